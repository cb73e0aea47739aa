"""Basin entropy and boundary basin entropy, from boxes of cells.

The cells are grouped into boxes.  In a box that has the share p_j of its decided starts in basin j the entropy is
S = -sum p_j ln p_j; the basin entropy is its mean over all boxes, the boundary basin entropy that over the boxes with
two basins or more, both weighted by the boxes' measure.  A straight boundary parallel to a face that cuts boxes at
random places gives the mean of -p ln p - (1 - p) ln(1 - p) over 0 < p < 1, which is 1/2; two basins mixed below the
boxes give ln 2.

The bracket allots the undecided cells of each box in every way to the basins in which they may lie, orbits that stay
elsewhere being one basin more.  The entropy is concave in the p_j, so that it is least where they all go to one basin
(the largest of those), and largest where they fill up the smallest ones evenly.

Starts that are asked for form a lattice in each box.  So few of them see a box as less mixed than it is: of the mixed
ones by 1/2N for N independent starts.  Their bracket adds what half as many along each axis see less (or more, of the
boundary), and two standard errors of shares that as many starts have as lie along one axis, for the starts of a row may
all lie on one side of a boundary.

Source: Daza, Wagemakers, Georgeot, Guery-Odelin, Sanjuan, "Basin entropy: a new tool to analyze uncertainty in
dynamical systems", Scientific Reports 6, 31416, 2016.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Column, Table, Tabled, arguments_checked, as_table, how_found, picked
from limitsets.systems.cells import Grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.maps import codes
from limitsets.systems.resilience.orbits import (
    ROUNDING,
    STEPS,
    Colours,
    Floats,
    best,
    colours,
    full_caption,
    labelled_lattice,
    leaves_by_the_border,
)
from limitsets.systems.sets import Attractor

# ----------------------------------------------------------------
# Boxes of cells: how much of each basin they hold, by cells or by starts, and the bracket of their entropy.
#
# What is undecided in a box is allotted in every way to the basins in which it may lie.


# Fewest starts along each axis of a box: every second of them gives two.
ALONG = 4


@dataclass(frozen=True, eq=False)
class Boxes:
    """Per box: its measure, basins met for certain, entropies (nan where all is undecided), their bracket."""

    weight: Floats
    met: NDArray[np.int64]
    value: Floats
    lo: Floats
    hi: Floats
    undecided: float


def of_cells(parted: Colours, box: int) -> Boxes:
    """Measure the cells of each basin in each box."""
    grid = parted.grid
    parts = [
        _gathered(grid, np.where(parted.labels == code, grid.measure, 0.0), box) for code in parted.codes
    ]
    mass = np.stack([*parts, np.zeros_like(parts[0])])  # last, elsewhere
    open_to, left = np.zeros(mass.shape, dtype=bool), np.zeros(grid.n_cells)
    for number, some in enumerate(parted.possible):
        left[:] = 0.0
        left[parted.undecided] = some
        open_to[number] = _gathered(grid, left, box) > 0.0
    left[:] = 0.0
    left[parted.undecided] = grid.measure[parted.undecided]
    weight, rest = _gathered(grid, grid.measure, box), _gathered(grid, left, box)
    return _bracketed(weight, mass, open_to, rest, parted.basins.undecided_between)


def counted_starts(parted: Colours, box: int, starts: int, steps: int, seed: int) -> tuple[list[Floats], int]:
    """Count the starts of each basin in each box, undecided last; of all, then of every second along each axis."""
    grid, rng = parted.grid, np.random.default_rng(seed)
    begins = [
        [np.append(_begins(int(n), box), int(n)) for n in grid.shape[side]] for side in range(grid.sides)
    ]
    boxes = sum(int(np.prod([begin.size - 1 for begin in axes])) for axes in begins)
    each = int((starts / boxes) ** (1.0 / grid.dimension) + 1e-9)
    if each < ALONG:
        fewest = boxes * ALONG**grid.dimension
        raise AnswerError(
            "the number of starts",
            starts,
            f"an integer from {fewest}, {ALONG} along each axis of {boxes} boxes",
            f"pass starts={fewest}, or larger boxes",
        )
    label = np.concatenate(
        [labelled_lattice(parted, side, axes, each, steps, rng) for side, axes in enumerate(begins)]
    )
    phases = product(range(2), repeat=grid.dimension)
    every_second = (label[(slice(None), *(slice(first, None, 2) for first in phase))] for phase in phases)
    counts = []
    for some in (label, *every_second):
        flat = some.reshape(boxes, -1)
        counts.append(np.stack([(flat == code).sum(axis=1) for code in (*parted.codes, codes.UNDECIDED)]))
    return [count.astype(np.float64) for count in counts], each


def of_starts(parted: Colours, box: int, counts: Floats) -> Boxes:
    """Take counts of starts in each box for the shares of basins."""
    weight = _gathered(parted.grid, parted.grid.measure, box)
    mass, rest = np.vstack([counts[:-1], np.zeros_like(counts[-1:])]), counts[-1]
    open_to = np.ones(mass.shape, dtype=bool)
    undecided = float((rest / counts.sum(axis=0) * weight).sum() / weight.sum())
    return _bracketed(weight, mass, open_to, rest, undecided)


def _bracketed(
    weight: Floats, mass: Floats, open_to: NDArray[np.bool_], rest: Floats, undecided: float
) -> Boxes:
    value = entropy_of(mass)
    value[mass.sum(axis=0) == 0.0] = np.nan
    lo, hi = value.copy(), value.copy()
    some = rest > 0.0
    lo[some], hi[some] = (
        least_entropy(mass[:, some], open_to[:, some], rest[some]),
        largest_entropy(mass[:, some], open_to[:, some], rest[some]),
    )
    return Boxes(weight, (mass > 0.0).sum(axis=0), value, lo, hi, undecided)


def _begins(cells: int, box: int) -> NDArray[np.int64]:
    """Cells along an axis in which boxes begin."""
    count = max(1, round(cells / box))
    return np.arange(count) * cells // count


def _gathered(grid: Grid, values: Floats, box: int) -> Floats:
    """Sum values of cells over boxes, side after side."""
    parts = []
    for side in range(grid.sides):
        block = grid.block(values, side)
        for axis, n in enumerate(block.shape):
            block = np.add.reduceat(block, _begins(n, box), axis=axis)
        parts.append(block.ravel())
    return np.concatenate(parts)


def entropy_of(mass: Floats) -> Floats:
    """Entropy of each column."""
    with np.errstate(divide="ignore", invalid="ignore"):
        p = mass / mass.sum(axis=0)
        return np.asarray(np.where(p > 0.0, -p * np.log(p), 0.0).sum(axis=0))


def least_entropy(mass: Floats, open_to: NDArray[np.bool_], rest: Floats) -> Floats:
    """Give all that is left to the largest basin that may have it."""
    full = mass.copy()
    largest = np.where(open_to, mass, -1.0).argmax(axis=0)
    full[largest, np.arange(rest.size)] += rest
    return entropy_of(full)


def largest_entropy(mass: Floats, open_to: NDArray[np.bool_], rest: Floats) -> Floats:
    """Fill the smallest basins that may have some up to one level, as water would."""
    bars = np.sort(np.where(open_to, mass, np.inf), axis=0)
    number = np.arange(1, len(bars) + 1)[:, None]
    with np.errstate(invalid="ignore"):
        levels = (rest + np.cumsum(bars, axis=0)) / number
    wet = (bars < levels) & np.isfinite(levels)
    level = np.where(wet, levels, np.inf).min(axis=0)
    return entropy_of(np.where(open_to, np.maximum(mass, level), mass))


# ----------------------------------------------------------------
# Basin entropy and boundary basin entropy.


# Cells along each side of a box.
BOX = 20


@dataclass(frozen=True)
class BasinEntropy(Tabled):
    """Mean entropy of boxes [natural logarithm].

    Attributes
    ----------
    value : float
        Without what is undecided, within the bracket; nan where there is no box to take the mean over, and where more
        than a tenth is undecided.  Of starts: as they are, so that finer ones give slightly more.
    lo, hi : float
        Least and largest value for any allotment of the undecided cells, or starts; of starts so wide that it holds
        the value of infinitely many.
    how : str
        "proved" where this bracket is; "cells" where images of cells are sampled; "sampled" from starts.
    boxes : int
        Boxes that the value is the mean over.
    box : int
        Cells along each side of a box.
    undecided : float
        Share of undecided cells, or starts.
    starts : int or None
        Starts that were followed, if any.
    cut : bool
        Whether orbits that cross the border of the domain were given up there, in the exit: with `starts` they may
        come back.
    """

    value: float
    lo: float
    hi: float
    how: str
    boxes: int
    box: int
    undecided: float
    starts: int | None = None
    cut: bool = False

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        row = (self.value, (self.lo, self.hi), self.boxes, self.box, self.undecided)
        columns = (
            Column("basin entropy", show=".6f"),
            Column("bracket", show=".6f", ends=True),
            "boxes",
            "cells along a box",
            Column("undecided share", show=".4f"),
        )
        caption = full_caption("Basin entropy, natural logarithm", self.undecided, self.cut)
        return (Table(columns, [row], caption, how_found(self.how)),)

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        return as_table(
            **picked(self, "value", "lo", "hi", "how", "boxes", "box", "undecided", "starts", "cut")
        )


@arguments_checked
def basin_entropy(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    *,
    box: int = BOX,
    starts: int | None = None,
    steps: int = STEPS,
    seed: int = 0,
) -> BasinEntropy:
    """Mean uncertainty, over boxes of cells, of the basin in which a random start of the box lies.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`; with method "boxes" the bracket is proved.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    box : int
        Cells along each side of a box, as nearly as the grid allows.
    starts : int, optional
        Follow so many starts, or a few less, as many in each box, instead of counting cells.  Their orbits may leave
        the domain and come back.
    steps : int
        Each is followed for so many steps at most.
    seed : int
        Of the starts.

    Returns
    -------
    BasinEntropy
        0 for one basin, at most the logarithm of their number.

    Raises
    ------
    AnswerError
        For attractors of another graph, boxes of fewer than 2 cells or more than the grid has along an axis, or fewer
        starts than 4 along each axis of each box.

    Notes
    -----
    Daza et al., Scientific Reports 6, 31416, 2016.  It depends on the size of the boxes: compare at the same size.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=1000), "boxes")
    >>> found = ls.resilience.basin_entropy(graph, ls.attractors(graph, throws=100), box=8)
    >>> found.how, found.lo <= found.value <= found.hi, round(found.value * 125, 2)  # ln 2 in one of 125 boxes
    ('proved', True, 0.69)
    """
    return _measured(_of_all, graph, found, box=box, starts=starts, steps=steps, seed=seed)


@arguments_checked
def boundary_basin_entropy(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    *,
    box: int = BOX,
    starts: int | None = None,
    steps: int = STEPS,
    seed: int = 0,
) -> BasinEntropy:
    """Mean entropy of the boxes that meet two basins or more.

    Parameters
    ----------
    graph, found, box, starts, steps, seed
        As for `basin_entropy`.

    Returns
    -------
    BasinEntropy
        1/2 for straight boundaries parallel to a face, at random places; ln 2 for two basins mixed below the boxes.
        Above ln 2 the boundary is fractal; below it nothing is said.

    Raises
    ------
    AnswerError
        As `basin_entropy`.

    Notes
    -----
    Daza et al., Scientific Reports 6, 31416, 2016.  Which boxes count is open itself where cells are undecided: its
    bracket counts those that may meet a second basin in, or not, whichever is farther.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=1000))
    >>> found = ls.resilience.boundary_basin_entropy(graph, ls.attractors(graph, throws=100), box=8)
    >>> found.boxes, round(found.value, 2)  # 0 lies in the middle of a box: ln 2
    (1, 0.69)
    """
    return _measured(_of_boundary, graph, found, box=box, starts=starts, steps=steps, seed=seed)


def _of_all(each: Boxes) -> tuple[Floats, float, float, float]:
    """Weights of the boxes that count, the mean over them, its bracket."""
    weight = np.where(np.isfinite(each.value), each.weight, 0.0)
    total = each.weight.sum()
    lo, hi = (float((ends * each.weight).sum() / total) for ends in (each.lo, each.hi))
    return weight, _mean(each.value, weight), lo, hi


def _of_boundary(each: Boxes) -> tuple[Floats, float, float, float]:
    """Weights of the boxes that meet two basins, the mean over them, its bracket."""
    sure = each.met > 1
    maybe = ~sure & (each.hi > 0.0)
    value = _mean(each.value, np.where(sure, each.weight, 0.0))
    weight, least = float(each.weight[sure].sum()), float((each.lo * each.weight)[sure].sum())
    all_of_them = weight + float(each.weight[maybe].sum())
    lo = least / all_of_them if all_of_them else np.nan
    order = np.flatnonzero(maybe)[np.argsort(-each.hi[maybe])]
    sums = np.cumsum([(each.hi * each.weight)[sure].sum(), *(each.hi * each.weight)[order]])
    weights = np.cumsum([weight, *each.weight[order]])
    hi = float((sums[weights > 0.0] / weights[weights > 0.0]).max(initial=0.0)) if all_of_them else np.nan
    return np.where(sure, each.weight, 0.0), value, lo, hi


def _measured(
    measure: Callable[[Boxes], tuple[Floats, float, float, float]],
    graph: TransitionGraph,
    attractors: tuple[Attractor, ...],
    box: int,
    starts: int | None,
    steps: int,
    seed: int,
) -> BasinEntropy:
    most = int(graph.grid.shape.min())
    if not 2 <= box <= most:
        raise AnswerError("the cells along a box", box, f"an integer from 2 to {most}", "pass box=20")
    parted, followed = colours(graph, attractors), None
    if starts is None:
        each = of_cells(parted, box)
        weight, value, lo, hi = measure(each)
    else:
        mass, size = counted_starts(parted, box, starts, steps, seed)
        followed = mass[0].shape[1] * size**graph.grid.dimension
        each = of_starts(parted, box, mass[0])
        weight, value, lo, hi = measure(each)
        coarse = [measure(of_starts(parted, box, some)) for some in mass[1:]]
        gap = value - float(np.mean([np.nan_to_num(each_value) for _, each_value, *_ in coarse]))
        spread = 2.0 * _deviation(mass[0], weight) / np.sqrt(size)
        # boxes that half the starts do not see to count: as many again, and two deviations more, may count unseen
        counted = (weight > 0.0).sum()
        late = max(counted - np.mean([(some > 0.0).sum() for some, *_ in coarse]), 0.0)
        unseen = min(late + 2.0 * np.sqrt(late + 1.0), weight.size - counted)
        lo = (lo - max(-gap, 0.0) - spread) * counted / max(counted + unseen, 1.0)
        hi += max(gap, 0.0) + spread
    cut = starts is None and leaves_by_the_border(graph)
    kept, boxes = best(float(np.clip(value, lo, hi)), each.undecided), int((weight > 0.0).sum())
    how = parted.how if starts is None else "sampled"
    lo, hi = max(lo - ROUNDING, 0.0), hi + ROUNDING
    return BasinEntropy(
        kept, lo, hi, how=how, boxes=boxes, box=box, undecided=each.undecided, starts=followed, cut=cut
    )


def _mean(values: Floats, weights: Floats) -> float:
    some = weights > 0.0
    return float((values * weights)[some].sum() / weights.sum()) if some.any() else np.nan


def _deviation(counts: Floats, weight: Floats) -> float:
    """Give the standard deviation of the mean over boxes, of one start in each."""
    decided = counts[:-1]
    with np.errstate(divide="ignore", invalid="ignore"):
        p = decided / decided.sum(axis=0)
        word = np.where(p > 0.0, -np.log(p), 0.0)
        variance = (p * word**2).sum(axis=0) - (p * word).sum(axis=0) ** 2
    total = weight.sum()
    return float(np.sqrt(np.nansum(weight**2 * variance)) / total) if total else 0.0
