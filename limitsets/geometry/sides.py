"""The sides a part can rest on: where its centre of mass stands over each.

Notation of the paper (Murphey et al., section 2): resting on side i, the centre of mass is ``a`` right of the left
bottom vertex and ``d`` above the side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.errors import GeometryError, TipsError
from limitsets.geometry.polygon import Scalar, Vector, above_side, side_ends

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
    found = []
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
        found.append((a, d, length, length - a, corner))
    return found


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
    if isinstance(centre, OnSide):
        if not 0 <= centre.side < len(corners):
            raise GeometryError(
                "the side", centre.side, f"0 to {len(corners) - 1}", "name a side of this part"
            )
        return RestingSides(*np.array(rest_of(corners, centre, lengths)).T)
    return RestingSides(*np.array(rest_of(corners, (centre[0], centre[1]), lengths)).T)


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
