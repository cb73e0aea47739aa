"""Unilateral contact in the engine: a part that is pushed, slips and bounces until it lies still."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from limitsets.engine.stage import Stage

if TYPE_CHECKING:
    from limitsets.scene import Scene

# For this long [rad] the part has to be idle, by the engine's own measure, before it is taken to rest.
IDLE = 0.5
# Farther from flat than this [rad] an idle part leans or stands on a vertex.
LEANING = 0.02
# A change of velocity in one step beyond this share of a fall by the part's size is an impact.
SUDDEN = 0.02
# Of a part of mass 1 with less energy than this nothing is worth watching [length squared].
STILL = 1e-9
# Vertices lower than this fraction of the part's size touch the arm.
TOUCHING = 1e-3


@dataclass
class Seen:
    """What is noticed on the way to rest; see `Landing` for what it means."""

    residual: float = 0.0
    reverses: bool = False
    rocks: bool = False


def slides_back(stage: Stage, velocity: Any, rate: float, friction: float) -> bool:
    """Whether Routh's path stops the sliding of the vertex that strikes now and then sets it sliding the other way.

    Signorini's and Coulomb's laws for the whole impulse, which the engine solves, have friction against the last
    sliding alone; where the impulse that stops the vertex lies in the cone, there it stops.  Notation of docs/model.md:
    A, B, C say what an impulse at the vertex does to its velocity.
    """
    body = stage.body
    arms = [body.position - body.local_to_world(corner) for corner in stage.corners]
    low = min(body.position.y - stage.height, max(arm.y for arm in arms)) - TOUCHING * stage.size
    off, right, high = min((velocity.y - rate * arm.x, arm.x, arm.y) for arm in arms if arm.y > low)
    along, rho2 = velocity.x + rate * high, float(body.moment)
    a, b, c = 1.0 + high * high / rho2, -right * high / rho2, 1.0 + right * right / rho2
    stop = abs(along) / (friction * a + abs(b))
    return abs(b) > friction * a and along * b < 0.0 and off + (c + friction * abs(b)) * stop < 0.0


def settle(
    stage: Stage, scene: Scene, friction: float, restitution: float, step: float, patience: float
) -> tuple[float, int, Seen]:
    """Let the engine's contact bring the part to rest: time, side (-1 where patience ends first), and what was seen."""
    space, body, size = stage.space, stage.body, stage.size
    arm = stage.arm(space.static_body, 4.0 * (scene.arm_length + size), friction, restitution, step)
    seen, sudden = Seen(), SUDDEN * math.sqrt(stage.kappa * size)
    space.on_collision(post_solve=lambda arbiter, _space, _data: _watch(arbiter, body, friction, seen))
    seen.reverses = slides_back(stage, body.velocity, body.angular_velocity, friction)
    stage.strike(arm)  # where the vertex is: a whole step would first move it through the arm
    space.add(arm)
    space.sleep_time_threshold = IDLE

    time = 0.0
    while time <= patience and not body.is_sleeping:
        velocity, rate = body.velocity, body.angular_velocity
        space.step(step)  # it moves the part first
        time += step
        if (body.velocity - velocity).length + size * abs(body.angular_velocity - rate) > sudden:
            seen.reverses |= slides_back(stage, velocity, rate, friction)
            rises = body.angular_velocity * rate > 0.0 and size * abs(body.angular_velocity) > sudden
            seen.rocks |= rises and min(_leaning(stage)) < LEANING
    off = _leaning(stage)
    side = off.index(min(off))
    at_rest = body.is_sleeping and off[side] < LEANING
    seen.residual /= stage.kappa * size
    return time, side if at_rest else -1, seen


def _leaning(stage: Stage) -> list[float]:
    """By which angle each side is off the arm."""
    return [abs(math.remainder(stage.body.angle - flat, math.tau)) for flat in stage.flat]


def _watch(arbiter: Any, body: Any, friction: float, seen: Seen) -> None:
    """Add the energy that a sliding contact should have lost and has not, and what moves it on into the arm."""
    if body.kinetic_energy < STILL:  # most steps of a throw are those of a part that lies
        return
    velocities = [body.velocity_at_world_point(point.point_a) for point in arbiter.contact_point_set.points]
    along = sum(velocity.x for velocity in velocities) / len(velocities)
    into = min(min(velocity.y for velocity in velocities), 0.0)
    drag, push = arbiter.total_impulse
    seen.residual += abs(along) * abs(friction * abs(push) - abs(drag)) + 0.5 * into * into
