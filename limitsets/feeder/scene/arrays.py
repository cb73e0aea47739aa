"""The numbers of a scene at many points at once: quantities vary, the parameters of the throw come out as arrays.

The formulas are those of every other reading (`limitsets.feeder.scene.numbers`), on arrays with one entry per point.
What a single scene refuses with a reason is here a flag: no triangle, a part that cannot rest, a speed that is not
above 0.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.base import SceneError
from limitsets.feeder.geometry import (
    Hole,
    Mass,
    OnSide,
    heights_inside,
    is_convex,
    is_triangle,
    largest_radius,
    triangle_of,
)
from limitsets.feeder.geometry.polygon import Scalar, Vector
from limitsets.feeder.scene.numbers import ROUNDING, SIGNED, SIGNED_POINT, Unchecked, corners_of
from limitsets.feeder.scene.quantities import LEAST, replaced
from limitsets.feeder.scene.scene import Scene, resting_places
from limitsets.feeder.scene.surroundings import Cavity, Tray, heights_over_sides
from limitsets.feeder.scene.units import fits

if TYPE_CHECKING:
    from limitsets.feeder.thrower import Throw


Array = npt.NDArray[np.float64]


class ThrowStack(NamedTuple):
    """Throw maps and their domains at n points, of a part with S sides.

    Attributes
    ----------
    params : Throw
        Stacked: numbers as arrays of shape (n,), one entry per side as (n, S), C-contiguous.
    lo, hi, anchor : ndarray, shape (n, S)
        Where the part can rest on each side, as in `Scene.domain` [length].
    possible : ndarray of bool, shape (n,)
        Where there is such a scene; the other points hold the numbers of the scene as it is.
    """

    params: Throw
    lo: Array
    hi: Array
    anchor: Array
    possible: npt.NDArray[np.bool_]


def throw_stack(scene: Scene, values: Mapping[str, npt.ArrayLike]) -> ThrowStack:
    """Give the throw maps of a scene at many values of some of its quantities.

    Parameters
    ----------
    scene : Scene
        The minimal model: no effect is switched on.
    values : mapping of str to array_like, shape (n,)
        By name of the quantity (`limitsets.scene.NAMES`), in the scene's units as `Scene.value` gives them.

    Returns
    -------
    ThrowStack
        At each possible point the numbers of ``scene.with_values(...)`` to the last bit.

    Raises
    ------
    SceneError
        An unknown quantity, one that this scene is not written in or on which its throws do not depend, or a scene with
        effects.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> found = throw_stack(load("paper-designed"), {"throw.speed": [2.7, 2.8, -1.0]})
    >>> found.params.kappa.round(3).tolist(), found.possible.tolist()
    ([26.481, 24.623, 25.378], [True, True, False])
    """
    if scene.effects.words:
        raise SceneError(
            "the scene", f"with {', '.join(scene.effects.words)}", "the minimal model, for many points at once",
            "leave [effects] out, or track it by a task that takes one scene", file=scene.file,
        )  # fmt: skip
    arrays = {name: np.ascontiguousarray(each, dtype=np.float64) for name, each in values.items()}
    tree = replaced(scene.text, scene.unit, scene.file, dict.fromkeys(arrays, LEAST))
    _require_use(scene, tree, arrays)
    own = scene.bare_map
    count = max(each.size for each in arrays.values()) if arrays else 1
    with np.errstate(all="ignore"):  # where there is no such scene; those points are flagged
        reader = _Arrays(tree, scene.unit, arrays, count)
        reader.corners = corners_of(scene.text["part"])
        numbers = reader.numbers(scene.goal, scene.cavity, scene.tray)
    shaped = scene.holes or len(scene.outline) > len(scene.vertices)
    if shaped and any("vertices" in name for name in arrays):
        rows = zip(*arrays.values(), strict=True)
        reader.require([_is_scene(scene, dict(zip(arrays, row, strict=True))) for row in rows])
    possible = reader.possible

    def kept(array: Array, present: Any) -> Array:
        mask = possible.reshape(-1, *[1] * (array.ndim - 1))
        return np.ascontiguousarray(np.where(mask, array, present))

    fields = {name: kept(array, getattr(own, name)) for name, array in numbers.items()}
    params = repeated(own, count)._replace(**fields)
    lo, hi = resting_places(params.a, params.arm_length[:, None])
    return ThrowStack(params, lo, hi, params.a.copy(), possible)


def _is_scene(scene: Scene, values: Mapping[str, Any]) -> bool:
    """Whether a scene has such values: outlines that cross themselves or a hole have too many ways to do so."""
    try:
        scene.with_values(values)
    except SceneError:
        return False
    return True


def repeated(params: Any, count: int) -> Any:
    """Stack one map's parameters with themselves.

    Examples
    --------
    >>> from limitsets import maps
    >>> repeated(maps.Logistic(3.5), 2)
    Logistic(r=array([3.5, 3.5]))
    """
    if isinstance(params, tuple) and hasattr(params, "_fields"):
        return type(params)(*(repeated(entry, count) for entry in params))
    if not isinstance(params, float | np.ndarray):
        return params
    return np.repeat(np.asarray(params)[None], count, axis=0)


def _require_use(scene: Scene, tree: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
    """Refuse a speed where gravity is not known, and gravity where the throw is given by kappa."""
    if "throw.speed" in arrays and "gravity" not in tree:
        scene.value("throw.speed")  # it says what is missing
    idle = [name for name in arrays if name.startswith("gravity.") and "kappa" in tree["throw"]]
    if idle:
        raise SceneError(
            "the quantity", idle[0], "a quantity on which the throws depend",
            "the throw is given by kappa, which gravity does not enter: give throw.speed", key=idle[0], file=scene.file,
        )  # fmt: skip


def _one_by_one(function: Callable[..., float], entries: int) -> Callable[..., Array]:
    """Apply a function of `math` to each entry: numpy's own differ from it in the last bit on some machines."""
    apply = np.frompyfunc(function, entries, 1)
    return lambda *numbers: np.asarray(apply(*numbers), dtype=np.float64)


def _stacked(points: Sequence[Vector]) -> Array:
    """Put points with entries of shape (...) into an array of shape (..., n, 2)."""
    flat = np.broadcast_arrays(*(entry for point in points for entry in point))
    return np.stack(flat, axis=-1).reshape(*np.shape(flat[0]), len(points), 2)


class _Arrays(Unchecked):
    """The numbers of one scene, some of them arrays."""

    def __init__(self, tree: Mapping[str, Any], unit: str, values: Mapping[str, Array], count: int) -> None:
        super().__init__(tree, unit)
        self.sqrt, self.sine = np.sqrt, _one_by_one(math.sin, 1)
        self.values, self.count = values, count
        self.possible = np.ones(count, dtype=np.bool_)

    def require(self, holds: Any) -> None:
        """Flag the points at which something does not hold."""
        self.possible &= holds

    def number(self, name: str) -> Scalar:
        """Return a quantity by its name."""
        if name not in self.values:
            return super().number(name)
        value = self.values[name]
        good = fits(value) | (value == 0)
        if not (name.startswith(SIGNED) or name.endswith(SIGNED_POINT)):
            good &= value >= LEAST
        if name == "gravity.tilt":
            good &= (value > 0) & (value <= math.pi / 2)
        self.require(good)
        return np.where(good, value, 1.0)

    def triangle(self, lengths: list[Scalar]) -> Sequence[Vector]:
        """Place the vertices of a triangle."""
        given = np.broadcast_arrays(*lengths)
        self.require(is_triangle(given))
        return triangle_of(given, np.sqrt, lambda three: list(np.sort(np.array(three), axis=0)))

    def polygon(self, outline: Sequence[Vector]) -> Sequence[Vector]:
        """Return the corners of the convex hull of an outline."""
        vertices = super().polygon(outline)
        points = _stacked(vertices)
        self.require((np.ptp(points, axis=-2).max(axis=-1) >= LEAST) & is_convex(points))
        return vertices

    def on_side(self, vertices: Sequence[Vector]) -> OnSide:
        """Return the centre of mass where it is measured on a side."""
        centre = super().on_side(vertices)
        self._require_inside(vertices, centre.in_frame(vertices, np.sqrt))
        return centre

    def plate(
        self, outline: Sequence[Vector], holes: tuple[Hole, ...], density: Scalar, points: list[Any]
    ) -> Mass:
        """Add up a plate with holes and the point masses on it."""
        for x, y, _ in points:
            self._require_inside([outline[corner] for corner in self.corners], (x, y))
        return super().plate(outline, holes, density, points)

    def _require_inside(self, vertices: Sequence[Vector], point: Vector) -> None:
        heights, slack = heights_inside(vertices, point, np.sqrt)
        for height in heights:
            self.require(height >= -slack)

    def numbers(self, goal: Any, cavity: Cavity | None, tray: Tray | None) -> dict[str, Array]:
        """Return the fields of the throw map as arrays; the flags are complete then."""
        arm_length = self.number("arm.length")
        a, d, length, right, corner = (
            np.stack([np.broadcast_to(entry, self.count) for entry in column], axis=-1)
            for column in zip(*self.sides(_one_by_one(math.atan2, 2)), strict=True)
        )
        on_arm = a < np.reshape(arm_length, (-1, 1))
        self.require(((d > 0) & (a > 0) & (a < length) & on_arm).all(axis=-1))
        if "gravity" in self.tree:
            self.require(self.gravity > 0)
        vertices, centre, _, radius, *_ = self.shape
        if isinstance(centre, OnSide):
            middle = _stacked([centre.in_frame(vertices, np.sqrt)])[..., 0, :]
            self.require(radius <= largest_radius(_stacked(vertices), middle) * (1 + ROUNDING))
        kappa = self.kappa
        if "speed" in self.tree["throw"]:
            self.require((kappa >= LEAST) & (kappa <= 1 / LEAST))
        if hasattr(goal, "x"):  # a goal beyond the arm is refused
            self.require(goal.x < arm_length)
        wanted = getattr(goal, "side", None)
        fitted = length.min(axis=-1) if wanted is None else length[:, wanted]
        if tray is not None:  # so are depressions that the part does not fit in, or that are deeper than it
            heights = heights_over_sides(self.shape.vertices, np.sqrt, np.maximum)
            highest = functools.reduce(np.maximum, heights) if wanted is None else heights[wanted]
            if "outline" not in self.tree["tray"]:  # that grows with the part
                self.require(tray.floor[1] - tray.floor[0] >= fitted)
            self.require(tray.depression_depth < highest)
        if cavity is not None:  # so is one that the arm overlaps, or that the part does not fit in
            self.require((cavity.position <= arm_length) & (cavity.position > a.max(axis=-1)))
            if not cavity.outline:
                self.require(cavity.width >= fitted)
        by_name = {
            "kappa": kappa,
            "surface_height": self.number("arm.surface_height"),
            "arm_length": arm_length,
            "radius_of_gyration": self.shape.radius_of_gyration,
        }
        fields = {name: np.array(np.broadcast_to(each, self.count)) for name, each in by_name.items()}
        fields |= {"a": a, "d": d, "length": length, "corner": corner}
        for each in (*fields.values(), right):
            self.require(np.isfinite(each).all(axis=tuple(range(1, each.ndim))))
        return fields
