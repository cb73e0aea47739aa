"""How long a part takes to tip over the end of the arm, until its side lies flush on the ramp.

The end is a hinge: no slip.  With the centre of mass e beyond the end and d above the side, theta the angle by which
the part has tipped, M = rho^2 + e^2 + d^2 and theta' = n at first,

    (M/2) theta'^2 = (M/2) n^2 + g (d (1 - cos theta) + e sin theta),

so that the time to the ramp's angle is an integral over theta.  The motion of the pendulum that is linear in theta,
theta = (e/d)(cosh s - 1) + (n/lambda) sinh s with s = lambda t and lambda^2 = g d / M, is the substitution; what is
left to integrate is smooth, however small e and n.

A jog turns the part clockwise about its left corner, a left of the centre of mass, until the side comes down on the
end of the arm.  The arm strikes the part there alone, so that the angular momentum about the end is kept:

    n (rho^2 + d^2 + e^2) = (rate of the fall) (rho^2 + d^2 + a e).

What is assumed stands in docs/feeding.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.maps import codes, images
from limitsets.thrower import fly

if TYPE_CHECKING:
    from limitsets.scene import Scene

Array = NDArray[np.float64]

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
    found: Array = (own + a * beyond) / (own + beyond * beyond)
    return found


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
