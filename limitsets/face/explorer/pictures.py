"""The pictures of the part, of the arm, of the places of rest, and of the attractors of a map."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from limitsets.base.arrays import Array
from limitsets.face.animation.film import Film, Pace, cut, labels_of
from limitsets.face.animation.legs import rest_leg
from limitsets.face.explorer.canvas import Canvas, Hand, Layer
from limitsets.face.explorer.estimates import Estimate
from limitsets.face.plot import basin, style
from limitsets.face.plot.throwing import turned
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.units import convert, parse

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


WORDS = ("x", "y", "words")
NUMBERS: dict[str, Any] = {"columns": WORDS, "align": "center", "colour": style.INK}
WHITE: dict[str, Any] = {"line": style.INK, "width": 2, "fill": "#ffffff"}


class PartPicture:
    """The part alone: outline, numbers of its sides, centre of mass, and the corners of a part that is being drawn."""

    def __init__(self, touched: Callable[[Hand], None]) -> None:
        heavy: dict[str, Any] = {"align": "left", "colour": style.FLIP, "size": 12, "shift": 10}
        layers = [
            Layer("path", "outline", line=style.INK, width=1.5, fill=PART),
            Layer("words", "sides", size=13, **NUMBERS),
            Layer("marks", "centre of mass", shape="cross", size=22, grip=True, **WHITE),
            Layer(
                "marks", "added masses", shape="diamond", size=14, line=style.INK, width=1, fill=style.FLIP
            ),
            Layer("words", "weights", WORDS, plate=True, apart=True, **heavy),
            Layer("path", "corners", line=style.FLIP, width=2, dash=[6, 4]),
            Layer("marks", "clicked", shape="circle", size=10, line=style.FLIP, width=1, fill="#ffffff"),
        ]
        self.canvas = Canvas("the part", layers, 250, touched, margins=BARE, equal=True)

    def show(self, scene: Scene) -> None:
        """Draw a scene's part."""
        cx, cy = (float(each) for each in scene.centre)
        masses = [
            (*(scene.value(f"part.mass.points[{k}].{axis}") for axis in "xy"), _short(point["mass"]))
            for k, point in enumerate(scene.text["part"]["mass"].get("points", ()))
        ]
        self.canvas.put("outline", scene.outline.tolist())
        self.canvas.put("sides", [(label.x + cx, label.y + cy, label.word) for label in labels_of(scene)])
        self.canvas.put("centre of mass", [(cx, cy)])
        self.canvas.put("added masses", masses)
        self.canvas.put("weights", masses)
        self.canvas.heading = "the part; sliders move its masses" if masses else "the part; drag the cross"
        _see(self.canvas, scene.vertices)

    def is_at_mark(self, x: float, y: float) -> bool:
        """Whether a place is within a finger's width of the mark: an eighth of the part's size."""
        centre, outline = (self.canvas.layer(called).data for called in ("centre of mass", "outline"))
        size = max(max(outline[axis]) - min(outline[axis]) for axis in "xy")
        return bool(math.hypot(x - centre["x"][0], y - centre["y"][0]) <= 0.125 * size)

    def sketch(self, corners: Sequence[tuple[float, float]]) -> None:
        """Show the corners of a part that is being drawn; the outline is closed once there are three."""
        for called in ("corners", "clicked"):
            self.canvas.put(called, [*corners, *corners[:1]] if len(corners) > 2 else corners)


class ArmPicture:
    """The arm and the part on it, at rest or in a film."""

    def __init__(self) -> None:
        layers = [
            Layer("path", "arm", line=style.INK, width=1, fill=ARM),
            Layer("path", "path", line=TRAIL, width=2, dash=[2, 3]),
            Layer("path", "part", line=style.INK, width=1.5, fill=PART),
            Layer("words", "sides", size=12, **NUMBERS),
            Layer("marks", "joint", shape="circle", size=9, **WHITE),
        ]
        margins = (*MARGINS[:2], *BARE[2:])  # as wide as the lanes
        self.canvas = Canvas("the arm", layers, None, margins=margins, equal=True)
        self.canvas.put("joint", [(0.0, 0.0)])

    def rest(self, scene: Scene, x: float, side: int, across: Sequence[float]) -> None:
        """Draw the part at rest, between the ends of the axis of the lanes: a place is below its x there."""
        height, end = scene.surface_height, scene.arm_length
        words = f"the arm, {end:g} {scene.unit}; x = {x:.2f} on side {side}"
        still = rest_leg(scene, x, side, seconds=0.0, caption=words)
        self.frame(cut(scene, [still], Pace(1.0, 1.0), title=scene.name, lanes=None), 0)
        low = min(height, 0.0) - 2.0 * THICK * end
        high = max(height, 0.0) + 1.2 * float(np.ptp(scene.vertices, axis=0).max())
        self.canvas.view |= {
            "x": list(across),
            "y": [low, high],
            "tall": (high - low) / (across[1] - across[0]),
        }

    def begin(self, film: Film) -> None:
        """Choose the view for a whole film."""
        assert film.surface is not None  # of throws on the arm
        places = film.poses[:, 0, :2]
        size = float(np.hypot(*film.outlines[0].T).max())
        low, high = places.min(axis=0) - size, places.max(axis=0) + size
        first, last = self.canvas.view["x"]
        ground = min(film.surface[0], 0.0) - 2.0 * THICK * film.surface[1]
        self.canvas.view |= {
            "x": [min(first, low[0]), max(last, high[0])],
            "y": [min(ground, low[1]), high[1]],
        }

    def frame(self, film: Film, number: int) -> None:
        """Draw a frame of a film."""
        assert film.surface is not None  # of throws on the arm
        x, y, angle = film.poses[number, 0].tolist()
        about = np.array([(label.x, label.y) for label in film.labels[0]])
        places = (turned(about, angle) + np.array([x, y])).tolist()
        first, last = film.trail[number].tolist()
        path = film.poses[first : last + 1, 0, :2].tolist() if last > first else ()
        self.canvas.put("part", film.polygon(number).tolist())
        self.canvas.put(
            "sides", [(*at, label.word) for at, label in zip(places, film.labels[0], strict=True)]
        )
        self.canvas.put("arm", film.arm_polygon(number, THICK * film.surface[1]).tolist())
        self.canvas.put("path", path)
        self.canvas.heading = film.captions[film.caption[number]]


# ----------------------------------------------------------------
# The pictures of the places of rest, and of the attractors of a map.


MARGINS = (52, 12, 24, 38)
"""Room for axes and words to the left, right, top and bottom of the frame [pixel]."""

PIXELS, FEW = 500, 40
"""Points of a plane map at so few places, in a picture so wide, are a cycle: they are drawn so that they are seen."""

BARS = ("left", "right", "bottom", "top", "face", "hatch")
WRITTEN: dict[str, Any] = {"columns": (*WORDS, "align"), "size": 11, "plate": True, "apart": True}


class LanesPicture:
    """A lane for each side: basins as strips, limit sets as bars in them, critical points, the goal, the start."""

    def __init__(self, touched: Callable[[Hand], None] | None = None) -> None:
        sign: dict[str, Any] = {"line": "#ffffff", "width": 1}
        names = WRITTEN | {"columns": (*WORDS, "align", "short")}
        layers = [
            Layer("bars", "basins", BARS, line="#777777"),
            Layer("bars", "limit sets", BARS, line=style.INK),
            Layer("strokes", "critical points", ("x", "y0", "y1"), line=style.INK, width=3),
            Layer("path", "goal", line=style.GOAL, width=2.5, dash=[2, 4]),
            Layer(
                "marks", "threshold", WRITTEN["columns"], shape="diamond", size=13, fill=style.GOAL, **sign
            ),
            Layer("marks", "start", shape="triangle", size=14, fill=style.FLIP, **sign),
            Layer("words", "names", colour=style.INK, baseline="top", **names),
            Layer("words", "limit", colour=style.GOAL, shift=-9, **WRITTEN),
            Layer("words", "goal in words", colour=style.GOAL, **WRITTEN),
        ]
        self.canvas = Canvas("lanes", layers, 285, touched, margins=MARGINS, across="x", up="", lanes=[])

    def frame(self, estimate: Estimate, unit: str, beyond: float = 0.0) -> None:
        """Set axes and lanes; a part is so much `beyond` the farthest place of its centre of mass."""
        count, lo, hi = len(estimate.lo), min(estimate.lo), max(estimate.hi)
        room = 0.01 * (hi - lo)
        self.canvas.view |= {
            "x": [min(lo, 0.0) - room, hi + max(room, beyond)],
            "y": [0.1 - count, 0.85],
            "across": f"x [{unit}]" if unit else "x",
            "lanes": [f"side {side}" for side in range(count)],
        }

    def show(self, estimate: Estimate, scene: Scene | None = None) -> None:
        """Draw an estimate."""
        put = self.canvas.put
        strips = estimate.basins
        put("basins", [(lo, hi, -side - 0.3, -side + 0.3, *look_of(k)[:2]) for side, lo, hi, k in strips])
        bars: list[tuple[Any, ...]] = []
        for k, extents in enumerate(estimate.sets):
            face, hatch = style.SETS[k % len(style.SETS)]
            for side, parts in extents.items():
                bars += [(lo, hi, -side - 0.14, -side + 0.14, face, pattern(hatch)) for lo, hi in parts]
        put("limit sets", bars)
        put("critical points", [(x, -side - 0.3, -side + 0.3) for side, _, x in estimate.critical])
        names = [(x, side, f"r{side}{chr(39) * number}") for side, number, x in estimate.critical]
        put("names", [(x, -side - 0.3, f"{name} {x:.2f}", "center", name) for x, side, name in names])
        goal = None if scene is None else scene.goal
        asked: list[tuple[Any, ...]] = []
        if scene is not None and isinstance(goal, OrientedBeyond | Reaches):
            align = "right" if goal.x > 0.5 * max(estimate.hi) else "left"
            asked = [(goal.x, 0.62, f" goal: side {goal.side} from {goal.x:g} {scene.unit} on ", align)]
        put("goal", [(x, y) for x, *_ in asked for y in (0.15 - len(estimate.lo), 0.55)])
        put("goal in words", asked)
        limits = [] if estimate.threshold is None else [estimate.threshold]
        for called in ("threshold", "limit"):
            put(called, [(x, 0.28 - len(estimate.lo), f"threshold {x:.3f}", "right") for x in limits])
        self.canvas.heading = f"estimate: limit sets, basins{', critical points' * bool(estimate.critical)}"

    def mark(self, x: float, side: float) -> None:
        """Mark the place of the part."""
        self.canvas.put("start", [(x, 0.22 - side)])


class PointsPicture:
    """The first two coordinates of points on the attractors of a map of two or three dimensions."""

    def __init__(self, lo: Sequence[float], hi: Sequence[float]) -> None:
        layers = [
            Layer("dots", "points", colour=style.JOG),
            Layer("marks", "few points", fill=style.JOG, shape="circle", size=8, line=style.INK, width=1),
        ]
        self.canvas = Canvas("map", layers, 460, margins=MARGINS, across="x_0", up="x_1")
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
        self.canvas.layer("points").data = {"x": points[:, 0], "y": points[:, 1]}
        (x0, x1), (y0, y1) = self._seen()
        place = np.round((points[:, :2] - (x0, y0)) / (x1 - x0, y1 - y0) * PIXELS).astype(np.int64)
        _, first = np.unique(place[:, 0] * (2 * PIXELS) + place[:, 1], return_index=True)
        self.canvas.put("few points", points[first].tolist() if first.size <= FEW else ())
        stay = f"estimate: {len(points)} points of orbits that stay"
        self.canvas.heading = stay if len(points) else "no orbit stays"

    def _seen(self) -> list[list[float]]:
        return [self.canvas.view[axis] for axis in "xy"]
