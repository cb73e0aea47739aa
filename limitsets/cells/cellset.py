"""Sets of cells of one grid and their algebra: union, intersection, difference, complement, inclusion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.cells.grid import Grid
from limitsets.errors import GridError


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

    def holds(self, x: ArrayLike, side: int) -> NDArray[np.bool_]:
        """Whether the cell of each state (`Grid.index`) is in the set; x of shape (n,) or (n, dimension)."""
        if self.grid.dimension > 1:
            cell = self.grid.index(x, side)
            return self.mask[cell] & (cell >= 0)
        # The borders of the set are fewer than those of the cells.
        states, edges = np.asarray(x, dtype=np.float64).ravel(), self.grid.edges[side][0]
        met = self.mask[self.grid.of_side(side)].astype(np.int8)
        border = edges[np.flatnonzero(np.diff(np.concatenate([[0], met, [0]])))]
        inside: NDArray[np.bool_] = np.searchsorted(border, states, side="right") % 2 == 1
        if met[-1:].any():
            inside |= states == edges[-1]  # of the last cell, whose upper border is nobody else's
        return inside

    def extents(self, axis: int = 0) -> dict[int, list[tuple[float, float]]]:
        """Per side the intervals that the cells make up; in more dimensions their ranges along one axis.

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
        found: dict[int, list[tuple[float, float]]] = {}
        for side in range(self.grid.sides):
            block = self.mask[self.grid.of_side(side)].reshape(tuple(self.grid.shape[side]))
            others = tuple(each for each in range(self.grid.dimension) if each != axis)
            met = np.any(block, axis=others).astype(np.int8)
            border = np.flatnonzero(np.diff(np.concatenate([[0], met, [0]])))
            edges = self.grid.edges[side][axis]
            if border.size:
                found[side] = [(float(edges[a]), float(edges[b])) for a, b in border.reshape(-1, 2)]
        return found

    def pieces(self) -> dict[int, list[tuple[tuple[float, float], ...]]]:
        """Per side the boxes that hold its connected pieces, a pair (lo, hi) for each axis.

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

        found: dict[int, list[tuple[tuple[float, float], ...]]] = {}
        for side, axes in enumerate(self.grid.edges):
            block = self.mask[self.grid.of_side(side)].reshape(tuple(self.grid.shape[side]))
            labels, _ = ndimage.label(block, np.ones((3,) * self.grid.dimension))
            boxes = [
                tuple(
                    (float(edges[part.start]), float(edges[part.stop]))
                    for edges, part in zip(axes, piece, strict=True)
                )
                for piece in ndimage.find_objects(labels)
            ]
            if boxes:
                found[side] = boxes
        return found

    def refined(self, fine: Grid) -> CellSet:
        """Return the cells of a refinement (`Grid.refine`) that lie in this set."""
        mask = np.zeros(fine.n_cells, dtype=bool)
        for side in range(self.grid.sides):
            block = self.mask[self.grid.of_side(side)].reshape(tuple(self.grid.shape[side]))
            for axis in range(self.grid.dimension):
                parts = int(fine.shape[side, axis] // max(self.grid.shape[side, axis], 1))
                block = np.repeat(block, parts, axis=axis)
            mask[fine.of_side(side)] = block.ravel()
        return CellSet(fine, mask)
