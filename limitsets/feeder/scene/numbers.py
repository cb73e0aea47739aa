"""A scene's text as numbers of any kind; as floats each is checked, and what cannot be is refused.

The tables of part, gravity and throw are read here and nowhere else but in the checker, which trusts nothing of ours.
A kind of number says how a quantity becomes one of it; the formulas are those of `geometry`, written on scalars.
"""

from __future__ import annotations

import functools
import json
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.base import GeometryError
from limitsets.feeder.geometry import (
    Hole,
    Mass,
    OnSide,
    RestingSides,
    checked_holes,
    convex_polygon,
    hull_corners,
    hull_polygon,
    largest_radius,
    mass_of,
    outline_polygon,
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
from limitsets.feeder.scene.units import convert, density_dimension, exact_factor, parse


class Shape(NamedTuple):
    """A part.

    Parameters
    ----------
    vertices : list of pairs of scalars
        Of the convex hull, counterclockwise [length].
    centre : pair of scalars or OnSide
        Centre of mass [length].
    lengths : list of scalars or None
        Of the sides, where they are given [length].
    radius_of_gyration : scalar
        About the centre of mass [length].
    outline : list of pairs of scalars
        All vertices of the part, counterclockwise [length].
    holes : tuple of Hole
        In a plate.
    """

    vertices: Sequence[Vector]
    centre: Vector | OnSide
    lengths: list[Scalar] | None
    radius_of_gyration: Scalar
    outline: Sequence[Vector]
    holes: tuple[Hole, ...] = ()


class Numbers(ABC):
    """The numbers of one scene, in its unit of length.

    Parameters
    ----------
    tree : mapping
        The scene as text.
    sqrt, sine : callable
        Square root and sine of such numbers.
    pi : scalar
        The number, as one of these.
    """

    def __init__(
        self,
        tree: Mapping[str, Any],
        sqrt: Callable[[Scalar], Scalar],
        sine: Callable[[Scalar], Scalar],
        pi: Scalar = math.pi,
    ) -> None:
        self.tree, self.sqrt, self.sine, self.pi = tree, sqrt, sine, pi

    @abstractmethod
    def number(self, name: str) -> Scalar:
        """Return a quantity by its name."""

    @abstractmethod
    def constant(self, text: str, dimension: str, key: str) -> Scalar:
        """Return what no quantity's name stands for, from its text and the place of the text."""

    def triangle(self, lengths: list[Scalar]) -> Sequence[Vector]:
        """Place the vertices of a triangle."""
        return triangle_of(lengths, self.sqrt)

    def polygon(self, outline: Sequence[Vector]) -> Sequence[Vector]:
        """Return the corners of the convex hull of an outline."""
        return [outline[corner] for corner in self.corners]

    @cached_property
    def corners(self) -> Sequence[int]:
        """Which vertices are corners of the convex hull: of a plate by the decimals of its text, else all."""
        return corners_of(self.tree["part"])

    def on_side(self, vertices: Sequence[Vector]) -> OnSide:
        """Return the centre of mass where it is measured on a side."""
        along, above = (self.number(f"part.mass.center.{word}") for word in ("along", "above"))
        return OnSide(self.tree["part"]["mass"]["center"]["side"], along, above)

    def plate(
        self, outline: Sequence[Vector], holes: tuple[Hole, ...], density: Scalar, points: list[Any]
    ) -> Mass:
        """Add up a plate with holes and the point masses on it."""
        return mass_of(outline, density, points, self.sqrt, holes=holes, pi=self.pi)

    def holes(self, outline: Sequence[Vector]) -> tuple[Hole, ...]:
        """Return the holes in the plate."""
        return tuple(
            self._hole(f"part.holes[{k}]", hole) for k, hole in enumerate(self.tree["part"].get("holes", ()))
        )

    def _hole(self, key: str, hole: Mapping[str, Any]) -> Hole:
        def place(key: str, pair: Sequence[str]) -> Vector:
            x, y = (
                self.constant(text, "length", f"{key}.{axis}") for axis, text in zip("xy", pair, strict=True)
            )
            return x, y

        if "diameter" not in hole:
            pairs = enumerate(hole["vertices"])
            return Hole(vertices=[place(f"{key}.vertices[{j}]", pair) for j, pair in pairs])
        centre = place(f"{key}.center", [hole["center"][axis] for axis in "xy"])
        return Hole(centre, self.constant(hole["diameter"], "length", f"{key}.diameter"))

    def lengths(self) -> list[Scalar] | None:
        """Return the lengths of the sides, where they are given."""
        sides = self.tree["part"].get("sides")
        return None if sides is None else [self.number(f"part.sides[{k}]") for k in range(len(sides))]

    def outline(self, lengths: list[Scalar] | None) -> Sequence[Vector]:
        """Return all vertices, counterclockwise."""
        if lengths is not None:
            return self.triangle(lengths)
        count = len(self.tree["part"]["vertices"])
        pairs = [[self.number(f"part.vertices[{k}].{axis}") for axis in "xy"] for k in range(count)]
        return [(x, y) for x, y in pairs]

    @cached_property
    def shape(self) -> Shape:
        """The part."""
        mass, lengths = self.tree["part"]["mass"], self.lengths()
        outline = self.outline(lengths)
        vertices = outline if lengths is not None else self.polygon(outline)
        if "center" in mass:
            centre = self.on_side(vertices)
            return Shape(vertices, centre, lengths, self.number("part.mass.radius_of_gyration"), outline)
        text = mass["plate_density"]
        density = self.constant(text, density_dimension(text), "part.mass.plate_density")
        if "plate_thickness" in mass:
            density = density * self.constant(mass["plate_thickness"], "length", "part.mass.plate_thickness")
        points = [
            tuple(self.number(f"part.mass.points[{k}].{word}") for word in ("x", "y", "mass"))
            for k in range(len(mass.get("points", ())))
        ]
        holes = self.holes(outline)
        plate = self.plate(outline, holes, density, points)
        return Shape(vertices, plate.centre, lengths, plate.radius_of_gyration, outline, holes)

    def sides(self, atan2: Callable[[Scalar, Scalar], Scalar]) -> list[tuple[Scalar, ...]]:
        """Return (a, d, length, right, corner) of every side (`limitsets.geometry.rest_of`)."""
        vertices, centre, lengths, *_ = self.shape
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


def corners_of(part: Mapping[str, Any]) -> Sequence[int]:
    """Give the corners of the convex hull by their index: of a plate from its decimals, exactly; of others all.

    A part whose mass is measured is convex, or refused.  Of a quantity with a tolerance, two texts, the middle counts.
    """
    vertices = part.get("vertices") or part["sides"]
    if "vertices" not in part or "plate_density" not in part["mass"]:
        return range(len(vertices))
    spans = (text if isinstance(text, list) else [text] for pair in vertices for text in pair)
    return _corners_of_texts(tuple(map(tuple, spans)))


@functools.lru_cache(maxsize=64)  # a scene is read many times in a search, mostly with the same outline
def _corners_of_texts(spans: tuple[tuple[str, ...], ...]) -> tuple[int, ...]:
    middles = [sum(map(_exact_length, span), Fraction(0)) / len(span) for span in spans]
    return tuple(hull_corners(list(zip(middles[::2], middles[1::2], strict=True))))


def _exact_length(text: str) -> Fraction:
    length = parse(text, "length")
    return Fraction(length.number) * exact_factor(length.unit, "m")


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

# Of the largest radius of gyration, a sum of squares over a dozen operations.
ROUNDING = 1e-9

Array = npt.NDArray[np.float64]


class Body(NamedTuple):
    """Shape and mass in the scene's unit."""

    vertices: Array
    centre: tuple[float, float]
    radius_of_gyration: float
    sides: RestingSides
    outline: Array
    holes: tuple[Hole, ...]


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
            signed = key.endswith(SIGNED_POINT)
            return self.resolver.value(key, dimension) if signed else self.resolver.positive(key, dimension)
        # of a scene in um a density in its unit is a small number, and none is ever squared
        value = self.resolver.value(key, dimension, text)
        self.resolver.require(value > 0.0, key, f"this {dimension}", "above 0")
        return value

    def triangle(self, lengths: list[float]) -> Sequence[Vector]:
        """Place the vertices of a triangle."""
        with self.at("part.sides"):
            return _pairs(triangle(lengths))

    def polygon(self, outline: Sequence[Vector]) -> Sequence[Vector]:
        """Return the corners of the convex hull of an outline; of a part whose mass is measured all are."""
        given: Array = np.array(outline, dtype=np.float64).reshape(-1, 2)
        if len(given) and np.ptp(given, axis=0).max() < LEAST:
            allowed = f"at least {LEAST:g} {self.resolver.unit} across"
            raise self.refusal("part.vertices", "the part", "smaller", allowed, "correct the vertices")
        plate = "plate_density" in self.tree["part"]["mass"]
        try:
            with self.at("part.vertices"):
                if plate:
                    return _pairs(hull_polygon(outline_polygon(given), self.corners))
                return _pairs(convex_polygon(given))
        except GeometryError as error:
            if plate or error.thing != "the polygon":
                raise
            corners = json.dumps(hull_of(self.tree["part"]["vertices"], given))
            remedy = (
                f"{error.remedy}: a concave part rests on its convex hull; give plate_density in place of center and "
                f"radius_of_gyration, for a uniform plate of this outline, or give the hull, vertices = {corners}, "
                "and center and radius_of_gyration of the real part (docs/scene.md)"
            )
            raise self.refusal("part.vertices", error.thing, error.value, error.allowed, remedy) from None

    def holes(self, outline: Sequence[Vector]) -> tuple[Hole, ...]:
        """Return the holes in the plate, which lie inside it and apart from each other."""
        with self.at("part.holes"):
            return checked_holes(np.array(outline), super().holes(outline))

    def on_side(self, vertices: Sequence[Vector]) -> OnSide:
        """Return the centre of mass where it is measured on a side."""
        side, last = self.tree["part"]["mass"]["center"]["side"], len(vertices) - 1
        key, remedy = "part.mass.center.side", "name a side of this part"
        self.resolver.require(side <= last, key, "the side", f"0 to {last}", remedy)
        centre = super().on_side(vertices)
        with self.at("part.mass.center"):
            require_inside(np.array(vertices), centre.in_frame(vertices), "the centre of mass")
        return centre

    def plate(
        self, outline: Sequence[Vector], holes: tuple[Hole, ...], density: float, points: list[Any]
    ) -> Mass:
        """Add up a plate with holes and the point masses on it."""
        vertices: Array = np.array(outline)
        with self.at("part.mass.points"):
            return plate_with_points(vertices, density, points, holes, vertices[list(self.corners)])

    @cached_property
    def body(self) -> Body:
        """The part, refused where it cannot rest on each of its sides; with `landing` and `roll` it tips there."""
        pairs, centre, lengths, radius, points, holes = self.shape
        vertices: Array = np.array(pairs)
        outline: Array = np.array(points)
        sides = resting_sides(vertices, centre, lengths)
        with self.at("part.mass.center" if isinstance(centre, OnSide) else "part.mass"):
            effects = self.tree.get("effects", {})
            require_rest(sides, self.resolver.unit, tips=all(effects.get(each) is True for each in TIPPING))
        vertices.flags.writeable = outline.flags.writeable = False
        x, y = centre.in_frame(pairs) if isinstance(centre, OnSide) else centre
        if isinstance(centre, OnSide):
            self._require_possible(radius, _largest(tuple(pairs), (x, y)))
        return Body(vertices, (x, y), radius, sides, outline, holes)

    def _require_possible(self, radius: float, largest: float) -> None:
        """Refuse a radius of gyration that no mass inside the part has about this centre of mass."""
        key, thing = "part.mass.radius_of_gyration", "the radius of gyration"
        allowed = f"at most {largest:.6g} {self.resolver.unit}, that of masses in the corners alone"
        remedy = "no part of this outline with this centre of mass has a larger one; correct it"
        self.resolver.require(radius <= largest * (1 + ROUNDING), key, thing, allowed, remedy)

    @cached_property
    def kappa(self) -> float:
        """Gravity over the squared angular speed of the throw [length]."""
        ratio: float = super().kappa
        good = "kappa" in self.tree["throw"] or LEAST <= ratio <= 1 / LEAST
        allowed = f"gravity/speed^2 from {LEAST:g} to {1 / LEAST:g} {self.resolver.unit}"
        self.resolver.require(good, "throw.speed", "this angular speed", allowed)
        return ratio


@functools.lru_cache(maxsize=64)  # in a search mostly of the same part
def _largest(vertices: tuple[Vector, ...], centre: Vector) -> float:
    return float(largest_radius(vertices, centre))


def _pairs(vertices: Array) -> list[Vector]:
    return [(x, y) for x, y in vertices.tolist()]


def hull_of(texts: Sequence[Any], vertices: Array) -> list[Any]:
    """Give the corners of the convex hull as they are written, counterclockwise; of no area all of them.

    Examples
    --------
    >>> hull_of("abcd", np.array([[0.0, 0.0], [0.0, 4.0], [1.0, 1.0], [4.0, 0.0]]))
    ['a', 'd', 'b']
    """
    corners = hull_corners(vertices.tolist())
    return [texts[corner] for corner in corners] if len(corners) > 2 else list(texts)
