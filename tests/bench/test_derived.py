"""Boxes derived from a map's plain kernels beside those written by hand: how wide, and how long they take.

The throw is that of the small-angle model: its impact angle is a formula.  That of the exact flight is the root of an
equation, which the throw's own boxes bracket; no kernel without a loop that compares gives it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.feeder.thrower import SmallAngle
from limitsets.numbers.interval import Interval
from limitsets.systems.graph.images.enclosed import enclosures
from limitsets.systems.maps.kernels import forced, image
from limitsets.systems.maps.textbook.shared import Plane, Point, plane, rectangle
from tests.bench.measure import limit, take_turns, versus

pytestmark = pytest.mark.bench


class LogisticDerived(NamedTuple):
    r: float = 4.0


class LeslieDerived(NamedTuple):
    young: float = 19.6
    old: float = 23.68
    crowding: float = 0.1
    survival: float = 0.7


def _leslie(p: Any, x: Any, side: int) -> Any:
    born = p.young * x[0] + p.old * x[1]
    return (born * math.exp(-p.crowding * (x[0] + x[1])), p.survival * x[0]), side, 0


class HenonByHand(NamedTuple):
    a: float = 1.4
    b: float = 0.3


def _henon_box(lo_map: HenonByHand, hi_map: HenonByHand, lo: Point, hi: Point, side: int) -> Plane:
    """Exact range: each number occurs once."""
    x, y = rectangle(lo, hi)
    bent = 1.0 - Interval(lo_map.a, hi_map.a) * x**2
    return plane((bent + y, Interval(lo_map.b, hi_map.b) * x), side, 0)


class SmallThrow(NamedTuple):
    """The throw of the small-angle model as a user writes it down from the paper."""

    kappa: float
    h: float
    rho2: float
    a: np.ndarray
    d: np.ndarray
    ell: np.ndarray
    shift: np.ndarray
    next: np.ndarray


def _small_margin(p: Any, x: Any, side: int) -> Any:
    a, d, reach = p.a[side], p.d[side], x - p.a[side]
    own = a**2 + d**2
    omega = (p.rho2 - a * reach + own + d * p.h) / (p.rho2 + own)
    barrier = p.kappa * (a**2 / (p.ell[side] + d)) - 2.0 * (a * reach)
    return 0.5 * (p.rho2 + own) * (omega * abs(omega)) - barrier


def _small_on(p: Any, x: Any, side: int, branch: int) -> Any:
    after = x - p.h * (2.0 * (x - p.a[side]) / p.kappa)
    if branch == 1:
        return after - p.shift[side], int(p.next[side])
    return after, side


def _small(p: Any, x: Any, side: int) -> Any:
    branch = 1 if _small_margin(p, x, side) > 0.0 else 0
    after, to = _small_on(p, x, side, branch)
    return after, to, branch


ls.register(LogisticDerived, image=image.methods[maps.Logistic], image_on=forced.methods[maps.Logistic])
ls.register(LeslieDerived, image=_leslie, dimension=2)
ls.register(HenonByHand, image=image.methods[maps.Henon], image_box=_henon_box, dimension=2)
ls.register(SmallThrow, image=_small, image_on=_small_on, margin=_small_margin, branches=("jog", "flip"))


def small_throw() -> tuple[Any, Any]:
    """The throw map of paper-designed with small angles, and the same as a user's map."""
    throw = ls.load("paper-designed").map._replace(flight=SmallAngle())
    a, d = throw.a, throw.d
    after = np.roll(np.arange(a.size), -1)
    shift = a + throw.length[after] - a[after]
    rho2 = throw.radius_of_gyration**2
    own = SmallThrow(throw.kappa, throw.surface_height, rho2, a, d, np.hypot(a, d), shift, after)
    return throw, maps.coerce(own)


THROW = small_throw()
PAIRS = {
    "logistic": (maps.Logistic(3.9), LogisticDerived(3.9), np.linspace(0.0, 1.0, 200_001)),
    "Henon": (HenonByHand(), maps.Henon(), (np.linspace(-2.0, 2.0, 401),) * 2),
    "Leslie": (maps.Leslie(), LeslieDerived(), tuple(np.linspace(0.0, end, 401) for end in (90.0, 70.0))),
    "throw, small angles": (*THROW, np.linspace(float(THROW[0].a[2]) + 0.1, THROW[0].arm_length, 200_001)),
}


def widths(found: Any) -> np.ndarray:
    """Width of the first coordinate of each cell's boxes, the sum where there are two."""
    total = 0.0
    for lo, hi in found.hulls.values():
        first, last = (end.reshape(end.shape[0], -1)[:, 0] for end in (lo, hi))
        total = total + np.where(first <= last, last - first, 0.0)
    return np.asarray(total)


@pytest.mark.parametrize("name", PAIRS)
def test_derived_boxes(benchmark, name, table):
    hand, derived, edges = PAIRS[name]
    side = 2 if "throw" in name else 0

    def ours():
        return enclosures(derived, derived, edges, side)

    turns = take_turns(benchmark, ours, {"by hand": lambda: enclosures(hand, hand, edges, side)}, rounds=9)
    own, theirs = widths(turns.answer), widths(turns.answers["by hand"])
    real = theirs > 0.0
    ratio = own[real] / theirs[real]
    assert not turns.answer.lost.any()
    assert np.median(ratio) < 1.001
    for what, value in (("median", np.median(ratio)), ("mean", ratio.mean()), ("largest", ratio.max())):
        table.append(limit(f"boxes of {name}, derived: {what} width to that by hand", float(value), "", None))
    table.append(versus(f"boxes of {name}, derived, a cell", turns, "by hand", unit="ns", per=own.size))
