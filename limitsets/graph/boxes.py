"""Boxes of target cells, before they become ranges."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.graph.target import Target, place
from limitsets.jit import kernel


@dataclass(frozen=True, eq=False)
class TargetBoxes:
    """Boxes of cells of one side: `cell` (local, ascending), `side`, `lo`, `hi` of shape (n, dimension), `exits`."""

    cell: NDArray[np.int64]
    side: NDArray[np.int32]
    lo: NDArray[np.int32]
    hi: NDArray[np.int32]
    exits: NDArray[np.uint8]
    second_pass: float


def no_boxes(dimension: int) -> TargetBoxes:
    """Boxes of a side without cells."""
    none, corner = np.empty(0, np.int64), np.empty((0, dimension), np.int32)
    return TargetBoxes(none, none.astype(np.int32), corner, corner.copy(), np.empty(0, np.uint8), 0.0)


@kernel(entry=True, counting=False)
def _place_hulls(
    target: Target, side: Any, lo: Any, hi: Any, pad: int, first: Any, last: Any, exits: Any, met: Any
) -> None:
    hint = np.int64(0)
    for box in range(side.size):
        out, meets = 0, True
        for axis in range(lo.shape[1]):
            k, m, leaves = place(target, np.int64(side[box]), axis, lo[box, axis], hi[box, axis], pad, hint)
            out |= leaves
            meets &= m >= k
            first[box, axis], last[box, axis] = k, m
            hint = k
        exits[box], met[box] = out, meets


def placed(
    target: Target, cell: NDArray[np.int64], side: NDArray[np.int64], lo: Any, hi: Any, pad: int, inside: bool
) -> TargetBoxes:
    """Boxes of the given hulls; `inside`: they are forced images, which do not count as leaving."""
    count, dimension = lo.shape
    k, m = np.empty((count, dimension), np.int32), np.empty((count, dimension), np.int32)
    exits, met = np.empty(count, np.uint8), np.empty(count, np.bool_)
    _place_hulls(target, side, np.ascontiguousarray(lo), np.ascontiguousarray(hi), pad, k, m, exits, met)
    leaves = np.zeros(count, np.uint8) if inside else exits
    return TargetBoxes(cell[met], side[met].astype(np.int32), k[met], m[met], _per_cell(cell, leaves), 0.0)


def _per_cell(cell: NDArray[np.int64], exits: NDArray[np.uint8]) -> NDArray[np.uint8]:
    found = np.zeros(int(cell.max(initial=-1)) + 1, np.uint8)
    np.bitwise_or.at(found, cell, exits)
    return found


def leaving(target: Target, cell: NDArray[np.int64], code: NDArray[np.int64], dimension: int) -> TargetBoxes:
    """Mark the exits that codes name, without boxes."""
    bits = (1 << target.sink_of_code[-code]).astype(np.uint8)
    nothing, none = np.empty(0, np.int64), np.empty((0, dimension), np.int32)
    return TargetBoxes(nothing, nothing.astype(np.int32), none, none, _per_cell(cell, bits), 0.0)


def merged(parts: list[TargetBoxes], n: int, second: float) -> TargetBoxes:
    """Boxes of all parts, by cell."""
    cell = np.concatenate([part.cell for part in parts])
    order = np.argsort(cell, kind="stable")
    exits = np.zeros(n, np.uint8)
    for part in parts:
        exits[: part.exits.size] |= part.exits
    return TargetBoxes(
        cell[order],
        np.concatenate([part.side for part in parts])[order],
        np.concatenate([part.lo for part in parts])[order],
        np.concatenate([part.hi for part in parts])[order],
        exits,
        second,
    )
