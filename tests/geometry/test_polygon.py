"""Polygons, their sides, mass and gyration."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, strategies as st

from limitsets.base.errors import GeometryError
from limitsets.feeder.geometry import (
    OnSide,
    convex_polygon,
    plate_with_points,
    require_inside,
    require_rest,
    resting_sides,
    side_ends,
    triangle,
    triangle_of,
)

PAPER = [5.75, 3.6, 6.75]
PENTAGON = [(math.cos(2 * math.pi * k / 5), math.sin(2 * math.pi * k / 5)) for k in range(5)]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def test_sides_come_in_flip_order() -> None:
    """Side 0 is P0-P1, side 1 P(n-1)-P0, side 2 P(n-2)-P(n-1); the left end of side i is the right end of i + 1."""
    assert [side_ends(5, side) for side in range(5)] == [(0, 1), (4, 0), (3, 4), (2, 3), (1, 2)]
    for count in (3, 4, 7):
        for side in range(count):
            assert side_ends(count, side)[0] == side_ends(count, (side + 1) % count)[1]


def test_triangle_has_the_lengths_it_was_given_in_flip_order() -> None:
    corners = triangle(PAPER)
    for side, expected in enumerate(PAPER):
        left, right = side_ends(3, side)
        assert math.dist(corners[left], corners[right]) == pytest.approx(expected, rel=4e-16)
    # the paper calls it right-angled; between its sides 0 and 1 it has 89.36 deg
    angle = math.degrees(math.atan2(corners[2][1], corners[2][0]))
    assert angle == pytest.approx(89.36, abs=0.005)


@pytest.mark.parametrize(
    "lengths", [(1.0, 0.6, 0.4 + 1e-10), (1e-9, 1.0, 1.0), (3.0, 3.0, 3.0), (1e-6, 1e6, 1e6)]
)
def test_height_of_needles_keeps_its_digits(lengths: tuple[float, float, float]) -> None:
    with mpmath.workdps(60):
        a, b, c = (mpmath.mpf(value) for value in lengths)
        half = (a + b + c) / 2
        exact = 2 * mpmath.sqrt(half * (half - a) * (half - b) * (half - c)) / a
    assert triangle_of(lengths)[2][1] == pytest.approx(float(exact), rel=2e-15)


def test_refuses_lengths_of_no_triangle() -> None:
    for lengths, words in (
        ([1, 2], "3, a triangle"),
        ([1, 2, 3, 4], "by its vertices"),
        ([1, 2, 3], "triangle inequality"),
        ([10, 2, 3], "side 0"),
        ([2, 10, 3], "side 1"),
        ([2, 10, 3], r"too long by 5\b"),
        ([2, 0, 3], "side 1"),
        ([2, -1, 3], "above 0"),
        ([math.inf, 1, 1], "above 0"),
        ([math.nan, 1, 1], "above 0"),
    ):
        with pytest.raises(GeometryError, match=words):
            triangle(lengths)


@pytest.mark.parametrize("vertices", [SQUARE, PENTAGON, [(0, 0), (4, 0), (0, 3)]])
def test_accepts_convex_polygons_wherever_they_lie(vertices: list[tuple[float, float]]) -> None:
    for shift in (0.0, 1e6, -3e3):
        assert convex_polygon(np.array(vertices) + shift).shape == (len(vertices), 2)


def test_refuses_what_is_no_convex_polygon() -> None:
    for vertices, words in (
        (SQUARE[::-1], "reverse the list"),
        (PENTAGON[::-1], "clockwise"),
        # the pentagram turns left at every corner
        ([PENTAGON[2 * k % 5] for k in range(5)], "crosses itself"),
        ([PENTAGON[3 * k % 5] for k in range(5)], "crosses itself"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "crosses itself"),  # a bow tie
        ([(0, 0), (2, 0), (0.5, 0.5), (0, 2)], "inward at vertex 2"),
        ([(0, 2), (0.5, 0.5), (2, 0), (0, 0)], "clockwise and not convex"),
        ([(0, 0), (1, 0), (2, 0), (0, 1)], "collinear"),
        ([(0, 0), (0.1, 0.1), (0.3, 0.3), (0, 1)], "collinear"),
        ([(0, 0), (1, 0), (2, 0)], "collinear"),
        ([(0, 0), (2, 0), (1, 0), (0, 1)], "collinear"),  # back on itself
        ([*SQUARE, (0, 0)], "vertex 4"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], "repeats vertex 1"),
        ([(1, 1), (1, 1), (1, 1)], "repeats"),
        ([(0, 0), (1, 0)], "3 to"),
        ([], "3 to"),
        ([0, 1, 2], "pair"),
        ([(0, 0, 0)] * 4, "pair"),
        ([(0, 0), (1, 0), (math.inf, 1)], "finite"),
    ):
        with pytest.raises(GeometryError, match=words):
            convex_polygon(vertices)


def test_boundary_is_inside_and_beyond_it_is_not() -> None:
    square = convex_polygon(SQUARE)
    for point in [(0, 0), (1, 0.5), (0.5, 0), (0.3, 0.9)]:
        require_inside(square, point, "the point")
    with pytest.raises(GeometryError, match=r"the point is .*0\.25 \[length\] beyond side 3"):
        require_inside(square, (1.25, 0.5), "the point")


# along, above on side 2; a and d of the three sides (docs/model.md, the four paper scenes)
SCENES = [
    (3.2444722, 1.7898493, (2.05089, 3.36103, 3.24447), (0.21620, 2.04836, 1.78985)),
    (4.4179581, 0.5040259, (1.74394, 1.65101, 4.41796), (1.92973, 1.72239, 0.50403)),
    (3.9867006, 1.8835981, (1.37302, 3.05205, 3.98670), (0.53272, 1.36702, 1.88360)),
    (4.2255778, 0.7082490, (1.79776, 1.92575, 4.22558), (1.65438, 1.77927, 0.70825)),
]


@pytest.mark.parametrize(("along", "above", "a", "d"), SCENES)
def test_paper_scenes(along: float, above: float, a: tuple[float, ...], d: tuple[float, ...]) -> None:
    sides = resting_sides(triangle(PAPER), OnSide(2, along, above), PAPER)
    np.testing.assert_allclose(sides.a, a, atol=5.1e-6)
    np.testing.assert_allclose(sides.d, d, atol=5.1e-6)
    assert sides.length.tolist() == PAPER
    assert (sides.a[2], sides.d[2]) == (along, above)  # what was given comes back untouched
    np.testing.assert_array_equal(sides.right, sides.length - sides.a)
    require_rest(sides)


def test_unit_square() -> None:
    sides = resting_sides(convex_polygon([(0, 0), (1, 0), (1, 1), (0, 1)]), (0.25, 0.375))
    assert sides.a.tolist() == [0.25, 0.625, 0.75, 0.375]
    assert sides.d.tolist() == [0.375, 0.25, 0.625, 0.75]
    np.testing.assert_allclose(sides.corner, math.pi / 2)
    assert len(sides) == 4
    with pytest.raises(ValueError, match="read-only"):
        sides.a[0] = 1.0


@st.composite
def parts(draw: st.DrawFn) -> tuple[np.ndarray, tuple[float, float]]:
    """Draw corners on an ellipse, at angles that keep apart, and a point among them."""
    count = draw(st.integers(3, 9))
    gaps = [draw(st.floats(0.2, 1.0)) for _ in range(count)]
    angles = np.cumsum(gaps) / sum(gaps) * 2 * math.pi
    corners = np.column_stack([np.cos(angles), draw(st.floats(0.3, 3.0)) * np.sin(angles)])
    weights = np.array([draw(st.floats(0.1, 1.0)) for _ in range(count)])
    x, y = weights @ corners / weights.sum()
    return corners, (float(x), float(y))


@given(parts(), st.floats(-math.pi, math.pi), st.floats(-10, 10))
def test_rests_do_not_depend_on_the_frame(part: tuple, angle: float, shift: float) -> None:
    corners, centre = part
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    here = resting_sides(convex_polygon(corners), centre)
    there = resting_sides(convex_polygon(corners @ turn + shift), np.array(centre) @ turn + shift)
    # where the list of vertices begins moves the numbers of the sides and nothing else
    begun_later = resting_sides(convex_polygon(np.roll(corners, -1, axis=0)), centre)
    for name in ("a", "d", "length", "right", "corner"):
        np.testing.assert_allclose(getattr(there, name), getattr(here, name), atol=1e-12)
        np.testing.assert_allclose(getattr(begun_later, name), np.roll(getattr(here, name), 1), atol=1e-13)
    assert here.corner.sum() == pytest.approx(2 * math.pi)


@given(parts(), st.integers(0, 8))
def test_centre_measured_on_any_side_is_the_same_point(part: tuple, side: int) -> None:
    corners, centre = part
    by_point = resting_sides(corners, centre)
    side %= len(corners)
    by_side = resting_sides(corners, OnSide(side, by_point.a[side], by_point.d[side]))
    np.testing.assert_allclose(by_side.a, by_point.a, atol=1e-13)
    np.testing.assert_allclose(by_side.d, by_point.d, atol=1e-13)


def test_part_that_cannot_rest_says_where_and_by_how_much() -> None:
    for centre, words in (
        ((-0.5, 0.5), "side 0, .*tips over the left end by 0.5 in"),
        ((4.25, 0.5), "side 0, .*right end by 0.25 in"),
        ((1.0, 0.0), "height .* side 0 is '0 in'"),
        ((1.0, -0.5), "height .* side 0 is '-0.5 in'"),
    ):
        slanted = convex_polygon([(0, 0), (4, 0), (7, 3), (-3, 3)])
        with pytest.raises(GeometryError, match=words):
            require_rest(resting_sides(slanted, centre), "in")


def test_refuses_a_side_that_is_not_there() -> None:
    with pytest.raises(GeometryError, match="0 to 2"):
        resting_sides(triangle(PAPER), OnSide(3, 1.0, 1.0))


CIRCLE = np.linspace(0, 2 * math.pi, 400, endpoint=False)


@pytest.mark.parametrize(
    ("corners", "density", "mass", "centre", "gyration", "within"),
    [
        (np.array([(0, 0), (3, 0), (3, 2), (0, 2)]), 0.5, 3.0, (1.5, 1.0), math.sqrt((9 + 4) / 12), 1e-12),
        (triangle([2, 2, 2]), 1.0, math.sqrt(3), (1.0, 1 / math.sqrt(3)), 2 / math.sqrt(12), 1e-12),
        (np.stack([np.cos(CIRCLE), np.sin(CIRCLE)], 1), 1.0, math.pi, (0.0, 0.0), math.sqrt(0.5), 1e-4),
    ],
    ids=["rectangle", "equilateral triangle", "circle by a fine polygon"],
)
def test_plates_with_known_moments(corners, density, mass, centre, gyration, within) -> None:
    found = plate_with_points(corners, density)
    assert found.mass == pytest.approx(mass, rel=within)
    assert found.centre == pytest.approx(centre, abs=within)
    assert found.radius_of_gyration == pytest.approx(gyration, rel=within)


def test_paper_plate_and_its_lead_weight() -> None:
    """docs/model.md: plate 1.595; with a point mass of 65 % of the total 1.14 (initial) and 1.01 (designed)."""
    corners = triangle([5.75, 3.6, 6.75])
    plate = plate_with_points(corners, 1.0)
    assert plate.radius_of_gyration == pytest.approx(1.595, abs=5e-4)
    for along, above, radius in [(3.9867006, 1.8835981, 1.14), (4.2255778, 0.7082490, 1.01)]:
        wanted = OnSide(2, along, above).in_frame([tuple(corner) for corner in corners.tolist()])
        point = [(w - 0.35 * p) / 0.65 for w, p in zip(wanted, plate.centre, strict=True)]
        lead = plate_with_points(corners, 1.0, [(point[0], point[1], plate.mass * 65 / 35)])
        assert lead.centre == pytest.approx(wanted, rel=1e-12)
        assert lead.radius_of_gyration == pytest.approx(radius, abs=5e-3)


def test_origin_costs_no_digits() -> None:
    corners = np.array([(0.0, 0.0), (4.0, 0.0), (0.0, 3.0)])
    near = plate_with_points(corners, 1.0, [(1.0, 1.0, 2.0)])
    far = plate_with_points(corners + 2.0**20, 1.0, [(1.0 + 2.0**20, 1.0 + 2.0**20, 2.0)])
    assert far.radius_of_gyration == near.radius_of_gyration


def test_refuses_masses_that_cannot_be() -> None:
    for density, points, words in (
        (0.0, [], "density"),
        (-1.0, [], "density"),
        (math.nan, [], "density"),
        (1.0, [(1, 1, 0.0)], "mass of point 0"),
        (1.0, [(1, 1, 1.0), (1, 1, -2.0)], "mass of point 1"),
        (1.0, [(-0.5, 1, 1.0)], "point mass 0 .*outside, 0.5 .length. beyond side 1"),
    ):
        with pytest.raises(GeometryError, match=words):
            plate_with_points(triangle([4, 3, 5]), density, points)
