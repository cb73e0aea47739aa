"""A scene's text as numbers of any kind: floats, spans of rationals, numbers with derivatives.

The tables of part, gravity and throw are read here and nowhere else but in the checker, which trusts nothing of ours.
A kind of number says how a quantity becomes one of it; the formulas are those of `geometry`, written on scalars.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

from limitsets.geometry import Mass, OnSide, mass_of, rest_of, triangle_of
from limitsets.geometry.polygon import Scalar, Vector
from limitsets.scene.quantities import STANDARD_GRAVITY
from limitsets.scene.units import density_dimension


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

    @cached_property
    def shape(self) -> Shape:
        """The part."""
        part: Mapping[str, Any] = self.tree["part"]
        mass, lengths = part["mass"], None
        if "sides" in part:
            lengths = [self.number(f"part.sides[{k}]") for k in range(len(part["sides"]))]
            vertices = self.triangle(lengths)
        else:
            count = len(part["vertices"])
            pairs = [[self.number(f"part.vertices[{k}].{axis}") for axis in "xy"] for k in range(count)]
            vertices = self.polygon([(x, y) for x, y in pairs])
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
        found = self.plate(vertices, density, points)
        return Shape(vertices, found.centre, lengths, found.radius_of_gyration)

    def sides(self, atan2: Callable[[Scalar, Scalar], Scalar]) -> list[tuple[Scalar, ...]]:
        """Return (a, d, length, right, corner) of every side (`limitsets.geometry.rest_of`)."""
        vertices, centre, lengths, _ = self.shape
        return list(rest_of(vertices, centre, lengths, self.sqrt, atan2))

    @cached_property
    def gravity(self) -> Scalar:
        """Gravity in the plane of the motion [unit/s^2]."""
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
