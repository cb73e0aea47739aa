"""The engine: its motion against closed forms, its effects, a depression, the ground."""

import itertools
import math
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import limitsets as ls
from limitsets.base.errors import AnswerError, MapError
from limitsets.feeder.engine import compare, throw
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.depression import EMPTY, UNFINISHED, Motion, Plate, fall_speed
from limitsets.feeder.engine.member import ground_of
from limitsets.feeder.engine.stage import IDLE, _bounce, _stick, fly, set_up, settle, slides_back
from limitsets.feeder.engine.throwing import accelerate
from tests.feeding.scenes import with_cavity

# ----------------------------------------------------------------
# The engine's throws against the model's formulas, figures known from elsewhere, and textbook mechanics.
# Expected values: docs/model.md's equations written out here, critical points the scenes were designed for, and
# figures found by high-precision computations that share no code with this package.


pytest.importorskip("pymunk")

DESIGNED, INITIAL = ls.load("paper-designed"), ls.load("paper-initial")


def height_of_left_vertex(scene, x, side, phi):
    """f of docs/model.md."""
    a, d = scene.sides.a[side], scene.sides.d[side]
    return x * phi - a * math.sin(phi) + d * (1 - math.cos(phi)) - scene.kappa / 2 * phi**2


@pytest.mark.parametrize("scene", [DESIGNED, INITIAL], ids=["designed", "initial"])
@pytest.mark.parametrize("side", [0, 1, 2])
@pytest.mark.parametrize("beyond", [1e-3, 0.1, 3.0, 12.0])
def test_the_left_vertex_lands_where_the_equation_says(scene, side, beyond):
    x = scene.sides.a[side] + beyond
    landing = throw(scene, x, side, step=0.01)
    assert landing.struck == -side % 3
    assert height_of_left_vertex(scene, x, side, landing.phi) == pytest.approx(0.0, abs=2e-13)
    middles = np.linspace(0.0, landing.phi, 50)[1:-1]
    assert min(height_of_left_vertex(scene, x, side, phi) for phi in middles) > 0.0


@pytest.mark.parametrize(
    ("scene", "side", "r"),
    [(DESIGNED, 0, 10), (DESIGNED, 1, 10), (DESIGNED, 2, 20)] + [(INITIAL, side, 20) for side in range(3)],
)
def test_the_part_flips_from_the_critical_point_on(scene, side, r):
    assert throw(scene, r - 1e-4, side, step=2e-3).side == side
    assert throw(scene, r + 1e-4, side, step=2e-3).side == (side + 1) % 3


@pytest.mark.parametrize(
    ("scene", "side", "x"), [(DESIGNED, 0, 20.1517), (DESIGNED, 1, 26.4235), (INITIAL, 0, 26.9141)]
)
def test_another_vertex_lands_first_from_there_on(scene, side, x):
    assert throw(scene, x - 1e-4, side, step=0.01).struck == -side % 3
    assert throw(scene, x + 1e-4, side, step=0.01).struck == (-side - 1) % 3


def test_the_hinge_is_of_second_order():
    x = np.linspace(5.5, 9.5, 7)
    sizes = []
    for step in (8e-3, 4e-3, 2e-3):
        found = compare(DESIGNED, x, 2, step=step)
        assert found.agree.all()
        sizes.append(np.abs(found.error))
    assert (sizes[-1] < 2e-4).all()
    for coarse, fine in pairwise(sizes):
        assert np.median(coarse / fine) == pytest.approx(4.0, abs=0.5)


def test_unilateral_contact_rests_elsewhere_than_the_hinge():
    assert throw(DESIGNED, 15.0, 2).x == pytest.approx(16.754, abs=6e-4)
    for friction in (1.0, 2.0, 5.0):
        landing = throw(DESIGNED, 15.0, 2, contact="unilateral", friction=friction)
        assert (landing.side, landing.status) == (2, "rest")
        assert 16.9 < landing.x < 17.0


def test_without_friction_nothing_changes_the_way_along_the_arm():
    landing = throw(DESIGNED, 15.0, 2, contact="unilateral", friction=0.0, patience=3.0)
    assert (landing.side, landing.status) == (-1, "unfinished")
    d = DESIGNED.sides.d[2]
    assert landing.x == pytest.approx(15.0 - (DESIGNED.surface_height + d) * landing.time, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.6])
def test_a_vertical_bounce_ends_after_its_zeno_time(restitution):
    """2 v e / (g (1 - e)), the sum of a geometric series."""
    stage = set_up(DESIGNED, 10.0, 2)
    speed, step = 6.0, 2e-4
    stage.body.velocity, stage.body.angular_velocity = (0.0, -speed), 0.0
    time, side, _ = settle(stage, DESIGNED, 1.0, restitution, step, 60.0)
    ends = 2 * speed * restitution / (DESIGNED.kappa * (1 - restitution))
    assert side == 2
    assert time - IDLE == pytest.approx(ends, abs=0.01)


def test_friction_and_restitution_of_the_scene_are_taken_up():
    words = DESIGNED.as_dict()
    words["world"] = {"friction": 0.5, "restitution": 0.2}
    own = throw(ls.load(words), 15.0, 2, contact="unilateral", step=4e-3)
    assert own == throw(DESIGNED, 15.0, 2, contact="unilateral", friction=0.5, restitution=0.2, step=4e-3)
    assert own != throw(DESIGNED, 15.0, 2, contact="unilateral", friction=0.5, step=4e-3)


def test_a_part_left_of_its_vertex_does_not_fly():
    landing = throw(DESIGNED, 4.0, 2)  # a_2 = 4.2256
    assert (landing.status, landing.x, landing.side, landing.struck) == ("no flight", 4.0, 2, -1)
    assert math.isnan(landing.phi)


def test_a_table_of_throws():
    random = np.random.default_rng(5)
    side = random.integers(3, size=60)
    x = random.uniform(INITIAL.sides.a[side], INITIAL.arm_length)
    found = compare(INITIAL, x, side, step=4e-3)
    left = ~found.other_vertex
    assert left.sum() > 50
    assert found.agree[left].all()
    assert np.abs(found.error[left]).max() < 2e-3
    assert set(found.side_engine.tolist()) == {0, 1, 2}


def test_a_missing_engine_is_named_with_its_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pymunk", None)
    with pytest.raises(AnswerError, match=r"pip install 'limitsets\[engine\]'"):
        throw(DESIGNED, 15.0, 2)


def test_wrong_calls_are_refused():
    for words, said in (
        ({"contact": "glue"}, "'hinge' or 'unilateral'"),
        ({"friction": 0.5}, "a hinge has none"),
        ({"contact": "unilateral", "friction": 0.5, "rolls": True}, "rolls anyway"),
        ({"stroke": 1.6}, "0 to pi/2"),
        ({"threshold": -1.0}, "from 0"),
        ({"contact": "unilateral"}, "the friction is None"),
        ({"contact": "unilateral", "friction": -1.0}, "a number from 0"),
        ({"contact": "unilateral", "friction": math.inf}, "a number from 0"),
        ({"contact": "unilateral", "friction": 1.0, "restitution": 1.5}, "0 to 1"),
        ({"step": 0.0}, "above 0"),
    ):
        with pytest.raises(AnswerError, match=said):
            throw(DESIGNED, 15.0, 2, **words)


def test_sides_that_do_not_fit_the_part_or_the_starts():
    with pytest.raises(MapError, match="from 0 to 2"):
        throw(DESIGNED, 15.0, 3)
    with pytest.raises(AnswerError, match="a side per start"):
        compare(DESIGNED, [8.0, 9.0], [0, 1, 2])


# ----------------------------------------------------------------
# Rolling, bouncing, strokes and unilateral contact in the engine, against mechanics written out here.


@pytest.mark.parametrize("x", [19.0, 19.5, 19.95])
def test_jogs_on_side_1_of_the_initial_scene_roll_back(x):
    """Known of that scene: with a plastic second impact every one of them, and it has the energy for it."""
    assert throw(INITIAL, x, 1).side == 1
    rolled = throw(INITIAL, x, 1, rolls=True)
    assert (rolled.side, rolled.status) == (0, "rest")
    # turned clockwise about the right vertex, which stays
    right = INITIAL.sides.length[1] - INITIAL.sides.a[1]
    assert rolled.x - throw(INITIAL, x, 1).x == pytest.approx(right + INITIAL.sides.a[0], abs=1e-3)


@pytest.mark.parametrize("scene", [DESIGNED, INITIAL], ids=["designed", "initial"])
@pytest.mark.parametrize("side", [0, 1, 2])
def test_the_second_impact_of_a_rocking_part(scene, side):
    """Housner: omega' = omega [rho^2 + d^2 - a (L - a)] / M' about the other end."""
    a, d, length = (float(getattr(scene.sides, name)[side]) for name in ("a", "d", "length"))
    rho2, omega = scene.radius_of_gyration**2, -1.7
    stage = set_up(scene, 15.0, side)
    stage.body.angular_velocity, stage.body.velocity = omega, (-omega * d, omega * a)  # about the left end
    _stick(stage, (1 - side) % 3)
    wanted = omega * (rho2 + d * d - a * (length - a)) / (rho2 + d * d + (length - a) ** 2)
    assert stage.body.angular_velocity == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("restitution", [0.2, 0.7, 1.0])
def test_a_bounce_gives_back_a_share_of_the_impulse(restitution):
    """Poisson's law without slip, by the 2 x 2 system of the contact's velocities."""
    random = np.random.default_rng(4)
    for _ in range(20):
        stage = set_up(DESIGNED, 15.0, 2)
        body, rho2 = stage.body, DESIGNED.radius_of_gyration**2
        body.angle = random.uniform(-math.pi, math.pi)
        body.velocity, body.angular_velocity = tuple(random.normal(size=2) * 5), random.normal() * 2
        vertex = int(random.integers(3))
        x, h = body.position - body.local_to_world(stage.corners[vertex])
        a, b, c = 1 + h * h / rho2, -x * h / rho2, 1 + x * x / rho2
        before = [body.velocity.x + body.angular_velocity * h, body.velocity.y - body.angular_velocity * x]
        push = np.linalg.solve([[a, b], [b, c]], np.negative(before))[1]
        lift = restitution * push * (c - b * b / a)
        found = _stick(stage, vertex)
        assert found == pytest.approx(push, abs=1e-8)
        assert _bounce(stage, vertex, restitution * found, 0.0) == (push > 0)
        after = body.velocity_at_world_point(body.local_to_world(stage.corners[vertex]))
        assert tuple(after) == pytest.approx((0.0, max(lift, 0.0)), abs=1e-8)


def test_a_bounce_below_the_threshold_is_none():
    stage = set_up(DESIGNED, 15.0, 2)
    lift = 2.0
    height = lift**2 / (2 * DESIGNED.kappa)
    for threshold, bounces in ((0.99 * height, True), (1.01 * height, False)):
        stage.body.velocity, stage.body.angular_velocity = (0.0, 0.0), 0.0
        impulse = lift * _stick(stage, 1, 1.0)
        stage.body.velocity, stage.body.angular_velocity = (0.0, 0.0), 0.0
        assert _bounce(stage, 1, impulse, threshold) == bounces


def test_a_stroke_ends_with_a_turn_at_rate_1():
    """At first order in the step, without slip: friction 1 holds the part on this arm."""
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        stage = set_up(DESIGNED, 20.0, 2)
        high = DESIGNED.surface_height + float(DESIGNED.sides.d[2])
        accelerate(stage, 0.2, 1.0, step)
        body = stage.body
        assert body.angle == pytest.approx(stage.flat[2], abs=1e-6)
        assert body.angular_velocity == pytest.approx(1.0, abs=1e-6)
        assert body.velocity.x == pytest.approx(-high, abs=1e-3)
        errors.append(abs(body.position.x - 20.0) + abs(body.position.y - high))
    assert errors[-1] < 1e-3
    assert errors[0] / errors[2] == pytest.approx(4.0, abs=1.0)
    gravity = -DESIGNED.kappa * np.array([math.sin(0.2), math.cos(0.2)])
    assert tuple(stage.space.gravity) == pytest.approx(tuple(gravity))


@pytest.mark.parametrize(
    ("friction", "back"), [(0.1, True), (0.5, True), (0.54, True), (0.6, False), (1.0, False)]
)
def test_when_an_impact_slides_back(friction, back):
    """x = 14.15, side 2: X 2.285, H 3.625, so |B| = 5.30 and A = 9.41; the vertex strikes while it slides right.

    mu A < |B| up to mu = 0.563; the impulse that stops it lies outside the cone of 0.5, and in that of 0.54.
    """
    stage = set_up(DESIGNED, 14.1501654661399, 2)
    fly(stage, 60.0)
    assert slides_back(stage, stage.body.velocity, stage.body.angular_velocity, friction) == back


def test_what_is_seen_of_unilateral_contact():
    how = {"contact": "unilateral", "restitution": 0.0}
    good = throw(DESIGNED, 15.0, 2, friction=1.0, **how)
    assert good.residual < 1e-4
    # friction 5 presses the sliding vertex: mu |X H| > rho^2 + X^2, where alternating impulses do not converge
    assert throw(DESIGNED, 17.0, 1, friction=5.0, **how).residual > 0.1
    assert throw(DESIGNED, 17.36, 0, friction=1.0, **how).rocks
    assert throw(DESIGNED, 14.15, 2, friction=0.5, **how).reverses


# ----------------------------------------------------------------
# One part and one depression: free fall, impact, friction and rest by textbook mechanics.


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


@pytest.mark.parametrize(("beyond", "falls"), [(20.0, False), (0.2, False), (-0.2, True)])
def test_a_part_tips_in_when_its_centre_of_mass_is_over_the_depression(beyond, falls):
    flat = plate()
    seat = flat.seated(2)
    rest = flat.settle(seat._replace(x=0.5 * WIDTH + beyond, y=seat.y + DEPTH), STILL)
    assert (rest.state > EMPTY) == falls
    if not falls:
        assert (rest.state, rest.side) == (EMPTY, 2)
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


# ----------------------------------------------------------------
# The ground in the engine: its surface is that of the scene.


def surface(ground, x):
    """Height of the highest polygon over a place, by the line of its upper side there."""
    heights = []
    for corners in ground.polygons:
        for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if min(x0, x1) <= x <= max(x0, x1) and x0 != x1:
                heights.append(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
    return max(heights)


@pytest.mark.parametrize("depth", ["5 in", "5.8633 in"])
def test_the_cavity_is_that_of_the_scene(depth):
    """The arm, a ramp of slope tan(angle), a floor where the ramp ends before the wall, the wall."""
    scene = with_cavity(depth=depth)
    ground, cavity = ground_of(scene), scene.cavity
    assert surface(ground, 19.9) == scene.surface_height
    for along in (0.5, 4.0, 7.0):
        down = along * math.tan(cavity.angle)
        assert surface(ground, 20.0 + along) == pytest.approx(scene.surface_height - down, abs=1e-12)
    assert surface(ground, 29.29) == pytest.approx(scene.surface_height - cavity.depth, abs=7e-3)
    assert surface(ground, 29.4) > scene.surface_height + 6.75
    if depth == "5 in":
        assert surface(ground, 28.2) == scene.surface_height - 5.0


def test_depressions_are_cut_into_the_arm():
    ground = ground_of(ls.load("paper-designed"), depressions=[(15.0, 7.0, 1.5), (2.0, 7.0, 1.0)])
    heights = [round(surface(ground, x), 9) for x in (1.0, 5.0, 12.0, 18.0, 25.0)]
    assert heights == [-0.2, -1.2, -0.2, -1.7, -0.2]
    assert [ground.is_arm(x) for x in (1.0, 5.0, 12.0)] == [True, False, True]
    solid = [piece.corners.tolist() for piece in ground.pieces]
    pairs = [(one, two) for k, one in enumerate(solid) for two in solid[:k]]
    assert max(depth_of_overlap(*pair) for pair in pairs) <= 1e-12


@pytest.mark.parametrize("wrong", [[(2.0, 7.0, 1.0), (8.0, 7.0, 1.0)], [(25.0, 7.0, 1.0)], [(2.0, 7.0, 0.0)]])
def test_depressions_that_cannot_be_are_refused(wrong):
    with pytest.raises(AnswerError, match="one after the other"):
        ground_of(ls.load("paper-designed"), depressions=wrong)
