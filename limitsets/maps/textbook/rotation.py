"""Rotation of the circle."""

from __future__ import annotations

from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

__all__ = ["Rotation"]


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


register(Rotation, image=_image, image_on=_image_on, branches=("stay", "wrap"))
DOMAINS[Rotation] = ((0.0, 1.0),)
