"""The numbers of a scene as dual numbers: what the throw needs, with derivatives by the scene's own quantities.

From the text of the scene through the same formulas of `geometry` that floats and spans of rational numbers go through
(`limitsets.proofs.parameters` is the other reader).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from limitsets.geometry import rest_of
from limitsets.inverse.critical.dual import Dual, sine, square_root
from limitsets.scene import Scene
from limitsets.scene.body import shape_of
from limitsets.scene.quantities import STANDARD_GRAVITY, base_unit
from limitsets.scene.units import convert, parse

__all__ = ["Numbers", "numbers_of", "present", "with_present"]

SPEED, KAPPA = "throw.speed", "throw.kappa"


class Numbers(NamedTuple):
    """What the throw map depends on, in the scene's unit.

    Parameters
    ----------
    a, d, length : list of Dual
        Per side, in flip order (`limitsets.geometry.RestingSides`).
    rho, kappa, h : Dual
        Radius of gyration, gravity over squared speed, signed height of the arm's surface.
    """

    a: list[Dual]
    d: list[Dual]
    length: list[Dual]
    rho: Dual
    kappa: Dual
    h: Dual


def present(scene: Scene, name: str) -> float:
    """Return the value of a quantity in the scene's units; a speed that the scene does not know counts as 1.

    A scene given by kappa without gravity has a speed all the same: only its unit is open, and shares of it are not.
    """
    return 1.0 if _speed_is_open(scene, name) else scene.value(name)


def with_present(scene: Scene, values: Mapping[str, float]) -> Scene:
    """Return the scene with other values; an open speed s times the present one makes kappa 1/s^2 times its own."""
    text: dict[str, float | str] = dict(values)
    if SPEED in values and _speed_is_open(scene, SPEED):
        text[KAPPA] = scene.kappa / values[SPEED] ** 2
        del text[SPEED]
    return scene.with_values(text)


def _speed_is_open(scene: Scene, name: str) -> bool:
    return name == SPEED and scene.gravity is None


def numbers_of(scene: Scene, names: Sequence[str], before: int = 0) -> Numbers:
    """Read a scene's numbers with their derivatives.

    Parameters
    ----------
    scene : Scene
        The scene.
    names : sequence of str
        The quantities to differentiate by, in the scene's units.
    before : int
        How many more directions the derivatives have, before those of `names`; zero here.

    Returns
    -------
    Numbers

    Raises
    ------
    SceneError
        An unknown quantity, one that this scene does not give, or two that exclude each other.
    """
    reader = _Reader(scene, names, before)
    a, d, length, rho = reader.body()
    return Numbers(a, d, length, rho, reader.kappa(), reader.number("arm.surface_height"))


class _Reader:
    def __init__(self, scene: Scene, names: Sequence[str], before: int) -> None:
        self.open_speed = SPEED in names and _speed_is_open(scene, SPEED)
        shown = {name: scene.value(name) for name in names if not (self.open_speed and name == SPEED)}
        # a speed is written in place of kappa, a tilt in place of an acceleration: then it is what counts
        self.scene = scene.with_values(shown)
        self.tree: Any = self.scene.text
        self.names, self.before = list(names), before

    def constant(self, value: float) -> Dual:
        return Dual(value, np.zeros(self.before + len(self.names)))

    def seeded(self, value: float, name: str) -> Dual:
        found = self.constant(value)
        if name in self.names:
            found.slope[self.before + self.names.index(name)] = 1.0
        return found

    def read(self, text: str, dimension: str) -> Dual:
        """Read a text that bears no quantity's name."""
        return self.constant(convert(parse(text, dimension), base_unit(dimension, self.scene.unit)))

    def number(self, name: str) -> Dual:
        return self.seeded(self.scene.value(name), name)

    def kappa(self) -> Dual:
        if "kappa" in self.tree["throw"]:
            kappa = self.number(KAPPA)
            speed = self.seeded(1.0, SPEED)
            return kappa / (speed * speed) if self.open_speed else kappa
        if "acceleration" in self.tree["gravity"]:
            gravity = self.number("gravity.acceleration")
        else:
            gravity = sine(self.number("gravity.tilt")) * self.read(STANDARD_GRAVITY, "acceleration")
        speed = self.number(SPEED)
        return gravity / (speed * speed)

    def body(self) -> tuple[list[Dual], list[Dual], list[Dual], Dual]:
        """Return a, d and the length per side, and the radius of gyration."""
        vertices, centre, lengths, rho = shape_of(self.tree["part"], self.number, self.read, square_root)
        # the throw does not depend on the corners
        sides = rest_of(vertices, centre, lengths, square_root, lambda y, _x: y)
        return [side[0] for side in sides], [side[1] for side in sides], [side[2] for side in sides], rho
