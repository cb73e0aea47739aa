"""The throw by a stroke in the engine: an arm that turns with constant angular acceleration, and stops."""

from __future__ import annotations

import math
from typing import Any

from limitsets.engine.stage import INSTANT, OVERLAP, Stage, pymunk_module

# Steps of a stroke to one of the way to rest; contact is of first order in them.
FINER = 0.5


def accelerate(stage: Stage, stroke: float, friction: float, step: float) -> None:
    """Turn the arm under the part until it is level, at rate 1 then, and take it away: it has stopped.

    All is seen by the arm as it stops; gravity leans towards the joint.
    """
    pymunk, space, body = pymunk_module(), stage.space, stage.body
    sine, cosine = math.sin(stroke), math.cos(stroke)
    space.gravity = (-stage.kappa * sine, -stage.kappa * cosine)
    # The overlap is more than the steps' straight ways lift the part.
    across, up = body.position.x, body.position.y - 0.5 * OVERLAP * stage.size
    body.position = (across * cosine + up * sine, up * cosine - across * sine)
    body.angle -= stroke

    steps = math.ceil(2.0 * stroke / (FINER * step))
    time = 2.0 * stroke / steps
    gain = time / (2.0 * stroke)
    arm = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    arm.angle, arm.angular_velocity = -stroke, 0.5 * gain
    surface = stage.arm(arm, 4.0 * (across + stage.size), friction, 0.0, time)
    gains = [gain] * (steps - 1) + [0.5 * gain]  # each step moves by the velocity of its middle

    def turn_faster(arm: Any, _gravity: Any, _damping: float, _time: float) -> None:
        if gains:
            arm.angular_velocity += gains.pop()

    body.angular_velocity = 0.5 * gain
    body.velocity = (-0.5 * gain * body.position.y, 0.5 * gain * body.position.x)
    space.add(arm, surface)
    gains.reverse()
    arm.velocity_func = turn_faster
    for _ in range(steps):
        space.step(time)
    space.step(INSTANT)
    space.remove(arm, surface)
    body.position += (0.0, -stage.gap())  # what the contact overlaps
