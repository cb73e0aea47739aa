"""Boundaries of classes, refined: a coarse grid, then only what lies between points that differ.

The points of a chunk are a rectangle of cells.  A cell is filled where all points of it that were computed, on its
edges too, agree; else it is halved along each axis, and its new corners are computed.  A cell beside one that was
halved sees the points on their common edge, so a boundary is followed once it is met.  What passes between the points
of the coarse grid without meeting one is missed: an island, or a tongue, that is narrower than the step.

A chunk is refined by itself, with the points of its own edges, by the worker that has it: the result is that of the
plan alone, and a sweep that was interrupted goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

# Of the coarse grid.
STEP = 8
FILLED = -1

Ints = npt.NDArray[np.int64]


class Refined(NamedTuple):
    """Which points were computed, and which point each point has its answers from.

    Attributes
    ----------
    points : ndarray of int64, shape (m,)
        Those computed, in that order.
    source : ndarray of int64, shape (n,)
        For every point, the place in `points` of itself or of the nearest corner of its cell.
    level : ndarray of int8, shape (n,)
        0 on the coarse grid, then how often cells were halved; -1 for what was filled.
    """

    points: Ints
    source: Ints
    level: npt.NDArray[np.int8]


def refined(shape: tuple[int, ...], step: int, ask: Callable[[Ints], Ints]) -> Refined:
    """Compute the points of a grid that are needed to see where its classes meet.

    Parameters
    ----------
    shape : tuple of int
        Points along one or two axes.
    step : int
        Between the points of the coarse grid, along each axis.
    ask : callable
        Told numbers of points, in the order of the rows, it computes them and returns codes; equal codes, one class.

    Returns
    -------
    Refined

    Examples
    --------
    >>> found = refined((1, 17), 8, lambda points: points // 11)  # classes meet between 10 and 11
    >>> found.points.tolist()
    [0, 8, 16, 12, 10, 11]
    >>> found.level[8:13].tolist()
    [0, -1, 2, 3, 1]
    """
    rows, columns = shape if len(shape) == 2 else (1, *shape)
    source = np.full((rows, columns), -1, np.int64)
    level = np.full((rows, columns), FILLED, np.int8)
    codes = np.zeros((rows, columns), np.int64)
    points = np.zeros(0, np.int64)
    cells = np.array([(*i, *j) for i, j in product(_parts(rows, step), _parts(columns, step))], np.int64)
    depth = np.zeros(len(cells), np.int64)
    new = cells
    while True:
        corners = _corners(new, columns)
        wanted = np.unique(corners[source.ravel()[corners] < 0])
        if wanted.size:
            source.ravel()[wanted] = points.size + np.arange(wanted.size)
            points = np.concatenate([points, wanted])
            codes.ravel()[wanted] = ask(wanted)
            near = np.full(rows * columns, np.iinfo(np.int8).max, np.int8)
            np.minimum.at(near, corners, np.tile(depth[len(cells) - len(new) :], 4).astype(np.int8))
            level.ravel()[wanted] = near[wanted]
        wide = np.maximum(cells[:, 1] - cells[:, 0], cells[:, 3] - cells[:, 2]) > 1
        split = wide & ~_uniform(cells, codes, source >= 0)
        if not split.any():
            break
        new, halves = _halved(cells[split], depth[split] + 1)
        cells, depth = np.concatenate([cells[~split], new]), np.concatenate([depth[~split], halves])
    for i, k, j, m in cells[wide].tolist():
        part = source[i : k + 1, j : m + 1]
        near_rows = np.where(2 * np.arange(k - i + 1) <= k - i, 0, k - i)
        near_columns = np.where(2 * np.arange(m - j + 1) <= m - j, 0, m - j)
        part[:] = np.where(part < 0, part[np.ix_(near_rows, near_columns)], part)
    return Refined(points, source.ravel(), level.ravel())


def _parts(length: int, step: int) -> list[tuple[int, int]]:
    ends = [*range(0, length - 1, step), length - 1]
    return list(pairwise(ends)) if len(ends) > 1 else [(0, 0)]


def _corners(cells: Ints, columns: int) -> Ints:
    """Numbers of the points at the corners of cells, the first corner of all cells first."""
    return np.concatenate([cells[:, i] * columns + cells[:, j] for i in (0, 1) for j in (2, 3)])


def _halved(cells: Ints, depth: Ints) -> tuple[Ints, Ints]:
    """Halve cells along each axis along which they have inner points."""
    for lo, hi in ((0, 1), (2, 3)):
        wide = cells[:, hi] - cells[:, lo] > 1
        lower, upper = cells[wide].copy(), cells[wide].copy()
        lower[:, hi] = upper[:, lo] = (lower[:, lo] + lower[:, hi]) // 2
        cells = np.concatenate([cells[~wide], lower, upper])
        depth = np.concatenate([depth[~wide], depth[wide], depth[wide]])
    return cells, depth


def _uniform(cells: Ints, codes: Ints, known: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Whether the known points of each cell have one code: where the mean of squares is the square of the mean."""
    places = np.unique(codes[known], return_inverse=True)[1]
    values = np.zeros(codes.shape, np.int64)
    values[known] = places
    count, total, squares = (_sums(cells, each) for each in (known.astype(np.int64), values, values**2))
    return np.asarray(count * squares == total**2)


def _sums(cells: Ints, values: Ints) -> Ints:
    """Sum an array over cells, their edges with them."""
    table = np.zeros((values.shape[0] + 1, values.shape[1] + 1), np.int64)
    table[1:, 1:] = values.cumsum(axis=0).cumsum(axis=1)
    i, k, j, m = cells[:, 0], cells[:, 1] + 1, cells[:, 2], cells[:, 3] + 1
    return table[k, m] - table[i, m] - table[k, j] + table[i, j]
