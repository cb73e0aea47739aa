"""Images of cells as boxes of target cells: the form in which every graph algorithm reads the graph.

A box is a block of cells of one side, kept as the number of its first cell, the length of its runs of consecutive
cells and the numbers of such runs (rows, and planes of rows in three dimensions).  Cell k's boxes are
``first[k]:first[k + 1]``.  Edges are never written out: a box of a thousand cells costs as much as one of four.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.jit import kernel

__all__ = ["Ranges", "box_rows", "build", "count_edges", "expand", "row_start"]


class Ranges(NamedTuple):
    """Boxes of target cells.

    Attributes
    ----------
    first : ndarray of int64, shape (n_cells + 1,)
        Where each cell's boxes begin.
    start, run, rows, planes : ndarray of int32, shape (n_boxes,)
        First cell, cells per run, runs per plane, planes.
    side : ndarray of int32, shape (n_boxes,)
        Side the box lies on.
    row_stride, plane_stride : ndarray of int64, shape (n_sides,)
        Steps in cell number from run to run and from plane to plane.
    exits : ndarray of uint8, shape (n_cells,)
        Bit e set: part of the cell's image leaves by exit e.
    """

    first: NDArray[np.int64]
    start: NDArray[np.int32]
    run: NDArray[np.int32]
    rows: NDArray[np.int32]
    planes: NDArray[np.int32]
    side: NDArray[np.int32]
    row_stride: NDArray[np.int64]
    plane_stride: NDArray[np.int64]
    exits: NDArray[np.uint8]


def build(
    grid: Grid,
    first: NDArray[np.int64],
    side: NDArray[np.int32],
    lo: NDArray[np.int32],
    hi: NDArray[np.int32],
    exits: NDArray[np.uint8],
) -> Ranges:
    """Make ranges of boxes given by their first and last position along each axis, shape (n_boxes, dimension)."""
    shape, dimension = grid.shape, grid.dimension
    row_stride = shape[:, -1].copy()
    plane_stride = shape[:, -2:].prod(axis=1)
    start = lo[:, 0].astype(np.int64)
    for axis in range(1, dimension):
        start *= shape[side, axis] if grid.sides > 1 else shape[0, axis]
        start += lo[:, axis]
    if grid.sides > 1:
        start += grid.offset[side]
    extent = hi - lo + 1
    one = np.ones(len(side), dtype=np.int32)
    return Ranges(
        first,
        start.astype(np.int32),
        np.ascontiguousarray(extent[:, -1]),
        np.ascontiguousarray(extent[:, -2]) if dimension > 1 else one,
        np.ascontiguousarray(extent[:, -3]) if dimension > 2 else one,
        side,
        row_stride,
        plane_stride,
        exits,
    )


@kernel
def box_rows(r: Ranges, box: Any) -> Any:
    """Count the runs of a box."""
    return np.int64(r.rows[box]) * np.int64(r.planes[box])


@kernel
def row_start(r: Ranges, box: Any, row: Any) -> Any:
    """First cell of a run."""
    rows = np.int64(r.rows[box])
    if row < rows:
        return r.start[box] + row * r.row_stride[r.side[box]]
    return (
        r.start[box] + (row % rows) * r.row_stride[r.side[box]] + (row // rows) * r.plane_stride[r.side[box]]
    )


@kernel(entry=True)
def _expand(r: Ranges, pointer: Any, targets: Any) -> None:
    for cell in range(r.first.size - 1):
        at = pointer[cell]
        for box in range(r.first[cell], r.first[cell + 1]):
            for row in range(box_rows(r, box)):
                begin = row_start(r, box, row)
                for target in range(begin, begin + r.run[box]):
                    targets[at] = target
                    at += 1


def expand(r: Ranges) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Write every edge between cells out: ``(pointer, targets)`` as in a CSR matrix, ascending, none twice."""
    sizes = r.run.astype(np.int64) * r.rows * r.planes
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
    sizes = r.run.astype(np.int64) * r.rows * r.planes
    several = np.flatnonzero(np.diff(r.first) > 1)
    total = int(sizes.sum())
    for cell in several.tolist():
        boxes = slice(int(r.first[cell]), int(r.first[cell + 1]))
        total += len(_cells_of(r, boxes)) - int(sizes[boxes].sum())
    return total


def _cells_of(r: Ranges, boxes: slice) -> set[int]:
    found: set[int] = set()
    for box in range(boxes.start, boxes.stop):
        stride, plane = int(r.row_stride[r.side[box]]), int(r.plane_stride[r.side[box]])
        for p in range(int(r.planes[box])):
            for row in range(int(r.rows[box])):
                begin = int(r.start[box]) + row * stride + p * plane
                found.update(range(begin, begin + int(r.run[box])))
    return found
