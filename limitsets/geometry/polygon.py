"""Convex polygons: from vertices, or a triangle from its three side lengths.

Coordinates enter only as differences from a vertex of the part, so that where the origin lies costs no digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from limitsets.errors import GeometryError

Scalar: TypeAlias = Any
"""A float, or anything with ``+ - * /``: an mpmath number, a ball of python-flint, an interval."""
Vector: TypeAlias = tuple[Scalar, Scalar]

_FLAT = 1e-12
"""Sine of the smallest corner: below it rounding decides on which side of an edge a vertex lies."""
_MOST_VERTICES = 1000


def side_ends(count: int, side: int) -> tuple[int, int]:
    """Give the indices of the left and the right vertex of a side that lies at the bottom.

    Examples
    --------
    >>> [side_ends(3, side) for side in range(3)]
    [(0, 1), (2, 0), (1, 2)]
    """
    left = -side % count
    return left, (left + 1) % count


def _by_size(lengths: Sequence[Scalar]) -> Sequence[Scalar]:
    return sorted(lengths, key=float)


def triangle_of(
    lengths: Sequence[Scalar],
    sqrt: Callable[[Scalar], Scalar] = math.sqrt,
    by_size: Callable[[Sequence[Scalar]], Sequence[Scalar]] = _by_size,
) -> tuple[Vector, ...]:
    """Place a triangle's vertices P0 = (0, 0), P1 = (L0, 0) and P2 above, without any check.

    Parameters
    ----------
    lengths : sequence of 3 scalars
        Side lengths in flip order: |P0 P1|, |P2 P0|, |P1 P2|.
    sqrt : callable
        Square root for these scalars.
    by_size : callable
        Sorts three of these scalars, the least first.

    Returns
    -------
    tuple of 3 pairs
        The vertices, counterclockwise, in the unit of the lengths.

    Notes
    -----
    The area is Heron's in Kahan's ordering, which stays accurate for needles (W. Kahan, "Miscalculating Area and
    Angles of a Needle-like Triangle").  The product is symmetric: for intervals that overlap any order is valid.

    Examples
    --------
    >>> triangle_of([4.0, 3.0, 5.0])
    ((0.0, 0.0), (4.0, 0.0), (0.0, 3.0))
    """
    first, second, third = lengths
    c, b, a = by_size(lengths)
    area = sqrt((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))) / 4
    zero = first - first
    x = (first + (second - third) * (second + third) / first) / 2
    return (zero, zero), (first, zero), (x, 2 * area / first)


def triangle(lengths: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Build a triangle from its three side lengths.

    Parameters
    ----------
    lengths : array_like, shape (3,)
        Side lengths in flip order [any unit of length].

    Returns
    -------
    ndarray, shape (3, 2)
        Vertices, counterclockwise, with side 0 on the x axis and its left end at the origin.

    Raises
    ------
    GeometryError
        Not three lengths, one not above 0, or one not below the sum of the other two.

    Examples
    --------
    >>> triangle([3, 4, 5]).tolist()
    [[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]]
    """
    given = np.asarray(lengths, dtype=np.float64)
    if given.shape != (3,):
        raise GeometryError(
            "the number of side lengths",
            int(given.size),
            "3, a triangle",
            "give a part with more sides by its vertices, counterclockwise",
        )
    values: list[float] = given.tolist()
    for side, value in enumerate(values):
        if not 0 < value < math.inf:
            raise GeometryError(f"the length of side {side}", value, "a length above 0", "correct it")
    c, b, a = sorted(values)
    if not is_triangle(values):
        raise GeometryError(
            f"the length of side {values.index(a)}",
            a,
            f"less than the sum of the other two, {b + c:.9g} (the triangle inequality)",
            f"it is too long by {(a - b) - c:.3g}; no triangle has these sides",
        )
    return np.array(triangle_of(values))


def is_triangle(lengths: Sequence[Scalar]) -> Any:
    """Whether three lengths above 0, or arrays of them, are the sides of a triangle.

    Examples
    --------
    >>> is_triangle([3.0, 4.0, 5.0]), is_triangle([1.0, 2.0, 3.0])
    (np.True_, np.False_)
    """
    c, b, a = np.sort(np.array(lengths, dtype=np.float64), axis=0)
    return c - (a - b) > _FLAT * a


def convex_polygon(vertices: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Check that vertices are those of a convex polygon, counterclockwise.

    Parameters
    ----------
    vertices : array_like, shape (n, 2)
        Corners in order, counterclockwise [any unit of length].

    Returns
    -------
    ndarray, shape (n, 2)
        The same vertices as floats.

    Raises
    ------
    GeometryError
        Fewer than three vertices, repeated or collinear ones, clockwise order, an inward corner, or a boundary that
        crosses itself.

    Examples
    --------
    >>> convex_polygon([(0, 0), (2, 0), (2, 1), (0, 1)]).shape
    (4, 2)
    """
    points = np.asarray(vertices, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or not 3 <= len(points) <= _MOST_VERTICES:
        shape = "x".join(str(extent) for extent in points.shape)
        raise GeometryError(
            "the table of vertices",
            shape,
            f"n x 2 with n from 3 to {_MOST_VERTICES}",
            "give a pair [x, y] for each",
        )
    if not np.isfinite(points).all():
        raise GeometryError("a coordinate of a vertex", "not finite", "finite numbers", "correct it")
    _refuse_repeated(points)
    sine, rounds = _turning(points)
    _refuse_shape(sine, int(rounds))
    return points


def is_convex(points: npt.NDArray[np.float64]) -> Any:
    """Whether vertices, of shape (..., n, 2), are those of convex polygons, counterclockwise.

    Examples
    --------
    >>> is_convex(np.array([[(0, 0), (2, 0), (2, 1)], [(0, 0), (2, 1), (2, 0)]], dtype=float))
    array([ True, False])
    """
    sine, rounds = _turning(points)
    return ~_repeated(points).any(axis=(-2, -1)) & (sine > _FLAT).all(axis=-1) & (rounds == 1)


def _turning(points: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return the sine of the turn at each vertex, and how often the boundary turns round."""
    edges = np.roll(points, -1, axis=-2) - points
    unit = edges / np.hypot(edges[..., 0], edges[..., 1])[..., None]
    before = np.roll(unit, 1, axis=-2)
    sine = before[..., 0] * unit[..., 1] - before[..., 1] * unit[..., 0]
    turns = np.arctan2(sine, (before * unit).sum(axis=-1))
    return sine, np.rint(turns.sum(axis=-1) / (2 * math.pi))


def _repeated(points: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Whether vertices are one and the same, for each pair of them."""
    relative = points - points[..., :1, :]
    size = np.abs(relative).max(axis=(-2, -1))
    gap = np.abs(relative[..., :, None, :] - relative[..., None, :, :]).max(axis=-1)
    return np.triu(gap <= _FLAT * size[..., None, None], k=1)


def _refuse_repeated(points: npt.NDArray[np.float64]) -> None:
    same = np.argwhere(_repeated(points))
    if len(same):
        first, second = (int(index) for index in same[0])
        raise GeometryError(
            f"vertex {second}",
            points[second].tolist(),
            "vertices that all differ",
            f"it repeats vertex {first}; leave one of them out (the last vertex is joined to the first by itself)",
        )


def _refuse_shape(sine: npt.NDArray[np.float64], rounds: int) -> None:
    """Refuse what is not convex and counterclockwise; the boundary of such a part turns left, once around."""
    flat = np.flatnonzero(np.abs(sine) <= _FLAT)
    left = int((sine > 0).sum())
    crossing = GeometryError(
        "the boundary",
        f"{rounds} turns",
        "one turn to the left around the part",
        "it crosses itself; give the vertices in order, counterclockwise",
    )
    if len(flat):
        raise GeometryError(
            f"vertex {int(flat[0])}",
            "on a line with its neighbours",
            "corners with an angle",
            "the vertices are collinear there; leave this one out",
        )
    if left == len(sine) and rounds == 1:
        return
    if left == 0 and rounds == -1:
        raise GeometryError("the order of the vertices", "clockwise", "counterclockwise", "reverse the list")
    if abs(rounds) != 1:
        raise crossing
    inward = int(np.flatnonzero(sine * rounds < 0)[0])
    order = "clockwise and " if rounds < 0 else ""
    raise GeometryError(
        "the polygon",
        f"{order}not convex",
        "a convex polygon, counterclockwise",
        f"its boundary turns inward at vertex {inward}",
    )


def above_side(
    left: Vector, right: Vector, point: Vector, sqrt: Callable[[Scalar], Scalar] = math.sqrt
) -> tuple[Scalar, Scalar, Scalar]:
    """Measure a point from the left end of a side: along it, above it, and the side's length.

    Examples
    --------
    >>> above_side((1.0, 1.0), (1.0, 4.0), (0.0, 3.0))
    (2.0, 1.0, 3.0)
    """
    edge_x, edge_y = right[0] - left[0], right[1] - left[1]
    x, y = point[0] - left[0], point[1] - left[1]
    length = sqrt(edge_x * edge_x + edge_y * edge_y)
    return (edge_x * x + edge_y * y) / length, (edge_x * y - edge_y * x) / length, length


def heights_inside(
    corners: Sequence[Vector], point: Vector, sqrt: Callable[[Scalar], Scalar] = math.sqrt
) -> tuple[list[Scalar], Scalar]:
    """Measure a point from every side, inwards, and say by how much rounding may put it outside.

    Rounding moves a point that was given on the boundary by a few units in the last place of the size.
    """
    ends = [side_ends(len(corners), side) for side in range(len(corners))]
    measured = [above_side(corners[left], corners[right], point, sqrt) for left, right in ends]
    longest = measured[0][2]
    for _, _, length in measured[1:]:
        longest = np.maximum(longest, length)
    return [height for _, height, _ in measured], 1e-12 * longest


def require_inside(vertices: npt.NDArray[np.float64], point: Sequence[float], thing: str) -> None:
    """Refuse a point that lies outside the part; the boundary counts as inside.

    Raises
    ------
    GeometryError
        With the side beyond which the point lies, and how far.
    """
    corners: list[Vector] = [(x, y) for x, y in np.asarray(vertices).tolist()]
    heights, slack = heights_inside(corners, (point[0], point[1]))
    side = int(np.argmin(heights))
    height = heights[side]
    if height < -slack:
        raise GeometryError(
            thing,
            f"({point[0]:.9g}, {point[1]:.9g})",
            "a point of the part",
            f"it lies outside, {-height:.6g} [length] beyond side {side}",
        )
