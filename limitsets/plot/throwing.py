"""One throw of the map as motion: the flight by its formulas, the impact, and the way to rest.

The angle at the impact, the place of rest and the sides turned are the map's.  A throw that scatters gives its kappa
back by the angle at which its vertex lands, and its landing by where it comes to rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.maps import codes
from limitsets.plot.poses import angle_on_side, centre_in_flight, outline, turned
from limitsets.plot.turning import Impact, Turning, turned_to_rest

if TYPE_CHECKING:
    from limitsets.scene import Scene
    from limitsets.thrower import Trace

Array = NDArray[np.float64]

# Effects that the turn about the struck vertex does not know.
CONTACTS = ("slip", "pivot", "bounce")


class Throw(NamedTuple):
    """One throw by the map.

    Attributes
    ----------
    x, side : float, int
        Where the part rests before it [length].
    after, side_after : float, int
        And after it.
    code, turned : int
        What it was, and sides turned.
    phi : float
        Angle at the impact [rad].
    kappa : float
        Of this throw [length].
    other_first : bool
        Whether another corner would have landed first, which the model leaves out.
    scatters : bool
        Whether the landing place deviates from that of the formulas.
    """

    x: float
    side: int
    after: float
    side_after: int
    code: int
    turned: int
    phi: float
    kappa: float
    other_first: bool
    scatters: bool = False

    @property
    def word(self) -> str:
        """What it was, in a word."""
        if self.code in (codes.INWARD, codes.OUTWARD):
            return "off the arm's end" if self.code == codes.OUTWARD else "into the joint"
        return codes.NAMES[self.code]


class Motion(NamedTuple):
    """How the part moves.

    Attributes
    ----------
    flight : callable
        From shares of the flight to poses, shape (n, 3).
    struck : tuple of (float, float)
        Where the vertex strikes [length].
    impact : ndarray, shape (3,)
        The pose there.
    turning : Turning
        What follows.
    """

    flight: Callable[[Array], Array]
    struck: tuple[float, float]
    impact: Array
    turning: Turning


def throws_of(scene: Scene, path: Trace, kappa: float | None = None) -> list[Throw]:
    """Read throws off a trace; those outside the model, which have no impact, are left out with all after them."""
    found = []
    for k in range(path.code.size):
        if path.code[k] == codes.OUTSIDE_MODEL or not math.isfinite(float(path.phi[k])):
            break
        throw = Throw(
            float(path.x[k]),
            int(path.side[k]),
            float(path.x[k + 1]),
            int(path.side[k + 1]),
            int(path.code[k]),
            int(path.turned[k]),
            float(path.phi[k]),
            scene.kappa if kappa is None else kappa,
            bool(path.other_vertex_first[k]),
        )
        if scene.effects.spread is not None:
            throw = throw._replace(kappa=kappa_of(scene, throw), scatters=True)
        found.append(throw)
    return found


def stroke_of(scene: Scene) -> float:
    """Angle of the stroke, where the scene simulates it; 0 for an impulse [rad]."""
    return float(scene.world.stroke or 0.0) if scene.effects.drive else 0.0


def lands(scene: Scene, throw: Throw) -> int:
    """Which vertex strikes: 0, the left one, or minus so many counterclockwise from it."""
    if not scene.effects.landing:
        return 0
    heights = turned(outline(scene, throw.side), throw.phi)[:, 1]
    struck = int(heights.argmin())
    return struck - len(heights) if struck else 0


def kappa_of(scene: Scene, throw: Throw) -> float:
    """Kappa of a throw that scatters: that with which its vertex lands at this angle."""
    p, q = outline(scene, throw.side)[lands(scene, throw)]
    d, phi = float(scene.sides.d[throw.side]), throw.phi
    height = d + throw.x * phi + float(p) * math.sin(phi) + float(q) * math.cos(phi)
    return 2.0 * height / (phi * phi * math.cos(stroke_of(scene)))


def motion(scene: Scene, throw: Throw) -> Motion:
    """Say how the part moves in one throw, of a throw at rate 1."""
    kappa, lean = throw.kappa, stroke_of(scene)
    gravity = -kappa * math.sin(lean), -kappa * math.cos(lean)
    exact = scene.flight == "exact"
    by_contact = [name for name in CONTACTS if getattr(scene.effects, name)]
    path = _exact_flight(scene, throw, gravity) if exact else _small_flight(scene, throw)
    struck, corners = lands(scene, throw), outline(scene, throw.side)
    start = angle_on_side(scene, throw.side)

    pose = path(np.ones(1))[0]
    d, h = float(scene.sides.d[throw.side]), scene.surface_height
    velocity = gravity[0] * throw.phi - (h + d), throw.x + gravity[1] * throw.phi, 1.0
    hit = Impact(turned(corners, throw.phi) + pose[:2], pose[:2], struck, velocity)
    corner, first, last = scene.sides.corner, throw.side, throw.side + throw.turned
    way = sum(float(corner[k % len(corners)]) for k in range(first, last))
    way -= sum(float(corner[k % len(corners)]) for k in range(last, first))
    rest = np.array([throw.after, h + float(scene.sides.d[throw.side_after])]), way - throw.phi
    turning = turned_to_rest(
        hit,
        rest,
        throw.turned,
        scene.radius_of_gyration,
        gravity,
        pendulum=exact and scene.flip == "signed" and not by_contact,
        rolls=bool(scene.effects.roll),
        scatters=throw.scatters,
    )
    shift = turning.shift

    def flight(share: Array) -> Array:
        poses = path(share)
        poses[:, 0] += shift * share
        poses[:, 2] += start
        return poses

    def turn(share: Array) -> Array:
        poses = turning.pose(share)
        poses[:, 2] += start + throw.phi
        return poses

    foot = hit.corners[struck % len(corners)]
    at_impact = np.array([hit.centre[0] + shift, hit.centre[1], start + throw.phi])
    return Motion(flight, (float(foot[0]) + shift, float(foot[1])), at_impact, turning._replace(pose=turn))


def _exact_flight(scene: Scene, throw: Throw, gravity: tuple[float, float]) -> Callable[[Array], Array]:
    def path(share: Array) -> Array:
        phi = throw.phi * np.asarray(share)
        centre = centre_in_flight(scene, throw.x, throw.side, phi, -gravity[1])
        return np.stack([centre[:, 0] + 0.5 * gravity[0] * phi * phi, centre[:, 1], phi], axis=-1)

    return path


def _small_flight(scene: Scene, throw: Throw) -> Callable[[Array], Array]:
    """Hang the part at its left vertex, of which the small-angle formulas give the path: (R - a - h phi, ...)."""
    a, d, h = float(scene.sides.a[throw.side]), float(scene.sides.d[throw.side]), scene.surface_height
    fall = throw.kappa - (d if scene.flight == "small-angle-2" else 0.0)

    def path(share: Array) -> Array:
        phi = throw.phi * np.asarray(share)
        x, y = throw.x - a - h * phi, h + (throw.x - a) * phi - 0.5 * fall * phi * phi
        cos, sin = np.cos(phi), np.sin(phi)
        return np.stack([x + a * cos - d * sin, y + a * sin + d * cos, phi], axis=-1)

    return path
