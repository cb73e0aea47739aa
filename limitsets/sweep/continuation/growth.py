"""Sets of intervals grown from inside: images of short pieces of an orbit, until they fill what the orbit fills.

Cells enclose an attractor from outside, and with it whatever unstable cycle lies in a gap narrower than they are.
Images of a short interval around a point of the attractor never leave the attractor, so that no gap is closed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from limitsets.maps import along
from limitsets.maps.bisection import Array
from limitsets.sets.cycle import Ints
from limitsets.sets.interval_map import IntervalMap
from limitsets.sets.unions import BORDER, Union, read, same

# Of the extent: half the length of the first pieces, the length at which their images are kept, what counts as none.
SHORT, LONG, NONE = 1e-9, 1e-3, 1e-14
MOST_STEPS, MOST_INTERVALS = 3000, 4000
# Pieces that have not grown tenfold by then do not expand: a quasi-periodic orbit, or the ghost of a cycle.
EARLY, TENFOLD = 500, 10.0


class _Intervals(NamedTuple):
    """Disjoint closed intervals, ascending by side."""

    side: Ints
    lo: Array
    hi: Array


class _Pieces:
    """The monotone pieces of a map as arrays."""

    def __init__(self, forward: IntervalMap, extent: float) -> None:
        rows = [
            (side, piece.branch, piece.bottom.x, piece.top.x)
            for side, pieces in forward.pieces.items()
            for piece in pieces
        ]
        table = np.array(rows, dtype=np.float64).reshape(-1, 4)
        self.params, self.extent = forward.params, extent
        self.side, self.branch = table[:, 0].astype(np.int64), table[:, 1].astype(np.int64)
        self.bottom, self.top = table[:, 2], table[:, 3]
        self.lo, self.hi = (np.array(ends) for ends in zip(*forward.bounds, strict=True))

    def image(self, given: _Intervals) -> _Intervals:
        """F of some intervals; what leaves the domain is dropped."""
        lo = np.maximum(given.lo[:, None], self.bottom)
        hi = np.minimum(given.hi[:, None], self.top)
        # A part that only rounding makes would be thrown elsewhere, far from everything.
        row, k = np.nonzero((given.side[:, None] == self.side) & (hi - lo > NONE * self.extent))
        count = row.size
        if count == 0:
            return _Intervals(row, lo[row, k], hi[row, k])
        x = np.concatenate([lo[row, k], hi[row, k]])
        y, to, _ = along(self.params, x, np.tile(self.side[k], 2), np.tile(self.branch[k], 2)[:, None])
        to = to[:count]
        inside = (to >= 0) & (to < self.lo.size)
        at = np.where(inside, to, 0)
        low = np.maximum(np.minimum(y[:count], y[count:]), self.lo[at])
        high = np.minimum(np.maximum(y[:count], y[count:]), self.hi[at])
        kept = inside & (low <= high)
        return self.joined(_Intervals(to[kept], low[kept], high[kept]))

    def joined(self, *given: _Intervals) -> _Intervals:
        """Union; intervals that touch up to rounding are one."""
        side, lo, hi = (
            np.concatenate([getattr(each, name) for each in given]) for name in _Intervals._fields
        )
        order = np.lexsort((lo, side))
        side, lo, hi = side[order], lo[order], hi[order]
        parts = []
        for s in np.unique(side):
            here = side == s
            low, top = lo[here], np.maximum.accumulate(hi[here])
            begins = np.concatenate([[True], low[1:] > top[:-1] + NONE * self.extent])
            ends = np.concatenate([np.flatnonzero(begins)[1:] - 1, [low.size - 1]])
            parts.append((np.full(ends.size, s), low[begins], top[ends]))
        if not parts:
            return _Intervals(side, lo, hi)
        return _Intervals(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _same(one: _Intervals, other: _Intervals, extent: float) -> bool:
    if one.lo.size != other.lo.size:
        return False
    moved = max(np.abs(one.lo - other.lo).max(initial=0.0), np.abs(one.hi - other.hi).max(initial=0.0))
    return bool((one.side == other.side).all() and moved <= 1e-13 * extent)


def grown(
    forward: IntervalMap, x: Array, side: Ints, extent: float
) -> dict[int, list[tuple[float, float]]] | None:
    """Union of all images of short intervals around some points; None where they do not grow, or do not settle."""
    pieces = _Pieces(forward, extent)
    lo, hi = np.maximum(x - SHORT * extent, pieces.lo[side]), np.minimum(x + SHORT * extent, pieces.hi[side])
    found = pieces.joined(_Intervals(side, lo, hi))
    first = float((found.hi - found.lo).sum())
    for count in range(MOST_STEPS):
        length = float((found.hi - found.lo).sum())
        if length >= LONG * extent:
            break
        found = pieces.image(found)
        if not 0 < found.lo.size <= MOST_INTERVALS or (count == EARLY and length < TENFOLD * first):
            return None
    if float((found.hi - found.lo).sum()) < SHORT * extent:
        return None
    for _ in range(MOST_STEPS):
        after = pieces.joined(found, pieces.image(found))
        if _same(found, after, extent):
            extents: dict[int, list[tuple[float, float]]] = {}
            for s, low, high in zip(after.side.tolist(), after.lo.tolist(), after.hi.tolist(), strict=True):
                extents.setdefault(s, []).append((low, high))
            return extents
        if after.lo.size > MOST_INTERVALS:
            return None
        found = after
    return None


def carried(
    forward: IntervalMap,
    extents: dict[int, list[tuple[float, float]]],
    domain: object,
    extent: float,
    images: int,
    *,
    rest: bool,
) -> tuple[Union, bool]:
    """Take images of a set until each end comes from a critical orbit or, with `rest`, until no end moves.

    Returns
    -------
    union, bool
        The set with its ends, empty where part of it leaves the domain: then it is no attractor, however long its
        orbits stay; and whether its ends came to be so.
    """
    union, rested = read(extents, domain), 0  # type: ignore[arg-type]  # a Domain
    for _ in range(images):
        image, leaves = forward.image(union)
        if leaves:
            return {}, False
        rested = rested + 1 if same(union, image, 1e-12, extent) else 0
        union = image
        known = all(end.kind != BORDER for parts in union.values() for part in parts for end in part)
        if not union or (rested >= 2 if rest else known):
            return union, bool(union)
    return union, False
