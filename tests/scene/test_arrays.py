"""The numbers of many scenes at once against those of each scene alone."""

import contextlib

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import SceneError
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.arrays import throw_stack
from tests.plates import bracket
from tests.scene.four_gon import FOUR_GON

FIELDS = ("kappa", "surface_height", "arm_length", "radius_of_gyration", "a", "d", "length", "corner")

# What varies, and between which values: far enough that many points cannot be.
PAPER = {
    "throw.speed": (-0.3, 4.0),
    "part.sides[1]": (0.5, 13.0),
    "part.mass.center.along": (-0.5, 7.0),
    "part.mass.center.above": (-0.1, 2.5),
    "part.mass.radius_of_gyration": (-0.1, 3.0),
    "arm.surface_height": (-3.0, 1.0),
    "arm.length": (3.0, 40.0),
    "gravity.tilt": (-0.1, 1.7),
}
PLATE = {
    "throw.kappa": (-5.0, 300.0),
    "part.vertices[0].x": (-30.0, 60.0),
    "part.vertices[2].y": (-80.0, 10.0),
    "part.mass.points[1].x": (-15.0, 12.0),
    "part.mass.points[0].mass": (-1e-4, 2e-2),
    "arm.length": (20.0, 500.0),
}
THICK_MASS = {
    "plate_density": "7850 kg/m^3",
    "plate_thickness": "2 mm",
    "points": [{"x": "21 mm", "y": "9 mm", "mass": "11 g"}],
}
THICK = FOUR_GON | {
    "throw": {"speed": "170 deg/s"},
    "gravity": {"tilt": "25 deg"},
    "part": {"sides": ["59 mm", "41 mm", "67 mm"], "mass": THICK_MASS},
}
BY_SIDES = {
    "throw.speed": (1.0, 5.0),
    "part.sides[0]": (20.0, 110.0),
    "part.sides[2]": (20.0, 110.0),
    "part.mass.points[0].y": (-3.0, 40.0),
}
SHAPED = {
    "throw.speed": (1.0, 5.0),
    "part.vertices[2].y": (-3.0, 60.0),  # through the base, through a hole
    "part.vertices[7].x": (-5.0, 75.0),  # beyond the hull, and the edge above through a hole
    "part.vertices[6].y": (10.0, 90.0),
    "part.mass.points[0].x": (-20.0, 90.0),
}
SCENES = {
    "whole": (None, PAPER),
    "designed": ("paper-designed", PAPER),
    "small angle": ("paper-initial-small-angle", PAPER),
    "plate": (FOUR_GON, PLATE),
    "thick plate": (THICK, BY_SIDES),
    "bracket": (bracket(), SHAPED),
}


def scene_of(given, whole):
    if isinstance(given, str):
        return ls.load(given)
    return Scene.of(whole if given is None else given, None)


def compared(scene, values):
    """Count the possible points; each must be the scene's own numbers, each other one refused."""
    found = throw_stack(scene, values)
    count = found.possible.size
    for k in range(count):
        one = {name: float(each[k]) for name, each in values.items()}
        alone = None
        with contextlib.suppress(SceneError):
            alone = scene.with_values(one)
        assert found.possible[k] == (alone is not None), one
        bare, domain = (alone or scene).bare_map, None if alone is None else alone.domain
        for name in FIELDS:
            assert np.array_equal(getattr(found.params, name)[k], getattr(bare, name)), (name, one)
        if domain is not None:
            assert np.array_equal(found.lo[k], domain.lo[:, 0])
            assert np.array_equal(found.hi[k], domain.hi[:, 0])
            assert np.array_equal(found.anchor[k], domain.anchor)
    return int(found.possible.sum())


@pytest.mark.parametrize("name", SCENES)
def test_each_point_is_the_scene_with_these_values(name, whole):
    given, ranges = SCENES[name]
    whole["gravity"], whole["goal"]["oriented_beyond"]["x"] = {"tilt": "30 deg"}, "6 in"
    scene, rng = scene_of(given, whole), np.random.default_rng(12)
    possible = 0
    for quantity, (lo, hi) in ranges.items():  # one at a time: most points can be
        if "tilt" in quantity and "kappa" in scene.text["throw"]:
            continue
        possible += compared(scene, {quantity: rng.uniform(lo, hi, 12)})
    assert possible > 4 * len(ranges)


@pytest.mark.sweep
@pytest.mark.parametrize("name", SCENES)
def test_random_points_in_all_quantities_at_once(name, whole):
    given, ranges = SCENES[name]
    scene, rng = scene_of(given, whole), np.random.default_rng(13)
    for _ in range(40):
        names = rng.choice(list(ranges), size=3, replace=False)
        if "gravity.tilt" in names and "throw.speed" not in names and "kappa" in scene.text["throw"]:
            continue
        middle = {quantity: rng.uniform(0.25, 0.6, 30) for quantity in names}
        compared(scene, {q: ranges[q][0] + share * np.ptp(ranges[q]) for q, share in middle.items()})


def test_what_is_stacked_has_one_row_per_point_and_no_holes():
    found = throw_stack(ls.load("paper-designed"), {"arm.surface_height": np.linspace(-1, 0.2, 5)})
    params = found.params
    arrays = [params.a, params.corner, found.lo, params.kappa, params.flight.full_turn]
    assert [each.shape for each in arrays] == [(5, 3), (5, 3), (5, 3), (5,), (5,)]
    assert all(each.flags.c_contiguous and each.dtype == np.float64 for each in arrays)


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize("value", [NAN, INF, -INF, 0.0, 1e-13, -1.0, 1e13])
def test_numbers_that_no_scene_holds_are_flagged(value):
    found = throw_stack(ls.load("paper-designed"), {"part.mass.radius_of_gyration": [1.25, value]})
    assert found.possible.tolist() == [True, False]
    assert np.isfinite(found.params.radius_of_gyration).all()


def test_a_radius_of_gyration_ends_with_all_mass_in_the_corners():
    """3.19666 in is that of the paper's part: tests/scene/test_refusals.py has the closed form."""
    stack = throw_stack(ls.load("paper-designed"), {"part.mass.radius_of_gyration": [3.1966, 3.1967]})
    assert stack.possible.tolist() == [True, False]


def test_an_arm_that_ends_before_the_goal_is_no_scene():
    found = throw_stack(ls.load("paper-designed"), {"arm.length": [20.0, 20.5]})
    assert found.possible.tolist() == [False, True]


def test_quantities_that_cannot_vary_are_refused():
    for quantity, words in (
        ("throw.sped", "did you mean 'throw.speed'"),
        ("landing.x", "noise of landings only"),
        ("part.vertices[0].x", "this scene does not give it"),
        ("part.sides[3]", "this scene does not give it"),
        ("gravity.tilt", "the throw is given by kappa"),
    ):
        with pytest.raises(SceneError, match=words.replace("[", r"\[")):
            throw_stack(ls.load("paper-designed"), {quantity: [1.0]})


def test_a_speed_needs_gravity():
    scene = Scene.of(FOUR_GON, None)
    with pytest.raises(SceneError, match="add \\[gravity\\]"):
        throw_stack(scene, {"throw.speed": [2.0]})
    assert throw_stack(scene, {"throw.speed": [2.0], "gravity.tilt": [0.5]}).possible.tolist() == [True]


def test_scenes_with_effects_are_refused(whole):
    whole["effects"] = {"landing": True}
    with pytest.raises(SceneError, match=r"the minimal model.*leave \[effects\] out"):
        throw_stack(Scene.of(whole, None), {"throw.speed": [2.0]})


@pytest.mark.parametrize("goal", [{"oriented_beyond": {"x": "20 in", "side": 2}}, None])
def test_a_part_that_does_not_fit_the_tray_is_no_scene(goal):
    tray = {"depression_width": "7.02 in", "depression_depth": "3 in", "pitch": "14.04 in"}
    tray |= {"agitation": "1 in", "wash": "1 in"}
    tree = {**ls.load("paper-designed").as_dict(), "tray": tray}
    if goal is None:
        tree.pop("goal")
    else:
        tree["goal"] = goal
    scene = ls.load(tree)
    # side 2 becomes longer than the depression; and the part lower than it is deep
    few = compared(scene, {"part.sides[2]": np.linspace(6.5, 7.5, 11)})
    assert 0 < few < 11 or goal is None
    assert 0 < compared(scene, {"part.sides[1]": np.linspace(2.9, 3.7, 9)}) <= 9
