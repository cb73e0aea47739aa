"""Basin entropy and boundary basin entropy.

The cells are grouped into boxes.  In a box that has the share p_j of its decided starts in basin j the entropy is
S = -sum p_j ln p_j; the basin entropy is its mean over all boxes, the boundary basin entropy that over the boxes with
two basins or more, both weighted by the boxes' measure.  A straight boundary parallel to a face that cuts boxes at
random places gives the mean of -p ln p - (1 - p) ln(1 - p) over 0 < p < 1, which is 1/2; two basins mixed below the
boxes give ln 2.

The bracket allots the undecided cells of each box in every way to the basins in which they may lie, orbits that stay
elsewhere being one basin more.  The entropy is concave in the p_j, so that it is least where they all go to one basin
(the largest of those), and largest where they fill up the smallest ones evenly.

Source: Daza, Wagemakers, Georgeot, Guery-Odelin, Sanjuan, "Basin entropy: a new tool to analyze uncertainty in
dynamical systems", Scientific Reports 6, 31416, 2016.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.arguments import arguments_checked
from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.files import as_table, picked
from limitsets.graph import TransitionGraph
from limitsets.resilience.colours import ROUNDING, colours
from limitsets.sets import Attractor
from limitsets.tables import Column, Table, Tabled, how_found

__all__ = ["BasinEntropy", "basin_entropy", "boundary_basin_entropy"]

Floats = NDArray[np.float64]

# Cells along each side of a box.
BOX = 20


@dataclass(frozen=True)
class BasinEntropy(Tabled):
    """Mean entropy of boxes [natural logarithm].

    Attributes
    ----------
    value : float
        Without the undecided cells, within the bracket; nan where there is no box to take the mean over.
    lo, hi : float
        Least and largest value for any allotment of the undecided cells.
    how : str
        "proved" where this bracket is; "cells" where images of cells are sampled.
    boxes : int
        Boxes that the value is the mean over.
    box : int
        Cells along each side of a box.
    undecided : float
        Share of undecided cells.
    """

    value: float
    lo: float
    hi: float
    how: str
    boxes: int
    box: int
    undecided: float

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
        return (Table(columns, [row], "Basin entropy, natural logarithm", how_found(self.how)),)

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        return as_table(**picked(self, "value", "lo", "hi", "how", "boxes", "box", "undecided"))


@dataclass(frozen=True, eq=False)
class _Boxes:
    """Per box: its measure, basins met for certain, entropies (nan where all is undecided), their bracket."""

    weight: Floats
    met: NDArray[np.int64]
    value: Floats
    lo: Floats
    hi: Floats
    how: str
    undecided: float


@arguments_checked
def basin_entropy(graph: TransitionGraph, found: tuple[Attractor, ...], *, box: int = BOX) -> BasinEntropy:
    """Mean uncertainty, over boxes of cells, of the basin in which a random start of the box lies.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`; with method "boxes" the bracket is proved.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    box : int
        Cells along each side of a box, as nearly as the grid allows.

    Returns
    -------
    BasinEntropy
        0 for one basin, at most the logarithm of their number.

    Raises
    ------
    AnswerError
        For attractors of another graph, or boxes of fewer than 2 cells or more than the grid has along an axis.

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
    each = _boxes(graph, found, box)
    some = np.isfinite(each.value)
    weight = each.weight / each.weight.sum()
    value = _mean(each.value[some], each.weight[some])
    lo, hi = float((each.lo * weight).sum()), float((each.hi * weight).sum())
    return _answer(each, value, lo, hi, int(some.sum()), box)


@arguments_checked
def boundary_basin_entropy(
    graph: TransitionGraph, found: tuple[Attractor, ...], *, box: int = BOX
) -> BasinEntropy:
    """Mean entropy of the boxes that meet two basins or more.

    Parameters
    ----------
    graph, found, box
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
    each = _boxes(graph, found, box)
    sure = each.met > 1
    maybe = ~sure & (each.hi > 0.0)
    value = _mean(each.value[sure], each.weight[sure])
    weight, least = float(each.weight[sure].sum()), float((each.lo * each.weight)[sure].sum())
    all_of_them = weight + float(each.weight[maybe].sum())
    lo = least / all_of_them if all_of_them else np.nan
    order = np.flatnonzero(maybe)[np.argsort(-each.hi[maybe])]
    sums = np.cumsum([(each.hi * each.weight)[sure].sum(), *(each.hi * each.weight)[order]])
    weights = np.cumsum([weight, *each.weight[order]])
    hi = float((sums[weights > 0.0] / weights[weights > 0.0]).max(initial=0.0)) if all_of_them else np.nan
    return _answer(each, value, lo, hi, int(sure.sum()), box)


def _answer(each: _Boxes, value: float, lo: float, hi: float, boxes: int, box: int) -> BasinEntropy:
    kept = float(np.clip(value, lo, hi))
    return BasinEntropy(kept, max(lo - ROUNDING, 0.0), hi + ROUNDING, each.how, boxes, box, each.undecided)


def _mean(values: Floats, weights: Floats) -> float:
    return float((values * weights).sum() / weights.sum()) if values.size else np.nan


def _boxes(graph: TransitionGraph, found: tuple[Attractor, ...], box: int) -> _Boxes:
    grid, most = graph.grid, int(graph.grid.shape.min())
    if not 2 <= box <= most:
        raise AnswerError("the cells along a box", box, f"an integer from 2 to {most}", "pass box=20")
    parted = colours(graph, found)
    weight = _gathered(grid, grid.measure, box)
    parts = [
        _gathered(grid, np.where(parted.labels == code, grid.measure, 0.0), box) for code in parted.codes
    ]
    mass = np.stack([*parts, np.zeros_like(weight)])  # last, elsewhere
    open_to, left = np.zeros(mass.shape, dtype=bool), np.zeros(grid.n_cells)
    for number, some in enumerate(parted.possible):
        left[:] = 0.0
        left[parted.undecided] = some
        open_to[number] = _gathered(grid, left, box) > 0.0
    left[:] = 0.0
    left[parted.undecided] = grid.measure[parted.undecided]
    rest = _gathered(grid, left, box)
    value = _entropy(mass)
    value[mass.sum(axis=0) == 0.0] = np.nan
    lo, hi = value.copy(), value.copy()
    some = rest > 0.0
    lo[some], hi[some] = (
        _least(mass[:, some], open_to[:, some], rest[some]),
        _largest(mass[:, some], open_to[:, some], rest[some]),
    )
    return _Boxes(
        weight, (mass > 0.0).sum(axis=0), value, lo, hi, parted.how, parted.basins.undecided_between
    )


def _gathered(grid: Grid, values: Floats, box: int) -> Floats:
    """Sum values of cells over boxes, side after side."""
    parts = []
    for side in range(grid.sides):
        shape = tuple(int(n) for n in grid.shape[side])
        block = values[grid.of_side(side)].reshape(shape)
        for axis, n in enumerate(shape):
            count = max(1, round(n / box))
            block = np.add.reduceat(block, np.arange(count) * n // count, axis=axis)
        parts.append(block.ravel())
    return np.concatenate(parts)


def _entropy(mass: Floats) -> Floats:
    """Entropy of each column."""
    with np.errstate(divide="ignore", invalid="ignore"):
        p = mass / mass.sum(axis=0)
        found: Floats = np.where(p > 0.0, -p * np.log(p), 0.0).sum(axis=0)
    return found


def _least(mass: Floats, open_to: NDArray[np.bool_], rest: Floats) -> Floats:
    """Give all that is left to the largest basin that may have it."""
    full = mass.copy()
    largest = np.where(open_to, mass, -1.0).argmax(axis=0)
    full[largest, np.arange(rest.size)] += rest
    return _entropy(full)


def _largest(mass: Floats, open_to: NDArray[np.bool_], rest: Floats) -> Floats:
    """Fill the smallest basins that may have some up to one level, as water would."""
    bars = np.sort(np.where(open_to, mass, np.inf), axis=0)
    number = np.arange(1, len(bars) + 1)[:, None]
    with np.errstate(invalid="ignore"):
        levels = (rest + np.cumsum(bars, axis=0)) / number
    wet = (bars < levels) & np.isfinite(levels)
    level = np.where(wet, levels, np.inf).min(axis=0)
    return _entropy(np.where(open_to, np.maximum(mass, level), mass))
