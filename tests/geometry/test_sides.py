import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limitsets.base.errors import GeometryError
from limitsets.feeder.geometry import (
    OnSide,
    convex_polygon,
    require_rest,
    rest_of,
    resting_sides,
    triangle,
    triangle_of,
)

PAPER = [5.75, 3.6, 6.75]
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


@pytest.mark.parametrize(("along", "above"), [scene[:2] for scene in SCENES])
def test_floats_against_fifty_digits(along: float, above: float) -> None:
    sides = resting_sides(triangle(PAPER), OnSide(2, along, above))
    with mpmath.workdps(50):
        corners = triangle_of([mpmath.mpf(length) for length in PAPER], sqrt=mpmath.sqrt)
        centre = OnSide(2, mpmath.mpf(along), mpmath.mpf(above))
        exact = rest_of(corners, centre, sqrt=mpmath.sqrt, atan2=mpmath.atan2)
    for index, array in enumerate((sides.a, sides.d, sides.length, sides.right, sides.corner)):
        np.testing.assert_allclose(array, [float(row[index]) for row in exact], rtol=0, atol=4e-15)


def test_balls_enclose_the_exact_values() -> None:
    flint = pytest.importorskip("flint")
    corners = triangle_of([flint.arb(length) for length in PAPER], sqrt=flint.arb.sqrt)
    along = flint.arb(4.2255778, 1e-3)
    balls = rest_of(
        corners, OnSide(2, along, flint.arb(0.708249)), sqrt=flint.arb.sqrt, atan2=flint.arb.atan2
    )
    for offset in (-9e-4, 0.0, 9e-4):
        sides = resting_sides(triangle(PAPER), OnSide(2, 4.2255778 + offset, 0.708249))
        for side, row in enumerate(balls):
            assert row[0].overlaps(flint.arb(sides.a[side], 1e-14))
            assert row[1].overlaps(flint.arb(sides.d[side], 1e-14))


def test_unit_square() -> None:
    sides = resting_sides(convex_polygon([(0, 0), (1, 0), (1, 1), (0, 1)]), (0.25, 0.375))
    assert sides.a.tolist() == [0.25, 0.625, 0.75, 0.375]
    assert sides.d.tolist() == [0.375, 0.25, 0.625, 0.75]
    np.testing.assert_allclose(sides.corner, math.pi / 2)
    assert len(sides) == 4


def test_arrays_are_read_only() -> None:
    sides = resting_sides(triangle(PAPER), (2.0, 1.0))
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


@pytest.mark.parametrize(
    ("centre", "words"),
    [
        ((-0.5, 0.5), "side 0, .*tips over the left end by 0.5 in"),
        ((4.25, 0.5), "side 0, .*right end by 0.25 in"),
        ((1.0, 0.0), "height .* side 0 is '0 in'"),
        ((1.0, -0.5), "height .* side 0 is '-0.5 in'"),
    ],
)
def test_part_that_cannot_rest_says_where_and_by_how_much(centre: tuple[float, float], words: str) -> None:
    slanted = convex_polygon([(0, 0), (4, 0), (7, 3), (-3, 3)])
    with pytest.raises(GeometryError, match=words):
        require_rest(resting_sides(slanted, centre), "in")


def test_refuses_a_side_that_is_not_there() -> None:
    with pytest.raises(GeometryError, match="0 to 2"):
        resting_sides(triangle(PAPER), OnSide(3, 1.0, 1.0))
