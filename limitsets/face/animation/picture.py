"""What a frame looks like, in pixels from the upper left: the arm with parts and cavity, below a lane for each side.

Both have one axis of x, so that a part stands over its place in the lanes.  Fixed shapes are drawn once
(`Picture.still`); moving shapes are computed frame by frame (`Picture.moving`), or drawn by the script of a page from
the same numbers (`writers.py`).  Colours and sizes are those of `plot.style`; nothing is in colour alone.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array
from limitsets.face.animation.film import Extents, Film, Lanes
from limitsets.face.plot import style
from limitsets.face.plot.throwing import turned
from limitsets.feeder.scene import Scene

# ---------------------------------------------------------------- Things to draw, in pixels from the upper left


TEXT = {"fill": style.INK, "size": 14.0}


class Shape(NamedTuple):
    """A shape to draw.

    Attributes
    ----------
    kind : str
        "polygon", "line", "circle" or "text".
    points : ndarray, shape (n, 2)
        Corners, or one place [pixels].
    look : dict
        fill, stroke, width, dash, radius, opacity; of text: words, size, weight, anchor; what: its name.
    """

    kind: str
    points: Array
    look: dict[str, Any]


def shape_of(kind: str, points: Any, **look: Any) -> Shape:
    """Make a shape."""
    return Shape(kind, np.asarray(points, dtype=np.float64).reshape(-1, 2), look)


def closed(points: Any, **look: Any) -> Shape:
    """Make the line around a polygon."""
    return shape_of("line", [*points, points[0]], **look)


def text_of(words: str, x: float, y: float, **look: Any) -> Shape:
    """Make a text."""
    return shape_of("text", (x, y), words=words, **{**TEXT, **look})


# ----------------------------------------------------------------
# The lanes under the arm: limit sets, critical points, the goal, what a controller knows; one lane for each
# side.


LEFT = 62.0
"""Room for names, left of the joint in all pictures [pixels]."""

LANE, GAP, AXIS, LINE = 34.0, 22.0, 22.0, 12.0
KNOWN: dict[str, Any] = {"fill": "#F2C14E", "stroke": "#8A6D00", "width": 0.8}
THIN: dict[str, Any] = {"stroke": style.INK, "width": 0.8}
CRITICAL: dict[str, Any] = {"stroke": style.INK, "width": 2.2}
WHITE: dict[str, Any] = {"stroke": "#ffffff", "width": 1.2}
VISITED: dict[str, Any] = {"radius": 3.0, "fill": style.INK, "opacity": 0.55}


def pointer(x: float, y: float) -> list[tuple[float, float]]:
    """Corners of a sign under a place on the arm."""
    return [(x, y + 1.0), (x - 6.5, y + 14.0), (x + 6.5, y + 14.0)]


def box(left: float, right: float, top: float, bottom: float) -> list[tuple[float, float]]:
    """Corners of a rectangle."""
    return [(left, top), (right, top), (right, bottom), (left, bottom)]


# ----------------------------------------------------------------
# A frame in pixels from the upper left: the arm with the parts above, a lane for each side below.


# The widest and the narrowest picture, its borders, and the largest height of the part above the lanes.
WIDEST, NARROWEST = 900.0, 640.0
RIGHT, TOP, FOOT = 22.0, 62.0, 62.0
TALLEST = 500.0
# The line from a part to its place in the lanes is left out if it leans by more than this [pixels].
LEANS = 16.0
THICK = 0.45
"""Of the arm [length, for one 28 long]."""

PARTS = ("#cfe3f2", "#f6dfae", "#c9e7da", "#eccfe2", "#dcdcdc", "#efeac2")
EDGES = (style.JOG, "#8A6D00", style.GOAL, style.ROLL, style.INK, "#6d6a2e")
GROUND, ARM = "#dedede", "#c4c4c4"


@dataclass(frozen=True, eq=False)
class Picture:
    """A film in pixels.

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
        """Choose the scale of a film, such that the moving parts stay in sight."""
        lo, hi = _bounds(film)
        across, up = (hi - lo).tolist()
        scale = min((WIDEST - LEFT - RIGHT) / across, TALLEST / up)
        wide = 2 * math.ceil(0.5 * max(NARROWEST, scale * across + LEFT + RIGHT))
        left = LEFT + 0.5 * (wide - LEFT - RIGHT - scale * across)
        bottom = TOP + scale * up
        lanes = film.lanes
        room = 0.0 if lanes is None else GAP + LINE * len(lanes.lines) + LANE * len(lanes.begin) + AXIS
        tall = 2 * math.ceil(0.5 * (bottom + room + FOOT))  # even, as video codecs require of a converted GIF
        origin = left - scale * float(lo[0]), TOP + scale * float(hi[1])
        return cls(film, scale, origin, bottom, (wide, tall))

    def at(self, points: Any) -> Array:
        """Turn lengths from the joint into pixels."""
        pixels: Array = np.asarray(points) * np.array([self.scale, -self.scale]) + np.array(self.origin)
        return pixels

    # ---------------------------------------------------------------- what does not move

    def still(self) -> list[Shape]:
        """Draw the fixed shapes."""
        film = self.film
        shapes = [] if film.arm.any() else self._ground(0)
        if film.lanes is not None:
            shapes += [*self._lanes(film.lanes), *self._axis(film.lanes), *self._key(film.lanes)]
        words = f"{film.title}: {film.about}" if film.about else film.title
        for number, line in enumerate(textwrap.wrap(words, int(self.size[0] / 6.6))[:2]):
            y = self.size[1] - 22.0 + 14.0 * number
            shapes.append(text_of(line, 12.0, y, size=11.0, fill="#5a5a5a", what="about"))
        return shapes

    def _ground(self, k: int) -> list[Shape]:
        # ground is as thick as parts are long: it is clipped to the upper part of the picture
        sight = (2.0, TOP - 20.0), (self.size[0] - 2.0, self.bottom)
        pieces = [np.clip(self.at(piece), *sight) for piece in self.film.ground_polygons(k)]
        shapes = [shape_of("polygon", piece, fill=GROUND, what="ground") for piece in pieces]
        return shapes + [closed(piece, stroke="#9a9a9a", width=1.0) for piece in pieces]

    # ---------------------------------------------------------------- the lanes under the arm

    def place(self, x: float) -> float:
        """Turn x into pixels."""
        return self.origin[0] + self.scale * x

    def height(self, side: float) -> float:
        """Height of a lane, or of a place between two lanes [pixels]."""
        lines = 0 if self.film.lanes is None else len(self.film.lanes.lines)
        return self.bottom + GAP + LINE * lines + LANE * (side + 0.35)

    def _foot(self, lanes: Lanes) -> float:
        return self.height(len(lanes.begin) - 0.5)

    def _lanes(self, lanes: Lanes) -> Iterator[Shape]:
        """Draw limit sets, critical points, the goal and other places; one lane for each side."""
        for side, begin in enumerate(lanes.begin):
            y = self.height(side)
            yield text_of(f"side {side}", 8.0, y + 4.5, size=13.0)
            ends = [(self.place(begin), y), (self.place(lanes.end), y)]
            yield shape_of("line", ends, stroke="#b9b9b9", width=1.0)
        for number, extents in enumerate(lanes.sets):
            yield from self.bars(
                extents, 6.0, fill=style.of_set(number)["facecolor"], what="limit set", **THIN
            )
        for side, points in lanes.critical.items():
            for x in points:
                px, y = self.place(x), self.height(side)
                yield shape_of("line", [(px, y - 10), (px, y + 10)], what="critical", **CRITICAL)
        uprights = [(x, words, style.INK, (6.0, 3.0)) for x, words in lanes.lines]
        if lanes.goal is not None:
            x, side = lanes.goal
            words = f"goal: side {side} from {x:g} {self.film.unit} on"
            uprights.append((x, words, style.GOAL, (2.0, 2.5)))
        for number, (x, words, colour, dash) in enumerate(uprights, start=1):
            px, top = self.place(x), self.height(-0.45) - 12.0 * number * (number <= len(lanes.lines))
            ends = [(px, top), (px, self._foot(lanes))]
            yield shape_of("line", ends, stroke=colour, width=1.6, dash=dash, what=words)
            shift, anchor = (-5.0, "end") if px > self.size[0] - 190.0 else (5.0, "start")
            yield text_of(words, px + shift, top + 3.0, anchor=anchor, size=11.5, fill=colour)

    def _axis(self, lanes: Lanes) -> Iterator[Shape]:
        """Draw ticks of x under the lanes."""
        y, end = self._foot(lanes), lanes.end
        steps = [number * ten for ten in (0.01, 0.1, 1.0, 10.0, 100.0) for number in (1, 2, 5)]
        step = next((step for step in steps if step * 8 >= end), end)
        last = int(end / step)
        for k in range(last + 1):
            px = self.place(k * step)
            words = f"{k * step:g} {self.film.unit}" if k == last else f"{k * step:g}"
            yield shape_of("line", [(px, y), (px, y + 4.0)], stroke="#8c8c8c", width=1.0)
            yield text_of(words, px, y + 15.0, anchor="middle", size=11.0, fill="#5a5a5a")

    def _key(self, lanes: Lanes) -> Iterator[Shape]:
        """Say what the signs in the lanes mean."""
        y = self._foot(lanes) + AXIS + 16.0
        rolls = any(mark.word == "roll" for mark in self.film.marks)
        face = style.of_set(0)["facecolor"]
        # whether it is drawn, its words, their distance from the sign's left end and the room for both, the sign
        entries: list[tuple[Any, str, float, float, str, Any, dict[str, Any]]] = [
            (lanes.sets, "limit set", 23, 88, "polygon", box(0, 18, y - 7, y + 1), {"fill": face, **THIN}),
            (
                any(lanes.critical.values()),
                "critical point",
                10,
                100,
                "line",
                [(3, y - 10), (3, y + 3)],
                CRITICAL,
            ),
            (lanes.known, "known to be here", 23, 132, "polygon", box(0, 18, y - 8, y + 2), KNOWN),
            (True, "the part", 14, 77, "circle", (5, y - 4), {"fill": style.FLIP, "radius": 5.5, **WHITE}),
            (True, "earlier rests", 11, 90, "circle", (3, y - 4), VISITED),
            (True, "impact", 21, 66, "polygon", pointer(11, y - 10), {"fill": style.FLIP}),
            (rolls, "rolls on", 21, 0, "polygon", pointer(11, y - 10), {"fill": style.ROLL}),
        ]
        x = LEFT
        for drawn, words, beside, wide, kind, points, look in entries:
            if drawn:
                yield shape_of(kind, np.add(points, (x, 0.0)), **look)
                yield text_of(words, x + beside, y, size=11.0, fill="#3d3d3d")
                x += wide

    def bars(self, extents: Extents, half: float, **look: Any) -> Iterator[Shape]:
        """Draw intervals in the lanes."""
        for side, parts in extents.items():
            y = self.height(side)
            for lo, hi in parts:
                left = self.place(lo)
                right = max(self.place(hi), left + 1.0)
                yield shape_of("polygon", box(left, right, y - half, y + half), **look)

    # ---------------------------------------------------------------- what moves

    def moving(self, k: int) -> list[Shape]:
        """Draw the moving shapes of a frame."""
        film = self.film
        shapes = [
            *self._known(k),
            *(self._ground(k) if film.arm.any() else ()),
            *self._arm(k),
            *self._trail(k),
        ]
        for part in range(len(film.outlines)):
            shapes += self._part(k, part)
        shapes += [*self._marks(k), *self._in_lanes(k)]
        caption, note = film.captions[int(film.caption[k])], film.notes[int(film.note[k])]
        clock = f"{film.times[k]:.2f} {film.clock.removeprefix('1')}"
        shapes.append(text_of(caption, 12.0, 26.0, size=18.0, weight="bold", what="caption"))
        shapes.append(text_of(clock, self.size[0] - 12.0, 26.0, anchor="end", fill="#5a5a5a", what="clock"))
        if note:
            shapes.append(text_of(note, 12.0, 48.0, fill="#3d3d3d", what="note"))
        return shapes

    def _known(self, k: int) -> Iterable[Shape]:
        lanes, stage = self.film.lanes, int(self.film.stage[k])
        if lanes is None or stage < 0:
            return ()
        return self.bars(lanes.known[stage], 10.0, what="known", opacity=0.75, **KNOWN)

    def _arm(self, k: int) -> Iterator[Shape]:
        if self.film.surface is not None:
            corners = self.at(self.film.arm_polygon(k, THICK * self.film.surface[1] / 28.0))
            yield shape_of("polygon", corners, fill=ARM, what="arm")
            yield shape_of("line", corners[:2], stroke=style.INK, width=2.2)
            yield shape_of(
                "circle", self.origin, radius=5.5, what="joint", fill="#ffffff", stroke=style.INK, width=1.6
            )

    def _trail(self, k: int) -> Iterator[Shape]:
        first, last = (int(frame) for frame in self.film.trail[k])
        if last > first:
            path = self.at(self.film.poses[first : last + 1, 0, :2])
            yield closed(
                self.at(self.film.polygon(first)), what="left", stroke="#a9a9a9", width=1.0, dash=(3.0, 3.0)
            )
            yield shape_of("line", path, stroke=style.FLIP, width=1.6, dash=(5.0, 3.0), what="trail")

    def _part(self, k: int, part: int) -> Iterator[Shape]:
        film = self.film
        x, y, angle = film.poses[k, part].tolist()
        if not math.isfinite(x):
            return
        look = {"fill": PARTS[part % len(PARTS)], "stroke": EDGES[part % len(EDGES)], "width": 2.0}
        yield shape_of("polygon", self.at(film.polygon(k, part)), what="part", **look)
        cos, sin = math.cos(angle), math.sin(angle)
        for label in film.labels[part]:
            px, py = self.at((x + cos * label.x - sin * label.y, y + sin * label.x + cos * label.y))
            yield text_of(label.word, px, py + 4.5, anchor="middle", size=13.0, what="label")
        if film.labels[part]:
            yield shape_of("circle", self.at((x, y)), radius=3.2, fill="#ffffff", stroke=style.INK, width=1.4)

    def _marks(self, k: int) -> Iterator[Shape]:
        for mark in self.film.marks:
            if mark.word in ("impact", "roll") and mark.frame <= k < mark.until:
                fill = style.FLIP if mark.word == "impact" else style.ROLL
                corners = pointer(*self.at((mark.x, mark.y)).tolist())
                yield shape_of("polygon", corners, fill=fill, what=mark.word)

    def _in_lanes(self, k: int) -> Iterator[Shape]:
        film = self.film
        x, side = film.position[k].tolist()
        if film.lanes is None or not math.isfinite(x):
            return
        for rest in film.rests:
            if rest.frame <= k:
                place = self.place(rest.x), self.height(rest.side)
                yield shape_of("circle", place, what="visited", **VISITED)
        px, y = self.place(x), self.height(side)
        centre = self.at(film.poses[k, 0, :2])
        if abs(float(centre[0]) - px) < LEANS:
            yield shape_of(
                "line", [centre, (px, y)], what="plumb", stroke="#7d7d7d", width=0.9, dash=(1.5, 2.5)
            )
        yield shape_of("circle", (px, y), what="here", fill=style.FLIP, radius=6.5, **WHITE | {"width": 1.4})


def _bounds(film: Film) -> tuple[Array, Array]:
    """Find the least and the largest x and y in the film."""
    places = [np.reshape(film.view, (-1, 2))]
    for part, outline in enumerate(film.outlines):
        pose = film.poses[:, part]
        pose = pose[np.isfinite(pose[:, 0])]
        cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        for u, v in outline.tolist():
            places.append(np.stack([pose[:, 0] + cos * u - sin * v, pose[:, 1] + sin * u + cos * v], axis=-1))
    if film.surface is not None:
        end, angles = film.surface[1], (float(film.arm.min()), float(film.arm.max()))
        places += [turned(piece, angle) for piece in film.ground for angle in angles]
        places.append(np.array([(0.0, 0.0), (end, 0.0), *((end, end * math.sin(angle)) for angle in angles)]))
    if film.lanes is not None:
        places.append(np.array([[film.lanes.end, 0.0]]))
    everything = np.concatenate(places)
    margin = 0.06 * max(float(np.hypot(*outline.T).max()) for outline in film.outlines)
    low, high = everything.min(axis=0), everything.max(axis=0)
    return low - margin * np.array([1.5, 4.0]), high + margin * np.array([1.5, 1.0])


# ----------------------------------------------------------------
# The cavity in a film: a sheet as thick as the arm, fixed to the arm, which turns with it.


def cavity_pieces(scene: Scene, wall: float) -> tuple[Array, ...]:
    """Give ramp, floor and far wall as convex polygons, with the arm level.

    Parameters
    ----------
    scene : Scene
        The scene; without a cavity there are no pieces.
    wall : float
        Height of the far wall over the arm's surface [length].
    """
    cavity, top = scene.cavity, scene.surface_height
    if cavity is None:
        return ()
    thick, end = THICK * cavity.position / 28.0, np.array([cavity.position, top])
    (before, _), (far, height) = cavity.line[-2:]
    line = [*cavity.line[: None if before < far else -1], (far, max(height, wall))]
    corners = []
    for (x, y), (past, over) in pairwise(line):
        if past - x > 1e-6 * cavity.width:
            corners.append([(x, y - thick), (past, over - thick), (past, over), (x, y)])
        elif (
            over != y
        ):  # upright: the ground lies outward of an edge that rises, and inward of one that falls
            left, low, high = x - thick * (over < y), min(y, over) - thick, max(y, over)
            corners.append([(left, low), (left + thick, low), (left + thick, high), (left, high)])
    return tuple(np.array(each) + end for each in corners)
