"""A film as a page that stands alone: what is still as SVG, what moves as numbers, and a script that draws it."""

from __future__ import annotations

import json
import math
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.animation.film import Film
from limitsets.animation.lanes_drawn import KNOWN, LANE
from limitsets.animation.picture import ARM, EDGES, GROUND, LEANS, PARTS, THICK, TOP, Picture
from limitsets.animation.raster import Progress
from limitsets.animation.shapes import Shape
from limitsets.files import as_plain
from limitsets.plot import style

# Digits of a length over all of the picture: a hundredth of a pixel is a tenth of the last one.
DIGITS = 6
# Texts that stand beside the picture in a page.
BESIDE = ("caption", "note", "clock", "about")


def write_page(film: Film, file: Path, progress: Progress = None) -> None:
    """Write a film."""
    from jinja2 import Environment, StrictUndefined

    if progress is not None:
        progress("page", 0, 1)
    picture = Picture.of(film)
    still = "\n".join(svg_of(each) for each in picture.still() if each.look.get("what") not in BESIDE)
    first = "\n".join(svg_of(each) for each in picture.moving(0) if each.look.get("what") not in BESIDE)
    template = (files("limitsets.animation") / "page.html").read_text(encoding="utf-8")
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

    lanes, rows = film.lanes, picture.rows
    return {
        "fps": film.fps,
        "clock": film.clock,
        "scale": picture.scale,
        "origin": picture.origin,
        "leans": LEANS,
        "lane": [0.0 if rows is None else rows.height(0.0), LANE],
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
        "known": []
        if rows is None
        else [[rounded(bar.points) for bar in rows.bars(each, 10.0, **KNOWN)] for each in rows.lanes.known],
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
        how += f' font-weight="{look.get("weight", "normal")}"'
        return f'<text x="{x:.2f}" y="{y:.2f}" {how}>{escape(look["words"])}</text>'
    paint = f'fill="{look.get("fill", "none")}" stroke="{look.get("stroke", "none")}"'
    paint += f' stroke-width="{look.get("width", 0.0):g}" stroke-linejoin="round"'
    if "dash" in look:
        paint += f' stroke-dasharray="{" ".join(f"{each:g}" for each in look["dash"])}"'
    if "opacity" in look:
        paint += f' opacity="{look["opacity"]:g}"'
    if shape.kind == "circle":
        return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{look["radius"]:g}" {paint}/>'
    return f'<{"polyline" if shape.kind == "line" else "polygon"} points="{places}" {paint}/>'
