import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limitsets.base.errors import SceneError
from limitsets.feeder.scene import NAMES, Deviation, deviation, load

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
    assert scene.value("part.mass.center.along") == 4.2255778
    assert scene.value("part.mass.center.above") == 0.708249
    assert scene.value("part.mass.radius_of_gyration") == 1.25
    assert scene.value("part.sides[1]") == 3.6
    assert scene.value("arm.surface_height") == -0.2
    scene = load(plate)
    assert scene.value("part.vertices[2].y") == 4.0
    assert scene.value("part.vertices[2].x") == 6.0
    assert scene.value("part.mass.points[0].y") == 1.0
    assert scene.value("part.mass.points[0].mass") == 0.0048
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
    assert (
        DESIGNED.with_values({"throw.speed": "150 rad/s"}).value("throw.speed") == 150.0
    )  # as text it is meant
    slower = DESIGNED.with_values({"throw.speed": "150 deg/s"})
    assert slower.value("throw.speed") == pytest.approx(math.radians(150.0), rel=1e-15)
    assert DESIGNED.with_values({"throw.speed": math.radians(150.0)}).kappa == pytest.approx(
        slower.kappa, rel=1e-14
    )


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


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in", "ft"])
def test_numbers_can_be_set_in_every_unit_of_length(unit: str) -> None:
    table = DESIGNED.as_dict()
    table["arm"]["length"] = f"2000 {unit}"
    table["goal"]["oriented_beyond"]["x"] = f"20 {unit}"
    scene = load(table).with_values({"gravity.acceleration": 193.0, "throw.speed": 2.0})
    assert scene.gravity == 193.0
    assert scene.kappa == 48.25
    assert load(scene.as_dict()) == scene


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"throw.sped": 1.0}, "did you mean 'throw.speed'"),
        ({"speed": 1.0}, "the quantity is 'speed'"),
        ({"part.sides[i]": 1.0}, "part.sides[i]"),
        ({"part.sides[01]": 1.0}, "part.sides[i]"),
        ({"part.sides[3]": 1.0}, "does not give it"),
        ({"part.sides[-1]": 1.0}, "the quantity"),
        ({"part.vertices[0].x": 1.0}, "does not give it"),
        ({"part.mass.points[0].mass": 1.0}, "does not give it"),
        ({"landing.x": 1.0}, "noise of landings only"),
        ({"throw.speed": 1.0, "throw.kappa": 1.0}, "leave out one of"),
        ({"throw.speed": math.nan}, "throw.speed"),
        ({"throw.speed": math.inf}, "throw.speed"),
        ({"throw.speed": 1e300}, "size from"),
        ({"arm.surface_height": 1e-301}, "size from"),
        ({"throw.speed": 10**400}, "a number [rad/s]"),
        ({"throw.speed": True}, "a number [rad/s]"),
        ({"throw.speed": None}, "a number [rad/s]"),
        ({"throw.speed": [1.0]}, "a number [rad/s]"),
        ({"throw.speed": "1 in"}, "dimension is wrong"),
        ({"throw.speed": -1.0}, "above 0"),
        ({"throw.speed": 1e-100}, "from 1e-12 rad/s"),
        ({"arm.length": "5 deg"}, "dimension is wrong"),
        ({"arm.length": 1.0}, "lengthen the arm"),
        ({"part.mass.center.above": 9.0}, "outside"),
        ({3: 1.0}, "the quantity is 3"),
    ],
)
def test_refuses_values(values: dict[Any, Any], words: str) -> None:
    with pytest.raises(SceneError) as caught:
        DESIGNED.with_values(values)
    assert words in str(caught.value)
    assert caught.value.file == "paper-designed"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("landing.x", "noise of landings only"),
        ("gravity.tilt", "in other words"),
        ("part.mass.points[0].x", "in other words"),
        ("arm", "did you mean"),
        (None, "the quantity is None"),
    ],
)
def test_refuses_to_give(name: Any, words: str) -> None:
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


@pytest.mark.parametrize(
    ("text", "name", "words"),
    [
        ("0 %", "throw.speed", "above 0"),
        ("-1 %", "throw.speed", "above 0"),
        ("100 %", "throw.speed", "below 100 %"),
        ("1 in", "throw.speed", "dimension is wrong"),
        ("1 %", "landing.x", "% is a unit of share"),
        (0.01, "throw.speed", "as text"),
        ("1 %", "throw", "the quantity"),
    ],
)
def test_refuses_deviations(text: object, name: str, words: str) -> None:
    with pytest.raises(SceneError) as caught:
        deviation(text, name, "in")
    assert words in str(caught.value)
