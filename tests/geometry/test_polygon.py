import math

import mpmath
import numpy as np
import pytest

from limitsets.base.errors import GeometryError
from limitsets.feeder.geometry import convex_polygon, require_inside, side_ends, triangle, triangle_of

PENTAGON = [(math.cos(2 * math.pi * k / 5), math.sin(2 * math.pi * k / 5)) for k in range(5)]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def test_sides_come_in_flip_order() -> None:
    """Side 0 is P0-P1, side 1 P(n-1)-P0, side 2 P(n-2)-P(n-1); the left end of side i is the right end of i + 1."""
    assert [side_ends(5, side) for side in range(5)] == [(0, 1), (4, 0), (3, 4), (2, 3), (1, 2)]
    for count in (3, 4, 7):
        for side in range(count):
            assert side_ends(count, side)[0] == side_ends(count, (side + 1) % count)[1]


def test_triangle_has_the_lengths_it_was_given_in_flip_order() -> None:
    lengths = [5.75, 3.6, 6.75]
    corners = triangle(lengths)
    for side, expected in enumerate(lengths):
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


def test_triangle_serves_other_numbers() -> None:
    with mpmath.workdps(50):
        corners = triangle_of([mpmath.mpf(3), mpmath.mpf(4), mpmath.mpf(6)], sqrt=mpmath.sqrt)
        assert abs(mpmath.hypot(corners[2][0] - 3, corners[2][1]) - 6) < mpmath.mpf(10) ** -48


def test_triangle_in_balls_encloses_the_float_one() -> None:
    flint = pytest.importorskip("flint")
    lengths = [5.75, 3.6, 6.75]
    balls = triangle_of([flint.arb(value) for value in lengths], sqrt=flint.arb.sqrt)
    with mpmath.workdps(50):
        exact = triangle_of([mpmath.mpf(value) for value in lengths], sqrt=mpmath.sqrt)
    assert all(
        ball.overlaps(flint.arb(mpmath.nstr(value, 45)))
        for pair, known in zip(balls, exact, strict=True)
        for ball, value in zip(pair, known, strict=True)
    )


@pytest.mark.parametrize(
    ("lengths", "words"),
    [
        ([1, 2], "3, a triangle"),
        ([1, 2, 3, 4], "by its vertices"),
        ([1, 2, 3], "triangle inequality"),
        ([10, 2, 3], "side 0"),
        ([2, 10, 3], "side 1"),
        ([2, 0, 3], "side 1"),
        ([2, -1, 3], "above 0"),
        ([math.inf, 1, 1], "above 0"),
        ([math.nan, 1, 1], "above 0"),
    ],
)
def test_refuses_lengths_of_no_triangle(lengths: list[float], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        triangle(lengths)


def test_broken_triangle_says_by_how_much() -> None:
    with pytest.raises(GeometryError, match=r"too long by 5\b"):
        triangle([2, 10, 3])


@pytest.mark.parametrize("vertices", [SQUARE, PENTAGON, [(0, 0), (4, 0), (0, 3)]])
def test_accepts_convex_polygons_wherever_they_lie(vertices: list[tuple[float, float]]) -> None:
    for shift in (0.0, 1e6, -3e3):
        assert convex_polygon(np.array(vertices) + shift).shape == (len(vertices), 2)


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        (SQUARE[::-1], "reverse the list"),
        (PENTAGON[::-1], "clockwise"),
        (
            [PENTAGON[2 * k % 5] for k in range(5)],
            "crosses itself",
        ),  # the pentagram turns left at every corner
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
    ],
)
def test_refuses_what_is_no_convex_polygon(vertices: list[tuple[float, float]], words: str) -> None:
    with pytest.raises(GeometryError, match=words):
        convex_polygon(vertices)


def test_boundary_is_inside_and_beyond_it_is_not() -> None:
    square = convex_polygon(SQUARE)
    for point in [(0, 0), (1, 0.5), (0.5, 0), (0.3, 0.9)]:
        require_inside(square, point, "the point")
    with pytest.raises(GeometryError, match=r"the point is .*0\.25 \[length\] beyond side 3"):
        require_inside(square, (1.25, 0.5), "the point")
