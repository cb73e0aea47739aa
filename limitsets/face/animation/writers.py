"""Films as files: an animated GIF from pixels, and a page of SVG and numbers that stands alone."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon
from matplotlib.text import Text
from numpy.typing import NDArray

from limitsets.base import Progress, as_plain
from limitsets.face.animation.film import Film
from limitsets.face.animation.picture import (
    ARM,
    EDGES,
    GROUND,
    KNOWN,
    LANE,
    LEANS,
    PARTS,
    THICK,
    TOP,
    Picture,
    Shape,
)
from limitsets.face.plot import style

# ----------------------------------------------------------------
# Frames as pixels, by matplotlib: fixed shapes are drawn once.


Pixels = NDArray[np.uint8]

DPI = 100.0
POINTS = 72.0 / DPI
"""Points of a pixel of the picture."""

ANCHORS = {"start": "left", "middle": "center", "end": "right"}


def frames(picture: Picture, zoom: float = 1.0, progress: Progress | None = None) -> Iterator[Pixels]:
    """Draw frame after frame, enlarged so many times; each of shape (height, width, 3), both even."""
    width, height = picture.size
    wide, tall = 2 * round(0.5 * zoom * width), 2 * round(0.5 * zoom * height)
    figure = Figure(figsize=(wide / zoom / DPI, tall / zoom / DPI), dpi=DPI * zoom)
    canvas: Any = FigureCanvasAgg(figure)  # matplotlib has no types for its methods
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0.0, width), ylim=(height, 0.0))
    axes.set_axis_off()
    for shape in picture.still():
        axes.add_artist(_artist(shape))
    canvas.draw()
    background = canvas.copy_from_bbox(figure.bbox)
    for k in range(picture.film.frames):
        if progress is not None:
            progress("frames", k, picture.film.frames)
        canvas.restore_region(background)
        for shape in picture.moving(k):
            artist = axes.add_artist(_artist(shape))
            axes.draw_artist(artist)
            artist.remove()
        yield np.array(np.asarray(canvas.buffer_rgba())[:, :, :3])


def _artist(shape: Shape) -> Any:
    look, (x, y) = shape.look, shape.points[0].tolist()
    if shape.kind == "text":
        how = {"ha": ANCHORS[look.get("anchor", "start")], "va": "baseline", "color": look["fill"]}
        return Text(
            x, y, look["words"], fontsize=look["size"] * POINTS, weight=look.get("weight", "normal"), **how
        )
    width = look.get("width", 0.0) * POINTS
    if shape.kind == "line":
        # matplotlib takes dashes in multiples of the width
        dash = (0.0, tuple(length / look["width"] for length in look["dash"])) if "dash" in look else "-"
        return Line2D(*shape.points.T, color=look["stroke"], lw=width, ls=dash, solid_capstyle="butt")
    paint = {"fc": look["fill"], "ec": look.get("stroke", "none"), "lw": width, "alpha": look.get("opacity")}
    if shape.kind == "circle":
        return Circle((x, y), look["radius"], **paint)
    return Polygon(shape.points, closed=True, joinstyle="round", **paint)


# ----------------------------------------------------------------
# A film as an animated GIF, by Pillow: all frames share one small palette, so that fixed shapes take no
# space.


ZOOM = 0.9
# Shades between a colour and white, for soft edges; and frames that are asked for their colours.
SHADES, ASKED = (0.0, 0.35, 0.7), 25


def write_gif(film: Film, file: Path, progress: Progress | None = None) -> None:
    """Write a film that plays in a loop."""
    from PIL import Image

    picture, options = Picture.of(film), {"save_all": True, "loop": 0, "optimize": False, "disposal": 1}
    palette = Image.new("P", (1, 1))
    palette.putpalette(_colours(picture))
    pictures = [
        Image.fromarray(pixels).quantize(palette=palette, dither=Image.Dither.NONE)
        for pixels in frames(picture, ZOOM, progress)
    ]
    delay = 10 * round(100.0 / film.fps)  # a GIF has whole hundredths of a second
    pictures[0].save(file, "GIF", append_images=pictures[1:], duration=delay, **options)


def _colours(picture: Picture) -> bytes:
    """Give white and shades of all colours in use: a palette chosen by area would lose small signs."""
    asked = range(0, picture.film.frames, max(1, picture.film.frames // ASKED))
    shapes = [*picture.still(), *(shape for k in asked for shape in picture.moving(k))]
    words = (shape.look.get(name) for shape in shapes for name in ("fill", "stroke"))
    drawn = dict.fromkeys(bytes.fromhex(word.removeprefix("#")) for word in words if word)
    shades = {
        bytes(round(each + (255 - each) * light) for each in colour) for light in SHADES for colour in drawn
    }
    return b"\xff\xff\xff" + b"".join(sorted(shades - {b"\xff\xff\xff"})[:255])


# ----------------------------------------------------------------
# A film as a page that stands alone: fixed shapes as SVG, moving ones as numbers, and a script that draws them.


# Digits of a length over all of the picture: a hundredth of a pixel is a tenth of the last one.
DIGITS = 6
# Texts beside the picture in a page.
BESIDE = ("caption", "note", "clock", "about")


def write_page(film: Film, file: Path, progress: Progress | None = None) -> None:
    """Write a film."""
    from jinja2 import Environment, StrictUndefined

    if progress is not None:
        progress("page", 0, 1)
    picture = Picture.of(film)
    still, first = (
        "\n".join(svg_of(shape) for shape in shapes if shape.look.get("what") not in BESIDE)
        for shapes in (picture.still(), picture.moving(0))
    )
    template = (files("limitsets.face.animation") / "page.html").read_text(encoding="utf-8")
    page = Environment(undefined=StrictUndefined, autoescape=True).from_string(template)
    top, wide, tall = TOP - 12.0, *picture.size
    words = page.render(
        film=film,
        box=f"0 {top:g} {wide} {tall - top - 34.0:g}",
        wide=wide,
        still=still,
        first=first,
        starts=_starts(film),
        # a script ends at the first "</"
        data=json.dumps(_data(picture), allow_nan=False, separators=(",", ":")).replace("</", "<\\/"),
    )
    file.write_text(words, encoding="utf-8", newline="\n")


def _starts(film: Film) -> list[tuple[int, str]]:
    """Give the frame in which each throw begins, and a sentence about it."""
    if film.rests:
        return [(rest.begin, rest.sentence) for rest in film.rests]
    thrown = sorted({mark.frame for mark in film.marks if mark.word == "thrown"})
    return [(frame, film.captions[film.caption[frame]].partition(":")[0]) for frame in thrown]


def _data(picture: Picture) -> dict[str, Any]:
    film = picture.film
    digits = max(0, DIGITS + 1 - math.ceil(math.log10(max(picture.size) / picture.scale)))

    def rounded(numbers: Any) -> Any:
        return as_plain(np.round(np.asarray(numbers, dtype=np.float64), digits))

    lanes = film.lanes
    known = () if lanes is None else lanes.known
    return {
        "fps": film.fps,
        "clock": film.clock,
        "scale": picture.scale,
        "origin": picture.origin,
        "leans": LEANS,
        "lane": [0.0 if lanes is None else picture.height(0.0), LANE],
        "times": as_plain(np.round(film.times, 4)),
        "arm": as_plain(np.round(film.arm, 6)),
        "poses": rounded(film.poses),
        "outlines": [rounded(each) for each in film.outlines],
        "labels": [[[each.word, *rounded([each.x, each.y])] for each in labels] for labels in film.labels],
        "ground": [rounded(each) for each in film.ground] if film.arm.any() else [],
        "surface": None if film.surface is None else list(film.surface),
        "thick": 0.0 if film.surface is None else THICK * film.surface[1] / 28.0,
        "captions": list(film.captions),
        "notes": list(film.notes),
        "caption": film.caption.tolist(),
        "note": film.note.tolist(),
        "trail": film.trail.tolist(),
        "marks": [
            [each.frame, each.until, each.word, *rounded([each.x, each.y])]
            for each in film.marks
            if each.word in ("impact", "roll")
        ],
        "rests": [[each.frame, *rounded([each.x]), each.side] for each in film.rests] if lanes else [],
        "position": rounded(film.position) if lanes else None,
        "stage": film.stage.tolist(),
        "known": [[rounded(bar.points) for bar in picture.bars(extents, 10.0)] for extents in known],
        "look": {
            "parts": PARTS,
            "edges": EDGES,
            "arm": ARM,
            "ground": GROUND,
            "ink": style.INK,
            "impact": style.FLIP,
            "roll": style.ROLL,
            "known": [KNOWN["fill"], KNOWN["stroke"]],
        },
    }


def svg_of(shape: Shape) -> str:
    """Write a shape as an element of SVG."""
    look, places = shape.look, " ".join(f"{x:.2f},{y:.2f}" for x, y in shape.points.tolist())
    x, y = shape.points[0].tolist()
    if shape.kind == "text":
        how = (
            f'font-size="{look["size"]:g}" text-anchor="{look.get("anchor", "start")}" fill="{look["fill"]}"'
        )
        weight = look.get("weight", "normal")
        return f'<text x="{x:.2f}" y="{y:.2f}" {how} font-weight="{weight}">{escape(look["words"])}</text>'
    paint = f'fill="{look.get("fill", "none")}" stroke="{look.get("stroke", "none")}"'
    paint += f' stroke-width="{look.get("width", 0.0):g}" stroke-linejoin="round"'
    if "dash" in look:
        paint += f' stroke-dasharray="{" ".join(f"{each:g}" for each in look["dash"])}"'
    if "opacity" in look:
        paint += f' opacity="{look["opacity"]:g}"'
    if shape.kind == "circle":
        return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{look["radius"]:g}" {paint}/>'
    return f'<{"polyline" if shape.kind == "line" else "polygon"} points="{places}" {paint}/>'
