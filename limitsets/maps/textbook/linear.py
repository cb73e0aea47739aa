"""Linear map of the plane."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

__all__ = ["Linear2"]

Point = tuple[float, float]


class Linear2(NamedTuple):
    """(x, y)' = (xx x + xy y, yx x + yy y); by default the saddle diag(0.5, 2).

    Known answers: the unstable set of the saddle is the y axis. For f = (x, y/2), that is
    ``Linear2(1.0, 0.0, 0.0, 0.5)``, the relative attractor of [-1, 1]^2 is the x axis.

    Attributes
    ----------
    xx, xy, yx, yy : float
        Entries of the matrix, row by row.
    """

    xx: float = 0.5
    xy: float = 0.0
    yx: float = 0.0
    yy: float = 2.0


def _image(params: Linear2, x: Point, side: int) -> tuple[Point, int, int]:
    u = params.xx * x[0] + params.xy * x[1]
    v = params.yx * x[0] + params.yy * x[1]
    return (u, v), side, 0 if (abs(u) < math.inf) & (abs(v) < math.inf) else codes.OUTSIDE


def _image_on(params: Linear2, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    u = params.xx * x[0] + params.xy * x[1]
    v = params.yx * x[0] + params.yy * x[1]
    return (u, v), side, ((params.xx, params.xy), (params.yx, params.yy))


register(Linear2, image=_image, image_on=_image_on, dimension=2)
DOMAINS[Linear2] = ((-1.0, 1.0), (-1.0, 1.0))
