"""From the impact to rest: the part turns about the struck vertex, a pendulum, and rolls on over others.

Times and rates are those of a throw at rate 1, gravity is a vector (kappa, leaning where the arm stops at an angle);
M theta'' = X g_y - H g_x about the vertex, X and H from it to the centre of mass.  Where no pendulum leads from the
impact to the rest that the map says (small-angle formulas, the energy criterion, contacts that slip, let go or bounce),
the way between the two is drawn: `Turning.drawn` says so.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.plot.poses import turned

Array = NDArray[np.float64]

# Longer than this near the top of a vertex is not shown [1/w]; a way that is drawn takes so long at most.
LONGEST, DRAWN = 40.0, 1.0
MOST_FACES = 60
# Of the part's size: places nearer than this are the same.
SAME = 1e-6


class Impact(NamedTuple):
    """A vertex has struck.

    Attributes
    ----------
    corners : ndarray, shape (n, 2)
        The part at this moment, the left bottom vertex of the side thrown from first, counterclockwise [length].
    centre : ndarray, shape (2,)
        Its centre of mass [length].
    struck : int
        Which vertex: 0, or minus so many counterclockwise from it.
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
        How long it takes, of a throw at rate 1.
    pose : callable
        From shares of this time, shape (n,), to poses since the impact, shape (n, 3): where the centre of mass is, and
        by how much the part has turned [length, rad].
    faces : tuple of (float, float, float)
        Shares of the time at which it rolls on over another vertex, and where that is.
    shift : float
        How much farther the flight led than its formulas say, where landings scatter [length].
    drawn : bool
        Whether it is drawn rather than computed.
    """

    time: float
    pose: Callable[[Array], Array]
    faces: tuple[tuple[float, float, float], ...]
    shift: float
    drawn: bool


class _Piece(NamedTuple):
    """Turning about one vertex: when it begins, how long it takes, and angle over time."""

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
    """Rate after a plastic impact: angular momentum about the vertex stays."""
    across, up, rate = velocity
    return (rho * rho * rate + float(arm[0]) * up - float(arm[1]) * across) / _inertia(rho, arm)


def _pendulum(
    arm: Array, rate: float, ends: tuple[float, float], inertia: float, gravity: tuple[float, float]
) -> tuple[float, float, Callable[[Array], Array], int] | None:
    """Turn until one of two angles: time, rate then, angle over time, and which; None where that takes too long."""
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
    found = solve_ivp(
        rates,
        (0.0, LONGEST),
        [0.0, rate],
        "DOP853",
        dense_output=True,
        events=(low, high),
        rtol=1e-10,
        atol=1e-12,
    )
    if found.status != 1:
        return None
    number = 0 if found.t_events[0].size else 1
    end, solution = float(found.t[-1]), found.sol
    return end, float(found.y[1, -1]), lambda at: solution(at)[0], number


def _ends(corners: Array, vertex: int) -> tuple[float, float]:
    """By how much the part may turn about a vertex: clockwise, not positive, and counterclockwise."""
    n = len(corners)
    before, after = corners[(vertex - 1) % n], corners[(vertex + 1) % n]
    here = corners[vertex % n]
    onward, back = after - here, here - before
    # the two are less than half a turn each; a side that lies down already is 0, to rounding
    clockwise = math.atan2(float(onward[1]), float(onward[0]))
    counter = -math.atan2(float(back[1]), float(back[0]))
    return -max(clockwise, 0.0), max(counter, 0.0)


def turned_to_rest(
    hit: Impact,
    rest: tuple[Array, float],
    sides: int,
    rho: float,
    gravity: tuple[float, float],
    *,
    pendulum: bool,
    rolls: bool,
    scatters: bool,
) -> Turning:
    """Find the way from an impact to rest.

    Parameters
    ----------
    hit : Impact
        The impact.
    rest : tuple of (ndarray, float)
        Where the centre of mass comes to rest [length], and by how much the part turns until then [rad].
    sides : int
        So many sides it turns from the one it was thrown from, counterclockwise.
    rho : float
        Radius of gyration [length].
    gravity : tuple of (float, float)
        Over the squared rate of the throw, along the arm and off it [length].
    pendulum : bool
        Whether the struck vertex is held and the criterion is that of a pendulum.
    rolls : bool
        Whether it may roll on.
    scatters : bool
        Whether the landing place may deviate.
    """
    found = _pendulums(hit, sides, rho, gravity, rolls) if pendulum else None
    if found is not None:
        last = found[-1]
        off = rest[0] - last.pose(np.array([last.begin + last.time]))[0, :2]
        size = float(np.abs(hit.corners - hit.centre).max())
        shift = float(off[0]) if scatters else 0.0
        if max(abs(float(off[0]) - shift), abs(float(off[1]))) <= SAME * size:
            aside = np.array([shift, 0.0])
            return _joined([piece._replace(vertex=piece.vertex + aside) for piece in found], rest, shift)
    return _drawn(hit, rest)


def _pendulums(
    hit: Impact, sides: int, rho: float, gravity: tuple[float, float], rolls: bool
) -> list[_Piece] | None:
    corners, centre, vertex, total = hit.corners, hit.centre, hit.struck, 0.0
    n, pieces, time = len(corners), [], 0.0
    arm = centre - corners[vertex % n]
    rate = _struck_rate(rho, arm, hit.velocity)
    for _ in range(MOST_FACES):
        place, inertia = corners[vertex % n], _inertia(rho, arm)
        ends = _ends(corners, vertex)
        swung = _pendulum(arm, rate, ends, inertia, gravity)
        if swung is None:
            return None
        took, rate, angle, counter = swung
        pieces.append(_Piece(time, took, place, arm, total, angle))
        time, turn = time + took, ends[counter]
        total += turn
        if counter - vertex == sides:
            return pieces
        if not rolls:
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
    """Show one piece after the other; the last frame is where the map says, to the last digit."""
    time = pieces[-1].begin + pieces[-1].time
    begins = np.array([piece.begin for piece in pieces])

    def pose(share: Array) -> Array:
        at = np.asarray(share, dtype=np.float64) * time
        which = np.searchsorted(begins, at, side="right") - 1
        poses = np.array([pieces[k].pose(np.array([t]))[0] for k, t in zip(which, at, strict=True)])
        poses[share >= 1.0] = (*rest[0], rest[1])
        return poses

    later = pieces[1:]
    faces = tuple(
        (piece.begin / time if time else 1.0, float(piece.vertex[0]), float(piece.vertex[1]))
        for piece in later
    )
    return Turning(time, pose, faces, shift, drawn=False)


def _drawn(hit: Impact, rest: tuple[Array, float]) -> Turning:
    """Draw a way: it turns and shifts evenly, its lowest corner on the arm."""
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
