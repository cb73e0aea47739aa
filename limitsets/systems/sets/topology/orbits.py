"""Orbits that check what cells and intervals say, means along them, and the attracting cycle that a set holds."""

from __future__ import annotations

import math
from typing import Any

from limitsets.numbers.jit import kernel
from limitsets.systems.maps.drivers import fill_images, step
from limitsets.systems.maps.kernels import image_on
from limitsets.systems.sets.topology.bands import COVERED, PUSHED, SET, copy, merge, put
from limitsets.systems.sets.topology.cells import cell_of
from limitsets.systems.sets.topology.work import Cells, Components, Pieces, Starts, Unions

# Throws of the orbits from cells that recur though they are left, and those between two looks at where they are.
THROWS, LOOKED = 160, 8
# Throws until every band has to be visited.
MOST_VISITS = 20_000
# Throws before means are taken; stretches of an orbit, and how many of them count together at most for an error.
SKIPPED, STRETCHES, MOST_TOGETHER = 200, 16, 4
# An orbit closes where it comes back this near, as a share of the largest side.
CLOSES = 1e-9
# Golden ratio: multiples of it, modulo 1, fill an interval evenly.
GOLDEN = 0.6180339887498949
# Where in a band an orbit starts: no whole fraction, whose orbit may be short.
INNER = 1.0 - GOLDEN


@kernel(entry=True, counting=False)
def _starts(sides: int, c: Cells, k: Components, s: Starts) -> int:
    """Spread the starts over the cells in `held`, in proportion to their lengths; how many starts there are."""
    held, total = 0, 0.0
    for side in range(sides):
        for cell in range(c.begin[side], c.begin[side + 1]):
            if k.held[cell]:
                k.path[held], k.rows[held] = cell, side
                total += c.hi[cell] - c.lo[cell]
                held += 1
    for start in range(s.x.size if held else 0):
        place = total * ((0.5 + start * GOLDEN) % 1.0)
        for j in range(held):
            cell = k.path[j]
            length = c.hi[cell] - c.lo[cell]
            if place < length or j == held - 1:
                s.x[start], s.side[start] = c.lo[cell] + min(place, length), k.rows[j]
                break
            place -= length
    return s.x.size if held else 0


@kernel(counting=False, inlined=False)
def _throw_all(params: Any, sides: int, count: int, s: Starts) -> None:
    """Make a step of several orbits, side by side: the images of a side are one loop over an array."""
    thrown = 0
    for side in range(sides):
        begin = thrown
        for i in range(count):
            if s.side[i] == side:
                s.which[thrown], s.before[thrown] = i, s.x[i]
                thrown += 1
        if thrown > begin:
            before, after = (s.before[begin:thrown],), (s.after[begin:thrown],)
            fill_images(params, side, before, after, s.to[begin:thrown], s.codes[begin:thrown])
    for j in range(count):
        i = s.which[j]
        s.x[i], s.side[i], s.code[i] = s.after[j], s.to[j], s.codes[j]


@kernel(counting=False, inlined=False)
def remaining(params: Any, sides: int, c: Cells, k: Components, s: Starts) -> int:
    """Count the orbits from the cells in `held` that are still among these cells after some throws; they lead `s`.

    All orbits make a throw before any makes the next, so that the images of a side are computed together.
    """
    left = _starts(sides, c, k, s)
    for throw in range(THROWS if left else 0):
        _throw_all(params, sides, left, s)
        looked, kept = throw % LOOKED == LOOKED - 1, 0
        for i in range(left):
            s.x[kept], s.side[kept] = s.x[i], s.side[i]
            stays = s.code[i] >= 0
            if looked and stays:
                here = cell_of(c, s.side[i], s.x[i])
                stays = k.held[here] and s.x[i] >= c.lo[here]
            kept += stays
        left = kept
        if left == 0:
            break
    return left


@kernel(counting=False, inlined=False)
def visits_all(params: Any, slack: float, u: Unions) -> bool:
    """Whether one orbit comes to every interval of SET, and leaves them never."""
    n, missing = u.size[SET], u.size[SET]
    for i in range(n):
        u.seen[i] = 0
    x, side = u.lo[SET, 0] + INNER * (u.hi[SET, 0] - u.lo[SET, 0]), u.side[SET, 0]
    for _ in range(MOST_VISITS):
        inside = False
        for i in range(n):
            if u.side[SET, i] == side and u.lo[SET, i] - slack <= x <= u.hi[SET, i] + slack:
                inside = True
                missing -= 1 - u.seen[i]
                u.seen[i] = 1
        if missing == 0 or not inside:
            return inside
        x, side, code = step(params, x, side)
        if code < 0:
            return False
    return False


@kernel(counting=False, inlined=False)
def averages(params: Any, x: float, side: int, throws: int, out: Any) -> None:
    """Fill `out` with means over stretches of one orbit: share of throws that change sides, logarithm of the slopes.

    nan where the orbit leaves.
    """
    out[:] = math.nan
    for _ in range(SKIPPED):
        x, side, code = step(params, x, side)
        if code < 0:
            return
    length = max(throws // STRETCHES, 1)
    for k in range(STRETCHES):
        flips, growth, size = 0, 0.0, 1.0
        for _ in range(length):
            after, side_after, code = step(params, x, side)
            if code < 0:
                out[:] = math.nan
                return
            _, _, slope = image_on(params, x, side, code)
            size *= abs(slope)
            if size < 1e-100 or size > 1e100:
                growth += math.log(size)
                size = 1.0
            flips += side_after != side
            x, side = after, side_after
        out[0, k], out[1, k] = flips / length, (growth + math.log(size)) / length


@kernel
def mean_of(values: Any) -> tuple[float, float]:
    """Return the mean over stretches and its standard error: the largest of those by one, two and four together.

    Stretches that follow each other are alike where an orbit stays long in one part of its attractor; longer ones
    then scatter more than shorter ones tell.
    """
    n, total, error, together = values.size, 0.0, 0.0, 1
    for value in values:
        total += value
    mean = total / n
    while together <= MOST_TOGETHER:
        squares, count = 0.0, n // together
        for k in range(count):
            off = 0.0
            for j in range(together):
                off += values[k * together + j] - mean
            squares += (off / together) ** 2
        error = max(error, math.sqrt(squares / count / (count - 1)))
        together *= 2
    return mean, error if mean == mean else math.nan


# ----------------------------------------------------------------
# The attracting cycle that a set holds, however narrow its basin is: from orbits of its critical points.
#
# An attractor that is no cycle holds a turning point or a jump, and beside a cycle that attracts one of these is in its
# basin from the first throw on, while other orbits may wander as long as the basin is narrow.  Newton's method finds
# the cycle where it attracts slowly, and its multiplier. Source: Singer, SIAM J. Appl. Math. 35, 1978; Mane, Commun.
# Math. Phys. 100, 1985.


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


@kernel(counting=False, inlined=False)
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


@kernel(counting=False, inlined=False)
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


@kernel(counting=False, inlined=False)
def _joins(params: Any, x: float, side: int, known: int, scale: float, u: Unions) -> int:
    """Follow an orbit to a cycle: its length, `DOUBTFUL` where another one is known; COVERED is the first."""
    length = _cycle_from(params, x, side, known >= NO_CYCLE, scale, u)
    if length == NO_CYCLE:
        return NO_CYCLE
    if known <= NO_CYCLE:
        copy(u, PUSHED, COVERED)
        return length
    for i in range(known if length == known else 0):
        if (
            u.side[COVERED, i] == u.side[PUSHED, 0]
            and abs(u.lo[COVERED, i] - u.lo[PUSHED, 0]) <= SAME * scale
        ):
            return length
    return DOUBTFUL


@kernel
def _goes_on(p: Pieces, q: int, x: float, to: int, close: float) -> Any:
    """Whether the image of piece q begins where that of the piece before ends: a turning point, whose orbit is one."""
    return p.to[q - 1] == to and abs(p.y_hi[q - 1] - x) <= close


@kernel(counting=False, inlined=False)
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
                    if end == 0 and q > first and _goes_on(p, q, x, to, CLOSES * scale):
                        continue
                count += 1
                length = _joins(params, x, to, DOUBTFUL if missed else known, scale, u)
                missed = missed or length == NO_CYCLE
                if length == DOUBTFUL or (missed and max(known, length) > NO_CYCLE):
                    return DOUBTFUL, count
                known = max(known, length)
    return known, count


@kernel(counting=False, inlined=False)
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
        copy(u, COVERED, SET)
        if not merge(u, SET, CLOSES * scale) or u.size[SET] != known:
            return DOUBTFUL
    return known
