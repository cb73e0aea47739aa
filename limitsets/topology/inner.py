"""Whether a set that is its own image is one attractor: the images of a short interval about an orbit's state fill it.

Cells do not see gaps that are narrower than they, nor cycles that attract slowly; the set is then its own image too.
"""

from __future__ import annotations

from typing import Any

from limitsets.jit import kernel
from limitsets.maps.drivers import step
from limitsets.topology.bands import ANY, COVERED, GAP, IMAGE, PUSHED, SET, cover_more, images_of, merge, put
from limitsets.topology.work import Pieces, Unions

# Of the length of the set: half the interval that is followed, and its length from which its images are joined.
SEED, LONG = 1e-5, 1e-2
# Throws before the interval is placed; images that are taken; ends that differ by less are one [of the largest side].
BEFORE, MOST_IMAGES, SAME = 40, 2000, 1e-9
# Where the interval does not grow: stretches of the set that an orbit has to visit, and its throws.
STRETCHES, MOST_VISITS = 200, 20_000


@kernel(entry=True, counting=False)
def _agree(u: Unions, slack: float) -> bool:
    """Whether SET and COVERED hold the same intervals."""
    if u.size[SET] != u.size[COVERED]:
        return False
    for i in range(u.size[SET]):
        if u.side[SET, i] != u.side[COVERED, i]:
            return False
        if max(abs(u.lo[SET, i] - u.lo[COVERED, i]), abs(u.hi[SET, i] - u.hi[COVERED, i])) > slack:
            return False
    return True


@kernel(entry=True, counting=False)
def _take(u: Unions) -> float:
    """Make PUSHED what IMAGE is; its length."""
    length = 0.0
    for i in range(u.size[IMAGE]):
        u.side[PUSHED, i], u.lo[PUSHED, i], u.hi[PUSHED, i] = u.side[IMAGE, i], u.lo[IMAGE, i], u.hi[IMAGE, i]
        length += u.hi[IMAGE, i] - u.lo[IMAGE, i]
    u.size[PUSHED] = u.size[IMAGE]
    return length


@kernel(entry=True, counting=False)
def _spreads(params: Any, x: float, side: int, length: float, u: Unions) -> bool:
    """Whether an orbit visits all of many equal stretches of SET."""
    missing = STRETCHES
    for k in range(STRETCHES):
        u.seen[k] = 0
    for _ in range(MOST_VISITS):
        before = 0.0
        for i in range(u.size[SET]):
            if u.side[SET, i] == side and u.lo[SET, i] <= x <= u.hi[SET, i]:
                k = min(int((before + x - u.lo[SET, i]) / length * STRETCHES), STRETCHES - 1)
                missing -= 1 - u.seen[k]
                u.seen[k] = 1
            before += u.hi[SET, i] - u.lo[SET, i]
        if missing == 0:
            return True
        x, side, code = step(params, x, side)
        if code < 0:
            return False
    return False


@kernel(entry=True, counting=False)
def fills(params: Any, x: float, side: int, scale: float, p: Pieces, u: Unions) -> bool:
    """Whether the images of a short interval, about where the orbit of a state of SET comes to, fill SET."""
    for _ in range(BEFORE):
        x, side, code = step(params, x, side)
        if code < 0:
            return False
    length, long = 0.0, 0.0
    for i in range(u.size[SET]):
        length += u.hi[SET, i] - u.lo[SET, i]
    u.size[PUSHED] = 0
    for i in range(u.size[SET]):
        if u.side[SET, i] == side and u.lo[SET, i] <= x <= u.hi[SET, i]:
            half = SEED * length
            put(u, PUSHED, side, max(x - half, u.lo[SET, i]), min(x + half, u.hi[SET, i]))
    for _ in range(MOST_IMAGES):
        u.size[IMAGE] = 0
        images_of(params, p, u, PUSHED, IMAGE, ANY, ANY, 0.0)
        if not merge(u, IMAGE, GAP * scale):
            return False
        long = _take(u)
        if long >= LONG * length:
            break
    if long < LONG * length:
        return _spreads(params, x, side, length, u)
    u.size[COVERED] = u.size[PUSHED]
    for i in range(u.size[PUSHED]):
        u.side[COVERED, i], u.lo[COVERED, i] = u.side[PUSHED, i], u.lo[PUSHED, i]
        u.hi[COVERED, i] = u.hi[PUSHED, i]
    for _ in range(MOST_IMAGES):
        u.size[IMAGE] = 0
        images_of(params, p, u, PUSHED, IMAGE, ANY, ANY, 0.0)
        if not cover_more(u, scale):
            return False
        if u.size[PUSHED] == 0:
            break
    return _agree(u, SAME * scale)
