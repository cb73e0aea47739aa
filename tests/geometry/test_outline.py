"""Plates with notches and holes: hull, mass by integrals over boundaries, and the largest radius of gyration."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from limitsets.feeder.geometry import Hole, hull_corners, largest_radius, mass_of, plate_with_points

# A base with a notch: vertices 1 to 4 stand on or above the edge from 0 to 5 of the hull.
NOTCHED = [(0, 0), (2, 0), (2, 1), (3, 1), (3, 0), (5, 0), (5, 4), (0, 4)]
whole = st.integers(-20, 20)


def starred(radii: list[float]) -> list[tuple[float, float]]:
    """A polygon around the origin, counterclockwise: any radii make it simple."""
    angles = 2 * np.pi * np.arange(len(radii)) / len(radii)
    return [(r * math.cos(a), r * math.sin(a)) for r, a in zip(radii, angles, strict=True)]


def by_boundary(vertices: list[tuple[float, float]]) -> np.ndarray:
    """Area, first moments and polar moment about the origin: Green's theorem, Gauss-Legendre along each edge."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    total = np.zeros(4)
    for (x0, y0), (x1, y1) in zip(vertices, [*vertices[1:], vertices[0]], strict=True):
        share = 0.5 * (nodes + 1)
        x, y, dy = x0 + share * (x1 - x0), y0 + share * (y1 - y0), 0.5 * weights * (y1 - y0)
        total += [dy @ x, dy @ (x * x / 2), dy @ (x * y), dy @ (x**3 / 3 + x * y * y)]
    return total


@given(st.lists(st.floats(0.3, 3.0), min_size=3, max_size=9), st.floats(-5.0, 5.0))
def test_the_mass_of_any_outline_is_that_of_the_integral_along_its_boundary(
    radii: list[float], at: float
) -> None:
    outline = [(x + at, y - at) for x, y in starred(radii)]
    area, sx, sy, second = by_boundary(outline)
    mass = mass_of(outline, 2.0)
    assert mass.mass == pytest.approx(2.0 * area, rel=1e-12)
    assert mass.centre == pytest.approx((sx / area, sy / area), rel=1e-10, abs=1e-11)
    squared = second / area - (sx / area) ** 2 - (sy / area) ** 2
    assert mass.radius_of_gyration**2 == pytest.approx(squared, rel=1e-9)


def test_holes_take_their_mass_away() -> None:
    """A ring of a disc less a disc, as the limit of a polygon; a frame of two rectangles in closed form."""
    frame = mass_of(
        [(0, 0), (6, 0), (6, 4), (0, 4)], 3.0, holes=[Hole(vertices=[(1, 1), (3, 1), (3, 2), (1, 2)])]
    )
    area, x, y = 24.0 - 2.0, (24 * 3 - 2 * 2) / 22, (24 * 2 - 2 * 1.5) / 22
    moments = 24 * ((36 + 16) / 12 + 9 + 4) - 2 * ((4 + 1) / 12 + 4 + 2.25)
    assert frame.mass == pytest.approx(3.0 * area, rel=1e-15)
    assert frame.centre == pytest.approx((x, y), rel=1e-15)
    assert frame.radius_of_gyration**2 == pytest.approx(moments / 22 - x * x - y * y, rel=1e-14)
    drilled = mass_of([(0, 0), (6, 0), (6, 4), (0, 4)], 1.0, [(5, 1, 2.0)], holes=[Hole((2.0, 2.0), 2.0)])
    disc = math.pi
    total = 24 - disc + 2
    cx, cy = (72 - 2 * disc + 10) / total, (48 - 2 * disc + 2) / total
    second = 24 * (52 / 12 + 13) - disc * (0.5 + 8) + 2 * 26
    assert drilled.centre == pytest.approx((cx, cy), rel=1e-15)
    assert drilled.radius_of_gyration**2 == pytest.approx(second / total - cx * cx - cy * cy, rel=1e-13)
    circle = starred([5.0] * 20_000)
    ring = mass_of(circle, 1.0, holes=[Hole((0.0, 0.0), 6.0)])
    assert ring.radius_of_gyration**2 == pytest.approx((25 + 9) / 2, rel=1e-6)


def test_the_corners_of_the_hull_are_exact() -> None:
    assert hull_corners(NOTCHED) == [0, 5, 6, 7]
    third = Fraction(1, 3)  # three places on a line that doubles miss
    slanted = [(0, 0), (third, third / 10), (10 * third, third), (0, 5)]
    assert hull_corners(slanted) == [0, 2, 3]
    assert hull_corners([*slanted[:1], (third, third / 10 - Fraction(1, 10**30)), *slanted[2:]]) == [
        0,
        1,
        2,
        3,
    ]


@given(st.lists(st.tuples(whole, whole), min_size=3, max_size=30, unique=True))
def test_the_corners_of_the_hull_are_those_of_another_library(points: list[tuple[int, int]]) -> None:
    assume(np.linalg.matrix_rank(np.array(points[1:]) - points[0]) == 2)
    corners = hull_corners(points)
    assert set(corners) <= set(ConvexHull(points).vertices.tolist())
    area = 0.5 * sum(
        points[a][0] * points[b][1] - points[b][0] * points[a][1]
        for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)
    )
    assert area == pytest.approx(ConvexHull(points).volume, rel=1e-12)
    assert corners[0] == min(corners)


def test_a_point_mass_may_bridge_a_notch() -> None:
    outline = np.array(NOTCHED, dtype=float)
    mass = plate_with_points(outline, 1.0, [(2.5, 0.5, 4.0)], hull=outline[[0, 5, 6, 7]])
    assert mass.mass == pytest.approx(20 - 1 + 4)


@given(st.lists(st.floats(0.0, 2 * np.pi), min_size=3, max_size=9, unique=True), st.data())
def test_the_largest_radius_is_the_optimum_of_the_linear_program(
    angles: list[float], data: st.DataObject
) -> None:
    angles = sorted(angles)
    turns = np.diff([*angles, angles[0] + 2 * np.pi])
    assume(turns.min() > 0.01)
    points = np.array([(3 * math.cos(a), math.sin(a)) for a in angles])
    weights = np.array([data.draw(st.floats(0.0, 1.0)) for _ in angles])
    assume(weights.sum() > 0.1)
    centre = weights @ points / weights.sum()
    away = ((points - centre) ** 2).sum(axis=1)
    equations = np.vstack([points.T, np.ones(len(points))])
    optimum = linprog(-away, A_eq=equations, b_eq=[*centre, 1.0])
    assume(optimum.success)
    largest = float(largest_radius(points, centre))
    assert largest**2 == pytest.approx(-optimum.fun, rel=1e-8, abs=2e-6)  # its equations hold to 1e-7
    assert weights @ away / weights.sum() <= largest**2 + 1e-14  # rounding of squares up to 10


def test_many_largest_radii_at_once_are_those_of_each() -> None:
    rng = np.random.default_rng(5)
    points = np.array([starred([2.0] * 7)]) * rng.uniform(0.5, 2.0, (50, 1, 2))
    weights = rng.dirichlet(np.ones(7), 50)
    centres = np.einsum("kn,knd->kd", weights, points)
    together = largest_radius(points, centres)
    assert together.shape == (50,)
    alone = [float(largest_radius(*each)) for each in zip(points, centres, strict=True)]
    assert together == pytest.approx(alone, rel=1e-14)
