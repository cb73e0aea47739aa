"""Strongly connected components, their order, and reachability, on ranges.

`strong_components` is Tarjan's algorithm in Pearce's form (Inf. Proc. Letters 116, 2016) with an explicit stack: it
walks each cell's runs of targets where they lie.  Components come out in reverse topological order, so a component
can only lead to components of smaller number, and `reach` needs one sweep.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.graph import segment_tree
from limitsets.graph.ranges import RUN, Ranges, Runs, box_at, box_rows, boxes_of, row_start
from limitsets.jit import kernel


@dataclass(frozen=True, eq=False)
class Components:
    """Strongly connected components of the cells (the ways out are components of their own, not listed).

    Attributes
    ----------
    label : ndarray of int32, shape (n_cells,)
        Component of each cell; an edge never leads to a component of larger number.
    order : ndarray of int32, shape (n_cells,)
        The cells, component by component.
    size : ndarray of int64, shape (count,)
        Cells per component.
    recurrent : ndarray of bool, shape (count,)
        Components in which an orbit of cells can stay.
    """

    label: NDArray[np.int32]
    order: NDArray[np.int32]
    size: NDArray[np.int64]
    recurrent: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Number of components."""
        return int(self.size.size)


@kernel(entry=True, counting=False)
def fill_components(
    r: Ranges | Runs,
    rank: Any,
    label: Any,
    order: Any,
    path: Any,
    boxes: Any,
    rows: Any,
    waiting: Any,
    loops: Any,
) -> Any:
    """Fill `label`, `order` and `loops` (cells that meet their own image); the number of components.

    `rank` is 0 for a cell not yet met, the smallest visiting number known to be reachable while it is open, and
    ``n - component`` once its component is closed: always larger than any open number, so one minimum serves both.
    """
    n = label.size
    closed, done, held, clock = n, 0, 0, 1
    for root in range(n):
        if rank[root] != 0:
            continue
        depth = 0
        cell: Any = np.int64(root)
        box: Any = np.int64(boxes_of(r, root)[0])
        row: Any = np.int64(0)
        path[0] = root
        rank[root] = clock
        label[root] = clock  # its own number, to see later whether it reached an older one
        clock += 1
        while depth >= 0:
            best = rank[cell]
            child: Any = np.int64(-1)
            _, last = boxes_of(r, cell)
            while box < last and child < 0:
                start, run, count, flat, stride = box_at(r, box)
                while row < count:
                    begin = start + row * stride if row < flat else row_start(r, box, row)
                    if begin <= cell < begin + run:
                        loops[cell] = True
                    for target in range(begin, begin + run):
                        known = rank[target]
                        if known == 0:
                            child = target
                            break
                        best = min(best, known)
                    if child >= 0:
                        break
                    row += 1
                if child < 0:
                    box += 1
                    row = np.int64(0)
            rank[cell] = best
            if child >= 0:
                boxes[depth], rows[depth] = box, row
                depth += 1
                path[depth] = child
                rank[child] = clock
                label[child] = clock
                clock += 1
                cell, box, row = child, np.int64(boxes_of(r, child)[0]), np.int64(0)
                continue
            if best == label[cell]:  # nothing older reached: the cell closes a component
                clock -= 1
                while held > 0 and rank[waiting[held - 1]] >= best:
                    held -= 1
                    member = waiting[held]
                    rank[member] = closed
                    label[member] = n - closed
                    order[done] = member
                    done += 1
                    clock -= 1
                rank[cell] = closed
                label[cell] = n - closed
                order[done] = cell
                done += 1
                closed -= 1
            else:
                waiting[held] = cell
                held += 1
            depth -= 1
            if depth >= 0:
                cell, box, row = np.int64(path[depth]), np.int64(boxes[depth]), np.int64(rows[depth])
    return n - closed


@kernel(entry=True, counting=False)
def _reach(r: Ranges, size: Any, order: Any, marks: Any) -> None:
    i = 0
    for c in range(size.size):
        j, found = i + size[c], marks[order[i]]
        for k in range(i, j):
            cell = order[k]
            found |= marks[cell]
            begin_box, end_box = boxes_of(r, cell)
            for box in range(begin_box, end_box):
                run = np.int64(r.box[box, RUN])
                for row in range(box_rows(r, box)):
                    begin = row_start(r, box, row)
                    for target in range(begin, begin + run):
                        found |= marks[target]
        for k in range(i, j):
            marks[order[k]] = found
        i = j


@kernel(entry=True, counting=False)
def _ranks(r: Ranges, label: Any, order: Any, settled: Any, rank: Any) -> None:
    i = 0
    while i < order.size:
        c, j, highest = label[order[i]], i, -1
        while j < order.size and label[order[j]] == c:
            cell = order[j]
            begin_box, end_box = boxes_of(r, cell)
            for box in range(begin_box, end_box):
                for row in range(box_rows(r, box)):
                    begin = row_start(r, box, row)
                    for target in range(begin, begin + r.box[box, RUN]):
                        if label[target] != c:
                            highest = max(highest, rank[target])
            j += 1
        for k in range(i, j):
            rank[order[k]] = 0 if settled[c] else highest + 1
        i = j


@kernel(entry=True, counting=False)
def _descend(r: Ranges, seen: Any, stack: Any, held: int) -> None:
    while held > 0:
        held -= 1
        cell = stack[held]
        begin_box, end_box = boxes_of(r, cell)
        for box in range(begin_box, end_box):
            for row in range(box_rows(r, box)):
                begin = row_start(r, box, row)
                for target in range(begin, begin + r.box[box, RUN]):
                    if not seen[target]:
                        seen[target] = True
                        stack[held] = target
                        held += 1


def strong_components(r: Ranges) -> Components:
    """Strongly connected components of the cells; recurrent are those of several cells or with a loop."""
    if segment_tree.is_wide(r):
        label, order, loops, count = segment_tree.strong(r)
        return _components(label, order, loops, count)
    n = r.first.size - 1
    label, order = np.empty(n, np.int32), np.empty(n, np.int32)
    path, waiting, rows = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n, np.int32)
    boxes = np.empty(n, np.int64 if len(r.box) >= 2**31 else np.int32)
    loops = np.zeros(n, dtype=np.bool_)
    count = fill_components(r, np.zeros(n, np.int32), label, order, path, boxes, rows, waiting, loops)
    return _components(label, order, loops, count)


def _components(
    label: NDArray[np.int32], order: NDArray[np.int32], loops: NDArray[np.bool_], count: int
) -> Components:
    size = np.bincount(label, minlength=count)
    recurrent = size > 1
    recurrent[label[loops]] = True
    return Components(label, order, size, recurrent)


def reach(r: Ranges, components: Components, marks: NDArray[Any]) -> NDArray[Any]:
    """Spread marks backwards along the edges: bit b of a cell's answer says that it can reach mark b.

    Parameters
    ----------
    r : Ranges
        The graph.
    components : Components
        Its strong components.
    marks : ndarray of an unsigned type, shape (n_cells,)
        The bits that each cell carries itself.

    Returns
    -------
    ndarray, shape (n_cells,)
        The bits it carries or can reach, in any number of steps.
    """
    if segment_tree.is_wide(r):
        return segment_tree.reach(r, components.label, components.order, marks)
    spread = marks.copy()
    _reach(r, components.size, components.order, spread)
    return spread


def ranks(r: Ranges, components: Components, settled: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Longest path from each component to a settled one, counted in components.

    Parameters
    ----------
    r : Ranges
        The graph.
    components : Components
        Its strong components.
    settled : ndarray of bool, shape (count,)
        Components whose cells have rank 0.

    Returns
    -------
    ndarray of int32, shape (n_cells,)
        The same on all cells of a component, and falling strictly along edges from one component to another, but for
        those that are settled.  Where every recurrent component is settled the rank bounds the steps until an orbit is
        in one.
    """
    if segment_tree.is_wide(r):
        return segment_tree.ranks(r, components.label, components.order, settled)
    rank = np.zeros(r.first.size - 1, dtype=np.int32)
    _ranks(r, components.label, components.order, settled, rank)
    return rank


def descend(r: Ranges, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Cells that can be reached from the given ones in one step or more."""
    if segment_tree.is_wide(r):
        return segment_tree.descend(r, cells)
    n = r.first.size - 1
    seen, stack = np.zeros(n, dtype=np.bool_), np.empty(n + cells.size, np.int64)
    stack[: cells.size] = cells
    _descend(r, seen, stack, cells.size)
    return seen
