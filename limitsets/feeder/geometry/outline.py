"""The outline of a plate, any simple polygon, the holes in it, and the corners of the hull on which it rests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.base import GeometryError
from limitsets.feeder.geometry.mass import Hole
from limitsets.feeder.geometry.polygon import FLAT, Vector, checked_points, turning

Array = npt.NDArray[np.float64]


def hull_corners(points: Sequence[Vector]) -> list[int]:
    """Give the indices of the corners of a convex hull, counterclockwise, the least one first.

    Parameters
    ----------
    points : sequence of pairs of scalars
        Numbers that compare, as floats and fractions do; of fractions the corners are exact: no point on an edge of
        the hull is one.  Those of a counterclockwise outline have ascending indices.

    Examples
    --------
    >>> hull_corners([(0, 0), (2, 0), (2, 1), (3, 1), (3, 0), (5, 0), (5, 4), (0, 4)])  # a notch in the base
    [0, 5, 6, 7]
    """
    order = sorted(range(len(points)), key=lambda k: tuple(points[k]))

    def chain(indices: Sequence[int]) -> list[int]:
        kept: list[int] = []
        for k in indices:
            while len(kept) > 1 and cross(points[kept[-2]], points[kept[-1]], points[k]) <= 0:
                kept.pop()
            kept.append(k)
        return kept[:-1]

    corners = chain(order) + chain(order[::-1])
    first = corners.index(min(corners))
    return corners[first:] + corners[:first]


def cross(start: Vector, end: Vector, point: Vector) -> Any:
    """Give twice the area of a triangle, positive where the point lies left of the way from start to end.

    Examples
    --------
    >>> cross((0, 0), (2, 0), (1, 3))
    6
    """
    (px, py), (qx, qy), (rx, ry) = start, end, point
    return (qx - px) * (ry - py) - (qy - py) * (rx - px)


def outline_polygon(vertices: npt.ArrayLike) -> Array:
    """Check that vertices are those of a simple polygon, counterclockwise.

    Parameters
    ----------
    vertices : array_like, shape (n, 2)
        In order [any unit of length].

    Returns
    -------
    ndarray, shape (n, 2)
        The same vertices as floats.

    Raises
    ------
    GeometryError
        Fewer than three vertices, repeated ones, a boundary that crosses or touches itself, or clockwise order.

    Examples
    --------
    >>> outline_polygon([(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (0, 3)]).shape
    (6, 2)
    """
    points = checked_points(vertices)
    count = len(points)
    sine, cosine, rounds = turning(points)
    if (sine > FLAT).all() and rounds == 1:  # convex
        return points
    back = np.flatnonzero((np.abs(sine) <= FLAT) & (cosine < 0))
    apart = (np.arange(count)[:, None] - np.arange(count)) % count
    meet = _crossing(points, points) & (apart > 1) & (apart < count - 1)
    if len(back) or meet.any():
        first, second = (int(back[0]), int(back[0])) if len(back) else np.argwhere(meet)[0].tolist()
        where = (
            f"at vertex {first}" if first == second else f"the edges from vertices {first} and {second} meet"
        )
        raise GeometryError(
            "the boundary",
            "one that crosses or touches itself",
            "one turn to the left around the part",
            f"{where}; give the vertices in order, counterclockwise",
        )
    if rounds != 1:
        raise GeometryError("the order of the vertices", "clockwise", "counterclockwise", "reverse the list")
    return points


def hull_polygon(outline: Array, corners: Sequence[int]) -> Array:
    """Give the hull of an outline, and refuse a corner of the hull with an angle that rounding may turn round.

    Raises
    ------
    GeometryError
        With the vertex.

    Examples
    --------
    >>> notched = np.array([(0, 0), (2, 0), (2, 1), (3, 1), (3, 0), (5, 0), (5, 4), (0, 4)], dtype=float)
    >>> len(hull_polygon(notched, hull_corners(notched.tolist())))
    4
    """
    hull = outline[list(corners)]
    flat = np.flatnonzero(turning(hull)[0] <= FLAT)
    if len(flat):
        raise GeometryError(
            f"vertex {corners[int(flat[0])]}",
            "almost on the line of its neighbours in the convex hull",
            "corners of the hull with an angle, or vertices on its edges",
            "put it on that line, or inside",
        )
    return hull


def checked_holes(outline: Array, holes: Sequence[Hole]) -> tuple[Hole, ...]:
    """Check that holes lie inside an outline and apart from each other.

    Raises
    ------
    GeometryError
        With the hole, and what it meets.

    Examples
    --------
    >>> square = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])
    >>> len(checked_holes(square, [Hole((1.0, 1.0), 1.0), Hole((3.0, 3.0), 1.5)]))
    2
    """
    for k, hole in enumerate(holes):
        if hole.centre is None:
            try:
                outline_polygon(hole.vertices)
            except GeometryError as error:
                raise GeometryError(
                    f"hole {k}: {error.thing}", error.value, error.allowed, error.remedy
                ) from None
        inside = _holds(outline, _place(hole)) and not _meets(outline, hole)
        if not inside:
            allowed = "a hole inside the outline, away from its edges"
            raise GeometryError(
                f"hole {k}", "beyond the outline", allowed, "correct it, or draw it as a notch"
            )
        for before, other in enumerate(holes[:k]):
            if _overlap(hole, other):
                allowed = "holes apart from each other"
                remedy = "draw the two as one hole, by vertices"
                raise GeometryError(f"hole {k}", f"one that meets hole {before}", allowed, remedy)
    return tuple(holes)


def _place(hole: Hole) -> Vector:
    """Give a point of a hole."""
    return hole.vertices[0] if hole.centre is None else hole.centre


def _overlap(hole: Hole, other: Hole) -> bool:
    if hole.centre is not None and other.centre is not None:
        return bool(math.dist(hole.centre, other.centre) <= 0.5 * (hole.diameter + other.diameter))
    polygon, second = (hole, other) if hole.centre is None else (other, hole)
    vertices: Array = np.array(polygon.vertices)
    within = second.centre is None and _holds(np.array(second.vertices), polygon.vertices[0])
    return _holds(vertices, _place(second)) or _meets(vertices, second) or within


def _meets(polygon: Array, hole: Hole) -> bool:
    """Whether the boundary of a hole meets that of a polygon, or a circle holds the polygon."""
    if hole.centre is None:
        return bool(_crossing(polygon, np.array(hole.vertices)).any())
    return bool(_distance(polygon, hole.centre) <= 0.5 * hole.diameter)


def _crossing(first: Array, second: Array) -> npt.NDArray[np.bool_]:
    """Whether edges of two polygons have a point in common: entry (i, j) is of edge i of the second, j of the first."""
    a, b = first, np.roll(first, -1, axis=0)
    c, d = second[:, None], np.roll(second, -1, axis=0)[:, None]
    low, high = np.maximum(np.minimum(a, b), np.minimum(c, d)), np.minimum(np.maximum(a, b), np.maximum(c, d))
    p, q, r, s = ((ends[..., 0], ends[..., 1]) for ends in (a, b, c, d))
    across: npt.NDArray[np.bool_] = (cross(p, q, r) * cross(p, q, s) <= 0) & (
        cross(r, s, p) * cross(r, s, q) <= 0
    )
    return across & (low <= high).all(axis=-1)


def _holds(polygon: Array, point: Vector) -> bool:
    """Whether a point lies inside a polygon: a ray from it crosses the boundary an odd number of times."""
    (x0, y0), (x1, y1) = polygon.T, np.roll(polygon, -1, axis=0).T
    over = (y0 > point[1]) != (y1 > point[1])
    left = cross((x0, y0), (x1, y1), point) > 0
    return bool((over & (left == (y1 > y0))).sum() % 2)


def _distance(polygon: Array, point: Vector) -> float:
    """Give the distance of a point from the boundary of a polygon."""
    way = np.roll(polygon, -1, axis=0) - polygon
    to = np.asarray(point) - polygon
    share = np.clip((to * way).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)
    return float(np.hypot(*(to - share[:, None] * way).T).min())
