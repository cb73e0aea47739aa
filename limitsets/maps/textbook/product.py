"""Two independent Moebius maps."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.interval.arithmetic import Ends
from limitsets.jit import proof_kernel
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.slots import Plane, Point, plane

__all__ = ["Product"]


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


@proof_kernel
def _moebius(pole: Ends, lo: float, hi: float) -> Ends:
    """Exact range of x / (pole - x) left of the pole: monotone in x; nan or infinite where it may be met."""
    first = iv.div((lo, lo), iv.sub(pole, (lo, lo)))
    last = iv.div((hi, hi), iv.sub(pole, (hi, hi)))
    after = iv.hull(first, last)
    left = iv.sub(pole, (hi, hi))[0] > 0.0
    return (max(after[0], 0.0) if lo >= 0.0 else after[0]) if left else -math.inf, after[
        1
    ] if left else math.inf


def _image_box(params_lo: Product, params_hi: Product, lo: Point, hi: Point, side: int) -> Plane:
    pole = (params_lo.pole, params_hi.pole)
    return plane((_moebius(pole, lo[0], hi[0]), _moebius(pole, lo[1], hi[1])), side, 0)


register(Product, image=_image, image_on=_image_on, image_box=_image_box, dimension=2)
DOMAINS[Product] = ((0.0, 1.2), (0.0, 1.2))
