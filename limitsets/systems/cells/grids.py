"""Cells: grids on the domain of a map, uniform or graded, and the algebra of sets of cells."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import Column, GridError, Table, Tabled, shown
from limitsets.systems.cells.domain import Domain, as_domain


def cell_ends(cells: Grid) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Return of every cell of a grid on lines its side, its lower and its upper end."""
    lo = np.concatenate([edges[:-1] for (edges,) in cells.edges])
    hi = np.concatenate([edges[1:] for (edges,) in cells.edges])
    return cells.side_of(np.arange(cells.n_cells)), lo, hi


# ----------------------------------------------------------------
# Grids: uniform, or graded so that cells shrink in proportion to their distance from an anchor.


# Graded cells grow with their distance from the anchor up to this share of the side's extent and are equal beyond:
# near a_i of the throw, where jogs shrink in proportion to R - a_i, resolution is relative; far from it, absolute.
EQUAL_BEYOND = 0.25

# Nodes are kept as 32-bit integers.
MOST_CELLS = 2**31 - 16


@dataclass(frozen=True, eq=False, repr=False)
class Grid(Tabled):
    """A grid of closed cells on each side.

    Attributes
    ----------
    domain : Domain
        What is covered.
    edges : tuple of tuple of ndarray
        ``edges[side][axis]``, shape (n + 1,): ascending cell borders, float64; a side without states has one, and no
        cell.

    Raises
    ------
    GridError
        For borders that do not ascend, or of fewer digits: rounded to them, distinct borders become one.
    """

    domain: Domain
    edges: tuple[tuple[NDArray[np.float64], ...], ...]

    def __post_init__(self) -> None:
        axes = [axis for side in self.edges for axis in side]
        if not all(axis.dtype == np.float64 for axis in axes):
            raise GridError(
                "the type of the cells' borders",
                ", ".join(sorted({str(axis.dtype) for axis in axes})),
                "float64",
                "compute the borders in float64: narrower numbers may merge them",
            )
        cut = zip(self.edges, self.domain.inhabited.tolist(), strict=True)
        least = [1 + some for side, some in cut for _ in side]
        if not all(a.size >= n and (a[1:] > a[:-1]).all() for a, n in zip(axes, least, strict=True)):
            raise GridError(
                "the cells",
                [int(axis.size) - 1 for axis in axes],
                "cells wider than the spacing of floating-point numbers",
                "ask for fewer",
            )

    def __repr__(self) -> str:
        return f"Grid({self.n_cells} cells: {', '.join('x'.join(map(str, n)) for n in self.shape.tolist())})"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (side, axis, edges.size - 1, (edges[0], edges[-1]), (np.diff(edges).min(), np.diff(edges).max()))
            for side, axes in enumerate(self.edges)
            for axis, edges in enumerate(axes)
            if edges.size > 1  # a side without states has no cells
        ]
        spans = (Column("x", show=".6g", ends=True), Column("width of a cell", show=".3g", ends=True))
        return (Table(("side", "axis", "cells", *spans), rows, f"Grid of {self.n_cells} cells"),)

    @property
    def sides(self) -> int:
        """Number of sides."""
        return len(self.edges)

    @property
    def dimension(self) -> int:
        """Number of axes."""
        return len(self.edges[0])

    @cached_property
    def shape(self) -> NDArray[np.int64]:
        """Cells per side and axis, shape (n_sides, dimension)."""
        return np.array([[axis.size - 1 for axis in side] for side in self.edges], dtype=np.int64)

    @cached_property
    def offset(self) -> NDArray[np.int64]:
        """Number of the first cell of each side, and last the number of cells, shape (n_sides + 1,)."""
        return np.concatenate([[0], np.cumsum(self.shape.prod(axis=1))]).astype(np.int64)

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return int(self.offset[-1])

    def of_side(self, side: int) -> slice:
        """Cells of one side."""
        return slice(int(self.offset[side]), int(self.offset[side + 1]))

    def side_of(self, cells: ArrayLike) -> NDArray[np.int64]:
        """Side of each cell."""
        return np.searchsorted(self.offset, np.asarray(cells), side="right").astype(np.int64) - 1

    def index(self, x: ArrayLike, side: int | NDArray[np.int64]) -> NDArray[np.int64]:
        """Cells that hold the given states; -1 outside, the upper one on a shared border.

        Parameters
        ----------
        x : array_like, shape (n,) or (n, dimension)
            States.
        side : int or ndarray of int, shape (n,)
            Their side, or the side of each.

        Returns
        -------
        ndarray of int, shape (n,)
            Numbers of the cells; along an axis that closes there is no outside.
        """
        states = np.asarray(x, dtype=np.float64).reshape(-1, self.dimension)
        if isinstance(side, np.ndarray):
            cells = np.full(len(states), -1)
            for s in range(self.sides):
                cells[side == s] = self.index(states[side == s], s)
            return cells
        states = self.domain.wrapped(states, side)
        inside = np.ones(len(states), dtype=bool)
        number = np.zeros(len(states), dtype=np.int64)
        for axis, edges in enumerate(self.edges[side]):
            column = states[:, axis]
            inside &= (column >= edges[0]) & (column <= edges[-1]) & (edges.size > 1)
            k = np.clip(np.searchsorted(edges, column, side="right") - 1, 0, edges.size - 2)
            number = number * (edges.size - 1) + k
        return np.where(inside, number + self.offset[side], -1)

    def block(self, values: NDArray[Any], side: int) -> NDArray[Any]:
        """Values of the cells of one side, shape (n_cells,) of all, as an array with an axis for each of the grid's."""
        return values[self.of_side(side)].reshape(tuple(self.shape[side]))

    def axes(self, cells: ArrayLike, side: int) -> tuple[NDArray[np.int64], ...]:
        """Position along each axis of cells of one side."""
        shape = tuple(int(n) for n in self.shape[side])
        return tuple(np.unravel_index(np.asarray(cells) - self.offset[side], shape))

    def boxes(self, cells: ArrayLike, side: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Corners of cells of one side: two arrays of shape (n, dimension)."""
        position = self.axes(cells, side)
        pairs = [(edges[k], edges[k + 1]) for edges, k in zip(self.edges[side], position, strict=True)]
        return np.stack([lo for lo, _ in pairs], axis=-1), np.stack([hi for _, hi in pairs], axis=-1)

    def corners(
        self, cells: NDArray[np.integer]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Corners of cells of any sides, two arrays of shape (n, dimension), and their sides."""
        side, (lo, hi) = self.side_of(cells), np.empty((2, cells.size, self.dimension))
        for s in np.unique(side).tolist():
            lo[side == s], hi[side == s] = self.boxes(cells[side == s], s)
        return lo, hi, side

    def centres(self, side: int) -> NDArray[np.float64]:
        """Middles of all cells of one side, shape (n,) in one dimension, (n, dimension) otherwise."""
        middles = [0.5 * (edges[1:] + edges[:-1]) for edges in self.edges[side]]
        if self.dimension == 1:
            return middles[0]
        return np.stack([m.ravel() for m in np.meshgrid(*middles, indexing="ij")], axis=-1)

    @cached_property
    def measure(self) -> NDArray[np.float64]:
        """Length, area or volume of every cell, shape (n_cells,)."""
        parts = []
        for side in self.edges:
            volume = np.ones(1)
            for edges in side:
                volume = np.multiply.outer(volume, np.diff(edges)).ravel()
            parts.append(volume)
        return np.concatenate(parts)

    def refine(self, parts: int = 2) -> Grid:
        """Cut every cell into `parts` equal ones along each axis.

        Examples
        --------
        >>> import limitsets as ls
        >>> ls.grid([(0.0, 1.0)], cells=8).refine(4).n_cells
        32
        """
        if parts < 1:
            raise GridError("the number of parts", parts, "an integer from 1", "pass parts=2")
        return Grid(self.domain, tuple(tuple(_split(edges, parts) for edges in side) for side in self.edges))


def _split(edges: NDArray[np.float64], parts: int) -> NDArray[np.float64]:
    weight = np.arange(parts) / parts
    inner = edges[:-1, None] + weight * np.diff(edges)[:, None]
    return np.append(inner.ravel(), edges[-1])


def _graded(lo: float, hi: float, anchor: float, cells: int) -> NDArray[np.float64]:
    """Edges whose distance from the anchor grows by a constant factor, then by a constant step of the same size.

    With y the distance from the anchor the edges are equidistant in u = ln y up to y_c and in y / y_c beyond it,
    so that width and rate of growth are continuous at y_c.
    """
    first, last = lo - anchor, hi - anchor
    change = max(first, EQUAL_BEYOND * last)
    log_part = math.log(change / first)
    u = np.linspace(0.0, log_part + (last - change) / change, cells + 1)
    near = first * np.exp(np.minimum(u, log_part))
    y = np.where(u <= log_part, near, change + change * (u - log_part))
    edges: NDArray[np.float64] = anchor + y
    edges[0], edges[-1] = lo, hi
    return edges


def _counts(cells: Any, depth: int | None, dimension: int) -> tuple[int, ...]:
    if depth is not None:
        if not isinstance(depth, int) or depth < 1:
            raise GridError(
                "the depth of the grid", depth, "an integer from 1", "pass depth=16, or cells=..."
            )
        return tuple(2 ** ((depth + dimension - 1 - axis) // dimension) for axis in range(dimension))
    counts = tuple(cells) if isinstance(cells, Sequence | np.ndarray) else (cells,) * dimension
    if len(counts) != dimension or not all(isinstance(n, int | np.integer) and n >= 1 for n in counts):
        raise GridError(
            "the number of cells",
            cells,
            "an integer from 1" + (f", or {dimension} of them" if dimension > 1 else ""),
            "pass cells=1024" + (", or one per axis" if dimension > 1 else ""),
        )
    return tuple(int(n) for n in counts)


def grid(
    domain: Domain | ArrayLike,
    cells: int | Sequence[int] = 1024,
    *,
    depth: int | None = None,
    grading: str | None = None,
    periodic: bool | Sequence[bool] | None = None,
) -> Grid:
    """Cut a domain into cells.

    Parameters
    ----------
    domain : Domain or list of (lo, hi)
        What to cover; a list of pairs is one side, one pair per axis.
    cells : int or sequence of int
        Cells per axis of each side.
    depth : int, optional
        Instead of `cells`: halve the box `depth` times, the axes in turn beginning with the first.
    grading : {"uniform", "graded"}, optional
        Default: graded where the domain has an anchor.
    periodic : bool or sequence of bool, optional
        Which axes close, one word for all or one per axis; default: those of the domain, of a list of pairs none.  The
        period is the extent of the axis, and images of the map may lie anywhere: they are taken modulo the period.

    Returns
    -------
    Grid
        The cells.

    Raises
    ------
    GridError
        For a domain, number or word that cannot be.

    Examples
    --------
    >>> import limitsets as ls
    >>> ls.grid(ls.load("paper-designed").domain, cells=1024).n_cells
    3072
    >>> ls.grid([(0.0, 1.0), (-1.0, 1.0)], cells=4, periodic=(True, False)).index([[1.2, 0.9], [0.2, 1.2]], 0)
    array([ 3, -1])
    """
    region = as_domain(domain)
    if periodic is not None:
        region = Domain(region.lo, region.hi, region.anchor, periodic)  # type: ignore[arg-type]  # read there
    counts = _counts(cells, depth, region.dimension)
    words = ("uniform", "graded")
    if grading is not None and not (isinstance(grading, str) and grading in words):
        raise GridError("the grading", shown(grading), " or ".join(words), "correct the word")
    if grading == "graded" and region.anchor is None:
        raise GridError(
            "the grading", grading, "uniform, for a domain without anchor", "give the domain an anchor"
        )
    if math.prod(counts) * region.sides > MOST_CELLS:
        raise GridError(
            "the number of cells",
            math.prod(counts) * region.sides,
            f"at most {MOST_CELLS}",
            "ask for fewer cells",
        )
    graded = region.anchor is not None and grading != "uniform"
    sides = []
    for side, some in enumerate(region.inhabited.tolist()):
        if not some:
            axes: tuple[NDArray[np.float64], ...] = tuple(end[None] for end in region.hi[side])
        elif graded and region.anchor is not None:
            lo, hi, anchor = float(region.lo[side, 0]), float(region.hi[side, 0]), float(region.anchor[side])
            axes = (_graded(lo, hi, anchor, counts[0]),)
        else:
            pairs = zip(region.lo[side], region.hi[side], counts, strict=True)
            axes = tuple(np.linspace(lo, hi, n + 1) for lo, hi, n in pairs)
        sides.append(axes)
    return Grid(region, tuple(sides))


# ----------------------------------------------------------------
# Sets of cells of one grid and their algebra: union, intersection, difference, complement, inclusion.


@dataclass(frozen=True, eq=False)
class CellSet:
    """A set of cells of a grid.

    Attributes
    ----------
    grid : Grid
        The grid.
    mask : ndarray of bool, shape (n_cells,)
        True for the cells in the set.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.cells import CellSet
    >>> cover = ls.grid([(0.0, 1.0)], cells=4)
    >>> left, middle = CellSet.of(cover, [0, 1]), CellSet.of(cover, [1, 2])
    >>> (left | middle).extents()
    {0: [(0.0, 0.75)]}
    >>> (left & middle).measure(), left <= middle
    (0.25, False)
    """

    grid: Grid
    mask: NDArray[np.bool_]

    def __post_init__(self) -> None:
        if self.mask.shape != (self.grid.n_cells,) or self.mask.dtype != bool:
            raise GridError("the mask", self.mask.shape, f"{self.grid.n_cells} booleans", "give one per cell")

    def __repr__(self) -> str:
        return f"CellSet({len(self)} of {self.grid.n_cells} cells)"

    @classmethod
    def of(cls, grid: Grid, cells: ArrayLike) -> CellSet:
        """Return the set of the given cell numbers."""
        mask = np.zeros(grid.n_cells, dtype=bool)
        mask[np.asarray(cells, dtype=np.int64)] = True
        return cls(grid, mask)

    def _other(self, other: CellSet) -> NDArray[np.bool_]:
        if other.grid is not self.grid:
            raise GridError(
                "the other set", "cells of another grid", "cells of the same grid", "build it on this grid"
            )
        return other.mask

    def __or__(self, other: CellSet) -> CellSet:
        return CellSet(self.grid, self.mask | self._other(other))

    def __and__(self, other: CellSet) -> CellSet:
        return CellSet(self.grid, self.mask & self._other(other))

    def __sub__(self, other: CellSet) -> CellSet:
        return CellSet(self.grid, self.mask & ~self._other(other))

    def __invert__(self) -> CellSet:
        return CellSet(self.grid, ~self.mask)

    def __le__(self, other: CellSet) -> bool:
        return not bool((self.mask & ~self._other(other)).any())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, CellSet) and bool((self.mask == self._other(other)).all())

    __hash__ = None  # type: ignore[assignment]  # sets of cells compare by content

    def __len__(self) -> int:
        return int(self.mask.sum())

    def __iter__(self) -> Iterator[int]:
        return iter(self.numbers().tolist())

    def __contains__(self, cell: int) -> bool:
        return bool(self.mask[cell])

    def numbers(self) -> NDArray[np.int64]:
        """Numbers of the cells, ascending."""
        return np.flatnonzero(self.mask)

    def measure(self) -> float:
        """Length, area or volume of the set."""
        return float(self.grid.measure[self.mask].sum())

    def holds(self, x: ArrayLike, side: int | NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether the cell of each state (`Grid.index`) is in the set; x of shape (n,) or (n, dimension)."""
        if self.grid.dimension > 1 or isinstance(side, np.ndarray):
            cell = self.grid.index(x, side)
            return self.mask[cell] & (cell >= 0)
        # The borders of the set are fewer than those of the cells.
        states, edges = self.grid.domain.wrapped(x, side).ravel(), self.grid.edges[side][0]
        met = self.mask[self.grid.of_side(side)].astype(np.int8)
        border = edges[np.flatnonzero(np.diff(np.concatenate([[0], met, [0]])))]
        inside: NDArray[np.bool_] = np.searchsorted(border, states, side="right") % 2 == 1
        if met[-1:].any():
            inside |= states == edges[-1]  # of the last cell, whose upper border is nobody else's
        return inside

    def extents(self, axis: int = 0) -> dict[int, list[tuple[float, float]]]:
        """Per side the intervals that the cells make up; in more dimensions their ranges along one axis.

        Of an axis that closes they are those of [lo, hi]: one that passes the seam is two.

        Parameters
        ----------
        axis : int
            Which one; the first by default.

        Returns
        -------
        dict of int to list of (lo, hi)
            Ascending; a side without cells is left out.

        Raises
        ------
        GridError
            An axis that the grid has not.

        Examples
        --------
        >>> import limitsets as ls
        >>> cells = CellSet.of(ls.grid([(0.0, 1.0), (0.0, 4.0)], cells=4), [5])
        >>> cells.extents(), cells.extents(axis=1)
        ({0: [(0.25, 0.5)]}, {0: [(1.0, 2.0)]})
        """
        if axis not in range(self.grid.dimension):
            allowed = f"0 to {self.grid.dimension - 1}"
            raise GridError("the axis", axis, allowed, "name an axis of the grid")
        intervals: dict[int, list[tuple[float, float]]] = {}
        for side in range(self.grid.sides):
            block = self.grid.block(self.mask, side)
            others = tuple(each for each in range(self.grid.dimension) if each != axis)
            met = np.any(block, axis=others).astype(np.int8)
            border = np.flatnonzero(np.diff(np.concatenate([[0], met, [0]])))
            edges = self.grid.edges[side][axis]
            if border.size:
                intervals[side] = [(float(edges[a]), float(edges[b])) for a, b in border.reshape(-1, 2)]
        return intervals

    def pieces(self) -> dict[int, list[tuple[tuple[float, float], ...]]]:
        """Per side the boxes that hold its connected pieces, a pair (lo, hi) for each axis.

        Where an axis closes, a piece that passes the seam is two.

        Returns
        -------
        dict of int to list of tuple of (lo, hi)
            In the order of the first cell of each piece; cells that share a corner are connected.  A side without
            cells is left out.

        Examples
        --------
        >>> import limitsets as ls
        >>> CellSet.of(ls.grid([(0.0, 1.0), (0.0, 4.0)], cells=4), [0, 5, 15]).pieces()
        {0: [((0.0, 0.5), (0.0, 2.0)), ((0.75, 1.0), (3.0, 4.0))]}
        """
        from scipy import ndimage

        boxes_by_side: dict[int, list[tuple[tuple[float, float], ...]]] = {}
        for side, axes in enumerate(self.grid.edges):
            block = self.grid.block(self.mask, side)
            labels, _ = ndimage.label(block, np.ones((3,) * self.grid.dimension))
            boxes = [
                tuple(
                    (float(edges[part.start]), float(edges[part.stop]))
                    for edges, part in zip(axes, piece, strict=True)
                )
                for piece in ndimage.find_objects(labels)
            ]
            if boxes:
                boxes_by_side[side] = boxes
        return boxes_by_side

    def refined(self, fine: Grid) -> CellSet:
        """Return the cells of a refinement (`Grid.refine`) that lie in this set."""
        mask = np.zeros(fine.n_cells, dtype=bool)
        for side in range(self.grid.sides):
            block = self.grid.block(self.mask, side)
            for axis in range(self.grid.dimension):
                parts = int(fine.shape[side, axis] // max(self.grid.shape[side, axis], 1))
                block = np.repeat(block, parts, axis=axis)
            mask[fine.of_side(side)] = block.ravel()
        return CellSet(fine, mask)
