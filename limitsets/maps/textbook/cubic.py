"""Odd cubic map."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.interval.arithmetic import Ends
from limitsets.jit import proof_kernel
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.slots import Line, line

__all__ = ["Cubic"]


class Cubic(NamedTuple):
    """u' = r u - u^3, with three monotone branches that meet at the turning points +-sqrt(r/3).

    Known answers: fixed points 0 and +-sqrt(r - 1) with slopes r and 3 - 2 r. At r = 1.5 the attractors are
    +-sqrt(1/2), of slope 0, and 0 is the edge state between their basins.

    Attributes
    ----------
    r : float
        Slope at 0, positive.
    """

    r: float = 1.5


def _image(params: Cubic, x: float, side: int) -> tuple[float, int, int]:
    after = x * (params.r - x * x)
    code = 0 if x < 0.0 else 2
    code = 1 if 3.0 * x * x <= params.r else code
    return after, side, code if abs(after) < math.inf else codes.OUTSIDE


def _image_on(params: Cubic, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return x * (params.r - x * x), side, params.r - 3.0 * x * x


@proof_kernel
def _half(r: Ends, a: float, b: float) -> Ends:
    """Exact range on [a, b], 0 <= a: least at an end, with the least r; largest at an end or the turning point."""
    first_lo = iv.mul((a, a), iv.sub((r[0], r[0]), iv.sqr((a, a))))
    last_lo = iv.mul((b, b), iv.sub((r[0], r[0]), iv.sqr((b, b))))
    first_hi = iv.mul((a, a), iv.sub((r[1], r[1]), iv.sqr((a, a))))
    last_hi = iv.mul((b, b), iv.sub((r[1], r[1]), iv.sqr((b, b))))
    most = max(r[1], 0.0)
    turn = iv.sqrt(iv.maximum(iv.div((most, most), (3.0, 3.0)), (0.0, 0.0)))
    top = iv.mul(iv.mul((2.0, 2.0), turn), iv.div((most, most), (3.0, 3.0)))
    turns = (turn[0] <= b) & (turn[1] >= a)
    ends = max(first_hi[1], last_hi[1])
    return min(first_lo[0], last_lo[0]), max(ends, top[1]) if turns else ends


def _image_box(params_lo: Cubic, params_hi: Cubic, lo: float, hi: float, side: int) -> Line:
    """Exact range; continuous, so one box, named middle where it holds a turning point."""
    r = (params_lo.r, params_hi.r)
    right, left = _half(r, max(lo, 0.0), max(hi, 0.0)), iv.neg(_half(r, max(-hi, 0.0), max(-lo, 0.0)))
    after = right if lo >= 0.0 else left
    after = iv.hull(left, right) if (lo < 0.0) & (hi > 0.0) else after
    outer = iv.mul((3.0, 3.0), iv.sqr((lo, hi)))[0] > r[1]
    return line(after, side, 1 if not outer else (0 if hi < 0.0 else 2))


register(Cubic, image=_image, image_on=_image_on, image_box=_image_box, branches=("left", "middle", "right"))
DOMAINS[Cubic] = ((-1.2, 1.2),)
