"""Statistics of noisy throws, and their laws."""

import json
import math

import numpy as np
import pytest
from scipy import integrate, stats

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError, SceneError
from limitsets.feeder.goals import OrientedBeyond
from limitsets.feeder.scattering import (
    Gaussian,
    Given,
    Law,
    Samples,
    Scattering,
    Uniform,
    kappa_strata,
    regrouped,
    scattering_of,
    starts_from,
    transformed,
)
from limitsets.feeder.scene import load
from limitsets.parameters.noise.absorbing import classes
from limitsets.parameters.noise.sampling import scattering_map, throw_many
from limitsets.parameters.noise.statistics import noise_levels, noise_statistics
from limitsets.parameters.noise.ulam import transfer

# ----------------------------------------------------------------
# Statistics of noisy scenes against throws with counted random numbers, and what is said about them.


GOAL = (20.5, 2)


@pytest.fixture(scope="module")
def gaussian():
    noise = Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
    return noise_statistics("paper-designed", noise, goal=GOAL, cells=384)


def solved(scene, noise, cells):
    return noise_statistics(scene, noise, goal=GOAL, cells=cells, sensitivity=False)


def within(found, thrown, names, sigmas=4.0):
    """Each number within its error bars of what was thrown."""
    for name in names:
        error = math.hypot(thrown.errors[name], found.errors[name])
        assert abs(found.numbers[name] - thrown.numbers[name]) < sigmas * error, name


NUMBERS = tuple(f"time on side {side}" for side in range(3))
NUMBERS += ("share of jog", "time beyond", "mean throws", "95 % throws", "fed", "first beyond is wrong")


def test_proved_brackets_stand_beside_the_numbers_and_hold_what_is_thrown():
    """Some parts leave the arm here, so that the mean of those fed is not the mean of all."""
    scene, noise, goal = load("paper-initial"), Scattering(landing=Uniform(0.4)), (20.0, 2)
    found = noise_statistics(
        scene, noise, goal=goal, cells=64, strata=4, sensitivity=False, seconds=0, brackets=100
    )
    many = throw_many(scene, noise, goal, starts_from(scene), throws=500_000, parts=10_000)
    lost = {"lost": (1.0 - many.numbers["fed"], many.errors["fed"])}
    counted = {name: (each, many.errors[name]) for name, each in many.numbers.items()} | lost
    long_run = {*(f"time on side {side}" for side in range(3)), "share of jog", "share of flip"}
    assert set(found.proved) == {"fed", "lost", "95 % throws", "mean throws"} | long_run
    for name, (lo, hi) in found.proved.items():
        number, error = counted[name]
        assert lo - 4.0 * error <= number <= hi + 4.0 * error, name
        assert lo < hi < lo + (8.0 if "throws" in name else 0.05), name
    shown = {row[0]: row[-1] for row in found.table().rows}
    assert shown == dict.fromkeys(found.numbers) | found.proved
    record = json.loads(json.dumps(found.to_json()))["numbers"]
    assert {name: each["proved"] for name, each in record.items() if each["proved"]} == {
        name: list(pair) for name, pair in found.proved.items()
    }


def test_brackets_without_scatter_of_the_landing_have_no_mean():
    how = {"goal": GOAL, "cells": 64, "strata": 4, "sensitivity": False, "seconds": 0, "brackets": 24}
    found = noise_statistics("paper-designed", Scattering(speed=Gaussian(0.01)), **how)
    assert not {"mean throws", "fed", "lost", "time on side 0"} & set(found.proved)
    with pytest.raises(AnswerError, match="bracket is 0; allowed: 1 or more"):
        noise_statistics("paper-designed", Scattering(speed=Gaussian(0.01)), **how | {"brackets": 0})


@pytest.mark.sweep
def test_gaussian_noise_against_throws(gaussian):
    scene = ls.load("paper-designed")
    thrown = throw_many(
        scene, gaussian.scatter, GOAL, starts_from(scene), throws=1_000_000, parts=10_000, seed=4
    )
    assert thrown.errors["time on side 0"] < 2e-4
    assert thrown.errors["mean throws"] < 0.3
    within(gaussian, thrown, NUMBERS)
    # the density in 40 bins per side: 5 000 throws a bin, correlated along an orbit
    for side in range(3):
        ours = density_in_bins(gaussian, side, thrown.bins[side])
        np.testing.assert_allclose(ours, thrown.density[side], rtol=0, atol=0.004)


def density_in_bins(found, side, bins):
    (edges,) = found.grid.edges[side]
    weight = found.classes[0].weight[found.grid.of_side(side)]
    below = np.interp(bins, edges, np.concatenate([[0.0], np.cumsum(weight)]))
    return np.diff(below) / np.diff(bins)


@pytest.mark.sweep
def test_bounded_noise_against_throws_on_a_short_arm():
    """The arm ends just beyond the limit set: throws are lost, and the class is left at a small rate."""
    scene = ls.load("paper-designed").with_values({"arm.length": 23.6})
    noise = Scattering(speed=Uniform(0.01), landing=Uniform(0.05))
    found = solved(scene, noise, 512)
    thrown = throw_many(scene, noise, GOAL, starts_from(scene), throws=400_000, parts=5_000, seed=8)
    within(found, thrown, ("time on side 0", "time beyond", "fed", "mean throws"))
    assert 0.0 < found.numbers["escape"] < 0.01
    assert found.numbers["lost"] == pytest.approx(1.0 - found.numbers["fed"], abs=1e-9)
    assert found.settles["outward"] == pytest.approx(1.0, abs=1e-9)
    assert not any(part.closed for part in found.classes)
    # how many of them are still on the arm, counted by throwing
    left = surviving(scene, noise, 4000, 300)
    assert left == pytest.approx(-math.log1p(-found.numbers["escape"]), rel=0.15)


def surviving(scene, noise, parts, throws):
    """Rate at which parts on the limit set leave, from how many are left after so many throws."""
    x, side = np.full(parts, 15.0), np.full(parts, 2)
    counted = []
    for number in range(throws):
        params = scattering_map(scene, noise, 9)
        x, side, code, _ = ls.maps.advance(params, x, side, 1, first=number * parts)
        x, side = x[code >= 0], side[code >= 0]
        if number == 30:
            counted.append(x.size)
    return math.log(counted[0] / x.size) / (throws - 31)


def test_no_noise_against_the_limit_set_and_a_long_orbit():
    found = solved("paper-designed", Scattering(), 2048)
    path = ls.orbit(ls.load("paper-designed").map, 15.0, 2, 1_000_000)
    for side in range(3):
        assert found.numbers[f"time on side {side}"] == pytest.approx(np.mean(path.side == side), abs=4e-4)
    # flips per throw of this scene, from a long orbit: docs of the four scenes
    assert found.numbers["share of flip"] == pytest.approx(0.3191, abs=4e-4)
    assert found.numbers["wrong beyond"] == 0.0
    assert found.numbers["escape"] == 0.0
    assert found.cut == 0.0
    (part,) = [part for part in found.classes if part.closed]
    assert part.cells.extents()[2][-1][1] == pytest.approx(23.383, abs=0.03)


@pytest.mark.sweep
def test_slopes_are_those_of_secants(gaussian):
    """The slope times the logarithm of two levels, against the difference of the numbers there on other cells."""
    for name in ("speed", "landing"):
        apart = math.log(1.1 / 0.9)
        scaled = [gaussian.scatter.scaled(factor, name) for factor in (1.1, 0.9)]
        high, low = (solved("paper-designed", noise, 512).numbers for noise in scaled)
        for number in ("time on side 0", "mean throws"):
            slope = gaussian.sensitivity[name][number]
            secant = (high[number] - low[number]) / apart
            assert slope.slope == pytest.approx(secant, abs=1.5 * slope.error), (name, number)
    steep = gaussian.sensitivity["speed"]["time on side 0"]
    assert steep.error < 0.3 * abs(steep.slope)  # an error that swallows the slope would agree with all
    # more noise of the speed turns more parts wrongly, very steeply
    assert gaussian.sensitivity["speed"]["wrong beyond"].slope > 5 * gaussian.numbers["wrong beyond"]


@pytest.mark.sweep
def test_levels_begin_without_noise(gaussian):
    levels = noise_levels("paper-designed", gaussian.scatter, factors=(0.0, 1.0), goal=GOAL, cells=512)
    still = solved("paper-designed", Scattering(), 512)
    assert levels.numbers["mean throws"][0] == pytest.approx(still.numbers["mean throws"], rel=1e-9)
    assert levels.numbers["wrong beyond"][0] == 0.0 < levels.numbers["wrong beyond"][1]


@pytest.mark.sweep
def test_json(gaussian):
    text = json.dumps(gaussian.to_json(), allow_nan=False)
    back = json.loads(text)
    assert back["how"] == "sampled"
    assert back["noise_cut_off"] == pytest.approx(2 * math.erfc(6 / math.sqrt(2)), rel=1e-6)
    assert back["goal"] == {"x": 20.5, "side": 2}
    assert set(back["numbers"]) == set(gaussian.numbers)
    assert back["sensitivity"]["speed"]["mean throws"]["slope"] is not None


@pytest.mark.sweep
def test_scene_with_scatter_and_a_goal_needs_no_more():
    tree = ls.load("paper-designed").as_dict()
    tree["world"] = {"scatter": {"speed": "0.5 %", "landing": "0.02 in"}}
    tree["effects"] = {"spread": "gaussian"}
    scene = ls.load(tree)
    found = noise_statistics(scene, goal=OrientedBeyond(*GOAL), cells=256, sensitivity=False)
    assert found.scatter == Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02))
    assert found.goal == GOAL
    assert solved("paper-designed", found.scatter, 256).numbers == found.numbers


def test_maps_without_forced_branches_go_by_points():
    """The same throw as a map with (no) effects: points of cells instead of pieces."""
    from limitsets.feeder.thrower.full import with_effects

    scene = ls.load("paper-designed")
    cover = ls.grid(scene.domain, cells=400, grading="uniform")
    by_pieces = classes(transfer(scene.map, cover, landing=Gaussian(0.05)))[0]
    by_points = classes(transfer(with_effects(scene.bare_map, {}, None), cover, landing=Gaussian(0.05)))[0]
    assert np.abs(by_pieces.weight - by_points.weight).sum() < 2e-3
    assert by_points.branches["flip"] == pytest.approx(by_pieces.branches["flip"], abs=2e-4)


def test_tilt_is_speed_by_another_name():
    """kappa goes with sin(tilt) and 1 / speed^2: small deviations of the one are those of the other."""
    scene = ls.load("paper-designed").with_values({"gravity.tilt": "30 deg"})
    sigma = 0.002
    by_speed = solved(scene, Scattering(speed=Gaussian(sigma)), 256)
    tilt = 2.0 * sigma * math.tan(math.pi / 6)  # d ln sin(t) = dt / tan(t)
    by_tilt = solved(scene, Scattering(tilt=Gaussian(tilt)), 256)
    for name in ("time on side 2", "mean throws", "time beyond"):
        assert by_tilt.numbers[name] == pytest.approx(by_speed.numbers[name], rel=1e-3)


def test_refusals():
    scene = ls.load("paper-designed")
    with pytest.raises(SceneError, match="spread"):
        noise_statistics(scene, goal=GOAL)
    for goal in ((40.0, 2), (20.0, 3), "far"):
        with pytest.raises(AnswerError, match="goal of the noise"):
            noise_statistics(scene, Scattering(speed=Gaussian(0.01)), goal=goal)
    with pytest.raises(AnswerError, match="noise to throw with"):
        scattering_map(scene, Scattering(speed=Samples([0.0, 0.01])))
    with pytest.raises(AnswerError, match="noise to throw with"):
        scattering_map(scene, Scattering(speed=Gaussian(0.01), landing=Uniform(0.01)))


# ----------------------------------------------------------------
# Laws cut into strata: probability, mean and variance are those of the law.


def moments(strata):
    mean = strata.weight @ strata.mean
    return strata.weight.sum(), mean, strata.weight @ (strata.sd**2 + (strata.mean - mean) ** 2)


LAWS = [
    (Gaussian(0.3), 0.0, 0.09),
    (Uniform(0.3), 0.0, 0.03),
    (Given(stats.gamma(3.0, scale=0.1)), 0.3, 0.03),  # mean 3 s, variance 3 s^2
    (Given(stats.triang(0.5, -1, 2), factor=0.5), 0.0, 1.0 / 24.0),  # on [-1, 1]: variance 1/6, with a kink
    (Samples([1.0, 2.0, 4.0], [1, 1, 2]), 2.75, 1.6875),
    (Samples(np.arange(1000.0)), 499.5, (1000.0**2 - 1) / 12),
]


@pytest.mark.parametrize(("law", "mean", "variance"), LAWS, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("count", [1, 7, 32])
def test_moments(law, mean, variance, count):
    strata = law.strata(count)
    assert isinstance(law, Law)
    assert strata.weight.size <= count
    got = moments(strata)
    assert got[0] == pytest.approx(1.0, abs=1e-12)
    # A Gaussian loses 2 * 36 * phi(6)/6 of its variance at the cuts: 7e-8.
    assert got[1] == pytest.approx(mean, abs=1e-7 * max(1.0, abs(mean)))
    assert got[2] == pytest.approx(variance, rel=1e-5)
    doubled = moments(law.scaled(2.0).strata(count))
    assert doubled[2] == pytest.approx(4.0 * variance, rel=1e-5)


def test_what_is_cut_off_is_said():
    assert Gaussian(0.1).strata(8).cut == pytest.approx(math.erfc(6 / math.sqrt(2)), rel=1e-6)
    assert Uniform(0.1).strata(8).cut == 0.0
    assert Given(stats.cauchy(scale=0.001)).strata(8).cut == pytest.approx(2e-9, rel=1e-3)


def test_no_deviation_is_one_stratum():
    for law in (Gaussian(0.0), Uniform(0.0), Given(stats.norm(), 0.0)):
        assert law.strata(9).weight.tolist() == [1.0]
        assert law.strata(9).sd.tolist() == [0.0]


def test_tails_are_looked_at():
    """Half of the cuts follow the length: the outermost of 16 strata of a Gaussian lies beyond 4 sigma."""
    strata = Gaussian(1.0).strata(16)
    assert strata.mean[-1] > 4.0
    assert strata.weight[-1] < 1e-4


def test_strata_of_a_function_have_its_moments():
    strata = transformed(Gaussian(0.1).strata(16), np.exp)
    got = moments(strata)
    # log-normal with sigma = 0.1
    assert got[1] == pytest.approx(math.exp(0.005), rel=1e-6)
    assert got[2] == pytest.approx((math.exp(0.01) - 1.0) * math.exp(0.01), rel=1e-3)


def test_joined_strata_keep_their_moments():
    fine = Gaussian(1.0).strata(200)
    coarse = regrouped(fine, 12)
    assert coarse.weight.size <= 12
    np.testing.assert_allclose(moments(coarse), moments(fine), rtol=0, atol=1e-12)


def test_kappa_of_speed_and_tilt():
    scene = load("paper-designed").with_values({"gravity.tilt": "30 deg"})
    noise = Scattering(speed=Uniform(0.02), tilt=Gaussian(0.01))
    strata = kappa_strata(noise, scene, 16)
    inverse = integrate.quad(lambda d: (1 + d) ** -2 / 0.04, -0.02, 0.02)[0]
    law = stats.norm(scale=0.01)
    tilted = integrate.quad(lambda t: math.sin(math.pi / 6 + t) * law.pdf(t), -0.06, 0.06)[0]
    assert strata.weight @ strata.mean == pytest.approx(inverse * tilted / 0.5, rel=1e-6)
    assert strata.lo == pytest.approx(1.02**-2 * math.sin(math.pi / 6 - 0.06) / 0.5, rel=1e-9)


def test_scattering_of_a_scene():
    tree = load("paper-designed").as_dict()
    tree["world"] = {"scatter": {"speed": "0.5 %", "landing": "0.02 in"}}
    tree["effects"] = {"spread": "bounded"}
    found = scattering_of(load(tree))
    assert found == Scattering(speed=Uniform(0.005), landing=Uniform(0.02))
    assert found.scaled(2.0, "speed") == Scattering(speed=Uniform(0.01), landing=Uniform(0.02))
    tree["effects"] = {"spread": "gaussian"}
    assert scattering_of(load(tree)).landing == Gaussian(0.02)


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Gaussian(-1.0), "standard deviation"),
        (lambda: Uniform(math.nan), "bound"),
        (lambda: Samples([1.0], [-1.0]), "samples"),
        (lambda: Samples([]), "samples"),
        (lambda: Given(stats.poisson(3)), "law"),
    ],
)
def test_laws_that_cannot_be(make, word):
    with pytest.raises(MapError, match=word):
        make()


def test_noise_that_a_scene_cannot_have():
    scene = load("paper-designed")
    with pytest.raises(SceneError, match="spread"):
        scattering_of(scene)
    with pytest.raises(SceneError, match="law"):
        Scattering(speed=0.01)
    with pytest.raises(SceneError, match="backwards"):
        kappa_strata(Scattering(speed=Uniform(1.5)), scene, 8)
    with pytest.raises(SceneError, match="tilt"):
        kappa_strata(Scattering(tilt=Gaussian(0.01)), scene, 8)
