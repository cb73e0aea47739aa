"""A film of feeding: throws until the part tips over the end of the arm, falls onto the ramp and slides down.

The part tips about the end of the arm as limitsets/feeding/tipping.py says: M theta'' = g (d sin theta + e cos theta).
It then slides without friction until it meets the far wall or the floor; that, and a fall of a part that lies wholly
beyond the end, is drawn.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.cavity_drawn import cavity_pieces
from limitsets.animation.cutting import Asked, Leg, Pace, cut
from limitsets.animation.film import Film
from limitsets.animation.lanes import known_of, require_start
from limitsets.animation.legs import RESTS, STAYS, drawn_of, legs_of, rest_leg
from limitsets.errors import AnswerError
from limitsets.feeding.tipping import rate_about_end
from limitsets.maps import codes
from limitsets.plot.poses import angle_on_side, outline
from limitsets.plot.throwing import Throw, motion, throws_of

if TYPE_CHECKING:
    from limitsets.feeding import Feeding
    from limitsets.feeding.falling import ArmEnd
    from limitsets.scene import Cavity, Scene

Array = NDArray[np.float64]

# Starts tried per side for a good one, and angles between which the first contact is searched.
TRIED, ANGLES = 40, 400
# Throws shown at most, and of a start that is chosen.
MOST_THROWS, USUAL = 60, 8
WORDS = ("fed rightly", "fed on a wrong side", "not clear of the wall")
AT_EDGE = "the next throw acts beyond the end of the arm, which is not simulated: assumed not fed"
BEYOND = "the struck corner is beyond the end of the arm: the map throws as if the arm went on"
# A place of rest nearer to the end than this share of the arm looks as if it were beyond.
NEAR = 0.005


def film_of_feeding(found: Feeding, asked: Asked) -> Film:
    """Show a part until it is fed."""
    return film_of_end(found.end, asked)


def film_of_end(end: ArmEnd, asked: Asked) -> Film:
    """Show a part until it is fed."""
    start, throws = asked.start, asked.throws
    sides = end.edges.size
    if start is not None and not start[0] < (end.edges[start[1]] if 0 <= start[1] < sides else end.x):
        allowed = f"below {end.x:g} {end.scene.unit}, where the arm ends, and where throws act beyond the end"
        raise AnswerError("x of the start", start[0], allowed, "start on the arm")
    goes_on = f"where the arm ends: side {end.side} is wanted"
    found, lanes = known_of(end.scene, asked.progress, lines=((end.x, goes_on),))
    scene, pace = found.scene, asked.pace(found.scene)
    most = MOST_THROWS if throws is None else throws
    x, side = _longest(end, most if throws else USUAL) if start is None else require_start(scene, start)
    made = _until_fed(end, scene, x, side, most)
    if not made:
        raise AnswerError("the start", f"x = {x:g} on side {side}", "one that is thrown", "choose another")
    last = made[-1]
    fate = _fate(end, last)
    legs = [rest_leg(scene, x, side, 1.0, f"Start: x = {x:.2f} {scene.unit} on side {side}")]
    for number, throw in enumerate(made, start=1):
        stays = STAYS if number == len(made) and fate < 0 else RESTS
        note = BEYOND if motion(scene, throw).struck[0] > end.x else ""
        edge = (AT_EDGE, -1) if end.at_edge(throw.after, throw.side_after) else None
        legs += legs_of(scene, throw, pace, f"Throw {number}", stays=stays, note=note, after=edge)
    if fate >= 0:
        legs += _falls(end, scene, last, fate, pace)
    pieces = cavity_pieces(scene, 0.5 * float(scene.sides.length.max()))
    about = "; ".join(words for words in (drawn_of(scene), "the slide down the ramp is drawn") if words)
    return cut(scene, legs, pace, title=scene.name, about=about, lanes=lanes, ground=pieces, end=end.x)


def _fate(end: ArmEnd, throw: Throw) -> int:
    if throw.code < 0:
        return -1
    return int(end.fate(np.array([throw.after]), np.array([throw.side_after]))[0])


def _until_fed(end: ArmEnd, scene: Scene, x: float, side: int, throws: int) -> list[Throw]:
    from limitsets.maps import orbit
    from limitsets.thrower import trace

    path = orbit(scene.map, x, side, throws)
    over = (path.x >= end.x) | end.at_edge(path.x, path.side)
    beyond = np.flatnonzero(over[1:])
    count = int(beyond[0]) + 1 if beyond.size else throws
    return throws_of(scene, trace(scene.map, x, side, count))


def _longest(end: ArmEnd, throws: int) -> tuple[float, int]:
    """Choose the start that is fed rightly after the most throws shown; a wrong one where none is."""
    best, chosen = (-1, -1), (float(end.starts[0]), 0)
    for side, begin in enumerate(end.starts.tolist()):
        for x in np.linspace(begin, end.x, TRIED + 2)[1:-1].tolist():
            made = _until_fed(end, end.scene, x, side, throws)
            if made and made[-1].code >= 0:
                fate = _fate(end, made[-1])
                flips = sum(throw.turned != 0 for throw in made)
                plain = all(abs(throw.after - end.x) > NEAR * end.x for throw in made)
                rank = (2 * (fate == 0) + (fate > 0) + plain, flips)
                best, chosen = max((best, chosen), (rank, (x, side)))
    return chosen


def _falls(end: ArmEnd, scene: Scene, throw: Throw, fate: int, pace: Pace) -> list[Leg]:
    """Tip, slide, and stay."""
    cavity, side = end.scene.cavity, throw.side_after
    assert cavity is not None  # an ArmEnd has one
    gravity = scene.kappa if scene.gravity is None else scene.gravity
    beyond, d = throw.after - end.x, float(scene.sides.d[side])
    about_end = outline(scene, side) + np.array([beyond, d])  # the corners from the end of the arm
    hinge = np.array([end.x, scene.surface_height])
    start = angle_on_side(scene, side)
    words, where = WORDS[fate], f"from x = {throw.after:.2f} {scene.unit} on side {side}"

    def pose(tipped: Array, along: Array, down: Array) -> Array:
        cos, sin = np.cos(tipped), np.sin(tipped)
        x = hinge[0] + beyond * cos + d * sin + along
        y = hinge[1] - beyond * sin + d * cos - down
        return np.stack([x, y, start - tipped], axis=-1)

    def leg(seconds: float, pose_of: Callable[[Array], Array], caption: str, begins: bool = False) -> Leg:
        place = np.array([throw.after, float(side)])
        return Leg(
            seconds,
            pose_of,
            np.zeros_like,
            lambda share: np.tile(place, (share.size, 1)),
            caption,
            where,
            trail=True,
            begins=begins,
        )

    if beyond >= float(scene.sides.a[side]):  # the whole side is beyond the end: nothing turns it
        drop = (beyond - float(scene.sides.a[side])) * math.tan(cavity.angle)
        time = math.sqrt(2.0 * drop / gravity)
        falls = leg(
            time * pace.unit,
            lambda share: pose(0.0 * share, 0.0 * share, drop * share * share),
            f"It falls: {words}",
            begins=True,
        )
        return [
            falls,
            leg(STAYS, lambda share: pose(0.0 * share, 0.0 * share, drop + 0.0 * share), words.capitalize()),
        ]
    most = _first_contact(cavity, about_end)
    inertia = scene.radius_of_gyration**2 + beyond**2 + d**2
    rate = rate_about_end(scene, throw.x, side, beyond) if throw.code == codes.JOG else 0.0
    time, angle_at = _tipping((rate, beyond, d), inertia, gravity, most)
    tips = leg(
        time * pace.unit,
        lambda share: pose(angle_at(share * time), 0.0 * share, 0.0 * share),
        f"It tips over the end: {words}",
        begins=True,
    )
    slide = _slide(cavity, about_end) if most >= cavity.angle else 0.0
    cos, sin = math.cos(cavity.angle), math.sin(cavity.angle)
    slides = leg(
        math.sqrt(2.0 * slide / (gravity * sin)) * pace.unit,
        lambda share: pose(most + 0.0 * share, slide * cos * share * share, slide * sin * share * share),
        f"It slides down the ramp: {words}" if slide else f"It meets the wall: {words}",
    )
    stays = leg(
        STAYS,
        lambda share: pose(most + 0.0 * share, slide * cos + 0.0 * share, slide * sin + 0.0 * share),
        words.capitalize(),
    )
    return [tips, slides, stays._replace(marks=((0.0, "in the cavity", *hinge.tolist()),))]


def _corners(about_end: Array, tipped: float) -> Array:
    cos, sin = math.cos(tipped), math.sin(tipped)
    found: Array = about_end @ np.array([[cos, -sin], [sin, cos]])
    return found


def _first_contact(cavity: Cavity, about_end: Array) -> float:
    """Angle at which a corner meets the far wall or the floor, or the side the ramp [rad]."""
    from scipy.optimize import brentq

    def room(tipped: float) -> float:
        corners = _corners(about_end, tipped)
        return float(min((cavity.width - corners[:, 0]).min(), (corners[:, 1] + cavity.depth).min()))

    angles = np.linspace(0.0, cavity.angle, ANGLES)
    for before, after in zip(angles[:-1].tolist(), angles[1:].tolist(), strict=True):
        if room(after) < 0.0:
            return float(brentq(room, before, after)) if room(before) > 0.0 else before
    return cavity.angle


def _tipping(
    begins: tuple[float, float, float], inertia: float, gravity: float, most: float
) -> tuple[float, Callable[[Array], Array]]:
    """Time to tip by an angle from a rate, e and d, and the angle over time."""
    from scipy.integrate import solve_ivp

    rate, beyond, height = begins

    def rates(_: float, state: Array) -> list[float]:
        sine, cosine = math.sin(state[0]), math.cos(state[0])
        return [float(state[1]), gravity * (height * sine + beyond * cosine) / inertia]

    def down(_: float, state: Array) -> float:
        return float(state[0]) - most

    down.terminal = True  # type: ignore[attr-defined]  # scipy reads it there
    # an inverted pendulum: from e off the top it takes ln(d/e) of its times, and a few more
    patience = (40.0 + max(0.0, math.log(height / max(beyond, 1e-300)))) * math.sqrt(
        inertia / (gravity * height)
    )
    found = solve_ivp(
        rates, (0.0, patience), [0.0, rate], "DOP853", dense_output=True, events=down, rtol=1e-10, atol=1e-14
    )
    end, solution = float(found.t[-1]), found.sol
    return end, lambda at: np.minimum(solution(at)[0], most)


def _slide(cavity: Cavity, about_end: Array) -> float:
    """How far it slides down the ramp until a corner meets the wall or the floor [length]."""
    corners = _corners(about_end, cavity.angle)
    wall = (cavity.width - corners[:, 0]) / math.cos(cavity.angle)
    floor = (cavity.depth + corners[:, 1]) / math.sin(cavity.angle)
    return max(0.0, float(min(wall.min(), floor.min())))
