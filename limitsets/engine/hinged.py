"""A struck vertex held by a joint: turning to a face, rolling on over its other end, and bouncing without slip.

The joint acts within the step, so the solver finds the plastic impact by itself.
"""

from __future__ import annotations

import math

from limitsets.engine.flying import fly
from limitsets.engine.stage import Stage, pymunk_module

# Farther than this [rad] from a face that a part may already lie on, to rounding.
LEANING = 0.02
# Less than this share of the energy that lifts the part by its own size cannot lift it over a vertex.
ROCKING = 1e-4
# Vertices lower than this fraction of the part's size touch the arm.
TOUCHING = 1e-7


def turn_on_hinge(stage: Stage, struck: int, step: float, patience: float) -> tuple[float, int]:
    """Hold a vertex that sticks until a face lies on the arm: time and side, -1 where patience ends first.

    What it leaves is the velocity at that moment, to second order in the step.
    """
    pymunk, space, body = pymunk_module(), stage.space, stage.body
    count = len(stage.flat)
    clockwise, counter = -struck % count, (1 - struck) % count
    # The angles between which no face is down; a face may already lie there, to rounding.
    leaning = (body.angle - stage.flat[clockwise] + LEANING) % math.tau - LEANING
    low = body.angle - leaning
    high = low + (stage.flat[counter] - stage.flat[clockwise]) % math.tau

    place = tuple(body.local_to_world(stage.corners[struck]))
    catch, joint = (pymunk.PivotJoint(space.static_body, body, place) for _ in range(2))
    catch.error_bias = 1.0  # nothing to correct yet, and rounding is not to be divided by an instant
    joint.error_bias = 0.0  # all of the drift is corrected in the next step
    stage.kick(0.5 * step)  # as in `drift`: the velocity of the middle of each step, here within the joint
    stage.strike(catch)
    space.add(joint)

    time, gain = 0.0, 0.0
    while time <= patience:
        angle, rate = body.angle, body.angular_velocity
        if low < angle + rate * step < high:
            space.step(step)
            time += step
            gain = body.angular_velocity - rate
            continue
        target, side = (low, clockwise) if rate < 0.0 else (high, counter)
        last = max((target - angle) / rate, 0.0) if rate else 0.0
        space.step(last)  # a step turns by rate times its length
        space.remove(joint)
        # the rate is that of half a step later
        _turn_about(stage, place, body.angular_velocity - 0.5 * gain)
        return time + last, side
    space.remove(joint)
    return time, -1


def _turn_about(stage: Stage, place: tuple[float, ...], rate: float) -> None:
    across, up = stage.body.position.x - place[0], stage.body.position.y - place[1]
    stage.body.angular_velocity, stage.body.velocity = rate, (-rate * up, rate * across)


def _stick(stage: Stage, vertex: int, lift: float = 0.0) -> float:
    """Let a joint give a vertex a velocity straight up, or stop it: the normal impulse that takes."""
    pymunk, space, body = pymunk_module(), stage.space, stage.body
    before = body.velocity.y
    place = tuple(body.local_to_world(stage.corners[vertex]))
    carrier = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
    carrier.position, carrier.velocity = place, (0.0, lift)
    catch = pymunk.PivotJoint(carrier, body, place)
    catch.error_bias = 1.0  # nothing to correct yet
    space.add(carrier)
    stage.strike(catch)
    space.remove(carrier)
    return float(body.velocity.y - before)


def _bounce(stage: Stage, vertex: int, impulse: float, threshold: float) -> bool:
    """Give back a normal impulse to a vertex that does not slip; False, and nothing, if it would hardly rise."""
    body = stage.body
    stuck = body.velocity, body.angular_velocity
    lift = impulse / _stick(stage, vertex, 1.0)  # what the joint takes grows with the lift in proportion
    body.velocity, body.angular_velocity = stuck
    if lift <= 0.0 or lift * lift <= 2.0 * stage.kappa * threshold:
        return False
    _stick(stage, vertex, lift)
    return True


def _lands(stage: Stage) -> int:
    """Which vertex strikes: of those that touch the arm the one that comes down fastest."""
    body = stage.body
    heights = [body.local_to_world(corner).y - stage.height for corner in stage.corners]
    touch = [k for k, height in enumerate(heights) if height < min(heights) + TOUCHING * stage.size]
    rates = [body.velocity_at_world_point(body.local_to_world(stage.corners[k])).y for k in touch]
    return touch[rates.index(min(rates))]


def turn_and_roll(
    stage: Stage, struck: int, rolls: bool, bounce: tuple[float, float], step: float, patience: float
) -> tuple[float, int]:
    """Follow impacts of one vertex after the other until the part rests: time and side, -1 where it does not.

    `bounce` is Poisson's restitution and the height below which a bounce is none.
    """
    body, time, vertex, face, down = stage.body, 0.0, struck, -1, 0.0
    restitution, threshold = bounce
    while time <= patience:
        came = down if face >= 0 else 0.0
        impulse = _stick(stage, vertex)
        if restitution > 0.0 and _bounce(stage, vertex, restitution * impulse, threshold):
            time += fly(stage, patience)
            vertex, face = _lands(stage), -1
            continue
        if face >= 0:
            moving = body.angular_velocity * came > 0.0
            if not rolls or not moving or body.kinetic_energy < ROCKING * stage.kappa * stage.size:
                return time, face
        took, face = turn_on_hinge(stage, vertex, step, patience - time)
        time += took
        if face < 0:
            break
        down = body.angular_velocity
        left, right = -face % len(stage.flat), (1 - face) % len(stage.flat)
        vertex = right if vertex == left else left
    return time, -1
