"""Logistic map."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import proof_kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.textbook.shared import DOMAINS, Line, line


class Logistic(NamedTuple):
    """x' = r x (1 - x), with a monotone branch on either side of 1/2.

    Known answers: fixed points 0 and 1 - 1/r; an attracting orbit of period 2 at r = 3.2, of period 3 at
    r = 3.83; Lyapunov exponent ln 2 at r = 4. Source: May, "Simple mathematical models with very complicated
    dynamics", 1976.

    Attributes
    ----------
    r : float
        Growth per step of a small population, 0 <= r <= 4 on [0, 1].
    """

    r: float = 4.0


def _image(params: Logistic, x: float, side: int) -> tuple[float, int, int]:
    after = params.r * x * (1.0 - x)
    code = 0 if x < 0.5 else 1
    return after, side, code if abs(after) < math.inf else codes.OUTSIDE


def _image_on(params: Logistic, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return params.r * x * (1.0 - x), side, params.r * (1.0 - 2.0 * x)


@proof_kernel
def _hump(x: float) -> Interval:
    """x (1 - x) at one point; x near 1/2 does not come out above 1/4."""
    at = Interval(x, x)
    value = at * (1.0 - at)
    return Interval(value.lo, min(value.hi, 0.25))


def _image_box(params_lo: Logistic, params_hi: Logistic, lo: float, hi: float, side: int) -> Line:
    """Exact range from the ends and the top at 1/2: continuous, so one box, named right where it holds both."""
    r, first, last = Interval(params_lo.r, params_hi.r), _hump(lo), _hump(hi)
    inside = (lo >= 0.0) & (hi <= 1.0)
    bottom = min(first.lo, last.lo)
    bottom = max(bottom, 0.0) if inside else bottom
    after = r * Interval(bottom, 0.25 if (lo <= 0.5) & (hi >= 0.5) else max(first.hi, last.hi))
    # 0 and r/4 are met exactly and may be the domain's ends: the outward step must not pass them.
    grows = r.lo >= 0.0
    below = max(after.lo, 0.0) if grows & (bottom >= 0.0) else after.lo
    top = 0.25 * r.hi if r.hi >= 1e-300 else math.inf
    above = min(after.hi, top) if grows else after.hi
    return line(Interval(below, above), side, 0 if hi < 0.5 else 1)


register(Logistic, image=_image, image_on=_image_on, image_box=_image_box, branches=("left", "right"))
DOMAINS[Logistic] = ((0.0, 1.0),)
