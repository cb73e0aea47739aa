"""Cycles close under `image`, and each comes once: against counts on paper and by another way."""

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets import maps
from limitsets.systems.cells import as_domain
from limitsets.systems.sets import cycles_from, cycles_of

UNIT, ALL = as_domain([(0.0, 1.0)]), {0: [(0.0, 1.0)]}


class Turned(NamedTuple):
    """The circle map with `floor` in place of branches."""

    omega: float
    coupling: float


def turned(p, x, side):
    y = x + p.omega - p.coupling / math.tau * math.sin(math.tau * x)
    return y - math.floor(y), side, 0


class Twice(NamedTuple):
    factor: float


def twice(p, x, side):
    y = p.factor * x
    return y - math.floor(y), side, 0


class Kicked(NamedTuple):
    """The standard map on the torus."""

    k: float


def kicked(p, x, side):
    v = x[1] + p.k / math.tau * math.sin(math.tau * x[0])
    u = x[0] + v
    return (u - math.floor(u), v - math.floor(v)), side, 0


class Cat(NamedTuple):
    a: float


def cat(p, x, side):
    u, v = p.a * x[0] + x[1], x[0] + x[1]
    return (u - math.floor(u), v - math.floor(v)), side, 0


class Open(NamedTuple):
    """x / 2 + 1/4 below 1/2, where the limit is a fixed point and the map is not; x / 2 above."""

    half: float


def opened(p, x, side):
    branch = 0 if x < 0.5 else 1
    after, to = opened_on(p, x, side, branch)
    return after, to, branch


def opened_on(p, x, side, branch):
    return (p.half * x + 0.25 if branch == 0 else p.half * x), side


class Cancels(NamedTuple):
    """The logistic map by a formula that loses six digits."""

    r: float


def cancels(p, x, side):
    return (p.r * x * (1.0 - x) + 1e6) - 1e6, side, 0


ls.register(Turned, image=turned)
ls.register(Twice, image=twice)
ls.register(Kicked, image=kicked, dimension=2)
ls.register(Cat, image=cat, dimension=2)
ls.register(Open, image=opened, image_on=opened_on, branches=("below", "above"))
ls.register(Cancels, image=cancels)


def require_closed(params, found):
    """Hold every cycle against the map itself."""
    for cycle in found:
        points = cycle.x if cycle.x.ndim > 1 else cycle.x[:, None]
        miss = []
        for x, side, branch, to, to_side in zip(
            cycle.x,
            cycle.side,
            cycle.branches,
            np.roll(points, -1, axis=0),
            np.roll(cycle.side, -1),
            strict=True,
        ):
            one = maps.images(params, np.array([x]), int(side))
            assert (one.code[0], one.side[0]) == (branch, to_side)
            miss.append(np.abs(one.x[0] - to).max())
        assert max(miss) == cycle.residual <= cycle.rounding
        assert len(np.unique(np.column_stack([points, cycle.side]), axis=0)) == cycle.period
    points = [np.round(c.x.reshape(c.period, -1), 7) + 0.0 for c in found]
    rounded = {
        tuple(sorted((*x, s) for x, s in zip(p.tolist(), c.side.tolist(), strict=True)))
        for p, c in zip(points, found, strict=True)
    }
    assert len(rounded) == len(found)


def lifted(p, n, up_to):
    """Count the cycles of each period of a circle map: changes of sign of F^p(x) - x - q, of its lift, on a grid."""
    x = (np.arange(n) + 0.5) / n
    count, y = {}, x.copy()
    for period in range(1, up_to + 1):
        y = y + p.omega - p.coupling / math.tau * np.sin(math.tau * y)
        for q in range(math.floor((y - x).min()), math.ceil((y - x).max()) + 1):
            sign = np.sign(y - x - q)
            points = int((sign != np.roll(sign, -1)).sum())
            shorter = sum(d * n for (d, of), n in count.items() if period % d == 0 and of * period == q * d)
            if points > shorter:
                count[period, q] = (points - shorter) // period
    found = Counter()
    for (period, _), number in count.items():
        found[period] += number
    return found


@pytest.mark.parametrize(
    ("omega", "coupling"), [(0.61, 0.9), (0.35, 0.95), (0.5, 0.9), (0.4, 0.99), (0.02, 0.3)]
)
def test_an_own_circle_map_has_the_cycles_of_its_lift(omega, coupling):
    params = Turned(omega, coupling)
    found = cycles_of(params, ALL, UNIT, 6)
    require_closed(params, found)
    assert Counter(c.period for c in found) == lifted(params, 200_001, 6)
    same = maps.Circle(omega, coupling)
    other = cycles_of(same, ALL, UNIT, 6)
    require_closed(same, other)
    assert [c.multiplier for c in other] == pytest.approx([c.multiplier for c in found], abs=1e-9)


def test_the_circle_map_at_one_half():
    # 0 and 1/2 are one orbit, of slope (1 - K) (1 + K); the other one goes from x to 1 - x
    first, second = cycles_of(maps.Circle(0.5, 0.9), ALL, UNIT, 4)
    assert first.x.tolist() == [0.0, 0.5]
    assert first.multiplier == pytest.approx((1.0 - 0.9) * (1.0 + 0.9), abs=1e-12)
    assert second.x.sum() == pytest.approx(1.0, abs=1e-14)


def test_the_doubling_map_by_floor_has_2_to_the_p_minus_1_points():
    found = cycles_of(Twice(2.0), ALL, UNIT, 9)
    require_closed(Twice(2.0), found)
    for p in range(1, 10):
        assert sum(c.period for c in found if p % c.period == 0) == 2**p - 1


def test_a_limit_that_is_no_orbit_is_no_cycle():
    assert [c.x.tolist() for c in cycles_of(Open(0.5), ALL, UNIT, 3) if c.period == 1] == []


def test_a_formula_that_cancels_loses_no_cycle():
    plain, rough = (cycles_of(cls(3.9), ALL, UNIT, 6) for cls in (maps.Logistic, Cancels))
    require_closed(Cancels(3.9), rough)
    assert Counter(c.period for c in rough) == Counter(c.period for c in plain)
    assert max(c.rounding for c in plain) < 1e-12 < max(c.rounding for c in rough) < 1e-8


def test_near_a_doubling_a_cycle_of_twice_the_period_is_there_or_not():
    # the cycle of period 2 is born at r = 3; its points are sqrt(r - 3) apart, in units of about 1
    for r, periods in ((3.0 - 1e-9, [1, 1]), (3.0, [1, 1]), (3.0 + 1e-6, [1, 1, 2])):
        found = cycles_of(maps.Logistic(r), ALL, UNIT, 4)
        assert [c.period for c in found] == periods
        require_closed(maps.Logistic(r), found)


def test_the_standard_map_has_two_cycles_of_period_two():
    graph = ls.transitions(Kicked(1.2), ls.grid([(0.0, 1.0)] * 2, cells=64))
    found = ls.cycles(graph, 3)
    require_closed(Kicked(1.2), found)
    two = [c for c in found if c.period == 2]
    # (0, 1/2), (1/2, 1/2): the trace of (1 + K, 1; K, 1) (1 - K, 1; -K, 1) is 2 - K^2
    assert two[0].multiplier == pytest.approx(1.0, abs=1e-9)
    # the other has v = 2 x at x and 1 - x, with 4 x = 1 - K sin(2 pi x) / (2 pi) up to a turn
    assert len(two) == 2
    x = two[1].x[0, 0]
    assert two[1].x[1, 0] == pytest.approx(1.0 - x, abs=1e-12)
    assert two[1].x[0, 1] == pytest.approx((2.0 * x) % 1.0, abs=1e-12)


def test_the_cat_map_has_its_points():
    # |trace of A^p - 2| points: 1, 5, 16
    random = np.random.default_rng(3)
    found = cycles_from(Cat(2.0), random.random((4000, 2)), 0, 3)
    require_closed(Cat(2.0), found)
    assert Counter(c.period for c in found) == {1: 1, 2: 2, 3: 5}  # those of periods 1 and 3 lie on the seams
