"""The condensation: order of the recurrent components and destinations of all cells, by sweeps over the graph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.graph import segment_tree
from limitsets.graph.components import Components, reach
from limitsets.graph.ranges import RUN, Ranges, box_rows, boxes_of, row_start
from limitsets.jit import kernel
from limitsets.maps import codes

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
    merged: NDArray[np.int32] = both.astype(np.int32)
    return merged


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
    found = np.zeros(len(sets), dtype=np.bool_)
    if sets:
        ends = np.cumsum([cells.size for cells in sets])
        _attracting(r, components.label, np.concatenate(sets), ends, found)
    return found
