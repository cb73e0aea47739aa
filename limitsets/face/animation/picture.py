"""What a frame looks like, in pixels from the upper left: the arm with parts and cavity, below a lane for each side.

Both have one axis of x, so that a part stands over its place in the lanes.  Fixed shapes are drawn once
(`Picture.still`); moving shapes are computed frame by frame (`Picture.moving`), or drawn by the script of a page from
the same numbers (`writers.py`).  Colours and sizes are those of `plot.style`; nothing is in colour alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.face.animation.film import Extents, Film, Lanes
from limitsets.face.plot import style
from limitsets.face.plot.throwing import turned

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene


# ---------------------------------------------------------------- Things to draw, in pixels from the upper left


Array = NDArray[np.float64]

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


def text_of(words: str, x: float, y: float, **look: Any) -> Shape:
    """Make a text."""
    return shape_of("text", (x, y), words=words, **{**TEXT, **look})


# ----------------------------------------------------------------
# The lanes under the arm: limit sets, critical points, the goal, what a controller knows; one lane for each
# side.


LEFT = 62.0
"""Room for names, left of the joint in all pictures [pixels]."""

LANE, GAP, AXIS, LINE = 34.0, 22.0, 22.0, 12.0
KNOWN: dict[str, Any] = {"fill": "#F2C14E", "stroke": "#8A6D00", "width": 0.8, "opacity": 0.75}


def pointer(x: float, y: float) -> list[tuple[float, float]]:
    """Corners of a sign under a place on the arm."""
    return [(x, y + 1.0), (x - 6.5, y + 14.0), (x + 6.5, y + 14.0)]


@dataclass(frozen=True, eq=False)
class LanePicture:
    """The lanes in pixels.

    Attributes
    ----------
    lanes : Lanes
        Contents of the lanes.
    unit : str
        Of x.
    scale, joint : float
        Pixels for a unit of length, and place of x = 0 [pixels].
    top, wide : float
        Upper end of the lanes, and width of the picture [pixels].
    rolls : bool
        Whether a part rolls on in the film.
    """

    lanes: Lanes
    unit: str
    scale: float
    joint: float
    top: float
    wide: float
    rolls: bool = False

    @staticmethod
    def room(lanes: Lanes) -> float:
        """Give the height that lanes take [pixels]."""
        return GAP + LINE * len(lanes.lines) + LANE * len(lanes.begin) + AXIS

    def place(self, x: float) -> float:
        """Turn x into pixels."""
        return self.joint + self.scale * x

    def height(self, side: float) -> float:
        """Height of a lane, or of a place between two lanes [pixels]."""
        return self.top + GAP + LINE * len(self.lanes.lines) + LANE * (side + 0.35)

    def still(self) -> list[Shape]:
        """Draw the fixed shapes of the lanes."""
        lanes = self.lanes
        top, foot = self.height(-0.45), self.height(len(lanes.begin) - 0.5)
        shapes = []
        for side, begin in enumerate(lanes.begin):
            y, ends = self.height(side), (self.place(begin), self.place(lanes.end))
            shapes.append(text_of(f"side {side}", 8.0, y + 4.5, size=13.0))
            shapes.append(shape_of("line", [(ends[0], y), (ends[1], y)], stroke="#b9b9b9", width=1.0))
        for number, extents in enumerate(lanes.sets):
            face, _ = style.SETS[number % len(style.SETS)]
            shapes += self.bars(extents, 6.0, fill=face, stroke=style.INK, width=0.8, what="limit set")
        for side, points in lanes.critical.items():
            for x in points:
                px, y = self.place(x), self.height(side)
                shapes.append(
                    shape_of(
                        "line", [(px, y - 10), (px, y + 10)], stroke=style.INK, width=2.2, what="critical"
                    )
                )
        for number, (x, words) in enumerate(lanes.lines):
            shapes += self._upright(x, top - 12.0 * (number + 1), foot, style.INK, (6.0, 3.0), words)
        if lanes.goal is not None:
            x, side = lanes.goal
            words = f"goal: side {side} from {x:g} {self.unit} on"
            shapes += self._upright(x, top, foot, style.GOAL, (2.0, 2.5), words)
        return [*shapes, *self._axis(foot), *self._key(foot + AXIS + 16.0)]

    def _axis(self, y: float) -> list[Shape]:
        """Draw ticks of x under the lanes."""
        end, unit = self.lanes.end, self.unit
        step = next(
            (
                each * ten
                for ten in (0.01, 0.1, 1.0, 10.0, 100.0)
                for each in (1, 2, 5)
                if each * ten * 8 >= end
            ),
            end,
        )
        shapes = []
        for k in range(int(end / step) + 1):
            px = self.place(k * step)
            words = f"{k * step:g} {unit}" if k == int(end / step) else f"{k * step:g}"
            shapes.append(shape_of("line", [(px, y), (px, y + 4.0)], stroke="#8c8c8c", width=1.0))
            shapes.append(text_of(words, px, y + 15.0, anchor="middle", size=11.0, fill="#5a5a5a"))
        return shapes

    def _key(self, y: float) -> list[Shape]:
        """Say what the signs in the lanes mean."""
        lanes, x, shapes = self.lanes, LEFT, []
        small: dict[str, Any] = {"size": 11.0, "fill": "#3d3d3d"}
        if lanes.sets:
            bar = [(x, y - 7), (x + 18, y - 7), (x + 18, y + 1), (x, y + 1)]
            shapes.append(shape_of("polygon", bar, fill=style.SETS[0][0], stroke=style.INK, width=0.8))
            shapes.append(text_of("limit set", x + 23, y, **small))
            x += 88
        if any(lanes.critical.values()):
            shapes.append(shape_of("line", [(x + 3, y - 10), (x + 3, y + 3)], stroke=style.INK, width=2.2))
            shapes.append(text_of("critical point", x + 10, y, **small))
            x += 100
        if lanes.known:
            bar = [(x, y - 8), (x + 18, y - 8), (x + 18, y + 2), (x, y + 2)]
            shapes.append(shape_of("polygon", bar, fill=KNOWN["fill"], stroke=KNOWN["stroke"], width=0.8))
            shapes.append(text_of("known to be here", x + 23, y, **small))
            x += 132
        shapes.append(
            shape_of("circle", (x + 5, y - 4), radius=5.5, fill=style.FLIP, stroke="#ffffff", width=1.2)
        )
        shapes.append(text_of("the part", x + 14, y, **small))
        shapes.append(shape_of("circle", (x + 80, y - 4), radius=3.0, fill=style.INK, opacity=0.55))
        shapes.append(text_of("earlier rests", x + 88, y, **small))
        shapes.append(shape_of("polygon", pointer(x + 178.0, y - 10.0), fill=style.FLIP))
        shapes.append(text_of("impact", x + 188, y, **small))
        if self.rolls:
            shapes.append(shape_of("polygon", pointer(x + 244.0, y - 10.0), fill=style.ROLL))
            shapes.append(text_of("rolls on", x + 254, y, **small))
        return shapes

    def _upright(
        self, x: float, top: float, foot: float, colour: str, dash: tuple[float, ...], words: str
    ) -> list[Shape]:
        px = self.place(x)
        near_right = px > self.wide - 190.0
        look = {"anchor": "end" if near_right else "start", "size": 11.5, "fill": colour}
        return [
            shape_of("line", [(px, top), (px, foot)], stroke=colour, width=1.6, dash=dash, what=words),
            text_of(words, px + (-5.0 if near_right else 5.0), top + 3.0, **look),
        ]

    def bars(self, extents: Extents, half: float, **look: Any) -> list[Shape]:
        """Draw intervals in the lanes."""
        shapes = []
        for side, parts in extents.items():
            y = self.height(side)
            for lo, hi in parts:
                left = self.place(lo)
                right = max(self.place(hi), left + 1.0)
                corners = [(left, y - half), (right, y - half), (right, y + half), (left, y + half)]
                shapes.append(shape_of("polygon", corners, **look))
        return shapes


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
        lanes = 0.0 if film.lanes is None else LanePicture.room(film.lanes)
        tall = 2 * math.ceil(
            0.5 * (bottom + lanes + FOOT)
        )  # even, as video codecs require when a GIF is converted
        return cls(
            film, scale, (left - scale * float(lo[0]), TOP + scale * float(hi[1])), bottom, (wide, tall)
        )

    def at(self, points: Any) -> Array:
        """Turn lengths from the joint into pixels."""
        pixels: Array = np.asarray(points) * np.array([self.scale, -self.scale]) + np.array(self.origin)
        return pixels

    @property
    def rows(self) -> LanePicture | None:
        """The lanes, or None if the film has none."""
        film = self.film
        if film.lanes is None:
            return None
        rolls = any(mark.word == "roll" for mark in film.marks)
        return LanePicture(
            film.lanes,
            film.unit,
            self.scale,
            joint=self.origin[0],
            top=self.bottom,
            wide=self.size[0],
            rolls=rolls,
        )

    # ---------------------------------------------------------------- what does not move

    def still(self) -> list[Shape]:
        """Draw the fixed shapes."""
        film = self.film
        shapes = [] if film.arm.any() else self._ground(0)
        if self.rows is not None:
            shapes += self.rows.still()
        words = f"{film.title}: {film.about}" if film.about else film.title
        for number, line in enumerate(_wrapped(words, int(self.size[0] / 6.6))):
            y = self.size[1] - 22.0 + 14.0 * number
            shapes.append(text_of(line, 12.0, y, size=11.0, fill="#5a5a5a", what="about"))
        return shapes

    def _ground(self, k: int) -> list[Shape]:
        pieces = [self._in_sight(each) for each in self.film.ground_polygons(k)]
        shapes = [shape_of("polygon", each, fill=GROUND, what="ground") for each in pieces]
        return shapes + [shape_of("line", [*each, each[0]], stroke="#9a9a9a", width=1.0) for each in pieces]

    def _in_sight(self, polygon: Array) -> Array:
        """Clip a polygon to the upper part of the picture: ground is as thick as parts are long."""
        pixels = self.at(polygon)
        return np.clip(pixels, (2.0, TOP - 20.0), (self.size[0] - 2.0, self.bottom))

    # ---------------------------------------------------------------- what moves

    def moving(self, k: int) -> list[Shape]:
        """Draw the moving shapes of a frame."""
        film = self.film
        shapes = self._known(k)
        shapes += self._ground(k) if film.arm.any() else []
        shapes += self._arm(k)
        first, last = (int(each) for each in film.trail[k])
        if last > first:
            path = self.at(film.poses[first : last + 1, 0, :2])
            ghost = self.at(film.polygon(first))
            shapes.append(
                shape_of(
                    "line", [*ghost, ghost[0]], stroke="#a9a9a9", width=1.0, dash=(3.0, 3.0), what="left"
                )
            )
            shapes.append(shape_of("line", path, stroke=style.FLIP, width=1.6, dash=(5.0, 3.0), what="trail"))
        for part in range(len(film.outlines)):
            shapes += self._part(k, part)
        shapes += self._marks(k)
        shapes += self._in_lanes(k)
        caption, note = film.captions[int(film.caption[k])], film.notes[int(film.note[k])]
        clock = f"{film.times[k]:.2f} {film.clock.removeprefix('1')}"
        shapes.append(text_of(caption, 12.0, 26.0, size=18.0, weight="bold", what="caption"))
        shapes.append(text_of(clock, self.size[0] - 12.0, 26.0, anchor="end", fill="#5a5a5a", what="clock"))
        if note:
            shapes.append(text_of(note, 12.0, 48.0, fill="#3d3d3d", what="note"))
        return shapes

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
        shapes = [shape_of("polygon", self.at(film.polygon(k, part)), what="part", **look)]
        cos, sin = math.cos(angle), math.sin(angle)
        for label in film.labels[part]:
            px, py = self.at((x + cos * label.x - sin * label.y, y + sin * label.x + cos * label.y))
            shapes.append(text_of(label.word, px, py + 4.5, anchor="middle", size=13.0, what="label"))
        if film.labels[part]:
            shapes.append(
                shape_of("circle", self.at((x, y)), radius=3.2, fill="#ffffff", stroke=style.INK, width=1.4)
            )
        return shapes

    def _marks(self, k: int) -> list[Shape]:
        shapes = []
        for mark in self.film.marks:
            if mark.word in ("impact", "roll") and mark.frame <= k < mark.until:
                x, y = self.at((mark.x, mark.y)).tolist()
                corners = pointer(x, y)
                fill = style.FLIP if mark.word == "impact" else style.ROLL
                shapes.append(shape_of("polygon", corners, fill=fill, what=mark.word))
        return shapes

    def _in_lanes(self, k: int) -> list[Shape]:
        film, rows = self.film, self.rows
        x, side = film.position[k].tolist()
        if rows is None or not math.isfinite(x):
            return []
        shapes = []
        for rest in film.rests:
            if rest.frame <= k:
                place = rows.place(rest.x), rows.height(rest.side)
                shapes.append(
                    shape_of("circle", place, radius=3.0, fill=style.INK, opacity=0.55, what="visited")
                )
        px, y = rows.place(x), rows.height(side)
        centre = self.at(film.poses[k, 0, :2])
        if abs(float(centre[0]) - px) < LEANS:
            dots = {"stroke": "#7d7d7d", "width": 0.9, "dash": (1.5, 2.5)}
            shapes.append(shape_of("line", [centre, (px, y)], what="plumb", **dots))
        look = {"fill": style.FLIP, "stroke": "#ffffff", "width": 1.4}
        return [*shapes, shape_of("circle", (px, y), radius=6.5, what="here", **look)]


def _bounds(film: Film) -> tuple[Array, Array]:
    """Find the least and the largest x and y in the film."""
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
    end, low, thick = cavity.position, top - cavity.depth, THICK * cavity.position / 28.0
    foot, far = end + cavity.depth / math.tan(cavity.angle), end + cavity.width
    corners = [
        [(end, top - thick), (foot, low - thick), (foot, low), (end, top)],
        [(foot, low - thick), (far, low - thick), (far, low), (foot, low)],
        [(far, low - thick), (far + thick, low - thick), (far + thick, top + wall), (far, top + wall)],
    ]
    return tuple(np.array(each) for each in corners if each[1][0] - each[0][0] > 1e-6 * cavity.width)
