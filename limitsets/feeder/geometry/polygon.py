"""The shape of a part: its convex polygon, and the sides it can rest on.

Coordinates enter only as differences from a vertex of the part, so that where the origin lies costs no digits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial, reduce
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from limitsets.base import GeometryError, TipsError

Scalar: TypeAlias = Any
"""A float, or anything with ``+ - * /``: an mpmath number, a ball of python-flint, an interval."""
Vector: TypeAlias = tuple[Scalar, Scalar]

FLAT = 1e-12
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


_by_size = partial(sorted, key=float)


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
    return c - (a - b) > FLAT * a


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
    points = checked_points(vertices)
    sine, _, rounds = turning(points)
    _refuse_shape(sine, int(rounds))
    return points


def checked_points(vertices: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Check that vertices are a table of finite numbers, and that no two are the same.

    Raises
    ------
    GeometryError
        With what is wrong.
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
    same = np.argwhere(_repeated(points))
    if len(same):
        first, second = same[0].tolist()
        raise GeometryError(
            f"vertex {second}",
            points[second].tolist(),
            "vertices that all differ",
            f"it repeats vertex {first}; leave one of them out (the last vertex is joined to the first by itself)",
        )
    return points


def is_convex(points: npt.NDArray[np.float64]) -> Any:
    """Whether vertices, of shape (..., n, 2), are those of convex polygons, counterclockwise.

    Examples
    --------
    >>> is_convex(np.array([[(0, 0), (2, 0), (2, 1)], [(0, 0), (2, 1), (2, 0)]], dtype=float))
    array([ True, False])
    """
    sine, _, rounds = turning(points)
    return ~_repeated(points).any(axis=(-2, -1)) & (sine > FLAT).all(axis=-1) & (rounds == 1)


def turning(points: npt.NDArray[np.float64]) -> tuple[npt.NDArray[np.float64], ...]:
    """Return sine and cosine of the turn at each vertex, and how often the boundary turns round."""
    edges = np.roll(points, -1, axis=-2) - points
    unit = edges / np.hypot(edges[..., 0], edges[..., 1])[..., None]
    before = np.roll(unit, 1, axis=-2)
    sine = before[..., 0] * unit[..., 1] - before[..., 1] * unit[..., 0]
    cosine = (before * unit).sum(axis=-1)
    return sine, cosine, np.rint(np.arctan2(sine, cosine).sum(axis=-1) / (2 * math.pi))


def _repeated(points: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Whether vertices are one and the same, for each pair of them."""
    relative = points - points[..., :1, :]
    size = np.abs(relative).max(axis=(-2, -1))
    gap = np.abs(relative[..., :, None, :] - relative[..., None, :, :]).max(axis=-1)
    return np.triu(gap <= FLAT * size[..., None, None], k=1)


def _refuse_shape(sine: npt.NDArray[np.float64], rounds: int) -> None:
    """Refuse what is not convex and counterclockwise; the boundary of such a part turns left, once around."""
    flat = np.flatnonzero(np.abs(sine) <= FLAT)
    left = int((sine > 0).sum())
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
        raise GeometryError(
            "the boundary",
            f"{rounds} turns",
            "one turn to the left around the part",
            "it crosses itself; give the vertices in order, counterclockwise",
        )
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
    longest = reduce(np.maximum, [length for _, _, length in measured])
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


# ----------------------------------------------------------------
# The sides a part can rest on: where its centre of mass stands over each.
#
# Notation of the paper (Murphey et al., section 2): resting on side i, the centre of mass is ``a`` right of the left
# bottom vertex and ``d`` above the side.


Array = npt.NDArray[np.float64]


class OnSide(NamedTuple):
    """A point measured from the left end of a side that lies at the bottom.

    Parameters
    ----------
    side : int
        The side, in flip order.
    along, above : scalar
        Distance along the side from its left end, and height above it [length].
    """

    side: int
    along: Scalar
    above: Scalar

    def in_frame(self, vertices: Sequence[Vector], sqrt: Callable[[Scalar], Scalar] = math.sqrt) -> Vector:
        """Give the point in the frame of the vertices.

        Examples
        --------
        >>> OnSide(1, 2.0, 0.5).in_frame([(0.0, 0.0), (4.0, 0.0), (0.0, 3.0)])
        (0.5, 1.0)
        """
        left, right = (vertices[index] for index in side_ends(len(vertices), self.side))
        x, y = right[0] - left[0], right[1] - left[1]
        length = sqrt(x * x + y * y)
        return (
            left[0] + (self.along * x - self.above * y) / length,
            left[1] + (self.along * y + self.above * x) / length,
        )


@dataclass(frozen=True, eq=False)
class RestingSides:
    """Where the centre of mass stands over each side; read-only arrays of shape (n,) in flip order.

    Parameters
    ----------
    a : ndarray, shape (n,)
        Distance along the side from its left vertex to the foot of the centre of mass [length].
    d : ndarray, shape (n,)
        Height of the centre of mass above the side [length].
    length : ndarray, shape (n,)
        Length of the side [length].
    right : ndarray, shape (n,)
        ``length - a`` [length].
    corner : ndarray, shape (n,)
        Exterior angle at the left vertex: by so much the part turns in a flip [rad].
    """

    a: Array
    d: Array
    length: Array
    right: Array
    corner: Array

    def __post_init__(self) -> None:
        for field in fields(self):
            values = np.array(getattr(self, field.name), dtype=np.float64)
            values.flags.writeable = False
            object.__setattr__(self, field.name, values)

    def __len__(self) -> int:
        return len(self.a)

    @property
    def rests(self) -> npt.NDArray[np.bool_]:
        """On which sides the part can rest: the centre of mass stands above the inside of the side."""
        return (self.a > 0) & (self.a < self.length)


def rest_of(
    vertices: Sequence[Vector],
    centre: Vector | OnSide,
    lengths: Sequence[Scalar] | None = None,
    sqrt: Callable[[Scalar], Scalar] = math.sqrt,
    atan2: Callable[[Scalar, Scalar], Scalar] = math.atan2,
) -> list[tuple[Scalar, Scalar, Scalar, Scalar, Scalar]]:
    """Measure the centre of mass over every side, without any check.

    Parameters
    ----------
    vertices : sequence of pairs
        Counterclockwise [length].
    centre : pair of scalars or OnSide
        Centre of mass.  Measured on a side, its two numbers are that side's a and d as they stand.
    lengths : sequence of scalars, optional
        Side lengths in flip order where they are known; computed otherwise.
    sqrt, atan2 : callable
        Functions for these scalars.

    Returns
    -------
    list of (a, d, length, right, corner)
        One for each side, in flip order.
    """
    count = len(vertices)
    ends = [side_ends(count, side) for side in range(count)]
    point = centre.in_frame(vertices, sqrt) if isinstance(centre, OnSide) else centre
    sides = []
    for side, (left, right) in enumerate(ends):
        a, d, length = above_side(vertices[left], vertices[right], point, sqrt)
        if isinstance(centre, OnSide) and side == centre.side:
            a, d = centre.along, centre.above
        if lengths is not None:
            length = lengths[side]
        before = vertices[ends[(side + 1) % count][0]]
        in_x, in_y = vertices[left][0] - before[0], vertices[left][1] - before[1]
        out_x, out_y = vertices[right][0] - vertices[left][0], vertices[right][1] - vertices[left][1]
        corner = atan2(in_x * out_y - in_y * out_x, in_x * out_x + in_y * out_y)
        sides.append((a, d, length, length - a, corner))
    return sides


def resting_sides(
    vertices: npt.NDArray[np.float64],
    centre: Sequence[float] | OnSide,
    lengths: Sequence[float] | None = None,
) -> RestingSides:
    """Measure the centre of mass over every side of a checked polygon.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2)
        Counterclockwise [length].
    centre : pair of floats or OnSide
        Centre of mass, in the frame of the vertices or measured on a side [length].
    lengths : sequence of floats, optional
        Side lengths in flip order where they were given [length].

    Returns
    -------
    RestingSides

    Raises
    ------
    GeometryError
        The side of `centre` does not exist.

    Examples
    --------
    >>> sides = resting_sides(np.array([(0, 0), (4, 0), (0, 3)]), (1.0, 1.0))
    >>> sides.a.tolist(), sides.d.tolist()
    ([1.0, 2.0, 3.0], [1.0, 1.0, 1.0])
    """
    corners: list[Vector] = [(x, y) for x, y in np.asarray(vertices, dtype=np.float64).tolist()]
    if isinstance(centre, OnSide) and not 0 <= centre.side < len(corners):
        allowed = f"0 to {len(corners) - 1}"
        raise GeometryError("the side", centre.side, allowed, "name a side of this part")
    point = centre if isinstance(centre, OnSide) else (centre[0], centre[1])
    return RestingSides(*np.array(rest_of(corners, point, lengths)).T)


def require_rest(sides: RestingSides, unit: str = "", *, tips: bool = False) -> None:
    """Refuse a part that tips over on one of its sides.

    A part rests on side i when its centre of mass stands above the inside of that side: 0 < a_i < L_i and d_i > 0.

    Parameters
    ----------
    sides : RestingSides
        What to check.
    unit : str
        Unit of length, for the message.
    tips : bool
        Whether it may tip over on some sides, for it is followed from there; it still rests on one at least.

    Raises
    ------
    TipsError
        With the first side on which it cannot rest, and by how much it fails.
    GeometryError
        For a centre of mass that is not above every side.
    """
    for side, (a, d, length) in enumerate(
        zip(sides.a.tolist(), sides.d.tolist(), sides.length.tolist(), strict=True)
    ):
        if not d > 0:
            raise GeometryError(
                f"the height of the centre of mass above side {side}",
                f"{d:.6g} {unit}".strip(),
                "above 0",
                "move the centre of mass into the part",
            )
        if 0 < a < length or (tips and sides.rests.any()):
            continue
        end, excess = ("left", -a) if a <= 0 else ("right", a - length)
        raise TipsError(
            f"the foot of the centre of mass on side {side}, from its left end,",
            f"{a:.6g} {unit}".strip(),
            f"between 0 and {f'{length:.6g} {unit}'.strip()}",
            f"the part cannot rest on side {side}: it tips over the {end} end by {f'{excess:.3g} {unit}'.strip()}; "
            "move the centre of mass, draw the part without this edge, or simulate it: add landing = true and "
            "roll = true to [effects], which design, feed, assemble, tray and feedback do not take",
        )
