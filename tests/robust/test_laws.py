"""Laws cut into strata: probability, mean and variance are those of the law."""

import math

import numpy as np
import pytest
from scipy import integrate, stats

from limitsets.base.errors import MapError, SceneError
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
    transformed,
)
from limitsets.feeder.scene import load


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
    tilted = integrate.quad(lambda t: math.sin(math.pi / 6 + t) * stats.norm.pdf(t, scale=0.01), -0.06, 0.06)[
        0
    ]
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
