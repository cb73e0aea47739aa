"""Parts that leave: how they fall, and how they tip over the end of the arm."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import limitsets as ls
from limitsets.base.errors import AnswerError, SceneError
from limitsets.cell.feeding import clear_beyond, time_to_tip
from limitsets.cell.feeding.falling import arm_end_of, farthest_clear, rate_about_end, tipping_times
from limitsets.cell.feeding.trials import run_trials
from limitsets.feeder.engine import Crowd
from limitsets.feeder.scattering import Scattering
from tests.feeding.scenes import with_cavity

# ----------------------------------------------------------------
# Time to tip against other ways to integrate it and a closed form; where the part meets the wall, by hand.


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
    pendulum = D * ANGLE / (math.cosh(0.5 * math.sqrt(G * D / (RHO**2 + D**2))) - 1.0)
    assert least == pytest.approx(pendulum, rel=0.05)
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


# ----------------------------------------------------------------
# A part that comes down beyond the end of the arm goes on turning about the end; thrown at the end it is lost.


def followed(scene, x, side, angle):
    """A jog by Newton's laws alone: where its side comes down, the rate about the end then, and the time to flush."""
    a, d = float(scene.sides.a[side]), float(scene.sides.d[side])
    rho, kappa = scene.radius_of_gyration, scene.kappa
    h, end, g = scene.surface_height, scene.cavity.position, scene.gravity
    w = math.sqrt(g / kappa)

    def corner(t):  # height of the left corner over the arm in free flight
        turned = w * t
        return h + d + x * turned - 0.5 * g * t * t - a * math.sin(turned) - d * math.cos(turned) - h

    t = brentq(corner, 0.5 * (x - a) * w / g, 4.0 * x * w / g)
    turned = w * t
    centre = np.array([x - (h + d) * turned, h + d + x * turned - 0.5 * g * t * t])
    velocity = np.array([-(h + d) * w, x * w - g * t])
    c, s = math.cos(turned), math.sin(turned)
    held = centre - np.array([a * c - d * s, a * s + d * c])

    def stopped(centre, velocity, rate, at):
        """Rate after an impulse at a point that stops that point of the part: three equations of momentum."""
        rx, ry = at - centre
        # v' = v + J, rho^2 n' = rho^2 n + r x J, v' + n' x r = 0
        system = np.array(
            [[1, 0, -ry, 0, 0], [0, 1, rx, 0, 0], [1, 0, 0, -1, 0], [0, 1, 0, 0, -1], [0, 0, rho**2, ry, -rx]]
        )
        return np.linalg.solve(system, [0, 0, *velocity, rho**2 * rate])[2]

    rate = stopped(centre, velocity, w, held)

    def pendulum(about, until):
        """The part about a point until it has turned by `until`, from the pose (centre, rate) given."""

        def motion(_, state):
            c, s = math.cos(state[0]), math.sin(state[0])
            rx, ry = np.array([[c, -s], [s, c]]) @ about[0]
            return state[1], -g * rx / (rho**2 + rx * rx + ry * ry)

        def arrives(_, state):
            return state[0] - until

        arrives.terminal, arrives.direction = True, -1
        path = solve_ivp(motion, (0, 5), (0.0, about[1]), events=arrives, rtol=1e-11, atol=1e-13)
        return path.t_events[0][0], path.y_events[0][0][1]

    _, rate = pendulum((centre - held, rate), -turned)
    landed = held[0] + a
    centre, down = np.array([landed, h + d]), np.array([a, d])
    velocity = rate * np.array([-down[1], down[0]])
    about = stopped(centre, velocity, rate, np.array([end, h]))
    time, _ = pendulum((centre - np.array([end, h]), about), -angle)
    return landed, -about, time


@pytest.mark.parametrize("x", [17.4815656, 18.2, 19.5])
def test_the_way_over_the_end_is_that_of_newtons_laws(x):
    scene = with_cavity()
    landed, rate, time = followed(scene, x, 2, scene.cavity.angle)
    beyond = landed - 20.0
    assert beyond > 0.0
    assert rate_about_end(scene, x, 2, beyond) == pytest.approx(rate, rel=1e-9)
    given = scene.sides.d[2], scene.radius_of_gyration, scene.gravity, scene.cavity.angle
    assert float(time_to_tip(beyond, *given, rate)) == pytest.approx(time, rel=1e-8)
    assert tipping_times(scene, 2)(np.array([beyond]))[0] == pytest.approx(time, rel=1e-5)


def test_a_hundredth_of_an_inch_beyond_the_end():
    """The issue's numbers: 0.064 s as it came down, 0.54 s from rest."""
    moving, resting = (tipping_times(with_cavity(tips=tips), 2) for tips in ("moving", "rest"))
    assert moving(np.array([0.01]))[0] == pytest.approx(0.064, abs=5e-4)
    assert resting(np.array([0.01]))[0] == pytest.approx(0.54, abs=5e-3)
    assert ls.load(with_cavity().as_dict()).cavity.tips == "moving"


def test_limits_of_the_time():
    """Without weight the rate stays; at the end itself sinh(lambda t) = lambda angle / rate for a small angle."""
    assert float(time_to_tip(0.3, 0.7, 1.25, 1e-12, 0.5, 4.0)) == pytest.approx(0.125, rel=1e-9)
    pull = math.sqrt(193.0 * 0.7 / (1.25**2 + 0.7**2))
    expected = math.asinh(pull * 0.02 / 0.1) / pull
    assert float(time_to_tip(0.0, 0.7, 1.25, 193.0, 0.02, 0.1)) == pytest.approx(expected, rel=1e-4)
    slow, resting = (float(time_to_tip(0.01, 0.7, 1.25, 193.0, 0.5, *rate)) for rate in ((1e-12,), ()))
    assert slow == pytest.approx(resting, rel=1e-9)


@pytest.mark.parametrize("contact", ["hinge", "unilateral"])
def test_the_crowd_throws_it_over_the_end_as_fast(contact):
    """One throw from 17.7 in, which comes down 0.3 in beyond the end; frames are 0.015 s."""
    scene = with_cavity(tables={"effects": {"contact": True}})
    crowd = Crowd([scene], friction=50.0, contact=contact, record=True)
    crowd.place(0, 17.7, 2)
    rest = crowd.throw()[0]
    assert (rest.where, rest.side) == ("cavity", 2)
    film = crowd.recording()
    angles = film.poses[:, 0, 2] - film.poses[0, 0, 2]
    down = film.times[np.flatnonzero((angles[:-1] > 0.0) & (angles[1:] <= 0.0))[0]]
    flush = film.times[np.flatnonzero(angles < 1e-3 - scene.cavity.angle)[0]]
    landed = float(ls.orbit(scene.map, 17.7, 2, 1).x[1]) - 20.0
    assert flush - down == pytest.approx(float(tipping_times(scene, 2)(np.array([landed]))[0]), abs=0.035)
    assert flush - down < 0.5 * float(tipping_times(with_cavity(tips="rest"), 2)(np.array([landed]))[0])


def test_a_part_that_comes_down_moving_is_not_late():
    assert clear_beyond(with_cavity(rate="4 Hz", tips="rest"), 2)[0][0] > 0.1
    assert clear_beyond(with_cavity(rate="4 Hz"), 2)[0][0] == 0.0
    ((least, _),) = clear_beyond(with_cavity(rate="18 Hz"), 2)
    assert tipping_times(with_cavity(), 2)(np.array([least]))[0] == pytest.approx(1.0 / 18.0, rel=1e-6)


def test_no_other_word_says_how_it_tips():
    with pytest.raises(SceneError, match=r'cavity\.tips.*"moving" or "rest"'):
        with_cavity(tips="fast")


@pytest.mark.parametrize("beyond", [1e-6, 1e-4, 1e-3])
def test_the_way_over_the_end_is_known_next_to_the_end(beyond):
    """Between the last start that comes down before the end and the first beyond."""
    scene = with_cavity()
    x = brentq(lambda x: float(ls.orbit(scene.map, x, 2, 1).x[1]) - 20.0 - beyond, 17.0, 17.6, xtol=1e-13)
    given = scene.sides.d[2], scene.radius_of_gyration, scene.gravity, scene.cavity.angle
    time = float(time_to_tip(beyond, *given, rate_about_end(scene, x, 2, beyond)))
    assert tipping_times(scene, 2)(np.array([beyond]))[0] == pytest.approx(time, rel=1e-6)


def test_what_does_not_reach_over_the_end_is_not_thrown_at_the_edge():
    """A tall part 1 in wide: its throw acts 1 in right of its middle, from where half an inch of it lies."""
    part = {
        "vertices": [["0 in", "0 in"], ["1 in", "0 in"], ["1 in", "8 in"], ["0 in", "8 in"]],
        "mass": {"plate_density": "1 kg/m^2"},
    }
    end = arm_end_of(with_cavity(tables={"part": part}), side=0)
    assert end.edges[[0, 2]] == pytest.approx(19.5)
    assert end.at_edge(np.array([19.4, 19.6]), np.zeros(2, dtype=int)).tolist() == [False, True]


def test_a_throw_that_acts_beyond_the_end_is_a_fate_of_its_own():
    """The impulse acts (rho^2 + d (h + d)) / x right of the foot of the centre of mass."""
    scene = with_cavity()
    end = arm_end_of(scene)
    for side, x in enumerate(end.edges.tolist()):
        d = float(scene.sides.d[side])
        assert x + (scene.radius_of_gyration**2 + d * (scene.surface_height + d)) / x == pytest.approx(20.0)
        places = np.array([x - 1e-6, x + 1e-6, 20.0 - 1e-6, 20.0])
        assert end.at_edge(places, np.full(4, side)).tolist() == [False, True, True, False]
    trials = run_trials(end, Scattering(), 20_000)
    assert 0.02 < trials.counts["edge"] / 20_000 < 0.06
