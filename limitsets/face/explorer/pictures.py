"""The pictures of the part, of the arm, of the places of rest, and of the attractors of a map."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.face.animation.film import Film, labels_of
from limitsets.face.explorer.canvas import Canvas, Hand, Layer
from limitsets.face.explorer.estimates import Estimate
from limitsets.face.plot import basin, style
from limitsets.face.plot.throwing import angle_on_side, turned
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import convert, parse

Array = npt.NDArray[np.float64]

PART, ARM, TRAIL = "#F2C14E", "#9a9a9a", "#666666"
# Thickness of the arm, as a share of its length.
THICK = 0.02


def pattern(hatch: str) -> str:
    """Translate a hatch of the figures."""
    return hatch[:1] or " "


def look_of(label: int) -> tuple[str, str, str]:
    """Give face, hatch and words of a label of basins."""
    if label < 0:
        face, hatch, words = basin.OUT[label]
        return face, pattern(hatch), words
    number = label % len(basin.ATTRACTORS)
    return basin.ATTRACTORS[number], pattern(basin.HATCHES[number]), f"to limit set {label}"


BARE = (6, 6, 24, 6)
"""Margins of a picture without axes [pixel]."""

PAD = 0.08
"""Room around the shapes in sight, as a share of their size."""


def _see(canvas: Canvas, corners: Array) -> None:
    """Set the view such that the corners are in sight."""
    lo, hi = corners.min(axis=0), corners.max(axis=0)
    room = PAD * (hi - lo)
    canvas.view["x"], canvas.view["y"] = np.stack([lo - room, hi + room]).T.tolist()


def _short(mass: str) -> str:
    """Write a mass with as many digits as its slider shows."""
    given = parse(mass, "mass")
    return f"{convert(given, given.unit):.4g} {given.unit}"


def _words(colour: str = style.INK, size: int = 12, **look: Any) -> Layer:
    chosen = {"align": "center", "colour": colour, "size": size, **look}
    return Layer("words", columns=("x", "y", "words"), **chosen)


class PartPicture:
    """The part alone: outline, numbers of its sides, centre of mass, and the corners of a part that is being drawn."""

    def __init__(self, touched: Callable[[Hand], None]) -> None:
        self._outline = Layer("path", "outline", line=style.INK, width=1.5, fill=PART)
        self._labels = _words(size=13)
        cross: dict[str, Any] = {
            "shape": "cross",
            "size": 22,
            "line": style.INK,
            "width": 2,
            "fill": "#ffffff",
            "grip": True,
        }
        self.centre = Layer("marks", "centre of mass", **cross)
        self.corners = Layer("path", "corners", line=style.FLIP, width=2, dash=[6, 4])
        self._dots = Layer("marks", shape="circle", size=10, line=style.FLIP, width=1, fill="#ffffff")
        added: dict[str, Any] = {"line": style.INK, "width": 1, "fill": style.FLIP}
        self._masses = Layer("marks", "added masses", shape="diamond", size=14, **added)
        self._heavy = Layer(
            "words",
            columns=("x", "y", "words"),
            align="left",
            colour=style.FLIP,
            size=12,
            shift=10,
            plate=True,
            apart=True,
        )
        shapes = [self._outline, self._labels, self.centre, self._masses, self._heavy]
        layers = [*shapes, self.corners, self._dots]
        self.canvas = Canvas("the part", layers, 250, touched, margins=BARE, equal=True)

    def show(self, scene: Scene) -> None:
        """Draw a scene's part."""
        x, y = scene.vertices.T.tolist()
        self._outline.data = {"x": x, "y": y}
        labels = labels_of(scene)
        cx, cy = (float(each) for each in scene.centre)
        self._labels.data = {
            "x": [each.x + cx for each in labels],
            "y": [each.y + cy for each in labels],
            "words": [each.word for each in labels],
        }
        self.centre.data = {"x": [cx], "y": [cy]}
        points = scene.text["part"]["mass"].get("points", ())
        places = [[scene.value(f"part.mass.points[{k}].{axis}") for k in range(len(points))] for axis in "xy"]
        x, y = places
        self.canvas.heading = "the part; sliders move its masses" if x else "the part; drag the cross"
        self._masses.data = {"x": x, "y": y}
        self._heavy.data = {"x": x, "y": y, "words": [_short(point["mass"]) for point in points]}
        _see(self.canvas, scene.vertices)

    def is_at_mark(self, x: float, y: float) -> bool:
        """Whether a place is within a finger's width of the mark: an eighth of the part's size."""
        (cx,), (cy,) = self.centre.data["x"], self.centre.data["y"]
        size = np.ptp(np.array([self._outline.data["x"], self._outline.data["y"]]), axis=1).max()
        return float(np.hypot(x - cx, y - cy)) <= 0.125 * float(size)

    def sketch(self, corners: Sequence[tuple[float, float]]) -> None:
        """Show the corners of a part that is being drawn; the outline is closed once there are three."""
        closed = [*corners, *corners[:1]] if len(corners) > 2 else list(corners)
        self.corners.data = self._dots.data = {"x": [x for x, _ in closed], "y": [y for _, y in closed]}


class ArmPicture:
    """The arm and the part on it, at rest or in a film."""

    def __init__(self) -> None:
        self._arm = Layer("path", "arm", line=style.INK, width=1, fill=ARM)
        self._trail = Layer("path", "path", line=TRAIL, width=2, dash=[2, 3])
        self._part = Layer("path", "part", line=style.INK, width=1.5, fill=PART)
        self._labels = _words()
        joint = Layer("marks", "joint", shape="circle", size=9, line=style.INK, width=2, fill="#ffffff")
        joint.data = {"x": [0.0], "y": [0.0]}
        layers = [self._arm, self._trail, self._part, self._labels, joint]
        self.canvas = Canvas("the arm", layers, 250, margins=BARE, equal=True)

    def rest(self, scene: Scene, x: float, side: int) -> None:
        """Draw the part at rest."""
        height, end = scene.surface_height, scene.arm_length
        about = scene.vertices - np.asarray(scene.centre)
        angle = angle_on_side(scene, side)
        at = np.array([x, height + float(scene.sides.d[side])])
        labels = [(each.x, each.y, each.word) for each in labels_of(scene)]
        self._place(turned(about, angle) + at, at, angle, labels)
        self._level(height, end, 0.0)
        self._trail.data = {"x": [], "y": []}
        tall = float(np.ptp(about, axis=0).max())
        _see(self.canvas, np.array([[0.0, height - THICK * end], [end, max(height, 0.0) + 1.2 * tall]]))
        self.canvas.heading = f"the arm, {end:g} {scene.unit}; x = {x:.2f} on side {side}"

    def begin(self, film: Film) -> None:
        """Choose the view for a whole film."""
        assert film.surface is not None  # of throws on the arm
        places = film.poses[:, 0, :2]
        size = float(np.hypot(*film.outlines[0].T).max())
        corners = [
            places.min(axis=0) - size,
            places.max(axis=0) + size,
            (0.0, film.surface[0]),
            (film.surface[1], 0.0),
        ]
        _see(self.canvas, np.array(corners))

    def frame(self, film: Film, number: int) -> None:
        """Draw a frame of a film."""
        assert film.surface is not None  # of throws on the arm
        x, y, angle = film.poses[number, 0].tolist()
        labels = [(each.x, each.y, each.word) for each in film.labels[0]]
        self._place(film.polygon(number), np.array([x, y]), angle, labels)
        self._level(*film.surface, float(film.arm[number]))
        first, last = film.trail[number].tolist()
        path = film.poses[first : last + 1, 0, :2].T.tolist() if last > first else ([], [])
        self._trail.data = {"x": path[0], "y": path[1]}
        self.canvas.heading = film.captions[film.caption[number]]

    def _place(self, corners: Array, at: Array, angle: float, labels: list[tuple[float, float, str]]) -> None:
        x, y = corners.T.tolist()
        self._part.data = {"x": x, "y": y}
        words = turned(np.array([[px, py] for px, py, _ in labels]), angle) + at
        self._labels.data = {
            "x": words[:, 0].tolist(),
            "y": words[:, 1].tolist(),
            "words": [w for *_, w in labels],
        }

    def _level(self, height: float, end: float, angle: float) -> None:
        thick = THICK * end
        corners = np.array([[0.0, height], [end, height], [end, height - thick], [0.0, height - thick]])
        x, y = turned(corners, angle).T.tolist()
        self._arm.data = {"x": x, "y": y}


# ----------------------------------------------------------------
# The pictures of the places of rest, and of the attractors of a map.


MARGINS = (52, 12, 24, 38)
"""Room for axes and words to the left, right, top and bottom of the frame [pixel]."""

PIXELS, FEW = 500, 40
"""Points of a plane map at so few places, in a picture so wide, are a cycle: they are drawn so that they are seen."""

BARS = ("left", "right", "bottom", "top", "face", "hatch")
WRITTEN = ("x", "y", "words", "align")


class LanesPicture:
    """A lane for each side: basins as strips, limit sets as bars in them, critical points, the goal, the start."""

    def __init__(self, touched: Callable[[Hand], None] | None = None) -> None:
        self._basins = Layer("bars", "basins", columns=BARS, line="#777777")
        self._sets = Layer("bars", "limit sets", columns=BARS, line=style.INK)
        stroke = "x", "y0", "y1"
        self._critical = Layer("strokes", "critical points", columns=stroke, line=style.INK, width=3)
        self._goal = Layer("path", "goal", line=style.GOAL, width=2.5, dash=[2, 4])
        self._threshold = Layer(
            "marks", "threshold", shape="diamond", size=13, line="#ffffff", width=1, fill=style.GOAL
        )
        part: dict[str, Any] = {"shape": "triangle", "size": 14, "line": "#ffffff", "width": 1}
        self._start = Layer("marks", "start", fill=style.FLIP, **part)
        self._points, self._limit, self._asked = (
            Layer("words", columns=WRITTEN, colour=colour, size=11, plate=True, apart=True, **look)
            for colour, look in (
                (style.INK, {"baseline": "top"}),
                (style.GOAL, {"shift": -9}),
                (style.GOAL, {}),
            )
        )
        shapes = [self._basins, self._sets, self._critical, self._goal, self._threshold, self._start]
        layers = [*shapes, self._points, self._limit, self._asked]
        self.canvas = Canvas("lanes", layers, 285, touched, margins=MARGINS, across="x", up="", lanes=[])

    def frame(self, estimate: Estimate, unit: str) -> None:
        """Set axes and lanes."""
        count, lo, hi = len(estimate.lo), min(estimate.lo), max(estimate.hi)
        room = 0.01 * (hi - lo)
        self.canvas.view |= {
            "x": [min(lo, 0.0) - room, hi + room],
            "y": [0.1 - count, 0.85],
            "across": f"x [{unit}]" if unit else "x",
            "lanes": [f"side {side}" for side in range(count)],
        }

    def show(self, estimate: Estimate, scene: Scene | None = None) -> None:
        """Draw an estimate."""
        rows = [
            (lo, hi, -side - 0.3, -side + 0.3, *look_of(label)[:2]) for side, lo, hi, label in estimate.basins
        ]
        self._basins.data = _columns(rows, *BARS)
        rows = []
        for k, extents in enumerate(estimate.sets):
            face, hatch = style.SETS[k % len(style.SETS)]
            for side, parts in extents.items():
                rows += [(lo, hi, -side - 0.14, -side + 0.14, face, pattern(hatch)) for lo, hi in parts]
        self._sets.data = _columns(rows, *BARS)
        marks = [(x, -side - 0.3, -side + 0.3) for side, _, x in estimate.critical]
        self._critical.data = _columns(marks, "x", "y0", "y1")
        names = [
            (x, -side - 0.3, f"r{side}{chr(39) * number} {x:.2f}", "center", f"r{side}{chr(39) * number}")
            for side, number, x in estimate.critical
        ]
        self._points.data = _columns(names, *WRITTEN, "short")
        goal = None if scene is None else scene.goal
        asked: list[tuple[Any, ...]] = []
        if scene is not None and isinstance(goal, OrientedBeyond | Reaches):
            align = "right" if goal.x > 0.5 * max(estimate.hi) else "left"
            asked = [(goal.x, 0.62, f" goal: side {goal.side} from {goal.x:g} {scene.unit} on ", align)]
        ends = [(x, y) for x, *_ in asked for y in (0.15 - len(estimate.lo), 0.55)]
        self._goal.data, self._asked.data = _columns(ends, "x", "y"), _columns(asked, *WRITTEN)
        low = 0.28 - len(estimate.lo)
        at = [] if estimate.threshold is None else [estimate.threshold]
        limits = [(x, low, f"threshold {x:.3f}", "right") for x in at]
        self._threshold.data = self._limit.data = _columns(limits, *WRITTEN)
        self.canvas.heading = f"estimate: limit sets, basins{', critical points' * bool(estimate.critical)}"

    def mark(self, x: float, side: float) -> None:
        """Mark the place of the part."""
        self._start.data = {"x": [x], "y": [0.22 - side]}


class PointsPicture:
    """The first two coordinates of points on the attractors of a map of two or three dimensions."""

    def __init__(self, lo: Sequence[float], hi: Sequence[float]) -> None:
        self._points = Layer("dots", "points", colour=style.JOG)
        spot: dict[str, Any] = {"shape": "circle", "size": 8, "line": style.INK, "width": 1}
        self._spots = Layer("marks", "few points", fill=style.JOG, **spot)
        self.canvas = Canvas("map", [self._points, self._spots], 460, margins=MARGINS, across="x_0", up="x_1")
        ends = np.array([lo[:2], hi[:2]])
        self._size = ends[1] - ends[0]
        self.canvas.view |= dict(zip("xy", ends.T.tolist(), strict=True))

    def show(self, points: Array) -> None:
        """Draw points; an axis is set anew once they come to its end, or fill less than a quarter of it."""
        if len(points):
            lo, hi = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
            room = 0.5 * np.maximum(hi - lo, 0.1 * self._size)
            for axis, (first, last), *ends in zip(
                "xy", self._seen(), lo, hi, lo - room, hi + room, strict=True
            ):
                low, high, fresh_low, fresh_high = ends
                if low < first or high > last or last - first > 4.0 * (fresh_high - fresh_low):
                    self.canvas.view[axis] = [float(fresh_low), float(fresh_high)]
        self._points.data = {"x": points[:, 0], "y": points[:, 1]}
        (x0, x1), (y0, y1) = self._seen()
        place = np.round((points[:, :2] - (x0, y0)) / (x1 - x0, y1 - y0) * PIXELS).astype(np.int64)
        _, first = np.unique(place[:, 0] * (2 * PIXELS) + place[:, 1], return_index=True)
        few = points[first if first.size <= FEW else first[:0]]
        self._spots.data = {"x": few[:, 0].tolist(), "y": few[:, 1].tolist()}
        words = f"estimate: {len(points)} points of orbits that stay" if len(points) else "no orbit stays"
        self.canvas.heading = words

    def _seen(self) -> list[list[float]]:
        return [self.canvas.view[axis] for axis in "xy"]


def _columns(rows: Sequence[Sequence[Any]], *names: str) -> dict[str, list[Any]]:
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}
