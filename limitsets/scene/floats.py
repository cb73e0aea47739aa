"""The numbers of a scene as floats, each checked: what cannot be is refused with its place and a remedy."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.errors import GeometryError
from limitsets.geometry import (
    Mass,
    OnSide,
    RestingSides,
    convex_polygon,
    plate_with_points,
    require_inside,
    require_rest,
    resting_sides,
    triangle,
)
from limitsets.geometry.polygon import Vector
from limitsets.scene.facts import TIPPING
from limitsets.scene.numbers import Numbers
from limitsets.scene.quantities import find, text_at
from limitsets.scene.resolve import LEAST, Resolver

# Quantities that may be 0 or below; of the others so small a number is refused that its square is none.
SIGNED = ("part.vertices", "part.mass.center", "arm.surface_height", "gravity.tilt")
SIGNED_POINT = (".x", ".y")

Array = npt.NDArray[np.float64]


class Body(NamedTuple):
    """Shape and mass in the scene's unit."""

    vertices: Array
    centre: tuple[float, float]
    radius_of_gyration: float
    sides: RestingSides


class Floats(Numbers):
    """The numbers of one scene.

    Parameters
    ----------
    tree : mapping
        The scene as text, its words checked.
    resolver : Resolver
        Its unit and file.
    """

    def __init__(self, tree: Mapping[str, Any], resolver: Resolver) -> None:
        super().__init__(tree, math.sqrt, math.sin)
        self.resolver, self.refusal, self.at = resolver, resolver.refusal, resolver.at

    def number(self, name: str) -> float:
        """Return a quantity by its name."""
        text, dimension = text_at(self.tree, name), find(name).dimension
        signed = name.startswith(SIGNED) or name.endswith(SIGNED_POINT)
        value = (self.resolver.value if signed else self.resolver.positive)(text, dimension, name)
        if name == "gravity.tilt" and not 0 < value <= math.pi / 2:
            allowed = "above 0 and up to 90 deg"
            raise self.refusal(name, "the tilt", text, allowed, "90 deg is an upright table")
        return value

    def constant(self, text: str, dimension: str, key: str) -> float:
        """Return what no quantity's name stands for, from its text and the place of the text."""
        if dimension == "length":
            return self.resolver.positive(text, dimension, key)
        # of a scene in um a density in its unit is a small number, and none is ever squared
        value = self.resolver.value(text, dimension, key)
        if not value > 0.0:
            raise self.refusal(key, f"this {dimension}", text, "above 0", "correct it")
        return value

    def triangle(self, lengths: list[float]) -> Sequence[Vector]:
        """Place the vertices of a triangle."""
        with self.at("part.sides"):
            return _pairs(triangle(lengths))

    def polygon(self, vertices: list[Vector]) -> Sequence[Vector]:
        """Return the vertices of a convex polygon."""
        given: Array = np.array(vertices, dtype=np.float64).reshape(-1, 2)
        if len(given) and np.ptp(given, axis=0).max() < LEAST:
            allowed = f"at least {LEAST:g} {self.resolver.unit} across"
            raise self.refusal("part.vertices", "the part", "smaller", allowed, "correct the vertices")
        try:
            with self.at("part.vertices"):
                return _pairs(convex_polygon(given))
        except GeometryError as error:
            if error.thing != "the polygon":
                raise
            corners = json.dumps(hull_of(self.tree["part"]["vertices"], given))
            remedy = (
                f"{error.remedy}: a concave part rests on its convex hull; give it that outline, vertices = {corners}, "
                "and center and radius_of_gyration of the real part (docs/scene.md)"
            )
            raise self.refusal("part.vertices", error.thing, error.value, error.allowed, remedy) from None

    def on_side(self, vertices: Sequence[Vector]) -> OnSide:
        """Return the centre of mass where it is measured on a side."""
        side, last = self.tree["part"]["mass"]["center"]["side"], len(vertices) - 1
        if side > last:
            key = "part.mass.center.side"
            raise self.refusal(key, "the side", side, f"0 to {last}", "name a side of this part")
        found = super().on_side(vertices)
        with self.at("part.mass.center"):
            require_inside(np.array(vertices), found.in_frame(vertices), "the centre of mass")
        return found

    def plate(self, vertices: Sequence[Vector], density: float, points: list[Any]) -> Mass:
        """Add up a plate and the point masses on it."""
        with self.at("part.mass.points"):
            return plate_with_points(np.array(vertices), density, points)

    @cached_property
    def body(self) -> Body:
        """The part, refused where it cannot rest on each of its sides; with `landing` and `roll` it tips there."""
        pairs, centre, lengths, radius = self.shape
        vertices: Array = np.array(pairs)
        sides = resting_sides(vertices, centre, lengths)
        with self.at("part.mass.center" if isinstance(centre, OnSide) else "part.mass"):
            effects = self.tree.get("effects", {})
            require_rest(sides, self.resolver.unit, tips=all(effects.get(each) is True for each in TIPPING))
        vertices.flags.writeable = False
        x, y = centre.in_frame(pairs) if isinstance(centre, OnSide) else centre
        return Body(vertices, (x, y), radius, sides)

    @cached_property
    def gravity(self) -> float | None:
        """Gravity in the plane of the motion [unit/s^2]; None where it is not given."""
        if "gravity" not in self.tree:
            return None
        found: float = super().gravity
        return found

    @cached_property
    def kappa(self) -> float:
        """Gravity over the squared angular speed of the throw [length]."""
        throw = self.tree["throw"]
        found: float = super().kappa
        if "speed" in throw and not LEAST <= found <= 1 / LEAST:
            allowed = f"gravity/speed^2 from {LEAST:g} to {1 / LEAST:g} {self.resolver.unit}"
            raise self.refusal("throw.speed", "this angular speed", throw["speed"], allowed, "correct it")
        return found


def _pairs(vertices: Array) -> list[Vector]:
    return [(x, y) for x, y in vertices.tolist()]


def hull_of(texts: Sequence[Any], vertices: Array) -> list[Any]:
    """Give the corners of the convex hull as they are written, counterclockwise; of no area all of them.

    Examples
    --------
    >>> hull_of("abcd", np.array([[0.0, 0.0], [0.0, 4.0], [1.0, 1.0], [4.0, 0.0]]))
    ['a', 'd', 'b']
    """
    from scipy.spatial import ConvexHull, QhullError  # lazily: 0.1 s

    try:
        order = ConvexHull(vertices).vertices
        return [texts[corner] for corner in np.roll(order, -np.argmin(order))]
    except QhullError:
        return list(texts)
