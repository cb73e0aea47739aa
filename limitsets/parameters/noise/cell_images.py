"""Images of cells under the noise of the throw: boxcars, and borders of pieces interpolated between parameters.

In one dimension, with forced branches, cells are cut where the map of each stratum changes its branch, turns or jumps:
a critical point moves with the noise, and so does the cut.  Otherwise points of the cells are mapped; if neighbouring
points take the same branch, each is spread over the distance between their images.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base.arrays import Array, Ints
from limitsets.systems.cells import Domain, Grid
from limitsets.systems.maps import along, has_slope, images, kind_of, monotone_pieces
from limitsets.systems.sets.measure import sample_points

# ----------------------------------------------------------------
# One stage of the transfer operator in one dimension: boxcars, and sums along the cells.
#
# The image of a cell under one stratum of the noise is a uniform density between two places: a boxcar.  A row of the
# operator is a sum of boxcars, and a wide one is never written out: with S the running integral of a function on the
# cells, the mean of the function over a boxcar is (S(hi) - S(lo)) / (hi - lo), S between borders being linear.  So both
# the operator and its adjoint cost a few operations per boxcar, however many cells that covers.
#
# A boxcar has the mean and the variance of the convolution of two uniform densities, the image of the cell and the
# effect of the stratum: their widths add as squares.


# Share of a cell that is the least width of a boxcar: the image of a fixed or a turning point may have none.
NARROWEST = 1e-4


class Boxcars(NamedTuple):
    """Boxcars of consecutive source cells before they are laid on a grid.

    Attributes
    ----------
    first : int
        Number of the first source cell.
    target : int
        Side on which they land.
    branch : int
        Branch that leads there.
    lo, hi : ndarray, shape (k,)
        Where they begin and end.
    weight : ndarray, shape (k,)
        Share of the cell's mass.
    """

    first: int
    target: int
    branch: int
    lo: Array
    hi: Array
    weight: Array


class BoxcarBlock(NamedTuple):
    """Boxcars of consecutive source cells on the target's edges.

    Attributes
    ----------
    first, target : int
        As in `Boxcars`.
    lo, hi : ndarray, shape (k,)
        Positions counted in cells of the target side: 3.25 is a quarter into cell number 3.
    mass : ndarray, shape (k,)
        Share of the cell's mass that lands between the target's first and last edge.
    per_length : ndarray, shape (k,)
        That share over the length on which it lands.
    """

    first: int
    target: int
    lo: Array
    hi: Array
    mass: Array
    per_length: Array


def _position(edges: Array, x: Array) -> Array:
    """Where x lies, counted in cells; at the nearer end if beyond all edges."""
    k = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, edges.size - 2)
    base = edges[k]
    return np.asarray(k + np.clip((x - base) / (edges[k + 1] - base), 0.0, 1.0))


def _over(pieces: Array, running: Array, lo: Array, hi: Array) -> Array:
    """Integral between two positions of a function that is even on each cell; `pieces` are its integrals cell by cell.

    The cells at both ends are taken for themselves: a difference of two running sums would lose the digits of a
    boxcar much narrower than the side.
    """
    first = np.minimum(lo.astype(np.int64), pieces.size - 1)
    last = np.minimum(hi.astype(np.int64), pieces.size - 1)
    between = (
        (first + 1 - lo) * pieces[first] + (hi - last) * pieces[last] + (running[last] - running[first + 1])
    )
    return np.where(first == last, (hi - lo) * pieces[first], between)


def _running(values: Array) -> Array:
    return np.asarray(np.cumulative_sum(values, include_initial=True))


def cells_met(lo: Array, hi: Array) -> tuple[Ints, Ints]:
    """First and last cell that intervals of positions meet."""
    first = lo.astype(np.int64)
    return first, np.maximum(np.ceil(hi).astype(np.int64) - 1, first)


def laid(boxcars: Boxcars, edges: Array) -> tuple[BoxcarBlock, Array, Array]:
    """Lay boxcars on the edges of their target: the sheet, and the mass that lands below and above all edges."""
    lo, hi, extent = boxcars.lo, boxcars.hi, np.diff(edges)
    least = NARROWEST * float(extent.min())
    middle, half = 0.5 * (lo + hi), 0.5 * np.maximum(hi - lo, least)
    lo, hi = np.where(hi - lo < least, middle - half, lo), np.where(hi - lo < least, middle + half, hi)
    per_width = boxcars.weight / (hi - lo)
    below = per_width * np.clip(edges[0] - lo, 0.0, hi - lo)
    above = per_width * np.clip(hi - edges[-1], 0.0, hi - lo)
    mass = np.maximum(boxcars.weight - below - above, 0.0)
    at_lo, at_hi = _position(edges, lo), _position(edges, hi)
    # The length as the operator will find it: the rows then add up to the mass exactly.
    length = _over(extent, _running(extent), at_lo, at_hi)
    some = length > 0.0
    per_length = np.where(some, mass / np.where(some, length, 1.0), 0.0)
    return (
        BoxcarBlock(boxcars.first, boxcars.target, at_lo, at_hi, np.where(some, mass, 0.0), per_length),
        below,
        above,
    )


def mass_rows(block: BoxcarBlock, edges: Array) -> tuple[Ints, Ints, Array]:
    """Write the entries of a sheet out: source, cell of the target side, mass."""
    lo, hi = block.lo, np.minimum(block.hi, edges.size - 1.0)
    first, last = cells_met(lo, hi)
    count = last - first + 1
    owner = np.repeat(np.arange(lo.size), count)
    cell = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count) + first[owner]
    part = np.maximum(np.minimum(hi[owner], cell + 1.0) - np.maximum(lo[owner], cell), 0.0)
    cell = np.minimum(cell, edges.size - 2)
    return owner + block.first, cell, (block.per_length[owner] * part * np.diff(edges)[cell])


def first_cells(edges: tuple[Array, ...]) -> Ints:
    """Return the number of the first cell of each side, and last that of all."""
    return np.cumulative_sum([each.size - 1 for each in edges], include_initial=True)


@dataclass(frozen=True, eq=False)
class BoxcarOperator:
    """A stage of the operator, as sheets of boxcars.

    Attributes
    ----------
    rows : int
        Source cells.
    edges : tuple of ndarray
        Borders of the target cells, per side.
    blocks : tuple of BoxcarBlock
        The boxcars.
    """

    rows: int
    edges: tuple[Array, ...]
    blocks: tuple[BoxcarBlock, ...]

    @property
    def entries(self) -> int:
        """Entries that the sheets have when they are written out."""
        return int(sum(float((np.ceil(s.hi) - np.floor(s.lo)).sum()) for s in self.blocks))

    def apply(self, values: Array) -> Array:
        """Mean of a function after one stage, from each source cell."""
        offset, after = first_cells(self.edges), np.zeros(self.rows)
        pieces = [values[offset[k] : offset[k + 1]] * np.diff(edges) for k, edges in enumerate(self.edges)]
        running = [_running(part) for part in pieces]
        for block in self.blocks:
            part = _over(pieces[block.target], running[block.target], block.lo, block.hi) * block.per_length
            after[block.first : block.first + part.size] += part
        return after

    def adjoint(self, masses: Array) -> Array:
        """Where masses in the source cells go."""
        ends = [np.zeros(edges.size) for edges in self.edges]
        for block in self.blocks:
            rate = block.per_length * masses[block.first : block.first + block.lo.size]
            size = ends[block.target].size
            for at, sign in ((block.hi, 1.0), (block.lo, -1.0)):
                k = np.minimum(at.astype(np.int64), size - 2)
                upper = sign * rate * (at - k)
                arriving = np.bincount(k, weights=sign * rate - upper, minlength=size)
                arriving[1:] += np.bincount(k, weights=upper, minlength=size)[:-1]
                ends[block.target] += arriving
        # Height of the density in cell j: what ends beyond it.
        heights = [np.cumsum(end[::-1])[::-1][1:] for end in ends]
        parts = [np.diff(edges) * height for edges, height in zip(self.edges, heights, strict=True)]
        return np.concatenate(parts)

    def matrix(self) -> Any:
        """Write the stage out as a sparse matrix of masses."""
        from scipy.sparse import coo_array

        offset = first_cells(self.edges)
        entries = []
        for block in self.blocks:
            source, cell, mass = mass_rows(block, self.edges[block.target])
            some, column = mass > 0.0, cell + offset[block.target]
            entries.append((source[some].astype(np.int32), column[some].astype(np.int32), mass[some]))
        rows, columns, masses = (np.concatenate(parts) for parts in zip(*entries, strict=True))
        return coo_array((masses, (rows, columns)), shape=(self.rows, int(offset[-1]))).tocsr()


# ----------------------------------------------------------------
# Borders of the monotone pieces for many values of a map's parameter: computed at a few, interpolated in
# between.
#
# Critical and turning points are smooth functions of the parameter as long as their number and kind stay the same.  If
# these change, or if the interpolation fails a check, the borders are computed for every value.


# Values of the parameter at which cuts are computed, and the error allowed at one more, as a share of the side.
NODES = 7
ALLOWED = 1e-7


class BranchInterval(NamedTuple):
    """A monotone piece of one side: from `lo` to `hi`, on this branch."""

    lo: float
    hi: float
    branch: int


Pieces = dict[int, tuple[BranchInterval, ...]]


def _cut(params: Any, domain: Domain) -> Pieces:
    by_side = {}
    for side, pieces in monotone_pieces(params, domain).items():
        # The last float of a piece and the first of the next are neighbours: the gap between them is nothing.
        ends = zip(pieces, [*(piece.lo for piece in pieces[1:]), np.inf], strict=True)
        tops = ((p, end if np.nextafter(p.hi, np.inf) == end else p.hi) for p, end in ends)
        by_side[side] = tuple(BranchInterval(p.lo, float(top), p.branch) for p, top in tops)
    return by_side


def _kinds(pieces: Pieces) -> dict[int, list[int]]:
    return {side: [cut.branch for cut in cuts] for side, cuts in pieces.items()}


class InterpolatedPieces:
    """Cuts of all sides as a function of the parameter.

    Parameters
    ----------
    map_of : callable
        From the parameter to the map.
    domain : Domain
        What is cut.
    values : ndarray
        Values that will be asked for.
    """

    def __init__(self, map_of: Callable[[float], Any], domain: Domain, values: Array) -> None:
        self.map_of, self.domain = map_of, domain
        self.nodes = np.empty(0)
        lo, hi = float(values.min()), float(values.max())
        if values.size <= NODES + 1 or not hi > lo:
            return
        angle = (2 * np.arange(NODES) + 1) * np.pi / (2 * NODES)
        self.nodes = 0.5 * (lo + hi) - 0.5 * (hi - lo) * np.cos(angle)
        self.weights = (-1.0) ** np.arange(NODES) * np.sin(angle)
        self.known = [_cut(map_of(float(node)), domain) for node in self.nodes]
        checks = (0.5 * (lo + float(self.nodes[0])), 0.5 * float(self.nodes[3:5].sum()))
        if not all(self._serves(value) for value in checks):
            self.nodes = np.empty(0)

    def _serves(self, value: float) -> bool:
        exact = _cut(self.map_of(value), self.domain)
        if any(_kinds(pieces) != _kinds(exact) for pieces in self.known):
            return False
        guess = self._between(value)
        extent = float((self.domain.hi - self.domain.lo).max())
        return all(
            abs(one.lo - two.lo) <= ALLOWED * extent and abs(one.hi - two.hi) <= ALLOWED * extent
            for side, cuts in exact.items()
            for one, two in zip(cuts, guess[side], strict=True)
        )

    def _between(self, value: float) -> Pieces:
        """Interpolate between the nodes by the barycentric formula."""
        gap = value - self.nodes
        if (gap == 0.0).any():
            return self.known[int(np.flatnonzero(gap == 0.0)[0])]
        share = self.weights / gap
        share /= share.sum()
        by_side = {}
        for side, cuts in self.known[0].items():
            ends = np.array([[cut[:2] for cut in pieces[side]] for pieces in self.known])
            values = np.tensordot(share, ends, axes=1) if cuts else ends[0]
            by_side[side] = tuple(
                BranchInterval(float(lo), float(hi), cut.branch)
                for (lo, hi), cut in zip(values, cuts, strict=True)
            )
        return by_side

    def at(self, value: float) -> Pieces:
        """Pieces of every side at one value of the parameter."""
        return self._between(value) if self.nodes.size else _cut(self.map_of(value), self.domain)


# ----------------------------------------------------------------
# Images of cells under the noise of the throw itself: boxcars of a map and a stratum of its parameter.


MapOf = Callable[[float], Any]

# Places per piece at which the effect of the noise within a stratum is computed; between them it is interpolated.
PLACES = 512
# Samples per cell and axis where there are no pieces, by dimension.
SAMPLES = {1: 32, 2: 4, 3: 3}


def _within(map_of: MapOf, mean: float, half: float, x: Array, side: int, branch: int) -> tuple[Array, Array]:
    """How far the noise within a stratum moves images: width of what it spreads them over, and shift of their mean."""
    if half == 0.0:
        return np.zeros(x.size), np.zeros(x.size)
    some = x if x.size <= PLACES else x[np.linspace(0, x.size - 1, PLACES).astype(np.int64)]
    below, at, above = (along(map_of(mean + d), some, side, [branch])[0] for d in (-half, 0.0, half))
    width, shift = np.abs(above - below), (below - 2.0 * at + above) / 6.0
    known = np.isfinite(width) & np.isfinite(shift)
    width, shift = np.where(known, width, 0.0), np.where(known, shift, 0.0)
    return np.interp(x, some, width), np.interp(x, some, shift)


def boxes_of_pieces(
    map_of: MapOf, grid: Grid, pieces: Pieces, mean: float, sd: float, weight: float
) -> Iterator[Boxcars]:
    """Boxcars of all cells under one stratum of the map's parameter, piece by piece.

    Parameters
    ----------
    map_of : callable
        From the parameter to the map.
    grid : Grid
        The cells.
    pieces : dict
        Monotone pieces of every side at the stratum's mean.
    mean, sd, weight : float
        The stratum.
    """
    params, half = map_of(mean), math.sqrt(3.0) * sd
    for side, cuts in pieces.items():
        edges = grid.edges[side][0]
        for cut in cuts:
            lo, hi = max(cut.lo, float(edges[0])), min(cut.hi, float(edges[-1]))
            if not hi > lo:
                continue
            first = int(np.searchsorted(edges, lo, side="right")) - 1
            last = int(np.searchsorted(edges, hi, side="left"))
            x = edges[first : last + 1].copy()
            x[0], x[-1] = lo, hi
            y, to, _ = along(params, x, side, [cut.branch])
            if not 0 <= int(to[0]) < grid.sides:
                continue
            finite = np.isfinite(y)
            known = finite[1:] & finite[:-1]  # elsewhere the mass is missing: outside the model
            y = np.where(finite, y, 0.0)
            width, shift = _within(map_of, mean, half, 0.5 * (x[1:] + x[:-1]), side, cut.branch)
            middle = 0.5 * (y[1:] + y[:-1]) + shift
            reach = 0.5 * np.hypot(np.diff(y), width)
            share = np.where(known, weight * np.diff(x) / np.diff(edges[first : last + 1]), 0.0)
            number = int(grid.offset[side]) + first
            yield Boxcars(number, int(to[0]), cut.branch, middle - reach, middle + reach, share)


def rows_of_points(
    map_of: MapOf, grid: Grid, mean: float, sd: float, weight: float, side: int
) -> tuple[NDArray[Any], ...]:
    """Send evenly spread points of the cells of one side, each for an equal share of its cell.

    Returns
    -------
    source, x, side, code, weight, width : ndarray
        Cell each comes from, where it lands, and over what width the noise within the stratum spreads it (in one
        dimension, where the branch stays the same; else 0).
    """
    dimension = grid.dimension
    samples = SAMPLES[dimension]
    cells = np.arange(grid.offset[side], grid.offset[side + 1])
    points = sample_points(grid, cells, side, samples)
    image = images(map_of(mean), points, side)
    width = np.zeros(image.code.size)
    if dimension == 1:
        width = _spread_of_points(
            map_of, mean, math.sqrt(3.0) * sd, points=points, side=side, image=image, samples=samples
        )
    source = np.repeat(cells, samples**dimension)
    share = np.full(source.size, weight * samples ** -float(dimension))
    return source, image.x, image.side, image.code, share, width


def _spread_of_points(
    map_of: MapOf, mean: float, half: float, points: Array, side: int, image: Any, samples: int
) -> Array:
    """Width over which each point's image is spread: that of its part of the cell, and that of the noise."""
    x, code = image.x.reshape(-1, samples), image.code.reshape(-1, samples)
    gap = np.abs(np.diff(x, axis=1))
    same = (np.diff(code, axis=1) == 0) & (np.diff(image.side.reshape(-1, samples), axis=1) == 0)
    gap = np.where(same, gap, np.inf)
    left, right = np.pad(gap, ((0, 0), (1, 0)), mode="edge"), np.pad(gap, ((0, 0), (0, 1)), mode="edge")
    part = np.minimum(left, right)
    width: Array = np.where(np.isfinite(part), part, 0.0).ravel()
    if half > 0.0:
        ends = [images(map_of(mean + d), points, side) for d in (-half, half)]
        alike = (ends[0].code == image.code) & (ends[1].code == image.code)
        alike &= (ends[0].side == image.side) & (ends[1].side == image.side)
        noise = np.where(alike, np.abs(ends[1].x - ends[0].x), 0.0)
        width = np.hypot(width, noise)
    return width


def uses_pieces(params: Any) -> bool:
    """Whether cells of a map can be cut into monotone pieces."""
    return kind_of(params).dimension == 1 and has_slope(params)
