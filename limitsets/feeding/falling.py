"""What falls in: a part at rest beyond the end of the arm tips over it, lies down flush on the ramp and slides down.

The end is a hinge: no slip, from rest.  With the centre of mass e beyond the end and d above the side, theta the angle
by which it has tipped and M = rho^2 + e^2 + d^2,

    (M/2) theta'^2 = g (d (1 - cos theta) + e sin theta),

so that the time to the ramp's angle is an integral over theta.  The substitution theta = (e/d)(cosh s - 1) is the
motion of the pendulum that is linear in theta; what is left to integrate is smooth, however small e.
What is assumed stands in docs/feeding.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.errors import AnswerError
from limitsets.geometry.polygon import above_side, side_ends
from limitsets.goals import Laid, OrientedBeyond, Reaches
from limitsets.robust.noise.chain_solution import starts_from
from limitsets.robust.noise.sampling import uniform_starts
from limitsets.scene.laid import LaidLike, read_laid
from limitsets.scene.scene import require_rests

if TYPE_CHECKING:
    from limitsets.scene import Cavity, Scene

__all__ = ["FATES", "ArmEnd", "arm_end_of", "clear_beyond", "farthest_clear", "time_to_tip"]

FATES = ("right", "wrong", "wall", "left", "never")
"""What becomes of a part: fed on the wanted side; on another one; on the wanted side but it meets the far wall (or is
still tipping at the next throw); it leaves the arm otherwise; it is still on the arm when throwing ends."""

# Abscissae of the integral, and places between which the time to tip is searched for the dwell.
NODES, PLACES = 96, 200


@cache
def _rule() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Nodes and weights of Gauss and Legendre: numpy solves an eigenvalue problem for them at each call."""
    return np.polynomial.legendre.leggauss(NODES)


def time_to_tip(
    beyond: ArrayLike, height: float, radius_of_gyration: float, gravity: float, angle: float
) -> NDArray[np.float64]:
    """Give the time in which a part tips over the end of the arm, from rest until its side lies on the ramp.

    Parameters
    ----------
    beyond : array_like
        How far beyond the end the centre of mass rests, from 0 [length].
    height : float
        Of the centre of mass above the side [length].
    radius_of_gyration : float
        About the centre of mass [length].
    gravity : float
        In the plane of the motion [length/s^2].
    angle : float
        Of the ramp, below 90 degrees [rad].

    Returns
    -------
    ndarray of float64
        Seconds; infinite at the end itself.

    Examples
    --------
    >>> time_to_tip([0.0, 0.1], 0.7, 1.25, 193.0, 0.56).round(3)
    array([  inf, 0.282])
    """
    e = np.asarray(beyond, dtype=np.float64)
    node, weight = _rule()
    with np.errstate(divide="ignore", invalid="ignore"):
        last = 2.0 * np.arcsinh(np.sqrt(0.5 * height * angle / e))
        s = 0.5 * last[..., None] * (1.0 + node)
        scale = (e / height)[..., None]
        theta = 2.0 * scale * np.sinh(0.5 * s) ** 2
        fallen = 2.0 * height * np.sin(0.5 * theta) ** 2 + e[..., None] * np.sin(theta)
        total = (weight * scale * np.sinh(s) / np.sqrt(fallen)).sum(axis=-1) * 0.5 * last
        inertia = radius_of_gyration**2 + height**2 + e**2
        time = np.sqrt(inertia / (2.0 * gravity)) * total
    return np.where(e > 0.0, time, np.inf)


def farthest_clear(scene: Scene, cavity: Cavity, side: int) -> float:
    """Give the largest e at which no vertex meets the far wall or the floor while the part tips [length].

    The wall has no upper end here.  A vertex p right of the hinge and q above it is at p cos theta + q sin theta at
    most hypot(p, q), where it is as high as the hinge; that grows with p, as its depth below the arm does.
    """
    cos, sin = math.cos(cavity.angle), math.sin(cavity.angle)
    corners = [(float(x), float(y)) for x, y in scene.vertices]
    left, right = side_ends(len(corners), side)
    most = math.inf
    for corner in corners:
        along, above, _ = above_side(corners[left], corners[right], corner)
        q = max(above, 0.0)  # on the side itself, to rounding
        if q <= cavity.width * sin:
            wall = math.sqrt(cavity.width**2 - q**2)
        else:
            wall = (cavity.width - q * sin) / cos
        floor = (cavity.depth + q * cos) / sin
        most = min(most, min(wall, floor) - (along - float(scene.sides.a[side])))
    return most


def clear_beyond(scene: Scene, side: int) -> tuple[tuple[float, float], ...]:
    """Give the intervals of e in which a part on this side falls in clear of the wall.

    Parameters
    ----------
    scene : Scene
        With a cavity; with `world.throw_rate` a part has the time between two throws to tip, and gravity is needed.
    side : int
        The side it rests on.

    Returns
    -------
    tuple of (float, float)
        Ascending [length].

    Raises
    ------
    AnswerError
        For a scene without [cavity], or with a rate of throws and without gravity.
    """
    cavity = _cavity_of(scene)
    # a part wholly beyond the end rests on nothing, and one beyond arm.length has left
    most = min(
        farthest_clear(scene, cavity, side), float(scene.sides.a[side]), scene.arm_length - cavity.position
    )
    rate = scene.world.throw_rate
    if not most > 0.0:
        return ()
    if rate is None:
        return ((0.0, most),)
    gravity = scene.gravity
    if gravity is None:
        remedy = "add [gravity] to the scene, or leave world.throw_rate out"
        raise AnswerError("gravity", None, "known where parts have limited time to tip", remedy)
    height = float(scene.sides.d[side])

    def late(e: float) -> float:
        time = time_to_tip(e, height, scene.radius_of_gyration, gravity, cavity.angle)
        return float(time) - 1.0 / rate

    # the time grows by ln 2 / sqrt(g d / M) whenever e halves: from so near to the end that it exceeds any dwell
    near, far = np.geomspace(most * 1e-200, most * 1e-3, PLACES), np.linspace(most * 1e-3, most, PLACES)
    places = [*near[:-1].tolist(), *far.tolist()]
    is_late = [late(e) > 0.0 for e in places]
    ends = [] if is_late[0] else [0.0]
    for (lo, hi), (before, after) in zip(pairwise(places), pairwise(is_late), strict=True):
        if before != after:
            from scipy.optimize import brentq

            ends.append(float(brentq(late, lo, hi, xtol=1e-15 * hi, rtol=1e-14)))
    if not is_late[-1]:
        ends.append(most)
    return tuple(zip(ends[::2], ends[1::2], strict=True))


def _cavity_of(scene: Scene) -> Cavity:
    if scene.cavity is None:
        require_rests(scene)
        at = f"{getattr(scene.goal, 'x', 0.7 * scene.arm_length):.6g} {scene.unit}"
        remedy = (
            f'add [cavity] with position, width, depth and angle: position = "{at}" is where the arm ends'
        )
        raise AnswerError("the scene", "without [cavity]", "one with a cavity", remedy)
    return scene.cavity


@dataclass(frozen=True, eq=False)
class ArmEnd:
    """The end of a scene's arm, and what becomes of parts beyond it.

    Attributes
    ----------
    scene : Scene
        With its cavity.
    x : float
        Where the arm ends [length].
    side : int
        The side wanted.
    clear : tuple of (float, float)
        How far beyond the end a part on that side clears the wall [length].
    starts : ndarray, shape (n_sides,)
        Random starts lie from here to the end, equally likely per length on all sides [length].
    laid : Laid
        Where parts are laid down, before the end: all starts, of proofs too; () for the whole arm.
    """

    scene: Scene
    x: float
    side: int
    clear: tuple[tuple[float, float], ...]
    starts: NDArray[np.float64]
    laid: Laid = ()

    @property
    def ranges(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
        """Lower ends, upper ends and sides of the ranges in which random starts lie."""
        whole = [(side, lo, self.x) for side, lo in enumerate(self.starts.tolist())]
        side, lo, hi = zip(*(self.laid or whole), strict=True)
        return np.array(lo), np.array(hi), np.array(side)

    def drawn(self, random: np.random.Generator, count: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Draw random starts: places and sides."""
        lo, hi, side = self.ranges
        return uniform_starts(random, lo, hi, count, side)

    def fate(self, x: NDArray[np.float64], side: NDArray[np.int64]) -> NDArray[np.int64]:
        """Say what becomes of parts at rest: a number of `FATES`, -1 of those that stay on the arm."""
        beyond = x - self.x
        clears = np.zeros(np.shape(x), dtype=bool)
        for lo, hi in self.clear:
            clears |= (beyond >= lo) & (beyond <= hi)
        fed = np.where(side == self.side, np.where(clears, 0, 2), 1)
        return np.where(beyond >= 0.0, fed, -1)


def arm_end_of(scene: Scene, side: int | None = None, laid: LaidLike | None = None) -> ArmEnd:
    """Read what is asked: the end of the arm, the side wanted, by default the goal's, and where parts are laid down.

    Raises
    ------
    AnswerError
        For a scene without a cavity or a wanted side, or an arm on which no landing beyond its end is known.
    """
    x = _cavity_of(scene).position
    if side is None and isinstance(scene.goal, OrientedBeyond | Reaches):
        side = scene.goal.side
    if side is None or not 0 <= side < len(scene.sides):
        allowed = f"0 to {len(scene.sides) - 1}"
        raise AnswerError(
            "the side wanted", side, allowed, "pass side= (--side), or give the scene a goal with a side"
        )
    if not x < scene.arm_length:
        allowed = f"above the cavity's position, {x:g} {scene.unit}"
        remedy = "arm.length is how far landings are followed: lengthen it by a part's length"
        raise AnswerError("the length of the arm", scene.arm_length, allowed, remedy)
    ranges = read_laid(scene, laid)
    for on, lo, hi in ranges:
        if not hi <= x:
            allowed = f"up to the end of the arm, {x:g} {scene.unit}"
            remedy = "lay parts down before it"
            raise AnswerError("the range", f"{lo:g} to {hi:g} on side {on}", allowed, remedy, key="laid")
    return ArmEnd(scene, x, side, clear_beyond(scene, side), starts_from(scene), ranges)
