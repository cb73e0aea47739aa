"""Two independent Moebius maps."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

__all__ = ["Product"]

Point = tuple[float, float]


class Product(NamedTuple):
    """x_i' = x_i / (pole - x_i) in each of two coordinates, for x_i < pole.

    Known answers for pole = 2 on [0, 1.2]^2: four fixed points, with slopes 1/2 at 0 and 2 at 1; the order of
    the recurrent sets is the diamond (1, 1) -> (1, 0), (0, 1) -> (0, 0), and (0, 0) attracts.

    Attributes
    ----------
    pole : float
        Where the image is infinite; the second fixed point is at pole - 1.
    """

    pole: float = 2.0


def _image(params: Product, x: Point, side: int) -> tuple[Point, int, int]:
    u, v = x[0] / (params.pole - x[0]), x[1] / (params.pole - x[1])
    inside = (x[0] < params.pole) & (x[1] < params.pole) & (abs(u) < math.inf) & (abs(v) < math.inf)
    return (u, v), side, 0 if inside else codes.OUTSIDE


def _image_on(params: Product, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    left, below = params.pole - x[0], params.pole - x[1]
    slope = ((params.pole / (left * left), 0.0), (0.0, params.pole / (below * below)))
    return (x[0] / left, x[1] / below), side, slope


register(Product, image=_image, image_on=_image_on, dimension=2)
DOMAINS[Product] = ((0.0, 1.2), (0.0, 1.2))
