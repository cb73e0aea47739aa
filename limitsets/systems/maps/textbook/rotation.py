"""Rotation of the circle."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.numbers.interval import Interval
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.textbook.shared import DOMAINS, Line, on_circle


class Rotation(NamedTuple):
    """x' = x + angle mod 1 on the circle [0, 1); x = 1 is read as 0, so that cells may end there.

    Known answers: for an irrational angle every orbit is dense and uniform; the Lyapunov exponent is 0.

    Attributes
    ----------
    angle : float
        Turn per step, 0 <= angle < 1 [turns]; by default the golden mean's.
    """

    angle: float = 0.6180339887498949


def _image(params: Rotation, x: float, side: int) -> tuple[float, int, int]:
    after = x + params.angle
    wraps = after >= 1.0
    code = 1 if wraps else 0
    code = code if (x >= 0.0) & (x <= 1.0) else codes.OUTSIDE
    return after - 1.0 if wraps else after, side, code


def _image_on(params: Rotation, x: float, side: int, branch: int) -> tuple[float, int, float]:
    after = x + params.angle
    return after - 1.0 if branch == 1 else after, side, 1.0


def _image_box(params_lo: Rotation, params_hi: Rotation, lo: float, hi: float, side: int) -> Line:
    """Clipped to what x on the circle and an angle in [0, 1] allow."""
    angle = Interval(params_lo.angle, params_hi.angle)
    turned = Interval(lo, hi) + angle
    bottom = 0.0 if angle.lo >= 0.0 else -math.inf
    top = 1.0 if angle.hi <= 1.0 else math.inf
    return on_circle(turned, bottom, top, lo, hi, side)


register(Rotation, image=_image, image_on=_image_on, image_box=_image_box, branches=("stay", "wrap"))
DOMAINS[Rotation] = ((0.0, 1.0),)
