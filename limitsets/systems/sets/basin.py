"""Basins: the ends of the paths from each cell, and recurrent cells in which no orbit stays."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import compress, product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Column, Table, Tabled, arguments_checked, how_found
from limitsets.numbers.jit import kernel
from limitsets.systems.cells import Grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.components import reach
from limitsets.systems.graph.images.enclosed import BOTH, NOTHING, BoxImages
from limitsets.systems.graph.ranges import RUN, SIDE
from limitsets.systems.graph.target import goes_round, turned
from limitsets.systems.maps import codes, images
from limitsets.systems.sets.attracting import Attractor

# ----------------------------------------------------------------
# Recurrent sets of cells in which no orbit stays: cells that meet their own image because they are coarse.
#
# Such a set is refined by itself; where images are sampled in more than one dimension they are enlarged by a fine
# cell on every side.  If no fine cell is recurrent, every orbit passes through, and the cells that lead there can be
# decided without a finer grid.  Where the images are proved, the fine ones are too, for the same box of parameters.


# Parts of a cell along an axis, step by step: few sets need the finest ones.  A step ends the search that would take
# more fine cells than this.
PARTS, MOST_CELLS = (2, 4, 16, 64), 100_000

# More steps than there are fine cells: of an orbit that can come back to a cell.
ENDLESS = 1 << 40

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]


def passing(graph: TransitionGraph) -> NDArray[np.bool_]:
    """Tell the recurrent components that orbits pass through; proved where the images are.

    Returns
    -------
    ndarray of bool, shape (k,)
        For each of `graph.recurrent_components()`; an attracting one is none.
    """
    return _stays(graph) > 0


def longest_stays(graph: TransitionGraph) -> Integers:
    """Most steps that an orbit stays in each recurrent component that it passes through; 0 for the others."""
    stays, parts = _stays(graph), PARTS[-1]
    component = _components(graph, stays > 0)
    while np.count_nonzero(component >= 0) * parts**graph.grid.dimension > MOST_CELLS:
        parts //= 2
    return np.minimum(stays, _refined(graph, component, parts)) if parts > 1 else stays


def _stays(graph: TransitionGraph) -> Integers:
    """Bound the stays in components through which orbits are seen to pass, each by the first step that shows it."""
    left = ~graph.condensation().attracting
    stays = np.zeros(left.size, dtype=np.int64)
    for parts in PARTS:
        component = _components(graph, left)
        count = np.count_nonzero(component >= 0)
        if not count or count * parts**graph.grid.dimension > MOST_CELLS:
            break
        refined = _refined(graph, component, parts)
        stays += np.where(refined < ENDLESS, refined, 0)
        left &= stays == 0
    return stays


def _components(graph: TransitionGraph, chosen: NDArray[np.bool_]) -> Integers:
    """Recurrent component of each cell, -1 in all that are not chosen."""
    parts = graph.components()
    number = np.full(parts.count, -1)
    number[np.flatnonzero(parts.recurrent)[chosen]] = np.flatnonzero(chosen)
    return number[parts.label]


@kernel(entry=True, counting=False)
def _fill_longest(
    source: Any, target: Any, first: Any, after: Any, path: Any, done: Any, longest: Any
) -> None:
    """Cells on the longest path from each cell, ENDLESS where a path comes back: depth first, by an explicit stack.

    `first` (-1) and `after` become the lists of edges of each cell, `longest` is 0 until a cell is met.
    """
    for edge in range(source.size):
        after[edge] = first[source[edge]]
        first[source[edge]] = edge
    for root in range(longest.size):
        depth = 0 if longest[root] == 0 else -1
        path[0] = root
        while depth >= 0:
            cell = path[depth]
            longest[cell] = max(longest[cell], 1)
            edge = first[cell]
            if edge < 0:
                done[cell] = True
                depth -= 1
                continue
            to = target[edge]
            if longest[to] == 0:  # the edge stays in the list until the cell it leads to is done
                depth += 1
                path[depth] = to
                continue
            beyond = longest[to] + 1 if done[to] else ENDLESS
            longest[cell] = min(max(longest[cell], beyond), ENDLESS)
            first[cell] = after[edge]


@kernel(entry=True, counting=False)
def _link(
    box: Any,
    of: Any,
    first: Any,
    count: Any,
    axes: Any,
    shape: Any,
    offset: int,
    parts: int,
    component: Any,
    rank: Any,
    source: Any,
    target: Any,
) -> Any:
    """Fill the edges from fine cells to the fine cells of their own component that their boxes meet; how many."""
    made = 0
    each = parts ** len(axes)
    for k in range(box.size):
        total = 1
        for axis in range(len(axes)):
            total *= count[axis][k]
        for place in range(total):
            rest, coarse, within = place, 0, 0
            for axis in range(len(axes)):
                at = (first[axis][k] + rest % count[axis][k]) % (axes[axis].size * parts)
                rest //= count[axis][k]
                coarse = coarse * shape[axis] + axes[axis][at // parts]
                within = within * parts + at % parts
            coarse += offset
            if component[coarse] == of[k]:
                source[made] = box[k]
                target[made] = rank[coarse] * each + within
                made += 1
    return made


class _Axis(NamedTuple):
    """Fine cells along one axis of a side: their ends, and the cells they are parts of, those that are looked at.

    `bottom` and `period` are those of the axis; 0 is the period of one that does not close.
    """

    lower: Floats
    upper: Floats
    cells: Integers
    bottom: float
    period: float


def _refined(graph: TransitionGraph, component: Integers, parts: int) -> Integers:
    """Cut the cells of components: most steps that an orbit stays in each, 0 where a component has no cell here.

    They are ENDLESS where it may come back to a fine cell, and where the images do not tell.
    """
    grid, proved, cells = graph.grid, graph.method == "boxes", np.flatnonzero(component >= 0)
    rank = np.zeros(graph.n_cells, np.int64)
    rank[cells] = np.arange(cells.size)
    owners = np.repeat(component[cells], parts**grid.dimension)
    longest, begun, sources, targets = np.zeros_like(owners), 0, [rank[:0]], [rank[:0]]
    of_side = np.split(cells, np.searchsorted(cells, grid.offset[1 : grid.sides]))
    axes = [_axes(grid, here, side, parts) for side, here in enumerate(of_side)]
    for side, here in enumerate(of_side):
        if not here.size:
            continue
        sub = np.indices((parts,) * grid.dimension).reshape(grid.dimension, -1)
        place = [
            (np.searchsorted(axis.cells, at)[:, None] * parts + s).ravel()
            for axis, at, s in zip(axes[side], grid.axes(here, side), sub, strict=True)
        ]
        lo, hi = (
            tuple((axis.lower, axis.upper)[end][at] for axis, at in zip(axes[side], place, strict=True))
            for end in (0, 1)
        )
        boxes, clear = (_enclosed if proved else _hulls)(graph, lo, hi, side)
        longest[begun : begun + clear.size][~clear] = ENDLESS
        for least, most, to, given in boxes:
            for after in range(grid.sides):
                some = np.flatnonzero(given & (to == after))
                first, count = _met(axes[after], least, most, some, int(grid.dimension > 1 and not proved))
                source, target = np.empty((2, int(np.prod(count, axis=0).sum())), np.int64)
                among = tuple(axis.cells for axis in axes[after]), tuple(map(int, grid.shape[after]))
                where = *among, int(grid.offset[after]), parts, component, rank
                made = _link(begun + some, owners[begun + some], first, count, *where, source, target)
                sources.append(source[:made])
                targets.append(target[:made])
        begun += clear.size
    source, target = np.concatenate(sources), np.concatenate(targets)
    lists = np.full(owners.size, -1), np.empty_like(source), np.empty_like(owners)
    _fill_longest(source, target, *lists, longest > 0, longest)
    most = np.zeros(graph.condensation().attracting.size, dtype=np.int64)
    np.maximum.at(most, owners, longest)
    return most


def _axes(grid: Grid, here: Integers, side: int, parts: int) -> list[_Axis]:
    """Cut the axes of a side; in one dimension, where an axis is as long as the side, but for the cells looked at."""
    axes = []
    for k, edges in enumerate(grid.edges[side]):
        period = float(grid.domain.period[side, k])
        cells = here - grid.offset[side] if grid.dimension == 1 else np.arange(edges.size - 1)
        ends = edges[cells, None] + np.arange(parts + 1) / parts * (edges[cells + 1] - edges[cells])[:, None]
        ends[:, -1] = edges[cells + 1]
        axes.append(_Axis(ends[:, :-1].ravel(), ends[:, 1:].ravel(), cells, float(edges[0]), period))
    return axes


def _hulls(graph: TransitionGraph, lo: Any, hi: Any, side: int) -> tuple[list[Any], Any]:
    """Boxes around the images of the corners of fine cells, their sides, where they say; whether all corners agree."""
    corner_images = [
        images(graph.map, np.stack(corner, axis=1), side) for corner in product(*zip(lo, hi, strict=True))
    ]
    x, first = [there.x.reshape(-1, len(lo)) for there in corner_images], corner_images[0]
    least, most = np.minimum.reduce(x), np.maximum.reduce(x)
    clear = (first.code >= 0) & (np.isfinite(least) & np.isfinite(most)).all(axis=1)
    for there in corner_images[1:]:
        clear &= (there.code == first.code) & (there.side == first.side)
    return [(least, most, first.side, clear)], clear


def _enclosed(graph: TransitionGraph, lo: Any, hi: Any, side: int) -> tuple[list[Any], Any]:
    """Proved boxes of the images of fine cells, one or two each, their sides, where they are; whether one is proved."""
    enclosures = BoxImages(graph.map, graph.map if graph.upper is None else graph.upper, side, lo, hi)
    boxes = [
        (*(np.stack(corner, axis=1) for corner in enclosures.slots[slot]), enclosures.to[2 * slot], given)
        for slot, given in enumerate((enclosures.count != NOTHING, enclosures.count == BOTH))
    ]
    return boxes, enclosures.count != NOTHING


@kernel(entry=True, counting=False)
def _turn(bottom: float, period: float, lo: Any, hi: Any, laps: Any) -> None:
    """Turn the ends of intervals to an axis that closes; the turns from the first to the last, -1 for all of it."""
    for k in range(lo.size):
        if goes_round(lo[k], hi[k], bottom, period):
            laps[k] = -1
            continue
        begun, lo[k] = turned(lo[k], bottom, period, -1.0)
        ended, hi[k] = turned(hi[k], bottom, period, 1.0)
        laps[k] = np.int64(ended - begun)


def _met(axes: list[_Axis], lo: Floats, hi: Floats, some: Integers, pad: int) -> tuple[Any, Any]:
    """Fine cells of one side that some boxes meet, and so many more around: the first on each axis, and how many.

    Along an axis that closes they go on beyond the seam, at both ends.
    """
    first, count = [], []
    for k, axis in enumerate(axes):
        n, least, most, laps = axis.lower.size, lo[some, k], hi[some, k], np.zeros_like(some)
        if axis.period:
            _turn(axis.bottom, axis.period, least, most, laps)
        begin = np.searchsorted(axis.upper, least, side="left") - pad
        end = np.searchsorted(axis.lower, most, side="right") + pad
        if axis.period:
            begin, end = np.where(laps < 0, 0, begin), np.where(laps < 0, n, end + n * laps)
        else:
            begin, end = np.maximum(begin, 0), np.minimum(end, n)
        first.append(begin)
        count.append(np.clip(end - begin, 0, n))
    return tuple(first), tuple(count)


# ----------------------------------------------------------------
# Basins: the ends of the paths from each cell.


# A recurrent set of more cells is hardly one unstable cycle.
MOST_OF_A_CYCLE = 64


@dataclass(frozen=True, eq=False)
class Basins(Tabled):
    """Where the paths from each cell end.

    Attributes
    ----------
    grid : Grid
        The cells.
    labels : ndarray of int32, shape (n_cells,)
        0 and up: attractor of that number, on every path.  -1, -2, -3, -5: the exit of that code, on every path.
        -4: paths end in different places, or may stay in a recurrent set that is not closed: the cell is undecided.
    attractors : tuple of float
        Share of each attractor's basin, weighted by length (area, volume) over all sides.
    undecided_between : float
        Share of undecided cells.
    exits : dict of str to float
        Share of the cells all of whose paths leave by that exit.
    advice : str or None
        What to do about recurrent sets that are not closed, where there are any.
    how : str
        "proved" where the transitions are (method "boxes"), "cells" where the images of cells are sampled.
    """

    grid: Grid
    labels: NDArray[np.int32]
    attractors: tuple[float, ...]
    undecided_between: float
    exits: dict[str, float]
    advice: str | None = None
    how: str = "cells"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            *((f"attractor {k}", share) for k, share in enumerate(self.attractors)),
            *((f"leave: {name}", share) for name, share in self.exits.items()),
            ("undecided", self.undecided_between),
        ]
        return (Table(("where paths end", Column("share", show=".6f")), rows, "Basins", how_found(self.how)),)


@arguments_checked
def basins(graph: TransitionGraph, found: tuple[Attractor, ...]) -> Basins:
    """Label every cell with what all its paths end in.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.

    Returns
    -------
    Basins
        Labels and shares; undecided cells and each exit are states of their own.

    Raises
    ------
    AnswerError
        For attractors of another graph.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=100), method="corners")
    >>> ls.basins(graph, ls.attractors(graph)).attractors
    (0.49, 0.49)
    """
    attracting = graph.condensation().attracting
    if any(a.cells.grid is not graph.grid for a in found) or len(found) != int(attracting.sum()):
        raise AnswerError(
            "the attractors",
            f"{len(found)} of another graph",
            "those of this graph",
            "call attractors(graph)",
        )
    weight = graph.grid.measure
    total = float(weight.sum())
    sets, through = graph.recurrent_components(), passing(graph)
    labels = graph.condensation().destinations(through)
    lowest = min(codes.UNDECIDED, *graph.exits.values())
    share = np.bincount(labels - lowest, weights=weight, minlength=len(found) - lowest) / total
    by_code = {code: float(share[code - lowest]) for code in range(lowest, len(found))}
    return Basins(
        graph.grid,
        labels,
        tuple(by_code[k] for k in range(len(found))),
        undecided_between=by_code[codes.UNDECIDED],
        exits={name: by_code[code] for name, code in graph.exits.items()},
        advice=_advice(graph, list(compress(sets, ~(attracting | through)))),
        how=graph.how,
    )


def _advice(graph: TransitionGraph, lasting: list[NDArray[np.int32]]) -> str | None:
    """Say from how many starts a recurrent set that is not closed can be reached, and what to do."""
    if not lasting:
        return None
    share = _share_reaching(graph, np.concatenate(lasting))
    reached = f"from {100 * share:.3g} % of the starts a recurrent set that is not closed can be reached"
    spread = _spread_over_a_side(graph)
    if spread.size:
        jumps = (
            f"from {100 * _share_reaching(graph, spread):.3g} % a cell whose enclosed image is a whole side"
        )
        return (
            f"{reached}, {jumps}: the map jumps there "
            "within a branch (a floor), and finer cells decide few more starts; give it one branch before the jump and "
            "one after it (docs/own_map.md), or sample the images: limitsets.transitions(map, grid)"
        )
    if _left_by_rounding(graph):
        return (
            f"{reached}: enclosed images leave the domain, and no sampled one does: the map touches a border, over "
            "which rounding carries every enclosure, however fine the cells are; widen the domain beyond that border, "
            "move it to x = 0 (a product or quotient of numbers that are not negative never ends below 0), or sample "
            "the images: limitsets.transitions(map, grid)"
        )
    coarse = "an attractor in cells that are too coarse for it: they are undecided; ask for finer cells"
    if max(map(len, lasting)) <= MOST_OF_A_CYCLE:
        return f"{reached}, an unstable cycle or {coarse}"
    return (
        f"{reached}, a chaotic repeller or {coarse}; near a repeller they decide few more starts, sample the shares: "
        "limitsets.resilience.basin_stability(graph, found, starts=10000)"
    )


def _left_by_rounding(graph: TransitionGraph) -> bool:
    """Whether enclosed images leave the domain, and none of the corners and middles of their cells does."""
    cells, domain = np.flatnonzero(graph.ranges.exits), graph.grid.domain
    if graph.method != "boxes" or not cells.size:
        return False
    lo, hi, side = graph.grid.corners(cells)
    for s, share in product(np.unique(side).tolist(), (0.0, 0.5, 1.0)):
        starts = (lo + share * (hi - lo))[side == s]
        image = images(graph.map, starts if domain.dimension > 1 else starts[:, 0], s)
        x = domain.wrapped(image.x.reshape(starts.shape), image.side)
        if not ((domain.lo[image.side] <= x) & (x <= domain.hi[image.side])).all():
            return False
    return True


def _share_reaching(graph: TransitionGraph, cells: NDArray[np.integer]) -> float:
    """Share of the starts from which some of the cells can be reached."""
    marks = np.zeros(graph.n_cells, dtype=np.uint8)
    marks[cells] = 1
    weight = graph.grid.measure
    return float(weight[reach(graph.ranges, graph.components(), marks) > 0].sum() / weight.sum())


def _spread_over_a_side(graph: TransitionGraph) -> NDArray[np.integer]:
    """Cells on a line of which one enclosed image is a whole side."""
    if graph.method != "boxes" or graph.grid.dimension > 1:
        return np.zeros(0, dtype=np.int64)
    box, shape = graph.ranges.box, graph.grid.shape
    whole = box[:, RUN] == shape[box[:, SIDE], 0]
    return np.searchsorted(graph.ranges.first, np.flatnonzero(whole), side="right") - 1
