"""A scene's text as numbers of any kind; as floats each is checked, and what cannot be is refused.

The tables of part, gravity and throw are read here and nowhere else but in the checker, which trusts nothing of ours.
A kind of number says how a quantity becomes one of it; the formulas are those of `geometry`, written on scalars.
"""

from __future__ import annotations

import json
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.base import GeometryError
from limitsets.feeder.geometry import (
    Mass,
    OnSide,
    RestingSides,
    convex_polygon,
    mass_of,
    plate_with_points,
    require_inside,
    require_rest,
    rest_of,
    resting_sides,
    triangle,
    triangle_of,
)
from limitsets.feeder.geometry.polygon import Scalar, Vector
from limitsets.feeder.scene.facts import TIPPING
from limitsets.feeder.scene.quantities import (
    LEAST,
    STANDARD_GRAVITY,
    Resolver,
    base_unit,
    find,
    in_units,
    text_at,
)
from limitsets.feeder.scene.units import convert, density_dimension, parse


class Shape(NamedTuple):
    """A part.

    Parameters
    ----------
    vertices : list of pairs of scalars
        Counterclockwise [length].
    centre : pair of scalars or OnSide
        Centre of mass [length].
    lengths : list of scalars or None
        Of the sides, where they are given [length].
    radius_of_gyration : scalar
        About the centre of mass [length].
    """

    vertices: Sequence[Vector]
    centre: Vector | OnSide
    lengths: list[Scalar] | None
    radius_of_gyration: Scalar


class Numbers(ABC):
    """The numbers of one scene, in its unit of length.

    Parameters
    ----------
    tree : mapping
        The scene as text.
    sqrt, sine : callable
        Square root and sine of such numbers.
    """

    def __init__(
        self, tree: Mapping[str, Any], sqrt: Callable[[Scalar], Scalar], sine: Callable[[Scalar], Scalar]
    ) -> None:
        self.tree, self.sqrt, self.sine = tree, sqrt, sine

    @abstractmethod
    def number(self, name: str) -> Scalar:
        """Return a quantity by its name."""

    @abstractmethod
    def constant(self, text: str, dimension: str, key: str) -> Scalar:
        """Return what no quantity's name stands for, from its text and the place of the text."""

    def triangle(self, lengths: list[Scalar]) -> Sequence[Vector]:
        """Place the vertices of a triangle."""
        return triangle_of(lengths, self.sqrt)

    def polygon(self, vertices: list[Vector]) -> Sequence[Vector]:
        """Return the vertices of a convex polygon."""
        return vertices

    def on_side(self, vertices: Sequence[Vector]) -> OnSide:
        """Return the centre of mass where it is measured on a side."""
        along, above = (self.number(f"part.mass.center.{word}") for word in ("along", "above"))
        return OnSide(self.tree["part"]["mass"]["center"]["side"], along, above)

    def plate(self, vertices: Sequence[Vector], density: Scalar, points: list[Any]) -> Mass:
        """Add up a plate and the point masses on it."""
        return mass_of(vertices, density, points, self.sqrt)

    def lengths(self) -> list[Scalar] | None:
        """Return the lengths of the sides, where they are given."""
        sides = self.tree["part"].get("sides")
        return None if sides is None else [self.number(f"part.sides[{k}]") for k in range(len(sides))]

    def vertices(self, lengths: list[Scalar] | None) -> Sequence[Vector]:
        """Return the vertices, counterclockwise."""
        if lengths is not None:
            return self.triangle(lengths)
        count = len(self.tree["part"]["vertices"])
        pairs = [[self.number(f"part.vertices[{k}].{axis}") for axis in "xy"] for k in range(count)]
        return self.polygon([(x, y) for x, y in pairs])

    @cached_property
    def shape(self) -> Shape:
        """The part."""
        mass, lengths = self.tree["part"]["mass"], self.lengths()
        vertices = self.vertices(lengths)
        if "center" in mass:
            centre = self.on_side(vertices)
            return Shape(vertices, centre, lengths, self.number("part.mass.radius_of_gyration"))
        text = mass["plate_density"]
        density = self.constant(text, density_dimension(text), "part.mass.plate_density")
        if "plate_thickness" in mass:
            density = density * self.constant(mass["plate_thickness"], "length", "part.mass.plate_thickness")
        points = [
            tuple(self.number(f"part.mass.points[{k}].{word}") for word in ("x", "y", "mass"))
            for k in range(len(mass.get("points", ())))
        ]
        plate = self.plate(vertices, density, points)
        return Shape(vertices, plate.centre, lengths, plate.radius_of_gyration)

    def sides(self, atan2: Callable[[Scalar, Scalar], Scalar]) -> list[tuple[Scalar, ...]]:
        """Return (a, d, length, right, corner) of every side (`limitsets.geometry.rest_of`)."""
        vertices, centre, lengths, _ = self.shape
        return list(rest_of(vertices, centre, lengths, self.sqrt, atan2))

    @cached_property
    def gravity(self) -> Scalar:
        """Gravity in the plane of the motion [unit/s^2]; None where it is not given."""
        if "gravity" not in self.tree:
            return None
        if "acceleration" in self.tree["gravity"]:
            return self.number("gravity.acceleration")
        tilt = self.number("gravity.tilt")
        return self.constant(STANDARD_GRAVITY, "acceleration", "gravity") * self.sine(tilt)

    @cached_property
    def kappa(self) -> Scalar:
        """Gravity over the squared angular speed of the throw [length]."""
        if "kappa" in self.tree["throw"]:
            return self.number("throw.kappa")
        speed = self.number("throw.speed")
        return self.gravity / (speed * speed)


class Unchecked(Numbers):
    """The numbers of one scene as floats, as far as they can be read.

    Parameters
    ----------
    tree : mapping
        The scene as text.
    unit : str
        Its unit of length.
    """

    def __init__(self, tree: Mapping[str, Any], unit: str) -> None:
        super().__init__(tree, lambda square: math.sqrt(max(square, 0.0)), math.sin)
        self.unit = unit

    def number(self, name: str) -> float:
        """Return a quantity by its name."""
        return in_units(self.unit, name, text_at(self.tree, name), key=name)

    def constant(self, text: str, dimension: str, key: str) -> float:
        """Return what no quantity's name stands for, from its text."""
        return convert(parse(text, dimension, key=key), base_unit(dimension, self.unit))


# ----------------------------------------------------------------
# The numbers of a scene as floats, each checked: what cannot be is refused with its place and a remedy.


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
    resolver : Resolver
        The scene's text, its unit and file.
    """

    def __init__(self, resolver: Resolver) -> None:
        super().__init__(resolver.tree, math.sqrt, math.sin)
        self.resolver, self.refusal, self.at = resolver, resolver.refusal, resolver.at

    def number(self, name: str) -> float:
        """Return a quantity by its name."""
        signed, dimension = name.startswith(SIGNED) or name.endswith(SIGNED_POINT), find(name).dimension
        if not signed:
            return self.resolver.positive(name, dimension)
        value = self.resolver.value(name, dimension)
        upright = name != "gravity.tilt" or 0 < value <= math.pi / 2
        allowed = "above 0 and up to 90 deg"
        self.resolver.require(upright, name, "the tilt", allowed, "90 deg is an upright table")
        return value

    def constant(self, text: str, dimension: str, key: str) -> float:
        """Return what no quantity's name stands for, from its text and the place of the text."""
        if dimension == "length":
            return self.resolver.positive(key, dimension)
        # of a scene in um a density in its unit is a small number, and none is ever squared
        value = self.resolver.value(key, dimension, text)
        self.resolver.require(value > 0.0, key, f"this {dimension}", "above 0")
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
        key, remedy = "part.mass.center.side", "name a side of this part"
        self.resolver.require(side <= last, key, "the side", f"0 to {last}", remedy)
        centre = super().on_side(vertices)
        with self.at("part.mass.center"):
            require_inside(np.array(vertices), centre.in_frame(vertices), "the centre of mass")
        return centre

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
    def kappa(self) -> float:
        """Gravity over the squared angular speed of the throw [length]."""
        ratio: float = super().kappa
        good = "kappa" in self.tree["throw"] or LEAST <= ratio <= 1 / LEAST
        allowed = f"gravity/speed^2 from {LEAST:g} to {1 / LEAST:g} {self.resolver.unit}"
        self.resolver.require(good, "throw.speed", "this angular speed", allowed)
        return ratio


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
