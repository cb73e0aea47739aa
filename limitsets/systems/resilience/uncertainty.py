"""Uncertainty exponent: how the share of uncertain starts falls with the error of the start.

f(e) is the share of the starts that come to another basin than one of the two starts e away along an axis; f ~ e^a with
the uncertainty exponent a = d - D in d dimensions, D being the box-counting dimension of the boundary.  A straight
boundary gives a = 1.  Where a = 0.3 an error of the start that is ten times smaller halves the uncertain starts.

One start is drawn in each cell, so that starts of one row differ in one coordinate only, and compared over whole
cells; or as many random starts as are asked for, with neighbours as near as a ten thousandth of a cell.  Far apart, f
no longer grows: three independent starts differ with the probability 1 - sum p_j^3, p_j being the shares of the basins.
The fit takes the distances at which f is at most half of this along each axis: of a boundary parallel to one axis only
the others tell.  Its error holds the difference between the
slopes of their nearer and farther half, since the range is a choice.

Source: Grebogi, McDonald, Ott, Yorke, "Final state sensitivity: an obstruction to predictability", Physics Letters A
99, 1983; "Fractal basin boundaries", Physica D 17, 1985.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base.arguments import arguments_checked
from limitsets.base.errors import AnswerError
from limitsets.base.files import as_table, picked
from limitsets.base.tables import Column, Table, Tabled, how_found
from limitsets.systems.cells import Grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.maps import codes
from limitsets.systems.resilience.orbits import (
    STEPS,
    Colours,
    best,
    colours,
    follow,
    full_caption,
    labelled_starts,
    leaves_by_the_border,
    random_cells,
)
from limitsets.systems.sets import Attractor

# Distances in cells: two decades, cut off where there are fewer than four times as many cells along an axis.
FARTHEST, DISTANCES, PARTS = 100, 13, 4

# Of random starts: down to this part of a cell, so many in a decade; fewer uncertain starts tell no share.
NEAREST, IN_A_DECADE, FEWEST_UNCERTAIN = 1e-4, 4, 20

# The fit takes shares up to this part of that of independent starts, at so many distances at least.
UNSATURATED, FEWEST_FITTED = 0.5, 4

Floats = NDArray[np.float64]

# Fewer cells along an axis than this do not give one decade.
FEWEST = 40


@dataclass(frozen=True, eq=False)
class UncertaintyExponent(Tabled):
    """How uncertain starts become fewer.

    Attributes
    ----------
    exponent : float
        a, by least squares on the logarithms; nan where fewer than four distances have uncertain starts and a share
        that still grows, and where more than a tenth of the starts is undecided.
    error : float
        The exponent lies within plus or minus this in nineteen of twenty cases: from how far the shares scatter about
        the line, and from the choice of the range.
    apart : ndarray, shape (n,)
        Distances in cells.
    shares : ndarray, shape (n,)
        Share of uncertain starts: one of the starts so far away comes to another basin; mean over the axes.
    fitted : ndarray of bool, shape (n,)
        The distances that the exponent is fitted to: the share is positive and does not saturate.
    dimension : int
        Of the states: that of the boundary is `dimension` - `exponent`.
    undecided : float
        Share of the starts, by measure, that came nowhere: left out, with those that are compared with them.
    starts : int or None
        Random starts, if any.
    cut : bool
        Whether orbits that cross the border of the domain were given up there, in the exit: with `starts` they may
        come back.
    how : str
        "sampled": orbits of one start in each cell, followed until the basin of their cell is decided; or of random
        starts.
    """

    exponent: float
    error: float
    apart: Floats
    shares: Floats
    fitted: NDArray[np.bool_]
    dimension: int
    undecided: float
    starts: int | None = None
    cut: bool = False
    how: str = "sampled"

    @property
    def boundary_dimension(self) -> float:
        """Box-counting dimension of the boundary, d - a."""
        return self.dimension - self.exponent

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = list(zip(self.apart.tolist(), self.shares.tolist(), self.fitted.tolist(), strict=True))
        if np.isfinite(self.exponent):
            caption = (
                f"Uncertainty exponent {self.exponent:.4g} +- {self.error:.2g}, in nineteen of twenty cases"
            )
        else:
            caption = (
                f"Uncertainty exponent: none, {self.fitted.sum()} distances to fit; more starts=... give more"
            )
        caption = full_caption(caption, self.undecided, self.cut)
        columns = (Column("apart", "cells", ".6g"), Column("uncertain share", show=".6f"), "fitted")
        return (Table(columns, rows, caption, how_found(self.how)),)

    def to_json(self) -> dict[str, Any]:
        """Give the exponent and what it was fitted to as JSON takes them."""
        return as_table(
            **picked(self, "exponent", "error", "boundary_dimension", "apart", "shares", "fitted"),
            **picked(self, "undecided", "starts", "cut", "how"),
        )


@arguments_checked
def uncertainty_exponent(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    *,
    starts: int | None = None,
    steps: int = STEPS,
    seed: int = 0,
) -> UncertaintyExponent:
    """Fit the exponent with which uncertain starts become fewer, where their share does not saturate.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    starts : int, optional
        Draw so many random starts, as many for each distance, from a ten thousandth of a cell up, instead of one in
        each cell.  Their orbits may leave the domain and come back.  A fractal boundary needs 100 000.
    steps : int
        An orbit is followed for so many steps at most.
    seed : int
        Of the starts.

    Returns
    -------
    UncertaintyExponent
        Without `starts` over two decades from one cell up; less where the grid has fewer than 400 cells along an axis.

    Raises
    ------
    AnswerError
        For attractors of another graph, fewer than 40 cells along an axis, fewer starts than 20 for each distance, or
        a number of steps below 1.

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
    parted, rng = colours(graph, found), np.random.default_rng(seed)
    farthest = min(FARTHEST, fewest // PARTS)
    if starts is None:
        label = labelled_starts(parted, steps, rng)
        apart = np.unique(np.rint(np.geomspace(1, farthest, DISTANCES)))
        shares, largest = np.array([_uncertain(graph.grid, label, int(m)) for m in apart]).T
        uncertain = np.full(apart.size, np.inf)  # the starts of a row are no independent ones
        weight = graph.grid.measure
    else:
        apart, shares, largest, uncertain, label = _sampled(parted, farthest, starts, steps, rng)
        weight = np.ones(label.size)
    undecided = float(weight[label == codes.UNDECIDED].sum() / weight.sum())
    p = np.array([weight[label == code].sum() for code in parted.codes])
    most = UNSATURATED * (1.0 - ((p / max(p.sum(), 1e-300)) ** 3).sum())
    fitted = (shares > 0.0) & (largest <= most) & (uncertain >= FEWEST_UNCERTAIN)
    slope, error = _fit(apart[fitted], shares[fitted], uncertain[fitted])
    cut = starts is None and leaves_by_the_border(graph)
    return UncertaintyExponent(
        best(slope, undecided),
        best(error, undecided),
        apart,
        shares=shares,
        fitted=fitted,
        dimension=graph.grid.dimension,
        undecided=undecided,
        starts=starts,
        cut=cut,
    )


def _sampled(
    parted: Colours, farthest: int, starts: int, steps: int, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats, Floats, NDArray[np.int64]]:
    """Compare random starts with their neighbours along an axis, as many for each distance, from the farthest in.

    Gives the distances, ascending, the shares of uncertain starts, those along the axis that has most, the numbers of
    uncertain starts, and the labels of all starts.
    """
    grid = parted.grid
    count = round(IN_A_DECADE * np.log10(farthest / NEAREST)) + 1
    if starts < count * FEWEST_UNCERTAIN:
        fewest = f"an integer from {count * FEWEST_UNCERTAIN}, for {count} distances"
        raise AnswerError("the number of starts", starts, fewest, "pass starts=100000")
    apart, rows, labels = np.geomspace(farthest, NEAREST, count), [], []
    for distance in apart:
        cell, (x, side) = random_cells(grid, starts // count, rng)
        axis, row = rng.integers(grid.dimension, size=side.size), np.arange(side.size)
        width = np.empty_like(x)
        for s in np.unique(side).tolist():
            lo, hi = grid.boxes(cell[side == s], s)
            width[side == s] = hi - lo
        own, _ = follow(parted.graph, parted.blocks, x, side, steps, returning=True)
        known, differs = own != codes.UNDECIDED, np.zeros(side.size, dtype=bool)
        for away in (distance, -distance):
            other = x.copy()
            other[row, axis] += away * width[row, axis]
            within = (other >= grid.domain.lo[side]).all(axis=1) & (other <= grid.domain.hi[side]).all(axis=1)
            label, _ = follow(parted.graph, parted.blocks, other, side, steps, returning=True)
            known &= ~within | (label != codes.UNDECIDED)
            differs |= within & (label != own)
        labels.append(own)
        of, uncertain = (
            np.bincount(axis[some], minlength=grid.dimension) for some in (known, known & differs)
        )
        number = int(uncertain.sum())
        rows.append((number / max(int(of.sum()), 1), float((uncertain / np.maximum(of, 1)).max()), number))
        if number < FEWEST_UNCERTAIN:
            break  # nearer ones are fewer still
    shares, largest, numbers = np.array(rows[::-1], dtype=np.float64).T
    return apart[: len(rows)][::-1], shares, largest, numbers, np.concatenate(labels)


def _uncertain(grid: Grid, label: NDArray[np.int64], apart: int) -> tuple[float, float]:
    """Share of the starts whose label is not that of a start so many cells away, up or down an axis.

    The mean over the axes, and the share along the axis that has most.
    """
    uncertain, total = np.zeros((2, grid.dimension))
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
            total[axis] += of[known].sum()
            uncertain[axis] += of[known & differs].sum()
    with np.errstate(invalid="ignore"):  # nothing is known of an axis: nan
        return float(uncertain.sum() / total.sum()), float(np.nanmax(uncertain / total, initial=0.0))


def _fit(apart: Floats, shares: Floats, uncertain: Floats) -> tuple[float, float]:
    """Slope of the logarithms, and an error that holds it in nineteen of twenty cases."""
    if apart.size < FEWEST_FITTED:
        return np.nan, np.nan
    from scipy.special import stdtrit

    # of n uncertain starts the logarithm of the share has the variance (1 - f) / n; in rows it is not known
    counted = bool(np.isfinite(uncertain).all())
    variance = (1.0 - shares) / uncertain if counted else np.ones(apart.size)
    x, y = np.log(apart), np.log(shares)
    slope, wide, rest = _line(x, y, variance)
    scatter = rest / (x.size - 2)
    random = float(np.sqrt(wide * (max(scatter, 1.0) if counted else scatter)))
    half = x.size // 2
    nearer, farther = (
        _line(x[part], y[part], variance[part])[0] for part in (slice(half + 1), slice(half, None))
    )
    return slope, float(np.hypot(stdtrit(x.size - 2, 0.975) * random, farther - nearer))


def _line(x: Floats, y: Floats, variance: Floats) -> tuple[float, float, float]:
    """Slope by weighted least squares, its variance, and the weighted sum of squares that is left."""
    weight = 1.0 / variance
    x, y = x - (weight * x).sum() / weight.sum(), y - (weight * y).sum() / weight.sum()
    sxx = float((weight * x * x).sum())
    slope = float((weight * x * y).sum()) / sxx
    return slope, 1.0 / sxx, float((weight * (y - slope * x) ** 2).sum())
