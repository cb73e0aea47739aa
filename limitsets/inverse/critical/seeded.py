"""The parameters of a scene as dual numbers, with derivatives with respect to the scene's quantities.

From the text of the scene by the reading that floats and spans of rational numbers share (`limitsets.scene.numbers`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from limitsets.inverse.critical.dual import MultiDual, sine, square_root
from limitsets.scene import Scene
from limitsets.scene.numbers import Numbers
from limitsets.scene.quantities import base_unit
from limitsets.scene.units import convert, parse

SPEED, KAPPA = "throw.speed", "throw.kappa"


class Seeded(NamedTuple):
    """What the throw map depends on, in the scene's unit.

    Parameters
    ----------
    a, d, length : list of MultiDual
        Per side, in flip order (`limitsets.geometry.RestingSides`).
    rho, kappa, h : MultiDual
        Radius of gyration, gravity over squared speed, signed height of the arm's surface.
    """

    a: list[MultiDual]
    d: list[MultiDual]
    length: list[MultiDual]
    rho: MultiDual
    kappa: MultiDual
    h: MultiDual


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


def numbers_of(scene: Scene, names: Sequence[str], before: int = 0) -> Seeded:
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
    Seeded

    Raises
    ------
    SceneError
        An unknown quantity, one that this scene does not give, or two that exclude each other.
    """
    reader = _Duals(scene, names, before)
    # the throw does not depend on the corners
    a, d, length, *_ = zip(*reader.sides(lambda y, _x: y), strict=True)
    rho, h = reader.shape.radius_of_gyration, reader.number("arm.surface_height")
    return Seeded(list(a), list(d), list(length), rho, reader.kappa, h)


class _Duals(Numbers):
    """The numbers of one scene, differentiated by some of its quantities."""

    def __init__(self, scene: Scene, names: Sequence[str], before: int) -> None:
        self.open_speed = SPEED in names and _speed_is_open(scene, SPEED)
        shown = {name: scene.value(name) for name in names if not (self.open_speed and name == SPEED)}
        # a speed is written in place of kappa, a tilt in place of an acceleration: then it is what counts
        self.scene = scene.with_values(shown)
        super().__init__(self.scene.text, square_root, sine)
        self.names, self.before = list(names), before

    def seeded(self, value: float, name: str = "") -> MultiDual:
        """Return a number, the quantity of this name if it is one."""
        found = MultiDual(value, np.zeros(self.before + len(self.names)))
        if name in self.names:
            found.slope[self.before + self.names.index(name)] = 1.0
        return found

    def constant(self, text: str, dimension: str, key: str = "") -> MultiDual:
        """Return a text of a dimension."""
        return self.seeded(convert(parse(text, dimension), base_unit(dimension, self.scene.unit)))

    def number(self, name: str) -> MultiDual:
        """Return a quantity by its name; kappa by a share of the speed, where nothing else is known of the speed."""
        found = self.seeded(self.scene.value(name), name)
        if name == KAPPA and self.open_speed:
            speed = self.seeded(1.0, SPEED)
            return found / (speed * speed)
        return found
