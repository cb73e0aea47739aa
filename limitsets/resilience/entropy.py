"""Basin entropy and boundary basin entropy.

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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.files import as_table, picked
from limitsets.graph import TransitionGraph
from limitsets.resilience.boxes import Boxes, counted_starts, of_cells, of_starts
from limitsets.resilience.colours import ROUNDING, best, colours, told
from limitsets.resilience.orbits import STEPS, leaves_by_the_border
from limitsets.sets import Attractor
from limitsets.tables import Column, Table, Tabled, how_found

Floats = NDArray[np.float64]

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
        caption = told("Basin entropy, natural logarithm", self.undecided, self.cut)
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
    return _measured(_of_all, graph, found, box, starts, steps, seed)


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
    return _measured(_of_boundary, graph, found, box, starts, steps, seed)


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
    found: tuple[Attractor, ...],
    box: int,
    starts: int | None,
    steps: int,
    seed: int,
) -> BasinEntropy:
    most = int(graph.grid.shape.min())
    if not 2 <= box <= most:
        raise AnswerError("the cells along a box", box, f"an integer from 2 to {most}", "pass box=20")
    parted, followed = colours(graph, found), None
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
    return BasinEntropy(kept, lo, hi, how, boxes, box, each.undecided, followed, cut)


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
