"""The lines of a drawing joined to closed loops, and their vertices as decimals of which the hull is exact.

What no plate is shaped like (a line that ends, three that meet, two parts, loops that cross) is refused with the place.

The convex hull of the outline decides on which sides the part rests, and that is decided exactly from decimals.  A
notch cut into the base line of a drawing that is turned has its vertices beside this line by rounding; one that is
outside by 1e-12 would be a corner of the hull, and beside it a side on which nothing rests.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from limitsets.base.arrays import Array, Ints
from limitsets.feeder.drawing.curves import SAMPLES, Curve, from_chords, package, require

# All in parts of the drawing's extent.  Ends that are no farther from each other belong together: files are written
# with six digits and more, and nobody cuts a part of 100 mm to 0.0001 mm.
GAP = 1e-6

# A corner of the hull that stands out less is none: it would be one by the digits of the file.
_CORNER = 1e-7

# A vertex so near the line between its neighbours is on it: a thousandth of a gap, and far above any rounding.
_STRAIGHT = 1e-9

# The grid of decimals: floats still tell a hundredth of it apart.
_GRID = 1e-13

_BY_LAYER = "or name the layers of the part with --layer"


@dataclass(frozen=True, eq=False)
class Loop:
    """A closed loop of lines.

    Attributes
    ----------
    points : ndarray (n, 2)
        Its vertices, counterclockwise.
    circle : tuple or None
        Centre (2,) and diameter, where it is one.
    bound : float
        No chord is farther from the drawn curve.
    thickness : float or None
        That all of its lines state.
    """

    points: Array
    circle: tuple[Array, float] | None
    bound: float
    thickness: float | None


def place(point: Any, unit: str) -> str:
    """Write where something is, as errors do."""
    return f"({point[0]:.6g}, {point[1]:.6g}) {unit}"


def joined_loops(curves: Sequence[Curve], extent: float, error: float, unit: str) -> list[Loop]:
    """Join lines at their ends; what is drawn twice counts once.

    Returns
    -------
    list of Loop
        The largest one first.

    Raises
    ------
    AnswerError
        A line that ends, or a place where more than two meet; or no lines but points.
    """
    import networkx as nx

    gap, graph = GAP * extent, nx.MultiGraph()
    places: dict[int, Array] = {}
    ends = np.array([curve.at(np.array([0.0, 1.0])) for curve in curves])
    nodes = _nodes(ends.reshape(-1, 2), gap).reshape(-1, 2).tolist()
    # the ends of straight lines stand in the file as they are, those of arcs are computed
    for k in sorted(range(len(curves)), key=lambda k: not curves[k].straight):
        (one, other), points = nodes[k], curves[k].at(SAMPLES)
        between = [edge["points"] for edge in graph.get_edge_data(one, other, default={}).values()]
        again = any(np.abs(way - drawn).max() <= gap for drawn in between for way in (points, points[::-1]))
        if not again and (one != other or np.ptp(points, axis=0).max() > gap):
            graph.add_edge(one, other, curve=curves[k], start=one, points=points)
            places.setdefault(one, ends[k, 0])
            places.setdefault(other, ends[k, 1])
    require(places, "the drawing", "made of points", "lines of an outline", "draw one")
    loops: list[Loop] = []
    for part in map(graph.subgraph, nx.connected_components(graph)):
        layer = next(curve.layer for _, _, curve in part.edges(data="curve"))
        busy, count = max(part.degree, key=lambda each: each[1])
        where = f"the place {place(places[busy], unit)} on layer {layer!r}"
        meeting = f"one where {count} ends meet"
        require(count <= 2, where, meeting, "two ends at each place", f"delete what is too much, {_BY_LAYER}")
        loose = [place(places[node], unit) for node, count in part.degree if count < 2]
        where = f"the line from {' to '.join(loose)} on layer {layer!r}"
        require(not loose, where, "open", "closed loops", f"join its ends, {_BY_LAYER}")
        edges = [(a, b, part.edges[a, b, key]) for a, b, key in nx.eulerian_circuit(part, keys=True)]
        chain = [(edge["curve"], edge["start"] == a, places[a], places[b]) for a, b, edge in edges]
        loop = _loop(chain, error, extent)
        # a circle that is drawn twice may begin anywhere
        if not any(loop.circle and other.circle and _same(loop.circle, other.circle, gap) for other in loops):
            loops.append(loop)
    largest = max(range(len(loops)), key=lambda k: _area(loops[k].points))
    return [loops.pop(largest), *loops]


def _same(one: tuple[Array, float], other: tuple[Array, float], gap: float) -> bool:
    return max(math.dist(one[0], other[0]), abs(one[1] - other[1])) <= gap


def _area(points: Array) -> float:
    """Give the area of a polygon, shape (n, 2), negative where it runs clockwise."""
    (x, y), (u, v) = points.T, np.roll(points, -1, axis=0).T
    return float(x @ v - y @ u) / 2.0


def _nodes(points: Array, gap: float) -> Ints:
    """Give each end, shape (n,), a number: ends within the gap, and what is within it of them, have the same one."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    unlike, where = np.unique(points, axis=0, return_inverse=True)
    near = cKDTree(unlike).query_pairs(gap, output_type="ndarray")
    links = coo_matrix((np.ones(len(near)), tuple(near.T)), shape=(len(unlike), len(unlike)))
    return np.asarray(connected_components(links, directed=False)[1][where.ravel()], dtype=np.int64)


def _loop(chain: Sequence[tuple[Curve, bool, Array, Array]], error: float, extent: float) -> Loop:
    """Make a loop of lines in their order: each with whether it is run forwards, and where it begins and ends."""
    parts, bounds = [], [0.0]
    for curve, forwards, start, end in chain:
        points, bound = curve.chords(error)
        points = points if forwards else points[::-1]
        # its ends are set to those of the lines beside it
        bounds.append(
            0.0 if curve.straight else bound + max(math.dist(points[0], start), math.dist(points[-1], end))
        )
        parts += [start[None], points[1:-1]]
    vertices = without_straight(np.concatenate(parts), _STRAIGHT * extent)
    circles = [curve.circle for curve, *_ in chain]
    one, turn = circles[0], sum(abs(curve.sweep) for curve, *_ in chain)
    # arcs of one circle that close and turn once around are that circle
    round_ = one and all(each and _same(each, one, GAP * extent) for each in circles)
    whole = round_ and math.isclose(turn, math.tau, rel_tol=GAP)
    stated = {curve.thickness for curve, *_ in chain}
    return Loop(
        vertices if _area(vertices) > 0.0 else vertices[::-1],
        one if whole else None,
        max(bounds),
        stated.pop() or None if len(stated) == 1 else None,
    )


def without_straight(points: Array, tolerance: float) -> Array:
    """Drop the vertices of a closed polygon, shape (n, 2), that are on the line between their neighbours.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> without_straight(square, 1e-9).tolist()
    [[2.0, 2.0], [0.0, 2.0], [0.0, 0.0], [2.0, 0.0]]
    """
    # the vertex that is farthest from the middle is a corner, whatever the rounding
    first = int(np.hypot(*(points - points.mean(axis=0)).T).argmax())
    closed, kept = np.concatenate([points[first:], points[: first + 1]]), [0]
    for k in range(2, len(closed)):
        # from all that is dropped, or a bend of many small steps would be taken for straight
        if from_chords(closed[None, kept[-1] : k + 1])[0] > tolerance:
            kept.append(k - 1)
    return np.asarray(closed[kept])


def require_one_plate(loops: Sequence[Loop], extent: float, unit: str) -> None:
    """Refuse loops that are not one outline, the first, and holes in it.

    Raises
    ------
    AnswerError
        A loop that crosses itself, or loops that cross, touch, are beside the outline or within a hole.
    """
    shapely, gap = package("shapely"), GAP * extent
    for loop in loops:
        reason = shapely.is_valid_reason(shapely.Polygon(loop.points)) if len(loop.points) > 2 else "flat"
        spot = next(iter(re.findall(r"\[(\S+) (\S+)\]", reason)), loop.points[0])
        value = f"one that crosses or touches itself at {place([float(each) for each in spot], unit)}"
        remedy = "correct the drawing, or give a smaller --error"
        require(
            reason == "Valid Geometry",
            f"the loop through {place(loop.points[0], unit)}",
            value,
            "one that does not",
            remedy,
        )
    # a circle is its centre, and a distance from it is less by the radius: chords of it would miss what touches it
    shapes = [
        shapely.Point(loop.circle[0]) if loop.circle else shapely.Polygon(loop.points) for loop in loops[1:]
    ]
    radii = np.array([loop.circle[1] / 2.0 if loop.circle else 0.0 for loop in loops[1:]])
    outline = shapely.Polygon(loops[0].points)
    for k, (shape, radius) in enumerate(zip(shapes, radii.tolist(), strict=True), 1):
        _require_apart(
            outline.exterior.distance(shape) - radius > gap, "cross or touch", loops[0], loops[k], unit
        )
        _require_apart(outline.contains(shape), "lie beside each other", loops[0], loops[k], unit)
    if shapes:
        reach = radii + radii.max() + gap
        for one, other in (
            shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=reach).T.tolist()
        ):
            apart = shapes[one].distance(shapes[other]) - radii[one] - radii[other]
            how = "cross, touch or lie within each other"
            _require_apart(one >= other or apart > gap, how, loops[one + 1], loops[other + 1], unit)


def _require_apart(holds: object, how: str, one: Loop, other: Loop, unit: str) -> None:
    spots = f"the loops through {place(one.points[0], unit)} and {place(other.points[0], unit)}"
    allowed = "one outline, and holes in it that are apart"
    require(holds, spots, f"two that {how}", allowed, f"correct the drawing, {_BY_LAYER}")


def grain(points: Array, extent: float) -> float:
    """Give the grid of decimals for coordinates, of any shape: in the distance floats are coarser."""
    return max(_GRID * extent, float(np.spacing(np.abs(points).max())))


def rounded(points: Array, extent: float) -> Array:
    """Round coordinates, of any shape, to the grid of decimals.

    Examples
    --------
    >>> rounded(np.array([12.700000000000001, -1e-30]), 100.0).tolist()
    [12.7, 0.0]
    """
    digits = -math.floor(math.log10(grain(points, extent)))
    return np.array([round(value, digits) + 0.0 for value in points.ravel().tolist()]).reshape(points.shape)


def flush(outline: Array, extent: float) -> Array:
    """Round a polygon, and decide which of its vertices are on sides of its hull.

    Parameters
    ----------
    outline : ndarray (n, 2)
        Vertices, counterclockwise.
    extent : float
        Of the drawing.

    Returns
    -------
    ndarray (n, 2)
        The same vertices on the grid, the lowest one, of several the left one, first.  Those that stand out of the
        hull of the others by less than a ten-millionth of the extent, or are that near to one of its sides, are on
        it or inside, in exact arithmetic of the decimals.

    Raises
    ------
    AnswerError
        All of it is as thin as that.

    Examples
    --------
    >>> base = [[0.0, 0.0], [1.0, -1e-15], [2.0, 1e-15], [3.0, 0.0], [3.0, 2.0], [0.0, 2.0]]
    >>> flush(np.array(base), 3.0)[:4].tolist()
    [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]
    """
    shapely = package("shapely")
    points = rounded(outline, extent)
    points = np.roll(points, -np.lexsort(points.T)[0], axis=0)
    hull = set(map(tuple, shapely.get_coordinates(shapely.convex_hull(shapely.MultiPoint(points))).tolist()))
    corners = np.array([k for k, point in enumerate(points.tolist()) if tuple(point) in hull])
    flat = np.ones(1, bool)
    while flat.any() and len(corners) > 2:
        before, here, after = (points[np.roll(corners, shift)] for shift in (1, 0, -1))
        out = -_depths(here, before, after)
        # the smallest first; those with both neighbours above them are apart, and leave at once
        rank = np.argsort(np.argsort(out, kind="stable"))
        flat = (out < _CORNER * extent) & (rank < np.roll(rank, 1)) & (rank < np.roll(rank, -1))
        corners = corners[~flat]
    allowed = f"a part thicker than {_CORNER:g} of its extent"
    require(len(corners) > 2, "the outline", "a line", allowed, "correct it")
    inside = 100.0 * grain(points, extent)  # the rounding after it is less than one
    for one, other in zip(corners, np.roll(corners, -1), strict=True):
        between = np.arange(one + 1, other + (other <= one) * len(points)) % len(points)
        depths, along = _depths(points[between], points[[one]], points[[other]]), points[other] - points[one]
        for k, depth in zip(between, depths, strict=True):
            if depth < inside and not _on_line(points[one], points[k], points[other]):
                inwards = np.array([-along[1], along[0]]) / np.hypot(*along)
                points[k] = rounded(points[k] + (inside - depth) * inwards, extent)
    return points


def _depths(points: Array, starts: Array, ends: Array) -> Array:
    """Give how far points are to the left of lines, shapes (n, 2)."""
    (x, y), (u, v) = (ends - starts).T, (points - starts).T
    return np.asarray((x * v - y * u) / np.hypot(x, y))


def _on_line(start: Array, point: Array, end: Array) -> bool:
    """Decide exactly, of the decimals that are written, whether three points are on a line."""
    (a, b), (x, y), (c, d) = (
        [Fraction(repr(value)) for value in each.tolist()] for each in (start, point, end)
    )
    return (c - a) * (y - b) == (d - b) * (x - a)
