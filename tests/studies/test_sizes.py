"""The sizes of Section IV follow from the triangle, as their file says."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import pytest

SIZES = tomllib.loads((Path(__file__).parents[2] / "studies" / "sizes.toml").read_text())


def inches(text):
    value, unit = text.split()
    assert unit == "in"
    return float(value)


A, B, C = (inches(text) for text in SIZES["triangle"]["sides"])  # sides 0, 1, 2
AT_LEFT = math.degrees(math.acos((A * A + C * C - B * B) / (2 * A * C)))  # at P1, by the law of cosines


def test_the_triangle_is_the_one_of_the_scenes():
    import limitsets as ls

    assert ls.load("paper-designed").sides.length == pytest.approx((A, B, C))


def test_the_ramp_and_the_wall_hold_the_triangle():
    cavity = SIZES["cavity"]
    angle = float(cavity["angle"].removesuffix(" deg"))
    width, depth = inches(cavity["width"]), inches(cavity["depth"])
    assert angle == pytest.approx(AT_LEFT, abs=5e-3)
    assert width == pytest.approx(1.6 * A + 0.1, abs=1e-9)
    assert depth == pytest.approx(width * math.tan(math.radians(angle)), abs=5e-5)
    # with side 2 on the ramp and P0 at the wall, P2 lies left of the wall: the corner at P0 is below a right angle
    at_top = math.degrees(math.acos((A * A + B * B - C * C) / (2 * A * B)))
    assert 89.0 < at_top < 90.0


def test_the_quadrilateral_fills_what_is_left_of_the_mouth():
    corners = [tuple(map(inches, corner)) for corner in SIZES["quadrilateral"]["vertices"]]
    (x0, y0), (x1, y1), (x2, y2), (x3, y3) = corners
    assert (x1 - x0, y0, y1) == (A, 0.0, 0.0)
    assert x2 == x1
    assert y2 == y3
    assert x2 - x3 == pytest.approx(1.6 * A, abs=1e-9)
    assert math.degrees(math.atan2(y3, -x3)) == pytest.approx(AT_LEFT, abs=0.05)
    area = 0.5 * sum(a * d - b * c for (a, b), (c, d) in zip(corners, corners[1:] + corners[:1], strict=True))
    assert area > 0.0  # counterclockwise


def test_the_tray_follows_from_side_2():
    tray = SIZES["tray"]
    height = A * math.sin(math.radians(AT_LEFT))
    assert inches(tray["depression_width"]) == pytest.approx(1.04 * C, abs=1e-9)
    assert inches(tray["depression_depth"]) == pytest.approx(0.5 * height, abs=5e-3)
    assert inches(tray["pitch"]) == pytest.approx(2 * inches(tray["depression_width"]), abs=1e-9)
