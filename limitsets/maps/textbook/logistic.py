"""Logistic map."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

__all__ = ["Logistic"]


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


register(Logistic, image=_image, image_on=_image_on, branches=("left", "right"))
DOMAINS[Logistic] = ((0.0, 1.0),)
