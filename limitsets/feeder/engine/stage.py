"""A part over the arm in the engine: bodies, time steps, flight, the joint at a struck vertex, contact until it lies.

Lengths are those of the scene; the unit of time is 1/w, so that the arm turns at rate 1, gravity is kappa, and a time
in flight is the angle by which the part has turned.  Mass 1; the joint is the origin.

The engine's step moves the part with its present velocity and then changes the velocity (symplectic Euler, first
order). With the velocity at the middle of the step, as in `Stage.drift`, it is exact for a parabola and a steady turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeAlias

from limitsets.base import AnswerError
from limitsets.feeder.geometry import side_ends

if TYPE_CHECKING:
    from pymunk import Body, Poly, Segment, Shape, Space

    from limitsets.feeder.scene import Scene


INSTANT = 1e-12
"""A step as short as this lets the solver act and moves nothing."""
OVERLAP = 1e-4
"""What contacts may overlap for good, as a fraction of the part's size: without any they would come and go."""
# Of the overlap beyond that so much is taken back in each step, without adding to the velocity.
TAKEN_BACK = 0.2
# Two contacts with friction on one body; more change nothing.
ITERATIONS = 40

State: TypeAlias = tuple[Any, float, Any]


def pymunk_module() -> ModuleType:
    """Import the engine.

    Raises
    ------
    AnswerError
        pymunk is not installed.
    """
    try:
        import pymunk
    except ImportError as error:
        remedy = "pip install 'limitsets[engine]', or pip install pymunk"
        raise AnswerError("the rigid-body engine", "not installed", "pymunk", remedy) from error
    return pymunk


def check_contact(contact: str, restitution: float, step: float, most: float) -> None:
    """Refuse what no contact in the engine can be; `most`: of the step."""
    if contact not in ("hinge", "unilateral"):
        raise AnswerError("the contact", contact, "'hinge' or 'unilateral'", "choose one")
    if not 0.0 <= restitution <= 1.0:
        remedy = "pass restitution=0 for a plastic contact"
        raise AnswerError("the restitution", restitution, "0 to 1", remedy)
    if not 0.0 < step <= most:
        remedy = "pass step=1e-3"
        raise AnswerError("the engine's step", step, f"above 0 and at most {most:g} rad", remedy)


@dataclass(frozen=True)
class Stage:
    """One part in a space of its own.

    Attributes
    ----------
    space, body, part : pymunk.Space, pymunk.Body, pymunk.Poly
        The engine's objects.
    corners : tuple of pairs
        Vertices about the centre of mass, in the scene's order [length].
    flat : tuple of float
        The body's angle when it rests on each side [rad].
    height, kappa : float
        Of the arm's surface over the joint, and gravity [length].
    size : float
        Length of the longest side [length].
    """

    space: Space
    body: Body
    part: Poly
    corners: tuple[tuple[float, float], ...]
    flat: tuple[float, ...]
    height: float
    kappa: float
    size: float

    def kick(self, time: float) -> None:
        """Give the velocity that gravity adds in `time`, which may be negative."""
        (across, up), (along, down) = self.body.velocity, self.space.gravity
        self.body.velocity = (across + along * time, up + down * time)

    def drift(self, time: float) -> None:
        """Fly freely, from the velocity at the start of the step to that at its end."""
        self.kick(0.5 * time)
        self.space.step(time)
        self.kick(-0.5 * time)

    def gap(self) -> float:
        """Height of the part's lowest point over the arm."""
        return float(self.part.cache_bb().bottom) - self.height

    def lowest(self) -> int:
        """Which vertex is lowest."""
        heights = [self.body.local_to_world(corner).y for corner in self.corners]
        return heights.index(min(heights))

    def strike(self, against: Any) -> None:
        """Let the solver answer a joint or a shape within an instant.

        It is taken away again: the engine starts each step from the impulses of the last one, in proportion to the
        steps' lengths, and an impact is no force that goes on.
        """
        self.space.add(against)
        self.space.step(INSTANT)
        self.space.remove(against)

    def arm(self, on: Body, far: float, friction: float, restitution: float, step: float) -> Segment:
        """Make the arm's surface, as far as that from the joint, and let it meet the part in steps of this length.

        It is as thick as the part is long, which so never comes out on the other side.
        """
        low = self.height - self.size
        arm: Segment = pymunk_module().Segment(on, (-far, low), (far, low), self.size)
        self.meet([arm], friction, restitution, step)
        return arm

    def meet(self, ground: Sequence[Shape], friction: float, restitution: float, step: float) -> None:
        """Let shapes of the ground meet the part with this friction and restitution, in steps of this length."""
        for shape in ground:
            shape.friction = shape.elasticity = 1.0  # the engine takes products
        self.part.friction, self.part.elasticity = friction, restitution
        self.space.iterations = ITERATIONS
        self.space.collision_slop = OVERLAP * self.size
        self.space.collision_bias = (1.0 - TAKEN_BACK) ** (1.0 / step)

    def state(self) -> State:
        """Remember where the part is in flight; its rate of turning does not change."""
        return self.body.position, self.body.angle, self.body.velocity

    def restore(self, state: State) -> None:
        """Go back to a remembered state."""
        self.body.position, self.body.angle, self.body.velocity = state


def set_up(scene: Scene, x: float, side: int) -> Stage:
    """Put a part on the arm at the moment of release: it has the velocity of a turn at rate 1 about the joint."""
    pymunk = pymunk_module()
    height, d = scene.surface_height, float(scene.sides.d[side])
    ends = (side_ends(len(scene.vertices), each) for each in range(len(scene.vertices)))
    sides = ((scene.vertices[right] - scene.vertices[left]).tolist() for left, right in ends)
    flat = tuple(-math.atan2(up, along) for along, up in sides)
    corners = tuple((across, up) for across, up in (scene.vertices - scene.centre).tolist())
    body = pymunk.Body(1.0, scene.radius_of_gyration**2)
    body.angle = flat[side]
    body.position = (x, height + d)
    body.velocity = (-(height + d), x)
    body.angular_velocity = 1.0
    part = pymunk.Poly(body, corners)
    space = pymunk.Space()
    space.gravity = (0.0, -scene.kappa)
    space.add(body, part)
    size = float(scene.sides.length.max())
    return Stage(space, body, part, corners=corners, flat=flat, height=height, kappa=scene.kappa, size=size)


# ----------------------------------------------------------------
# A flight in the engine, exact for every step size, until a vertex meets the arm.


# Between steps of this size [rad] a vertex must not touch and rise again.
FLIGHT_STEP = 2.0**-7
# Shorter flights than this [rad] are lost in the rounding of heights.
SHORTEST = 1e-9


def fly(stage: Stage, patience: float) -> float:
    """Fly until the part's lowest point is on the arm; the time, 0 where it never leaves the arm."""
    from scipy.optimize import brentq

    before, length = stage.state(), FLIGHT_STEP
    stage.drift(length)
    while stage.gap() <= 0.0:  # a short flight: first find a moment in the air
        length *= 0.5
        if length < SHORTEST:
            return 0.0
        stage.restore(before)
        stage.drift(length)
    flown = length
    before = stage.state()
    stage.drift(FLIGHT_STEP)
    while stage.gap() > 0.0:
        flown += FLIGHT_STEP
        if flown > patience:
            return flown
        before = stage.state()
        stage.drift(FLIGHT_STEP)

    def gap_after(time: float) -> float:
        stage.restore(before)
        stage.drift(time)  # the engine takes a step of 0 as none
        return stage.gap()

    time = float(brentq(gap_after, 0.0, FLIGHT_STEP, xtol=1e-14))
    gap_after(time)
    return flown + time


# ----------------------------------------------------------------
# A struck vertex held by a joint: turning to a face, rolling on over its other end, and bouncing without slip.
#
# The joint acts within the step, so the solver finds the plastic impact by itself.


# Farther than this [rad] from a face that a part may already lie on, to rounding.
LEANING = 0.02
# Less than this share of the energy that lifts the part by its own size cannot lift it over a vertex.
ROCKING = 1e-4
# Vertices lower than this fraction of the part's size touch the arm.
AS_LOW = 1e-7


def faces_about(flat: Sequence[float], vertex: int, angle: float) -> tuple[tuple[int, int], float, float]:
    """Give the sides that come down about a vertex, and the angles between which neither is down.

    A face may already lie there, to rounding.
    """
    faces = -vertex % len(flat), (1 - vertex) % len(flat)
    clockwise, counter = (flat[face] for face in faces)
    low = angle - ((angle - clockwise + LEANING) % math.tau - LEANING)
    return faces, low, low + (counter - clockwise) % math.tau


def turn_on_hinge(stage: Stage, struck: int, step: float, patience: float) -> tuple[float, int]:
    """Hold a vertex that sticks until a face lies on the arm: time and side, -1 where patience ends first.

    What it leaves is the velocity at that moment, to second order in the step.
    """
    pymunk, space, body = pymunk_module(), stage.space, stage.body
    (clockwise, counter), low, high = faces_about(stage.flat, struck, body.angle)

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
    touch = [k for k, height in enumerate(heights) if height < min(heights) + AS_LOW * stage.size]
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
        impulse = _stick(stage, vertex)
        if restitution > 0.0 and _bounce(stage, vertex, restitution * impulse, threshold):
            time += fly(stage, patience)
            vertex, face = _lands(stage), -1
            continue
        if face >= 0:
            moving = body.angular_velocity * down > 0.0
            if not rolls or not moving or body.kinetic_energy < ROCKING * stage.kappa * stage.size:
                return time, face
        took, face = turn_on_hinge(stage, vertex, step, patience - time)
        time += took
        if face < 0:
            break
        down = body.angular_velocity
        left, right = side_ends(len(stage.flat), face)
        vertex = right if vertex == left else left
    return time, -1


# ----------------------------------------------------------------
# Unilateral contact in the engine: a part that is pushed, slips and bounces until it lies still.


# For this long [rad] the part has to be idle, by the engine's own measure, before it is taken to rest.
IDLE = 0.5
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
            seen.rocks |= rises and nearest(body.angle, stage.flat)[1] < LEANING
    side, off = nearest(body.angle, stage.flat)
    seen.residual /= stage.kappa * size
    return time, side if body.is_sleeping and off < LEANING else -1, seen


def nearest(angle: float, flat: Sequence[float]) -> tuple[int, float]:
    """Find the side that is nearest to lie on, and by which angle it is off."""
    off = [abs(math.remainder(angle - each, math.tau)) for each in flat]
    return off.index(min(off)), min(off)


def _watch(arbiter: Any, body: Any, friction: float, seen: Seen) -> None:
    """Add the energy that a sliding contact should have lost and has not, and what moves it on into the arm."""
    if body.kinetic_energy < STILL:  # most steps of a throw are those of a part that lies
        return
    velocities = [body.velocity_at_world_point(point.point_a) for point in arbiter.contact_point_set.points]
    along = sum(velocity.x for velocity in velocities) / len(velocities)
    into = min(min(velocity.y for velocity in velocities), 0.0)
    drag, push = arbiter.total_impulse
    seen.residual += abs(along) * abs(friction * abs(push) - abs(drag)) + 0.5 * into * into
