"""Frames as pixels, by matplotlib: what does not move is drawn once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.picture import Picture
from limitsets.animation.shapes import Shape

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Progress = Callable[[str, int, int], None] | None
Pixels = NDArray[np.uint8]

DPI = 100.0
POINTS = 72.0 / DPI
"""Points of a pixel of the picture."""

ANCHORS = {"start": "left", "middle": "center", "end": "right"}


def frames(picture: Picture, zoom: float = 1.0, progress: Progress = None) -> Iterator[Pixels]:
    """Draw frame after frame, enlarged so many times; each of shape (height, width, 3), both even."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    width, height = picture.size
    wide, tall = 2 * round(0.5 * zoom * width), 2 * round(0.5 * zoom * height)
    figure = Figure(figsize=(wide / zoom / DPI, tall / zoom / DPI), dpi=DPI * zoom)
    canvas: Any = FigureCanvasAgg(figure)  # matplotlib types none of its methods
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_xlim(0.0, width)
    axes.set_ylim(height, 0.0)
    axes.set_axis_off()
    for shape in picture.still():
        axes.add_artist(_artist(shape))
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for k in range(picture.film.frames):
        if progress is not None:
            progress("frames", k, picture.film.frames)
        canvas.restore_region(background)
        _draw(axes, picture.moving(k))
        yield np.array(np.asarray(canvas.buffer_rgba())[:, :, :3])


def _draw(axes: Axes, shapes: list[Shape]) -> None:
    for shape in shapes:
        artist = axes.add_artist(_artist(shape))
        axes.draw_artist(artist)
        artist.remove()


def _artist(shape: Shape) -> Any:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Circle, Polygon
    from matplotlib.text import Text

    look, (x, y) = shape.look, shape.points[0].tolist()
    if shape.kind == "text":
        how = {"ha": ANCHORS[look.get("anchor", "start")], "va": "baseline", "color": look["fill"]}
        return Text(
            x, y, look["words"], fontsize=look["size"] * POINTS, weight=look.get("weight", "normal"), **how
        )
    width = look.get("width", 0.0) * POINTS
    if shape.kind == "line":
        # matplotlib takes dashes in multiples of the width
        dash = tuple(each / look["width"] for each in look["dash"]) if "dash" in look else None
        style: Any = (0.0, dash) if dash else "-"
        return Line2D(*shape.points.T, color=look["stroke"], lw=width, ls=style, solid_capstyle="butt")
    paint = {"fc": look["fill"], "ec": look.get("stroke", "none"), "lw": width, "alpha": look.get("opacity")}
    if shape.kind == "circle":
        return Circle((x, y), look["radius"], **paint)
    return Polygon(shape.points, closed=True, joinstyle="round", **paint)
