"""Orbits that check what cells and intervals say: they stay, and they visit every band.  Means along orbits."""

from __future__ import annotations

import math
from typing import Any

from limitsets.jit import kernel
from limitsets.maps.drivers import fill_images, step
from limitsets.maps.kernels import image_on
from limitsets.topology.bands import SET
from limitsets.topology.cells import cell_of
from limitsets.topology.work import Cells, Components, Starts, Unions

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


@kernel(entry=True, counting=False)
def _throw_all(params: Any, sides: int, count: int, s: Starts) -> None:
    """Make a step of several orbits, side by side: the images of a side are one loop over an array."""
    found = 0
    for side in range(sides):
        begin = found
        for i in range(count):
            if s.side[i] == side:
                s.which[found], s.before[found] = i, s.x[i]
                found += 1
        if found > begin:
            before, after = (s.before[begin:found],), (s.after[begin:found],)
            fill_images(params, side, before, after, s.to[begin:found], s.codes[begin:found])
    for j in range(count):
        i = s.which[j]
        s.x[i], s.side[i], s.code[i] = s.after[j], s.to[j], s.codes[j]


@kernel(entry=True, counting=False)
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


@kernel(entry=True, counting=False)
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


@kernel(entry=True, counting=False)
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
