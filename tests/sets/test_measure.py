"""Ulam's method where the stationary distribution is known on paper."""

from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from limitsets.systems.sets import invariant_measures
from tests.maps_of_tests import Baker, Linear2


class Swap(NamedTuple):
    """[0, 1) and [1, 2) are swapped by the doubling map: period 2, uniform."""

    factor: float


def _swap(params, x, side):
    base = 0.0 if x < 1.0 else 1.0
    after = params.factor * (x - base)
    after = after if after < 1.0 else after - 1.0
    return after + (1.0 - base), side, 0 if x < 1.0 else 1


ls.register(Swap, image=_swap, branches=("up", "down"))


class Tents(NamedTuple):
    """A tent map on each of [0, 1] and [2, 3], and a rest that falls to the first."""

    slope: float


def _tents(params, x, side):
    base = 2.0 if x >= 2.0 else 0.0
    y = x - base if x >= 2.0 or x <= 1.0 else 0.5 * (x - 1.0)
    after = params.slope * y if y < 0.5 else params.slope * (1.0 - y)
    return base + after, side, 0 if y < 0.5 else 1


ls.register(Tents, image=_tents, branches=("left", "right"))


def measures(params, domain, cells, **options):
    return invariant_measures(ls.transitions(params, ls.grid(domain, cells=cells)), **options)


def test_doubling_map_is_uniform():
    (found,) = measures(ls.maps.Doubling(), [(0.0, 1.0)], 64)
    np.testing.assert_allclose(found.density, 1.0, rtol=0, atol=1e-11)
    assert found.weight.sum() == pytest.approx(1.0, abs=1e-12)
    assert found.residual <= 1e-12
    assert found.lost == 0.0


def test_baker_map_is_uniform():
    (found,) = measures(Baker(), [(0.0, 1.0), (0.0, 1.0)], 16)
    np.testing.assert_allclose(found.density, 1.0, rtol=0, atol=1e-10)


def arcsine(x):
    """Share of the time that the logistic map with r = 4 spends below x."""
    return 2.0 / np.pi * np.arcsin(np.sqrt(x))


def test_logistic_map_comes_near_the_arcsine_density():
    errors = []
    for cells in (1024, 4096, 16384):
        (found,) = measures(ls.maps.Logistic(4.0), [(0.0, 1.0)], cells)
        exact = np.diff(arcsine(np.linspace(0.0, 1.0, cells + 1)))
        errors.append(np.abs(found.weight - exact).sum())
    # The density grows as 1/sqrt(x) at the ends: an end cell holds, and gets wrong, a share of order sqrt(width), and
    # each step carries that on to four times the distance: sqrt(width) ln(1/width) in all.
    assert errors[0] < 0.15
    assert 0.5 < errors[1] / errors[0] < 0.5 * 12 / 10
    assert 0.5 < errors[2] / errors[1] < 0.5 * 14 / 12


def test_period_two_does_not_keep_the_chain_from_resting():
    (found,) = measures(Swap(2.0), [(0.0, 2.0)], 32)
    np.testing.assert_allclose(found.density, 0.5, rtol=0, atol=1e-11)


def test_two_attractors_have_a_measure_each():
    low, high = measures(Tents(1.9), [(0.0, 3.0)], 300)
    np.testing.assert_allclose(low.weight[:100], high.weight[200:], rtol=0, atol=1e-10)  # the same map twice
    assert low.weight[100:].sum() == high.weight[:200].sum() == 0.0
    assert low.weight[:100].sum() == pytest.approx(1.0, abs=1e-12)
    # It lives between the second and the first image of the top: 1.9 (1 - 0.95) = 0.095 and 0.95.
    first, last = np.flatnonzero(low.weight > 1e-9)[[0, -1]]
    assert first == 9
    assert last in (94, 95)  # 0.95 is a border


def test_attracting_cycle_holds_all_the_weight():
    (found,) = measures(ls.maps.Logistic(3.2), [(0.0, 1.0)], 4096)
    r = 3.2  # the cycle of period 2 solves r^2 x^2 - r (r + 1) x + r + 1 = 0
    points = (r + 1 + np.array([-1, 1]) * np.sqrt((r + 1) * (r - 3))) / (2 * r)
    edges = np.linspace(0.0, 1.0, 4097)
    middles = 0.5 * (edges[1:] + edges[:-1])
    for point in points:
        assert found.weight[np.abs(middles - point) < 2 / 4096].sum() == pytest.approx(0.5, abs=1e-9)


def test_shares_of_the_sides_agree_with_an_orbit():
    scene = ls.load("paper-designed")
    graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    (found,) = invariant_measures(graph)
    path = ls.orbit(scene.map, 15.0, 2, 1_000_000)
    for side in range(3):
        share = found.weight[graph.grid.of_side(side)].sum()
        assert share == pytest.approx(np.mean(path.side == side), abs=1e-3)


def test_nothing_stays():
    graph = ls.transitions(Linear2(xx=3.0, yy=3.0), ls.grid([(1.0, 2.0), (1.0, 2.0)], cells=8))
    assert invariant_measures(graph) == ()
