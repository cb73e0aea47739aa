"""Baker map."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.slots import Plane, Point, plane_of_two

__all__ = ["Baker"]


class Baker(NamedTuple):
    """(x, y)' = (2 x, c y) for x < 1/2, else (2 x - 1, c y + 1 - c), on 0 <= x <= 1; c is the contraction.

    Known answers: Lyapunov exponents ln 2 and ln c; for c = 1/2 areas are kept, and the invariant measure is
    uniform.

    Attributes
    ----------
    contraction : float
        Factor across the dough, 0 < contraction <= 1/2.

    Notes
    -----
    Doubles are multiples of a power of 2, so every x ends in 0, as for `limitsets.maps.Doubling`.
    """

    contraction: float = 0.5


def _image(params: Baker, x: Point, side: int) -> tuple[Point, int, int]:
    right = x[0] >= 0.5
    u = 2.0 * x[0] - 1.0 if right else 2.0 * x[0]
    v = params.contraction * x[1]
    v = v + (1.0 - params.contraction) if right else v
    code = 1 if right else 0
    return (u, v), side, code if (x[0] >= 0.0) & (x[0] <= 1.0) & (abs(v) < math.inf) else codes.OUTSIDE


def _image_on(params: Baker, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    c = params.contraction
    slope = ((2.0, 0.0), (0.0, c))
    if branch == 1:
        return (2.0 * x[0] - 1.0, c * x[1] + (1.0 - c)), side, slope
    return (2.0 * x[0], c * x[1]), side, slope


def _image_box(params_lo: Baker, params_hi: Baker, lo: Point, hi: Point, side: int) -> Plane:
    """Both branches at x = 1/2; products with 2 are exact, and the unit square is not left by rounding."""
    c = (params_lo.contraction, params_hi.contraction)
    dough = (lo[0] >= 0.0) & (hi[0] <= 1.0)
    y = (lo[1], hi[1])
    thin = iv.mul(c, y)
    # c y + 1 - c = 1 - c (1 - y), with each number once
    lifted = iv.sub((1.0, 1.0), iv.mul(c, iv.sub((1.0, 1.0), y)))
    bottom = 0.0 if (c[0] >= 0.0) & (y[0] >= 0.0) else -math.inf
    top = 1.0 if (c[0] >= 0.0) & (y[1] <= 1.0) else math.inf
    left = (2.0 * lo[0], min(2.0 * hi[0], 1.0)), (max(thin[0], bottom), thin[1])
    right = iv.sub((2.0 * lo[0], 2.0 * hi[0]), (1.0, 1.0))
    moved = (max(right[0], 0.0), min(right[1], 1.0)), (lifted[0], min(lifted[1], top))
    return plane_of_two(dough & (lo[0] <= 0.5), left, dough & (hi[0] >= 0.5), moved, side)


register(
    Baker, image=_image, image_on=_image_on, image_box=_image_box, dimension=2, branches=("left", "right")
)
DOMAINS[Baker] = ((0.0, 1.0), (0.0, 1.0))
