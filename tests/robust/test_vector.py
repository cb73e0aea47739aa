"""A vector of tolerances: exact and in floats it is the same box, and its worst corner is the worst of all."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import LimitsetsError
from limitsets.parameters.design import robust_design
from limitsets.parameters.margins.deviations import Tolerance, corners, deviation_scale, worst_corner

TEXTS = {
    "throw.speed": "1 %",
    "part.sides[1]": "2 mm",
    "part.mass.center.along": "0.01 in",
    "arm.surface_height": "3 %",
    "landing.x": "0.5 mm",
}
FACTOR = Fraction(7, 4)


@pytest.mark.parametrize("signs", [(1, 1, 1, 1), (-1, 1, -1, 1), (-1, -1, -1, -1)])
def test_a_corner_in_floats_is_that_of_the_proof(signs):
    scene = ls.load("paper-designed")
    tolerance = Tolerance.of(scene, TEXTS)
    exact, floats = tolerance.corner(FACTOR, signs), tolerance.scene_at(scene, float(FACTOR), signs)
    assert exact.spans.keys() == {"throw.kappa", *list(TEXTS)[1:4]}
    for name, span in exact.spans.items():  # all in inches, the scene's unit
        assert floats.value(name) == pytest.approx(float(span.lo), rel=1e-14)
    speed = 1 + Fraction(7, 400) * signs[0]
    assert float(exact.spans["throw.kappa"].lo) == pytest.approx(scene.kappa / float(speed) ** 2, rel=1e-14)
    assert floats.value("part.sides[1]") == pytest.approx(3.6 + signs[1] * 3.5 / 25.4, rel=1e-14)


def test_landings_are_noise_and_nothing_else_is():
    tolerance = Tolerance.of(ls.load("paper-designed"), TEXTS)
    assert tolerance.noise(FACTOR) == {"landing.x": "0.875 mm"}
    assert tolerance.scatter == pytest.approx(0.5 / 25.4, rel=1e-15)
    assert "landing.x" not in tolerance.texts(FACTOR)


def test_a_quantity_alone_is_a_vector_of_one():
    scene = ls.load("paper-designed")
    height = Tolerance.alone(deviation_scale(scene, "arm.surface_height"))
    assert height.texts(Fraction(1, 50)) == {"arm.surface_height": "0.02 in"}
    assert height.corner(Fraction(1, 50), (-1,)).texts() == {"arm.surface_height": ["-0.22 in"] * 2}
    speed = Tolerance.alone(deviation_scale(scene, "throw.speed", "per-throw"))
    assert speed.noise(Fraction(3, 10)) == {"throw.speed": "0.3 %"}
    assert speed.corner(Fraction(3, 10), ()) is None


def test_the_worst_corner_is_the_worst_of_all():
    random = np.random.default_rng(2)
    for _ in range(50):
        fall = random.normal(size=5)
        slack = {signs: -float(np.dot(fall, signs)) for signs in product((-1, 1), repeat=5)}
        assert worst_corner(fall) == min(slack, key=slack.get)


def test_of_a_large_box_some_corners_are_tried_always_the_same():
    assert len(set(corners(9))) == 512
    assert corners(12) == corners(12)
    assert len(corners(12)) == 512


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("gravity.tilt", "1 deg", "the quantity"),
        ("throw.speed", "1 deg/s", "percent"),
        ("part.sides[1]", "0 in", "above 0"),
    ],
)
def test_a_design_refuses_what_a_proof_refuses(name, text, words):
    """Before, the search read 1 deg/s in a scene given by kappa as 1.7 %."""
    with pytest.raises(LimitsetsError, match=words):
        robust_design("paper-designed", tolerance={name: text}, evaluations=1, prove=0.0)
