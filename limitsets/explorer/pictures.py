"""The pictures of the page, as Bokeh figures: what changes in them is data, so that a slider moves them fast."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from bokeh.models import ColumnDataSource
from bokeh.plotting import figure

from limitsets.animation.cutting import labels_of
from limitsets.animation.film import Film
from limitsets.plot import basin, style
from limitsets.plot.poses import angle_on_side, turned
from limitsets.scene import Scene

__all__ = ["ArmPicture", "PartPicture", "bare_figure", "look_of", "pattern", "put", "source_of"]

Array = npt.NDArray[np.float64]

PART, ARM, TRAIL = "#F2C14E", "#9a9a9a", "#666666"
# How thick the arm is, of its length.
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


def bare_figure(called: str, **options: Any) -> Any:
    """Make a figure without tools: a finger that scrolls the page must not move the picture."""
    made = figure(
        name=called, toolbar_location=None, tools="", sizing_mode="stretch_width", min_border=4, **options
    )
    made.xgrid.visible = made.ygrid.visible = False
    made.outline_line_color = None
    return made


def source_of(*names: str, called: str | None = None) -> ColumnDataSource:
    """Make an empty source; scripts of a reader, and tests, find it in the page by what it is called."""
    return ColumnDataSource({name: [] for name in names}, name=called)


def put(source: ColumnDataSource, columns: dict[str, list[Any]]) -> None:
    """Give a source its columns; what is there already is not sent to the browser again."""
    if any(source.data[name] != column for name, column in columns.items()):
        source.data = columns


def _scaled(called: str, title: str) -> tuple[Any, ColumnDataSource]:
    """Make a figure with one scale for both axes on any screen, and the source of what has to be in sight."""
    made = bare_figure(called, height=250, match_aspect=True, title=title)
    sight = source_of("x", "y")
    box = made.scatter("x", "y", source=sight, alpha=0.0)
    for axes in (made.x_range, made.y_range):
        axes.renderers, axes.range_padding = [box], 0.08
    made.xaxis.visible = made.yaxis.visible = False
    return made, sight


def _see(sight: ColumnDataSource, corners: Array) -> None:
    """Keep corners in sight; the same ones are not sent again."""
    x, y = np.stack([corners.min(axis=0), corners.max(axis=0)]).T.tolist()
    if sight.data["x"] != x or sight.data["y"] != y:
        sight.data = {"x": x, "y": y}


class PartPicture:
    """The part by itself: outline, numbers of its sides, centre of mass; and corners that are being drawn."""

    def __init__(self) -> None:
        self.figure, self._sight = _scaled("the part", "the part; drag the cross")
        self._outline, self._labels = source_of("x", "y"), source_of("x", "y", "words")
        self.centre, self.corners = source_of("x", "y", called="centre of mass"), source_of("x", "y")
        self.figure.patch(
            "x", "y", source=self._outline, fill_color=PART, line_color=style.INK, line_width=1.5
        )
        self.figure.text(
            "x",
            "y",
            "words",
            source=self._labels,
            text_align="center",
            text_baseline="middle",
            text_font_size="13px",
        )
        cross: Any = {"marker": "circle_cross", "size": 22, "line_color": style.INK, "line_width": 2.0}
        self.figure.scatter("x", "y", source=self.centre, fill_color="white", **cross)
        dots = {"line_dash": "dashed", "line_color": style.FLIP, "line_width": 2}
        self.figure.line("x", "y", source=self.corners, **dots)
        self.figure.scatter("x", "y", source=self.corners, size=10, fill_color="white", line_color=style.FLIP)

    def show(self, scene: Scene) -> None:
        """Draw a scene's part."""
        x, y = scene.vertices.T.tolist()
        put(self._outline, {"x": x, "y": y})
        labels = labels_of(scene)
        cx, cy = scene.centre
        put(
            self._labels,
            {
                "x": [each.x + cx for each in labels],
                "y": [each.y + cy for each in labels],
                "words": [each.word for each in labels],
            },
        )
        put(self.centre, {"x": [float(cx)], "y": [float(cy)]})
        _see(self._sight, scene.vertices)

    def is_at_mark(self, x: float, y: float) -> bool:
        """Whether a place is as near to the mark as a finger can tell: an eighth of the part's size."""
        (cx,), (cy,) = self.centre.data["x"], self.centre.data["y"]
        size = np.ptp(np.array([self._outline.data["x"], self._outline.data["y"]]), axis=1).max()
        return float(np.hypot(x - cx, y - cy)) <= 0.125 * float(size)

    def sketch(self, corners: Sequence[tuple[float, float]]) -> None:
        """Show corners that are being drawn, closed once there are three."""
        closed = [*corners, *corners[:1]] if len(corners) > 2 else list(corners)
        put(self.corners, {"x": [x for x, _ in closed], "y": [y for _, y in closed]})


class ArmPicture:
    """The arm and the part on it, at rest or in a film."""

    def __init__(self) -> None:
        self.figure, self._sight = _scaled("the arm", "")
        self._arm, self._part, self._trail = (
            source_of("x", "y", called=each) for each in ("arm", "part", "path")
        )
        self._words = source_of("x", "y", "words")
        self.figure.patch("x", "y", source=self._arm, fill_color=ARM, line_color=style.INK)
        self.figure.line("x", "y", source=self._trail, line_color=TRAIL, line_dash="dotted", line_width=2)
        self.figure.patch("x", "y", source=self._part, fill_color=PART, line_color=style.INK, line_width=1.5)
        self.figure.text(
            "x",
            "y",
            "words",
            source=self._words,
            text_align="center",
            text_baseline="middle",
            text_font_size="12px",
        )
        self.figure.scatter(
            [0], [0], size=9, fill_color="white", line_color=style.INK, line_width=2
        )  # the joint

    def rest(self, scene: Scene, x: float, side: int) -> None:
        """Draw the part at rest."""
        height, end = scene.surface_height, scene.arm_length
        about = scene.vertices - np.asarray(scene.centre)
        angle = angle_on_side(scene, side)
        at = np.array([x, height + float(scene.sides.d[side])])
        labels = [(each.x, each.y, each.word) for each in labels_of(scene)]
        self._place(turned(about, angle) + at, at, angle, labels)
        self._level(height, end, 0.0)
        put(self._trail, {"x": [], "y": []})
        tall = float(np.ptp(about, axis=0).max())
        _see(self._sight, np.array([[0.0, height - THICK * end], [end, max(height, 0.0) + 1.2 * tall]]))
        self.figure.title.text = f"the arm, {end:g} {scene.unit}; x = {x:.2f} on side {side}"

    def begin(self, film: Film) -> None:
        """Choose what is in sight for a whole film."""
        assert film.surface is not None  # of throws on the arm
        places = film.poses[:, 0, :2]
        size = float(np.hypot(*film.outlines[0].T).max())
        corners = [
            places.min(axis=0) - size,
            places.max(axis=0) + size,
            (0.0, film.surface[0]),
            (film.surface[1], 0.0),
        ]
        _see(self._sight, np.array(corners))

    def frame(self, film: Film, number: int) -> None:
        """Draw a frame of a film."""
        assert film.surface is not None  # of throws on the arm
        x, y, angle = film.poses[number, 0].tolist()
        labels = [(each.x, each.y, each.word) for each in film.labels[0]]
        self._place(film.polygon(number), np.array([x, y]), angle, labels)
        self._level(*film.surface, float(film.arm[number]))
        first, last = film.trail[number].tolist()
        path = film.poses[first : last + 1, 0, :2].T.tolist() if last > first else ([], [])
        put(self._trail, {"x": path[0], "y": path[1]})
        self.figure.title.text = film.captions[film.caption[number]]

    def _place(self, corners: Array, at: Array, angle: float, labels: list[tuple[float, float, str]]) -> None:
        x, y = corners.T.tolist()
        put(self._part, {"x": x, "y": y})
        words = turned(np.array([[px, py] for px, py, _ in labels]), angle) + at
        put(
            self._words,
            {
                "x": words[:, 0].tolist(),
                "y": words[:, 1].tolist(),
                "words": [w for *_, w in labels],
            },
        )

    def _level(self, height: float, end: float, angle: float) -> None:
        thick = THICK * end
        corners = np.array([[0.0, height], [end, height], [end, height - thick], [0.0, height - thick]])
        x, y = turned(corners, angle).T.tolist()
        put(self._arm, {"x": x, "y": y})
