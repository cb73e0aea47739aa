"""Images of boxes, and their hulls: one for each side and branch.

The joining is compiled: done in numpy it took a third of the time of a rigorous image.  Only the loop that asks the map
is compiled for each map; the others know but the number of coordinates.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.jit import proof_kernel, take_mark
from limitsets.maps.kernels import fallback_box, image_box, on_side_box, pick, put

Floats: TypeAlias = NDArray[np.float64]
Columns: TypeAlias = tuple[Floats, ...]

NOTHING, DECIDED, BOTH = -1, 1, 2


@proof_kernel
def _store(answer: Any, k: int, count: Any, first: Any, second: Any, to: Any, witness: Any) -> None:
    """Keep an answer: corners of the slots in `first` and `second`, their sides and branches in `to`."""
    n, a, b, w = answer
    count[k] = n
    put(first[0], k, a[0])
    put(first[1], k, a[1])
    put(second[0], k, b[0])
    put(second[1], k, b[1])
    to[0, k], to[1, k], to[2, k], to[3, k] = a[2], a[3], b[2], b[3]
    witness[0, k], witness[1, k] = w


@proof_kernel(entry=True, counting=False)
def _enclose(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, kept: Any) -> bool:
    """Images of boxes; whether a function was asked beyond where it is defined, for any of them."""
    take_mark()
    one, two = on_side_box(lo_map, hi_map, side)
    for k in range(lo[0].size):
        _store(image_box(one, two, pick(lo, k), pick(hi, k), side), k, *kept)
    return bool(take_mark())


@proof_kernel(entry=True, counting=False)
def _find_undefined(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, count: Any) -> None:
    """Give up the boxes on which one was: apart from the loop above, which it would keep from vectorising."""
    for k in range(count.size):
        take_mark()
        one, two = on_side_box(lo_map, hi_map, side)
        found = image_box(one, two, pick(lo, k), pick(hi, k), side)
        count[k] = NOTHING if take_mark() else found[0]


@proof_kernel(entry=True, counting=False)
def _enclose_surely(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, again: Any, kept: Any) -> None:
    """Images of some of them, the slow and sure way."""
    one, two = on_side_box(lo_map, hi_map, side)
    for k in again:
        take_mark()
        _store(fallback_box(one, two, pick(lo, k), pick(hi, k), side), k, *kept)
        if take_mark():
            kept[0][k] = NOTHING


@proof_kernel(entry=True)
def _refuse(count: Any, first: Any, second: Any) -> None:
    """Give up the answers that are none of the three, or no finite box.  A nan is no finite box."""
    for k in range(count.size):
        n = count[k]
        count[k] = n if (n == DECIDED) | (n == BOTH) else NOTHING
    for axis in range(len(first[0])):
        for k in range(count.size):
            lo, hi = first[0][axis][k], first[1][axis][k]
            real = (lo > -math.inf) & (lo <= hi) & (hi < math.inf)
            count[k] = count[k] if real else NOTHING
        for k in range(count.size):
            lo, hi = second[0][axis][k], second[1][axis][k]
            real = (lo > -math.inf) & (lo <= hi) & (hi < math.inf)
            count[k] = count[k] if real | (count[k] != BOTH) else NOTHING


@proof_kernel(entry=True)
def _widen(begin: int, wanted: Any, lo: Any, hi: Any, side: Any, branch: Any, cells: Any, hull: Any) -> int:
    """Widen one hull by the wanted images that lead where image `begin` leads; the first that leads elsewhere.

    They are wanted no longer.  `cells` are those the images belong to, the same number of consecutive ones each.
    """
    least, most = hull
    to, by = side[begin], branch[begin]
    pieces = wanted.size // cells.size
    elsewhere: int = wanted.size
    for c in range(begin // pieces, cells.size):
        cell = cells[c]
        for k in range(c * pieces, (c + 1) * pieces):
            if not wanted[k]:
                continue
            if (side[k] != to) | (branch[k] != by):
                elsewhere = min(elsewhere, k)
                continue
            wanted[k] = False
            for axis in range(len(lo)):
                least[axis][cell] = min(least[axis][cell], lo[axis][k])
                most[axis][cell] = max(most[axis][cell], hi[axis][k])
    return elsewhere


class BoxImages:
    """Images of boxes: `count`, and per slot the corners, an array for each axis, the sides and the branches.

    `count` is NOTHING too where the answer is none of the three, or no finite box, or a function was asked beyond where
    it is defined.
    """

    def __init__(self, lo_map: Any, hi_map: Any, side: int, lo: Columns, hi: Columns) -> None:
        n, axes = lo[0].size, range(len(lo))
        self.count, self.to, self.witness = (
            np.empty(n, np.int8),
            np.empty((4, n), np.int32),
            np.empty((2, n)),
        )
        self.slots = [tuple(tuple(np.empty(n) for _ in axes) for _ in range(2)) for _ in range(2)]
        kept = (self.count, *self.slots, self.to, self.witness)
        if _enclose(lo_map, hi_map, side, lo, hi, kept):
            _find_undefined(lo_map, hi_map, side, lo, hi, self.count)
        again = np.flatnonzero(self.count == NOTHING)
        if again.size and type(lo_map) in fallback_box.methods:
            _enclose_surely(lo_map, hi_map, side, lo, hi, again, kept)
        _refuse(self.count, *self.slots)


class Hulls:
    """Hulls of the images of n cells: for each (side, branch) the corners, an array for each axis."""

    def __init__(self, n: int, dimension: int) -> None:
        self.n, self.dimension = n, dimension
        self.found: dict[tuple[int, int], tuple[Columns, Columns]] = {}

    def join(self, images: BoxImages, wanted: NDArray[np.bool_], slot: int, cells: NDArray[np.int64]) -> None:
        """Widen them by one slot of the wanted images, those of the pieces of `cells`, which follow each other."""
        lo, hi = images.slots[slot]
        side, branch = images.to[2 * slot], images.to[2 * slot + 1]
        left = wanted.copy()
        begin = int(left.argmax()) if left.any() else left.size
        while begin < left.size:
            key = int(side[begin]), int(branch[begin])
            if key not in self.found:
                self.found[key] = self._empty(math.inf), self._empty(-math.inf)
            begin = _widen(begin, left, lo, hi, side, branch, cells, self.found[key])

    def _empty(self, end: float) -> Columns:
        return tuple(np.full(self.n, end) for _ in range(self.dimension))

    def arrays(self) -> dict[tuple[int, int], tuple[Floats, Floats]]:
        """Hulls with corners of shape (n,), in more than one dimension (n, dimension)."""
        if self.dimension == 1:
            return {key: (lo[0], hi[0]) for key, (lo, hi) in self.found.items()}
        return {key: (np.stack(lo, axis=1), np.stack(hi, axis=1)) for key, (lo, hi) in self.found.items()}
