"""Margins by floats: against the sharp margins of docs/model.md's designed feeder, and against proved brackets."""

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.scene.arrays import throw_stack
from limitsets.parameters.atlas.float_margins import float_margins
from limitsets.systems.topology import topologies


def margins(scene, values, quantity, reading="fixed"):
    arrays = {name: np.atleast_1d(np.asarray(each, float)) for name, each in values.items()}
    stack = throw_stack(scene, arrays)
    known = topologies(stack.params, stack.lo, stack.hi, stack.anchor)
    return float_margins(scene, arrays, known, quantity, reading)


def designed(**tolerance):
    tree = ls.load("paper-designed").as_dict()
    return ls.load({**tree, "tolerance": tolerance} if tolerance else tree)


@pytest.mark.parametrize(("reading", "sharp"), [("fixed", 0.733), ("per-throw", 0.397)])
def test_the_speed_of_the_designed_feeder_has_its_sharp_margins(reading, sharp):
    # found by two programs written apart from each other, to all three digits [% of the speed]
    scene = designed()
    (found,) = margins(scene, {"arm.surface_height": -0.2}, "throw.speed", reading)
    assert found == pytest.approx(sharp, rel=0.005)


@pytest.mark.sweep  # each bracket is proved anew
@pytest.mark.parametrize(
    ("height", "quantity"),
    [
        *((height, "throw.speed") for height in (-0.25, -0.2, -0.1)),
        # from -0.1 in the goal holds up to 0.058 in: above the joint, where one proof of all heights does not reach
        *((height, "arm.surface_height") for height in (-0.25, -0.2)),
    ],
)
def test_margins_lie_within_two_percent_of_the_middle_of_proved_brackets(height, quantity):
    scene = designed().with_values({"arm.surface_height": height})
    (proved,) = ls.margin(scene, quantity)
    (found,) = margins(scene, {"arm.surface_height": height}, quantity)
    assert found == pytest.approx(0.5 * (proved.proved + proved.refuted), rel=0.02)


@pytest.mark.sweep
def test_a_margin_that_reaches_above_the_joint_ends_where_the_goal_is_shown_to_fail():
    """Starts near the joint creep to it there, more of them at each height: no proof is for the same starts at all."""
    scene = designed().with_values({"arm.surface_height": -0.1})
    (proved,) = ls.margin(scene, "arm.surface_height")
    (found,) = margins(scene, {"arm.surface_height": -0.1}, "arm.surface_height")
    assert 0.1 < proved.proved < found
    assert found == pytest.approx(proved.refuted, rel=0.02)


@pytest.mark.sweep
def test_a_joint_margin_lies_within_two_percent_of_its_proved_bracket():
    scene = designed(**{"throw.speed": "1 %", "arm.surface_height": "0.01 in", "part.sides[0]": "0.5 %"})
    (proved,) = ls.margin(scene, "joint")
    (found,) = margins(scene, {"arm.surface_height": -0.2}, "joint")
    assert found == pytest.approx(0.5 * (proved.proved + proved.refuted), rel=0.02)


def test_no_margin_where_the_goal_fails_and_none_is_told_where_nothing_stays():
    scene = designed()
    # at -0.5 in the limit set reaches 21.06 in on side 0, beyond the goal's 20; at -3 in every start leaves the arm
    found = margins(scene, {"arm.surface_height": [-0.5, -3.0]}, "throw.speed")
    assert found[0] == 0.0
    assert np.isnan(found[1])


def test_a_margin_does_not_depend_on_the_points_beside_it():
    scene = designed()
    heights = np.linspace(-0.3, -0.05, 7)
    together = margins(scene, {"arm.surface_height": heights}, "throw.speed")
    alone = [margins(scene, {"arm.surface_height": height}, "throw.speed")[0] for height in heights]
    assert np.array_equal(together, alone)


def test_a_goal_that_has_no_threshold_is_refused():
    tree = ls.load("paper-designed").as_dict()
    scene = ls.load({**tree, "goal": {"stays_on_arm": True}})
    with pytest.raises(AnswerError, match="oriented_beyond or reaches"):
        margins(scene, {"arm.surface_height": -0.2}, "throw.speed")


def test_a_scene_without_a_goal_is_told_to_have_one():
    tree = ls.load("paper-designed").as_dict()
    del tree["goal"]
    with pytest.raises(AnswerError, match=r"missing.*add \[goal\] to the scene"):
        margins(ls.load(tree), {"arm.surface_height": -0.2}, "throw.speed")
