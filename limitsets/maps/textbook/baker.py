"""Baker map."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS

__all__ = ["Baker"]

Point = tuple[float, float]


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


register(Baker, image=_image, image_on=_image_on, dimension=2, branches=("left", "right"))
DOMAINS[Baker] = ((0.0, 1.0), (0.0, 1.0))
