"""Uncertainty exponent: how the share of uncertain starts falls with the error of the start.

One start is drawn in each cell, so that starts of one row differ in one coordinate only.  f(e) is the share of those
that come to another basin than one of the two starts e away along an axis; f ~ e^a with the uncertainty exponent
a = d - D in d dimensions, D being the box-counting dimension of the boundary.  A straight boundary gives a = 1.  Where
a = 0.3 an error of the start that is ten times smaller halves the uncertain starts.

Source: Grebogi, McDonald, Ott, Yorke, "Final state sensitivity: an obstruction to predictability", Physics Letters A
99, 1983; "Fractal basin boundaries", Physica D 17, 1985.
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
from limitsets.maps import codes
from limitsets.resilience.colours import colours
from limitsets.resilience.orbits import STEPS, labelled_starts
from limitsets.sets import Attractor
from limitsets.tables import Column, Table, Tabled, how_found

__all__ = ["UncertaintyExponent", "uncertainty_exponent"]

# Distances in cells: two decades, cut off where there are fewer than four times as many cells along an axis.
FARTHEST, DISTANCES, PARTS = 100, 13, 4

# Fewer cells along an axis than this do not give one decade.
FEWEST = 40


@dataclass(frozen=True, eq=False)
class UncertaintyExponent(Tabled):
    """How uncertain starts become fewer.

    Attributes
    ----------
    exponent : float
        a, by least squares on the logarithms; nan where fewer than three distances have uncertain starts.
    error : float
        Its standard error, from how far the shares scatter about the line.
    apart : ndarray of int, shape (n,)
        Distances in cells.
    shares : ndarray, shape (n,)
        Share of uncertain starts: one of the starts so far away comes to another basin; mean over the axes.
    dimension : int
        Of the states: that of the boundary is `dimension` - `exponent`.
    undecided : float
        Share of the starts, by measure, that came nowhere: left out, with those that are compared with them.
    how : str
        "sampled": orbits of one start in each cell, followed until the basin of their cell is decided.
    """

    exponent: float
    error: float
    apart: NDArray[np.int64]
    shares: NDArray[np.float64]
    dimension: int
    undecided: float
    how: str = "sampled"

    @property
    def boundary_dimension(self) -> float:
        """Box-counting dimension of the boundary, d - a."""
        return self.dimension - self.exponent

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = list(zip(self.apart.tolist(), self.shares.tolist(), strict=True))
        caption = f"Uncertainty exponent {self.exponent:.4g} +- {self.error:.2g}"
        columns = (Column("apart", "cells"), Column("uncertain share", show=".6f"))
        return (Table(columns, rows, caption, how_found(self.how)),)

    def to_json(self) -> dict[str, Any]:
        """Give the exponent and what it was fitted to as JSON takes them."""
        return as_table(
            **picked(self, "exponent", "error", "boundary_dimension", "apart", "shares", "undecided", "how")
        )


@arguments_checked
def uncertainty_exponent(
    graph: TransitionGraph, found: tuple[Attractor, ...], *, steps: int = STEPS, seed: int = 0
) -> UncertaintyExponent:
    """Fit the exponent with which uncertain starts become fewer, over two decades from one cell up.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    steps : int
        An orbit is followed for so many steps at most.
    seed : int
        Of the start in each cell.

    Returns
    -------
    UncertaintyExponent
        Over less than two decades where the grid has fewer than 400 cells along an axis.

    Raises
    ------
    AnswerError
        For attractors of another graph, or fewer than 40 cells along an axis.

    Notes
    -----
    Grebogi, McDonald, Ott, Yorke, Physics Letters A 99, 1983.  On graded cells the distance is relative, as the cells.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=4000))
    >>> found = ls.resilience.uncertainty_exponent(graph, ls.attractors(graph, throws=100))
    >>> round(found.exponent, 2)  # one boundary point
    1.0
    """
    fewest = int(graph.grid.shape.min())
    if fewest < FEWEST:
        raise AnswerError(
            "the cells along an axis",
            fewest,
            f"{FEWEST} at least, 400 for two decades",
            "ask for finer cells",
        )
    label = labelled_starts(colours(graph, found), steps, np.random.default_rng(seed))
    farthest = min(FARTHEST, fewest // PARTS)
    apart = np.unique(np.rint(np.geomspace(1, farthest, DISTANCES)).astype(np.int64))
    shares = np.array([_uncertain(graph.grid, label, int(m)) for m in apart])
    weight = graph.grid.measure
    undecided = float(weight[label == codes.UNDECIDED].sum() / weight.sum())
    return UncertaintyExponent(*_fit(apart, shares), apart, shares, graph.grid.dimension, undecided)


def _uncertain(grid: Grid, label: NDArray[np.int64], apart: int) -> float:
    """Share of the starts whose label is not that of a start so many cells away, up or down an axis."""
    uncertain = total = 0.0
    for side in range(grid.sides):
        shape = tuple(int(n) for n in grid.shape[side])
        block, weight = (values[grid.of_side(side)].reshape(shape) for values in (label, grid.measure))
        for axis in range(grid.dimension):
            one, of = np.moveaxis(block, axis, 0), np.moveaxis(weight, axis, 0)
            differs, known = np.zeros(one.shape, dtype=bool), one != codes.UNDECIDED
            both = known[apart:] & known[:-apart]
            known[apart:] &= both
            known[:-apart] &= both
            other = one[apart:] != one[:-apart]
            differs[apart:] |= other
            differs[:-apart] |= other
            total += float(of[known].sum())
            uncertain += float(of[known & differs].sum())
    return uncertain / total if total else np.nan


def _fit(apart: NDArray[np.int64], shares: NDArray[np.float64]) -> tuple[float, float]:
    """Slope of the logarithms and its standard error."""
    some = shares > 0.0
    if some.sum() < 3:
        return np.nan, np.nan
    x, y = np.log(apart[some]), np.log(shares[some])
    x, y = x - x.mean(), y - y.mean()
    slope = float((x * y).sum() / (x * x).sum())
    return slope, float(np.sqrt(((y - slope * x) ** 2).sum() / (x.size - 2) / (x * x).sum()))
