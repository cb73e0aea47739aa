"""Mass, centre of mass and radius of gyration of a plate with holes and with point masses on it."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.base import GeometryError
from limitsets.feeder.geometry.polygon import Scalar, Vector, require_inside


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


class Hole(NamedTuple):
    """A hole in a plate: a circle, or a polygon.

    Parameters
    ----------
    centre : pair of scalars or None
        Of a circle, in the frame of the vertices [length].
    diameter : scalar
        Of a circle [length]; 0 of a polygon.
    vertices : sequence of pairs
        Of a polygon, counterclockwise [length].
    """

    centre: Vector | None = None
    diameter: Scalar = 0.0
    vertices: Sequence[Vector] = ()


_sum = partial(reduce, operator.add)

Piece = tuple[Scalar, Scalar, Scalar, Scalar]
"""A mass, where its centre is, and its polar moment about that centre."""


def mass_of(
    vertices: Sequence[Vector],
    density: Scalar,
    points: Sequence[tuple[Scalar, Scalar, Scalar]] = (),
    sqrt: Callable[[Scalar], Scalar] = math.sqrt,
    *,
    holes: Sequence[Hole] = (),
    pi: Scalar = math.pi,
) -> Mass:
    """Add up a plate, the holes in it and point masses, without any check.

    Parameters
    ----------
    vertices : sequence of pairs
        Of the outline, counterclockwise [length].
    density : scalar
        Mass per area of the plate.
    points : sequence of (x, y, mass)
        In the frame of the vertices.
    sqrt : callable
        Square root for these scalars.
    holes : sequence of Hole
        Where the plate has no mass.
    pi : scalar
        The number, as one of these scalars.

    Returns
    -------
    Mass

    Notes
    -----
    A polygon is a fan of triangles at its first vertex.  Each triangle has area (u x v)/2, its centre at (u + v)/3 and
    the polar moment m (u^2 + v^2 + (u - v)^2)/36 about that centre; a disc has m d^2/8.  Of a convex plate without
    holes all summands are positive, and nothing cancels; holes, and triangles beyond a notch, count negative.

    Examples
    --------
    >>> mass_of([(0.0, 0.0), (3.0, 0.0), (3.0, 2.0), (0.0, 2.0)], 1.0).centre
    (1.5, 1.0)
    >>> mass_of([(0, 0), (4, 0), (4, 4), (0, 4)], 1.0, holes=[Hole(vertices=[(0, 0), (2, 0), (2, 4), (0, 4)])]).centre
    (3.0, 2.0)
    """
    origin = vertices[0]
    pieces = _fan(vertices, origin, density)
    for hole in holes:
        if hole.centre is None:
            pieces += _fan(hole.vertices, origin, -density)
        else:
            square = hole.diameter * hole.diameter
            mass = -density * pi * square / 4
            pieces.append((mass, hole.centre[0] - origin[0], hole.centre[1] - origin[1], mass * square / 8))
    pieces += [(mass, x - origin[0], y - origin[1], 0 * mass) for x, y, mass in points]
    total = _sum([mass for mass, _, _, _ in pieces])
    x = _sum([mass * px for mass, px, _, _ in pieces]) / total
    y = _sum([mass * py for mass, _, py, _ in pieces]) / total
    moment = _sum([own + mass * ((px - x) * (px - x) + (py - y) * (py - y)) for mass, px, py, own in pieces])
    return Mass(total, (x + origin[0], y + origin[1]), sqrt(moment / total))


def _fan(vertices: Sequence[Vector], origin: Vector, density: Scalar) -> list[Piece]:
    """Cut a polygon into triangles at its first vertex; centres are measured from `origin`."""
    (first_x, first_y), *others = vertices
    from_x, from_y = first_x - origin[0], first_y - origin[1]
    arms = [(x - first_x, y - first_y) for x, y in others]
    pieces: list[Piece] = []
    for (ux, uy), (vx, vy) in pairwise(arms):
        mass = density * (ux * vy - uy * vx) / 2
        across_x, across_y = ux - vx, uy - vy
        squares = ux * ux + uy * uy + vx * vx + vy * vy + across_x * across_x + across_y * across_y
        pieces.append((mass, from_x + (ux + vx) / 3, from_y + (uy + vy) / 3, mass * squares / 36))
    return pieces


def plate_with_points(
    vertices: npt.NDArray[np.float64],
    density: float,
    points: Sequence[tuple[float, float, float]] = (),
    holes: Sequence[Hole] = (),
    hull: npt.NDArray[np.float64] | None = None,
) -> Mass:
    """Check and add up a plate with holes and the point masses on it.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2)
        A checked outline [length].
    density : float
        Mass per area [mass/length^2].
    points : sequence of (x, y, mass)
        Point masses inside the hull or on its boundary: a weight can bridge a notch or fill a hole.
    holes : sequence of Hole
        Checked holes.
    hull : ndarray, shape (m, 2), optional
        The convex hull of the outline; by default the outline is convex.

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
        require_inside(vertices if hull is None else hull, (x, y), f"point mass {index}")
    corners: list[Vector] = [(x, y) for x, y in np.asarray(vertices, dtype=np.float64).tolist()]
    return mass_of(corners, density, points, holes=holes)


def largest_radius(vertices: npt.ArrayLike, centre: npt.ArrayLike) -> Any:
    """Give the largest radius of gyration that a part of this hull can have about this centre of mass.

    Parameters
    ----------
    vertices : array_like, shape (..., n, 2)
        Of convex polygons, counterclockwise [length].
    centre : array_like, shape (..., 2)
        Centres of mass in them [length].

    Returns
    -------
    ndarray, shape (...)
        [length]

    Notes
    -----
    The squared distance from the centre is convex, so its mean is largest where all mass is in the vertices: with
    weights w of these, sum w = 1, whose mean is the centre.  That is a linear program with three equations, so three
    vertices carry the optimum; the simplex method finds these from a triangle that holds the centre.  Where it stops
    early, the bound by the reduced costs holds all the same (weak duality).

    Examples
    --------
    >>> float(largest_radius([(0, 0), (4, 0), (4, 2), (0, 2)], (2, 1)) ** 2)  # all mass in the corners: 4 + 1
    5.0
    """
    away = np.asarray(vertices, dtype=np.float64) - np.asarray(centre, dtype=np.float64)[..., None, :]
    away = away.reshape(-1, *away.shape[-2:])
    shape = np.broadcast_shapes(np.shape(vertices)[:-2], np.shape(centre)[:-1])
    size = np.abs(away).max(axis=(1, 2), keepdims=True)
    away = away / size
    count, n = away.shape[:2]
    rows, squares = np.arange(count)[:, None], (away**2).sum(axis=2)
    columns = np.concatenate([away, np.ones((count, n, 1))], axis=2)  # an equation each: x, y, the sum
    mean = np.array([0.0, 0.0, 1.0])[:, None]
    fan = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    weights = np.linalg.solve(np.swapaxes(columns[:, fan], 2, 3), mean)[..., 0]
    basis = fan[weights.min(axis=2).argmax(axis=1)]
    for _ in range(4 * n):
        chosen = columns[rows, basis]
        plane = np.linalg.solve(chosen, squares[rows, basis][..., None])
        reduced = squares - (columns @ plane)[..., 0]
        entering = reduced.argmax(axis=1)
        bound = plane[:, 2, 0] + np.maximum(reduced.max(axis=1), 0.0)
        better = reduced.max(axis=1) > 1e-12  # rounding of squares of size 1
        if not better.any():
            break
        ahead = np.stack(
            [np.broadcast_to(mean, (count, 3, 1))[..., 0], columns[rows[:, 0], entering]], axis=2
        )
        weights, rates = np.moveaxis(np.linalg.solve(np.swapaxes(chosen, 1, 2), ahead), 2, 0)
        ratios = np.where(
            rates > 1e-12, np.maximum(weights, 0.0) / np.where(rates > 1e-12, rates, 1.0), np.inf
        )
        leaving = ratios.argmin(axis=1)
        basis[rows[better, 0], leaving[better]] = entering[better]
    return (np.sqrt(np.maximum(bound, 0.0)) * size[:, 0, 0]).reshape(shape)
