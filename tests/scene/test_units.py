"""Quantities and their units."""

import math
import re
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pint
import pytest
from hypothesis import given, strategies as st

from limitsets.base.errors import SceneError
from limitsets.feeder.scene import NAMES, Deviation, deviation, load
from limitsets.feeder.scene.quantities import base_unit
from limitsets.feeder.scene.units import UNITS, convert, exact_factor, parse, spelled_plainly, written


def test_factors_are_those_of_pints_own_registry() -> None:
    full = pint.UnitRegistry(non_int_type=Fraction)
    for dimension, units in UNITS.items():
        for unit in units if dimension != "share" else ():
            for target in (*units, *(base_unit(dimension, length) for length in UNITS["length"])):
                factor = full.Quantity(Fraction(1), unit).to(target).magnitude
                assert convert(parse(f"1 {unit}", dimension), target) == float(factor)


def test_what_measures_different_things_has_no_factor() -> None:
    for unit, target in (("in", "kg"), ("kg/m^2", "kg/m^3"), ("rpm", "rad"), ("Hz", "rad/s")):
        with pytest.raises(ValueError, match="measure different things"):
            exact_factor(unit, target)


@pytest.mark.parametrize(
    ("text", "dimension", "unit", "value"),
    [
        ("5.75 in", "length", "in", 5.75),
        ("0.1 in", "length", "in", 0.1),
        ("2.54 cm", "length", "in", 1.0),
        ("-.5e1 in", "length", "in", -5.0),
        ("+7. in", "length", "in", 7.0),
        ("0 m", "length", "in", 0.0),
        ("1   in", "length", "mm", 25.4),
        ("1 %", "share", "", 0.01),
        ("0.7%", "share", "", 0.007),
        ("600 um", "length", "mm", 0.6),
        ("600 \u00b5m", "length", "mm", 0.6),  # micro sign
        ("600 \u03bcm", "length", "mm", 0.6),  # Greek mu
        ("45 \u00b0", "angle", "deg", 45.0),
        ("45\u00b0", "angle", "deg", 45.0),
    ],
)
def test_values(text: str, dimension: str, unit: str, value: float) -> None:
    assert convert(parse(text, dimension), unit) == value


@given(st.floats(1e-12, 1e12), st.sampled_from(UNITS["length"]), st.sampled_from(UNITS["length"]))
def test_conversions_are_rounded_once(number: float, unit: str, target: str) -> None:
    metres = {"m": "1", "cm": "0.01", "mm": "0.001", "um": "1e-6", "in": "0.0254", "ft": "0.3048"}
    exact = Fraction(Decimal(repr(number))) * Fraction(metres[unit]) / Fraction(metres[target])
    assert convert(parse(written(number, unit), "length"), target) == float(exact)


def test_refuses() -> None:
    for text, words in (
        ("5,75 in", "decimal point"),
        ("9**9**9 in", "one finite decimal number"),
        ("1/s", "one finite decimal number"),
        ("1 1/s", "1/s is a unit of frequency: the dimension is wrong"),
        ("nan in", "finite"),
        ("1e400 in", "size from"),
        ("1e-400 in", "size from"),
        ("1e9999 in", "one finite"),
        ("-1e13 in", "choose another unit"),
        ("5.75", "add the unit"),
        ("5.75in", "a space between"),
        ("in", "one finite decimal number"),
        ("", "one finite decimal number"),
        ("5.75 inch", "did you mean 'in'"),
        ("5.75 parsec", "not known"),
        ("5.75 deg", "deg is a unit of angle: the dimension is wrong"),
        ("5.75 in\n", "one finite"),
        ("5.75\u00a0in", "one finite"),
        ("\u0665 in", "one finite"),
        ("0x10 in", "one finite"),
        ("5.75 in in", "not known"),
        ("1" * 100 + " in", "shorten"),
        (5.75, "write it as text"),
        (True, "write it as text"),
        (None, "write it as text"),
        (["5.75 in"], "write it as text"),
    ):
        with pytest.raises(SceneError) as caught:
            parse(text, "length", key="arm.length", file="arm.toml")
        error = caught.value
        assert (error.key, error.file) == ("arm.length", "arm.toml")
        assert words in str(error)
        assert "m, cm, mm, in, ft" in error.allowed


def test_what_is_proposed_is_the_same_value() -> None:
    for text, dimension, words in (
        ("2 rps", "angular speed", 'write "720 deg/s"'),
        ("120 /min", "frequency", 'write "2 Hz"'),
        ("2/s", "frequency", "did you mean 'Hz'?"),
        ("25 rev/min", "angular speed", "did you mean 'rpm'?"),
        ("158 \u00b0/s", "angular speed", "did you mean 'deg/s'?"),
        ("6 rad/min", "angular speed", 'write "0.1 rad/s"'),
        ("25 Hz", "angular speed", 'Hz is a unit of frequency: if it counts turns, write "1500 rpm"'),
        ("120 /min", "angular speed", 'if it counts turns, write "120 rpm"'),
        ("90 rpm", "frequency", 'rpm is a unit of angular speed: if each turn throws once, write "1.5 Hz"'),
        ("6.283185307179586 rad/s", "frequency", 'if each turn throws once, write "1 Hz"'),
        ("90 rev/min", "frequency", 'if each turn throws once, write "1.5 Hz"'),
        ("90 throws/min", "frequency", 'write "1.5 Hz"'),
        ("0.5 s", "frequency", 's is a unit of time: if it is that from throw to throw, write "2 Hz"'),
        ("250 ms", "frequency", 'write "4 Hz"'),
        ("0 s", "frequency", "convert the value"),
        ("0.5 turn", "angle", 'write "180 deg"'),
        ("0.5 g", "acceleration", 'g is a unit of mass: if it is that of free fall, write "4.903325 m/s^2"'),
        ("0.5 kg", "acceleration", "kg is a unit of mass: the dimension is wrong"),
        ("25 kHz", "angular speed", "convert the value"),  # of what, is not said
        ("45 \u00ba", "angle", "did you mean 'deg'?"),  # the sign of an ordinal
        ("3 km", "length", 'write "3000 m"'),
        ("3 nm", "length", "convert the value"),
        ("3e999 km", "length", "size from"),  # no float to propose
        ("3 MM", "length", "did you mean 'mm'?"),
        ("25 rpm", "length", "rpm is a unit of angular speed: the dimension is wrong"),
        ("2 Mg", "mass", "did you mean 't'?"),
        ("2 oz", "mass", 'write "56.69904625 g"'),
        ("2 \u00b5g", "mass", 'write "2e-06 g"'),
        ("0.2 N", "mass", "N is a unit of force, and a mass is wanted: give kg"),
        ("0.2 N", "length", "N is a unit of force: the dimension is wrong"),
        ("300 g/m^2", "mass per area", 'write "0.3 kg/m^2"'),
        ("300 g/m\u00b2", "mass per area", 'write "0.3 kg/m^2"'),
        ("7850 kg/m\u00b3", "mass per volume", "did you mean 'kg/m^3'?"),
        ("7.85 t/m^3", "mass per volume", 'write "7850 kg/m^3"'),
        ("7.85 kg/dm^3", "mass per volume", "did you mean 'g/cm^3'?"),
        ("9.8 m/s2", "acceleration", "did you mean 'm/s^2'?"),
        ("600\u00b5m", "length", 'put a space between number and unit: "600 \u00b5m"'),
    ):
        with pytest.raises(SceneError) as caught:
            parse(text, dimension)
        assert words in caught.value.remedy


@pytest.mark.parametrize("text", ["5", "banana", "5,75 mm", 5.75])
@pytest.mark.parametrize(("dimension", "per"), [("length", ""), ("acceleration", "/s^2")])
def test_examples_are_in_millimetres_and_in_inches(text: object, dimension: str, per: str) -> None:
    """A scene has one or the other, and an example in the other alone looks like a demand."""
    with pytest.raises(SceneError) as caught:
        parse(text, dimension)
    examples = re.findall(r'"[0-9.]+ ([^"]+)"', caught.value.remedy)
    assert examples == [f"mm{per}", f"in{per}"]
    texts = re.findall(r'"([^"]+)"', caught.value.remedy)
    values = [convert(parse(each, dimension), f"mm{per}") for each in texts]
    assert values[0] == pytest.approx(values[1], rel=0.01)


def test_spellings_for_certificates() -> None:
    of = [["45\u00b0", "1 \u03bcm"], 3, True, None]
    kept = {"name": "\u00b5m", "said": "5  parsec"}
    tree = {"x": " 600   \u00b5m ", "of": of, "w": "25  rpm", "share": "1%", **kept}
    wanted = tree | {"x": "600 um", "of": [["45 deg", "1 um"], *of[1:]], "w": "25 rpm", "share": "1 %"}
    assert spelled_plainly(tree) == wanted


@given(st.text(max_size=80))
def test_any_text_is_read_or_refused(text: str) -> None:
    for dimension in UNITS:
        try:
            quantity = parse(text, dimension)
        except SceneError:
            continue
        assert quantity.unit in UNITS[dimension]


DESIGNED = load("paper-designed")


def test_names_are_those_of_the_interface() -> None:
    listed = (
        "throw.speed throw.kappa part.mass.center.along part.mass.center.above part.mass.radius_of_gyration "
        "part.mass.points[i].x part.mass.points[i].y part.mass.points[i].mass part.sides[i] part.vertices[i].x "
        "part.vertices[i].y arm.surface_height arm.length gravity.acceleration gravity.tilt landing.x"
    )
    assert set(NAMES) == set(listed.split())


def test_values_in_the_scenes_units(whole: dict[str, Any], plate: dict[str, Any]) -> None:
    scene = load(whole)
    assert scene.value("throw.speed") == math.radians(158.02)
    assert scene.value("throw.kappa") == scene.kappa
    assert scene.value("gravity.tilt") == pytest.approx(math.pi / 6, rel=3e-16)
    assert scene.value("gravity.acceleration") == pytest.approx(193.04429133858268, rel=1e-15)
    of_mass = {"center.along": 4.2255778, "center.above": 0.708249, "radius_of_gyration": 1.25}
    for name, value in of_mass.items():
        assert scene.value(f"part.mass.{name}") == value
    assert scene.value("part.sides[1]") == 3.6
    assert scene.value("arm.surface_height") == -0.2
    scene = load(plate)
    of_part = {"vertices[2].y": 4.0, "vertices[2].x": 6.0, "mass.points[0].y": 1.0}
    of_part["mass.points[0].mass"] = 0.0048
    for name, value in of_part.items():
        assert scene.value(f"part.{name}") == value
    assert scene.value("part.mass.radius_of_gyration") == scene.radius_of_gyration


SETTABLE = {
    "throw.speed": (1.0, 4.0),
    "throw.kappa": (10.0, 90.0),
    "part.mass.center.along": (3.2, 4.4),
    "part.mass.center.above": (0.5, 1.5),
    "part.mass.radius_of_gyration": (0.1, 3.0),
    "part.sides[1]": (3.4, 3.7),
    "arm.surface_height": (-2.0, 2.0),
    "arm.length": (21.0, 60.0),
    "gravity.acceleration": (1.0, 400.0),
    "gravity.tilt": (0.01, 1.57),
}


@pytest.mark.filterwarnings("ignore:.gravity. changes no throw")  # of a scene that is given by kappa
@given(st.data(), st.sampled_from(sorted(SETTABLE)))
def test_what_is_set_is_what_is_read(data: st.DataObject, name: str) -> None:
    # 0, or a size that a scene may hold: below 1e-300 it says so
    value = data.draw(st.floats(*SETTABLE[name]).filter(lambda v: v == 0.0 or abs(v) >= 1e-300))
    scene = DESIGNED.with_values({name: value})
    assert scene.value(name) == value
    assert load(scene.as_dict()).value(name) == value
    assert load("paper-designed") == DESIGNED


def test_a_bare_speed_meant_in_degrees_is_refused_and_names_its_unit() -> None:
    with pytest.raises(SceneError, match=r"150 rad/s.*read in rad/s: write \"150 deg/s\"") as error:
        DESIGNED.with_values({"throw.speed": 150})
    assert error.value.key == "throw.speed"
    as_text = DESIGNED.with_values({"throw.speed": "150 rad/s"})  # is meant
    assert as_text.value("throw.speed") == 150.0
    slower = DESIGNED.with_values({"throw.speed": "150 deg/s"})
    assert slower.value("throw.speed") == pytest.approx(math.radians(150.0), rel=1e-15)
    bare = DESIGNED.with_values({"throw.speed": math.radians(150.0)})
    assert bare.kappa == pytest.approx(slower.kappa, rel=1e-14)


def test_everything_that_follows_is_computed_anew() -> None:
    moved = DESIGNED.with_values({"part.mass.center.along": 4.0, "arm.length": np.float32(30.0)})
    assert moved.sides.a[2] == 4.0
    assert moved.sides.a[0] != DESIGNED.sides.a[0]
    assert moved.map.a[2] == 4.0
    assert moved.map.arm_length == 30.0
    assert np.ravel(moved.domain.hi).tolist() == [30.0] * 3


def test_speed_and_kappa_replace_each_other() -> None:
    faster = DESIGNED.with_values({"throw.speed": 2.7})
    assert faster.kappa == pytest.approx(193.045 / 2.7**2, rel=1e-15)
    assert faster.as_dict()["throw"] == {"speed": "2.7 rad/s"}
    assert faster.with_values({"throw.kappa": "25.3778518 in"}) == DESIGNED


def test_tilt_and_acceleration_replace_each_other() -> None:
    with pytest.warns(UserWarning, match="changes no throw beside throw.kappa"):
        tilted = DESIGNED.with_values({"gravity.tilt": "90 deg"})
    assert tilted.gravity == 9.80665 / 0.0254
    assert tilted.as_dict()["gravity"] == {"tilt": "90 deg"}
    assert tilted.kappa == DESIGNED.kappa  # the scene is given by kappa


def test_another_gravity_is_told_of_only_where_it_is_without_effect() -> None:
    # the same, in other words
    assert DESIGNED.with_values({"gravity.tilt": "30 deg"}).kappa == DESIGNED.kappa
    assert DESIGNED.with_values({"gravity.tilt": "90 deg", "throw.kappa": "25 in"}).kappa == 25.0
    by_speed = DESIGNED.with_values({"throw.speed": "158 deg/s"})
    assert by_speed.with_values({"gravity.tilt": "90 deg"}).kappa > 1.9 * by_speed.kappa
    without = DESIGNED.as_dict()
    del without["gravity"]
    assert load(without).with_values({"gravity.tilt": "30 deg"}).kappa == DESIGNED.kappa


def test_text_keeps_its_unit_and_the_scene_its_own() -> None:
    scene = DESIGNED.with_values({"part.sides[0]": "14.605 cm", "arm.length": "0.7112 m"})
    assert (scene.unit, scene.arm_length, scene.sides.length[0]) == ("in", 28.0, 5.75)
    assert scene.as_dict()["part"]["sides"][0] == "14.605 cm"
    assert DESIGNED.with_values({"arm.length": "28 in"}) == DESIGNED


def test_numbers_can_be_set_in_every_unit_of_length() -> None:
    for unit in ("m", "cm", "mm", "in", "ft"):
        table = DESIGNED.as_dict()
        table["arm"]["length"] = f"2000 {unit}"
        table["goal"]["oriented_beyond"]["x"] = f"20 {unit}"
        scene = load(table).with_values({"gravity.acceleration": 193.0, "throw.speed": 2.0})
        assert (scene.gravity, scene.kappa) == (193.0, 48.25)
        assert load(scene.as_dict()) == scene


def test_refuses_values() -> None:
    for values, words in (
        ({"throw.sped": 1.0}, "did you mean 'throw.speed'"),
        ({"part.sides[i]": 1.0}, "part.sides[i]"),
        ({"part.sides[01]": 1.0}, "part.sides[i]"),
        ({"part.sides[3]": 1.0}, "does not give it"),
        ({"part.vertices[0].x": 1.0}, "does not give it"),
        ({"part.mass.points[0].mass": 1.0}, "does not give it"),
        ({"landing.x": 1.0}, "noise of landings only"),
        ({"throw.speed": 1.0, "throw.kappa": 1.0}, "leave out one of"),
        ({"throw.speed": math.nan}, "throw.speed"),
        ({"throw.speed": 1e300}, "size from"),
        ({"arm.surface_height": 1e-301}, "size from"),
        ({"throw.speed": 10**400}, "a number [rad/s]"),
        ({"throw.speed": True}, "a number [rad/s]"),
        ({"throw.speed": None}, "a number [rad/s]"),
        ({"throw.speed": "1 in"}, "dimension is wrong"),
        ({"throw.speed": -1.0}, "above 0"),
        ({"throw.speed": 1e-100}, "from 1e-12 rad/s"),
        ({"arm.length": "5 deg"}, "dimension is wrong"),
        ({"arm.length": 1.0}, "lengthen the arm"),
        ({"part.mass.center.above": 9.0}, "outside"),
        ({3: 1.0}, "the quantity is 3"),
    ):
        with pytest.raises(SceneError) as caught:
            DESIGNED.with_values(values)
        assert words in str(caught.value)
        assert caught.value.file == "paper-designed"


def test_refuses_to_give() -> None:
    for name, words in (
        ("landing.x", "noise of landings only"),
        ("gravity.tilt", "in other words"),
        ("part.mass.points[0].x", "in other words"),
        ("arm", "did you mean"),
        (None, "the quantity is None"),
    ):
        with pytest.raises(SceneError, match="the quantity") as caught:
            DESIGNED.value(name)
        assert words in str(caught.value)


def test_speed_needs_gravity() -> None:
    table = DESIGNED.as_dict()
    del table["gravity"]
    scene = load(table)
    with pytest.raises(SceneError, match=r"add \[gravity\]"):
        scene.value("throw.speed")
    with pytest.raises(SceneError, match=r"add \[gravity\]"):
        scene.with_values({"throw.speed": 2.0})
    with_both = scene.with_values({"throw.speed": 2.0, "gravity.acceleration": 193.0})
    assert with_both.kappa == 48.25


@pytest.mark.parametrize(
    ("text", "name", "expected"),
    [
        ("1 %", "throw.speed", Deviation(0.01, relative=True)),
        ("0.4%", "throw.speed", Deviation(0.004, relative=True)),
        ("180 deg/s", "throw.speed", Deviation(math.pi, relative=False)),
        ("2.54 mm", "landing.x", Deviation(0.1, relative=False)),
    ],
)
def test_deviations(text: str, name: str, expected: Deviation) -> None:
    assert deviation(text, name, "in") == expected


def test_refuses_deviations() -> None:
    for text, name, words in (
        ("0 %", "throw.speed", "above 0"),
        ("-1 %", "throw.speed", "above 0"),
        ("100 %", "throw.speed", "below 100 %"),
        ("1 in", "throw.speed", "dimension is wrong"),
        ("1 %", "landing.x", "% is a unit of share"),
        (0.01, "throw.speed", "as text"),
        ("1 %", "throw", "the quantity"),
    ):
        with pytest.raises(SceneError) as caught:
            deviation(text, name, "in")
        assert words in str(caught.value)
