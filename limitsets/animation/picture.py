"""What a frame looks like, in pixels from the upper left: above the arm with the parts, below a lane for each side.

Both have one axis of x, so that a part stands over its place in the lanes.  What does not move is drawn once
(`Picture.still`); what does is asked for frame by frame (`Picture.moving`), or drawn by the script of a page from the
same numbers (`page.py`).  Colours and sizes are those of `limitsets.plot.style`; nothing is in colour alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.film import Film
from limitsets.animation.lanes_drawn import KNOWN, LEFT, LanePicture, pointer
from limitsets.animation.shapes import Shape, shape_of, text_of
from limitsets.plot import style
from limitsets.plot.poses import turned

Array = NDArray[np.float64]

# The widest and the narrowest picture, its borders, and the most for what is above the lanes.
WIDEST, NARROWEST = 900.0, 640.0
RIGHT, TOP, FOOT = 22.0, 62.0, 62.0
TALLEST = 500.0
# The line from a part to its place in the lanes is left out where they are farther apart than this.
LEANS = 16.0
THICK = 0.45
"""Of the arm [length, for one 28 long]."""

PARTS = ("#cfe3f2", "#f6dfae", "#c9e7da", "#eccfe2", "#dcdcdc", "#efeac2")
EDGES = (style.JOG, "#8A6D00", style.GOAL, style.ROLL, style.INK, "#6d6a2e")
GROUND, ARM = "#dedede", "#c4c4c4"


@dataclass(frozen=True, eq=False)
class Picture:
    """A film laid out.

    Attributes
    ----------
    film : Film
        The film.
    scale : float
        Pixels for a unit of length.
    origin : tuple of (float, float)
        Where the joint is [pixels].
    bottom : float
        Of the upper part [pixels].
    size : tuple of (int, int)
        Width and height [pixels].
    """

    film: Film
    scale: float
    origin: tuple[float, float]
    bottom: float
    size: tuple[int, int]

    @classmethod
    def of(cls, film: Film) -> Picture:
        """Lay a film out: everything that moves is in sight all the time."""
        lo, hi = _bounds(film)
        across, up = (hi - lo).tolist()
        scale = min((WIDEST - LEFT - RIGHT) / across, TALLEST / up)
        wide = 2 * math.ceil(0.5 * max(NARROWEST, scale * across + LEFT + RIGHT))
        left = LEFT + 0.5 * (wide - LEFT - RIGHT - scale * across)
        bottom = TOP + scale * up
        lanes = 0.0 if film.lanes is None else LanePicture.room(film.lanes)
        tall = 2 * math.ceil(
            0.5 * (bottom + lanes + FOOT)
        )  # even, as codecs of video ask of who converts a GIF
        return cls(
            film, scale, (left - scale * float(lo[0]), TOP + scale * float(hi[1])), bottom, (wide, tall)
        )

    def at(self, points: Any) -> Array:
        """Turn lengths from the joint into pixels."""
        found: Array = np.asarray(points) * np.array([self.scale, -self.scale]) + np.array(self.origin)
        return found

    @property
    def rows(self) -> LanePicture | None:
        """The lanes, where there are any."""
        film = self.film
        if film.lanes is None:
            return None
        rolls = any(mark.word == "roll" for mark in film.marks)
        return LanePicture(
            film.lanes, film.unit, self.scale, self.origin[0], self.bottom, self.size[0], rolls
        )

    # ---------------------------------------------------------------- what does not move

    def still(self) -> list[Shape]:
        """Everything that stays where it is."""
        film = self.film
        found = [] if film.arm.any() else self._ground(0)
        if self.rows is not None:
            found += self.rows.still()
        words = f"{film.title}: {film.about}" if film.about else film.title
        for number, line in enumerate(_wrapped(words, int(self.size[0] / 6.6))):
            y = self.size[1] - 22.0 + 14.0 * number
            found.append(text_of(line, 12.0, y, size=11.0, fill="#5a5a5a", what="about"))
        return found

    def _ground(self, k: int) -> list[Shape]:
        pieces = [self._in_sight(each) for each in self.film.ground_polygons(k)]
        found = [shape_of("polygon", each, fill=GROUND, what="ground") for each in pieces]
        return found + [shape_of("line", [*each, each[0]], stroke="#9a9a9a", width=1.0) for each in pieces]

    def _in_sight(self, polygon: Array) -> Array:
        """Clip a polygon to the upper part: ground is as thick as parts are long."""
        found = self.at(polygon)
        return np.clip(found, (2.0, TOP - 20.0), (self.size[0] - 2.0, self.bottom))

    # ---------------------------------------------------------------- what moves

    def moving(self, k: int) -> list[Shape]:
        """Everything else, in a frame."""
        film = self.film
        found = self._known(k)
        found += self._ground(k) if film.arm.any() else []
        found += self._arm(k)
        first, last = (int(each) for each in film.trail[k])
        if last > first:
            path = self.at(film.poses[first : last + 1, 0, :2])
            ghost = self.at(film.polygon(first))
            found.append(
                shape_of(
                    "line", [*ghost, ghost[0]], stroke="#a9a9a9", width=1.0, dash=(3.0, 3.0), what="left"
                )
            )
            found.append(shape_of("line", path, stroke=style.FLIP, width=1.6, dash=(5.0, 3.0), what="trail"))
        for part in range(len(film.outlines)):
            found += self._part(k, part)
        found += self._marks(k)
        found += self._in_lanes(k)
        caption, note = film.captions[int(film.caption[k])], film.notes[int(film.note[k])]
        clock = f"{film.times[k]:.2f} {film.clock.removeprefix('1')}"
        found.append(text_of(caption, 12.0, 26.0, size=18.0, weight="bold", what="caption"))
        found.append(text_of(clock, self.size[0] - 12.0, 26.0, anchor="end", fill="#5a5a5a", what="clock"))
        if note:
            found.append(text_of(note, 12.0, 48.0, fill="#3d3d3d", what="note"))
        return found

    def _known(self, k: int) -> list[Shape]:
        rows, stage = self.rows, int(self.film.stage[k])
        if rows is None or stage < 0:
            return []
        return rows.bars(rows.lanes.known[stage], 10.0, what="known", **KNOWN)

    def _arm(self, k: int) -> list[Shape]:
        if self.film.surface is None:
            return []
        corners = self.at(self.film.arm_polygon(k, THICK * self.film.surface[1] / 28.0))
        joint = np.array(self.origin)
        return [
            shape_of("polygon", corners, fill=ARM, what="arm"),
            shape_of("line", corners[:2], stroke=style.INK, width=2.2),
            shape_of("circle", joint, radius=5.5, fill="#ffffff", stroke=style.INK, width=1.6, what="joint"),
        ]

    def _part(self, k: int, part: int) -> list[Shape]:
        film = self.film
        x, y, angle = film.poses[k, part].tolist()
        if not math.isfinite(x):
            return []
        look = {"fill": PARTS[part % len(PARTS)], "stroke": EDGES[part % len(EDGES)], "width": 2.0}
        found = [shape_of("polygon", self.at(film.polygon(k, part)), what="part", **look)]
        cos, sin = math.cos(angle), math.sin(angle)
        for label in film.labels[part]:
            px, py = self.at((x + cos * label.x - sin * label.y, y + sin * label.x + cos * label.y))
            found.append(text_of(label.word, px, py + 4.5, anchor="middle", size=13.0, what="label"))
        if film.labels[part]:
            found.append(
                shape_of("circle", self.at((x, y)), radius=3.2, fill="#ffffff", stroke=style.INK, width=1.4)
            )
        return found

    def _marks(self, k: int) -> list[Shape]:
        found = []
        for mark in self.film.marks:
            if mark.word in ("impact", "roll") and mark.frame <= k < mark.until:
                x, y = self.at((mark.x, mark.y)).tolist()
                corners = pointer(x, y)
                fill = style.FLIP if mark.word == "impact" else style.ROLL
                found.append(shape_of("polygon", corners, fill=fill, what=mark.word))
        return found

    def _in_lanes(self, k: int) -> list[Shape]:
        film, rows = self.film, self.rows
        x, side = film.position[k].tolist()
        if rows is None or not math.isfinite(x):
            return []
        found = []
        for rest in film.rests:
            if rest.frame <= k:
                place = rows.place(rest.x), rows.height(rest.side)
                found.append(
                    shape_of("circle", place, radius=3.0, fill=style.INK, opacity=0.55, what="visited")
                )
        px, y = rows.place(x), rows.height(side)
        centre = self.at(film.poses[k, 0, :2])
        if abs(float(centre[0]) - px) < LEANS:
            dots = {"stroke": "#7d7d7d", "width": 0.9, "dash": (1.5, 2.5)}
            found.append(shape_of("line", [centre, (px, y)], what="plumb", **dots))
        look = {"fill": style.FLIP, "stroke": "#ffffff", "width": 1.4}
        return [*found, shape_of("circle", (px, y), radius=6.5, what="here", **look)]


def _bounds(film: Film) -> tuple[Array, Array]:
    """Find the least and the largest x and y of what is shown."""
    reach = max(float(np.hypot(*outline.T).max()) for outline in film.outlines)
    lo, hi = np.array([np.inf, np.inf]), np.array([-np.inf, -np.inf])
    for part, outline in enumerate(film.outlines):
        pose = film.poses[:, part]
        pose = pose[np.isfinite(pose[:, 0])]
        if not pose.size:
            continue
        cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        for u, v in outline.tolist():
            x, y = pose[:, 0] + cos * u - sin * v, pose[:, 1] + sin * u + cos * v
            lo, hi = np.minimum(lo, (x.min(), y.min())), np.maximum(hi, (x.max(), y.max()))
    places = list(film.view)
    if film.surface is not None:
        angles = (float(film.arm.min()), float(film.arm.max()))
        places += [tuple(each) for piece in film.ground for k in angles for each in turned(piece, k).tolist()]
        end = film.surface[1]
        places += [
            (0.0, 0.0),
            (end, 0.0),
            *((end, end * math.sin(float(k))) for k in (film.arm.min(), film.arm.max())),
        ]
    if film.lanes is not None:
        places.append((film.lanes.end, 0.0))
    for place in places:
        lo, hi = np.minimum(lo, place), np.maximum(hi, place)
    margin = 0.06 * reach
    return lo - margin * np.array([1.5, 4.0]), hi + margin * np.array([1.5, 1.0])


def _wrapped(words: str, most: int) -> Sequence[str]:
    import textwrap

    return textwrap.wrap(words, most)[:2]
