"""The picture of an orbit that violates a goal: every state by its side, and where it must not be."""

import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.feeder.goals import FlipOrder, OrientedBeyond, Reaches

ORBIT = [{"x": 15.0, "side": 2}, {"x": 18.0, "side": 2}, {"x": 23.5, "side": 2}, {"x": 20.25, "side": 0}]


def drawn(goal, orbit=ORBIT):
    return ls.plot.counterexample(ls.load("paper-designed"), orbit, goal).axes[0]


def marks(axes):
    return {
        (float(x), float(y)): line.get_marker()
        for line in axes.lines
        if line.get_linestyle() == "None" and line.get_markersize() < 10
        for x, y in line.get_xydata()
    }


def test_states_and_the_forbidden_place():
    axes = drawn(OrientedBeyond(20.0, 2))
    found = marks(axes)
    assert set(found) == {(0, 15.0), (1, 18.0), (2, 23.5), (3, 20.25)}
    assert len({found[(k, x)] for k, x in ((0, 15.0), (1, 18.0), (2, 23.5))}) == 1
    assert found[(3, 20.25)] != found[(0, 15.0)]  # not by colour alone
    (area,) = axes.patches
    assert area.get_gid() == "forbidden"
    assert area.get_y() == 20.0
    words = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert words[-1] == "on side 0, 0.25 in beyond"


def test_what_is_to_be_reached_is_shown_even_far_off():
    axes = drawn(Reaches(30.0, 1))
    assert [patch.get_gid() for patch in axes.patches] == ["wanted"]
    assert axes.get_ylim()[1] > 30.0


def test_goals_without_a_place_shade_nothing():
    assert not drawn(FlipOrder((0, 1, 2))).patches
    assert not drawn(None).patches


def test_of_a_long_orbit_the_end_is_drawn():
    orbit = [{"x": 10.0 + 0.01 * k, "side": k % 3} for k in range(100)]
    found = marks(drawn(OrientedBeyond(20.0, 2), orbit))
    assert min(found)[0] == 60
    assert max(found)[0] == 99


def test_nothing_to_draw_is_refused():
    with pytest.raises(AnswerError, match="empty"):
        drawn(None, [])


def test_a_goal_that_fails_at_once_is_more_than_a_dot():
    """The next rests are those of the map: the picture shows whether the part comes back."""
    axes = drawn(OrientedBeyond(20.0, 2), [{"x": 21.0, "side": 0}])
    path = ls.orbit(ls.load("paper-designed").map, 21.0, 0, 12)
    onward = [line.get_xydata()[0] for line in axes.lines if line.get_gid() == "thrown on"]
    assert onward == [pytest.approx((k, x)) for k, x in enumerate(path.x[1:], start=1)]
    low, high = axes.get_ylim()
    assert low < path.x.min() < path.x.max() < high
    assert "at once" in axes.figure.get_suptitle()
    assert not [line for line in drawn(OrientedBeyond(20.0, 2)).lines if line.get_gid() == "thrown on"]
