"""How uncertain a boundary of basins is: the uncertainty exponent and the Wada test.

f(e) is the share of the starts that come to another basin than one of the two starts e away along an axis; f ~ e^a with
the uncertainty exponent a = d - D in d dimensions, D being the box-counting dimension of the boundary.  A straight
boundary gives a = 1.  Where a = 0.3 an error of the start that is ten times smaller halves the uncertain starts.

One start is drawn in each cell, so that starts of one row differ in one coordinate only, and compared over whole
cells; or as many random starts as are asked for, with neighbours as near as a ten thousandth of a cell.  Far apart, f
no longer grows: three independent starts differ with the probability 1 - sum p_j^3, p_j being the shares of the basins.
The fit takes the distances at which f is at most half of this along each axis: of a boundary parallel to one axis only
the others tell.  Its error holds the difference between the slopes of their nearer and farther half, since the range is
a choice.

Source: Grebogi, McDonald, Ott, Yorke, "Final state sensitivity: an obstruction to predictability", Physics Letters A
99, 1983; "Fractal basin boundaries", Physica D 17, 1985.
"""

from __future__ import annotations

from collections.abc import Iterator
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
    MOST_UNDECIDED,
    STEPS,
    Colours,
    Floats,
    best,
    colours,
    follow,
    full_caption,
    labelled_starts,
    leaves_by_the_border,
    random_cells,
    starts_in,
)
from limitsets.systems.sets import Attractor

# Distances in cells: two decades, cut off where there are fewer than four times as many cells along an axis.
FARTHEST, DISTANCES, PARTS = 100, 13, 4

# Of random starts: down to this part of a cell, so many in a decade; fewer uncertain starts tell no share.
NEAREST, IN_A_DECADE, FEWEST_UNCERTAIN = 1e-4, 4, 20

# The fit takes shares up to this part of that of independent starts, at so many distances at least.
UNSATURATED, FEWEST_FITTED = 0.5, 4


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
    graph.grid.domain.require_ends("the grid of uncertainty_exponent")
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
        lo, hi, _ = grid.corners(cell)
        own, _ = follow(parted.graph, parted.blocks, x, side, steps, returning=True)
        known, differs = own != codes.UNDECIDED, np.zeros(side.size, dtype=bool)
        for away in (distance, -distance):
            other = x.copy()
            other[row, axis] += away * (hi - lo)[row, axis]
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
        block, weight = (grid.block(values, side) for values in (label, grid.measure))
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


# ----------------------------------------------------------------
# Wada test: whether boxes on a boundary meet all basins once one looks closely enough.
#
# A basin boundary has the Wada property where each of its points is a boundary point of three basins or more.  No
# finite number of starts shows it: the share of boundary boxes that meet all basins is given as found, at one
# resolution.
#
# Source: Daza, Wagemakers, Sanjuan, Yorke, "Testing for basins of Wada", Scientific Reports 5, 16579, 2015 (the grid
# method, used here); Daza, Wagemakers, Sanjuan, "Ascertaining when a basin is Wada: the merging method", Scientific
# Reports 8, 9954, 2018.


# Starts per cell and axis at the four refinements; the first is one start in each cell of a box.
REFINEMENTS = (1, 2, 4, 8)

# Boundary boxes that are looked at.
BOXES = 400

# A box reaches so many cells to each side of its middle one.
AROUND = 1

# Starts that are followed at a time.
BATCH = 2**18


@dataclass(frozen=True)
class Wada(Tabled):
    """How many boundary boxes meet all basins.

    Attributes
    ----------
    shares : tuple of float
        Share of the boundary boxes that meet all basins, at four refinements of the starts in them: rising to 1 for a
        Wada boundary.  nan without boundary boxes, where fewer than three basins were met, and where more than a tenth
        of the starts is undecided.
    basins : tuple of int or str
        Those met by the first starts: numbers of attractors, names of exits.
    refinements : tuple of int
        Starts per cell and axis; the first are one in each cell, or the random ones that were asked for.
    boxes, of : int
        Boxes of three cells along each axis that were looked at, of so many on a boundary.
    undecided : float
        Share of the first starts that came nowhere.
    cut : bool
        Whether orbits that cross the border of the domain were given up there, in the exit.
    how : str
        "sampled, at this resolution": never proved.
    """

    shares: tuple[float, ...]
    basins: tuple[int | str, ...]
    refinements: tuple[int, ...]
    boxes: int
    of: int
    undecided: float
    cut: bool = False
    how: str = "sampled, at this resolution"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = list(zip(self.refinements, self.shares, strict=False))
        columns = ("starts per cell and axis", Column("share of boxes that meet all basins", show=".6f"))
        caption = full_caption(f"Wada: {self.boxes} of {self.of} boxes", self.undecided, self.cut)
        return (Table(columns, rows, caption, f"{self.how}, not proved"),)

    def to_json(self) -> dict[str, Any]:
        """Give the shares as JSON takes them."""
        return as_table(
            **picked(self, "shares", "basins", "refinements", "boxes", "of", "undecided", "cut", "how")
        )


@arguments_checked
def wada(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    *,
    boxes: int = BOXES,
    starts: int | None = None,
    steps: int = STEPS,
    seed: int = 0,
) -> Wada:
    """Share of the boundary boxes that meet all basins, at four refinements.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    boxes : int
        Boundary boxes to look at; drawn at random where there are more.
    starts : int, optional
        Follow so many random starts first, instead of one in each cell that is not decided: one for each cell or more.
        Their orbits, and those of the finer starts, may leave the domain and come back.
    steps : int
        An orbit is followed for so many steps at most.
    seed : int
        Of the starts and the boxes.

    Returns
    -------
    Wada

    Raises
    ------
    AnswerError
        For attractors of another graph, or a number of boxes below 1.

    Notes
    -----
    Daza, Wagemakers, Sanjuan, Yorke, Scientific Reports 5, 16579, 2015.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-2.0, 2.0)], cells=1000))
    >>> found = ls.resilience.wada(graph, ls.attractors(graph, throws=100))
    >>> found.basins, found.shares[-1] < 0.5  # the two attractors and the way out
    ((0, 1, 'outside'), True)
    """
    if boxes < 1:
        raise AnswerError("the number of boxes", boxes, "an integer from 1", "pass boxes=400")
    graph.grid.domain.require_ends("the grid of wada")
    parted, rng = colours(graph, found), np.random.default_rng(seed)
    if starts is None:
        cell, label = np.arange(graph.n_cells), labelled_starts(parted, steps, rng)
    else:
        cell, drawn = random_cells(graph.grid, starts, rng)
        label, _ = follow(graph, parted.blocks, *drawn, steps, returning=True)
    number, undecided = _numbers(parted, label), float((label == codes.UNDECIDED).mean())
    seen = np.zeros((parted.codes.size, graph.n_cells), dtype=bool)
    seen[number[number >= 0], cell[number >= 0]] = True
    met = np.flatnonzero(seen.any(axis=1))
    several = np.zeros(graph.n_cells, dtype=np.int64)
    for colour, side in product(met, range(graph.grid.sides)):
        several[graph.grid.of_side(side)] += _around(graph.grid.block(seen[colour], side)).ravel()
    middle = np.flatnonzero(several > 1)
    of = middle.size
    if of > boxes:
        middle = np.sort(rng.choice(middle, boxes, replace=False))
    here = np.zeros((middle.size, parted.codes.size), dtype=bool)
    shares = []
    for parts in REFINEMENTS:
        if parts == 1:
            for box, places in _neighbours(graph.grid, middle):
                here[box] |= seen[:, places].T
        else:
            left = np.flatnonzero(~here[:, met].all(axis=1))
            _look(
                parted,
                middle[left],
                left,
                parts=parts,
                steps=steps,
                rng=rng,
                here=here,
                returning=starts is not None,
            )
        known = of and met.size > 2 and undecided <= MOST_UNDECIDED
        shares.append(float(here[:, met].all(axis=1).mean()) if known else np.nan)
    names = tuple(parted.names[k] for k in met)
    cut = starts is None and leaves_by_the_border(graph)
    return Wada(tuple(shares), names, REFINEMENTS, boxes=middle.size, of=of, undecided=undecided, cut=cut)


def _numbers(parted: Colours, label: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index of each label among the basins, -1 for undecided."""
    order = np.argsort(parted.codes)
    at = np.searchsorted(parted.codes[order], label).clip(max=order.size - 1)
    return np.where(parted.codes[order][at] == label, order[at], -1)


def _around(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells in whose box some cell of the mask lies."""
    from scipy.ndimage import binary_dilation

    return np.asarray(binary_dilation(mask, np.ones((2 * AROUND + 1,) * mask.ndim)))


def _neighbours(
    grid: Grid, middle: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Cells of boxes: which box, which cell; one place of the box after the other."""
    side = grid.side_of(middle)
    for s in np.unique(side).tolist():
        mine = np.flatnonzero(side == s)
        position, shape = grid.axes(middle[mine], s), tuple(int(n) for n in grid.shape[s])
        for shift in product(range(-AROUND, AROUND + 1), repeat=grid.dimension):
            at = [k + by for k, by in zip(position, shift, strict=True)]
            inside = np.all([(k >= 0) & (k < n) for k, n in zip(at, shape, strict=True)], axis=0)
            cell = np.ravel_multi_index([k[inside] for k in at], shape)
            yield mine[inside], grid.offset[s] + cell


def _look(
    parted: Colours,
    middle: NDArray[np.int64],
    row: NDArray[np.int64],
    parts: int,
    steps: int,
    rng: np.random.Generator,
    here: NDArray[np.bool_],
    returning: bool,
) -> None:
    """Mark the basins of more random starts in the undecided cells of boxes; the others are of one basin.

    Of orbits that may come back the cells decide nothing: all are looked at.
    """
    stops = parted.blocks if returning else parted.labels
    for box, cell in _neighbours(parted.grid, middle):
        open_ones = np.flatnonzero(stops[cell] == codes.UNDECIDED)
        each = parts**parted.grid.dimension
        for some in np.array_split(open_ones, 1 + open_ones.size * each // BATCH):
            starts = starts_in(parted.grid, np.repeat(cell[some], each), rng)
            label, _ = follow(parted.graph, stops, *starts, steps, returning=returning)
            number = _numbers(parted, label)
            which = np.repeat(row[box[some]], each)
            here[which[number >= 0], number[number >= 0]] = True
