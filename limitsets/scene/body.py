"""The part of a scene: its shape, its mass, and the sides it rests on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from limitsets.geometry import (
    OnSide,
    RestingSides,
    convex_polygon,
    mass_of,
    plate_with_points,
    require_inside,
    require_rest,
    resting_sides,
    triangle,
    triangle_of,
)
from limitsets.scene.resolve import LEAST, Resolver
from limitsets.scene.units import density_dimension

if TYPE_CHECKING:
    from limitsets.scene.schema import CenterTable, MassTable, PartTable

__all__ = ["Body", "Shape", "resolve_body", "shape_of"]

Shape: TypeAlias = tuple[list[Any], Any, list[Any] | None, Any]
"""Vertices, centre of mass, the sides' lengths where they are given, radius of gyration; in any scalars."""


class Body(NamedTuple):
    """Shape and mass in the scene's unit."""

    vertices: npt.NDArray[np.float64]
    centre: tuple[float, float]
    radius_of_gyration: float
    sides: RestingSides


def resolve_body(table: PartTable, resolver: Resolver) -> Body:
    """Resolve ``[part]``."""
    vertices, lengths = _shape(table, resolver)
    mass = table.mass
    if _by_centre(mass, resolver):
        assert mass.center is not None
        assert mass.radius_of_gyration is not None
        on_side = _centre(mass.center, vertices, resolver)
        corners = [(x, y) for x, y in vertices.tolist()]
        centre = on_side.in_frame(corners)
        with resolver.at("part.mass.center"):
            require_inside(vertices, centre, "the centre of mass")
        radius = resolver.positive(mass.radius_of_gyration, "length", "part.mass.radius_of_gyration")
        sides = resting_sides(vertices, on_side, lengths)
    else:
        centre, radius = _plate(mass, vertices, resolver)
        sides = resting_sides(vertices, centre, lengths)
    with resolver.at("part.mass" if mass.center is None else "part.mass.center"):
        require_rest(sides, resolver.unit)
    vertices.flags.writeable = False
    return Body(vertices, centre, radius, sides)


def shape_of(
    part: Mapping[str, Any],
    number: Callable[[str], Any],
    read: Callable[[str, str], Any],
    sqrt: Callable[[Any], Any],
) -> Shape:
    """Read ``[part]`` of a scene that was checked, in other scalars than floats.

    Parameters
    ----------
    part : mapping
        The table, as text.
    number : callable
        From a quantity's name to its scalar.
    read : callable
        From a text and its dimension to a scalar, for what is no quantity: the plate's density and thickness.
    sqrt : callable
        Square root for these scalars.
    """
    lengths, vertices = None, []
    if "sides" in part:
        lengths = [number(f"part.sides[{k}]") for k in range(3)]
        vertices = list(triangle_of(lengths, sqrt))
    else:
        vertices = [
            tuple(number(f"part.vertices[{k}].{axis}") for axis in "xy") for k in range(len(part["vertices"]))
        ]
    mass = part["mass"]
    if "center" in mass:
        along, above = (number(f"part.mass.center.{word}") for word in ("along", "above"))
        centre = OnSide(mass["center"]["side"], along, above)
        return vertices, centre, lengths, number("part.mass.radius_of_gyration")
    points: list[Any] = [
        tuple(number(f"part.mass.points[{k}].{word}") for word in ("x", "y", "mass"))
        for k in range(len(mass.get("points", ())))
    ]
    density = read(mass["plate_density"], density_dimension(mass["plate_density"]))
    if "plate_thickness" in mass:
        density = density * read(mass["plate_thickness"], "length")
    found = mass_of(vertices, density, points, sqrt)
    return vertices, found.centre, lengths, found.radius_of_gyration


def _shape(table: PartTable, resolver: Resolver) -> tuple[npt.NDArray[np.float64], list[float] | None]:
    if (table.sides is None) == (table.vertices is None):
        found = "neither is given" if table.sides is None else "both are given"
        raise resolver.refusal(
            "part",
            "the shape",
            found,
            "sides = [three lengths] or vertices = [[x, y], ...]",
            "give one of them",
        )
    if table.sides is not None:
        lengths = [
            resolver.positive(text, "length", f"part.sides[{side}]") for side, text in enumerate(table.sides)
        ]
        with resolver.at("part.sides"):
            return triangle(lengths), lengths
    points = [
        [
            resolver.value(text, "length", f"part.vertices[{index}].{axis}")
            for text, axis in zip(pair, "xy", strict=True)
        ]
        for index, pair in enumerate(table.vertices or ())
    ]
    given = np.array(points).reshape(-1, 2)
    if len(given) and np.ptp(given, axis=0).max() < LEAST:
        allowed = f"at least {LEAST:g} {resolver.unit} across"
        raise resolver.refusal("part.vertices", "the part", "smaller", allowed, "correct the vertices")
    with resolver.at("part.vertices"):
        return convex_polygon(given), None


def _by_centre(mass: MassTable, resolver: Resolver) -> bool:
    """Tell how the mass is given; a mixture and half a description are refused."""
    measured = [name for name in ("center", "radius_of_gyration") if getattr(mass, name) is not None]
    plate = ("plate_density", "plate_thickness", "points")
    made = [name for name in plate if getattr(mass, name) is not None]
    allowed = "center and radius_of_gyration, or plate_density and points"
    if measured and made:
        found = " and ".join(measured + made)
        raise resolver.refusal("part.mass", "the mass", found, allowed, "give one of the two, not both")
    if len(measured) == 1 or (not measured and "plate_density" not in made):
        found = f"only {' and '.join(measured + made)}" if measured or made else "empty"
        raise resolver.refusal("part.mass", "the mass", found, allowed, "add what is missing")
    return bool(measured)


def _centre(table: CenterTable, vertices: npt.NDArray[np.float64], resolver: Resolver) -> OnSide:
    last = len(vertices) - 1
    if table.side > last:
        key = "part.mass.center.side"
        raise resolver.refusal(key, "the side", table.side, f"0 to {last}", "name a side of this part")
    return OnSide(
        table.side,
        resolver.value(table.along, "length", "part.mass.center.along"),
        resolver.value(table.above, "length", "part.mass.center.above"),
    )


def _plate(
    mass: MassTable, vertices: npt.NDArray[np.float64], resolver: Resolver
) -> tuple[tuple[float, float], float]:
    density = _density(mass, resolver)
    points = []
    for index, point in enumerate(mass.points or ()):
        key = f"part.mass.points[{index}]"
        x, y = resolver.value(point.x, "length", f"{key}.x"), resolver.value(point.y, "length", f"{key}.y")
        points.append((x, y, resolver.positive(point.mass, "mass", f"{key}.mass")))
    with resolver.at("part.mass.points"):
        found = plate_with_points(vertices, density, points)
    x, y = found.centre
    return (x, y), found.radius_of_gyration


def _density(mass: MassTable, resolver: Resolver) -> float:
    """Give the mass per area, from one per volume where a thickness is given."""
    text, thickness = mass.plate_density, mass.plate_thickness
    assert text is not None
    dimension = density_dimension(text)
    key, keys = "part.mass.plate_density", "part.mass.plate_thickness"
    if dimension == "mass per volume" and thickness is None:
        allowed = "a mass per area, or a mass per volume with plate_thickness"
        raise resolver.refusal(key, "this density", text, allowed, f'add {keys}, like "2 mm"')
    if dimension == "mass per area" and thickness is not None:
        raise resolver.refusal(
            keys,
            "the thickness",
            thickness,
            "one beside a mass per volume",
            f"{text} holds the thickness already: leave it out, or give the density in kg/m^3 or g/cm^3",
        )
    # of a scene in um a density in its unit is a small number, and none is ever squared
    density = resolver.value(text, dimension, key)
    if not density > 0.0:
        raise resolver.refusal(key, f"this {dimension}", text, "above 0", "correct it")
    return density if thickness is None else density * resolver.positive(thickness, "length", keys)
