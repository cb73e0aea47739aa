"""What falls in: a part that comes to rest beyond the end of the arm tips over it, and slides down the ramp.

How long it takes to tip: `tipping`.  What is assumed stands in docs/feeding.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.feeding.tipping import tipping_times
from limitsets.geometry.polygon import above_side, side_ends
from limitsets.goals import Laid, OrientedBeyond, Reaches
from limitsets.robust.noise.chain_solution import starts_from
from limitsets.robust.noise.sampling import uniform_starts
from limitsets.scene.laid import LaidLike, read_laid
from limitsets.scene.scene import require_rests

if TYPE_CHECKING:
    from limitsets.scene import Cavity, Scene

FATES = ("right", "wrong", "wall", "edge", "left", "never")
"""What becomes of a part: fed on the wanted side; on another one; on the wanted side but it meets the far wall (or is
still tipping at the next throw); it is thrown from so near before the end that the throw acts beyond the end, which is
not simulated: it is assumed not to be fed; it leaves the arm otherwise; it is still on the arm when throwing ends."""

# Places between which the time to tip is searched for the dwell.
PLACES = 200


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
    if scene.gravity is None:
        remedy = "add [gravity] to the scene, or leave world.throw_rate out"
        raise AnswerError("gravity", None, "known where parts have limited time to tip", remedy)
    times = tipping_times(scene, side)

    def late(e: float) -> float:
        return float(times(np.array([e]))[0]) - 1.0 / rate

    # from rest the time grows by ln 2 / sqrt(g d / M) whenever e halves: from so near that it exceeds any dwell
    near, far = np.geomspace(most * 1e-200, most * 1e-3, PLACES), np.linspace(most * 1e-3, most, PLACES)
    places = [*near[:-1].tolist(), *far.tolist()]
    is_late = (times(np.array(places)) > 1.0 / rate).tolist()
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
    edges : ndarray, shape (n_sides,)
        From here to the end a throw acts beyond the end: its impulse, (rho^2 + d (h + d)) / x right of the foot of the
        centre of mass, finds no arm below [length].
    starts : ndarray, shape (n_sides,)
        Random starts lie from here to the end, equally likely per length on all sides [length].
    laid : Laid
        Where parts are laid down, before the end: all starts, of proofs too; () for the whole arm.
    """

    scene: Scene
    x: float
    side: int
    clear: tuple[tuple[float, float], ...]
    edges: NDArray[np.float64]
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

    def at_edge(self, x: Any, side: Any) -> Any:
        """Say of which parts at rest before the end the next throw acts beyond it: their fate is "edge"."""
        return (x > self.edges[side]) & (x < self.x)


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
    return ArmEnd(scene, x, side, clear_beyond(scene, side), _edges(scene, x), starts_from(scene), ranges)


def _edges(scene: Scene, x: float) -> NDArray[np.float64]:
    """Give by side the least place from which a throw acts beyond the end: y + c / y > x, the side over the end."""
    sides = scene.sides
    c = scene.radius_of_gyration**2 + sides.d * (scene.surface_height + sides.d)
    root = np.sqrt(np.maximum(x * x - 4.0 * c, 0.0))
    acts = np.where(4.0 * c < x * x, 0.5 * (x + root), 0.0)
    return np.clip(acts, np.maximum(x - sides.right, sides.a), x)
