"""One part and one depression: free fall, impact, friction and rest by textbook mechanics."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.engine.depression import EMPTY, UNFINISHED, Motion, Plate, fall_speed

pytest.importorskip("pymunk")

PART = ls.load("paper-designed")
STILL = Motion(0.0, 0.0, 0.0)
WIDTH, DEPTH = 7.02, 1.53


def plate(friction=0.3, restitution=0.3, width=WIDTH, depth=DEPTH, **changes):
    return Plate(PART, width, depth, friction, restitution, **changes)


def energy(of, pose, motion):
    """Kinetic and potential energy of a part of mass 1, over the plate; gravity is one size per time squared."""
    rho2 = PART.radius_of_gyration**2
    return 0.5 * (motion.along**2 + motion.up**2 + rho2 * motion.turning**2) + of.size * pose.y


@pytest.mark.parametrize("side", [0, 1, 2])
@pytest.mark.parametrize("above", [0.0, 0.05, 1.0])
def test_a_part_exactly_above_its_seat_and_at_rest_is_captured(side, above):
    flat = plate(restitution=0.0)
    seat = flat.seated(side)
    rest = flat.settle(seat._replace(y=seat.y + above), STILL)
    assert rest.state == 1 + side
    assert rest.pose.x == pytest.approx(seat.x, abs=1e-3)
    assert rest.pose.y == pytest.approx(float(PART.sides.d[side]) - DEPTH, abs=2e-3)


def test_a_depression_as_deep_as_nothing_captures_nothing():
    flat, random = plate(depth=1e-3), np.random.default_rng(3)
    for _ in range(60):
        x, angle = random.uniform(-7.0, 7.0), random.uniform(0.0, math.tau)
        assert flat.settle(flat.lowered(x, angle, 0.5), STILL).state in (EMPTY, UNFINISHED)


def test_a_part_that_lies_on_the_plate_beside_it_is_not_in_it():
    flat = plate()
    seat = flat.seated(2)
    rest = flat.settle(seat._replace(x=seat.x + 20.0, y=seat.y + DEPTH), STILL)
    assert (rest.state, rest.side) == (EMPTY, 2)


@pytest.mark.parametrize(("beyond", "falls"), [(0.2, False), (-0.2, True)])
def test_a_part_tips_in_when_its_centre_of_mass_is_over_the_depression(beyond, falls):
    flat = plate()
    seat = flat.seated(2)
    rest = flat.settle(seat._replace(x=0.5 * WIDTH + beyond, y=seat.y + DEPTH), STILL)
    assert (rest.state > EMPTY) == falls
    if not falls:
        assert rest.pose.x == pytest.approx(0.5 * WIDTH + beyond, abs=1e-3)


@pytest.mark.parametrize("side", [0, 1, 2])
def test_a_part_falls_as_fast_as_galileo_says(side):
    flat, seen = plate(step=1e-3), []
    seat = flat.seated(side)
    start = seat._replace(x=seat.x + 20.0, y=seat.y + DEPTH + 2.0)
    flat.settle(start, STILL, lambda *now: seen.append(now))
    falling = [(time, pose.y) for time, pose, _ in seen if time < math.sqrt(2 * 1.9 / flat.size)]
    assert len(falling) > 500
    for time, y in falling:
        assert start.y - y == pytest.approx(0.5 * flat.size * time**2, abs=flat.size * 1e-3)


@pytest.mark.parametrize("restitution", [0.2, 0.5, 0.9])
def test_a_flat_part_rises_again_to_the_square_of_the_restitution(restitution):
    flat, seen = plate(0.0, restitution, step=5e-4), []
    seat = flat.seated(2)
    start = seat._replace(x=seat.x + 20.0, y=seat.y + DEPTH + 1.0)
    flat.settle(start, STILL, lambda *now: seen.append(now))
    ups = [motion.up for _, _, motion in seen]
    impact = next(k for k, (before, now) in enumerate(itertools.pairwise(ups)) if before < 0.0 < now)
    until = next(k for k in range(impact + 1, len(ups)) if ups[k] <= 0.0)
    rise = seen[until][1].y - (start.y - 1.0)
    assert rise == pytest.approx(restitution**2, abs=0.01)


def test_a_sliding_part_stops_where_coulomb_says():
    flat = plate(0.1, 0.0, step=1e-3)
    seat = flat.seated(2)
    start = seat._replace(x=seat.x + 20.0, y=seat.y + DEPTH)
    rest = flat.settle(start, Motion(fall_speed(flat.size, 0.5), 0.0, 0.0))
    assert rest.state == EMPTY
    assert rest.pose.x - start.x == pytest.approx(0.5 / 0.1, rel=0.01)  # v^2/(2 mu g) with v^2 = 2 g 0.5


def test_energy_is_only_lost():
    flat, random = plate(), np.random.default_rng(11)
    for _ in range(25):
        pose = flat.lowered(random.uniform(-7.0, 7.0), random.uniform(0.0, math.tau), 1.0)
        motion = Motion(*random.normal(0.0, fall_speed(flat.size, 0.5), 2), random.normal(0.0, 0.4))
        seen = []
        flat.settle(pose, motion, lambda _, *now: seen.append(energy(flat, *now)))  # noqa: B023
        steps = np.diff(np.minimum.accumulate(seen))
        assert np.all(steps <= 0.0)
        # the step moves the part with its old velocity: a fall gains g^2 dt^2/2 in each
        assert max(np.array(seen) - np.minimum.accumulate(seen)) < 0.02 * energy(flat, pose, motion)


def test_half_the_step_changes_hardly_any_rest():
    random, differ = np.random.default_rng(5), 0
    whole, half = plate(), plate(step=2e-3)
    for _ in range(60):
        pose = whole.lowered(random.uniform(-7.0, 7.0), random.uniform(0.0, math.tau), 0.5)
        motion = Motion(random.uniform(0.0, fall_speed(whole.size, 1.0)), 0.0, 0.0)
        differ += whole.settle(pose, motion).state != half.settle(pose, motion).state
    assert differ <= 6


def test_a_part_that_hangs_level_between_the_edges_is_not_on_the_floor():
    """A trapezoid 2 wide below and 4 above, 3 high, is 3 wide at half its height: it hangs 1.5 deep in a gap of 3."""
    corners = [["0 in", "0 in"], ["2 in", "0 in"], ["3 in", "3 in"], ["-1 in", "3 in"]]
    mass = {"center": {"side": 0, "along": "1 in", "above": "1.5 in"}, "radius_of_gyration": "1.1 in"}
    tree = {**PART.as_dict(), "part": {"vertices": corners, "mass": mass}}
    del tree["goal"]
    hung = replace(plate(restitution=0.0, width=3.0, depth=2.5), part=ls.load(tree))
    rest = hung.settle(hung.lowered(0.0, 0.0, -1.4), STILL)
    assert rest.pose.y == pytest.approx(0.0, abs=0.01)
    assert rest.state in (5, 6)  # it leans, one of its lower corners lowest; on the floor it would be 1


def test_a_part_straight_up_and_down_stays_as_it_was():
    flat = plate()
    for speed in (0.5, 2.0, 4.0):
        assert flat.settle(flat.seated(2), Motion(0.0, speed, 0.0)).state == 3


def test_a_part_thrown_far_is_out():
    flat = plate()
    rest = flat.settle(flat.lowered(0.0, 0.0, 3.0), Motion(fall_speed(flat.size, 8.0), 0.0, 0.0))
    assert rest.state == EMPTY
    assert rest.pose.x > 2.0 * math.sqrt(8.0 * 3.0)  # the parabola alone, which begins at x = 0


def test_a_wall_stops_what_lies_against_it():
    flat = plate(restitution=0.0)
    seat = flat.seated(2)
    pushed = seat._replace(x=seat.x + 0.5 * (WIDTH - flat.size) - 1e-3)
    assert flat.settle(pushed, Motion(0.5, 0.0, 0.0)).pose.x == pytest.approx(pushed.x, abs=5e-3)


def test_the_lowest_point_is_where_it_is_told():
    flat = plate()
    for angle in (0.0, 1.0, 4.0):
        pose = flat.lowered(2.0, angle, 0.7)
        about = PART.vertices - PART.centre
        heights = pose.y + about @ (math.sin(angle), math.cos(angle))
        assert heights.min() == pytest.approx(0.7, abs=1e-12)


def test_of_the_arm_and_the_throw_nothing_is_used():
    other = replace(plate(), part=PART.with_values({"arm.surface_height": -1.0, "throw.kappa": 90.0}))
    start = plate().lowered(1.0, 0.8, 0.5)
    assert other.settle(start, STILL) == plate().settle(start, STILL)


def test_patience_ends():
    rest = plate(patience=0.1).settle(plate().lowered(0.0, 0.3, 2.0), STILL)
    assert (rest.state, rest.side) == (UNFINISHED, -1)
