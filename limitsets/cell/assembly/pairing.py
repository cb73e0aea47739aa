"""Two scenes that share an arm: their pair, what a trial draws, and whether the outlines come into each other's way."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array
from limitsets.cell.feeding.falling import ArmEnd, arm_end_of
from limitsets.feeder.engine.crowd import depth_of_overlap
from limitsets.feeder.engine.depression import seat_of
from limitsets.feeder.geometry import side_ends
from limitsets.feeder.scattering import Gaussian, Law, Scattering, Uniform, scattering_of
from limitsets.feeder.scene import Scene, load, require_rests
from limitsets.feeder.thrower import impact_angles
from limitsets.parameters.sheet.summary import still

SHARED = ("unit", "kappa", "surface_height", "arm_length", "gravity", "flight", "flip", "cavity")
"""What two parts on one arm have in common."""

FOLLOWED = {
    "flight": ("exact", "outlines in flight are those of the exact one"),
    "flip": ("signed", "a part that flips by another criterion has no way from its impact to rest"),
}
"""Of which models outlines are followed, and why."""

Start = tuple[float, int]
"""x [length] and side."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two parts on one arm.

    Attributes
    ----------
    ends : tuple of ArmEnd
        The end of the arm as each part meets it; the first part is to lie below the second.
    scatter : Scattering
        Of the throws: the deviation of the speed is common, each part's landing has its own.
    """

    ends: tuple[ArmEnd, ArmEnd]
    scatter: Scattering

    @property
    def scenes(self) -> tuple[Scene, Scene]:
        """The scenes, without noise."""
        return self.ends[0].scene, self.ends[1].scene

    @property
    def contact(self) -> bool:
        """Whether the scenes ask for contact between the parts."""
        return self.scenes[0].effects.contact


def pair_of(
    scene: Scene | str | Path | Mapping[str, Any],
    scene2: Scene | str | Path | Mapping[str, Any],
    scatter: Scattering | None = None,
) -> Pair:
    """Join two scenes.

    Raises
    ------
    AnswerError
        Scenes that differ in arm, throw, noise or cavity, that have none, or with effects or noise that are not thrown.
    """
    one, two = (load(each) for each in (scene, scene2))
    for name in SHARED:
        values = getattr(one, name), getattr(two, name)
        if values[0] != values[1]:
            remedy = (
                "two parts on one arm share it, its throw and its cavity: write them alike in both scenes"
            )
            said = " and ".join(_said(each, name) for each in (one, two))
            raise AnswerError(f"{name} of the two scenes", said, "the same in both", remedy)
    if one.effects.contact != two.effects.contact:
        values = one.effects.contact, two.effects.contact
        raise AnswerError(
            "effects.contact of the two scenes", values, "the same in both", "switch it in both"
        )
    for each in (one, two):
        require_rests(each)
        others = sorted(set(each.effects.on()) - {"landing", "spread"})
        if others:
            remedy = "their motion after the impact is not followed here: switch them off"
            raise AnswerError(f"the effects of {each.name}", others, "landing, spread and contact", remedy)
        for name, (allowed, remedy) in FOLLOWED.items():
            if getattr(each, name) != allowed:
                raise AnswerError(f"the {name} of {each.name}", getattr(each, name), allowed, remedy)
    if scatter is None:
        drawn = [Scattering() if each.effects.spread is None else scattering_of(each) for each in (one, two)]
        if drawn[0] != drawn[1]:
            words = drawn[0].words(), drawn[1].words()
            raise AnswerError("the noise of the two scenes", words, "the same in both", "one arm throws both")
        scatter = drawn[0]
    laws = [getattr(scatter, name) for name in scatter.given()]
    if scatter.tilt is not None or not all(isinstance(law, Gaussian | Uniform) for law in laws):
        allowed = "Gaussian or Uniform, of speed and landing"
        raise AnswerError("the noise to throw with", scatter.words(), allowed, "choose one of these")
    return Pair((arm_end_of(still(one)), arm_end_of(still(two))), scatter)


def _said(scene: Scene, name: str) -> str:
    """Put what two parts have in common in words, with units."""
    value = getattr(scene, name)
    if name == "cavity" and value is not None:
        return ", ".join(f"{key} {text}" for key, text in scene.text["cavity"].items())
    unit = f"{scene.unit}/s^2" if name == "gravity" else scene.unit
    return f"{value:.9g} {unit}" if isinstance(value, float) else str(value)


def seats_of(pair: Pair) -> tuple[Array, Array]:
    """Give the corners of both parts in their seats, the second on the first, shapes (n, 2) [length].

    Raises
    ------
    AnswerError
        A part that would stand out of the cavity.
    """
    first, second = pair.ends
    below = seat_of(first.scene, first.side)
    return below, seat_of(second.scene, second.side, [below])


def outline_at(scene: Scene, x: float, height: float, angle: float) -> list[tuple[float, float]]:
    """Give the corners of a part, its centre of mass at (x, height) from the joint, turned from side 0 by an angle."""
    about = scene.vertices - np.asarray(scene.centre)
    cos, sin = math.cos(angle), math.sin(angle)
    return [(float(px), float(py)) for px, py in (about @ np.array([[cos, sin], [-sin, cos]]) + (x, height))]


def angle_on(scene: Scene, side: int) -> float:
    """By what a part is turned from its frame when it lies on a side [rad]."""
    left, right = side_ends(len(scene.vertices), side)
    along, up = (scene.vertices[right] - scene.vertices[left]).tolist()
    return -math.atan2(up, along)


def at_rest(scene: Scene, start: Start) -> list[tuple[float, float]]:
    """Give the corners of a part at rest."""
    x, side = start
    return outline_at(scene, x, scene.surface_height + float(scene.sides.d[side]), angle_on(scene, side))


def are_apart(pair: Pair, starts: Sequence[Start]) -> bool:
    """Whether two parts at rest do not overlap."""
    one, two = (at_rest(scene, start) for scene, start in zip(pair.scenes, starts, strict=True))
    return depth_of_overlap(one, two) <= 0.0


def require_apart(pair: Pair, starts: Sequence[Start]) -> tuple[Start, Start]:
    """Refuse starts off the arm, and two parts that overlap.

    Raises
    ------
    AnswerError
    """
    if len(starts) != 2:
        raise AnswerError("the starts", len(starts), "two, one for each part", "give (x, side) twice")
    for scene, end, (x, side) in zip(pair.scenes, pair.ends, starts, strict=True):
        if not (0 <= side < len(scene.sides) and float(scene.sides.a[side]) < x < end.x):
            allowed = f"a side of the part, and x on the arm before its end at {end.x:g} {scene.unit}"
            raise AnswerError(f"the start of {scene.name}", (x, side), allowed, "lay it on the arm")
    (x1, side1), (x2, side2) = starts
    if not are_apart(pair, starts):
        thing = f"the starts {x1:g} on side {side1} and {x2:g} on side {side2}"
        raise AnswerError(thing, "overlapping", "parts that do not overlap", "move one of them along the arm")
    return (float(x1), int(side1)), (float(x2), int(side2))


# ----------------------------------------------------------------
# What a trial draws, from its seed and its number alone: starts, and the deviations of every throw.


# Pairs of starts drawn before it is believed that none are apart; throws drawn at once.
MOST_DRAWN, AT_ONCE = 10_000, 64


class Draws:
    """Random numbers of one trial.

    Parameters
    ----------
    pair : Pair
        The parts and the noise.
    seed, number : int
        Of the series of trials, and of the trial in it.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.cell.assembly.pairing import pair_of
    >>> pair = pair_of("paper-triangle", "paper-quadrilateral")
    >>> Draws(pair, 0, 7).starts(apart=True) == Draws(pair, 0, 7).starts(apart=True)
    True
    """

    def __init__(self, pair: Pair, seed: int, number: int) -> None:
        self.pair = pair
        self.random = np.random.Generator(np.random.Philox(key=np.array([seed, number], dtype=np.uint64)))
        self.rows: list[list[float]] = []

    def starts(self, *, apart: bool) -> tuple[Start, Start]:
        """Draw where the parts lie at first, each as `limitsets.feed` does; `apart`: until they do not overlap."""
        for _ in range(MOST_DRAWN):
            (x1, side1), (x2, side2) = (end.drawn(self.random, 1) for end in self.pair.ends)
            first, second = (float(x1[0]), int(side1[0])), (float(x2[0]), int(side2[0]))
            if not apart or are_apart(self.pair, (first, second)):
                return first, second
        remedy = "lengthen the arm, or throw without contact"
        raise AnswerError("the arm", "too short for both parts", "room for two parts side by side", remedy)

    def throw(self) -> tuple[float, tuple[float, float]]:
        """Draw the next throw: relative deviation of the speed, and of each part's landing place [length]."""
        if not self.rows:
            scatter, shape = self.pair.scatter, (AT_ONCE, 1)
            speed = _drawn(scatter.speed, self.random, shape)
            self.rows = np.hstack([speed, _drawn(scatter.landing, self.random, (AT_ONCE, 2))])[::-1].tolist()
        speed_of, one, two = self.rows.pop()
        return speed_of, (one, two)


def _drawn(law: Law | None, random: np.random.Generator, shape: tuple[int, int]) -> Array:
    if isinstance(law, Gaussian):
        return law.sigma * random.standard_normal(shape)
    if isinstance(law, Uniform):
        return random.uniform(-law.bound, law.bound, shape)
    return np.zeros(shape)


# ----------------------------------------------------------------
# Whether two parts thrown together come into each other's way, were they to pass through each other.
#
# A part flies with its release's velocity until the throw map's impact; then it turns about the corner that struck,
# held, until the side lies down on which the map lets it rest.  Angles are those of the arm's speed of this throw:
# time is w t.


# Parts nearer than this share of the first one's longest side are taken to overlap.
TOLERANCE = 5e-3
# Step in which a part turns about the corner that struck [rad], and when turning is given up.
STEP, PATIENCE = 4e-3, 12.0


@dataclass(frozen=True, eq=False)
class Way:
    """How a part moves in one throw.

    Attributes
    ----------
    scene : Scene
        The part.
    start : (float, int)
        Where it lies at first.
    kappa : float
        Of this throw [length].
    phi : float
        Time of its impact [rad].
    struck : int
        The corner that strikes.
    turns : tuple of float
        Angles by which it has turned since, at multiples of `STEP`; the last one is that at rest [rad].
    in_flight, turning : float
        No point of the part is faster before and after the impact [length].
    """

    scene: Scene
    start: Start
    kappa: float
    phi: float
    struck: int
    turns: tuple[float, ...]
    in_flight: float
    turning: float

    @property
    def ends(self) -> float:
        """When it lies still."""
        return self.phi + STEP * (len(self.turns) - 1)

    def speed(self, time: float) -> float:
        """No point of the part is faster from a time on [length]."""
        if time >= self.ends:
            return 0.0
        return self.turning if time >= self.phi else max(self.in_flight, self.turning)

    def corners(self, time: float) -> list[tuple[float, float]]:
        """Where its corners are.

        Parameters
        ----------
        time : float
            From release, times the angular speed of the throw [rad].
        """
        if time <= self.phi:
            return _in_flight(self.scene, self.start, self.kappa, time)
        at, last = (time - self.phi) / STEP, len(self.turns) - 1
        k = min(int(at), last)
        part = min(at - k, 1.0) if k < last else 0.0
        angle = self.turns[k] + part * (self.turns[min(k + 1, last)] - self.turns[k])
        landed = _in_flight(self.scene, self.start, self.kappa, self.phi)
        (px, py), cos, sin = landed[self.struck], math.cos(angle), math.sin(angle)
        return [
            (px + (x - px) * cos - (y - py) * sin, py + (x - px) * sin + (y - py) * cos) for x, y in landed
        ]


def _in_flight(scene: Scene, start: Start, kappa: float, phi: float) -> list[tuple[float, float]]:
    x, side = start
    height = scene.surface_height + float(scene.sides.d[side])
    rise = height + (x - 0.5 * kappa * phi) * phi
    return outline_at(scene, x - height * phi, rise, angle_on(scene, side) + phi)


def way_of(scene: Scene, params: Any, start: Start, side: int) -> Way:
    """Follow a part through a throw.

    Parameters
    ----------
    scene : Scene
        The part, in the minimal model or with `landing`.
    params : Throw or FullThrow
        The throw map at the speed of this throw.
    start : (float, int)
        Where it lies.
    side : int
        On which side the map lets it come to rest.
    """
    x, before = start
    kappa = float(getattr(params, "bare", params).kappa)
    phi = float(impact_angles(params, [x], before)[0])
    reach = max(math.dist(corner, scene.centre) for corner in scene.vertices.tolist())
    height = scene.surface_height + float(scene.sides.d[before])
    if not math.isfinite(phi):  # outside the model: it stays where it is
        return Way(scene, start, kappa, phi=0.0, struck=0, turns=(0.0,), in_flight=0.0, turning=0.0)
    landed = _in_flight(scene, start, kappa, phi)
    # the left corner, unless the scene lets another one land before it
    count = len(landed)
    struck = (
        min(range(count), key=lambda k: landed[k][1]) if "landing" in scene.effects.on() else -before % count
    )
    right = x - height * phi - landed[struck][0]
    above = height + (x - 0.5 * kappa * phi) * phi - landed[struck][1]
    inertia = scene.radius_of_gyration**2 + right**2 + above**2
    # plastic impact: angular momentum about the corner is kept
    rate = (scene.radius_of_gyration**2 + right * (x - kappa * phi) + above * height) / inertia
    turned = sum(float(scene.sides.corner[(before + k) % count]) for k in range((side - before) % count))
    turns, fastest = _turned(turned - phi, rate, (right, above), inertia, kappa)
    return Way(
        scene,
        start,
        kappa,
        phi=phi,
        struck=struck,
        turns=turns,
        in_flight=(math.hypot(height, max(abs(x), abs(x - kappa * phi))) + reach),
        turning=2.0 * reach * fastest,
    )


def _turned(
    target: float, rate: float, centre: tuple[float, float], inertia: float, kappa: float
) -> tuple[tuple[float, ...], float]:
    """Turn about the corner until it has turned by `target`: angles by time, and the greatest rate."""
    (right, above), angle, fastest, angles = centre, 0.0, abs(rate), [0.0]

    def pull(angle: float) -> float:
        return -kappa * (right * math.cos(angle) - above * math.sin(angle)) / inertia

    gain = pull(angle)
    while len(angles) * STEP < PATIENCE:
        angle += STEP * (rate + 0.5 * STEP * gain)
        after = pull(angle)
        rate, gain = rate + 0.5 * STEP * (gain + after), after
        fastest = max(fastest, abs(rate))
        if (target <= 0.0 and angle <= target) or (target >= 0.0 and angle >= target):
            break
        angles.append(angle)
    return (*angles, target), fastest


def meet(one: Way, two: Way) -> bool:
    """Whether the outlines of two parts overlap at any time of a throw.

    As nothing is faster than the ways' speeds, times are left out in which the parts cannot have met: no overlap is
    missed, and parts that come closer than `TOLERANCE` count as overlapping.
    """
    least = TOLERANCE * float(one.scene.sides.length.max())
    time, last = 0.0, max(one.ends, two.ends)
    while True:
        apart = -depth_of_overlap(one.corners(time), two.corners(time))
        if apart < least:
            return True
        if time >= last:
            return False
        speed = one.speed(time) + two.speed(time)
        time = min(time + apart / speed, last) if speed > 0.0 else last
