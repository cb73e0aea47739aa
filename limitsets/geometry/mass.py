"""Mass, centre of mass and radius of gyration of a plate with point masses on it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from limitsets.errors import GeometryError
from limitsets.geometry.polygon import Scalar, Vector, require_inside


@dataclass(frozen=True)
class Mass:
    """What the throw needs to know of a part's mass.

    Parameters
    ----------
    mass : scalar
        Total mass [unit of density times length squared].
    centre : pair of scalars
        Centre of mass in the frame of the vertices [length].
    radius_of_gyration : scalar
        About the centre of mass [length].
    """

    mass: Scalar
    centre: Vector
    radius_of_gyration: Scalar


def mass_of(
    vertices: Sequence[Vector],
    density: Scalar,
    points: Sequence[tuple[Scalar, Scalar, Scalar]] = (),
    sqrt: Callable[[Scalar], Scalar] = math.sqrt,
) -> Mass:
    """Add up a convex plate and point masses, without any check.

    Parameters
    ----------
    vertices : sequence of pairs
        Counterclockwise [length].
    density : scalar
        Mass per area of the plate.
    points : sequence of (x, y, mass)
        In the frame of the vertices.
    sqrt : callable
        Square root for these scalars.

    Returns
    -------
    Mass

    Notes
    -----
    The plate is a fan of triangles at the first vertex.  Each triangle has area (u x v)/2, its centre at (u + v)/3 and
    the polar moment m (u^2 + v^2 + (u - v)^2)/36 about that centre.  All summands are positive: nothing cancels.

    Examples
    --------
    >>> mass_of([(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)], 1.0).centre
    (1.5, 1.0)
    """
    origin_x, origin_y = vertices[0]
    arms = [(x - origin_x, y - origin_y) for x, y in vertices[1:]]
    pieces: list[tuple[Scalar, Scalar, Scalar, Scalar]] = []
    for (ux, uy), (vx, vy) in pairwise(arms):
        mass = density * (ux * vy - uy * vx) / 2
        across_x, across_y = ux - vx, uy - vy
        squares = ux * ux + uy * uy + vx * vx + vy * vy + across_x * across_x + across_y * across_y
        pieces.append((mass, (ux + vx) / 3, (uy + vy) / 3, mass * squares / 36))
    pieces += [(mass, x - origin_x, y - origin_y, 0 * mass) for x, y, mass in points]
    total = _sum([mass for mass, _, _, _ in pieces])
    x = _sum([mass * px for mass, px, _, _ in pieces]) / total
    y = _sum([mass * py for mass, _, py, _ in pieces]) / total
    moment = _sum([own + mass * ((px - x) * (px - x) + (py - y) * (py - y)) for mass, px, py, own in pieces])
    return Mass(total, (x + origin_x, y + origin_y), sqrt(moment / total))


def _sum(terms: Sequence[Scalar]) -> Scalar:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total


def plate_with_points(
    vertices: npt.NDArray[np.float64],
    density: float,
    points: Sequence[tuple[float, float, float]] = (),
) -> Mass:
    """Check and add up a plate and the point masses on it.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2)
        A checked polygon [length].
    density : float
        Mass per area [mass/length^2].
    points : sequence of (x, y, mass)
        Point masses inside the part or on its boundary.

    Returns
    -------
    Mass

    Raises
    ------
    GeometryError
        A density or mass that is not above 0, or a point outside the part.

    Examples
    --------
    >>> lead = plate_with_points(np.array([(0, 0), (6, 0), (0, 6)]), 1.0, [(5.0, 0.5, 9.0)])
    >>> lead.mass, lead.centre
    (27.0, (3.0, 1.5))
    """
    if not 0 < density < math.inf:
        raise GeometryError("the density of the plate", density, "a mass per area above 0", "correct it")
    for index, (x, y, mass) in enumerate(points):
        if not 0 < mass < math.inf:
            raise GeometryError(f"the mass of point {index}", mass, "a mass above 0", "correct it")
        require_inside(vertices, (x, y), f"point mass {index}")
    corners: list[Vector] = [(x, y) for x, y in np.asarray(vertices, dtype=np.float64).tolist()]
    return mass_of(corners, density, points)
