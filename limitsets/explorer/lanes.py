"""The pictures of where parts come to rest, and of where a map leads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.explorer.canvas import Canvas, Hand, Layer
from limitsets.explorer.estimates import Estimate
from limitsets.explorer.pictures import look_of, pattern
from limitsets.goals import OrientedBeyond, Reaches
from limitsets.plot import style
from limitsets.scene import Scene

Array = npt.NDArray[np.float64]


MARGINS = (52, 12, 24, 38)
"""Left, right, above and below the frame, where axes and words are [pixel]."""

PIXELS, FEW = 500, 40
"""Points of a plane map at so few places, in a picture so wide, are a cycle: they are drawn so that they are seen."""

WRITTEN = ("x", "y", "words", "align")


class LanesPicture:
    """A lane for each side: basins as strips, limit sets as bars in them, critical points, the goal, the start."""

    def __init__(self, touched: Callable[[Hand], None] | None = None) -> None:
        bars = "left", "right", "bottom", "top", "face", "hatch"
        self._basins = Layer("bars", "basins", columns=bars, line="#777777")
        self._sets = Layer("bars", "limit sets", columns=bars, line=style.INK)
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

    def frame(self, found: Estimate, unit: str) -> None:
        """Lay the lanes out."""
        count, lo, hi = len(found.lo), min(found.lo), max(found.hi)
        room = 0.01 * (hi - lo)
        self.canvas.view |= {
            "x": [min(lo, 0.0) - room, hi + room],
            "y": [0.1 - count, 0.85],
            "across": f"x [{unit}]" if unit else "x",
            "lanes": [f"side {side}" for side in range(count)],
        }

    def show(self, found: Estimate, scene: Scene | None = None) -> None:
        """Draw an estimate."""
        rows = [
            (lo, hi, -side - 0.3, -side + 0.3, *look_of(label)[:2]) for side, lo, hi, label in found.basins
        ]
        self._basins.data = _columns(rows, "left", "right", "bottom", "top", "face", "hatch")
        rows = []
        for k, extents in enumerate(found.sets):
            face, hatch = style.SETS[k % len(style.SETS)]
            for side, parts in extents.items():
                rows += [(lo, hi, -side - 0.14, -side + 0.14, face, pattern(hatch)) for lo, hi in parts]
        self._sets.data = _columns(rows, "left", "right", "bottom", "top", "face", "hatch")
        marks = [(x, -side - 0.3, -side + 0.3) for side, _, x in found.critical]
        self._critical.data = _columns(marks, "x", "y0", "y1")
        names = [
            (x, -side - 0.3, f"r{side}{chr(39) * number} {x:.2f}", "center", f"r{side}{chr(39) * number}")
            for side, number, x in found.critical
        ]
        self._points.data = _columns(names, *WRITTEN, "short")
        goal = None if scene is None else scene.goal
        asked: list[tuple[Any, ...]] = []
        if scene is not None and isinstance(goal, OrientedBeyond | Reaches):
            align = "right" if goal.x > 0.5 * max(found.hi) else "left"
            asked = [(goal.x, 0.62, f" goal: side {goal.side} from {goal.x:g} {scene.unit} on ", align)]
        ends = [(x, y) for x, *_ in asked for y in (0.15 - len(found.lo), 0.55)]
        self._goal.data, self._asked.data = _columns(ends, "x", "y"), _columns(asked, *WRITTEN)
        low = 0.28 - len(found.lo)
        at = [] if found.threshold is None else [found.threshold]
        limits = [(x, low, f"threshold {x:.3f}", "right") for x in at]
        self._threshold.data = self._limit.data = _columns(limits, *WRITTEN)
        self.canvas.heading = f"estimate: limit sets, basins{', critical points' * bool(found.critical)}"

    def mark(self, x: float, side: float) -> None:
        """Show where the part is."""
        self._start.data = {"x": [x], "y": [0.22 - side]}


class PointsPicture:
    """Points of the attractors of a map of two or three dimensions, of which the first two coordinates are shown."""

    def __init__(self, lo: Sequence[float], hi: Sequence[float]) -> None:
        self._points = Layer("dots", "points", colour=style.JOG)
        spot: dict[str, Any] = {"shape": "circle", "size": 8, "line": style.INK, "width": 1}
        self._spots = Layer("marks", "few points", fill=style.JOG, **spot)
        self.canvas = Canvas("map", [self._points, self._spots], 460, margins=MARGINS, across="x_0", up="x_1")
        ends = np.array([lo[:2], hi[:2]])
        self._size = ends[1] - ends[0]
        self.canvas.view |= dict(zip("xy", ends.T.tolist(), strict=True))

    def show(self, points: Array) -> None:
        """Draw them; an axis follows once they come to its end, or fill less than a quarter of what they could."""
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
