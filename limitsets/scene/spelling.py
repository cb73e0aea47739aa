"""The units in which a scene writes its quantities, for what is told of them and for scenes that are made of it."""

from __future__ import annotations

from collections.abc import Iterable

from limitsets.scene.quantities import base_unit, find, text_at
from limitsets.scene.scene import Scene
from limitsets.scene.units import exact_factor, parse, written

# Of what a scene does not write itself.
USUAL = {"angular speed": "deg/s", "angle": "deg"}


def unit_of(scene: Scene, name: str) -> str:
    """Give the unit in which a scene writes a quantity, or the usual one of its dimension.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> unit_of(load("paper-designed"), "throw.kappa"), unit_of(load("paper-designed"), "throw.speed")
    ('in', 'deg/s')
    """
    dimension, text = find(name).dimension, text_at(scene.text, name)
    if text is not None:
        return parse(text, dimension).unit
    return USUAL.get(dimension, base_unit(dimension, scene.unit))


def in_unit_of(scene: Scene, name: str, value: float) -> float:
    """Give a value in the scene's units (`Scene.value`) in the unit that `unit_of` names.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> round(in_unit_of(load("paper-designed"), "throw.speed", 3.141592653589793), 9)
    180.0
    """
    base = base_unit(find(name).dimension, scene.unit)
    unit = unit_of(scene, name)
    return value if unit == base else value * float(exact_factor(base, unit))


def in_units_of(scene: Scene, like: Scene, names: Iterable[str], decimals: int | None = None) -> Scene:
    """Write quantities of a scene in the units of another one, with so many decimals where they are given.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> fast = load("paper-designed").with_values({"throw.speed": 3.0})
    >>> in_units_of(fast, load("paper-designed"), ["throw.speed"], decimals=2).text["throw"]
    {'speed': '171.89 deg/s'}
    """
    values: dict[str, float | str] = {}
    for name in names:
        value, unit = in_unit_of(like, name, scene.value(name)), unit_of(like, name)
        values[name] = written(value, unit) if decimals is None else f"{value:.{decimals}f} {unit}"
    return scene.with_values(values)
