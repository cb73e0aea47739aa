"""One throw in the engine: flight, the first contact, and the way to rest by a hinge or by the engine's own contact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from limitsets.engine.stage import Stage, pymunk_module, set_up
from limitsets.errors import AnswerError, MapError

if TYPE_CHECKING:
    from limitsets.scene import Scene

__all__ = ["Landing", "throw"]

# A flight is exact whatever the step; between steps of this size [rad] a vertex must not touch and rise again.
FLIGHT_STEP = 2.0**-7
# Shorter flights than this [rad] are lost in the rounding of heights.
SHORTEST = 1e-9
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


@dataclass(frozen=True)
class Landing:
    """Where one throw ended in the engine.

    Attributes
    ----------
    x : float
        Distance of the centre of mass along the arm [scene's unit].
    side : int
        On which side; -1 where it did not come to rest.
    status : str
        ``"rest"``; ``"no flight"``: it met the arm at once, and x and side are those it started from;
        ``"unfinished"``: it was still in motion, or leaning, when patience ended.
    struck : int
        Vertex that met the arm first, as numbered in the scene's vertices; -1 where none did.
    phi : float
        By how much the part had turned then [rad]; nan where it did not.
    time : float
        From release to rest, times the angular speed of the throw [rad].
    """

    x: float
    side: int
    status: str
    struck: int
    phi: float
    time: float


def throw(
    scene: Scene,
    x: float,
    side: int,
    *,
    contact: str = "hinge",
    friction: float | None = None,
    restitution: float | None = None,
    step: float = 1e-3,
    patience: float = 60.0,
) -> Landing:
    """Throw a part once in the engine.

    It is released at rest on its side with the velocity of a rigid turn about the joint and flies by gravity alone.
    Whichever vertex meets the arm first is struck; the map asks only for the left one.

    Parameters
    ----------
    scene : Scene
        The scene; of its flight and flip nothing is used.
    x : float
        Where the part rests before the throw [scene's unit].
    side : int
        On which side.
    contact : str
        ``"hinge"``: the struck vertex stays where it is, by a pivot joint, until a face lies on the arm: the minimal
        model.  ``"unilateral"``: the engine's own contact, which pushes, slips and bounces, until the part lies still.
    friction, restitution : float, optional
        Of the unilateral contact; from the scene's world where not given here.  Without a restitution it is plastic.
    step : float
        The engine's step after the first contact, times the angular speed of the throw [rad].
    patience : float
        When to give up, in the same measure [rad].

    Returns
    -------
    Landing

    Raises
    ------
    AnswerError
        pymunk is not installed, or the contact cannot be what it is said to be.
    MapError
        For a side the part has not.

    Notes
    -----
    The joint acts within the step, so the solver finds the plastic impact by itself.  By the hinge, x' is off by about
    (omega^2 ell / 2) step^2, omega being the rate at which the face comes down, and critical points by a multiple of
    step^2; by unilateral contact x' converges at about first order.  The engine's restitution is Newton's, of
    velocities, and its friction bounds the impulse of a whole step: with both at once it differs from Poisson's and
    Routh's laws.

    Examples
    --------
    >>> import limitsets as ls
    >>> landing = ls.engine.throw(ls.load("paper-designed"), 15.0, 2)
    >>> landing.side, round(landing.x, 3)
    (2, 16.754)
    """
    mu, e = _check(scene, side, contact, friction, restitution, step)
    stage = set_up(scene, x, side)
    flown = _fly(stage, patience)
    if flown <= 0.0:
        return Landing(x, side, "no flight", -1, math.nan, 0.0)
    if flown > patience:
        return Landing(stage.body.position.x, -1, "unfinished", -1, math.nan, flown)
    struck = stage.lowest()
    if contact == "hinge":
        turned, on = _turn_on_hinge(stage, struck, step, patience - flown)
    else:
        turned, on = _settle(stage, scene, mu, e, step, patience - flown)
    status = "rest" if on >= 0 else "unfinished"
    return Landing(stage.body.position.x, on, status, struck, flown, flown + turned)


def _check(
    scene: Scene, side: int, contact: str, friction: float | None, restitution: float | None, step: float
) -> tuple[float, float]:
    """Friction and restitution of the contact, both 0 for a hinge."""
    if not 0 <= side < len(scene.sides):
        raise MapError(
            "the side", side, f"an integer from 0 to {len(scene.sides) - 1}", "name a side of the part"
        )
    if not 0.0 < step <= 0.1:
        raise AnswerError("the engine's step", step, "above 0 and at most 0.1 rad", "pass step=1e-3")
    if contact == "hinge":
        if friction is not None or restitution is not None:
            raise AnswerError(
                "the contact",
                contact,
                "'unilateral' with a friction or a restitution",
                "a hinge has neither: leave them out",
            )
        return 0.0, 0.0
    if contact != "unilateral":
        raise AnswerError("the contact", contact, "'hinge' or 'unilateral'", "choose one")
    mu = scene.world.friction if friction is None else friction
    e = scene.world.restitution if restitution is None else restitution
    if mu is None or not 0.0 <= mu < math.inf:
        raise AnswerError(
            "the friction", mu, "a number from 0", "pass friction=0.5, or give world.friction in the scene"
        )
    if e is not None and not 0.0 <= e <= 1.0:
        raise AnswerError("the restitution", e, "0 to 1", "pass restitution=0 for a plastic contact")
    return mu, e or 0.0


def _fly(stage: Stage, patience: float) -> float:
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


def _turn_on_hinge(stage: Stage, struck: int, step: float, patience: float) -> tuple[float, int]:
    """Hold the struck vertex until a face lies on the arm: time and side, -1 where patience ends first."""
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

    time = 0.0
    while time <= patience:
        angle, rate = body.angle, body.angular_velocity
        if low < angle + rate * step < high:
            space.step(step)
            time += step
            continue
        target, side = (low, clockwise) if rate < 0.0 else (high, counter)
        last = max((target - angle) / rate, 0.0) if rate else 0.0
        space.step(last)  # a step turns by rate times its length
        return time + last, side
    return time, -1


def _settle(
    stage: Stage, scene: Scene, friction: float, restitution: float, step: float, patience: float
) -> tuple[float, int]:
    """Let the engine's contact bring the part to rest: time and side, -1 where it does not within patience."""
    pymunk, space, body = pymunk_module(), stage.space, stage.body
    size = float(scene.sides.length.max())
    far = 4.0 * (scene.arm_length + size)
    # As thick as the part is long: it never comes out on the other side.
    low = stage.height - size
    arm = pymunk.Segment(space.static_body, (-far, low), (far, low), size)
    arm.friction = arm.elasticity = 1.0  # the engine takes products
    stage.part.friction, stage.part.elasticity = friction, restitution
    space.iterations = ITERATIONS
    space.collision_slop = OVERLAP * size
    space.collision_bias = (1.0 - TAKEN_BACK) ** (1.0 / step)
    stage.strike(arm)  # where the vertex is: a whole step would first move it through the arm
    space.add(arm)
    space.sleep_time_threshold = IDLE

    time = 0.0
    while time <= patience and not body.is_sleeping:
        space.step(step)
        time += step
    off = [abs(math.remainder(body.angle - flat, math.tau)) for flat in stage.flat]
    side = off.index(min(off))
    return time, side if body.is_sleeping and off[side] < LEANING else -1
