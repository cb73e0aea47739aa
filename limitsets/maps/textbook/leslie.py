"""Leslie population model with two ages."""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.exponential import exponential

__all__ = ["Leslie"]

Point = tuple[float, float]


class Leslie(NamedTuple):
    """(x, y)' = ((young x + old y) exp(-crowding (x + y)), survival x).

    Known answers: fixed points 0 and x = ln(young + survival old) / (crowding (1 + survival)), y = survival x;
    the recurrent components in tests/maps. Source: Arai, Kalies, Kokubu, Mischaikow, Oka, Pilarczyk, "A database
    schema for the analysis of global dynamics of multiparameter systems", 2009; the example of CMGDB.

    Attributes
    ----------
    young, old : float
        Offspring per head of the two ages, without crowding.
    crowding : float
        Decay of fertility with the size of the population.
    survival : float
        Share of the young that grow old.
    """

    young: float = 19.6
    old: float = 23.68
    crowding: float = 0.1
    survival: float = 0.7


def _image(params: Leslie, x: Point, side: int) -> tuple[Point, int, int]:
    decay = exponential(-params.crowding * (x[0] + x[1]))
    u = (params.young * x[0] + params.old * x[1]) * decay
    v = params.survival * x[0]
    return (u, v), side, 0 if (abs(u) < math.inf) & (abs(v) < math.inf) else codes.OUTSIDE


def _image_on(params: Leslie, x: Point, side: int, branch: int) -> tuple[Point, int, tuple[Point, Point]]:
    decay = exponential(-params.crowding * (x[0] + x[1]))
    born = params.young * x[0] + params.old * x[1]
    fewer = params.crowding * born
    slope = (((params.young - fewer) * decay, (params.old - fewer) * decay), (params.survival, 0.0))
    return (born * decay, params.survival * x[0]), side, slope


register(Leslie, image=_image, image_on=_image_on, dimension=2)
DOMAINS[Leslie] = ((-0.001, 90.0), (-0.001, 70.0))
