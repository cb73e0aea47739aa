"""One throw in the engine, struck or by a stroke, from flight to rest; and its comparison with the map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import AnswerError, MapError, arguments_checked
from limitsets.feeder.engine.stage import (
    INSTANT,
    OVERLAP,
    Seen,
    Stage,
    check_contact,
    fly,
    pymunk_module,
    set_up,
    settle,
    turn_and_roll,
    turn_on_hinge,
)
from limitsets.systems.maps import OUTSIDE_MODEL, images

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene


# ----------------------------------------------------------------
# The throw by a stroke in the engine: an arm that turns with constant angular acceleration, and stops.


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


# ----------------------------------------------------------------
# One throw in the engine: flight, first contact, and motion to rest by a hinge or by the engine's own contact.


@dataclass(frozen=True)
class EngineThrow:
    """Where one throw ended in the engine.

    Attributes
    ----------
    x : float
        Distance of the centre of mass along the arm [length].
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
    residual : float
        Unilateral contact: energy by which the engine's contact fell short of Coulomb's law, as a fraction of what
        lifts the part by its own size.  Its solver does not converge where friction presses a sliding vertex hard.
    reverses : bool
        Unilateral contact: within an impact the vertex would slide one way and then, driven by the impact itself,
        the other.  Routh's law follows both; a law for the whole impulse, as the engine's, knows the second alone.
    rocks : bool
        Unilateral contact: after a face had come down the part rose again over its other end.
    """

    x: float
    side: int
    status: str
    struck: int
    phi: float
    time: float
    residual: float = 0.0
    reverses: bool = False
    rocks: bool = False


@arguments_checked
def throw(
    scene: Scene,
    x: float,
    side: int,
    *,
    contact: str = "hinge",
    friction: float | None = None,
    restitution: float | None = None,
    threshold: float = 0.0,
    rolls: bool = False,
    stroke: float = 0.0,
    step: float = 1e-3,
    patience: float = 60.0,
) -> EngineThrow:
    """Throw a part once in the engine.

    It is released at rest on its side with the velocity of a rigid turn about the joint and flies by gravity alone.
    Whichever vertex meets the arm first is struck; the map asks only for the left one.

    Parameters
    ----------
    scene : Scene
        The scene; of its flight and flip nothing is used.
    x : float
        Where the part rests before the throw [length].
    side : int
        On which side.
    contact : str
        ``"hinge"``: the struck vertex stays where it is, by a pivot joint, until a face lies on the arm: the minimal
        model.  ``"unilateral"``: the engine's own contact, which pushes, slips and bounces, until the part lies still.
    friction, restitution : float, optional
        Of the unilateral contact; from the scene's world where not given here.  Without a restitution it is plastic.
        With a hinge, friction is that of the stroke, and a restitution throws the struck vertex off again: Poisson's
        law, a joint keeping the vertex from sliding.
    threshold : float
        With a hinge: height below which a bounce is none [length].
    rolls : bool
        With a hinge: whether the part may roll on over the other end of the face that came down.
    stroke : float
        Angle over which the arm is turned, with constant acceleration, before it stops [rad]; 0 for an impulse.
    step : float
        The engine's step after the first contact, times the angular speed of the throw [rad].
    patience : float
        When to give up, in the same measure [rad].

    Returns
    -------
    EngineThrow

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
    _check_asked(contact, friction, threshold, rolls, stroke)
    mu, e = _check(scene, side, contact, friction, restitution, step)
    stage = set_up(scene, x, side)
    if stroke > 0.0:
        accelerate(stage, stroke, mu, step)
    flown = fly(stage, patience)
    if flown <= 0.0:
        return EngineThrow(x, side, "no flight", -1, math.nan, 0.0)
    if flown > patience:
        return EngineThrow(stage.body.position.x, -1, "unfinished", -1, math.nan, flown)
    struck, left, seen = stage.lowest(), patience - flown, Seen()
    if contact == "unilateral":
        turned, on, seen = settle(stage, scene, mu, e, step, left)
    elif rolls or e > 0.0:
        turned, on = turn_and_roll(stage, struck, rolls, (e, threshold), step, left)
    else:
        turned, on = turn_on_hinge(stage, struck, step, left)
    status = "rest" if on >= 0 else "unfinished"
    end, time = stage.body.position.x, flown + turned
    return EngineThrow(
        end,
        on,
        status,
        struck=struck,
        phi=flown,
        time=time,
        residual=seen.residual,
        reverses=seen.reverses,
        rocks=seen.rocks,
    )


def _check_asked(contact: str, friction: float | None, threshold: float, rolls: bool, stroke: float) -> None:
    """Refuse words that say nothing of this contact."""
    if contact == "hinge" and friction is not None and stroke == 0.0:
        remedy = "a hinge has none: leave it out"
        raise AnswerError("the contact", contact, "'unilateral' with a friction", remedy)
    if contact != "hinge" and (rolls or threshold):
        remedy = "the engine's own contact rolls anyway"
        raise AnswerError("the contact", contact, "'hinge' with rolls or a threshold", remedy)
    if not (0.0 <= stroke < 0.5 * math.pi and 0.0 <= threshold < math.inf):
        thing, allowed = "the stroke and the threshold", "0 to pi/2 rad; from 0"
        raise AnswerError(thing, (stroke, threshold), allowed, "pass stroke=0.2")


def _check(
    scene: Scene, side: int, contact: str, friction: float | None, restitution: float | None, step: float
) -> tuple[float, float]:
    """Friction and restitution of the contact; of a hinge only what is asked for."""
    if not 0 <= side < len(scene.sides):
        allowed = f"an integer from 0 to {len(scene.sides) - 1}"
        raise MapError("the side", side, allowed, "name a side of the part")
    held = contact == "hinge"
    mu = scene.world.friction if friction is None else friction
    mu = 0.0 if mu is None and held else mu
    e = scene.world.restitution if restitution is None and not held else restitution
    check_contact(contact, e or 0.0, step, 0.1)
    if mu is None or not 0.0 <= mu < math.inf:
        remedy = "pass friction=0.5, or give world.friction in the scene"
        raise AnswerError("the friction", mu, "a number from 0", remedy)
    return mu, e or 0.0


# ----------------------------------------------------------------
# Comparison of throws by the map and in the engine.


@dataclass(frozen=True)
class Comparison:
    """One row per throw.

    Attributes
    ----------
    x, side : ndarray, shape (n,)
        Where the part rested before the throw [length], and on which side.
    x_map, side_map, code_map : ndarray, shape (n,)
        Where it rests after it by the map [length], and what the throw was (`limitsets.maps`).
    x_engine, side_engine : ndarray, shape (n,)
        The same in the engine [length]; side -1 where it did not come to rest.
    status : ndarray of str, shape (n,)
        How the throw ended in the engine (`Landing.status`).
    struck : ndarray of int, shape (n,)
        Vertex that met the arm first in the engine.
    left : ndarray of int, shape (n,)
        Left bottom vertex before the throw, the one that the minimal model lets land.
    residual, reverses, rocks : ndarray, shape (n,)
        What was seen of unilateral contact (`Landing`).
    """

    x: NDArray[np.float64]
    side: NDArray[np.int64]
    x_map: NDArray[np.float64]
    side_map: NDArray[np.int64]
    code_map: NDArray[np.int64]
    x_engine: NDArray[np.float64]
    side_engine: NDArray[np.int64]
    status: NDArray[np.str_]
    struck: NDArray[np.int64]
    left: NDArray[np.int64]
    residual: NDArray[np.float64]
    reverses: NDArray[np.bool_]
    rocks: NDArray[np.bool_]

    @property
    def agree(self) -> NDArray[np.bool_]:
        """Whether it rests on the same side by both."""
        inside = (self.code_map != OUTSIDE_MODEL) & (self.status == "rest")
        same: NDArray[np.bool_] = inside & (self.side_map == self.side_engine)
        return same

    @property
    def error(self) -> NDArray[np.float64]:
        """x' in the engine less x' by the map [length]; nan where the sides differ."""
        return np.where(self.agree, self.x_engine - self.x_map, np.nan)

    @property
    def other_vertex(self) -> NDArray[np.bool_]:
        """Whether a vertex other than the left one met the arm first."""
        other: NDArray[np.bool_] = (self.struck >= 0) & (self.struck != self.left)
        return other


# Fields of `Landing` that are taken over, and what they are.
SEEN: dict[str, Any] = {
    "status": np.str_,
    "struck": np.int64,
    "residual": np.float64,
    "reverses": np.bool_,
    "rocks": np.bool_,
}


@arguments_checked
def compare(scene: Scene, x: ArrayLike, side: ArrayLike, **how: Any) -> Comparison:
    """Throw parts by the scene's map, with the effects it has, and in the engine.

    Parameters
    ----------
    scene : Scene
        The scene.
    x : array_like, shape (n,)
        Where the parts rest before the throw [length].
    side : int or array_like, shape (n,)
        On which side.
    **how
        How it goes in the engine, as keywords of `throw`: contact, friction, restitution, ...

    Returns
    -------
    Comparison

    Raises
    ------
    AnswerError
        As `throw`; or x and side do not fit together.
    MapError
        For a side the part has not.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.engine.compare(ls.load("paper-designed"), [15.0, 21.0], 2)
    >>> found.side_map.tolist(), found.side_engine.tolist(), bool(abs(found.error).max() < 1e-4)
    ([2, 0], [2, 0], True)
    """
    starts = np.asarray(x, dtype=np.float64)
    sides = np.asarray(side, dtype=np.int64)
    if starts.ndim != 1 or sides.shape not in ((), starts.shape):
        allowed = f"{starts.shape}, or one side"
        raise AnswerError("the shape of the sides", sides.shape, allowed, "give a side per start")
    sides = np.broadcast_to(sides, starts.shape).copy()
    landings = [throw(scene, *start, **how) for start in zip(starts.tolist(), sides.tolist(), strict=True)]
    x_map, side_map, code_map = _by_map(scene, starts, sides)
    return Comparison(
        x=starts,
        side=sides,
        x_map=x_map,
        side_map=side_map,
        code_map=code_map,
        x_engine=np.array([each.x for each in landings]),
        side_engine=np.array([each.side for each in landings], dtype=np.int64),
        left=-sides % len(scene.sides),
        **{name: np.array([getattr(each, name) for each in landings], kind) for name, kind in SEEN.items()},
    )


def _by_map(
    scene: Scene, x: NDArray[np.float64], side: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    after, on, code = np.empty_like(x), np.empty_like(side), np.empty_like(side)
    for each in np.unique(side).tolist():
        here = side == each
        image = images(scene.map, x[here], each)
        after[here], on[here], code[here] = image.x, image.side, image.code
    return after, on, code
