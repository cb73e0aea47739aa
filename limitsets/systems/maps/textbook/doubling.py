"""Doubling map of the circle, and its slower relatives."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.numbers.interval import Interval
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.textbook.shared import DOMAINS, Line, on_circle


class Doubling(NamedTuple):
    """x' = factor x mod 1 on the circle [0, 1); x = 1 is read as the end of the upper branch.

    Known answers for factor 2: entropy and Lyapunov exponent ln 2, 2^p - 1 points with F^p(x) = x, uniform
    density. In general the entropy is ln factor (Parry, "On the beta-expansions of real numbers", 1960).

    Attributes
    ----------
    factor : float
        Slope, 1 < factor <= 2.

    Notes
    -----
    Doubles are multiples of a power of 2, so factor 2 sends each of them to 0: from 0.1 in 55 steps. Take
    factor 1.999999999 for statistics of long orbits.
    """

    factor: float = 2.0


def _image(params: Doubling, x: float, side: int) -> tuple[float, int, int]:
    after = params.factor * x
    high = after >= 1.0
    code = 1 if high else 0
    code = code if (x >= 0.0) & (x <= 1.0) else codes.OUTSIDE
    rest = after - 1.0
    rest = rest if rest > 0.0 else 0.0  # factor x - 1 contracted may be below 0 where factor x rounds to 1
    return rest if high else after, side, code


def _image_on(params: Doubling, x: float, side: int, branch: int) -> tuple[float, int, float]:
    after = params.factor * x
    return after - 1.0 if branch == 1 else after, side, params.factor


def _image_box(params_lo: Doubling, params_hi: Doubling, lo: float, hi: float, side: int) -> Line:
    """Clipped to what x on the circle and a factor in [0, 2] allow."""
    factor = Interval(params_lo.factor, params_hi.factor)
    times = factor * Interval(lo, hi)
    bottom = 0.0 if factor.lo >= 0.0 else -math.inf
    top = 1.0 if factor.hi <= 2.0 else math.inf
    return on_circle(times, bottom, top, lo, hi, side)


register(Doubling, image=_image, image_on=_image_on, image_box=_image_box, branches=("low", "high"))
DOMAINS[Doubling] = ((0.0, 1.0),)
