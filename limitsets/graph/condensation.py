"""The condensation: order of the recurrent components and destinations of all cells, in one sweep over the graph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.graph import segment_tree
from limitsets.graph.components import Components, reach
from limitsets.graph.ranges import RUN, Ranges, box_rows, boxes_of, row_start
from limitsets.jit import kernel
from limitsets.maps import codes

__all__ = ["Condensation", "attracting_of", "condense"]

# Components per sweep; the other bits of a 64-bit mark are for the ways out.
SETS_PER_SWEEP = 56


@dataclass(frozen=True, eq=False)
class Condensation:
    """Order of the recurrent components and destinations of the cells.

    Attributes
    ----------
    order : ndarray of bool, shape (k, k)
        ``order[i, j]``: from recurrent component i cells lead to j (each to itself).
    exits : ndarray of bool, shape (k, n_exits)
        Which ways out it can reach.
    attracting : ndarray of bool, shape (k,)
        It leads nowhere else.
    destination : ndarray of int32, shape (n_cells,)
        What every path from the cell ends in: attractor number (0 for the first attracting component) or the code
        of an exit; `UNDECIDED` (-4) where paths end in different places, or may stay in a recurrent component that
        is not attracting.
    """

    order: NDArray[np.bool_]
    exits: NDArray[np.bool_]
    attracting: NDArray[np.bool_]
    destination: NDArray[np.int32]


@kernel(entry=True, counting=False)
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


def attracting_of(r: Ranges, components: Components, sets: Sequence[NDArray[np.int32]]) -> NDArray[np.bool_]:
    """Whether each recurrent component is attracting: no edge and no way out leads from it; of any number of them."""
    leads_out = segment_tree.leaves if segment_tree.is_wide(r) else _leaves
    return np.array([not leads_out(r, components.label, cells) for cells in sets], dtype=bool)


def condense(
    r: Ranges,
    components: Components,
    exits: dict[str, int],
    sets: Sequence[NDArray[np.int32]],
    passing: NDArray[np.bool_] | None = None,
) -> Condensation:
    """Sweep the graph, up to 56 recurrent components at a time.

    Parameters
    ----------
    r : Ranges
        The graph.
    components : Components
        Its strong components.
    exits : dict of str to int
        Names and codes of the ways out.
    sets : sequence of ndarray
        Cells of each recurrent component.
    passing : ndarray of bool, shape (k,), optional
        Components known to hold no orbit for ever; none.

    Returns
    -------
    Condensation
        Order, attracting components, destinations.
    """
    k = len(sets)
    attracting = attracting_of(r, components, sets)
    number = np.cumsum(attracting) - 1
    order, out = np.zeros((k, k), dtype=bool), np.zeros((k, len(exits)), dtype=bool)
    destination: NDArray[np.int32] | None = None
    one_of_each = np.array([cells[0] for cells in sets], dtype=np.int64)
    for begin in range(0, max(k, 1), SETS_PER_SWEEP):
        chunk = sets[begin : begin + SETS_PER_SWEEP]
        bits = len(chunk) + len(exits)
        kind: Any = np.uint8 if bits <= 8 else np.uint64
        marks: Any = r.exits.astype(kind) << kind(len(chunk))
        for b, cells in enumerate(chunk):
            marks[cells] |= kind(1 << b)
        marks = reach(r, components, marks)
        seen = marks[one_of_each].astype(np.uint64)
        names = {len(chunk) + e: code for e, code in enumerate(exits.values())}
        for b in range(len(chunk)):
            order[:, begin + b] = seen >> np.uint64(b) & np.uint64(1)
            # An orbit may stay in a set that is not closed: where one can be reached, nothing is said.
            if attracting[begin + b]:
                names[b] = int(number[begin + b])
            elif passing is None or not passing[begin + b]:
                names[b] = codes.UNDECIDED
        for e in range(len(exits)):
            out[:, e] = seen >> np.uint64(len(chunk) + e) & np.uint64(1)
        destination = _destinations(marks, names, destination)
    assert destination is not None  # the loop runs once at least
    return Condensation(order, out, attracting, destination)
