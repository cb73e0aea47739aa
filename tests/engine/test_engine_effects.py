"""Rolling, bouncing, strokes and unilateral contact in the engine, against mechanics written out here."""

import math

import numpy as np
import pytest

import limitsets as ls
from limitsets.feeder.engine import throw

pytest.importorskip("pymunk")

from limitsets.feeder.engine.stage import _bounce, _stick, set_up, slides_back
from limitsets.feeder.engine.throwing import accelerate

DESIGNED, INITIAL = ls.load("paper-designed"), ls.load("paper-initial")


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
    from limitsets.feeder.engine.stage import fly

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
