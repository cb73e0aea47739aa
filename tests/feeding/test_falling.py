"""Time to tip against other ways to integrate it and a closed form; where the part meets the wall, by hand."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.feeding import clear_beyond, time_to_tip
from limitsets.cell.feeding.falling import arm_end_of, farthest_clear
from tests.feeding.scenes import with_cavity

G, D, RHO, ANGLE = 193.045, 0.708249, 1.25, math.radians(32.23)


def linear(e, height=D, angle=ANGLE):
    """The inverted pendulum linear in the angle: M theta'' = g (e + d theta)."""
    rate = math.sqrt(G * height / (RHO**2 + height**2 + e**2))
    return math.acosh(1.0 + height * angle / e) / rate


@pytest.mark.parametrize("e", [0.01, 0.3, 2.0, 4.2])
def test_time_to_tip_is_that_of_the_equation_of_motion(e):
    inertia = RHO**2 + D**2 + e**2

    def motion(_, state):
        # the moment of gravity about the hinge: the lever of the centre of mass
        lever = e * math.cos(state[0]) + D * math.sin(state[0])
        return state[1], G * lever / inertia

    def arrives(_, state):
        return state[0] - ANGLE

    arrives.terminal = True
    path = solve_ivp(motion, (0.0, 5.0), (0.0, 0.0), events=arrives, rtol=1e-12, atol=1e-14)
    assert float(time_to_tip(e, D, RHO, G, ANGLE)) == pytest.approx(path.t_events[0][0], rel=1e-9)


@pytest.mark.parametrize("e", [1e-2, 1e-6, 1e-12, 1e-100])
def test_close_to_the_end_the_time_is_that_of_the_linear_pendulum(e):
    """To small angles: sin theta = theta to 1e-4 below 0.02 rad, so that a ramp of 0.02 rad is reached in that time."""
    assert float(time_to_tip(e, D, RHO, G, 0.02)) == pytest.approx(linear(e, angle=0.02), rel=1e-4)


def test_half_the_distance_takes_ln_2_longer():
    rate = math.sqrt(G * D / (RHO**2 + D**2))
    near, nearer = time_to_tip([2e-9, 1e-9], D, RHO, G, ANGLE)
    assert nearer - near == pytest.approx(math.log(2.0) / rate, rel=1e-8)
    assert time_to_tip(0.0, D, RHO, G, ANGLE) == math.inf


def test_without_a_rate_of_throws_a_part_has_time_to_tip():
    scene = with_cavity()
    # no vertex is near the wall: what bounds it is that the arm's model ends 8 in beyond, and the part 4.2 in
    assert clear_beyond(scene, 2) == ((0.0, pytest.approx(4.2255778)),)


def test_the_next_throw_comes_too_early_close_to_the_end():
    scene = with_cavity(rate="2 Hz", tips="rest")
    ((least, most),) = clear_beyond(scene, 2)
    assert float(time_to_tip(least, D, RHO, G, ANGLE)) == pytest.approx(0.5, rel=1e-9)
    # the linear pendulum is a little too fast: cosh(0.5 sqrt(g d / M)) - 1 = d angle / e
    assert least == pytest.approx(
        D * ANGLE / (math.cosh(0.5 * math.sqrt(G * D / (RHO**2 + D**2))) - 1.0), rel=0.05
    )
    assert most == pytest.approx(4.2255778)
    end = arm_end_of(scene)
    x = 20.0 + np.array([-0.1, 0.5 * least, 2.0 * least, 1.0, 4.3])
    assert end.fate(x, np.full(5, 2)).tolist() == [-1, 2, 0, 0, 2]
    assert end.fate(x, np.full(5, 1)).tolist() == [-1, 1, 1, 1, 1]


def test_so_fast_that_none_clears():
    assert clear_beyond(with_cavity(rate="100 Hz"), 2) == ()


def test_the_leading_corner_meets_a_near_wall_by_hand():
    """On a ramp of 45 deg the right corner comes down along a circle about the end: it is farthest right at first."""
    scene = with_cavity(width="7 in", depth="6 in", angle="45 deg")
    length, a = 6.75, 4.2255778
    # the top corner, 4.8641 in along and 3.0665 in above, swings out to hypot(e + 0.6385, 3.0665) at most
    along = (5.75**2 + 6.75**2 - 3.6**2) / (2.0 * 6.75)
    height = math.sqrt(5.75**2 - along**2)
    top = math.sqrt(7.0**2 - height**2) - (along - a)
    right = 7.0 - (length - a)
    assert farthest_clear(scene, scene.cavity, 2) == pytest.approx(min(top, right), rel=1e-12)


def test_the_floor_by_hand():
    """A ramp that ends early: flush on it, the right corner is s sin(angle) deep."""
    scene = with_cavity(width="30 in", depth="2.5 in", angle="45 deg")
    a = 4.2255778
    floor = 2.5 * math.sqrt(2.0) - (6.75 - a)
    assert farthest_clear(scene, scene.cavity, 2) == pytest.approx(floor, rel=1e-9)


def test_a_corner_that_overhangs_meets_the_floor_by_hand():
    """The corner at (5, 1) is beyond the side's own right one, at 2: flush on 45 deg it lies (5 - 1) / sqrt(2) deep."""
    corners = [["0 in", "0 in"], ["2 in", "0 in"], ["5 in", "1 in"]]
    mass = {"center": {"side": 0, "along": "1.95 in", "above": "0.25 in"}, "radius_of_gyration": "1 in"}
    part = {"vertices": corners, "mass": mass}
    scene = with_cavity(tables={"part": part}, width="30 in", depth="2.5 in", angle="45 deg")
    assert farthest_clear(scene, scene.cavity, 0) == pytest.approx(2.5 * math.sqrt(2.0) + 1.0 - (5.0 - 1.95))


def test_what_feeding_needs_is_asked_for():
    with pytest.raises(AnswerError, match=r"without \[cavity\]"):
        ls.feed("paper-designed")
    scene = with_cavity(rate="2 Hz", tables={"gravity": {"tilt": "30 deg"}})
    with pytest.raises(AnswerError, match=r"add \[gravity\]"):
        clear_beyond(dataclasses.replace(scene, gravity=None), 2)
    with pytest.raises(AnswerError, match="pass side="):
        arm_end_of(with_cavity(tables={"goal": {"attracts_all": True}}))
    with pytest.raises(AnswerError, match="lengthen it"):
        arm_end_of(with_cavity(position="28 in"))
