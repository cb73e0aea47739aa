"""Sets found from orbits: intervals grown from inside until they fill an attractor, and attracting cycles.

Cells enclose an attractor from outside, and with it whatever unstable cycle lies in a gap narrower than they are.
Images of a short interval around a point of the attractor never leave the attractor, so that no gap is closed.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple, TypeAlias

import numpy as np

from limitsets.parameters.continuation.path import Place
from limitsets.systems.maps import advance, along
from limitsets.systems.maps.critical import Array, Flags
from limitsets.systems.sets.closing import Cycle, Ints, stepped
from limitsets.systems.sets.end_points import EPS, IntervalMap

# Of the extent: half the length of the first pieces, the length at which their images are kept, what counts as none.
SHORT, LONG, NONE = 1e-9, 1e-3, 1e-14
MOST_STEPS, MOST_INTERVALS = 3000, 4000
# Pieces that have not grown tenfold by then do not expand: a quasi-periodic orbit, or the ghost of a cycle.
EARLY, TENFOLD = 500, 10.0


# Disjoint closed intervals, ascending: side, lower and upper end.
Intervals: TypeAlias = list[tuple[int, float, float]]


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

    def image(self, given: Intervals) -> Intervals:
        """F of some intervals; what leaves the domain is dropped."""
        side, lo, hi = (np.array(column)[:, None] for column in zip(*given, strict=True))
        lo, hi = np.maximum(lo, self.bottom), np.minimum(hi, self.top)
        # Rounding may leave a sliver, whose image would lie far from all others.
        row, k = np.nonzero((side == self.side) & (hi - lo > NONE * self.extent))
        x = np.concatenate([lo[row, k], hi[row, k]])
        y, sides, _ = along(self.params, x, np.tile(self.side[k], 2), np.tile(self.branch[k], 2)[:, None])
        one, other, to = y[: row.size], y[row.size :], sides[: row.size]
        inside = (to >= 0) & (to < self.lo.size)
        at = np.where(inside, to, 0)
        low = np.maximum(np.minimum(one, other), self.lo[at])
        high = np.minimum(np.maximum(one, other), self.hi[at])
        kept = inside & (low <= high)
        return self.joined(zip(to[kept].tolist(), low[kept].tolist(), high[kept].tolist(), strict=True))

    def joined(self, given: Iterable[tuple[int, float, float]]) -> Intervals:
        """Union; intervals that touch up to rounding are one."""
        union: Intervals = []
        for side, lo, hi in sorted(given):
            if union and union[-1][0] == side and lo <= union[-1][2] + NONE * self.extent:
                union[-1] = (side, union[-1][1], max(union[-1][2], hi))
            else:
                union.append((side, lo, hi))
        return union


def _same(before: Intervals, after: Intervals, slack: float) -> bool:
    return len(before) == len(after) and all(
        one[0] == other[0] and max(abs(one[1] - other[1]), abs(one[2] - other[2])) <= slack
        for one, other in zip(before, after, strict=True)
    )


def _length(union: Intervals) -> float:
    return sum(hi - lo for _, lo, hi in union)


def grown(
    forward: IntervalMap, x: Array, side: Ints, extent: float
) -> dict[int, list[tuple[float, float]]] | None:
    """Union of all images of short intervals around some points; None where they do not grow, or do not settle."""
    pieces = _Pieces(forward, extent)
    lo, hi = np.maximum(x - SHORT * extent, pieces.lo[side]), np.minimum(x + SHORT * extent, pieces.hi[side])
    union = pieces.joined(zip(side.tolist(), lo.tolist(), hi.tolist(), strict=True))
    first = _length(union)
    for count in range(MOST_STEPS):
        length = _length(union)
        if length >= LONG * extent:
            break
        union = pieces.image(union)
        if not 0 < len(union) <= MOST_INTERVALS or (count == EARLY and length < TENFOLD * first):
            return None
    if _length(union) < SHORT * extent:
        return None
    for _ in range(MOST_STEPS):
        after = pieces.joined([*union, *pieces.image(union)])
        if _same(union, after, 1e-13 * extent):
            sides = sorted({s for s, _, _ in after})
            return {on: [(low, high) for s, low, high in after if s == on] for on in sides}
        if len(after) > MOST_INTERVALS:
            return None
        union = after
    return None


# ----------------------------------------------------------------
# Attracting cycles near the ends of orbits: closest returns, then Newton's method on their itinerary.
#
# An orbit that has come near a cycle of slope -1 or 1 creeps; its returns still tell the period, and Newton's method
# finds the cycle and its multiplier to rounding, on both sides of the bifurcation.


MOST_PERIOD = 128
# Of the extent: a return that may be one of a cycle; how far Newton's method may lead; cycles nearer are one.
RETURN, FAR, ONE = 1e-4, 0.05, 1e-9


class Recorded(NamedTuple):
    """States of many orbits: x and side of shape (n, m + 1), code of shape (n, m)."""

    x: Array
    side: Ints
    code: Ints


def recorded(place: Place, x: Array, side: Ints, steps: int) -> Recorded:
    """Record orbits step by step; those that leave are left out."""
    xs, sides, codes = [x], [side], []
    for _ in range(steps):
        x, side, code, _ = advance(place.params, xs[-1], sides[-1], 1)
        xs.append(x)
        sides.append(side)
        codes.append(code)
    orbits = Recorded(np.stack(xs, axis=1), np.stack(sides, axis=1), np.stack(codes, axis=1))
    lo, hi = place.domain.lo[orbits.side, 0], place.domain.hi[orbits.side, 0]
    kept = (orbits.code >= 0).all(axis=1) & ((orbits.x >= lo) & (orbits.x <= hi)).all(axis=1)
    return Recorded(*(each[kept] for each in orbits))


def on_itinerary(place: Place, x: Array, side: Ints, words: Ints) -> tuple[Array, Array, Flags]:
    """Solve F^p(x) = x on forced branches near x: roots, slopes there, and where the method converged."""
    start, converged = x.copy(), np.zeros(x.size, dtype=bool)
    slope = np.full(x.size, np.nan)
    for _ in range(80):
        k = np.flatnonzero(~converged & np.isfinite(x))
        if k.size == 0:
            break
        y, to, rate = along(place.params, x[k], side[k], words[k])
        noise = 16.0 * EPS * place.extent * (1.0 + np.abs(rate))
        slope[k] = rate
        with np.errstate(divide="ignore", invalid="ignore"):
            move = (y - x[k]) / (1.0 - rate)
        done = (np.abs(y - x[k]) <= noise) & (to == side[k])
        far = ~(np.abs(x[k] + move - start[k]) <= FAR * place.extent)
        # A last step even where it is done: near slope 1 a small residual is no small error.
        x[k] = np.where(far, np.where(done, x[k], np.nan), x[k] + move)
        converged[k] = done
    return x, slope, converged


def _as_cycle(place: Place, x: float, side: int, word: Ints) -> Cycle | None:
    """Follow one period from a root; None unless the map takes these branches and the cycle attracts."""
    xs, sides, slopes = np.empty(word.size), np.empty(word.size, dtype=np.int64), np.empty(word.size)
    for j, branch in enumerate(word.tolist()):
        xs[j], sides[j] = x, side
        after, to, slope = along(place.params, [x], side, [branch])
        x, side, slopes[j] = float(after[0]), int(to[0]), slope[0]
    multiplier = float(np.prod(slopes))
    if not abs(multiplier) < 1.0 or (stepped(place.params, xs[:, None], sides)[2] != word).any():
        return None
    first = int(np.lexsort((xs, sides))[0])
    ahead = (np.arange(sides.size) + first) % sides.size
    rounding = 16.0 * EPS * place.extent * (1.0 + float(np.abs(slopes).max()))
    return Cycle(xs[ahead], sides[ahead], word[ahead], multiplier, abs(x - float(xs[0])), rounding)


def _shortest(place: Place, cycle: Cycle) -> Cycle:
    """Return the shorter cycle that a cycle repeats, if the shorter one attracts; else the cycle itself."""
    for period in range(1, cycle.period):
        near = abs(cycle.x[period] - cycle.x[0]) <= 1e-3 * place.extent
        if near and cycle.period % period == 0 and cycle.side[period] == cycle.side[0]:
            word = cycle.branches[:period]
            x, _, good = on_itinerary(place, cycle.x[:1].copy(), cycle.side[:1], word[None, :])
            shorter = _as_cycle(place, float(x[0]), int(cycle.side[0]), word) if good[0] else None
            if shorter is not None:
                return shorter
    return cycle


def attracting_cycles(place: Place, orbits: Recorded) -> tuple[list[Cycle], Flags]:
    """Find the attracting cycles that orbits have come near; which orbits have come near none."""
    away = np.abs(orbits.x[:, 1:] - orbits.x[:, :1])
    away[orbits.side[:, 1:] != orbits.side[:, :1]] = np.inf
    near = away <= RETURN * place.extent
    first = np.where(near.any(axis=1), near.argmax(axis=1) + 1, 0)
    closest = away.argmin(axis=1) + 1 if away.size else first
    cycles: list[Cycle] = []
    left = np.ones(len(orbits.x), dtype=bool)
    for periods in (first, 2 * first, np.where(first > 0, closest, 0)):
        for period in np.unique(periods[left & (periods > 0) & (periods <= MOST_PERIOD)]).tolist():
            k = np.flatnonzero(left & (periods == period))
            words = np.ascontiguousarray(orbits.code[k, :period])
            x, slope, good = on_itinerary(place, orbits.x[k, 0].copy(), orbits.side[k, 0], words)
            for j in np.flatnonzero(good & (np.abs(slope) < 1.0 + 1e-6)).tolist():
                side = int(orbits.side[k[j], 0])
                if not any(
                    (np.abs(cycle.x[cycle.side == side] - x[j]) <= ONE * place.extent).any()
                    for cycle in cycles
                ):
                    cycle = _as_cycle(place, float(x[j]), side, words[j])
                    if cycle is None:
                        continue
                    cycles.append(_shortest(place, cycle))
                left[k[j]] = False
    return _told_apart(place, cycles), left


def _told_apart(place: Place, cycles: list[Cycle]) -> list[Cycle]:
    """Keep the cycles that rounding can tell apart: near slope 1 every number between two cycles is a root."""
    kept: list[Cycle] = []
    for cycle in sorted(cycles, key=lambda each: each.period):
        twin = False
        for other in kept:
            near = other.x[other.side == cycle.side[0]]
            if cycle.period % other.period or near.size == 0:
                continue
            x = np.linspace(cycle.x[0], near[np.abs(near - cycle.x[0]).argmin()], 9)
            y, _, slope = along(place.params, x, int(cycle.side[0]), cycle.branches)
            noise = 16.0 * EPS * place.extent * (1.0 + np.abs(slope))
            twin |= bool((np.abs(y - x) <= noise).all())
        kept += [] if twin else [cycle]
    return kept
