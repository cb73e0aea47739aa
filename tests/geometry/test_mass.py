import math

import mpmath
import numpy as np
import pytest

from limitsets.base.errors import GeometryError
from limitsets.feeder.geometry import OnSide, mass_of, plate_with_points, triangle


def test_rectangle() -> None:
    found = plate_with_points(np.array([(0, 0), (3, 0), (3, 2), (0, 2)]), 0.5)
    assert found.mass == pytest.approx(3.0)
    assert found.centre == pytest.approx((1.5, 1.0))
    assert found.radius_of_gyration == pytest.approx(math.sqrt((9 + 4) / 12))


def test_equilateral_triangle() -> None:
    found = plate_with_points(triangle([2, 2, 2]), 1.0)
    assert found.mass == pytest.approx(math.sqrt(3))
    assert found.centre == pytest.approx((1.0, 1 / math.sqrt(3)))
    assert found.radius_of_gyration == pytest.approx(2 / math.sqrt(12))


def test_circle_by_a_fine_polygon() -> None:
    angles = np.linspace(0, 2 * math.pi, 400, endpoint=False)
    found = plate_with_points(np.column_stack([np.cos(angles), np.sin(angles)]), 1.0)
    assert found.mass == pytest.approx(math.pi, rel=1e-4)
    assert found.radius_of_gyration == pytest.approx(math.sqrt(0.5), rel=1e-4)


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


def test_serves_other_numbers() -> None:
    with mpmath.workdps(40):
        corners = [(mpmath.mpf(x), mpmath.mpf(y)) for x, y in [(0, 0), (3, 0), (3, 2), (0, 2)]]
        found = mass_of(corners, mpmath.mpf(1), sqrt=mpmath.sqrt)
        assert abs(found.radius_of_gyration**2 - mpmath.mpf(13) / 12) < mpmath.mpf(10) ** -38


@pytest.mark.parametrize(
    ("density", "points", "words"),
    [
        (0.0, [], "density"),
        (-1.0, [], "density"),
        (math.nan, [], "density"),
        (1.0, [(1, 1, 0.0)], "mass of point 0"),
        (1.0, [(1, 1, 1.0), (1, 1, -2.0)], "mass of point 1"),
        (1.0, [(-0.5, 1, 1.0)], "point mass 0 .*outside, 0.5 .length. beyond side 1"),
    ],
)
def test_refuses_masses_that_cannot_be(
    density: float, points: list[tuple[float, float, float]], words: str
) -> None:
    with pytest.raises(GeometryError, match=words):
        plate_with_points(triangle([4, 3, 5]), density, points)
