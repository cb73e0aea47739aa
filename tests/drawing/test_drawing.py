"""Plates of drawings, against areas and moments in closed form; and drawings that are none."""

import math
import re
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from hypothesis import given, strategies as st
from scipy.integrate import quad
from scipy.interpolate import BSpline

from limitsets.base import AnswerError
from limitsets.feeder.drawing import Drawing, read_drawing

# Area, its first moments along x and y, and its polar second moment about the origin: these add up.
Integrals = np.ndarray

MILLIMETRES = 4  # in $INSUNITS


def box(left: float, low: float, right: float, high: float) -> Integrals:
    area = (right - left) * (high - low)
    polar = (right**3 - left**3) / 3 * (high - low) + (high**3 - low**3) / 3 * (right - left)
    return np.array([area, area * (left + right) / 2, area * (low + high) / 2, polar])


def moved(x: float, y: float, area: float, along_x: float, along_y: float, polar: float) -> Integrals:
    """Those of a shape that is known about a point."""
    first = area * x + along_x, area * y + along_y
    return np.array([area, *first, polar + 2 * (x * along_x + y * along_y) + area * (x * x + y * y)])


def ellipse(x: float, y: float, a: float, b: float) -> Integrals:
    return moved(x, y, math.pi * a * b, 0, 0, math.pi * a * b * (a * a + b * b) / 4)


def disc(x: float, y: float, r: float) -> Integrals:
    return ellipse(x, y, r, r)


def half_disc(x: float, y: float, r: float, side: int) -> Integrals:
    """The half of a disc on one side, along x."""
    return moved(x, y, math.pi * r * r / 2, side * 2 * r**3 / 3, 0, math.pi * r**4 / 4)


def quarter_disc(x: float, y: float, r: float, right: int, up: int) -> Integrals:
    return moved(x, y, math.pi * r * r / 4, right * r**3 / 3, up * r**3 / 3, math.pi * r**4 / 8)


def triangle(*corners: tuple[float, float]) -> Integrals:
    (a, b), (c, d), (e, f) = corners
    area = abs((c - a) * (f - b) - (e - a) * (d - b)) / 2
    squares = sum(x * x for corner in corners for x in corner)
    products = a * c + c * e + e * a + b * d + d * f + f * b
    return np.array([area, area * (a + c + e) / 3, area * (b + d + f) / 3, area * (squares + products) / 6])


def turned(angle: float, of: Integrals) -> Integrals:
    """Those of a shape turned about the origin."""
    area, x, y, polar = of
    return np.array(
        [area, math.cos(angle) * x - math.sin(angle) * y, math.sin(angle) * x + math.cos(angle) * y, polar]
    )


def of_polygon(points: np.ndarray) -> Integrals:
    """By the formula of Green, corner by corner."""
    points = np.asarray(points)
    (x, y), (u, v) = points.T, np.roll(points, -1, axis=0).T
    cross = x * v - u * y
    polar = cross * (x * x + x * u + u * u + y * y + y * v + v * v) / 12
    return np.array([cross.sum() / 2, (cross * (x + u)).sum() / 6, (cross * (y + v)).sum() / 6, polar.sum()])


def measured(plate: Drawing) -> Integrals:
    of = of_polygon(plate.outline)
    for hole in plate.holes:
        if hole.centre is not None:
            of = of - disc(*hole.centre, hole.diameter / 2)
        else:
            assert hole.diameter == 0.0
            of = of - of_polygon(hole.vertices)
    return of


def border(plate: Drawing) -> float:
    """The length of everything that is made of chords, and some more: that of the curves."""
    polygons = [plate.outline, *(np.array(hole.vertices) for hole in plate.holes if hole.centre is None)]
    return 1.01 * sum(np.hypot(*(np.roll(each, -1, axis=0) - each).T).sum() for each in polygons)


def assert_same(plate: Drawing, expected: Integrals) -> None:
    """To rounding where nothing has chords; else a strip as wide as their error along the border is in doubt."""
    reach = max(np.hypot(*plate.outline.T).max(), 1e-9)
    doubt = border(plate) * plate.chord_error * np.array([1.0, reach, reach, reach * reach])
    scale = expected[0] * np.array([1.0, reach, reach, reach * reach])
    assert (np.abs(measured(plate) - expected) <= doubt + 1e-9 * scale).all()


# ----------------------------------------------------------------
# DXF.


class Pen:
    """Draws into a document of ezdxf in the words of its version."""

    def __init__(self, version: str, units: int = MILLIMETRES) -> None:
        self.old = version == "R12"
        self.document = ezdxf.new(version)
        if not self.old:
            self.document.units = units
        self.space = self.document.modelspace()

    def polyline(self, points: Sequence[tuple[float, ...]], closed: bool = True, **attributes: Any) -> None:
        """Corners (x, y) or with a bulge (x, y, bulge)."""
        three = [(*point, 0.0)[:3] for point in points]
        if self.old:
            self.space.add_polyline2d(three, format="xyb", close=closed, dxfattribs=attributes)
        else:
            self.space.add_lwpolyline(three, format="xyb", close=closed, dxfattribs=attributes)

    def lines(self, points: Sequence[tuple[float, float]], **attributes: Any) -> None:
        for start, end in zip(points, [*points[1:], points[0]], strict=True):
            self.space.add_line(start, end, dxfattribs=attributes)


def read(pen: Pen, folder: Path, **words: Any) -> Drawing:
    file = folder / "part.DXF"
    pen.document.saveas(file)
    return read_drawing(file, **{"unit": "mm", **words})


BRACKET = [(0, 0), (60, 0), (60, 12), (15, 12), (15, 45), (0, 45)]


def draw_triangle(pen: Pen) -> Integrals:
    pen.polyline([(0, 0), (40, 0), (12.7, 30)])
    return triangle((0, 0), (40, 0), (12.7, 30))


def draw_bracket_of_lines(pen: Pen) -> Integrals:
    """Shuffled, some the other way, one twice, one of no length, one in two halves."""
    sides = list(zip(BRACKET, BRACKET[1:] + BRACKET[:1], strict=True))
    for k in (3, 0, 5, 2, 4, 1, 3):
        start, end = sides[k]
        pen.space.add_line(*((end, start) if k % 2 else (start, end)))
    pen.space.add_line((60, 0), (60, 0))
    pen.space.add_text("a bracket")
    return box(0, 0, 60, 12) + box(0, 12, 15, 45)


def draw_rectangle_with_holes(pen: Pen) -> Integrals:
    pen.polyline([(0, 0), (0, 30), (50, 30), (50, 0), (0, 0)])  # clockwise, and its first corner again
    pen.space.add_circle((10, 10), 4)
    pen.space.add_circle((35, 18), 2.5)
    pen.space.add_circle((35, 18), 2.5)
    pen.space.add_arc((35, 18), 2.5, 90, 90)  # all of it, from elsewhere
    return box(0, 0, 50, 30) - disc(10, 10, 4) - disc(35, 18, 2.5)


def draw_slotted_plate(pen: Pen) -> Integrals:
    pen.lines([(-5, -5), (45, -5), (45, 25), (-5, 25)])
    pen.space.add_arc((10, 10), 4, 90, 270)
    pen.space.add_arc((30, 10), 4, 270, 30)  # crosses 360 degrees
    pen.space.add_arc((30, 10), 4, 390, 450)
    pen.space.add_line((10, 14), (30, 14))
    pen.space.add_line((30, 6), (10, 6))
    slot = box(10, 6, 30, 14) + half_disc(10, 10, 4, -1) + half_disc(30, 10, 4, 1)
    return box(-5, -5, 45, 25) - slot


def draw_disc_with_hole(pen: Pen) -> Integrals:
    pen.space.add_circle((3, 4), 20)
    pen.polyline([(1, 1, 1.0), (7, 1, 1.0)])  # a circle of two bulges
    return disc(3, 4, 20) - disc(4, 1, 3)


def draw_rounded_rectangle(pen: Pen) -> Integrals:
    """Clockwise, so that all bulges are negative."""
    bulge = -math.tan(math.pi / 8)
    corners = [(5, 0), (0, 5), (0, 25), (5, 30), (45, 30), (50, 25), (50, 5), (45, 0)]
    pen.polyline([(*corner, bulge if k % 2 == 0 else 0.0) for k, corner in enumerate(corners)])
    quarters = [
        quarter_disc(5 + 40 * right, 5 + 20 * up, 5, 2 * right - 1, 2 * up - 1)
        for right in (0, 1)
        for up in (0, 1)
    ]
    return box(5, 0, 45, 30) + box(0, 5, 5, 25) + box(45, 5, 50, 25) + sum(quarters)


NOTCHED = [(0, 0), (20, 0), (20, 6), (30, 6), (30, 0), (70, 0), (70, 40), (0, 40)]


def draw_turned_notched_plate(pen: Pen) -> Integrals:
    angle = math.radians(33.3)
    x, y = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    pen.lines([tuple(a * x + b * y) for a, b in NOTCHED])
    return turned(angle, box(0, 0, 70, 40) - box(20, 0, 30, 6))


def draw_mirrored_block(pen: Pen) -> Integrals:
    """A block on its base point, mirrored, doubled and turned by a right angle; and one within it."""
    inner = pen.document.blocks.new("HOLE")
    inner.add_circle((0, 0), 1)
    block = pen.document.blocks.new("PLATE", base_point=(1, 1))
    for start, end in zip(BRACKET, BRACKET[1:] + BRACKET[:1], strict=True):
        block.add_line(start, end)
    block.add_blockref("HOLE", (8, 20), dxfattribs={"xscale": 2, "yscale": 2})
    block.add_arc((5, 5), 2, 90, 450)
    pen.space.add_blockref("PLATE", (10, 20), dxfattribs={"xscale": -2, "yscale": 2, "rotation": 90})

    def laid(x: float, y: float) -> tuple[float, float]:
        return 10 - 2 * (y - 1), 20 - 2 * (x - 1)

    (a, b), (c, d), (e, f) = laid(0, 0), laid(60, 12), laid(15, 45)
    corner = laid(0, 12)
    plate = box(c if c < a else a, min(b, d), max(a, c), max(b, d))
    tab = box(min(corner[0], e), min(corner[1], f), max(corner[0], e), max(corner[1], f))
    return plate + tab - disc(*laid(8, 20), 4) - disc(*laid(5, 5), 4)


def draw_stretched_block(pen: Pen) -> Integrals:
    """A circle that a block stretches is an ellipse, in every version; bulges too."""
    block = pen.document.blocks.new("ROUND")
    block.add_circle((0, 0), 10)
    block.add_arc((2, 0), 3, 180, 0)
    block.add_arc((2, 0), 3, 0, 180)
    pen.space.add_blockref("ROUND", (1, 2), dxfattribs={"xscale": 3, "yscale": 1.5})
    return ellipse(1, 2, 30, 15) - ellipse(7, 2, 9, 4.5)


def draw_from_behind(pen: Pen) -> Integrals:
    """Extrusion (0, 0, -1): x of the entity points to the left."""
    behind = {"extrusion": (0, 0, -1)}
    pen.polyline([(0, 0), (-40, 0), (-40, 20, -1.0), (0, 20)], **behind)
    pen.space.add_circle((-10, 8), 3, dxfattribs=behind)
    top = moved(20, 20, math.pi * 200, 0, 2 * 20**3 / 3, math.pi * 20**4 / 4)
    return box(0, 0, 40, 20) + top - disc(10, 8, 3)


def draw_layers(pen: Pen) -> Integrals:
    """What is off, frozen or on paper is not read."""
    pen.polyline([(0, 0), (30, 0), (30, 20), (0, 20)], thickness=3.0)
    for name in ("OFF", "FROZEN"):
        layer = pen.document.layers.add(name)
        layer.off() if name == "OFF" else layer.freeze()
        pen.space.add_line((0, 0), (99, 99), dxfattribs={"layer": name})
    return box(0, 0, 30, 20)


DRAWN_IN_ALL = [
    draw_triangle,
    draw_bracket_of_lines,
    draw_rectangle_with_holes,
    draw_slotted_plate,
    draw_disc_with_hole,
    draw_rounded_rectangle,
    draw_turned_notched_plate,
    draw_mirrored_block,
    draw_stretched_block,
    draw_from_behind,
    draw_layers,
]
WITHOUT_CHORDS = {
    draw_triangle,
    draw_bracket_of_lines,
    draw_rectangle_with_holes,
    draw_turned_notched_plate,
    draw_mirrored_block,
    draw_layers,
}


@pytest.mark.parametrize("version", ["R12", "R2010"])
@pytest.mark.parametrize("draw", DRAWN_IN_ALL)
def test_dxf_has_the_area_and_moments_of_what_is_drawn(
    draw: Callable[[Pen], Integrals], version: str, tmp_path: Path
) -> None:
    pen = Pen(version)
    expected = draw(pen)
    plate = read(pen, tmp_path)
    assert_same(plate, expected)
    assert (plate.chord_error == 0.0) == (draw in WITHOUT_CHORDS)
    extent = np.ptp(plate.outline, axis=0).max()
    assert plate.chord_error <= 1e-3 * extent * 1.001
    # the strip in doubt is as wide as the chords are away: ten times finer, ten times nearer
    finer = read(pen, tmp_path, error=f"{1e-5 * extent:.12f} mm")
    assert finer.chord_error <= 1e-5 * extent
    assert_same(finer, expected)


def draw_ellipse(pen: Pen) -> Integrals:
    pen.space.add_ellipse((5, -3), (0, 20), 0.4, 0.7, 0.7 + math.tau)
    pen.space.add_ellipse((5, -3), (3, 0), 0.5, 0, math.pi)
    pen.space.add_line((8, -3), (2, -3))
    half = moved(5, -3, math.pi * 4.5 / 2, 0, 2 / 3 * 3 * 1.5**2, math.pi * 4.5 * (9 + 2.25) / 8)
    return ellipse(5, -3, 8, 20) - half


CONTROL = [(0, 0), (30, -20), (60, 10), (40, 50), (10, 60), (-20, 30)]
WEIGHTS = [1, 2, 1, 0.5, 1, 3]


def closed_by_quadrature(curve: Callable[[float], np.ndarray], breaks: Sequence[float]) -> Integrals:
    """Integrate along the true curve, whose derivative is taken from differences of it."""

    def along(weight: Callable[[float, float, float, float], float]) -> float:
        def rate(t: float) -> float:
            step = 1e-6
            inside = min(max(t, breaks[0] + step), breaks[-1] - step)
            x, y = curve(t)
            dx, dy = (curve(inside + step) - curve(inside - step)) / (2 * step)
            return weight(x, y, dx, dy)

        return sum(quad(rate, low, high, epsabs=1e-9)[0] for low, high in pairwise(breaks))

    return np.array(
        [
            along(lambda x, y, dx, dy: (x * dy - y * dx) / 2),
            along(lambda x, y, dx, dy: x * (x * dy - y * dx) / 3),
            along(lambda x, y, dx, dy: y * (x * dy - y * dx) / 3),
            along(lambda x, y, dx, dy: (x * x + y * y) * (x * dy - y * dx) / 4),
        ]
    )


def draw_closed_spline(pen: Pen) -> Integrals:
    """A closed rational spline: its knots go on beyond its ends."""
    pen.space.add_rational_spline([], [])
    spline = pen.space.query("SPLINE").last
    spline.set_closed_rational([(*point, 0) for point in CONTROL], WEIGHTS, degree=3)
    points, weights = np.array(CONTROL + CONTROL[:3], float), np.array(WEIGHTS + WEIGHTS[:3], float)
    homogeneous = BSpline(np.arange(13.0), np.column_stack([points * weights[:, None], weights]), 3)

    def curve(t: float) -> np.ndarray:
        x, y, w = homogeneous(t)
        return np.array([x / w, y / w])

    return closed_by_quadrature(curve, list(range(3, 10)))


def draw_fitted_spline(pen: Pen) -> Integrals:
    """One of degree 2 with an inner knot, and the lines that close it; by hand of its two parabolas."""
    pen.space.add_open_spline([(0, 0), (0, 30), (40, 30), (40, 0)], degree=2)
    pen.lines([(40, 0), (40, -10), (0, -10), (0, 0)][:4])
    pen.space.query("LINE").last.destroy()
    pen.space.add_line((0, -10), (0, 0))

    def curve(t: float) -> np.ndarray:
        first = [(0, 0), (0, 30), (20, 30)], [(20, 30), (40, 30), (40, 0)]
        (a, b, c), s = np.array(first[t > 1]), t - (t > 1)
        return a * (1 - s) ** 2 + 2 * b * s * (1 - s) + c * s * s

    # the curve runs clockwise from (0, 0) to (40, 0), and its chord along the axis adds nothing
    return box(0, -10, 40, 0) - closed_by_quadrature(curve, [0.0, 1.0 - 1e-12, 2.0])


@pytest.mark.parametrize("draw", [draw_ellipse, draw_closed_spline, draw_fitted_spline])
@pytest.mark.parametrize("version", ["R2000", "R2018"])
def test_curves_of_newer_dxf_have_the_area_and_moments_of_the_true_curve(
    draw: Callable[[Pen], Integrals], version: str, tmp_path: Path
) -> None:
    pen = Pen(version)
    expected = draw(pen)
    for error in (None, "0.5 mm", "0.001 mm"):
        plate = read(pen, tmp_path, error=error)
        assert_same(plate, expected)
        assert 0.0 < plate.chord_error <= (0.08 if error is None else float(error.split()[0]))


def test_vertices_of_chords_lie_on_the_curve_and_chords_are_as_far_as_is_said(tmp_path: Path) -> None:
    pen = Pen("R2010")
    pen.space.add_circle((1e3, -2e3), 50)
    plate = read(pen, tmp_path, error="0.01 mm")
    middle = (plate.outline + np.roll(plate.outline, -1, axis=0)) / 2
    from_centre = np.hypot(*(plate.outline - [1e3, -2e3]).T)
    assert np.abs(from_centre - 50).max() < 1e-11
    away = 50 - np.hypot(*(middle - [1e3, -2e3]).T)
    assert away.max() == pytest.approx(plate.chord_error, rel=1e-9)
    assert len(plate.outline) == math.ceil(math.pi / math.acos(1 - 0.01 / 50))


def test_hardly_bent_arcs_keep_their_digits(tmp_path: Path) -> None:
    """A bulge of 1e-10: the centre is 5e10 mm away."""
    pen = Pen("R2010")
    pen.polyline([(0, 0, 1e-10), (20, 0), (20, 10), (0, 10)])
    assert read(pen, tmp_path).outline.tolist() == [[0, 0], [20, 0], [20, 10], [0, 10]]


def test_what_is_left_out_is_counted(tmp_path: Path) -> None:
    pen = Pen("R2010")
    draw_layers(pen)
    pen.space.add_text("part 7")
    pen.space.add_text("steel")
    pen.space.add_point((3, 3))
    pen.space.add_hatch()
    pen.space.add_linear_dim(base=(0, -5), p1=(0, 0), p2=(30, 0)).render()
    pen.document.layout("Layout1").add_line((0, 0), (1, 1))
    assert read(pen, tmp_path).left_out == (
        "1 DIMENSION",
        "1 HATCH",
        "1 POINT",
        "2 TEXT",
        "1 in paper space",
        "2 on layers that are off",
    )


def test_thickness_is_that_of_all_lines_of_the_outline(tmp_path: Path) -> None:
    pen = Pen("R2010", units=1)
    pen.lines([(0, 0), (3, 0), (3, 2), (0, 2)], thickness=0.5)
    pen.space.add_circle((1, 1), 0.5)
    assert read(pen, tmp_path).thickness == 12.7
    assert read(pen, tmp_path, unit="in").thickness == 0.5
    pen.space.query("LINE").first.dxf.thickness = 0.25
    assert read(pen, tmp_path).thickness is None


# ----------------------------------------------------------------
# Units.


def square(pen: Pen, side: float = 1.0) -> Pen:
    pen.polyline([(0, 0), (side, 0), (side, side), (0, side)])
    return pen


@pytest.mark.parametrize(
    ("code", "words", "unit", "side"),
    [
        (4, {"unit": None}, "mm", 12.7),
        (4, {"unit": "in"}, "in", 0.5),
        (1, {"unit": "mm"}, "mm", 322.58),
        (1, {"unit": None}, "in", 12.7),
        (2, {"unit": "mm"}, "mm", 3870.96),
        (5, {"unit": "mm"}, "mm", 127.0),
        (6, {"unit": "cm"}, "cm", 1270.0),
        (13, {"unit": "mm"}, "mm", 0.0127),
        (0, {"unit": "mm"}, "mm", 12.7),
        (9, {"unit": "um"}, "um", 12.7),
        (1, {"unit": None, "scale": "0.1 mm"}, "mm", 1.27),
        (0, {"unit": "in", "scale": "2 mm"}, "in", 1.0),
        (4, {"unit": "in", "scale": "10 mm"}, "in", 5.0),
    ],
)
def test_units_of_dxf(code: int, words: dict[str, Any], unit: str, side: float, tmp_path: Path) -> None:
    plate = read(square(Pen("R2010", code), 12.7), tmp_path, **words)
    assert plate.unit == unit
    assert plate.outline.tolist() == [[0, 0], [side, 0], [side, side], [0, side]]


SVG = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" {}>{}</svg>'
RECT = '<rect x="10" y="20" width="30" height="15"/>'


def read_text(folder: Path, page: str, inside: str, **words: Any) -> Drawing:
    file = folder / "part.svg"
    file.write_text(SVG.format(page, inside))
    return read_drawing(file, **words)


@pytest.mark.parametrize(
    ("page", "words", "unit", "corner"),
    [
        ('width="100mm" height="50mm" viewBox="0 0 100 50"', {}, "mm", (10, -35)),
        ('width="100mm" height="50mm" viewBox="0 0 200 100"', {}, "mm", (5, -17.5)),
        ('width="100mm" height="50mm" viewBox="5 5 200 100"', {"unit": "cm"}, "cm", (0.5, -1.75)),
        ('width="10cm" viewBox="0 0 100 50"', {}, "cm", (1, -3.5)),
        ('height="2in" viewBox="0 0 100 50"', {"unit": "mm"}, "mm", (10.16, -35.56)),
        ('width="10cm" height="50mm" viewBox="0 0 100 50"', {"unit": "mm"}, "mm", (10, -35)),
        ('width="100mm" height="90mm" viewBox="0 0 100 50"', {}, "mm", (10, -35)),
        (
            'width="100mm" height="90mm" viewBox="0 0 100 50" preserveAspectRatio="xMidYMid slice"',
            {},
            "mm",
            (18, -63),
        ),
        (
            'width="100mm" height="90mm" viewBox="0 0 100 50" preserveAspectRatio="none"',
            {},
            "mm",
            (10, -63),
        ),
        ('width="72pt" height="36pt" viewBox="0 0 100 50"', {}, "in", (0.1, -0.35)),
        ('width="8in" height="8in"', {}, "in", (10 / 96, -35 / 96)),
        ('width="100" height="50" viewBox="0 0 10 5"', {"unit": "mm"}, "mm", (10, -35)),
        ('width="100px" height="50px"', {"unit": "in"}, "in", (10, -35)),
        ('width="100%" height="100%"', {"unit": "mm"}, "mm", (10, -35)),
        ("", {"unit": "mm"}, "mm", (10, -35)),
        ("", {"scale": "0.5 cm"}, "cm", (5, -17.5)),
        (
            'width="100mm" height="50mm" viewBox="0 0 200 100"',
            {"scale": "1 in", "unit": "mm"},
            "mm",
            (254, -889),
        ),
    ],
)
def test_units_of_svg(
    page: str, words: dict[str, Any], unit: str, corner: tuple[float, float], tmp_path: Path
) -> None:
    plate = read_text(tmp_path, page, RECT, **words)
    assert plate.unit == unit
    assert plate.outline[0].tolist() == pytest.approx(corner, rel=1e-13)


# ----------------------------------------------------------------
# SVG, y down: each expected one is mirrored.


def upwards(of: Integrals) -> Integrals:
    return of * np.array([1, 1, -1, 1])


BRACKET_DATA = "m 0,0 h 60 v 12 h -45 v 33 H0z"
SLOT = "M10 6 H30 A4 4 0 0 1 30 14 L10 14 a4 4 0 0 1 0-8 Z"
STRETCHED = "translate(10 20) rotate(90) scale(2 -3)"


def cubic(*control: tuple[float, float]) -> Callable[[float], np.ndarray]:
    points = np.array(control, float)
    return lambda t: sum(
        math.comb(3, k) * t**k * (1 - t) ** (3 - k) * point for k, point in enumerate(points)
    )


POLYLINE_WITH_HOLES = (
    '<polyline points="0 0 40 0 40 20 0 20 0 0"/><circle cx="10" cy="9" r="4" transform="rotate(31 10 9)"/>'
    '<g transform="translate(20 0) scale(-2 2)"><circle cx="-3.5" cy="5" r="1.5"/></g>'
)

SHAPES = [
    ('<polygon points="0,0 40,0 12.7,30"/>', triangle((0, 0), (40, 0), (12.7, 30)), False),
    (f'<path d="{BRACKET_DATA}"/>', box(0, 0, 60, 12) + box(0, 12, 15, 45), False),
    (
        POLYLINE_WITH_HOLES,
        box(0, 0, 40, 20) - disc(10, 9, 4) - disc(27, 10, 3),
        False,
    ),
    (
        f'<rect width="40" height="20"/><path d="{SLOT}"/>',
        box(0, 0, 40, 20) - box(10, 6, 30, 14) - half_disc(10, 10, 4, -1) - half_disc(30, 10, 4, 1),
        True,
    ),
    (
        '<rect x="0" y="0" width="50" height="30" rx="5"/>',
        box(5, 0, 45, 30)
        + box(0, 5, 5, 25)
        + box(45, 5, 50, 25)
        + sum(
            quarter_disc(5 + 40 * right, 5 + 20 * up, 5, 2 * right - 1, 2 * up - 1)
            for right in (0, 1)
            for up in (0, 1)
        ),
        True,
    ),
    ('<rect x="1" y="2" width="20" height="10" rx="40" ry="5"/>', ellipse(11, 7, 10, 5), True),
    ('<rect x="1" y="2" width="10" height="10" ry="7"/>', disc(6, 7, 5), True),
    # two arcs are a circle, and as a hole it stays one
    (
        '<ellipse cx="5" cy="6" rx="30" ry="20"/><path d="M2 6 A3 3 0 0 0 8 6 A3 3 0 0 0 2 6"/>',
        ellipse(5, 6, 30, 20) - disc(5, 6, 3),
        True,
    ),
    (
        f'<g transform="{STRETCHED}"><path d="M-5 0 A5 5 0 1 1 5 0 Z"/></g>',
        # (x, y) goes to (10 + 3 y, 20 + 2 x): the half below the axis, y < 0, to x < 10
        moved(10, 20, math.pi * 150 / 2, -2 / 3 * 10 * 15**2, 0, math.pi * 150 * (100 + 225) / 8),
        True,
    ),
    (
        '<path d="M0 0 C 0 30 40 30 40 0 Z"/>',
        -closed_by_quadrature(cubic((0, 0), (0, 30), (40, 30), (40, 0)), [0.0, 1.0]),
        True,
    ),
    # Archimedes: two thirds of the box
    ('<path d="M-10 0 Q 0 40 10 0 Z"/>', None, True),
    (
        '<defs><path id="p" d="M0 0H10V10H0Z"/></defs><use xlink:href="#p" x="5" y="5" transform="scale(2 1)"/>',
        box(10, 5, 30, 15),
        False,
    ),
    (
        '<rect width="40" height="20"/><text x="3">text</text><g style="display: none"><circle r="99"/></g>',
        box(0, 0, 40, 20),
        False,
    ),
    ('<path d="M 0. 0. L 10. 0 10.5 7. 0. 7.z"/>', box(0, 0, 10, 7) + triangle((10, 0), (10.5, 7), (10, 7)), False),
    ('<rect x="1in" y="25.4mm" width="2in" height="48pt" />', 96**2 * box(1, 1, 3, 5 / 3) * [1, 96, 96, 96**2], False),
]  # fmt: skip


@pytest.mark.parametrize(("inside", "expected", "chords"), SHAPES)
@pytest.mark.parametrize(
    ("page", "factor"),
    [('width="100mm" height="50mm" viewBox="0 0 200 100"', 0.5), ('width="200px" height="100px"', 1.0)],
)
def test_svg_has_the_area_and_moments_of_what_is_drawn(
    inside: str, expected: Integrals | None, chords: bool, page: str, factor: float, tmp_path: Path
) -> None:
    plate = read_text(tmp_path, page, inside, unit="mm")
    assert (plate.chord_error > 0.0) == chords
    if expected is None:
        area = 2 / 3 * 20 * 20
        # of y = 20 (1 - (x/10)^2): integrals of x^2 and of y^3 / 3
        polar = 20 * 10**3 * (2 / 3 - 2 / 5) + 20**3 / 3 * 10 * 32 / 35
        expected = np.array([area, 0, 2 / 5 * 20 * area, polar])
    assert_same(plate, upwards(expected) * factor ** np.array([2, 3, 3, 4]))
    finer = read_text(tmp_path, page, inside, unit="mm", error="0.0005 mm")
    assert finer.chord_error <= 0.0005
    assert_same(finer, upwards(expected) * factor ** np.array([2, 3, 3, 4]))


def test_circles_stay_circles_where_the_transformation_keeps_them(tmp_path: Path) -> None:
    holes = '<circle cx="20" cy="20" r="5"/><g transform="matrix(0 -2 -2 0 100 60)"><circle cx="5" cy="5" r="2"/></g>'
    stretched = '<circle cx="120" cy="20" r="5" transform="translate(0 5) scale(1 1.1)"/>'
    plate = read_text(tmp_path, "", f'<rect width="200" height="60"/>{holes}{stretched}', unit="mm")
    assert [(hole.centre, hole.diameter) for hole in plate.holes[:2]] == [((20, -20), 10), ((90, -50), 8)]
    assert plate.holes[2].centre is None
    assert of_polygon(plate.holes[2].vertices)[0] > 0  # counterclockwise


def test_groups_of_svg_are_layers(tmp_path: Path) -> None:
    inside = (
        '<g id="part" transform="scale(2)"><rect width="30" height="20"/></g>'
        '<g xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" inkscape:label="Holes">'
        '<circle cx="9" cy="9" r="2"/></g>'
        '<g id="frame"><path d="M-5 -5 H99"/></g>'
    )  # fmt: skip
    assert not read_text(tmp_path, "", inside, unit="mm", layers=["part"]).holes
    plate = read_text(tmp_path, "", inside, unit="mm", layers=["part", "Holes"])
    assert_same(plate, upwards(box(0, 0, 60, 40) - disc(9, 9, 2)))


def test_layers_of_dxf(tmp_path: Path) -> None:
    """What a block has on layer 0 is on that on which the block lies."""
    pen = Pen("R2010")
    square(pen, 20)
    block = pen.document.blocks.new("HOLE")
    block.add_circle((5, 5), 2)
    pen.space.add_blockref("HOLE", (0, 0), dxfattribs={"layer": "DRILL"})
    pen.space.add_line((0, 0), (99, 99), dxfattribs={"layer": "AXES"})
    assert_same(read(pen, tmp_path, layers=["0", "drill"]), box(0, 0, 20, 20) - disc(5, 5, 2))
    assert not read(pen, tmp_path, layers=["0"]).holes
    with pytest.raises(AnswerError, match=r"the layer is 'CUTS'; allowed: 0, AXES, DRILL, Defpoints"):
        read(pen, tmp_path, layers=["0", "CUTS"])


def test_a_dxf_of_entities_alone_is_read(tmp_path: Path) -> None:
    """As small programs write them: no header, no tables."""
    lines = [(0, 0, 9, 0), (9, 0, 9, 5), (9, 5, 0, 5), (0, 5, 0, 0)]
    tags = [(0, "SECTION"), (2, "ENTITIES")]
    for x, y, u, v in lines:
        tags += [(0, "LINE"), (8, "0"), (10, x), (20, y), (11, u), (21, v)]
    file = tmp_path / "small.dxf"
    file.write_text("".join(f"{code}\n{value}\n" for code, value in [*tags, (0, "ENDSEC"), (0, "EOF")]))
    assert read_drawing(file, unit="mm").outline.tolist() == [[0, 0], [9, 0], [9, 5], [0, 5]]


def test_ends_within_a_gap_are_joined_and_wider_ones_are_not(tmp_path: Path) -> None:
    for gap, joined in ((0.5e-6, True), (3e-6, False)):
        pen = Pen("R2010")
        pen.space.add_line((0, 0), (100, 0))
        pen.space.add_line((100, 100 * gap), (50, 70))
        pen.space.add_line((50, 70), (0, 0))
        if joined:
            assert_same(read(pen, tmp_path), triangle((0, 0), (100, 0), (50, 70)))
        else:
            with pytest.raises(AnswerError, match=r"line from .* to .* is 'open'"):
                read(pen, tmp_path)


def test_vertices_on_straight_lines_are_dropped(tmp_path: Path) -> None:
    pen = Pen("R2010")
    pen.polyline([(0, 0), (10, 0), (20, 0), (20, 0), (30, 1e-10), (60, 0), (60, 40), (30, 40), (0, 40)])
    assert read(pen, tmp_path).outline.tolist() == [[0, 0], [60, 0], [60, 40], [0, 40]]


# ----------------------------------------------------------------
# The hull, exactly.


def exact_hull(points: Iterable[Sequence[float]]) -> list[tuple[float, float]]:
    """Andrew's monotone chain on fractions of the decimals; vertices on a side are no corners."""
    exact = sorted((Fraction(repr(x)), Fraction(repr(y))) for x, y in points)

    def chain(ordered: Iterable[tuple[Fraction, Fraction]]) -> list[tuple[Fraction, Fraction]]:
        kept: list[tuple[Fraction, Fraction]] = []
        for x, y in ordered:
            while len(kept) > 1:
                (a, b), (c, d) = kept[-2:]
                if (c - a) * (y - b) - (d - b) * (x - a) > 0:
                    break
                kept.pop()
            kept.append((x, y))
        return kept[:-1]

    return [(float(x), float(y)) for x, y in chain(exact) + chain(reversed(exact))]


@given(
    angle=st.floats(0, 360),
    cuts=st.lists(st.tuples(st.floats(0.05, 0.3), st.floats(0.05, 0.9)), min_size=1, max_size=4),
    size=st.sampled_from([1e-3, 1.0, 25.4, 1e4]),
    shift=st.tuples(st.floats(-100, 100), st.floats(-100, 100)),
)
def test_notches_of_turned_plates_make_no_corners(
    tmp_path_factory: pytest.TempPathFactory,
    angle: float,
    cuts: list[tuple[float, float]],
    size: float,
    shift: tuple[float, float],
) -> None:
    """Notches on the bottom and the right side: the hull of the decimals has the four corners of the plate."""
    corners, step = [(0.0, 0.0)], 1 / len(cuts)
    for k, (start, width) in enumerate(cuts):
        left, right = (k + start) * step, (k + start + width * (1 - start - 0.02)) * step
        corners += [(left, 0.0), (left, 0.3), (right, 0.3), (right, 0.0)]
    corners += [(1.0, 0.0), (1.0, 0.4), (0.9, 0.4), (0.9, 0.5), (1.0, 0.5), (1.0, 0.8), (0.0, 0.8)]
    turn = np.exp(1j * math.radians(angle))
    points = [size * (complex(x, y) * turn + complex(*shift)) for x, y in corners]
    pen = Pen("R2010")
    pen.lines([(point.real, point.imag) for point in points])
    outline = read(pen, tmp_path_factory.mktemp("notched")).outline
    assert len(outline) == len(corners)
    expected = [points[0], points[-7], points[-2], points[-1]]
    hull = [complex(*corner) for corner in exact_hull(outline.tolist())]
    assert len(hull) == 4
    for corner in expected:
        assert min(abs(corner - other) for other in hull) < 3e-11 * size


def test_short_decimals_stay_short_and_lie_on_the_sides_exactly(tmp_path: Path) -> None:
    pen = Pen("R2010", units=1)
    pen.lines([(x / 10, y / 10) for x, y in NOTCHED])
    outline = read(pen, tmp_path).outline
    assert outline.tolist() == [[round(2.54 * x, 9), round(2.54 * y, 9)] for x, y in NOTCHED]
    assert max(len(repr(value)) for value in outline.ravel().tolist()) <= 6
    assert len(exact_hull(outline.tolist())) == 4


def test_a_corner_that_stands_out_is_kept_and_one_by_rounding_is_not(tmp_path: Path) -> None:
    for out, count in ((1e-4, 5), (1e-9, 4)):
        pen = Pen("R2010")
        pen.lines([(0, 0), (40, 0), (40, 10), (50, -out), (100, 0), (100, 50), (0, 50)])
        outline = read(pen, tmp_path).outline
        assert len(outline) == 7
        assert len(exact_hull(outline.tolist())) == count


# ----------------------------------------------------------------
# What is no drawing of one plate.


def lines(*points: tuple[float, float], **attributes: Any) -> Callable[[Pen], Any]:
    return lambda pen: pen.lines(list(points), **attributes)


def open_chain(pen: Pen) -> None:
    for start, end in (((0, 0), (9, 0)), ((9, 0), (9, 5)), ((9, 5), (1, 5))):
        pen.space.add_line(start, end, dxfattribs={"layer": "CUT"})


def branch(pen: Pen) -> None:
    square(pen, 10)
    pen.space.add_line((10, 10), (20, 20))


def two_parts(pen: Pen) -> None:
    square(pen, 10)
    pen.lines([(20, 0), (25, 0), (25, 5)])


def island(pen: Pen) -> None:
    square(pen, 30)
    pen.space.add_circle((15, 15), 10)
    pen.space.add_circle((14, 15), 3)


def crossing(pen: Pen) -> None:
    square(pen, 30)
    pen.space.add_circle((30, 15), 5)


def touching(pen: Pen) -> None:
    """By a circle whose chords do not touch."""
    square(pen, 30)
    pen.space.add_circle((15, 5), 5)


def touching_holes(pen: Pen) -> None:
    square(pen, 30)
    pen.space.add_circle((10, 15), 4)
    pen.space.add_circle((18, 15), 4)


def hole_at_hole(pen: Pen) -> None:
    square(pen, 30)
    pen.space.add_circle((10, 15), 4)
    pen.lines([(12, 12), (20, 12), (20, 20), (12, 20)])


def tilted(pen: Pen) -> None:
    pen.space.add_circle((0, 0), 5, dxfattribs={"extrusion": (0, 1, 1)})


def itself(pen: Pen) -> None:
    block = pen.document.blocks.new("A")
    block.add_blockref("A", (1, 1))
    pen.space.add_blockref("A", (0, 0))


def bomb(pen: Pen) -> None:
    pen.document.blocks.new("B0").add_line((0, 0), (1, 1))
    for k in range(20):
        block = pen.document.blocks.new(f"B{k + 1}")
        block.add_blockref(f"B{k}", (0, 0))
        block.add_blockref(f"B{k}", (1, 0))
    pen.space.add_blockref("B20", (0, 0))


def far_away(pen: Pen) -> None:
    pen.lines([(1e9, 0), (1e9 + 10, 0), (1e9, 10)])


def text_alone(pen: Pen) -> None:
    pen.space.add_text("nothing else")


def jump(pen: Pen) -> None:
    spline = pen.space.add_spline()
    spline.dxf.degree = 1
    spline.control_points = [(0, 0), (10, 0), (20, 10), (0, 10)]
    spline.knots = [0, 0, 1, 1, 2, 2]
    pen.space.add_line((0, 10), (0, 0))


REFUSED_DXF = [
    (open_chain, {}, r"the line from \(0, 0\) mm to \(1, 5\) mm on layer 'CUT' is 'open'.*--layer"),
    (branch, {}, r"\(10, 10\) mm on layer '0' is 'one where 3 ends meet'.*--layer"),
    (two_parts, {}, r"through \(0, 0\) mm and \(2., .\) mm is 'two that lie beside each other'.*--layer"),
    (island, {}, r"'two that cross, touch or lie within each other'"),
    (crossing, {}, r"'two that cross or touch'"),
    (touching, {}, r"'two that cross or touch'"),
    (touching_holes, {}, r"'two that cross, touch or lie within each other'"),
    (hole_at_hole, {}, r"'two that cross, touch or lie within each other'"),
    (lines((0, 0), (10, 10), (10, 0), (0, 10)), {}, r"'one that crosses or touches itself at \(5, 5\) mm'"),
    (lines((0, 0), (10, 0), (5, 5e-7)), {}, "the outline is 'a line'"),
    (tilted, {}, r"the CIRCLE at \(-5, 0, 0\) on layer '0' is 'tilted'"),
    (itself, {}, "'one of more than 200000 lines, or 64 levels'"),
    (bomb, {}, "'one of more than 200000 lines, or 64 levels'"),
    (far_away, {}, r"'one that reaches \(1e\+09, 0\) mm'"),
    (text_alone, {}, "'without lines; left out: 1 TEXT'"),
    (jump, {}, "a spline of the drawing is 'one that jumps'"),
    (square, {"error": "1 in2"}, "this length is '1 in2'"),
    (square, {"error": "-1 mm"}, "the error of chords is '-1 mm'; allowed: a length above 0"),
    (square, {"error": "1e-9 mm"}, "the error of chords is '1e-9 mm'; allowed: from 1e-06 mm"),
    (square, {"scale": "0 mm"}, "the scale is '0 mm'; allowed: a length above 0"),
    (square, {"scale": "1 deg"}, "this length is '1 deg'"),
    (square, {"unit": "miles"}, "the unit of the drawing is 'miles'; allowed: m, cm, mm"),
    (square, {"layers": "0"}, "the argument layers of read_drawing is '0'"),
]


@pytest.mark.parametrize(("draw", "words", "said"), REFUSED_DXF)
def test_refuses_dxf_of_no_plate(
    draw: Callable[[Pen], Any], words: dict[str, Any], said: str, tmp_path: Path
) -> None:
    pen = Pen("R2010")
    draw(pen)
    with pytest.raises(AnswerError) as wrong:
        read(pen, tmp_path, **words)
    assert re.search(said, str(wrong.value))
    assert "\n" not in str(wrong.value)


def test_r12_states_no_unit(tmp_path: Path) -> None:
    pen = square(Pen("R12"), 10)
    with pytest.raises(
        AnswerError, match=r"the unit of the drawing is 'not stated'; .*; give --unit mm, say"
    ):
        read(pen, tmp_path, unit=None)
    assert read(pen, tmp_path, unit="mm").unit == "mm"


WHOLE = SVG.format('width="9mm"', RECT)
REFUSED_FILES = [
    ("part.pdf", b"%PDF", "a file that ends in .dxf or .svg"),
    ("part", b"0", "a file that ends in .dxf or .svg"),
    ("part.dxf", b"", "is '0 bytes long'"),
    ("part.svg", b"", "is '0 bytes long'"),
    ("part.dxf", b"hello\nworld\n", "this DXF is"),
    ("part.dxf", bytes(range(256)) * 40, "this DXF is"),
    ("part.dxf", b"AutoCAD Binary DXF\r\n\x1a\x00" + bytes(range(256)) * 9, "this DXF is"),
    ("part.dxf", b"  0\nSECTION\n  2\nENTITIES\n  0\nLINE\n 10\nabc\n", "this DXF is"),
    ("part.dxf", b"  0\nSECTION\n  2\nENTITIES\n  0\nLINE\n 10\n1.0\n 20\nnan\n  0\nENDSEC\n  0\nEOF\n", "is"),
    ("part.svg", b"<svg", "this SVG is"),
    ("part.svg", b"\x89PNG\r\n\x1a\n\0\0", "this SVG is"),
    ("part.svg", b"<html><p/></html>", "its reader says: its first element is 'html'"),
    ("part.svg", b'<!DOCTYPE svg [<!ENTITY a "b">]><svg>&a;</svg>', "this SVG is 'one with <!ENTITY'"),
    ("part.svg", '<!DOCTYPE svg [<!ENTITY a "b">]><svg>&a;</svg>'.encode("utf-16"), "'one with <!ENTITY'"),
    ("part.svg", WHOLE.replace('height="15"', 'height="15%"').encode(), "height is '15%'"),
    ("part.svg", WHOLE.replace('height="15"', 'height="much"').encode(), "height is 'much'"),
    ("part.svg", SVG.format('width="9mm"', '<path d="M0 0 L 5"/>').encode(), "this SVG is"),
    ("part.svg", SVG.format('width="9mm"', '<path d="M0 0 L 5 5"/>').encode(), "is 'open'"),
    ("part.svg", SVG.format('width="9mm"', '<path d="M0 0 L 5 1e999 3 3Z"/>').encode(), "'one that reaches"),
    ("part.svg", SVG.format('width="9mm"', '<path d="M0 0 L 5 1e300 3 3Z"/>').encode(), "'one that reaches"),
    ("part.svg", SVG.format('width="9mm"', "<text>a</text>").encode(), "'without lines; left out: 1 text'"),
    ("part.svg", SVG.format("", RECT).encode(), "the unit of the drawing is 'not stated'"),
    ("part.svg", SVG.format('width="9px"', RECT).encode(), "the unit of the drawing is 'not stated'"),
    ("part.svg", SVG.format("", '<g id="a"><use href="#a"/></g>').encode(), "64 levels"),
    ("part.svg", SVG.format("", "<g>" * 3000 + "</g>" * 3000).encode(), "64 levels"),
    (
        "part.svg",
        SVG.format(
            "",
            '<g id="a0"><path d="M0 0H1"/></g>'
            + "".join(f'<g id="a{k + 1}"><use href="#a{k}"/><use href="#a{k}"/></g>' for k in range(20)),
        ).encode(),
        "200000 lines",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("name", "content", "said"), REFUSED_FILES)
def test_refuses_broken_files_in_one_line(name: str, content: bytes, said: str, tmp_path: Path) -> None:
    file = tmp_path / name
    file.write_bytes(content)
    with pytest.raises(AnswerError) as wrong:
        read_drawing(file)
    assert str(wrong.value).startswith(f"{file}: ")
    assert said in str(wrong.value)
    assert "\n" not in str(wrong.value)


def test_refuses_what_is_no_file(tmp_path: Path) -> None:
    (tmp_path / "folder.dxf").mkdir()
    with (tmp_path / "long.svg").open("wb") as file:
        file.truncate(50_000_001)
    for name, said in (
        ("folder.dxf", "Is a directory"),
        ("gone.dxf", "No such file"),
        ("long.svg", "50000001 bytes"),
    ):
        with pytest.raises(AnswerError, match=f"the drawing is '{said}"):
            read_drawing(tmp_path / name)
    with pytest.raises(AnswerError, match=r"layer is 'x'; allowed: none: it has no layers"):
        read_text(tmp_path, "", RECT, layers=["x"])


@pytest.mark.parametrize("name", ["ezdxf", "svgelements", "shapely"])
def test_a_missing_package_names_the_extra(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import sys

    square(Pen("R2010")).document.saveas(tmp_path / "part.dxf")
    (tmp_path / "part.svg").write_text(WHOLE)
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(AnswerError, match=rf"the package {name} is 'missing'.*limitsets\[drawing\]"):
        read_drawing(tmp_path / ("part.svg" if name == "svgelements" else "part.dxf"))
