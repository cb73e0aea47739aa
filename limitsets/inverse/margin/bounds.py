"""Bounds of what a search for designs varies: those given, else usual ones that hold the scene's own value."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from limitsets.errors import AnswerError
from limitsets.scene import Scene
from limitsets.scene.quantities import find

Ends = tuple[float | None, float | None]
"""Lowest and highest [scene's units]; None for the usual one."""

USUAL: dict[str, tuple[float, float]] = {
    "part.mass.center.along": (0.05, 0.95),
    "part.mass.center.above": (0.05, 0.6),
    "part.mass.radius_of_gyration": (0.12, 0.4),
    "throw.kappa": (2.2, 8.0),
    "arm.surface_height": (-0.2, -0.005),
}
"""Between what these are sought, in mean side lengths (along: of its side); the speed follows from kappa."""


def bounds_of(
    scene: Scene, vary: Sequence[str] | None = None, given: Mapping[str, Ends] | None = None
) -> dict[str, tuple[float, float]]:
    """Give the bounds of what is varied [scene's units].

    Parameters
    ----------
    scene : Scene
        The scene.
    vary : sequence of str, optional
        Quantities; default those of `given`, else what the scene gives of the mass, the throw and the surface's height.
    given : mapping of str to (float or None, float or None), optional
        Bounds of some of them.

    Raises
    ------
    AnswerError
        Between two bounds there is nothing.

    Examples
    --------
    >>> import limitsets as ls
    >>> bounds_of(ls.load("paper-designed"), given={"throw.speed": (None, 3.0), "arm.length": (20.0, None)})
    {'throw.speed': (2.120469229098313, 3.0), 'arm.length': (20.0, 42.0)}
    """
    given = dict(given or {})
    found = {}
    for name in dict.fromkeys([*(vary or ([] if given else _usual(scene))), *given]):
        lo, hi = (
            own if end is None else float(end)
            for own, end in zip(_own(scene, name), given.get(name, (None, None)), strict=True)
        )
        if not lo < hi:
            raise AnswerError(
                "the bounds", f"{lo:g} to {hi:g}", "a lower and a higher one", "give both", key=name
            )
        found[name] = lo, hi
    return found


def of_the_arm(scene: Scene) -> list[str]:
    """Name what is changed without another part: the throw, as the scene gives it, and the surface's height."""
    return ["throw.speed" if "speed" in scene.text["throw"] else "throw.kappa", "arm.surface_height"]


def _usual(scene: Scene) -> list[str]:
    mass: Mapping[str, Any] = scene.text["part"]["mass"]
    if "center" in mass:
        own = [f"part.mass.{word}" for word in ("center.along", "center.above", "radius_of_gyration")]
    else:
        own = [
            f"part.mass.points[{k}].{word}"
            for k in range(len(mass.get("points", ())))
            for word in ("x", "y", "mass")
        ]
    return [*own, *of_the_arm(scene)]


def _own(scene: Scene, name: str) -> tuple[float, float]:
    """Give bounds of one quantity which hold its value; beyond the usual ones a throw may have half or twice of it."""
    dimension, value = find(name).dimension, scene.value(name)
    corners, size = scene.vertices, float(scene.sides.length.mean())
    half, twice = sorted((0.5 * value, 2.0 * value))
    if name == "throw.speed" and scene.gravity is not None:
        lo, hi = (math.sqrt(scene.gravity / (end * size)) for end in reversed(USUAL["throw.kappa"]))
        return lo if lo <= value else half, hi if value <= hi else twice
    if name in USUAL:
        own = float(scene.sides.length[_side_of_centre(scene)]) if name.endswith("along") else size
        lo, hi = (end * own for end in USUAL[name])
        if name == "throw.kappa":
            return lo if lo <= value else half, hi if value <= hi else twice
        return min(lo, value), max(hi, value)
    if name.startswith("part.mass.points") and name[-1] in "xy":
        axis = "xy".index(name[-1])
        return float(corners[:, axis].min()), float(corners[:, axis].max())
    if name.startswith("part.vertices"):
        return value - 0.2 * size, value + 0.2 * size
    if name == "arm.length":
        return value, 1.5 * value
    if dimension == "angle":
        return 0.5 * value, max(value, min(1.5 * value, math.pi / 2))
    return (0.7 * value, 1.4 * value) if name.startswith("part.sides") else (half, twice)


def _side_of_centre(scene: Scene) -> int:
    centre: Any = scene.text["part"]["mass"]["center"]
    return int(centre.get("side", 0))
