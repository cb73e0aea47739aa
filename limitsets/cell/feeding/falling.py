"""What falls in: a part beyond the end of the arm tips over it, how long that takes, and its way down the ramp.

How long it takes to tip: `tipping`.  What is assumed stands in docs/feeding.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints
from limitsets.feeder.geometry.polygon import above_side, side_ends
from limitsets.feeder.goals import Laid, OrientedBeyond, Reaches
from limitsets.feeder.scattering import starts_from, uniform_starts
from limitsets.feeder.scene import Cavity, LaidLike, Scene, read_laid, require_rests
from limitsets.feeder.thrower import fly
from limitsets.systems.maps import codes, images

# ----------------------------------------------------------------
# How long a part takes to tip over the end of the arm, until its side lies flush on the ramp.
#
# The end is a hinge: no slip.  With the centre of mass e beyond the end and d above the side, theta the angle by which
# the part has tipped, M = rho^2 + e^2 + d^2 and theta' = n at first,
#
#     (M/2) theta'^2 = (M/2) n^2 + g (d (1 - cos theta) + e sin theta),
#
# so that the time to the ramp's angle is an integral over theta.  The motion of the pendulum that is linear in theta,
# theta = (e/d)(cosh s - 1) + (n/lambda) sinh s with s = lambda t and lambda^2 = g d / M, is the substitution; what is
# left to integrate is smooth, however small e and n.
#
# A jog turns the part clockwise about its left corner, a left of the centre of mass, until the side comes down on the
# end of the arm.  The arm strikes the part there alone, so that the angular momentum about the end is kept:
#
#     n (rho^2 + d^2 + e^2) = (rate of the fall) (rho^2 + d^2 + a e).
#
# What is assumed stands in docs/feeding.md.


# Abscissae of the integral, and starts on the arm whose landings are looked at.
NODES, STARTS = 96, 800


@cache
def _rule() -> tuple[Array, Array]:
    """Nodes and weights of Gauss and Legendre: numpy solves an eigenvalue problem for them at each call."""
    return np.polynomial.legendre.leggauss(NODES)


def time_to_tip(
    beyond: ArrayLike,
    height: float,
    radius_of_gyration: float,
    gravity: float,
    angle: float,
    rate: ArrayLike = 0.0,
) -> Array:
    """Give the time in which a part tips over the end of the arm until its side lies on the ramp.

    Parameters
    ----------
    beyond : array_like
        How far beyond the end the centre of mass is, from 0 [length].
    height : float
        Of the centre of mass above the side [length].
    radius_of_gyration : float
        About the centre of mass [length].
    gravity : float
        In the plane of the motion [length/s^2].
    angle : float
        Of the ramp, below 90 degrees [rad].
    rate : array_like
        At which the part turns about the end at first, from 0: 0 for a part that begins at rest [rad/s].

    Returns
    -------
    ndarray of float64
        Seconds; infinite for a part at rest at the end itself.

    Examples
    --------
    >>> time_to_tip([0.0, 0.1], 0.7, 1.25, 193.0, 0.56).round(3)
    array([  inf, 0.282])
    >>> time_to_tip([0.0, 0.1], 0.7, 1.25, 193.0, 0.56, rate=8.0).round(3)
    array([0.067, 0.065])
    """
    e, first = np.broadcast_arrays(np.asarray(beyond, dtype=np.float64), np.asarray(rate, dtype=np.float64))
    node, weight = _rule()
    inertia = radius_of_gyration**2 + height**2 + e**2
    with np.errstate(divide="ignore", invalid="ignore"):
        pull = np.sqrt(gravity * height / inertia)
        lever, push = e / height, first / pull
        # where the substitution reaches the angle: tanh(s/2) without a difference of nearly equal numbers
        root = np.sqrt(push**2 + angle * (2.0 * lever + angle))
        last = np.log1p(2.0 * angle / (push + (push**2 + 2.0 * angle * lever) / (root + angle)))
        s = 0.5 * last[..., None] * (1.0 + node)
        lever, push = lever[..., None], push[..., None]
        theta = 2.0 * lever * np.sinh(0.5 * s) ** 2 + push * np.sinh(s)
        fallen = 2.0 * height * np.sin(0.5 * theta) ** 2 + e[..., None] * np.sin(theta)
        speed = np.sqrt(first[..., None] ** 2 + 2.0 * gravity * fallen / inertia[..., None])
        time = (weight * (lever * np.sinh(s) + push * np.cosh(s)) / speed).sum(axis=-1) * 0.5 * last
    return np.where((e > 0.0) | (first > 0.0), time, np.inf)


def _fall(scene: Scene, x: float, side: int) -> float:
    """Give the rate, in units of the throw's, at which a jog from x brings its side down."""
    flown = fly(scene.map, x, side)
    a, d = float(scene.sides.a[side]), float(scene.sides.d[side])
    # the barrier is what is left to climb to the top, of either sign once the exact model's is past it
    climbs = abs(flown.barrier) if scene.flight == "exact" else flown.barrier
    energy = flown.kinetic + scene.kappa * (math.hypot(a, d) - d) - climbs
    return math.sqrt(2.0 * max(energy, 0.0) / (scene.radius_of_gyration**2 + a * a + d * d))


def _kept(scene: Scene, side: int, beyond: Array) -> Array:
    """Give the rate about the end, for 1 at which the side comes down about its left corner."""
    a, d = float(scene.sides.a[side]), float(scene.sides.d[side])
    own = scene.radius_of_gyration**2 + d * d
    return np.asarray((own + a * beyond) / (own + beyond * beyond))


def _speed(scene: Scene) -> float:
    """Of the throw [rad/s]; 1 where no gravity is given."""
    return 1.0 if scene.gravity is None else math.sqrt(scene.gravity / scene.kappa)


def rate_about_end(scene: Scene, x: float, side: int, beyond: float) -> float:
    """Give the rate at which a part begins to tip over the end, once a jog has brought it down.

    Parameters
    ----------
    scene : Scene
        With a cavity.
    x : float
        Where the part lay before the throw [length].
    side : int
        On which side.
    beyond : float
        How far beyond the end its centre of mass came down [length].

    Returns
    -------
    float
        0 for a cavity whose parts tip from rest [rad/s; in units of the throw's rate without gravity].

    Examples
    --------
    >>> import limitsets as ls
    >>> cavity = {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}
    >>> scene = ls.load({**ls.load("paper-designed").as_dict(), "cavity": cavity})
    >>> round(rate_about_end(scene, 17.481566, 2, 0.01), 3)
    8.418
    """
    assert scene.cavity is not None
    if scene.cavity.tips == "rest":
        return 0.0
    return float(_fall(scene, x, side) * _kept(scene, side, np.asarray(beyond)) * _speed(scene))


def tipping_times(scene: Scene, side: int) -> Callable[[Array], Array]:
    """Give the time to tip of a part that came to lie on this side, as a function of e.

    Where the part keeps its momentum, the rate is that of the jog, without noise, that comes down there; of several
    the slowest; where none does, of the one that comes nearest.

    Parameters
    ----------
    scene : Scene
        With a cavity and gravity.
    side : int
        On which the part lies.

    Returns
    -------
    callable
        From e [length] to seconds, both of shape (n,).
    """
    cavity, gravity = scene.cavity, scene.gravity
    assert cavity is not None
    assert gravity is not None
    height, radius = float(scene.sides.d[side]), scene.radius_of_gyration

    def times(beyond: Array, falls: Array | float) -> Array:
        rate = falls * _kept(scene, side, beyond) * _speed(scene)
        return time_to_tip(beyond, height, radius, gravity, cavity.angle, rate)

    if cavity.tips == "rest":
        return lambda beyond: times(beyond, 0.0)
    starts = np.linspace(float(scene.sides.a[side]), cavity.position, STARTS + 2)[1:-1]
    seen = images(getattr(scene.map, "bare", scene.map), starts, side)
    jogs = np.flatnonzero((seen.code == codes.JOG) & (seen.side == side))
    landed = seen.x[jogs] - cavity.position
    near = landed >= min(0.0, float(landed.max(initial=-math.inf)))
    near[:-1] |= near[1:]  # and the one before the first
    jogs, landed = jogs[near], landed[near]
    if not jogs.size:
        return lambda beyond: times(beyond, 0.0)
    falls = np.array([_fall(scene, x, side) for x in starts[jogs].tolist()])
    joined = np.diff(jogs) == 1

    def at(beyond: Array) -> Array:
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (beyond[:, None] - landed[:-1]) / np.diff(landed)
        within = joined & (share >= 0.0) & (share <= 1.0)
        slowest = np.where(within, falls[:-1] + share * np.diff(falls), np.inf).min(axis=1, initial=np.inf)
        nearest = falls[np.abs(beyond[:, None] - landed).argmin(axis=1)]
        return times(beyond, np.where(np.isfinite(slowest), slowest, nearest))

    return at


# ----------------------------------------------------------------
# What falls in: a part that comes to rest beyond the end of the arm tips over it, and slides down the ramp.


FATES = ("right", "wrong", "wall", "edge", "left", "never")
"""What becomes of a part: fed on the wanted side; on another one; on the wanted side but it meets the far wall (or is
still tipping at the next throw); it is thrown from so near before the end that the throw acts beyond the end, which is
not simulated: it is assumed not to be fed; it leaves the arm otherwise; it is still on the arm when throwing ends."""

# Places between which the time to tip is searched for the dwell, and the first contact with a ground by polygon.
PLACES = 200
# A side that lies along the ramp to this share of its angle has met nothing before.
FLUSH = 1e-12
# Of the ramp of a cavity that is proposed [deg]: a part slides down where friction is below its tangent, 0.58.
RAMP = 30.0


def farthest_clear(scene: Scene, cavity: Cavity, side: int) -> float:
    """Give the largest e at which no vertex meets the far wall or the floor while the part tips [length].

    The wall has no upper end here.  A vertex p right of the hinge and q above it is at p cos theta + q sin theta at
    most hypot(p, q), where it is as high as the hinge; that grows with p, as its depth below the arm does.  Over a
    ground by polygon it is the first e at which the part meets the ground as it turns.
    """
    cos, sin = math.cos(cavity.angle), math.sin(cavity.angle)
    places = _on_side(scene, side)
    if cavity.outline:
        return _first_meeting(cavity, np.array(places), float(scene.sides.a[side]))
    most = math.inf
    for p, q in places:
        near = q <= cavity.width * sin
        wall = math.sqrt(cavity.width**2 - q**2) if near else (cavity.width - q * sin) / cos
        floor = (cavity.depth + q * cos) / sin
        most = min(most, min(wall, floor) - p)
    return most


def _on_side(scene: Scene, side: int) -> list[tuple[float, float]]:
    """Give the corners of a part on a side, from the foot of its centre of mass."""
    corners, a = [(float(x), float(y)) for x, y in scene.vertices], float(scene.sides.a[side])
    left, right = side_ends(len(corners), side)
    measured = (above_side(corners[left], corners[right], corner) for corner in corners)
    # on the side itself, to rounding
    return [(along - a, max(above, 0.0)) for along, above, _ in measured]


def _first_meeting(cavity: Cavity, corners: Array, a: float) -> float:
    """Give the first e, up to a, at which a part with these corners at e = 0 meets the ground as it turns."""
    from scipy.optimize import brentq

    def room(e: float) -> float:
        return first_contact(cavity, corners + np.array([e, 0.0])) - cavity.angle * (1.0 - FLUSH)

    tried = np.linspace(0.0, a, PLACES).tolist()
    first = next((k for k, e in enumerate(tried) if room(e) < 0.0), PLACES)
    if first in (0, PLACES):
        return a if first else 0.0
    return float(brentq(room, tried[first - 1], tried[first], xtol=1e-13 * a))


def first_contact(cavity: Cavity, corners: Array) -> float:
    """Angle by which a part turns about the end of the arm until it meets the ground, at most that of the ramp [rad].

    Parameters
    ----------
    cavity : Cavity
        With an outline.
    corners : ndarray, shape (n, 2)
        The part's, counterclockwise, from the end of the arm [length].
    """
    far, top = cavity.outline[-1]
    ground = np.array([*cavity.outline[1:], (far, top + 2.0 * float(np.ptp(corners)))])
    part = np.concatenate([corners, corners[:1]])
    up = np.array([1.0, -1.0])  # as the part sees it, the ground turns the other way
    return min(cavity.angle, _turn_to(part, ground), _turn_to(ground * up, part * up))


def _turn_to(points: Array, line: Array) -> float:
    """Angle by which points turn clockwise about the origin until one of them meets a line; infinite if none does."""
    start, way = line[:-1], np.diff(line, axis=0)
    # where on each edge is as far from the origin as each point: |start + s way| = r
    square, half = (way**2).sum(axis=1), (start * way).sum(axis=1)
    rest = (start**2).sum(axis=1) - (points**2).sum(axis=1)[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        root = np.sqrt(half**2 - square * rest)
        share = (np.stack([-root, root]) - half) / square
        met = start + share[..., None] * way
        turned = np.arctan2(points[:, 1], points[:, 0])[:, None] - np.arctan2(met[..., 1], met[..., 0])
        turned = np.where((share >= 0.0) & (share <= 1.0), turned % math.tau, np.inf)
    return float(turned.min())


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


def _cavity_of(scene: Scene, side: int | None = None) -> Cavity:
    if scene.cavity is None:
        require_rests(scene)
        text = proposed_cavity(scene, side)
        remedy = "add [cavity] with position, width, depth and angle"
        if text:
            rule = f"2 % wider than the least that feeds the side wanted down a ramp of {RAMP:g} deg"
            remedy += f"; this one is {rule}:\n\n{text}"
        raise AnswerError("the scene", "without [cavity]", "one with a cavity", remedy)
    return scene.cavity


def proposed_cavity(scene: Scene, side: int | None = None) -> str:
    """Propose a cavity that feeds a side, as TOML to add to the scene.

    The ramp falls by 30 degrees to the foot of the far wall.  The width is 2 % above the least for which a part on that
    side clears the wall wherever it comes to rest with the end of the arm below that side, and has its seat below the
    arm's surface; rounded up to three digits.

    Parameters
    ----------
    scene : Scene
        With a goal at a place, where the arm will end; without one it ends at 0.7 of its length.
    side : int, optional
        The side wanted; default the goal's.

    Returns
    -------
    str
        Empty where no side is wanted, or where a part needs the arm beyond that place.

    Examples
    --------
    >>> import limitsets as ls
    >>> print(proposed_cavity(ls.load("paper-designed")))
    [cavity]
    position = "20 in"
    width = "6.89 in"
    depth = "3.97794 in"
    angle = "30 deg"
    <BLANKLINE>
    """
    wanted = getattr(scene.goal, "side", None) if side is None else side
    x = float(getattr(scene.goal, "x", 0.7 * scene.arm_length))
    if wanted is None or not 0 <= wanted < len(scene.sides) or x <= float(scene.sides.a.max()):
        return ""
    tan, a = math.tan(math.radians(RAMP)), float(scene.sides.a[wanted])
    beyond, places = min(a, scene.arm_length - x), np.array(_on_side(scene, wanted))
    clear = float(np.hypot(places[:, 0] + beyond, places[:, 1]).max())
    cos, sin = math.cos(math.radians(RAMP)), math.sin(math.radians(RAMP))
    foot = places[side_ends(len(places), wanted)[1]]
    lying = (places - foot) @ np.array([[cos, -sin], [sin, cos]])
    seated = float(lying[:, 0].max() + max(lying[:, 1].max(), 0.0) / tan)
    least = 1.02 * max(clear, seated)
    unit = 10.0 ** (math.floor(math.log10(least)) - 2)
    width = unit * math.ceil(least / unit)
    depth = 1e-3 * unit * math.floor(width * tan / (1e-3 * unit))  # no longer than the cavity is wide
    sizes = {"position": x, "width": width, "depth": depth}
    lines = [f'{name} = "{size:.9g} {scene.unit}"' for name, size in sizes.items()]
    return "\n".join(["[cavity]", *lines, f'angle = "{RAMP:g} deg"', ""])


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
    edges: Array
    starts: Array
    laid: Laid = ()

    @property
    def ranges(self) -> tuple[Array, Array, Ints]:
        """Lower ends, upper ends and sides of the ranges in which random starts lie."""
        whole = [(side, lo, self.x) for side, lo in enumerate(self.starts.tolist())]
        side, lo, hi = zip(*(self.laid or whole), strict=True)
        return np.array(lo), np.array(hi), np.array(side)

    def drawn(self, random: np.random.Generator, count: int) -> tuple[Array, Ints]:
        """Draw random starts: places and sides."""
        lo, hi, side = self.ranges
        return uniform_starts(random, lo, hi, count, side)

    def fate(self, x: Array, side: Ints) -> Ints:
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
    x = _cavity_of(scene, side).position
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
    return ArmEnd(
        scene,
        x,
        side,
        clear=clear_beyond(scene, side),
        edges=_edges(scene, x),
        starts=starts_from(scene),
        laid=ranges,
    )


def _edges(scene: Scene, x: float) -> Array:
    """Give by side the least place from which a throw acts beyond the end: y + c / y > x, the side over the end."""
    sides = scene.sides
    c = scene.radius_of_gyration**2 + sides.d * (scene.surface_height + sides.d)
    root = np.sqrt(np.maximum(x * x - 4.0 * c, 0.0))
    return np.clip(np.where(4.0 * c < x * x, 0.5 * (x + root), 0.0), np.maximum(x - sides.right, sides.a), x)
