"""Leslie population model with two ages."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.interval.arithmetic import Ends
from limitsets.jit import proof_kernel
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.exponential import exponential
from limitsets.maps.textbook.slots import Plane, Point, plane, rectangle

__all__ = ["Leslie"]


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


class _Rates(NamedTuple):
    """Parameters as intervals."""

    young: Ends
    old: Ends
    crowding: Ends


@proof_kernel
def _born(p: _Rates, x: Ends, y: Ends) -> Ends:
    return iv.add(iv.mul(p.young, x), iv.mul(p.old, y))


@proof_kernel
def _young(p: _Rates, x: Ends, y: Ends) -> Ends:
    """First coordinate of the image, from each operation in turn."""
    return iv.mul(_born(p, x, y), iv.exp(iv.neg(iv.mul(p.crowding, iv.add(x, y)))))


@proof_kernel
def _crest(own: Ends, other: Ends, crowding: Ends, z: float) -> float:
    """Largest value along the line on which the other age stays z: (own/c) exp(c z (other/own - 1) - 1)."""
    ratio = iv.sub(iv.div(other, own), (1.0, 1.0))
    power = iv.sub(iv.mul(iv.mul(crowding, (z, z)), ratio), (1.0, 1.0))
    return iv.mul(iv.div(own, crowding), iv.exp(power))[1]


@proof_kernel
def _may_be_zero(a: Ends) -> bool:
    return not ((a[0] > 0.0) | (a[1] < 0.0))


@proof_kernel
def _crests(p: _Rates, x: Ends, y: Ends) -> float:
    """Largest value inside the four borders of a box: there the slope along the border is 0."""
    most = -math.inf
    for end in range(2):
        at, beside = (y[0], x[0]) if end == 0 else (y[1], x[1])
        if _may_be_zero(iv.sub(p.young, iv.mul(p.crowding, _born(p, x, (at, at))))):
            most = max(most, _crest(p.young, p.old, p.crowding, at))
        if _may_be_zero(iv.sub(p.old, iv.mul(p.crowding, _born(p, (beside, beside), y)))):
            most = max(most, _crest(p.old, p.young, p.crowding, beside))
    return most


@proof_kernel
def _young_range(p: _Rates, x: Ends, y: Ends) -> Ends:
    """Range over a box: exact, but for parameters that are intervals.

    Where both slopes keep their signs, the corners span it.  Where some are born and the parameters are positive,
    the logarithm is concave: the least value is at a corner and the largest on a border (inside, both slopes are 0
    only for young = old, and then along whole lines).
    """
    born = _born(p, x, y)
    fewer = iv.mul(p.crowding, born)
    across, along = iv.sub(p.young, fewer), iv.sub(p.old, fewer)
    monotone = ((across[0] >= 0.0) | (across[1] <= 0.0)) & ((along[0] >= 0.0) | (along[1] <= 0.0))
    concave = (born[0] > 0.0) & (p.young[0] > 0.0) & (p.old[0] > 0.0) & (p.crowding[0] > 0.0)
    if not (monotone | concave):
        return _young(p, x, y)
    west = iv.hull(_young(p, (x[0], x[0]), (y[0], y[0])), _young(p, (x[0], x[0]), (y[1], y[1])))
    east = iv.hull(_young(p, (x[1], x[1]), (y[0], y[0])), _young(p, (x[1], x[1]), (y[1], y[1])))
    ends = iv.hull(west, east)
    return ends if monotone else (ends[0], max(ends[1], _crests(p, x, y)))


def _image_box(params_lo: Leslie, params_hi: Leslie, lo: Point, hi: Point, side: int) -> Plane:
    rates = _Rates(
        (params_lo.young, params_hi.young),
        (params_lo.old, params_hi.old),
        (params_lo.crowding, params_hi.crowding),
    )
    survival = (params_lo.survival, params_hi.survival)
    x, y = rectangle(lo, hi)
    u, v = _young_range(rates, x, y), iv.mul(survival, x)
    # Nobody is born of nobody, exactly.
    several = (lo[0] >= 0.0) & (lo[1] >= 0.0) & (rates.young[0] >= 0.0) & (rates.old[0] >= 0.0)
    u = (max(u[0], 0.0) if several else u[0], u[1])
    v = (max(v[0], 0.0) if (lo[0] >= 0.0) & (survival[0] >= 0.0) else v[0], v[1])
    return plane((u, v), side, 0)


register(Leslie, image=_image, image_on=_image_on, image_box=_image_box, dimension=2)
DOMAINS[Leslie] = ((-0.001, 90.0), (-0.001, 70.0))
