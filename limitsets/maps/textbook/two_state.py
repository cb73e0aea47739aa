"""Map of the plane with two constant values."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

__all__ = ["TwoState"]

Point = tuple[float, float]


class TwoState(NamedTuple):
    """(x, y)' = (r, r) for x >= 0, (-r, -r) for x < 0; for r < 1/2 the origin in both cases.

    Known answers: for r = 1 on [-2, 2]^2 two attractors with half of the starts each; for r < 1/2 one.

    Attributes
    ----------
    r : float
        Where the two states lie.
    """

    r: float = 1.0


def _image(params: TwoState, x: Point, side: int) -> tuple[Point, int, int]:
    reach = params.r if params.r >= 0.5 else 0.0
    after = reach if x[0] >= 0.0 else -reach
    code = 1 if x[0] >= 0.0 else 0
    return (after, after), side, code if (abs(x[0]) < math.inf) & (abs(x[1]) < math.inf) else codes.OUTSIDE


def _image_on(params: TwoState, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    reach = params.r if params.r >= 0.5 else 0.0
    after = reach if branch == 1 else -reach
    return (after, after), side, ((0.0, 0.0), (0.0, 0.0))


register(TwoState, image=_image, image_on=_image_on, dimension=2, branches=("down", "up"))
DOMAINS[TwoState] = ((-2.0, 2.0), (-2.0, 2.0))
