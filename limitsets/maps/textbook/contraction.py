"""Affine map of the line."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.slots import Line, line

__all__ = ["Contraction"]


class Contraction(NamedTuple):
    """x' = slope x + offset, a contraction for abs(slope) < 1.

    Known answer: the fixed point offset / (1 - slope) attracts everything; the Lyapunov exponent is
    ln abs(slope).

    Attributes
    ----------
    slope : float
        Factor per step.
    offset : float
        Image of 0.
    """

    slope: float = 0.5
    offset: float = 0.0


def _image(params: Contraction, x: float, side: int) -> tuple[float, int, int]:
    after = params.slope * x + params.offset
    return after, side, 0 if abs(after) < math.inf else codes.OUTSIDE


def _image_on(params: Contraction, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return params.slope * x + params.offset, side, params.slope


def _image_box(params_lo: Contraction, params_hi: Contraction, lo: float, hi: float, side: int) -> Line:
    slope, offset = (params_lo.slope, params_hi.slope), (params_lo.offset, params_hi.offset)
    return line(iv.add(iv.mul(slope, (lo, hi)), offset), side, 0)


register(Contraction, image=_image, image_on=_image_on, image_box=_image_box)
DOMAINS[Contraction] = ((-1.0, 1.0),)
