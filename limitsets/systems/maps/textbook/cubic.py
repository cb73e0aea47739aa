"""Odd cubic map."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.number import hull_of, larger, square_root
from limitsets.numbers.jit import proof_kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.textbook.shared import DOMAINS, Line, line


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
def _at(r: float, x: float) -> Interval:
    at = Interval(x, x)
    return at * (r - at**2)


@proof_kernel
def _half(r: Interval, a: float, b: float) -> Interval:
    """Exact range on [a, b], 0 <= a: least at an end, with the least r; largest at an end or the turning point."""
    most = max(r.hi, 0.0)
    square = Interval(most, most) / 3.0
    turn = square_root(larger(square, Interval(0.0, 0.0)))
    top = 2.0 * turn * square
    ends = max(_at(r.hi, a).hi, _at(r.hi, b).hi)
    turns = (turn.lo <= b) & (turn.hi >= a)
    return Interval(min(_at(r.lo, a).lo, _at(r.lo, b).lo), max(ends, top.hi) if turns else ends)


def _image_box(params_lo: Cubic, params_hi: Cubic, lo: float, hi: float, side: int) -> Line:
    """Exact range; continuous, so one box, named middle where it holds a turning point."""
    r = Interval(params_lo.r, params_hi.r)
    right, left = _half(r, max(lo, 0.0), max(hi, 0.0)), -_half(r, max(-hi, 0.0), max(-lo, 0.0))
    after = right if lo >= 0.0 else left
    after = hull_of(left, right) if (lo < 0.0) & (hi > 0.0) else after
    outer = (3.0 * Interval(lo, hi) ** 2).lo > r.hi
    return line(after, side, 1 if not outer else (0 if hi < 0.0 else 2))


register(Cubic, image=_image, image_on=_image_on, image_box=_image_box, branches=("left", "middle", "right"))
DOMAINS[Cubic] = ((-1.2, 1.2),)
