"""Many parts in one engine space: against the throw map, and against the laws of impact.

Expected values: the map; textbook mechanics written out here; the cavity's sizes of studies/sizes.toml.
"""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError
from limitsets.cell.feeding import time_to_tip
from limitsets.feeder.engine import Crowd, Rest, off_seat, seat_of
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.member import Film
from limitsets.feeder.engine.stage import OVERLAP
from limitsets.systems.maps import images
from tests.feeding.scenes import with_cavity

pytest.importorskip("pymunk")

DESIGNED, INITIAL = ls.load("paper-designed"), ls.load("paper-initial")
FED = with_cavity()
STUDY_02 = 8.8e-5
"""Worst error of x' in that study, at its step."""


def by_map(scene, x, side, factor=1.0):
    found = images(scene.map._replace(kappa=scene.map.kappa * factor), np.array([x]), side)
    return float(found.x[0]), int(found.side[0])


@pytest.mark.parametrize("scene", [DESIGNED, INITIAL], ids=["designed", "initial"])
@pytest.mark.parametrize("step", [4e-3, 1e-2])
def test_parts_that_pass_through_each_other_land_where_the_map_says(scene, step):
    random = np.random.default_rng(5)
    crowd = Crowd([scene] * 5, between=False, friction=1.0, step=step)
    errors = []
    for _ in range(12):
        side = random.integers(3, size=5).tolist()
        x = random.uniform(scene.sides.a[side], 20.0).tolist()
        for number in range(5):
            crowd.place(number, x[number], side[number])
        deviation, shifts = 0.005 * random.normal(), 0.02 * random.normal(size=5)
        for rest in crowd.throw(deviation, shifts):
            after, on = by_map(scene, x[rest.number], side[rest.number], 1.0 / (1.0 + deviation) ** 2)
            assert (rest.where, rest.side) == ("arm", on)
            errors.append(abs(rest.x - after - shifts[rest.number]))
    assert max(errors) < STUDY_02


def test_parts_that_do_not_meet_land_alike_with_contact_and_without():
    rests = []
    for between in (True, False):
        crowd = Crowd([DESIGNED] * 2, between=between, friction=1.0)
        crowd.place(0, 6.0, 2)
        crowd.place(1, 15.0, 2)
        rests.append(crowd.throw())
        assert not crowd.overlapped
    assert rests[0] == rests[1]


def test_outlines_that_pass_through_each_other_are_told():
    """By the map part 0 comes to rest where part 1 does."""
    crowd = Crowd([DESIGNED] * 2, between=False, friction=1.0)
    crowd.place(0, 6.0, 2)
    crowd.place(1, 12.5, 0)
    after = by_map(DESIGNED, 12.5, 0)[0]
    assert after - 6.0 < 6.75
    crowd.throw()
    assert crowd.overlapped == {(0, 1)}


def test_unilateral_contact_comes_to_study_02_s_place():
    crowd = Crowd([DESIGNED], contact="unilateral", friction=1.0, step=1e-3)
    crowd.place(0, 15.0, 2)
    assert crowd.throw()[0].x == pytest.approx(16.94, abs=6e-3)


def polygon(count, radius=1.0, **words):
    """A regular part, its centre of mass in the middle."""
    turns = [math.tau * (k + 0.5) / count - math.pi / 2 for k in range(count)]
    corners = [[f"{radius * math.cos(t)!r} in", f"{radius * math.sin(t)!r} in"] for t in turns]
    foot = radius * math.sin(math.pi / count)
    centre = {"side": 0, "along": f"{foot!r} in", "above": f"{radius * math.cos(math.pi / count)!r} in"}
    mass = {"center": centre, "radius_of_gyration": "0.7 in"}
    tree = DESIGNED.as_dict()
    del tree["goal"]
    return ls.load({**tree, "part": {"vertices": corners, "mass": mass}, **words})


def kinetic(state, masses, inertia):
    """Energy of motion."""
    parts = zip(masses, state, strict=True)
    return 0.5 * sum(m * (v[0] ** 2 + v[1] ** 2 + inertia * v[2] ** 2) for m, v in parts)


def collide(part, masses, poses, velocities, **how):
    """Let two like parts meet in the air; states just before and after, and the last centres of mass."""
    crowd = Crowd([part, part], friction=1.0, masses=masses, step=1e-4, **how)
    for number, pose in enumerate(poses):
        crowd.drop(number, pose)
        crowd.members[number].body.velocity = velocities[number]
    bodies = [member.body for member in crowd.members]
    while True:
        before = [(*body.velocity, body.angular_velocity) for body in bodies]
        crowd.space.step(crowd.step)
        if crowd.overlapped:
            break
    after = [(*body.velocity, body.angular_velocity) for body in bodies]
    gained = -part.kappa * crowd.step
    before = [(across, up + gained, rate) for across, up, rate in before]  # what gravity adds in that step
    return np.array(before), np.array(after), [tuple(body.position) for body in bodies]


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_an_impact_off_the_centre(e):
    """J = (1 + e) v / c, c = 1/m1 + 1/m2 + (r1 x n)^2/I1 + (r2 x n)^2/I2; the energy lost is (1 - e^2) v^2 / 2 c."""
    square, masses, inertia = polygon(4), (1.0, 2.0), 0.49
    half, lift = math.cos(math.pi / 4), 0.3
    # the left one stands on a corner, which meets the other's upright side 0.3 above its middle
    poses = [(5.0, 40.0, math.pi / 4), (5.0 + 1.0 + half + 0.02, 40.0 - lift, 0.0)]
    how = {"sliding": 0.0, "restitution": e}
    before, after, _ = collide(square, masses, poses, [(3.0, 0.0), (0.0, 0.0)], **how)
    compliance = 1.0 / masses[0] + 1.0 / masses[1] + lift**2 / (inertia * masses[1])
    impulse = (1 + e) * 3.0 / compliance
    expected = [(3.0 - impulse, 0.0), (impulse / masses[1], -lift * impulse / (inertia * masses[1]))]
    for number, (across, rate) in enumerate(expected):
        # the corner has turned by no more than that
        assert after[number, 0] == pytest.approx(across, abs=1e-3)
        assert after[number, 2] == pytest.approx(rate, abs=2e-3)

    lost = 0.5 * (1 - e * e) * 9.0 / compliance
    assert kinetic(before, masses, inertia) - kinetic(after, masses, inertia) == pytest.approx(lost, abs=6e-3)


@pytest.mark.parametrize("sliding", [0.0, 0.6])
@pytest.mark.parametrize("e", [0.0, 0.7])
def test_impacts_keep_momentum_and_its_moment_about_the_joint(sliding, e):
    random, masses, inertia = np.random.default_rng(1), (1.0, 2.5), 1.25**2
    for _ in range(10):
        angles, off = random.uniform(0, math.tau, 2), random.uniform(-1.5, 1.5)
        poses = [(5.0, 60.0, angles[0]), (15.5, 60.0 + off, angles[1])]
        how = {"sliding": sliding, "restitution": e}
        before, after, places = collide(DESIGNED, masses, poses, [(6.0, 0.0), (-5.0, 0.0)], **how)
        changes = []
        for state in (before, after):
            momentum = sum(m * v[:2] for m, v in zip(masses, state, strict=True))
            each = zip(masses, state, places, strict=True)
            moment = sum(m * (x * v[1] - y * v[0] + inertia * v[2]) for m, v, (x, y) in each)
            changes.append(np.array([*momentum, moment]))
        assert np.abs(after - before).max() > 0.1
        assert changes[1][:2] == pytest.approx(changes[0][:2], abs=1e-9)
        # the two points of a contact lie apart by the overlap, a step's way at most: friction has that lever
        assert changes[1][2] == pytest.approx(changes[0][2], abs=1e-9 if sliding == 0.0 else 0.05)
        assert kinetic(after, masses, inertia) <= kinetic(before, masses, inertia) + 1e-9


@pytest.mark.parametrize("contact", ["hinge", "unilateral"])
def test_parts_at_rest_do_not_overlap(contact):
    crowd = Crowd([FED] * 4, contact=contact, friction=1.0)
    random = np.random.default_rng(2)
    for number in range(4):
        crowd.drop(number, (7.0 + 4.0 * number, 4.0 + 10.0 * number, float(random.uniform(0, 6))))
    seen = {rest.where for rest in crowd.settle()}
    for _ in range(12):
        seen |= {rest.where for rest in crowd.throw(0.005 * random.normal())}
        outlines = [member.world() for member in crowd.members]
        pairs = [(one, two) for k, one in enumerate(outlines) for two in outlines[:k]]
        assert max(depth_of_overlap(*pair) for pair in pairs) < 2.0 * OVERLAP * 6.75
    assert seen <= {"arm", "leaning", "cavity", "beyond"}
    assert {"arm", "cavity"} <= seen


def test_a_part_beyond_the_end_falls_into_its_seat():
    """That of sizes.toml: side 2 on the ramp, the top corner at the wall, side 0 level."""
    crowd = Crowd([FED], friction=1.0)
    crowd.place(0, 21.0, 2)
    (rest,) = crowd.settle()
    assert (rest.where, rest.side) == ("cavity", 2)
    seat = seat_of(FED, 2)
    assert seat[0] == pytest.approx((29.3, seat[1, 1]), abs=0.01)
    assert off_seat(crowd.members[0].world(), seat) < 0.01
    assert rest.met == ("arm", "ramp", "wall")


def test_a_part_balanced_over_the_end_is_beyond_it():
    """Its centre of mass is past the end by so little that it stands longer than the engine waits."""
    for x, where in ((20.0 + 1e-9, "beyond"), (20.0, "arm")):
        crowd = Crowd([FED], friction=1.0)
        crowd.place(0, x, 2)
        (rest,) = crowd.settle()
        assert (rest.where, rest.side) == (where, 2)


def test_a_part_in_motion_in_the_cavity_is_not_marked_as_ejected():
    film = Film(True, 1.0, [])
    for where in ("cavity", "unfinished", "cavity", "arm"):
        film.end(1.0, [Rest(0, where, 25.0, -1, (25.0, -3.0, 0.0), ())])
    marks = [(at, word) for at, _, word in film.marks]
    assert marks == [(1.0, "in the cavity"), (4.0, "ejected"), (4.0, "rest")]


@pytest.mark.parametrize("beyond", [0.05, 0.4, 1.2])
def test_it_tips_in_the_time_that_the_pendulum_takes(beyond):
    """The integral of docs/feeding.md; the end of the arm holds by much friction, and a frame is 0.015 s."""
    crowd = Crowd([FED], friction=50.0, record=True)
    crowd.place(0, 20.0 + beyond, 2)
    crowd.settle()
    film, angle = crowd.recording(), FED.cavity.angle
    flush = film.times[np.flatnonzero(film.poses[:, 0, 2] < film.poses[0, 0, 2] - angle + 1e-3)[0]]
    time = float(time_to_tip(beyond, FED.sides.d[2], FED.radius_of_gyration, FED.gravity, angle))
    assert flush == pytest.approx(time, rel=0.05, abs=0.02)


def test_the_cavity_stands_still_or_is_carried():
    for carried in (False, True):
        crowd = Crowd([FED, FED], friction=1.0, carried=carried)
        crowd.place(0, 21.0, 2)
        fed = crowd.settle()[0]
        crowd.place(1, 6.0, 2)
        after = crowd.throw()
        assert after[1].x == pytest.approx(by_map(FED, 6.0, 2)[0], abs=STUDY_02)
        assert (after[0].met == ()) is not carried
        assert (after[0].pose == fed.pose) is not carried


def test_a_recording_of_a_throw():
    crowd = Crowd([DESIGNED, DESIGNED], friction=1.0, record=True)
    crowd.place(0, 6.0, 2)
    crowd.place(1, 15.0, 2)
    rests = crowd.throw()
    film = crowd.recording()
    assert film.poses.shape == (film.times.size, 2, 3)
    assert (np.diff(film.times) > 0).all()
    assert [len(outline) for outline in film.outlines] == [3, 3]
    assert film.poses[0, 1].tolist()[0] == 15.0
    assert film.poses[-1, 1].tolist() == list(rests[1].pose)
    assert [word for _, part, word in film.marks if part == 1] == ["thrown", "impact", "rest"]
    # in flight x = R - (h + d) phi, seconds by w^2 = g / kappa
    turned = film.times[5] * math.sqrt(DESIGNED.gravity / DESIGNED.kappa)
    expected = 15.0 - (DESIGNED.surface_height + DESIGNED.sides.d[2]) * turned
    assert film.poses[5, 1, 0] == pytest.approx(expected, abs=1e-9)


def test_what_falls_in_and_comes_out_again_is_marked():
    """A part in the cavity is laid on the arm again by hand."""
    crowd = Crowd([FED], friction=1.0, record=True)
    crowd.place(0, 21.0, 2)
    crowd.settle()
    crowd.settle()
    crowd.place(0, 6.0, 2)
    crowd.settle()
    words = [word for _, _, word in crowd.recording().marks if word not in ("impact", "roll")]
    assert words == ["in the cavity", "ejected", "rest"]


def test_a_part_that_falls_off_is_lost_and_one_taken_out_is_out():
    crowd = Crowd([DESIGNED, DESIGNED], friction=1.0)
    crowd.drop(0, (32.0, 3.0, 0.0))
    crowd.place(1, 10.5, 1)
    assert [rest.where for rest in crowd.settle()] == ["lost", "arm"]
    crowd.take(1)
    assert [rest.where for rest in crowd.throw()] == ["lost", "out"]
    crowd.place(0, 6.0, 2)
    assert crowd.throw()[0].where == "arm"


def test_parts_that_overlap_at_the_start_are_refused():
    crowd = Crowd([DESIGNED, DESIGNED], friction=1.0)
    crowd.place(0, 10.0, 2)
    with pytest.raises(AnswerError, match="parts 0 and 1 is 'overlapping'"):
        crowd.place(1, 12.0, 2)
    with pytest.raises(AnswerError, match="overlapping"):
        crowd.place(1, 10.0 + 6.75 - 0.05, 2)  # corner in corner: the engine would throw them apart
    crowd.place(1, 10.0 + 6.75, 2)


def test_a_cavity_that_does_not_take_the_part():
    with pytest.raises(AnswerError, match="standing out by"):
        seat_of(with_cavity(depth="2 in"), 2)
    with pytest.raises(AnswerError, match=r"without \[cavity\]"):
        seat_of(DESIGNED, 2)


def test_wrong_calls_are_refused():
    for scenes, words, said in (
        ([DESIGNED, INITIAL], {"friction": 1.0}, "kappa of the scenes"),
        ([DESIGNED, FED], {"friction": 1.0}, "cavity of the scenes"),
        ([DESIGNED], {}, "world.friction"),
        ([DESIGNED], {"friction": -1.0}, "friction on the arm is -1.0"),
        ([DESIGNED], {"friction": 1.0, "sliding": math.inf}, "friction elsewhere is inf"),
        ([DESIGNED], {"friction": 1.0, "contact": "glue"}, "'hinge' or 'unilateral'"),
        ([DESIGNED], {"friction": 1.0, "restitution": 2.0}, "0 to 1"),
        ([DESIGNED], {"friction": 1.0, "step": 0.1}, "at most 0.05"),
    ):
        with pytest.raises(AnswerError, match=said):
            Crowd(scenes, **words)


@pytest.mark.parametrize("place", [(3.0, 2), (29.0, 2), (10.0, 3)])
def test_places_off_the_arm_are_refused(place):
    with pytest.raises(AnswerError, match="lay it on the arm"):
        Crowd([DESIGNED], friction=1.0).place(0, *place)


def test_places_converge_where_parts_have_met():
    """One flips towards the other; a quarter of the step at least halves the errors."""
    random, places = np.random.default_rng(3), {}
    starts = [(x, x + gap) for x, gap in zip(random.uniform(6, 9, 12), random.uniform(5, 6, 12), strict=True)]
    for step in (8e-3, 2e-3, 5e-4):
        places[step] = []
        for inner, outer in starts:
            crowd = Crowd([FED, FED], friction=1.0, step=step)
            crowd.place(0, inner, 2)
            crowd.place(1, outer, 0)
            places[step].append([rest.x for rest in crowd.throw()])
            assert crowd.overlapped == {(0, 1)}
    coarse, middle = (np.abs(np.subtract(places[step], places[5e-4])).max(axis=1) for step in (8e-3, 2e-3))
    assert np.median(middle) < 0.5 * np.median(coarse)
    assert np.median(middle) < 0.02  # less than landings scatter
