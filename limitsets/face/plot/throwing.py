"""One throw of the map as motion: the part's vertices in flight, the impact, and the way to rest.

The angle at the impact, the place of rest and the sides turned are those of the map.  For a throw that scatters, kappa
is computed back from the angle at which its vertex lands, and the noise of its landing from its place of rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from limitsets.base.arrays import Array
from limitsets.feeder.geometry import side_ends
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower import Trace
from limitsets.systems.maps import codes

# ----------------------------------------------------------------
# Places of a part's vertices: lying on a side, and in flight.  Figures and animations place the part by the same
# functions.
#
# A pose is the centre of mass (x, y) and the angle by which the part has turned from the frame of the scene's vertices.


def about_centre(scene: Scene, *, hull: bool = True) -> Array:
    """Vertices of the hull, or of the part itself, about the centre of mass, as the scene gives them; shape (n, 2)."""
    about: Array = (scene.vertices if hull else scene.outline) - np.asarray(scene.centre)
    return about


def angle_on_side(scene: Scene, side: int) -> float:
    """Angle of the part when it lies on a side [rad]."""
    left, right = side_ends(len(scene.vertices), side)
    along = scene.vertices[right] - scene.vertices[left]
    return -math.atan2(float(along[1]), float(along[0]))


def outline(scene: Scene, side: int) -> Array:
    """Vertices about the centre of mass with `side` at the bottom, its left end first."""
    left, _ = side_ends(len(scene.vertices), side)
    rolled: Array = np.roll(turned(about_centre(scene), angle_on_side(scene, side)), -left, axis=0)
    return rolled


def turned(points: Array, angle: float) -> Array:
    """Turn points counterclockwise about the origin."""
    cosine, sine = math.cos(angle), math.sin(angle)
    images: Array = points @ np.array([[cosine, sine], [-sine, cosine]])
    return images


# ----------------------------------------------------------------
# From the impact to rest: the part turns about the struck vertex, a pendulum, and rolls on over others.
#
# Times and rates are those of a throw at rate 1, gravity is a vector (kappa, leaning where the arm stops at an angle);
# M theta'' = X g_y - H g_x about the vertex, X and H from it to the centre of mass.  Where no pendulum leads from the
# impact to the rest that the map says (small-angle formulas, the energy criterion, contacts that slip, let go or
# bounce), the way between the two is drawn: `Turning.drawn` says so.


# Longest time of a turn that is computed, and time of a motion that is drawn [1/w].
LONGEST, DRAWN = 40.0, 1.0
MOST_FACES = 60
# Places closer than this share of the part's size count as the same.
SAME = 1e-6


class Impact(NamedTuple):
    """An impact of a vertex.

    Attributes
    ----------
    corners : ndarray, shape (n, 2)
        The part at this moment, the left bottom vertex of the side thrown from first, counterclockwise [length].
    centre : ndarray, shape (2,)
        Its centre of mass [length].
    struck : int
        Number of the vertex: 0, or minus the number of vertices counterclockwise from vertex 0.
    velocity : tuple of (float, float, float)
        Of the centre of mass and of the rotation just before [length, length, 1], of a throw at rate 1.
    """

    corners: Array
    centre: Array
    struck: int
    velocity: tuple[float, float, float]


class Turning(NamedTuple):
    """The way to rest.

    Attributes
    ----------
    time : float
        Duration, for a throw at rate 1.
    pose : callable
        From shares of this time, shape (n,), to poses since the impact, shape (n, 3): where the centre of mass is, and
        by how much the part has turned [length, rad].
    faces : tuple of (float, float, float)
        Shares of the time at which the part rolls on over another vertex, and the places of these vertices.
    shift : float
        Noise of the landing: distance of the landing from that of the formulas [length].
    drawn : bool
        Whether it is drawn rather than computed.
    """

    time: float
    pose: Callable[[Array], Array]
    faces: tuple[tuple[float, float, float], ...]
    shift: float
    drawn: bool


class _Piece(NamedTuple):
    """A turn about one vertex: its begin, its duration, and the angle over time."""

    begin: float
    time: float
    vertex: Array
    arm: Array
    before: float
    angle: Callable[[Array], Array]

    def pose(self, at: Array) -> Array:
        turn = self.angle(np.clip(at - self.begin, 0.0, self.time))
        cos, sin = np.cos(turn), np.sin(turn)
        x = self.vertex[0] + cos * self.arm[0] - sin * self.arm[1]
        y = self.vertex[1] + sin * self.arm[0] + cos * self.arm[1]
        return np.stack([x, y, self.before + turn], axis=-1)


def _inertia(rho: float, arm: Array) -> float:
    return rho * rho + float(arm @ arm)


def _struck_rate(rho: float, arm: Array, velocity: tuple[float, float, float]) -> float:
    """Rate after a plastic impact, which conserves angular momentum about the vertex."""
    across, up, rate = velocity
    return (rho * rho * rate + float(arm[0]) * up - float(arm[1]) * across) / _inertia(rho, arm)


def pendulum_until(
    arm: Array,
    rate: float,
    ends: tuple[float, float],
    inertia: float,
    gravity: tuple[float, float],
    longest: float = LONGEST,
) -> tuple[float, float, Callable[[Array], Array], int] | None:
    """Turn until one of two angles: time, final rate, angle over time, and which; None if this takes too long."""
    from scipy.integrate import solve_ivp

    along, down = gravity

    def rates(_: float, state: Array) -> list[float]:
        angle, speed = state
        cos, sin = math.cos(angle), math.sin(angle)
        right, high = cos * arm[0] - sin * arm[1], sin * arm[0] + cos * arm[1]
        return [speed, (right * down - high * along) / inertia]

    pushed = rates(0.0, np.array([0.0, rate]))[1] if rate == 0.0 else rate
    for number, end in enumerate(ends):
        if abs(end) < 1e-9 and pushed * (-1.0, 1.0)[number] > 0.0:  # the side is down already
            return 0.0, rate, np.zeros_like, number

    def low(_: float, state: Array) -> float:
        return float(state[0]) - ends[0]

    def high(_: float, state: Array) -> float:
        return float(state[0]) - ends[1]

    for event, way in ((low, -1.0), (high, 1.0)):
        event.terminal, event.direction = True, way  # type: ignore[attr-defined]  # scipy reads them there
    swing = solve_ivp(
        rates,
        (0.0, longest),
        [0.0, rate],
        "DOP853",
        dense_output=True,
        events=(low, high),
        rtol=1e-10,
        atol=1e-14,
    )
    if swing.status != 1:
        return None
    number = 0 if swing.t_events[0].size else 1
    end, solution = float(swing.t[-1]), swing.sol
    return end, float(swing.y[1, -1]), lambda at: solution(at)[0], number


def _ends(corners: Array, vertex: int) -> tuple[float, float]:
    """Angles by which the part can turn about a vertex: clockwise (at most 0) and counterclockwise."""
    before, here, after = (corners[(vertex + k) % len(corners)] for k in (-1, 0, 1))
    onward, back = after - here, here - before
    # each angle is less than half a turn; it is 0, up to rounding, for a side that lies on the arm already
    clockwise = math.atan2(float(onward[1]), float(onward[0]))
    counter = -math.atan2(float(back[1]), float(back[0]))
    return -max(clockwise, 0.0), max(counter, 0.0)


def _turned_to_rest(
    scene: Scene, throw: Throw, hit: Impact, rest: tuple[Array, float], gravity: tuple[float, float]
) -> Turning:
    """Find the motion from an impact to rest.

    Parameters
    ----------
    scene, throw : Scene, Throw
        The scene, and the throw that ends so.
    hit : Impact
        The impact.
    rest : tuple of (ndarray, float)
        Place of rest of the centre of mass [length], and angle by which the part turns until then [rad].
    gravity : tuple of (float, float)
        Gravity over the squared rate of the throw, along the arm and away from it [length].
    """
    by_contact = any(getattr(scene.effects, name) for name in CONTACTS)
    # the striking vertex is held, and the part turns over as a pendulum does
    held = scene.flight == "exact" and scene.flip == "signed" and not by_contact
    pieces = _pendulums(scene, hit, throw.turned, gravity) if held else None
    if pieces is not None:
        last = pieces[-1]
        off = rest[0] - last.pose(np.array([last.begin + last.time]))[0, :2]
        size = float(np.abs(hit.corners - hit.centre).max())
        shift = float(off[0]) if throw.scatters else 0.0
        if max(abs(float(off[0]) - shift), abs(float(off[1]))) <= SAME * size:
            aside = np.array([shift, 0.0])
            return _joined([piece._replace(vertex=piece.vertex + aside) for piece in pieces], rest, shift)
    return _drawn(hit, rest)


def _pendulums(scene: Scene, hit: Impact, sides: int, gravity: tuple[float, float]) -> list[_Piece] | None:
    """Turn about one vertex after another until the part has turned by so many sides; None if it does not."""
    corners, centre, vertex, total = hit.corners, hit.centre, hit.struck, 0.0
    n, pieces, time, rho = len(corners), [], 0.0, scene.radius_of_gyration
    arm = centre - corners[vertex % n]
    rate = _struck_rate(rho, arm, hit.velocity)
    for _ in range(MOST_FACES):
        place, inertia = corners[vertex % n], _inertia(rho, arm)
        ends = _ends(corners, vertex)
        swung = pendulum_until(arm, rate, ends, inertia, gravity)
        if swung is None:
            return None
        took, rate, angle, counter = swung
        pieces.append(_Piece(time, took, place, arm, total, angle))
        time, turn = time + took, ends[counter]
        total += turn
        if counter - vertex == sides:
            return pieces
        if not scene.effects.roll:
            return None
        corners = turned(corners - place, turn) + place
        centre = turned(arm, turn) + place
        vertex += -1 if counter else 1
        # the side has come down; its other end strikes
        velocity = (-rate * float(centre[1] - place[1]), rate * float(centre[0] - place[0]), rate)
        arm = centre - corners[vertex % n]
        after = _struck_rate(rho, arm, velocity)
        if not after * rate > 0.0:
            return None
        rate = after
    return None


def _joined(pieces: list[_Piece], rest: tuple[Array, float], shift: float) -> Turning:
    """Join the pieces in time; the last pose is exactly that of the map."""
    time = pieces[-1].begin + pieces[-1].time
    begins = np.array([piece.begin for piece in pieces])

    def pose(share: Array) -> Array:
        at = np.asarray(share, dtype=np.float64) * time
        which = np.searchsorted(begins, at, side="right") - 1
        poses = np.array([pieces[k].pose(np.array([t]))[0] for k, t in zip(which, at, strict=True)])
        poses[share >= 1.0] = (*rest[0], rest[1])
        return poses

    faces = tuple(
        (piece.begin / time if time else 1.0, float(piece.vertex[0]), float(piece.vertex[1]))
        for piece in pieces[1:]
    )
    return Turning(time, pose, faces, shift, drawn=False)


def _drawn(hit: Impact, rest: tuple[Array, float]) -> Turning:
    """Draw a motion: the part turns and shifts evenly, with its lowest corner on the arm."""
    shape, floor = hit.corners - hit.centre, float(hit.corners[hit.struck % len(hit.corners), 1])
    foot = hit.corners[hit.struck % len(hit.corners)] - hit.centre
    place, turn = rest
    begin = float(hit.centre[0] + foot[0])
    end = float(place[0] + turned(foot[None, :], turn)[0, 0])

    def pose(share: Array) -> Array:
        at = np.asarray(share, dtype=np.float64)
        ease = at * at * (3.0 - 2.0 * at)
        poses = np.empty((at.size, 3))
        for k, (straight, eased) in enumerate(zip(at.tolist(), ease.tolist(), strict=True)):
            now = turned(shape, turn * straight)
            x = begin + (end - begin) * eased - float(turned(foot[None, :], turn * straight)[0, 0])
            poses[k] = x, floor - float(now[:, 1].min()), turn * straight
        poses[at >= 1.0] = (*place, turn)
        return poses

    return Turning(min(abs(turn), DRAWN), pose, (), 0.0, drawn=True)


# ----------------------------------------------------------------
# One throw of the map as motion: the flight by its formulas, the impact, and the way to rest.


# Effects that the turn about the striking vertex does not include.
CONTACTS = ("slip", "pivot", "bounce")


class Throw(NamedTuple):
    """One throw by the map.

    Attributes
    ----------
    x, side : float, int
        Place of rest before the throw [length].
    after, side_after : float, int
        Place of rest after the throw [length].
    code, turned : int
        Kind of the throw, and number of sides turned.
    phi : float
        Angle at the impact [rad].
    kappa : float
        Kappa of this throw [length].
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
        """The kind of the throw, in a word."""
        if self.code in (codes.INWARD, codes.OUTWARD):
            return "off the arm's end" if self.code == codes.OUTWARD else "into the joint"
        return codes.NAMES[self.code]


class Motion(NamedTuple):
    """The motion of the part in one throw.

    Attributes
    ----------
    flight : callable
        From shares of the flight to poses, shape (n, 3).
    struck : tuple of (float, float)
        Place at which the vertex strikes [length].
    impact : ndarray, shape (3,)
        The pose there.
    turning : Turning
        The motion after the impact.
    """

    flight: Callable[[Array], Array]
    struck: tuple[float, float]
    impact: Array
    turning: Turning


def throws_of(scene: Scene, path: Trace, kappa: float | None = None) -> list[Throw]:
    """Read throws from a trace, up to the first one outside the model, which has no impact."""
    throws = []
    for k in range(path.code.size):
        if path.code[k] == codes.OUTSIDE_MODEL or not math.isfinite(float(path.phi[k])):
            break
        throw = Throw(
            float(path.x[k]),
            int(path.side[k]),
            float(path.x[k + 1]),
            side_after=int(path.side[k + 1]),
            code=int(path.code[k]),
            turned=int(path.turned[k]),
            phi=float(path.phi[k]),
            kappa=scene.kappa if kappa is None else kappa,
            other_first=bool(path.other_vertex_first[k]),
        )
        if scene.effects.spread is not None:
            throw = throw._replace(kappa=kappa_of(scene, throw), scatters=True)
        throws.append(throw)
    return throws


def stroke_of(scene: Scene) -> float:
    """Angle of the stroke, if the scene simulates it; 0 for an impulse [rad]."""
    return float(scene.world.stroke or 0.0) if scene.effects.drive else 0.0


def lands(scene: Scene, throw: Throw) -> int:
    """Find the vertex that strikes: 0 for the left one, or minus the number of vertices counterclockwise from it."""
    if not scene.effects.landing:
        return 0
    heights = turned(outline(scene, throw.side), throw.phi)[:, 1]
    struck = int(heights.argmin())
    return struck - len(heights) if struck else 0


def kappa_of(scene: Scene, throw: Throw) -> float:
    """Kappa of a throw that scatters, computed from the angle at which its vertex lands."""
    p, q = outline(scene, throw.side)[lands(scene, throw)]
    d, phi = float(scene.sides.d[throw.side]), throw.phi
    height = d + throw.x * phi + float(p) * math.sin(phi) + float(q) * math.cos(phi)
    return 2.0 * height / (phi * phi * math.cos(stroke_of(scene)))


def motion(scene: Scene, throw: Throw) -> Motion:
    """Give the motion of the part in one throw, at rate 1."""
    kappa, lean = throw.kappa, stroke_of(scene)
    gravity = -kappa * math.sin(lean), -kappa * math.cos(lean)
    path = partial(_exact_flight if scene.flight == "exact" else _small_flight, scene, throw)
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
    turning = _turned_to_rest(scene, throw, hit, rest, gravity)
    shift, at_impact = turning.shift, start + throw.phi
    foot = hit.corners[struck % len(corners)]
    return Motion(
        lambda share: path(share) + np.outer(share, (shift, 0.0, 0.0)) + np.array([0.0, 0.0, start]),
        (float(foot[0]) + shift, float(foot[1])),
        np.array([hit.centre[0] + shift, hit.centre[1], at_impact]),
        turning._replace(pose=lambda share: turning.pose(share) + np.array([0.0, 0.0, at_impact])),
    )


def _exact_flight(scene: Scene, throw: Throw, share: Array) -> Array:
    """Move the centre of mass as docs/model.md says (flight); gravity leans where the stroke is simulated."""
    h, d, lean = scene.surface_height, float(scene.sides.d[throw.side]), stroke_of(scene)
    along, fall = -throw.kappa * math.sin(lean), throw.kappa * math.cos(lean)
    phi = throw.phi * np.asarray(share)
    x = throw.x - (h + d) * phi + 0.5 * along * phi * phi
    return np.stack([x, h + d + throw.x * phi - 0.5 * fall * phi * phi, phi], axis=-1)


def _small_flight(scene: Scene, throw: Throw, share: Array) -> Array:
    """Attach the part to its left vertex, whose path follows the small-angle formulas: (R - a - h phi, ...)."""
    a, d, h = float(scene.sides.a[throw.side]), float(scene.sides.d[throw.side]), scene.surface_height
    fall = throw.kappa - (d if scene.flight == "small-angle-2" else 0.0)
    phi = throw.phi * np.asarray(share)
    x, y = throw.x - a - h * phi, h + (throw.x - a) * phi - 0.5 * fall * phi * phi
    cos, sin = np.cos(phi), np.sin(phi)
    return np.stack([x + a * cos - d * sin, y + a * sin + d * cos, phi], axis=-1)
