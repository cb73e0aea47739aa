"""Bands: an attractor as a union of intervals, whether it is one attractor, and what orbits do there.

As `limitsets.systems.sets.end_points`, in compiled code: images of intervals come from their ends and from the
one-sided limits at the ends of pieces.
"""

from __future__ import annotations

from typing import Any

from limitsets.numbers.jit import kernel
from limitsets.systems.maps.drivers import step
from limitsets.systems.maps.kernels import image_on, on_side
from limitsets.systems.sets.topology.cells import cell_of
from limitsets.systems.sets.topology.work import MOST_INTERVALS, Cells, Components, Pieces, Region, Unions

# Rows of `Unions`.
SET, IMAGE, PUSHED, COVERED = 0, 1, 2, 3
# Of the largest side: ends rest that move by less; a gap this small is rounding, and a part this short.
REST, GAP, SLIVER = 1e-12, 1e-13, 1e-10
# Half the length of the interval whose images are followed, likewise, and gaps that are filled where there are many.
SEED, FILLED, MANY = 1e-6, 1e-3, 256
MOST_IMAGES, MOST_STEPS = 2000, 100_000
# What a search may end with besides an answer.
NOTHING, TOO_MANY, MOVES, OUT = 0, 1, 2, 3
ANY = -1
# In place of the order where it changes.
IRREGULAR = -2


@kernel
def put(u: Unions, row: int, side: int, lo: float, hi: float) -> None:
    """Append an interval to a row; past the last place it is only counted."""
    n = u.size[row]
    if n < MOST_INTERVALS:
        u.side[row, n], u.lo[row, n], u.hi[row, n] = side, lo, hi
    u.size[row] = n + 1


@kernel(entry=True, counting=False)
def merge(u: Unions, row: int, gap: float) -> bool:
    """Sort a union and join what touches; False where it has too many intervals."""
    n = u.size[row]
    if n > MOST_INTERVALS:
        return False
    side, lo, hi = u.side[row], u.lo[row], u.hi[row]
    for i in range(1, n):
        s, a, b, j = side[i], lo[i], hi[i], i
        while j > 0 and (side[j - 1] > s or (side[j - 1] == s and lo[j - 1] > a)):
            side[j], lo[j], hi[j] = side[j - 1], lo[j - 1], hi[j - 1]
            j -= 1
        side[j], lo[j], hi[j] = s, a, b
    k = 0
    for i in range(1, n):
        if side[i] == side[k] and lo[i] <= hi[k] + gap:
            hi[k] = max(hi[k], hi[i])
        else:
            k += 1
            side[k], lo[k], hi[k] = side[i], lo[i], hi[i]
    u.size[row] = k + 1 if n else 0
    return True


@kernel(entry=True, counting=False)
def copy(u: Unions, row: int, into: int) -> None:
    """Make a row what another is."""
    for i in range(u.size[row]):
        u.side[into, i], u.lo[into, i], u.hi[into, i] = u.side[row, i], u.lo[row, i], u.hi[row, i]
    u.size[into] = u.size[row]


@kernel(entry=True, counting=False)
def _length(u: Unions, row: int) -> float:
    length = 0.0
    for i in range(u.size[row]):
        length += u.hi[row, i] - u.lo[row, i]
    return length


@kernel(entry=True, counting=False)
def _agree(u: Unions, row: int, slack: float) -> bool:
    """Whether SET and another row hold the same intervals."""
    if u.size[SET] != u.size[row]:
        return False
    for i in range(u.size[SET]):
        apart = max(abs(u.lo[SET, i] - u.lo[row, i]), abs(u.hi[SET, i] - u.hi[row, i]))
        if u.side[SET, i] != u.side[row, i] or not apart <= slack:
            return False
    return True


@kernel(entry=True, counting=False)
def is_still(u: Unions, rest: float) -> bool:
    """Make SET what IMAGE is; whether no end moved by more than `rest`."""
    still: bool = _agree(u, IMAGE, rest)
    copy(u, IMAGE, SET)
    return still


@kernel(entry=True, counting=False)
def begin_union(sides: int, attractor: int, c: Cells, k: Components, u: Unions) -> bool:
    """Make SET the union of the cells of a closed component; whether the images of all are longer than they."""
    n, expands = 0, True
    for side in range(sides):
        last = -2
        for cell in range(c.begin[side], c.begin[side + 1]):
            if k.label[cell] != k.closed[attractor]:
                continue
            expands &= c.expands[cell]
            if cell == last + 1:
                u.hi[SET, n - 1] = c.hi[cell]
            elif n < MOST_INTERVALS:
                u.side[SET, n], u.lo[SET, n], u.hi[SET, n] = side, c.lo[cell], c.hi[cell]
                n += 1
            last = cell
    u.size[SET] = n
    return expands


@kernel(counting=False, inlined=False)
def images_of(
    params: Any, p: Pieces, u: Unions, row: int, into: int, leaving: int, only: int, sliver: float
) -> bool:
    """Append to a row the images of the parts of another, by piece; whether some part has no image.

    `leaving` 1: only what changes sides; 0: only what does not; `ANY`: all.  `only`: images on this side, or `ANY`.
    """
    out, side = False, -1
    here = on_side(params, 0)
    for i in range(u.size[row]):
        if u.side[row, i] != side:
            side = u.side[row, i]
            here = on_side(params, side)
        lo, hi = u.lo[row, i], u.hi[row, i]
        for q in range(p.begin[side], p.begin[side + 1]):
            a, b, branch, to = max(lo, p.lo[q]), min(hi, p.hi[q]), p.branch[q], p.to[q]
            if a > b or (b - a <= sliver and hi - lo > sliver):
                continue
            if branch < 0:
                out = True
                continue
            if (leaving >= 0 and (to != side) != (leaving == 1)) or (only >= 0 and to != only):
                continue
            y_a, y_b = p.y_lo[q], p.y_hi[q]
            if a != p.lo[q]:
                y_a, _, _ = image_on(here, a, side, branch)
            if b != p.hi[q]:
                y_b, _, _ = image_on(here, b, side, branch)
            put(u, into, to, min(y_a, y_b), max(y_a, y_b))
    return out


@kernel(counting=False, inlined=False)
def settle(params: Any, scale: float, r: Region, p: Pieces, u: Unions) -> int:
    """Take images of SET until its ends rest; NOTHING, or why they do not."""
    rest, rested = REST * scale, 0
    for _ in range(MOST_IMAGES):
        u.size[IMAGE] = 0
        if images_of(params, p, u, SET, IMAGE, ANY, ANY, 0.0):
            return OUT
        if not merge(u, IMAGE, GAP * scale):
            return TOO_MANY
        for i in range(u.size[IMAGE]):
            side = u.side[IMAGE, i]
            if u.lo[IMAGE, i] < r.lo[side] - rest or u.hi[IMAGE, i] > r.hi[side] + rest:
                return OUT
        rested = rested + 1 if is_still(u, rest) else 0
        if rested == 2:
            return NOTHING
    return MOVES


@kernel
def _ends_known(r: Region, c: Cells, k: Components, side: int, x: float) -> bool:
    """Whether a state is out of the domain, or in a cell all of whose starts end in one known way."""
    if x < r.lo[side] or x > r.hi[side]:
        return True
    cell = cell_of(c, side, x)
    ends = k.ends[cell]
    return not k.held[cell] and ends & (ends - 1) == 0


@kernel(counting=False, inlined=False)
def stays_around(
    params: Any, x: float, side: int, scale: float, r: Region, p: Pieces, c: Cells, k: Components, u: Unions
) -> bool:
    """Whether no part of the images of a short interval about a state comes to a known end.

    COVERED is what they cover together, PUSHED what is new of it.
    """
    half = SEED * scale
    u.size[COVERED], u.size[PUSHED] = 0, 0
    for row in (COVERED, PUSHED):
        put(u, row, side, max(x - half, r.lo[side]), min(x + half, r.hi[side]))
    for _ in range(MOST_IMAGES):
        u.size[IMAGE] = 0
        if images_of(params, p, u, PUSHED, IMAGE, ANY, ANY, 0.0):
            return False
        for i in range(min(u.size[IMAGE], MOST_INTERVALS)):
            to = u.side[IMAGE, i]
            if _ends_known(r, c, k, to, u.lo[IMAGE, i]) or _ends_known(r, c, k, to, u.hi[IMAGE, i]):
                return False
        if not cover_more(u, scale) or u.size[PUSHED] == 0:
            return True
    return True


@kernel(entry=True, counting=False)
def cover_more(u: Unions, scale: float) -> bool:
    """Join IMAGE to COVERED, and make PUSHED what is new; False for too many intervals.

    Gaps are filled where there are many intervals: near a fixed point that repels slowly one follows another.
    """
    if u.size[IMAGE] > MOST_INTERVALS - MANY:
        return False
    u.size[PUSHED] = 0
    for i in range(u.size[IMAGE]):
        lo, hi, side, held = u.lo[IMAGE, i], u.hi[IMAGE, i], u.side[IMAGE, i], False
        for k in range(u.size[COVERED]):
            held = held or (u.side[COVERED, k] == side and u.lo[COVERED, k] <= lo and hi <= u.hi[COVERED, k])
        if not held:
            put(u, PUSHED, side, lo, hi)
            put(u, COVERED, side, lo, hi)
    many = u.size[COVERED] > MANY
    merge(u, COVERED, (FILLED if many else GAP) * scale)
    if u.size[COVERED] > MANY:
        return False
    if many:  # what was filled has images too
        copy(u, COVERED, PUSHED)
    return True


@kernel
def _fill_order(u: Unions, sides: int, first: int, regular: Any, order: Any) -> None:
    """Write in which order `u.seen` leads from side to side; `IRREGULAR` if not one cycle holds all that are left."""
    side, n, left = first, 0, 0
    for other in range(sides):
        left += u.seen[other] >= 0
    while side >= 0 and n < left and (n == 0 or side != first):
        order[n] = side
        side, n = u.seen[side], n + 1
    if not (regular and n == left and side == first):
        order[:] = IRREGULAR


@kernel(counting=False, inlined=False)
def push_through(
    params: Any, sides: int, scale: float, p: Pieces, u: Unions, jogs_min: Any, jogs_max: Any, order: Any
) -> int:
    """Push what arrives on each side of SET until all has left it: steps that stay, and the order of the sides.

    Nothing arrives where no step changes sides: then the order is that side alone, and no jogs are counted.
    """
    jogs_min[:], jogs_max[:], order[:] = -1, -1, -1
    regular, least = True, -1
    for side in range(sides):
        u.size[PUSHED] = 0
        images_of(params, p, u, SET, PUSHED, 1, side, SLIVER * scale)
        u.seen[side] = -1
        steps = 0
        while u.size[PUSHED] > 0:
            if not merge(u, PUSHED, GAP * scale):
                return TOO_MANY
            if steps == MOST_STEPS:
                return MOVES
            u.size[IMAGE] = 0
            images_of(params, p, u, PUSHED, IMAGE, 1, ANY, SLIVER * scale)
            for i in range(min(u.size[IMAGE], MOST_INTERVALS)):
                regular &= u.seen[side] in (-1, u.side[IMAGE, i])
                u.seen[side] = u.side[IMAGE, i]
            if u.size[IMAGE] > 0:
                jogs_min[side] = steps if jogs_min[side] < 0 else jogs_min[side]
                jogs_max[side] = steps
            u.size[IMAGE] = 0
            images_of(params, p, u, PUSHED, IMAGE, 0, ANY, SLIVER * scale)
            if u.size[IMAGE] > MOST_INTERVALS:
                return TOO_MANY
            copy(u, IMAGE, PUSHED)
            steps += 1
        if least < 0 and u.seen[side] >= 0:
            least = side
    if least < 0:
        order[0] = u.side[SET, 0]
    else:
        _fill_order(u, sides, least, regular, order)
    return NOTHING


# ----------------------------------------------------------------
# Whether a set that is its own image is one attractor: the images of a short interval about an orbit's state
# fill it.
#
# Cells do not see gaps that are narrower than they, nor cycles that attract slowly; the set is then its own image too.


# Of the length of the set: half the interval that is followed, and its length from which its images are joined.
INTERVAL, LONG = 1e-5, 1e-2
# Throws before the interval is placed; images that are taken; ends that differ by less are one [of the largest side].
BEFORE, MOST_GROWN, SAME = 40, 2000, 1e-9
# Where the interval does not grow: stretches of the set that an orbit has to visit, and its throws.
STRETCHES, MOST_VISITS = 200, 20_000


@kernel(counting=False, inlined=False)
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


@kernel(counting=False, inlined=False)
def fills(params: Any, x: float, side: int, scale: float, p: Pieces, u: Unions) -> bool:
    """Whether the images of a short interval, about where the orbit of a state of SET comes to, fill SET."""
    for _ in range(BEFORE):
        x, side, code = step(params, x, side)
        if code < 0:
            return False
    length, long = _length(u, SET), 0.0
    u.size[PUSHED] = 0
    for i in range(u.size[SET]):
        if u.side[SET, i] == side and u.lo[SET, i] <= x <= u.hi[SET, i]:
            half = INTERVAL * length
            put(u, PUSHED, side, max(x - half, u.lo[SET, i]), min(x + half, u.hi[SET, i]))
    for _ in range(MOST_GROWN):
        u.size[IMAGE] = 0
        images_of(params, p, u, PUSHED, IMAGE, ANY, ANY, 0.0)
        if not merge(u, IMAGE, GAP * scale):
            return False
        copy(u, IMAGE, PUSHED)
        long = _length(u, PUSHED)
        if long >= LONG * length:
            break
    if long < LONG * length:
        return _spreads(params, x, side, length, u)
    copy(u, PUSHED, COVERED)
    for _ in range(MOST_GROWN):
        u.size[IMAGE] = 0
        images_of(params, p, u, PUSHED, IMAGE, ANY, ANY, 0.0)
        if not cover_more(u, scale):
            return False
        if u.size[PUSHED] == 0:
            break
    return _agree(u, COVERED, SAME * scale)
