"""Odd cubic map."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

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


register(Cubic, image=_image, image_on=_image_on, branches=("left", "middle", "right"))
DOMAINS[Cubic] = ((-1.2, 1.2),)
