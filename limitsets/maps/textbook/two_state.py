"""Map of the plane with two constant values."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.slots import Plane, Point, plane_of_two

__all__ = ["TwoState"]


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


def _image_box(params_lo: TwoState, params_hi: TwoState, lo: Point, hi: Point, side: int) -> Plane:
    """Both states on x = 0."""
    r = (params_lo.r, params_hi.r)
    # below 1/2 both states are the origin
    reach = (r[0] if r[0] >= 0.5 else 0.0, r[1] if r[1] >= 0.5 else 0.0)
    down = iv.neg(reach)
    return plane_of_two(lo[0] <= 0.0, (down, down), hi[0] >= 0.0, (reach, reach), side)


register(
    TwoState, image=_image, image_on=_image_on, image_box=_image_box, dimension=2, branches=("down", "up")
)
DOMAINS[TwoState] = ((-2.0, 2.0), (-2.0, 2.0))
