"""Topological entropy against closed forms."""

import math

import pytest

import limitsets as ls
from limitsets import maps
from limitsets.systems.cells import as_domain
from limitsets.systems.sets import limit_set_of
from limitsets.systems.sets.measure import topological_entropy

UNIT = as_domain([(0, 1)])


def of_logistic(r):
    bands = limit_set_of(maps.Logistic(r), {0: [(0.05, 0.999)]}, UNIT).extents
    return topological_entropy(maps.Logistic(r), bands, UNIT)


def test_the_full_logistic_map_has_ln_2():
    assert topological_entropy(maps.Logistic(4.0), {0: [(0.0, 1.0)]}, UNIT) == pytest.approx(
        math.log(2), rel=1e-10
    )


def test_where_two_bands_merge_it_is_half_of_that():
    # F^2 on each of two bands is conjugate to the full tent map (Misiurewicz point, F^3(1/2) a fixed point)
    assert of_logistic(3.678573510428322) == pytest.approx(0.5 * math.log(2), rel=1e-8)


def test_within_the_window_of_period_three_it_is_that_of_the_golden_ratio():
    # the set from 0.05 to 0.999 holds the repelling Cantor set beside the cycle: laps grow as Fibonacci numbers
    assert of_logistic(3.83) == pytest.approx(math.log(0.5 * (1.0 + math.sqrt(5.0))), rel=1e-10)


@pytest.mark.parametrize("r", [2.8, 3.2, 3.5])
def test_before_chaos_it_is_zero(r):
    assert of_logistic(r) == 0.0


@pytest.mark.parametrize("slope", [1.3, 1.6180339887498949, 1.9])
def test_constant_slope(slope):
    # of a piecewise linear map of constant slope s it is ln s (Misiurewicz and Szlenk)
    params = maps.Doubling(slope)
    bands = limit_set_of(params, {0: [(0.0, 1.0)]}, UNIT).extents
    assert topological_entropy(params, bands, UNIT) == pytest.approx(math.log(slope), rel=1e-6)


@pytest.mark.parametrize("name", ["paper-initial-small-angle", "paper-designed-small-angle"])
def test_small_angle_feeders_have_the_logarithm_of_their_slope(name):
    scene = ls.load(name)
    bands = ls.limit_set(ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))).extents
    slope = 1.0 + 2.0 * abs(scene.surface_height) / scene.kappa
    found = topological_entropy(scene.map, bands, scene.domain)
    assert found == pytest.approx(math.log(slope), rel=1e-5)


def test_it_is_at_least_the_lyapunov_exponent():
    # Ruelle's inequality, and 0.206 per throw on the designed feeder
    scene = ls.load("paper-designed")
    bands = ls.limit_set(ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))).extents
    assert 0.2055 < topological_entropy(scene.map, bands, scene.domain) < math.log(2)
