"""Leslie population model with two ages."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.number import hull_of
from limitsets.numbers.jit import proof_kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.textbook.shared import DOMAINS, Plane, Point, exponential, plane, rectangle


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
    decay = math.exp(-params.crowding * (x[0] + x[1]))
    born = params.young * x[0] + params.old * x[1]
    fewer = params.crowding * born
    slope = (((params.young - fewer) * decay, (params.old - fewer) * decay), (params.survival, 0.0))
    return (born * decay, params.survival * x[0]), side, slope


class _Rates(NamedTuple):
    """Parameters as intervals."""

    young: Interval
    old: Interval
    crowding: Interval


@proof_kernel
def _born(p: _Rates, x: Interval, y: Interval) -> Interval:
    return p.young * x + p.old * y


@proof_kernel
def _young(p: Any, x: Any, y: Any) -> Interval:
    """First coordinate of the image, from each operation in turn."""
    return _born(p, x, y) * math.exp(-(p.crowding * (x + y)))


@proof_kernel
def _crest(own: Any, other: Any, crowding: Any, z: float) -> float:
    """Largest value along the line on which the other age stays z: (own/c) exp(c z (other/own - 1) - 1)."""
    ratio = other / own - 1.0
    top: Interval = own / crowding * math.exp(crowding * Interval(z, z) * ratio - 1.0)
    return top.hi


@proof_kernel
def _may_be_zero(a: Interval) -> bool:
    return not ((a.lo > 0.0) | (a.hi < 0.0))


@proof_kernel
def _crests(p: _Rates, x: Interval, y: Interval) -> float:
    """Largest value inside the four borders of a box: there the slope along the border is 0."""
    most = -math.inf
    for end in range(2):
        at, beside = (y.lo, x.lo) if end == 0 else (y.hi, x.hi)
        if _may_be_zero(p.young - p.crowding * _born(p, x, Interval(at, at))):
            most = max(most, _crest(p.young, p.old, p.crowding, at))
        if _may_be_zero(p.old - p.crowding * _born(p, Interval(beside, beside), y)):
            most = max(most, _crest(p.old, p.young, p.crowding, beside))
    return most


@proof_kernel
def _young_range(p: _Rates, x: Interval, y: Interval) -> Interval:
    """Range over a box: exact, but for parameters that are intervals.

    Where both slopes keep their signs, the corners span it.  Where some are born and the parameters are positive,
    the logarithm is concave: the least value is at a corner and the largest on a border (inside, both slopes are 0
    only for young = old, and then along whole lines).
    """
    born = _born(p, x, y)
    fewer = p.crowding * born
    across, along = p.young - fewer, p.old - fewer
    monotone = ((across.lo >= 0.0) | (across.hi <= 0.0)) & ((along.lo >= 0.0) | (along.hi <= 0.0))
    concave = (born.lo > 0.0) & (p.young.lo > 0.0) & (p.old.lo > 0.0) & (p.crowding.lo > 0.0)
    if not (monotone | concave):
        return _young(p, x, y)
    left, right, low, high = (
        Interval(x.lo, x.lo),
        Interval(x.hi, x.hi),
        Interval(y.lo, y.lo),
        Interval(y.hi, y.hi),
    )
    west = hull_of(_young(p, left, low), _young(p, left, high))
    east = hull_of(_young(p, right, low), _young(p, right, high))
    ends = hull_of(west, east)
    return Interval(ends.lo, ends.hi if monotone else max(ends.hi, _crests(p, x, y)))


def _image_box(params_lo: Leslie, params_hi: Leslie, lo: Point, hi: Point, side: int) -> Plane:
    rates = _Rates(
        Interval(params_lo.young, params_hi.young),
        Interval(params_lo.old, params_hi.old),
        Interval(params_lo.crowding, params_hi.crowding),
    )
    survival = Interval(params_lo.survival, params_hi.survival)
    x, y = rectangle(lo, hi)
    u, v = _young_range(rates, x, y), survival * x
    # Nobody is born of nobody, exactly.
    several = (lo[0] >= 0.0) & (lo[1] >= 0.0) & (rates.young.lo >= 0.0) & (rates.old.lo >= 0.0)
    u = Interval(max(u.lo, 0.0) if several else u.lo, u.hi)
    v = Interval(max(v.lo, 0.0) if (lo[0] >= 0.0) & (survival.lo >= 0.0) else v.lo, v.hi)
    return plane((u, v), side, 0)


register(Leslie, image=_image, image_on=_image_on, image_box=_image_box, dimension=2)
DOMAINS[Leslie] = ((-0.001, 90.0), (-0.001, 70.0))
