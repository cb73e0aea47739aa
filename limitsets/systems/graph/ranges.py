"""Images of cells as boxes of target cells: the form in which every graph algorithm reads the graph.

A box is a block of cells of one side, kept as the number of its first cell, the length of its runs of consecutive
cells and the numbers of such runs (rows, and planes of rows in three dimensions).  Cell k's boxes are
``first[k]:first[k + 1]``.  Edges are never written out: a box of a thousand cells costs as much as one of four.

The five numbers of a box stand side by side: an algorithm that jumps from cell to cell then waits for memory once a
box, not five times (components of a million cells of the Leslie map: 29 ms against 42).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.numbers.jit import generic, kernel
from limitsets.systems.cells import Grid

# Columns of `Ranges.box`.
START, RUN, ROWS, PLANES, SIDE = range(5)


class Ranges(NamedTuple):
    """Boxes of target cells.

    Attributes
    ----------
    first : ndarray of int64, shape (n_cells + 1,)
        Where each cell's boxes begin.
    box : ndarray of int32, shape (n_boxes, 5)
        First cell, cells per run, runs per plane, planes, side the box lies on.
    single : bool
        Each cell has one box, and its number: to look it up would cost a third of the time of the components.
    row_stride, plane_stride : ndarray of int64, shape (n_sides,)
        Steps in cell number from run to run and from plane to plane.
    exits : ndarray of uint8, shape (n_cells,)
        Bit e set: part of the cell's image leaves by exit e.
    """

    first: NDArray[np.int64]
    box: NDArray[np.int32]
    single: bool
    row_stride: NDArray[np.int64]
    plane_stride: NDArray[np.int64]
    exits: NDArray[np.uint8]


class Runs(NamedTuple):
    """A graph in which every cell has one run of targets: the first and the last, none where last < first."""

    first: NDArray[np.int64]
    last: NDArray[np.int64]


def build(
    grid: Grid,
    first: NDArray[np.int64],
    side: NDArray[np.int32],
    lo: NDArray[np.int32],
    hi: NDArray[np.int32],
    exits: NDArray[np.uint8],
) -> Ranges:
    """Make ranges of boxes given by their first and last position along each axis, shape (n_boxes, dimension)."""
    shape = grid.shape
    box = np.empty((len(side), 5), dtype=np.int32)
    _build(shape, grid.offset, side, lo, hi, box)
    single = len(box) == first.size - 1 and bool((np.diff(first) == 1).all())
    return Ranges(first, box, single, shape[:, -1].copy(), shape[:, -2:].prod(axis=1), exits)


@kernel(entry=True, counting=False)
def _build(shape: Any, offset: Any, side: Any, lo: Any, hi: Any, box: Any) -> None:
    dimension = shape.shape[1]
    for k in range(side.size):
        start = np.int64(lo[k, 0])
        for axis in range(1, dimension):
            start = start * shape[side[k], axis] + lo[k, axis]
        box[k, START] = start + offset[side[k]]
        for column in range(RUN, SIDE):
            axis = dimension - column
            box[k, column] = hi[k, axis] - lo[k, axis] + 1 if axis >= 0 else 1
        box[k, SIDE] = side[k]


def one_run(side: NDArray[Any], start: NDArray[Any], run: NDArray[Any]) -> NDArray[np.int32]:
    """Return the column `Ranges.box` of boxes of one run each."""
    one = np.ones_like(start)
    return np.stack([start, run, one, one, side], axis=1).astype(np.int32)


@generic
def boxes_of(r: Ranges | Runs, cell: Any) -> tuple[Any, Any]:
    """Return the number of a cell's first box, and of the first that is not its own."""


@generic
def box_at(r: Ranges | Runs, box: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Return a box: its first cell, cells per run, runs, runs per plane, and cells from run to run of a plane."""


@generic
def row_start(r: Ranges | Runs, box: Any, row: Any) -> Any:
    """First cell of a run."""


@kernel(counting=False)
def box_rows(r: Ranges, box: Any) -> Any:
    """Count the runs of a box."""
    return np.int64(r.box[box, ROWS]) * np.int64(r.box[box, PLANES])


def _boxes_of_cell(r: Ranges, cell: Any) -> tuple[Any, Any]:
    if r.single:
        return np.int64(cell), np.int64(cell) + 1
    return r.first[cell], r.first[cell + 1]


def _box_of_ranges(r: Ranges, box: Any) -> tuple[Any, Any, Any, Any, Any]:
    rows, stride = np.int64(r.box[box, ROWS]), r.row_stride[r.box[box, SIDE]]
    return np.int64(r.box[box, START]), np.int64(r.box[box, RUN]), box_rows(r, box), rows, stride


def _row_of_box(r: Ranges, box: Any, row: Any) -> Any:
    start, rows, side = np.int64(r.box[box, START]), np.int64(r.box[box, ROWS]), r.box[box, SIDE]
    if row < rows:
        return start + row * r.row_stride[side]
    return start + (row % rows) * r.row_stride[side] + (row // rows) * r.plane_stride[side]


boxes_of.on(Ranges, _boxes_of_cell)
boxes_of.on(Runs, lambda r, cell: (np.int64(cell), np.int64(cell) + 1))
box_at.on(Ranges, _box_of_ranges)
box_at.on(Runs, lambda r, box: (r.first[box], r.last[box] - r.first[box] + 1, 1, 1, 0))
row_start.on(Ranges, _row_of_box)
row_start.on(Runs, lambda r, box, row: r.first[box])


@kernel(entry=True, counting=False)
def _expand(r: Ranges, pointer: Any, targets: Any) -> None:
    for cell in range(r.first.size - 1):
        at = pointer[cell]
        begin_box, end_box = boxes_of(r, cell)
        for box in range(begin_box, end_box):
            for row in range(box_rows(r, box)):
                begin = row_start(r, box, row)
                for target in range(begin, begin + r.box[box, RUN]):
                    targets[at] = target
                    at += 1


def _sizes(r: Ranges) -> NDArray[np.int64]:
    """Cells per box."""
    return r.box[:, RUN].astype(np.int64) * r.box[:, ROWS] * r.box[:, PLANES]


def expand(r: Ranges) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Write every edge between cells out: ``(pointer, targets)`` as in a CSR matrix, ascending, none twice."""
    sizes = _sizes(r)
    filled = np.concatenate([[0], np.cumsum(sizes)])
    pointer = filled[r.first]
    targets = np.empty(int(pointer[-1]), dtype=np.int64)
    _expand(r, pointer, targets)
    if (np.diff(r.first) <= 1).all():
        return pointer, targets
    cells = np.repeat(np.arange(r.first.size - 1), np.diff(pointer))
    order = np.lexsort((targets, cells))
    cells, targets = cells[order], targets[order]
    new = np.ones(cells.size, dtype=bool)
    new[1:] = (np.diff(cells) != 0) | (np.diff(targets) != 0)
    counts = np.bincount(cells[new], minlength=r.first.size - 1)
    return np.concatenate([[0], np.cumsum(counts)]), targets[new]


def count_edges(r: Ranges) -> int:
    """Count the edges between cells, those that two boxes of a cell share once."""
    sizes = _sizes(r)
    several = np.flatnonzero(np.diff(r.first) > 1)
    total = int(sizes.sum())
    for cell in several.tolist():
        boxes = slice(int(r.first[cell]), int(r.first[cell + 1]))
        total += cells_of(r, boxes).size - int(sizes[boxes].sum())
    return total


def cells_of(r: Ranges, boxes: slice) -> NDArray[np.int64]:
    """Cells of some boxes, ascending, each once."""
    parts = [np.empty(0, np.int64)]
    for start, run, rows, planes, side in r.box[boxes].tolist():
        in_plane = np.arange(rows) * r.row_stride[side]
        corner = start + np.add.outer(np.arange(planes) * r.plane_stride[side], in_plane)
        parts.append(np.add.outer(corner, np.arange(run)).ravel())
    return np.unique(np.concatenate(parts))
