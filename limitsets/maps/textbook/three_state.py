"""Map of the line with three constant values."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

__all__ = ["ThreeState"]


class ThreeState(NamedTuple):
    """x' = -value for x < -edge, 0 for -edge <= x <= edge, value for x > edge.

    Known answer: for value > edge three attractors, whose basins are the three intervals.

    Attributes
    ----------
    value : float
        Where the outer states lie.
    edge : float
        Where the basins end.
    """

    value: float = 2.0
    edge: float = 1.0


def _image(params: ThreeState, x: float, side: int) -> tuple[float, int, int]:
    code = 1 if x >= -params.edge else 0
    code = 2 if x > params.edge else code
    after = params.value * (code - 1.0)
    return after, side, code if abs(x) < math.inf else codes.OUTSIDE


def _image_on(params: ThreeState, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return params.value * (branch - 1.0), side, 0.0


register(ThreeState, image=_image, image_on=_image_on, branches=("low", "middle", "high"))
DOMAINS[ThreeState] = ((-3.0, 3.0),)
