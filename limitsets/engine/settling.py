"""Unilateral contact in the engine: a part that is pushed, slips and bounces until it lies still."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from limitsets.engine.stage import Stage, pymunk_module

if TYPE_CHECKING:
    from limitsets.scene import Scene

__all__ = ["IDLE", "settle", "slides_back"]

# For this long [rad] the part has to be idle, by the engine's own measure, before it is taken to rest.
IDLE = 0.5
# Farther from flat than this [rad] an idle part leans or stands on a vertex.
LEANING = 0.02
# What contacts may overlap for good, as a fraction of the part's size: without any they would come and go.
OVERLAP = 1e-4
# Of the overlap beyond that so much is taken back in each step, without adding to the velocity.
TAKEN_BACK = 0.2
# Two contacts with friction on one body; more change nothing.
ITERATIONS = 40


def slides_back(stage: Stage, vertex: int, friction: float) -> bool:
    """Whether Routh's path stops the sliding of a vertex that strikes now and then sets it sliding the other way.

    Signorini's and Coulomb's laws for the whole impulse, which the engine solves, have friction against the last
    sliding alone.  Notation of docs/model.md: A, B, C say what an impulse at the vertex does to its velocity.
    """
    body, place = stage.body, stage.body.local_to_world(stage.corners[vertex])
    right, high = body.position.x - place.x, body.position.y - place.y
    rho2 = float(body.moment)
    a, b, c = 1.0 + high * high / rho2, -right * high / rho2, 1.0 + right * right / rho2
    along, off = body.velocity_at_world_point(place)
    push = (b * along / a - off) / (c - b * b / a)
    if push > 0.0 and abs(along + b * push) <= friction * a * push:  # friction can hold the vertex
        return False
    stop = abs(along) / (friction * a + abs(b))
    return abs(b) > friction * a and along * b < 0.0 and off + (c + friction * abs(b)) * stop < 0.0


def settle(
    stage: Stage, scene: Scene, friction: float, restitution: float, step: float, patience: float
) -> tuple[float, int, float]:
    """Let the engine's contact bring the part to rest: time, side (-1 where patience ends first) and residual."""
    pymunk, space, body, size = pymunk_module(), stage.space, stage.body, stage.size
    far = 4.0 * (scene.arm_length + size)
    # As thick as the part is long: it never comes out on the other side.
    low = stage.height - size
    arm = pymunk.Segment(space.static_body, (-far, low), (far, low), size)
    arm.friction = arm.elasticity = 1.0  # the engine takes products
    stage.part.friction, stage.part.elasticity = friction, restitution
    space.iterations = ITERATIONS
    space.collision_slop = OVERLAP * size
    space.collision_bias = (1.0 - TAKEN_BACK) ** (1.0 / step)
    short = [0.0]
    space.on_collision(post_solve=lambda arbiter, _space, _data: _watch(arbiter, body, friction, short))
    stage.strike(arm)  # where the vertex is: a whole step would first move it through the arm
    space.add(arm)
    space.sleep_time_threshold = IDLE

    time = 0.0
    while time <= patience and not body.is_sleeping:
        space.step(step)
        time += step
    off = [abs(math.remainder(body.angle - flat, math.tau)) for flat in stage.flat]
    side = off.index(min(off))
    at_rest = body.is_sleeping and off[side] < LEANING
    return time, side if at_rest else -1, short[0] / (stage.kappa * size)


def _watch(arbiter: Any, body: Any, friction: float, short: list[float]) -> None:
    """Add the energy that a contact which slides should have lost and has not."""
    points = arbiter.contact_point_set.points
    along = sum(body.velocity_at_world_point(point.point_a).x for point in points) / len(points)
    drag, push = arbiter.total_impulse
    short[0] += abs(along) * abs(friction * abs(push) - abs(drag))
