"""Monotone pieces of one side: where the branch changes and where the slope changes its sign, from samples.

As `limitsets.systems.maps.pieces`, in compiled code and to the accuracy of estimates: between samples a change is
bracketed by the deciding number, and a dip of that number towards zero is followed to its bottom, so that two changes
between a pair of samples are found.
"""

from __future__ import annotations

from typing import Any

from limitsets.numbers.jit import kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.kernels import decision, fallback, image, image_on, margin
from limitsets.systems.sets.topology.work import MOST_PIECES, Pieces, Region, Samples

# Steps of a search for a change or for the bottom of a dip, and how close its ends come, as a share of the side.
MOST_STEPS, CLOSE = 100, 1e-15
# A dip is followed where a parabola through three samples comes below this share of the lowest.
FOLLOWED = 0.75
MARGIN, SLOPE, CODE = 0, 1, 2
# A step of the image across one such bracket that is longer, in brackets, is a jump.
JUMP = 1e6


@kernel
def _decided(value: float) -> int:
    """Branch that a margin decides for."""
    return codes.OUTSIDE_MODEL if value != value else 1 if value > 0.0 else 0


@kernel
def branch_at(here: Any, x: float, side: int, decided: bool) -> int:
    """Branch in force; a negative code where there is none.  `decided`: the map has a margin, or but one branch."""
    if decided:
        return _decided(margin(here, x, side))
    after, _, code = image(here, x, side)
    if code == codes.UNSETTLED:
        after, _, code = fallback(here, x, side)
    return codes.UNDEFINED if after != after else code


@kernel(counting=False, inlined=False)
def _followed(here: Any, x: float, side: int, branch: int, what: int) -> Any:
    """Return a number that changes its sign with what is followed: with the branch, or with the slope on a branch."""
    if what == MARGIN:
        return margin(here, x, side)
    if what == SLOPE:
        return image_on(here, x, side, branch)[2]
    return 1.0 if branch_at(here, x, side, False) != branch else -1.0


@kernel(counting=False, inlined=False)
def _change(
    here: Any, side: int, branch: int, what: int, a: float, b: float, f_a: float, f_b: float, close: float
) -> float:
    """Return where the sign changes between a and b, on the side of b: false position, every third step a halving."""
    for step in range(MOST_STEPS):
        if b - a <= close:
            break
        x = 0.5 * (a + b)
        if step % 3 != 2 and what != CODE:
            x = a + (b - a) * (f_a / (f_a - f_b))
            # off the end that has stayed, so that both ends come in
            x = min(
                max(x + (0.25 * close if step % 3 == 0 else -0.25 * close), a + 0.25 * close),
                b - 0.25 * close,
            )
        f = _followed(here, x, side, branch, what)
        if f != f:
            break
        if (f > 0.0) == (f_a > 0.0):
            a, f_a = x, f
        else:
            b, f_b = x, f
    return b


@kernel(counting=False, inlined=False)
def _bottom(here: Any, side: int, branch: int, what: int, a: float, m: float, b: float, f_m: float) -> float:
    """Return a place between a and b where the other sign is met, nan where the dip about m does not come to zero."""
    sign = 1.0 if f_m > 0.0 else -1.0
    # golden section about m: 0.618^40 = 4e-9 of the bracket, where a parabola is flat to rounding
    for _ in range(40):
        x = m + 0.382 * (b - m) if b - m > m - a else m - 0.382 * (m - a)
        f = _followed(here, x, side, branch, what)
        if (f > 0.0) != (f_m > 0.0):
            return x
        if sign * f < sign * f_m:
            a, b = (m, b) if x > m else (a, m)
            m, f_m = x, f
        else:
            a, b = (a, x) if x > m else (x, b)
    return float("nan")


@kernel(counting=False, inlined=False)
def _jump(
    here: Any, side: int, branch: int, a: float, b: float, rising: bool, close: float
) -> tuple[float, float]:
    """Return both sides of a jump against the slope, as a floor makes one; nan where there is none between a and b."""
    sign = 1.0 if rising else -1.0
    y_a, y_b = image_on(here, a, side, branch)[0], image_on(here, b, side, branch)[0]
    while sign * y_b < sign * y_a and b - a > close:
        x = 0.5 * (a + b)
        y = image_on(here, x, side, branch)[0]
        if sign * y < sign * y_a:
            b, y_b = x, y
        else:
            a, y_a = x, y
    if sign * (y_a - y_b) > JUMP * close:
        return a, b
    return float("nan"), float("nan")


@kernel
def _dips(left: float, here: float, right: float) -> bool:
    """Whether three values of one sign may hide a zero beside the middle: by the parabola through them."""
    if not ((left > 0.0) == (here > 0.0) and (right > 0.0) == (here > 0.0)):
        return False
    left, here, right = abs(left), abs(here), abs(right)
    if not (left > here and right >= here):
        return False
    bend, tilt = left - 2.0 * here + right, right - left
    return here - tilt * tilt / (8.0 * bend) < FOLLOWED * here


@kernel(counting=False, inlined=False)
def _sample(here: Any, side: int, decided: bool, bottom: float, span: float, scan: Any, s: Samples) -> None:
    for j in range(scan.size):
        s.x[j] = bottom + span * scan[j]
    if not decided:
        for j in range(scan.size):
            s.margin[j], s.slope[j] = 0.0, 1.0
            s.branch[j] = branch_at(here, s.x[j], side, decided)
            if s.branch[j] >= 0:
                _, _, s.slope[j] = image_on(here, s.x[j], side, s.branch[j])
        return
    for j in range(scan.size):
        s.margin[j], s.slope[j], settled = decision(here, s.x[j], side)
        s.branch[j] = _decided(s.margin[j]) if settled else codes.UNSETTLED
    for j in range(scan.size):
        if s.branch[j] == codes.UNSETTLED:
            s.margin[j], s.slope[j] = margin(here, s.x[j], side), 1.0
            s.branch[j] = _decided(s.margin[j])
            if s.branch[j] >= 0:
                _, _, s.slope[j] = image_on(here, s.x[j], side, s.branch[j])


@kernel
def _cuts_at_dips(here: Any, side: int, j: int, decided: bool, close: float, s: Samples, n: int) -> int:
    """Add the two cuts about sample j where the margin or the slope dips below 0 between samples; the new number."""
    before, a, b, branch = s.x[j - 1], s.x[j], s.x[j + 1], s.branch[j]
    for what in range(2):
        f = s.margin if what == MARGIN else s.slope
        if (what == MARGIN and not decided) or not _dips(f[j - 1], f[j], f[j + 1]):
            continue
        x = _bottom(here, side, branch, what, before, a, b, f[j])
        if x == x:
            f_x = _followed(here, x, side, branch, what)
            s.cuts[n] = _change(here, side, branch, what, before, x, f[j - 1], f_x, close)
            s.cuts[n + 1] = _change(here, side, branch, what, x, b, f_x, f[j + 1], close)
            n += 2
    return n


@kernel
def _sort(cuts: Any, n: int) -> None:
    """Sort the first n, which are nearly sorted: by insertion."""
    for i in range(1, n):
        x, j = cuts[i], i
        while j > 0 and cuts[j - 1] > x:
            cuts[j] = cuts[j - 1]
            j -= 1
        cuts[j] = x


@kernel(counting=False, inlined=False)
def _cuts(here: Any, side: int, decided: bool, close: float, s: Samples) -> int:
    """Fill `s.cuts`, ascending; their number, -1 where there are too many."""
    n, last = 0, s.x.size - 1
    for j in range(last):
        if n + 4 > s.cuts.size:
            return -1
        a, b, branch = s.x[j], s.x[j + 1], s.branch[j]
        if s.branch[j + 1] != branch:
            what = MARGIN if decided and min(branch, s.branch[j + 1]) >= 0 else CODE
            f_a, f_b = (s.margin[j], s.margin[j + 1]) if what == MARGIN else (-1.0, 1.0)
            s.cuts[n] = _change(here, side, branch, what, a, b, f_a, f_b, close)
            n += 1
        elif branch >= 0 and (s.slope[j] > 0.0) != (s.slope[j + 1] > 0.0):
            s.cuts[n] = _change(here, side, branch, SLOPE, a, b, s.slope[j], s.slope[j + 1], close)
            n += 1
        elif branch >= 0 and s.margin[j] == s.margin[j + 1]:  # no number tells where the image jumps
            left, right = _jump(here, side, branch, a, b, s.slope[j] > 0.0, close)
            if left < right:  # what lies between is too short for a piece
                s.cuts[n], s.cuts[n + 1] = left, right
                n += 2
        if j == 0 or branch < 0 or s.branch[j - 1] != branch or s.branch[j + 1] != branch:
            continue
        n = _cuts_at_dips(here, side, j, decided, close, s, n)
    _sort(s.cuts, n)
    return n


@kernel(counting=False, inlined=False)
def find_pieces(here: Any, side: int, decided: bool, r: Region, scan: Any, s: Samples, p: Pieces) -> bool:
    """Append the pieces of one side, from samples at ``r.bottom + (r.hi - r.bottom) * scan``; False for too many."""
    lo, hi, bottom = r.lo[side], r.hi[side], r.bottom[side]
    close = CLOSE * (abs(lo) + abs(hi))
    _sample(here, side, decided, bottom, hi - bottom, scan, s)
    count = _cuts(here, side, decided, close, s)
    q = p.begin[side]
    if count < 0 or count + 1 > MOST_PIECES:
        return False
    for k in range(count + 1):
        begin = lo if k == 0 else s.cuts[k - 1]
        end = hi if k == count else s.cuts[k]
        if end - begin <= 4.0 * close:
            continue
        branch = branch_at(here, 0.5 * (begin + end), side, decided)
        p.lo[q], p.hi[q], p.branch[q], p.to[q] = begin, end, branch, branch
        if branch >= 0:
            p.branch[q] = branch
            p.y_lo[q], to, _ = image_on(here, begin, side, branch)
            p.y_hi[q], _, _ = image_on(here, end, side, branch)
            p.to[q] = to
        else:
            p.branch[q] = -1
        q += 1
    p.begin[side + 1] = q
    return True
