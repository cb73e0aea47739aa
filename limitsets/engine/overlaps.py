"""By how much two convex polygons overlap."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

Corners = Sequence[tuple[float, float]]


def depth_of_overlap(one: Corners, two: Corners) -> float:
    """Give the least distance by which one has to move so that two convex polygons only touch; below 0 they are apart.

    Negative values are lower bounds of the distance between them.

    Parameters
    ----------
    one, two : sequence of (float, float)
        Corners, counterclockwise [length].

    Returns
    -------
    float
        [length].

    Source: the theorem of separating axes: two convex polygons are apart if and only if a side's line separates them.

    Examples
    --------
    >>> square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    >>> depth_of_overlap(square, [(x + 0.75, y) for x, y in square])
    0.25
    """
    return min(_along_sides(one, two), _along_sides(two, one))


def _along_sides(one: Corners, two: Iterable[tuple[float, float]]) -> float:
    """Least depth of the other polygon's deepest corner behind a side of this one."""
    others, least = list(two), math.inf
    for (x0, y0), (x1, y1) in zip(one, [*one[1:], one[0]], strict=True):
        along, up = x1 - x0, y1 - y0
        length = math.hypot(along, up)
        depth = max((y - y0) * along - (x - x0) * up for x, y in others) / length
        least = min(least, depth)
    return least
