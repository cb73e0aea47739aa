"""Where parts come to rest, and where a map leads, as Bokeh figures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from bokeh.models import CustomJSTickFormatter, FixedTicker, Range1d

from limitsets.explorer.estimates import Estimate
from limitsets.explorer.pictures import bare_figure, look_of, pattern, put, source_of
from limitsets.goals import OrientedBeyond, Reaches
from limitsets.plot import style
from limitsets.scene import Scene

__all__ = ["LanesPicture", "PointsPicture"]

Array = npt.NDArray[np.float64]


class LanesPicture:
    """A lane for each side: basins as strips, limit sets as bars in them, critical points, the goal, the start."""

    def __init__(self) -> None:
        self.figure = bare_figure(
            "lanes", height=285, x_range=Range1d(0, 1), y_range=Range1d(-1, 1), title=""
        )
        self.figure.xaxis.axis_label = "x"
        bars = ("left", "right", "bottom", "top", "face", "hatch")
        self._basins, self._sets = source_of(*bars, called="basins"), source_of(*bars, called="limit sets")
        self._critical = source_of("x", "y0", "y1", "words", called="critical points")
        self._goal, self._start = source_of("x", "y", "words", "align"), source_of("x", "y")
        self._threshold = source_of("x", "y", "words", called="threshold")
        look: dict[str, Any] = {
            "hatch_pattern": "hatch",
            "hatch_alpha": 0.45,
            "hatch_weight": 1,
            "hatch_scale": 8,
        }
        for source, line in ((self._basins, "#777777"), (self._sets, style.INK)):
            self.figure.quad(
                left="left",
                right="right",
                bottom="bottom",
                top="top",
                source=source,
                fill_color="face",
                line_color=line,
                **look,
            )
        self.figure.segment("x", "y0", "x", "y1", source=self._critical, line_color=style.INK, line_width=3)
        note: dict[str, Any] = {
            "text_font_size": "11px",
            "background_fill_color": "white",
            "background_fill_alpha": 0.85,
        }
        self.figure.text(
            "x",
            "y0",
            "words",
            source=self._critical,
            text_align="center",
            text_baseline="top",
            y_offset=1,
            **note,
        )
        self.figure.line(
            "x", "y", source=self._goal, line_color=style.GOAL, line_width=2.5, line_dash="dotted"
        )
        self.figure.text(
            "x", "y", "words", source=self._goal, text_color=style.GOAL, text_align="align", **note
        )
        self.figure.scatter(
            "x",
            "y",
            source=self._threshold,
            marker="diamond",
            size=11,
            fill_color=style.GOAL,
            line_color="white",
        )
        self.figure.text(
            "x", "y", "words", source=self._threshold, text_color=style.GOAL, text_align="right",
            text_baseline="middle", x_offset=-8, **note,
        )  # fmt: skip
        self.figure.scatter(
            "x",
            "y",
            source=self._start,
            marker="inverted_triangle",
            size=14,
            fill_color=style.FLIP,
            line_color="white",
        )

    def frame(self, found: Estimate, unit: str) -> None:
        """Lay the lanes out."""
        count, lo, hi = len(found.lo), min(found.lo), max(found.hi)
        room = 0.01 * (hi - lo)
        self.figure.x_range.start, self.figure.x_range.end = min(lo, 0.0) - room, hi + room
        self.figure.y_range.start, self.figure.y_range.end = -count + 0.1, 0.75
        self.figure.yaxis.ticker = FixedTicker(ticks=[-side for side in range(count)])
        self.figure.yaxis.formatter = CustomJSTickFormatter(code="return 'side ' + (-tick)")
        self.figure.yaxis.major_tick_line_color = None
        self.figure.xaxis.axis_label = f"x [{unit}]" if unit else "x"

    def show(self, found: Estimate, scene: Scene | None = None) -> None:
        """Draw an estimate."""
        rows = [
            (lo, hi, -side - 0.3, -side + 0.3, *look_of(label)[:2]) for side, lo, hi, label in found.basins
        ]
        put(self._basins, _columns(rows, "left", "right", "bottom", "top", "face", "hatch"))
        rows = []
        for k, extents in enumerate(found.sets):
            face, hatch = style.SETS[k % len(style.SETS)]
            for side, parts in extents.items():
                rows += [(lo, hi, -side - 0.14, -side + 0.14, face, pattern(hatch)) for lo, hi in parts]
        put(self._sets, _columns(rows, "left", "right", "bottom", "top", "face", "hatch"))
        marks = [
            (x, -side - 0.3, -side + 0.3, f"r{side}{chr(39) * number} {x:.2f}")
            for side, number, x in found.critical
        ]
        put(self._critical, _columns(marks, "x", "y0", "y1", "words"))
        goal = None if scene is None else scene.goal
        if scene is not None and isinstance(goal, OrientedBeyond | Reaches):
            bottom = -len(found.lo) + 0.15
            asked = f" goal: side {goal.side} from {goal.x:g} {scene.unit} on "
            align = "right" if goal.x > 0.5 * max(found.hi) else "left"
            ends: dict[str, list[Any]] = {
                "x": [goal.x] * 2,
                "y": [bottom, 0.55],
                "words": ["", asked],
                "align": [align] * 2,
            }
            put(self._goal, ends)
        else:
            put(self._goal, {"x": [], "y": [], "words": [], "align": []})
        at = [] if found.threshold is None else [found.threshold]
        texts = [f"threshold {x:.3f}" for x in at]
        put(self._threshold, {"x": at, "y": [0.28 - len(found.lo) for _ in at], "words": texts})
        self.figure.title.text = "estimate: limit sets, basins, critical points"

    def mark(self, x: float, side: float) -> None:
        """Show where the part is."""
        put(self._start, {"x": [x], "y": [0.22 - side]})


class PointsPicture:
    """Points of the attractors of a map of two or three dimensions, of which the first two coordinates are shown."""

    def __init__(self, lo: Sequence[float], hi: Sequence[float]) -> None:
        ranges = {"x_range": Range1d(lo[0], hi[0]), "y_range": Range1d(lo[1], hi[1])}
        self.figure = bare_figure(
            "map", height=460, title="", x_axis_label="x_0", y_axis_label="x_1", **ranges
        )
        self._points = source_of("x", "y", called="points")
        self.figure.scatter("x", "y", source=self._points, size=2.2, fill_color=style.JOG, line_color=None)

    def show(self, points: Array) -> None:
        """Draw them."""
        self._points.data = {"x": points[:, 0].astype(np.float32), "y": points[:, 1].astype(np.float32)}
        words = f"estimate: {len(points)} points of orbits that stay" if len(points) else "no orbit stays"
        self.figure.title.text = words


def _columns(rows: Sequence[Sequence[Any]], *names: str) -> dict[str, list[Any]]:
    return {name: [row[k] for row in rows] for k, name in enumerate(names)}
