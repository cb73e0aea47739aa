"""The cells of a map in one to three coordinates: arrays, labels, and how they are shared among processes.

docs/certificates.md, "Certificates of any map": the arrays of a box, and the two rules that labels follow.
"""

import functools
import itertools
import math
import operator
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from flint import arb

from .any_map import Bound, CellClaim, Map, Shape, check_map_cell, period_of
from .balls import ZERO, Arb, Array, Pair, floats_around, prove
from .cells import CHUNK, Checked, of_box
from .file import Arrays, require
from .labels import Labelled, Way, box_max

MOST_CELLS_OF_MAP = 2**31


class MapCells(Labelled):
    """The arrays of one box of parameters; cells of all sides one after another, the last axis fastest.

    `exits`: whether there are cells from which orbits leave the domain; `weights`: whether cells have a weight.
    """

    def __init__(self, arrays: Arrays, prefix: str, shape: Shape, *, exits: bool, weights: bool):
        sides, d = range(shape.sides), shape.dimension
        self.periods = [[period_of(text) for text in axes] for axes in shape.periods]
        self.closed = [np.array([period is not None for period in axes]) for axes in self.periods]
        self.edges = [read_edges(arrays, f"{prefix}edges.{s}.", self.periods[s]) for s in sides]
        ascending = all(len(e) > 1 and bool((e[1:] > e[:-1]).all()) for axes in self.edges for e in axes)
        require(ascending, "the edges of the cells do not ascend")
        counts = [[len(e) - 1 for e in axes] for axes in self.edges]
        sizes = [math.prod(along) for along in counts]
        require(sum(sizes) <= MOST_CELLS_OF_MAP, "there are more than 2^31 cells")
        self.target = [arrays.read(f"{prefix}target.{b}", "<i4", 2 * d) for b in range(shape.branches)]
        self.rank, self.component = (arrays.read(prefix + name, "<i4") for name in ("rank", "component"))
        # without a claim of it no array of the file is read, and no cell has an exit
        self.exit = arrays.read(f"{prefix}exit", "<i4") if exits else np.minimum(self.rank, -1)
        self.weight = arrays.read(f"{prefix}weight", "<f8") if weights else np.zeros(len(self.rank))
        self.thin = (self.rank < 0) & weights  # the cells that starts thin out of
        labels = (self.rank, self.component, self.exit)
        alike = all(len(one) == sum(sizes) for one in (*self.target, *labels, self.weight))
        require(alike, "the arrays do not have one row for each cell")
        require(all(bool((one >= -1).all()) for one in labels), "a rank, a component or an exit is below -1")
        self.counts = np.array(counts, dtype=np.int64)
        self.start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)  # the first cell of each side
        self.to = [[shape.to[s, b] for s in sides] for b in range(shape.branches)]
        self.require_targets()

    def require_targets(self) -> None:
        """Require that targets are cells; with an exit or a weight they may lie beyond the grid too, as -1 and n."""
        beyond = (((self.exit >= 0) & (self.rank < 0)) | self.thin).astype(np.int64)
        for b, target in enumerate(self.target):
            for s, to in enumerate(self.to[b]):
                cells = slice(int(self.start[s]), int(self.start[s + 1]))
                (first, last), far = np.hsplit(target[cells], 2), beyond[cells, None]
                fits = (first >= -far) & (first <= last) & (last < self.counts[to] + far)
                # along an axis that closes cells are counted on beyond the seam, none twice
                round_it = (
                    (first >= 0)
                    & (first < self.counts[to])
                    & (first <= last)
                    & (last - first < self.counts[to])
                )
                fits = np.where(self.closed[to], round_it, fits)
                sound = bool((fits.all(axis=1) | (target[cells] == -2).all(axis=1)).all())
                require(sound, f"side {s}, branch {b}: target cells are out of range")

    def checked(self, final: Array) -> Array:
        """Mark the cells whose images are checked."""
        return ((self.rank >= 0) & ~final) | (self.exit >= 0) | self.thin

    def thin_may_leave(self) -> bool:
        """Whether targets of cells that starts thin out of lie beyond the grid, on a line."""
        own = [slice(*ends) for ends in itertools.pairwise(self.start.tolist())]
        return any(
            bool(((rows == -1) | (rows == self.counts[to[s], 0])).any())
            for target, to in zip(self.target, self.to, strict=True)
            for s, rows in enumerate(target[cells][self.thin[cells]] for cells in own)
        )

    def ends(self, cells: Array, side: int) -> Array:
        """Return the ends of some cells of a side: lower, upper along each axis in turn."""
        at = np.unravel_index(cells - self.start[side], tuple(self.counts[side]))
        columns = [e[k + shift] for e, k in zip(self.edges[side], at, strict=True) for shift in (0, 1)]
        return np.stack(columns, axis=1)

    def boxes(self, chosen: Array, side: int) -> Array:
        """Return the ends of the chosen cells of a side (n, axes, 2); `chosen` is by cell."""
        own = self.start[side] + np.flatnonzero(chosen[self.start[side] : self.start[side + 1]])
        return self.ends(own, side).reshape(len(own), len(self.edges[side]), 2)

    def box(self, cell: int) -> tuple[int, list[Pair]]:
        """Return side and ends of one cell."""
        side = int(self.side_of(np.array([cell]))[0])
        ends = self.ends(np.array([cell]), side)[0].tolist()
        return side, list(zip(ends[::2], ends[1::2], strict=True))

    def name(self, cell: int) -> str:
        """Name a cell, for people."""
        side, box = self.box(cell)
        return f"side {side}, cell {cell}, x in {' x '.join(f'[{lo!r}, {hi!r}]' for lo, hi in box)}"

    def first_edges(self) -> list[list[float | None]]:
        """Return by side and axis where the cells begin, None along axes that end."""
        sides = zip(self.edges, self.closed, strict=True)
        return [[float(e[0]) if closed else None for e, closed in zip(*axes, strict=True)] for axes in sides]

    def meets_seam(self, side: int, box: list[Pair]) -> bool:
        """Whether a box may hold a state beyond the seam of an axis, whose cell is another, and not all of the axis."""
        axes = zip(self.edges[side], self.periods[side], box, strict=True)
        return any(
            period is not None and lo > e[0] and not arb(hi) < arb(e[0]) + period
            for e, period, (lo, hi) in axes
        )

    def in_domain(self, side: int, box: list[Pair]) -> bool:
        """Whether a box lies in the domain."""
        return all(e[0] <= lo and hi <= e[-1] for e, (lo, hi) in zip(self.edges[side], box, strict=True))

    def ways(self) -> list[Way]:
        """Return the branches."""
        branches = enumerate(self.target)
        return [Way(f"branch {b}", to[:, 0] != -2, functools.partial(self.extremes, b)) for b, to in branches]

    def extremes(self, branch: int, labels: Array, cells: Array) -> tuple[Array, Array]:
        """Return the least and the largest label among the target cells of each of some cells.

        The branch is possible from these cells.  Where all targets lie beyond the grid the two are 0 and -1, which hold
        no label back.
        """
        least, most, side = np.zeros(len(cells), np.int64), np.full(len(cells), -1), self.side_of(cells)
        for s in np.unique(side).tolist():
            to, own = self.to[branch][s], np.flatnonzero(side == s)
            table = labels[self.start[to] : self.start[to + 1]].reshape(tuple(self.counts[to]))
            first, last = np.hsplit(self.target[branch][cells[own]].astype(np.int64), 2)
            for axis in np.flatnonzero(self.closed[to]).tolist():
                table = np.concatenate([table, table], axis=axis)  # cells are counted on beyond the seam
            first, last = np.maximum(first, 0), np.minimum(last, np.array(table.shape) - 1)
            met = (first <= last).all(axis=1)
            least[own[met]] = -box_max(-table, first[met], last[met])
            most[own[met]] = box_max(table, first[met], last[met])
        return least, most

    def check_labels(self, final: Array) -> None:
        """Check the two rules by whole numbers, off the final cells.

        Every target of an attracting cell is of its component; of every other cell with a rank it has a smaller one.
        """
        attracting, checked = self.component >= 0, (self.rank >= 0) & ~final
        self.prove_all(~attracting | (self.rank == 0), "it has a component, and a rank that is not 0")
        self.check_components(checked & attracting)
        self.check_falling("rank", self.rank, checked & ~attracting)

    def check_exits(self) -> None:
        """Check that the exit falls along every target inside the domain."""
        has_exit = self.exit >= 0
        prove(bool(has_exit.any()), "no cell has an exit")
        self.check_falling("exit", self.exit, has_exit)


# ----------------------------------------------------------------
# Cells for the processes that share the work.


class MapTask(NamedTuple):
    """Some cells of one side, one row for each."""

    box: int  # of parameters
    side: int
    cells: Array
    ends: Array  # (n, 2 d)
    targets: list[Array]  # by branch (n, 2 d): their ends, nan where the branch is impossible
    strict: list[Array]  # by branch: whether the image has to lie strictly inside
    least: Array  # the size that the slope has to have, 0 where none is claimed


def map_tasks(c: MapCells, box: int, chosen: Array, strict: Array, least: Array) -> Iterator[MapTask]:
    """Cut the chosen cells, which ascend, into tasks of one side each; `strict` and `least` are by cell of the box."""
    side = c.side_of(chosen)
    for s in np.unique(side).tolist():
        own = chosen[side == s]
        for part in np.array_split(own, max(1, -(-len(own) // CHUNK))):
            to = [c.to[b][s] for b in range(len(c.target))]
            both = [
                ends_of_targets(c.edges[t], target[part], c.closed[t])
                for t, target in zip(to, c.target, strict=True)
            ]
            targets, alone = [ends for ends, _ in both], [strict[part] | beyond for _, beyond in both]
            yield MapTask(box, s, part, c.ends(part, s), targets=targets, strict=alone, least=least[part])


def read_edges(arrays: Arrays, prefix: str, periods: list[Arb | None]) -> list[Array]:
    """Read the edges of the cells of a side, along each axis."""
    return [closed_axis(arrays.read(f"{prefix}{a}", "<f8"), period) for a, period in enumerate(periods)]


def closed_axis(edges: Array, period: Arb | None) -> Array:
    """Return the edges of an axis; of one with a period also the end of its last cell, rounded up."""
    if period is None or not len(edges) or not math.isfinite(edges[0]):
        return edges
    end = arb(float(edges[0])) + period
    require(bool(arb(float(edges[-1])) < end), "the last edge is not before the first and the period")
    last = float(end.upper())
    return np.append(edges, last if arb(last) >= end else floats_around(end)[1])


def ends_of_targets(edges: list[Array], rows: Array, closed: Array) -> tuple[Array, Array]:
    """Return the ends of target cells, nan where the branch is impossible; and whether an image is beyond the grid.

    It is where along an axis all targets are; then it has to be so strictly, since the last edge belongs to the domain,
    and the other axes do not matter.  Where a part of them is beyond the grid there is no end.  Along axes that are
    closed there is none where they are the whole axis, and an upper end that is not above the lower one is that of the
    next turn.
    """
    (first, last), n = np.hsplit(rows, 2), np.array([len(e) - 1 for e in edges])
    alone = ((last == -1) | (first == n)) & ~closed
    beyond = alone.any(axis=1)
    free = (beyond[:, None] & ~alone) | (closed & (last - first == n - 1))
    until = np.where(closed, (last + 1) % n, np.clip(last + 1, 0, n))
    lower = np.stack([e[np.maximum(k, 0)] for e, k in zip(edges, first.T, strict=True)], axis=1)
    upper = np.stack([e[k] for e, k in zip(edges, until.T, strict=True)], axis=1)
    lower[free | (first < 0)], upper[free | (~closed & (last == n))] = -math.inf, math.inf
    ends = np.stack([lower, upper], axis=2).reshape(len(rows), -1)
    ends[rows[:, 0] == -2] = math.nan
    return ends, beyond


def map_of_box(box: int, shape: Shape, parameters: list[dict[str, tuple[str, str]]]) -> Map:
    """Return the map of a box of parameters."""
    return Map(shape, parameters[box])


def check_map_task(task: MapTask) -> Checked:
    """Check the cells of a task."""
    the_map: Map = of_box(task.box)
    total = 0
    for i, cell in enumerate(task.cells.tolist()):
        ends, least = task.ends[i].tolist(), float(task.least[i])
        pairs = zip(task.targets, task.strict, strict=True)
        bounds = [bounds_of(target[i].tolist(), bool(strict[i])) for target, strict in pairs]
        box = list(zip(ends[::2], ends[1::2], strict=True))
        if the_map.shape.closes:
            bounds = [turned(the_map, (task.side, b), box, each) for b, each in enumerate(bounds)]
        claimed = CellClaim(task.side, box, bounds, arb(least) if least > 0 else None)
        failure, pieces = check_map_cell(the_map, claimed)
        total += pieces
        if failure is not None:
            return cell, failure, total
    return -1, None, total


def turned(
    the_map: Map, key: tuple[int, int], box: list[Pair], bounds: list[Bound] | None
) -> list[Bound] | None:
    """Turn bounds along axes that close to where an image is: any whole number of periods is as good.

    The image has to lie strictly before the upper end: on the seam it is a state of the first cell alone, since there
    the formulas are evaluated at the lower end of the domain.
    """
    shape = the_map.shape
    if bounds is None:
        return None
    near = the_map.image[key].at([ball.mid() for ball in the_map.piece(box).balls])
    shifted, d = [], shape.dimension
    for (axis, above, low), (_, below, high) in zip(bounds[:d], bounds[d:], strict=True):
        period = the_map.periods[shape.to[key]][axis]
        if period is not None and low.is_finite():
            turns = ((near[axis] - low) / period).mid().floor() if near[axis].is_finite() else ZERO
            high = high + period if high <= low else high
            low, high, below = low + turns * period, high + turns * period, operator.lt
        shifted += [(axis, above, low), (axis, below, high)]
    return shifted


def bounds_of(ends: list[float], strict: bool) -> list[Bound] | None:
    """Return what proves that an image lies in its target cells; None where the branch is impossible."""
    if math.isnan(ends[0]):
        return None
    above, below = (operator.gt, operator.lt) if strict else (operator.ge, operator.le)
    lower = [(a, above, arb(end)) for a, end in enumerate(ends[::2])]
    return lower + [(a, below, arb(end)) for a, end in enumerate(ends[1::2])]
