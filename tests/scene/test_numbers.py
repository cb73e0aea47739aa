"""A scene is read once: floats, spans, numbers with derivatives and a kind of the test's own say the same numbers."""

import copy
from fractions import Fraction

import pytest
from mpmath import mp, mpf

import limitsets as ls
from limitsets.feeder.scene.numbers import Numbers
from limitsets.feeder.scene.quantities import base_unit, find, text_at
from limitsets.feeder.scene.units import exact_factor, parse, share_of_pi
from limitsets.parameters.design.derivatives import sides_of
from limitsets.proofs.prover.parameters import parameter_box

POINTS = [{"x": "1.5 in", "y": "1 in", "mass": "50 g"}, {"x": "2 in", "y": "1.5 in", "mass": "0.1 lb"}]
PLATE = {
    "vertices": [["0 in", "0 in"], ["10 cm", "0 in"], ["0.3 ft", "3 in"], ["0 in", "2.5 in"]],
    "mass": {"plate_density": "7850 kg/m^3", "plate_thickness": "0.4 mm", "points": POINTS},
}
TRIANGLE = {"sides": ["5.75 in", "3.6 in", "6.75 in"], "mass": {"plate_density": "1 g/cm^2"}}
SCENES = {
    "sides, kappa": {},
    "sides, speed, tilt": {"throw": {"speed": "158.02 deg/s"}, "gravity": {"tilt": "30 deg"}},
    "plate, rpm": {"part": PLATE, "throw": {"speed": "26.3 rpm"}, "gravity": {"acceleration": "4.9 m/s^2"}},
    "plate of a triangle": {"part": TRIANGLE},
}


def scene(name):
    return ls.load(copy.deepcopy(ls.load("paper-designed").as_dict() | SCENES[name]))


class Digits(Numbers):
    """Fifty digits: all that another kind of number takes."""

    def __init__(self, tree, unit):
        super().__init__(tree, mp.sqrt, mp.sin)
        self.unit = unit

    def number(self, name):
        return self.constant(text_at(self.tree, name), find(name).dimension, name)

    def constant(self, text, dimension, key):
        given = parse(text, dimension)
        share = share_of_pi(given.unit)
        factor = exact_factor(given.unit, base_unit(dimension, self.unit)) if share is None else share
        exact = Fraction(given.number) * factor
        return mpf(exact.numerator) / exact.denominator * (1 if share is None else mp.pi)


@pytest.fixture(autouse=True)
def digits():
    with mp.workdps(50):
        yield


@pytest.mark.parametrize("name", SCENES)
def test_every_kind_of_number_says_the_same(name):
    given = scene(name)
    exact = Digits(given.text, given.unit)
    columns = list(zip(*exact.sides(mp.atan2), strict=True))
    scalars = {"kappa": exact.kappa, "surface_height": exact.number("arm.surface_height")}
    scalars["arm_length"] = exact.number("arm.length")
    radius = exact.shape.radius_of_gyration
    sides = dict(zip(("a", "d", "length"), columns, strict=False))
    floats, box, duals = given.bare_map, parameter_box(given), sides_of(given, [])
    assert given.radius_of_gyration == pytest.approx(float(radius), rel=1e-14)
    assert given.sides.corner == pytest.approx([float(x) for x in columns[4]], rel=1e-14)
    for word, value in scalars.items():
        assert getattr(floats, word) == pytest.approx(float(value), rel=1e-14)
        assert getattr(box.lo, word) < value < getattr(box.hi, word)
    for word, values in sides.items():
        assert getattr(given.sides, word) == pytest.approx([float(x) for x in values], rel=1e-13)
        lo, hi = (getattr(end, word).tolist() for end in (box.lo, box.hi))
        assert all(a < x < b for a, x, b in zip(lo, values, hi, strict=True))
        assert [getattr(side, word).value for side in duals] == pytest.approx(
            getattr(given.sides, word), rel=1e-13
        )
    assert duals[0].kappa.value == pytest.approx(float(scalars["kappa"]), rel=1e-14)
    assert duals[0].rho.value == pytest.approx(float(radius), rel=1e-14)


@pytest.mark.parametrize("name", SCENES)
def test_boxes_hold_the_numbers_and_little_more(name):
    """A few units in the last place: the scene's decimals are known exactly, and so is all that follows from them."""
    box = parameter_box(scene(name))
    for lo, hi in zip(box.lo.a, box.hi.a, strict=True):
        assert 0.0 < hi - lo <= 4 * 2.0**-52 * hi
    assert box.hi.kappa - box.lo.kappa <= 4 * 2.0**-52 * box.hi.kappa


def test_kappa_is_gravity_over_the_squared_speed():
    tilted = mpf("9.80665") * mp.sin(mp.pi / 6) / (mpf("158.02") * mp.pi / 180) ** 2
    upright = mpf("4.9") / (mpf("26.3") * mp.pi / 30) ** 2
    for name, metres in (("sides, speed, tilt", tilted), ("plate, rpm", upright)):
        box = parameter_box(scene(name))
        assert box.lo.kappa < metres / mpf("0.0254") < box.hi.kappa
