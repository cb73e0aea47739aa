"""The attracting cycle that a set holds, however narrow its basin is: from orbits of its critical points.

An attractor that is no cycle holds a turning point or a jump, and beside a cycle that attracts one of these is in its
basin from the first throw on, while other orbits may wander as long as the basin is narrow.  Newton's method finds the
cycle where it attracts slowly, and its multiplier.
Source: Singer, SIAM J. Appl. Math. 35, 1978; Mane, Commun. Math. Phys. 100, 1985.
"""

from __future__ import annotations

from typing import Any

from limitsets.jit import kernel
from limitsets.maps.drivers import step
from limitsets.maps.kernels import image_on
from limitsets.topology.bands import COVERED, PUSHED, SET, merge, put
from limitsets.topology.orbits import CLOSES
from limitsets.topology.work import Pieces, Unions

# Throws before a cycle is sought, and further ones before it is sought once more; the longest that is found.
SHORT, LONG, MOST_PERIOD = 1000, 8000, 512
# Of the largest side: a return from which Newton's method begins, how far it may lead, and when it has come to rest;
# where the multiplier is 1 or -1 to rounding it does not.
NEAR, FAR, REST = 1e-3, 1e-2, 1e-10
# Beyond this multiplier no attracting cycle is near; steps of Newton's method.
STEEP, MOST_STEPS = 8.0, 40
# From this multiplier on rounding decides what is a cycle.
NEUTRAL = 1.0 - 1e-7
# Of the largest side: cycles are one that have points this near to each other.
SAME = 1e-6
NO_CYCLE, DOUBTFUL = 0, -1


@kernel(entry=True, counting=False)
def _closes(params: Any, x: float, side: int, length: int, scale: float, u: Unions) -> bool:
    """Whether the branches in `u.seen` have an attracting cycle near a state; PUSHED becomes its points."""
    first, move, steps = x, scale, 0
    while abs(move) > REST * scale:
        steps += 1
        y, on, slope = x, side, 1.0
        for k in range(length):
            y, on, factor = image_on(params, y, on, u.seen[k])
            slope *= factor
        if not abs(slope) < STEEP or slope == 1.0 or steps > MOST_STEPS:
            return False
        move = (y - x) / (1.0 - slope)
        x += move
        if not abs(x - first) <= FAR * scale:
            return False
    y, on, slope = x, side, 1.0
    u.size[PUSHED] = 0
    for _ in range(length):
        put(u, PUSHED, on, y, y)
        after, to, code = step(params, y, on)
        if code < 0:
            return False
        _, _, factor = image_on(params, y, on, code)
        y, on, slope = after, to, slope * factor
    return on == side and abs(y - x) <= CLOSES * scale and abs(slope) < NEUTRAL


@kernel(entry=True, counting=False)
def _cycle_from(params: Any, x: float, side: int, patient: bool, scale: float, u: Unions) -> int:
    """Length of the attracting cycle that an orbit comes to, PUSHED its points; 0 where it closes none."""
    for tries in range(2 if patient else 1):
        for _ in range(LONG if tries else SHORT):
            x, side, code = step(params, x, side)
            if code < 0:
                return NO_CYCLE
        at, on = x, side
        for length in range(1, MOST_PERIOD + 1):
            x, side, code = step(params, x, side)
            if code < 0:
                return NO_CYCLE
            u.seen[length - 1] = code
            if side == on and abs(x - at) <= NEAR * scale and _closes(params, at, on, length, scale, u):
                return length
    return NO_CYCLE


@kernel(entry=True, counting=False)
def _joins(params: Any, x: float, side: int, known: int, scale: float, u: Unions) -> int:
    """Follow an orbit to a cycle: its length, `DOUBTFUL` where another one is known; COVERED is the first."""
    length = _cycle_from(params, x, side, known >= NO_CYCLE, scale, u)
    if length == NO_CYCLE:
        return NO_CYCLE
    if known <= NO_CYCLE:
        u.size[COVERED] = length
        for i in range(length):
            u.side[COVERED, i], u.lo[COVERED, i], u.hi[COVERED, i] = (
                u.side[PUSHED, i],
                u.lo[PUSHED, i],
                u.hi[PUSHED, i],
            )
        return length
    for i in range(known if length == known else 0):
        if (
            u.side[COVERED, i] == u.side[PUSHED, 0]
            and abs(u.lo[COVERED, i] - u.lo[PUSHED, 0]) <= SAME * scale
        ):
            return length
    return DOUBTFUL


@kernel(entry=True, counting=False)
def _of_ends(params: Any, inside: bool, scale: float, p: Pieces, u: Unions) -> tuple[int, int]:
    """Length of the one cycle that the orbits of all ends come to, or `DOUBTFUL`; and how many ends there are.

    The ends are those of pieces `inside` SET, from both sides, else those of SET itself.
    """
    known, count, missed = NO_CYCLE, 0, False
    for i in range(u.size[SET]):
        side = u.side[SET, i]
        first, last = (p.begin[side], p.begin[side + 1]) if inside else (0, 1)
        for q in range(first, last):
            for end in range(2):
                x, to = (u.lo[SET, i], side) if end == 0 else (u.hi[SET, i], side)
                if inside:
                    c = p.lo[q] if end == 0 else p.hi[q]
                    if p.branch[q] < 0 or c < u.lo[SET, i] or c > u.hi[SET, i]:
                        continue
                    x, to = (p.y_lo[q] if end == 0 else p.y_hi[q]), p.to[q]
                    if (
                        end == 0
                        and q > first
                        and p.to[q - 1] == to
                        and abs(p.y_hi[q - 1] - x) <= CLOSES * scale
                    ):
                        continue  # a turning point: one orbit
                count += 1
                found = _joins(params, x, to, DOUBTFUL if missed else known, scale, u)
                missed = missed or found == NO_CYCLE
                if found == DOUBTFUL or (missed and max(known, found) > NO_CYCLE):
                    return DOUBTFUL, count
                known = max(known, found)
    return known, count


@kernel(entry=True, counting=False)
def one_cycle(params: Any, x: float, side: int, scale: float, p: Pieces, u: Unions) -> int:
    """Length of the attracting cycle that SET holds, which SET becomes; `NO_CYCLE`, or `DOUBTFUL`.

    All critical points of SET have to come to the one cycle, and the orbit of the state must come to no other.
    """
    known, count = _of_ends(params, True, scale, p, u)
    if count == 0:  # what is monotone is squeezed between the orbits of its ends
        known, count = _of_ends(params, False, scale, p, u)
    if known == DOUBTFUL:
        return DOUBTFUL
    other = _joins(params, x, side, known if known else DOUBTFUL, scale, u)
    if other == DOUBTFUL or (known == NO_CYCLE and other > NO_CYCLE):
        return DOUBTFUL
    if known > NO_CYCLE:
        u.size[SET] = 0
        for i in range(known):
            put(u, SET, u.side[COVERED, i], u.lo[COVERED, i], u.hi[COVERED, i])
        if not merge(u, SET, CLOSES * scale) or u.size[SET] != known:
            return DOUBTFUL
    return known
