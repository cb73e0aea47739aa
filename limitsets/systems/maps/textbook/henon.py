"""Henon map."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.textbook.shared import DOMAINS, Point


class Henon(NamedTuple):
    """(x, y)' = (1 - a x^2 + y, b x).

    Known answers: fixed points x = (b - 1 +- sqrt((1 - b)^2 + 4 a)) / (2 a), y = b x; the Jacobian's
    determinant is -b. At a = 1.4, b = 0.3 the Lyapunov exponent is 0.4192, and 0.432 +- 0.002 of uniform starts
    in [-2, 2]^2 stay bounded. Source: Henon, "A two-dimensional mapping with a strange attractor", 1976.

    Attributes
    ----------
    a : float
        Bend.
    b : float
        Contraction of areas.
    """

    a: float = 1.4
    b: float = 0.3


def _image(params: Henon, x: Point, side: int) -> tuple[Point, int, int]:
    u = 1.0 - params.a * x[0] ** 2 + x[1]
    v = params.b * x[0]
    return (u, v), side, 0 if (abs(u) < math.inf) & (abs(v) < math.inf) else codes.OUTSIDE


def _image_on(params: Henon, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    u = 1.0 - params.a * x[0] ** 2 + x[1]  # as a power, each number occurs once: the derived box is exact
    return (u, params.b * x[0]), side, ((-2.0 * params.a * x[0], 1.0), (params.b, 0.0))


register(Henon, image=_image, image_on=_image_on, dimension=2)
DOMAINS[Henon] = ((-2.0, 2.0), (-2.0, 2.0))
