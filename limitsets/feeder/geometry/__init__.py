"""The shape of a part: its polygon, its mass, and the sides it can rest on.

The formulas are written on scalars with ``+ - * /`` and a passed-in ``sqrt`` and ``atan2``, so that the same lines
serve floats, high precision and intervals.  What a person gives is checked first, in floats, and refused with a
`limitsets.errors.GeometryError` that says what is wrong and by how much.

Sides are counted in flip order: with vertices ``P0 .. P(n-1)`` counterclockwise, side 0 is the edge P0-P1, side 1 the
edge P(n-1)-P0, side 2 the edge P(n-2)-P(n-1), and so on: a flip about the left vertex takes side i to side i + 1.
"""

from limitsets.feeder.geometry.mass import Hole, Mass, largest_radius, mass_of, plate_with_points
from limitsets.feeder.geometry.outline import (
    checked_holes,
    cross,
    hull_corners,
    hull_polygon,
    outline_polygon,
)
from limitsets.feeder.geometry.polygon import (
    OnSide,
    RestingSides,
    convex_polygon,
    heights_inside,
    is_convex,
    is_triangle,
    require_inside,
    require_rest,
    rest_of,
    resting_sides,
    side_ends,
    triangle,
    triangle_of,
)

__all__ = [
    "Hole",
    "Mass",
    "OnSide",
    "RestingSides",
    "checked_holes",
    "convex_polygon",
    "cross",
    "heights_inside",
    "hull_corners",
    "hull_polygon",
    "is_convex",
    "is_triangle",
    "largest_radius",
    "mass_of",
    "outline_polygon",
    "plate_with_points",
    "require_inside",
    "require_rest",
    "rest_of",
    "resting_sides",
    "side_ends",
    "triangle",
    "triangle_of",
]
