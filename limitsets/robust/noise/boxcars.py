"""One stage of the transfer operator in one dimension: boxcars, and sums along the cells.

The image of a cell under one stratum of the noise is a uniform density between two places: a boxcar.  A row of the
operator is a sum of boxcars, and a wide one is never written out: with S the running integral of a function on the
cells, the mean of the function over a boxcar is (S(hi) - S(lo)) / (hi - lo), S between borders being linear.  So both
the operator and its adjoint cost a few operations per boxcar, however many cells that covers.

A boxcar has the mean and the variance of the convolution of two uniform densities, the image of the cell and the effect
of the stratum: their widths add as squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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
    share: Array = np.clip((x - base) / (edges[k + 1] - base), 0.0, 1.0)
    return k + share


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
    value: Array = np.where(first == last, (hi - lo) * pieces[first], between)
    return value


def _running(values: Array) -> Array:
    running: Array = np.cumulative_sum(values, include_initial=True)
    return running


def cells_met(lo: Array, hi: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last cell that intervals of positions meet."""
    first = lo.astype(np.int64)
    return first, np.maximum(np.ceil(hi).astype(np.int64) - 1, first)


def laid(boxcars: Boxcars, edges: Array) -> tuple[BoxcarBlock, Array, Array]:
    """Lay boxcars on the edges of their target: the sheet, and the mass that lands below and above all edges."""
    lo, hi = boxcars.lo, boxcars.hi
    least = NARROWEST * float(np.min(np.diff(edges)))
    middle, half = 0.5 * (lo + hi), 0.5 * np.maximum(hi - lo, least)
    lo, hi = np.where(hi - lo < least, middle - half, lo), np.where(hi - lo < least, middle + half, hi)
    per_width = boxcars.weight / (hi - lo)
    below = per_width * np.clip(edges[0] - lo, 0.0, hi - lo)
    above = per_width * np.clip(hi - edges[-1], 0.0, hi - lo)
    mass = np.maximum(boxcars.weight - below - above, 0.0)
    at_lo, at_hi = _position(edges, lo), _position(edges, hi)
    # The length as the operator will find it: the rows then add up to the mass exactly.
    extent = np.diff(edges)
    length = _over(extent, _running(extent), at_lo, at_hi)
    some = length > 0.0
    per_length = np.where(some, mass / np.where(some, length, 1.0), 0.0)
    return (
        BoxcarBlock(boxcars.first, boxcars.target, at_lo, at_hi, np.where(some, mass, 0.0), per_length),
        below,
        above,
    )


def mass_rows(block: BoxcarBlock, edges: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Write the entries of a sheet out: source, cell of the target side, mass."""
    lo, hi = block.lo, np.minimum(block.hi, edges.size - 1.0)
    first, last = cells_met(lo, hi)
    count = last - first + 1
    owner = np.repeat(np.arange(lo.size), count)
    cell = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count) + first[owner]
    part = np.maximum(np.minimum(hi[owner], cell + 1.0) - np.maximum(lo[owner], cell), 0.0)
    cell = np.minimum(cell, edges.size - 2)
    mass = block.per_length[owner] * part * np.diff(edges)[cell]
    return owner + block.first, cell, mass


def first_cells(edges: tuple[Array, ...]) -> NDArray[np.int64]:
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
                found = np.bincount(k, weights=sign * rate - upper, minlength=size)
                found[1:] += np.bincount(k, weights=upper, minlength=size)[:-1]
                ends[block.target] += found
        # Height of the density in cell j: what ends beyond it.
        heights = [np.cumsum(end[::-1])[::-1][1:] for end in ends]
        parts = [np.diff(edges) * height for edges, height in zip(self.edges, heights, strict=True)]
        return np.concatenate(parts)

    def matrix(self) -> Any:
        """Write the stage out as a sparse matrix of masses."""
        from scipy.sparse import coo_array

        offset = first_cells(self.edges)
        rows, columns, masses = [], [], []
        for block in self.blocks:
            source, cell, mass = mass_rows(block, self.edges[block.target])
            some = mass > 0.0
            rows.append(source[some].astype(np.int32))
            columns.append((cell[some] + offset[block.target]).astype(np.int32))
            masses.append(mass[some])
        place = (np.concatenate(rows), np.concatenate(columns))
        whole = coo_array((np.concatenate(masses), place), shape=(self.rows, int(offset[-1])))
        return whole.tocsr()
