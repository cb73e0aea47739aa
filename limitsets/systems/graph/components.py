"""Strongly connected components, reachability and the condensation, on ranges of cells.

`strong_components` is Tarjan's algorithm in Pearce's form (Inf. Proc. Letters 116, 2016) with an explicit stack: it
walks each cell's runs of targets where they lie.  Components come out in reverse topological order, so a component
can only lead to components of smaller number, and `reach` needs one sweep.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.numbers.jit import kernel
from limitsets.systems.graph import segment_tree
from limitsets.systems.graph.ranges import RUN, Ranges, Runs, box_at, box_rows, boxes_of, row_start
from limitsets.systems.maps import codes


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
        j, reached_marks = i + size[c], marks[order[i]]
        for k in range(i, j):
            cell = order[k]
            reached_marks |= marks[cell]
            begin_box, end_box = boxes_of(r, cell)
            for box in range(begin_box, end_box):
                run = np.int64(r.box[box, RUN])
                for row in range(box_rows(r, box)):
                    begin = row_start(r, box, row)
                    for target in range(begin, begin + run):
                        reached_marks |= marks[target]
        for k in range(i, j):
            marks[order[k]] = reached_marks
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


# ----------------------------------------------------------------
# The condensation: order of the recurrent components and destinations of all cells, by sweeps over the graph.


# Components per sweep; the other bits of a 64-bit mark are for the ways out.
SETS_PER_SWEEP = 56


@dataclass(frozen=True, eq=False)
class Condensation:
    """Order of the recurrent components and destinations of the cells, each found when it is first asked for.

    Attributes
    ----------
    ranges : Ranges
        The graph.
    components : Components
        Its strong components.
    ways_out : dict of str to int
        Names and codes of the ways out.
    sets : sequence of ndarray
        Cells of each of the k recurrent components.
    """

    ranges: Ranges
    components: Components
    ways_out: dict[str, int]
    sets: Sequence[NDArray[np.int32]]

    @cached_property
    def attracting(self) -> NDArray[np.bool_]:
        """Whether each recurrent component leads nowhere else, shape (k,)."""
        return attracting_of(self.ranges, self.components, self.sets)

    @property
    def order(self) -> NDArray[np.bool_]:
        """``order[i, j]``: from recurrent component i cells lead to j (each to itself); shape (k, k)."""
        return self._reached[:, : len(self.sets)]

    @property
    def exits(self) -> NDArray[np.bool_]:
        """Which ways out each recurrent component can reach, shape (k, n_exits)."""
        return self._reached[:, len(self.sets) :]

    @cached_property
    def destination(self) -> NDArray[np.int32]:
        """What every path from the cell ends in, shape (n_cells,).

        Attractor number (0 for the first attracting component) or the code of an exit; `UNDECIDED` (-4) where paths
        end in different places, or may stay in a recurrent component that is not attracting.
        """
        return self.destinations(np.zeros(len(self.sets), dtype=bool))

    def destinations(self, passing: NDArray[np.bool_]) -> NDArray[np.int32]:
        """Find the destinations where some components, of k, are known to hold no orbit for ever."""
        attracting = self.attracting
        # An orbit may stay in a set that is not closed: where one can be reached, nothing is said.
        code = np.where(attracting, np.cumsum(attracting) - 1, codes.UNDECIDED).tolist()
        names = {k: code[k] for k in np.flatnonzero(attracting | ~passing).tolist()}
        if len(self.sets) <= SETS_PER_SWEEP:
            return self._ended(self._marks, names, len(self.sets), None)
        ends = [(self.sets[k], code[k]) for k in np.flatnonzero(attracting).tolist()]
        lasting = [self.sets[k] for k, number in names.items() if number == codes.UNDECIDED]
        if lasting:
            ends.append((np.concatenate(lasting), codes.UNDECIDED))
        destination: NDArray[np.int32] | None = None
        for begin in range(0, max(len(ends), 1), SETS_PER_SWEEP):
            chunk = ends[begin : begin + SETS_PER_SWEEP]
            marks = self._swept([cells for cells, _ in chunk])
            named = {bit: number for bit, (_, number) in enumerate(chunk)}
            destination = self._ended(marks, named, len(chunk), destination)
        assert destination is not None  # the loop runs once at least
        return destination

    def _swept(self, sets: Sequence[NDArray[np.int32]]) -> NDArray[Any]:
        """Mark each cell with a bit for each set, and above these for each way out, that it can reach."""
        kind: Any = np.uint8 if len(sets) + len(self.ways_out) <= 8 else np.uint64
        marks: Any = self.ranges.exits.astype(kind) << kind(len(sets))
        for bit, cells in enumerate(sets):
            marks[cells] |= kind(1 << bit)
        return reach(self.ranges, self.components, marks)

    @cached_property
    def _marks(self) -> NDArray[Any]:
        """The marks of all sets: one sweep is enough for them, and serves order and destinations alike."""
        return self._swept(self.sets)

    def _ended(
        self, marks: NDArray[Any], names: dict[int, int], first_exit: int, so_far: NDArray[np.int32] | None
    ) -> NDArray[np.int32]:
        exits = {first_exit + e: code for e, code in enumerate(self.ways_out.values())}
        return _destinations(marks, names | exits, so_far)

    @cached_property
    def _reached(self) -> NDArray[np.bool_]:
        """Which components, and after them which ways out, each component can reach."""
        k, ways_out = len(self.sets), len(self.ways_out)
        reached = np.zeros((k, k + ways_out), dtype=bool)
        one_of_each = np.array([cells[0] for cells in self.sets], dtype=np.int64)
        for begin in range(0, k, SETS_PER_SWEEP):
            chunk = self.sets[begin : begin + SETS_PER_SWEEP]
            marks = self._marks if k <= SETS_PER_SWEEP else self._swept(chunk)
            bits = np.arange(len(chunk) + ways_out, dtype=np.uint64)
            seen = (marks[one_of_each].astype(np.uint64)[:, None] >> bits & np.uint64(1)).astype(bool)
            reached[:, begin : begin + len(chunk)] = seen[:, : len(chunk)]
            reached[:, k:] = seen[:, len(chunk) :]
        return reached


@kernel(counting=False)
def _leaves(r: Ranges, label: Any, cells: Any) -> bool:
    """Whether an edge leads out of the component that the given cells make up."""
    for cell in cells:
        if r.exits[cell]:
            return True
        begin_box, end_box = boxes_of(r, cell)
        for box in range(begin_box, end_box):
            for row in range(box_rows(r, box)):
                begin = row_start(r, box, row)
                for target in range(begin, begin + r.box[box, RUN]):
                    if label[target] != label[cell]:
                        return True
    return False


def _destinations(
    bits: NDArray[Any], names: dict[int, int], so_far: NDArray[np.int32] | None
) -> NDArray[np.int32]:
    """Destinations after one more sweep: `names` gives what each bit that counts stands for."""
    nothing = np.int32(-(2**31))
    if bits.dtype == np.uint8:
        table = np.full(256, codes.UNDECIDED, dtype=np.int32)
        count = sum(np.arange(256) >> bit & 1 for bit in names)
        for bit, name in names.items():
            table[(count == 1) & (np.arange(256) >> bit & 1 == 1)] = name
        table[np.asarray(count) == 0] = nothing
        now: NDArray[np.int32] = table[bits]
    else:
        relevant = bits & np.uint64(sum(1 << bit for bit in names))
        now = np.where(relevant == 0, nothing, np.int32(codes.UNDECIDED)).astype(np.int32)
        for bit, name in names.items():
            now[relevant == np.uint64(1 << bit)] = name
    if so_far is None:
        return now
    both = np.where(
        now == nothing, so_far, np.where((so_far == nothing) | (so_far == now), now, codes.UNDECIDED)
    )
    return np.asarray(both, dtype=np.int32)


@kernel(entry=True, counting=False)
def _attracting(r: Ranges, label: Any, cells: Any, ends: Any, out: Any) -> None:
    """Whether each component, whose cells end at these places, is attracting; thousands are of one cell each."""
    begin = 0
    for k in range(ends.size):
        out[k] = not _leaves(r, label, cells[begin : ends[k]])
        begin = ends[k]


def attracting_of(r: Ranges, components: Components, sets: Sequence[NDArray[np.int32]]) -> NDArray[np.bool_]:
    """Whether each recurrent component is attracting: no edge and no way out leads from it; of any number of them."""
    if segment_tree.is_wide(r):
        return np.array([not segment_tree.leaves(r, components.label, cells) for cells in sets], dtype=bool)
    attracting = np.zeros(len(sets), dtype=np.bool_)
    if sets:
        ends = np.cumsum([cells.size for cells in sets])
        _attracting(r, components.label, np.concatenate(sets), ends, attracting)
    return attracting
