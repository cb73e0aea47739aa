"""Two scenes that share an arm, its throw and its cavity."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.engine.overlaps import depth_of_overlap
from limitsets.engine.seats import seat_of
from limitsets.errors import AnswerError
from limitsets.feeding.falling import ArmEnd, arm_end_of
from limitsets.geometry import side_ends
from limitsets.robust.noise.laws import Gaussian, Uniform
from limitsets.robust.noise.scattering import Scattering, scattering_of
from limitsets.robust.sheet.noise_input import still
from limitsets.scene import Scene, load
from limitsets.scene.scene import require_rests

SHARED = ("unit", "kappa", "surface_height", "arm_length", "gravity", "flight", "flip", "cavity")
"""What two parts on one arm have in common."""

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
        if each.flight != "exact":
            remedy = "outlines in flight are those of the exact one"
            raise AnswerError(f"the flight of {each.name}", each.flight, "exact", remedy)
        if each.flip != "signed":
            remedy = "a part that flips by another criterion has no way from its impact to rest"
            raise AnswerError(f"the flip of {each.name}", each.flip, "signed", remedy)
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


def seats_of(pair: Pair) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
    turned: NDArray[np.float64] = about @ np.array([[cos, sin], [-sin, cos]]) + (x, height)
    return [(float(px), float(py)) for px, py in turned]


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
    if not are_apart(pair, starts):
        (x1, side1), (x2, side2) = starts
        thing = f"the starts {x1:g} on side {side1} and {x2:g} on side {side2}"
        raise AnswerError(thing, "overlapping", "parts that do not overlap", "move one of them along the arm")
    (x1, side1), (x2, side2) = starts
    return (float(x1), int(side1)), (float(x2), int(side2))
