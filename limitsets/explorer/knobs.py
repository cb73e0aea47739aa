"""Knobs: the numbers of a scene, or of a map, that sliders move, and what follows from moving them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from limitsets.errors import LimitsetsError, shown
from limitsets.geometry import side_ends
from limitsets.geometry.polygon import above_side
from limitsets.scene import Scene
from limitsets.scene.quantities import STANDARD_GRAVITY, find, text_at, unit_read
from limitsets.scene.units import convert, parse, written

# Point masses that get sliders; more would be a table, not a picture.
MOST_POINTS = 3
STEPS = 400
# Ends of the slider of a point mass, which cannot be 0.
LIGHTEST, HEAVIEST = 0.1, 3.0


class Knob(NamedTuple):
    """A number that a slider moves.

    Attributes
    ----------
    name : str
        The quantity of the scene, or the field of the map's parameters.
    words : str
        What it is called.
    unit : str
        Its unit; empty for a map.
    value, lo, hi : float
        Where it stands, and the slider's ends, in this unit.
    """

    name: str
    words: str
    unit: str
    value: float
    lo: float
    hi: float

    @property
    def step(self) -> float:
        """What one press of an arrow key moves: a round number, some 400 of them from end to end."""
        rough = (self.hi - self.lo) / STEPS
        ten = 10.0 ** math.floor(math.log10(rough))
        return float(f"{ten * min((1, 2, 5, 10), key=lambda each: abs(each * ten - rough)):.3g}")

    def read(self, text: str) -> float:
        """Read what is typed: a number in the knob's unit, or with a unit of its own.

        Raises
        ------
        LimitsetsError
            It is no such quantity.

        Examples
        --------
        >>> Knob("throw.speed", "speed", "deg/s", 150.0, 100.0, 200.0).read("2.5 rad/s")
        143.23...
        """
        words = text.strip()
        try:
            value = float(words)
        except ValueError:
            if not self.unit:
                raise LimitsetsError(self.words, shown(words), "a number", "correct it") from None
            value = convert(parse(words, find(self.name).dimension, key=self.name), self.unit)
        if not math.isfinite(value):
            raise LimitsetsError(self.words, shown(words), "a finite number", "correct it")
        return value

    @property
    def title(self) -> str:
        """Its name and unit."""
        return f"{self.words} [{self.unit}]" if self.unit else self.words


def knobs_of(scene: Scene) -> tuple[Knob, ...]:
    """List the knobs of a scene: centre of mass or point masses, speed, height, tilt.

    Examples
    --------
    >>> import limitsets as ls
    >>> [knob.words for knob in knobs_of(ls.load("paper-designed"))]
    ['centre of mass, along', 'centre of mass, above', 'speed', 'height of the surface', 'tilt']
    """
    return (*_of_mass(scene), _of_throw(scene), _of_height(scene), *_of_gravity(scene))


def _of_mass(scene: Scene) -> list[Knob]:
    unit, tree = scene.unit, scene.text
    if text_at(tree, "part.mass.center.along") is not None:
        along, above = (scene.value(f"part.mass.center.{word}") for word in ("along", "above"))
        side = tree["part"]["mass"]["center"]["side"]
        left, right = side_ends(len(scene.vertices), side)
        measured = [
            above_side(scene.vertices[left], scene.vertices[right], corner) for corner in scene.vertices
        ]
        reach = [float(each[0]) for each in measured]
        return [
            Knob("part.mass.center.along", "centre of mass, along", unit, along, min(reach), max(reach)),
            Knob(
                "part.mass.center.above",
                "centre of mass, above",
                unit,
                above,
                0.0,
                float(max(m[1] for m in measured)),
            ),
        ]
    found = []
    lo, hi = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    for k in range(min(len(tree["part"]["mass"].get("points", [])), MOST_POINTS)):
        for axis, word in enumerate("xy"):
            name = f"part.mass.points[{k}].{word}"
            ends = float(lo[axis]), float(hi[axis])
            found.append(Knob(name, f"point mass {k}, {word}", unit, scene.value(name), *ends))
        name = f"part.mass.points[{k}].mass"
        text, own = text_at(tree, name), unit_read(tree, unit, name)
        mass = convert(parse(text, "mass"), own)
        found.append(Knob(name, f"point mass {k}, mass", own, mass, LIGHTEST * mass, HEAVIEST * mass))
    return found


def _of_throw(scene: Scene) -> Knob:
    if scene.gravity is None:
        return Knob("throw.kappa", "kappa", scene.unit, scene.kappa, 0.5 * scene.kappa, 1.5 * scene.kappa)
    speed = math.degrees(scene.value("throw.speed"))
    return Knob("throw.speed", "speed", "deg/s", speed, 0.7 * speed, 1.3 * speed)


def _of_height(scene: Scene) -> Knob:
    height, reach = scene.surface_height, 0.05 * scene.arm_length
    lo, hi = min(-reach, 1.5 * height), max(reach, 1.5 * height)
    return Knob("arm.surface_height", "height of the surface", scene.unit, height, lo, hi)


def _of_gravity(scene: Scene) -> list[Knob]:
    """Give the tilt of the table; none where gravity is unknown, or stronger than a tilt could make it."""
    if scene.gravity is None:
        return []
    sine = scene.gravity / convert(parse(STANDARD_GRAVITY, "acceleration"), f"{scene.unit}/s^2")
    if sine > 1.0 + 1e-9:
        return []
    return [Knob("gravity.tilt", "tilt", "deg", math.degrees(math.asin(min(sine, 1.0))), 5.0, 90.0)]


def texts_of(knobs: tuple[Knob, ...], values: Mapping[str, float]) -> dict[str, str]:
    """Write the values that differ from where the knobs stood, with their units."""
    units = {knob.name: knob for knob in knobs}
    return {
        name: written(value, units[name].unit) for name, value in values.items() if value != units[name].value
    }


def scene_with(scene: Scene, knobs: tuple[Knob, ...], values: Mapping[str, float]) -> Scene:
    """Give the scene with its knobs at other values; one that was not moved stays as it is written.

    A tilt that is moved leaves the speed of the machine as it is, whether the scene gives a speed or kappa.

    Raises
    ------
    SceneError
        There is no such scene.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> scene_with(scene, knobs_of(scene), {"gravity.tilt": 90.0}).kappa  # twice the gravity of 30 deg
    50.75...
    """
    texts = texts_of(knobs, values)
    if "gravity.tilt" in texts and "throw.speed" not in texts:
        texts["throw.speed"] = written(
            next(each.value for each in knobs if each.name == "throw.speed"), "deg/s"
        )
    return scene.with_values(texts) if texts else scene


def centre_at(scene: Scene, x: float, y: float) -> dict[str, float]:
    """Say where a point of the part's frame is along and above the side from which the scene gives its centre of mass.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = centre_at(ls.load("paper-designed"), *ls.load("paper-designed").centre)
    >>> [round(value, 6) for value in found.values()]
    [4.225578, 0.708249]
    """
    left, right = side_ends(len(scene.vertices), scene.text["part"]["mass"]["center"]["side"])
    along, above, _ = above_side(scene.vertices[left], scene.vertices[right], (x, y))
    return {"part.mass.center.along": float(along), "part.mass.center.above": float(above)}


def knobs_of_map(params: Any) -> tuple[Knob, ...]:
    """List the numbers among a map's parameters.

    Examples
    --------
    >>> from limitsets import maps
    >>> [(knob.name, knob.lo, knob.hi) for knob in knobs_of_map(maps.Henon())]
    [('a', 0.7, 2.1), ('b', 0.15, 0.45)]
    """
    found = []
    for name, value in zip(params._fields, params, strict=True):
        if isinstance(value, float | int | np.floating):
            ends = sorted((0.5 * float(value), 1.5 * float(value))) if value else [-1.0, 1.0]
            found.append(Knob(name, name, "", float(value), round(ends[0], 9), round(ends[1], 9)))
    return tuple(found)


def map_with(params: Any, values: Mapping[str, float]) -> Any:
    """Give the map with other parameters."""
    return params._replace(**{name: float(value) for name, value in values.items()})
