"""Linear map of the plane."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.slots import Plane, Point, plane, rectangle

__all__ = ["Linear2"]


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


def _image_box(params_lo: Linear2, params_hi: Linear2, lo: Point, hi: Point, side: int) -> Plane:
    """Exact range: each number occurs once per coordinate."""
    x, y = rectangle(lo, hi)
    u = iv.add(iv.mul((params_lo.xx, params_hi.xx), x), iv.mul((params_lo.xy, params_hi.xy), y))
    v = iv.add(iv.mul((params_lo.yx, params_hi.yx), x), iv.mul((params_lo.yy, params_hi.yy), y))
    return plane((u, v), side, 0)


register(Linear2, image=_image, image_on=_image_on, image_box=_image_box, dimension=2)
DOMAINS[Linear2] = ((-1.0, 1.0), (-1.0, 1.0))
