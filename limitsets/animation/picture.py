"""What a frame looks like, in pixels from the upper left: above the arm with the parts, below a lane for each side.

Both have one axis of x, so that a part stands over its place in the lanes.  What does not move is drawn once
(`Picture.still`); what does is asked for frame by frame (`Picture.moving`), or drawn by the script of a page from the
same numbers (`Picture.frame`).  Colours and sizes are those of `limitsets.plot.style`; nothing is in colour alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.film import Extents, Film
from limitsets.plot import style

__all__ = ["Picture", "Shape"]

Array = NDArray[np.float64]

# The widest and the narrowest picture, its borders, the height of a lane, and the most for what is above them.
WIDEST, NARROWEST = 900.0, 640.0
LEFT, RIGHT, TOP, FOOT = 62.0, 22.0, 62.0, 62.0
LANE, GAP, AXIS = 34.0, 22.0, 22.0
TALLEST = 500.0
# The line from a part to its place in the lanes is left out where they are farther apart than this.
LEANS = 16.0
THICK = 0.45
"""Of the arm [length, for one 28 long]."""

PARTS = ("#cfe3f2", "#f6dfae", "#c9e7da", "#eccfe2", "#dcdcdc", "#efeac2")
EDGES = (style.JOG, "#8A6D00", style.GOAL, style.ROLL, style.INK, "#6d6a2e")
KNOWN: dict[str, Any] = {"fill": "#F2C14E", "stroke": "#8A6D00", "width": 0.8, "opacity": 0.75}
GROUND, ARM = "#dedede", "#c4c4c4"
TEXT = {"fill": style.INK, "size": 14.0}


class Shape(NamedTuple):
    """Something to draw.

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


def _shape(kind: str, points: Any, **look: Any) -> Shape:
    return Shape(kind, np.asarray(points, dtype=np.float64).reshape(-1, 2), look)


def _text(words: str, x: float, y: float, **look: Any) -> Shape:
    return _shape("text", (x, y), words=words, **{**TEXT, **look})


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
        lanes = (
            0.0
            if film.lanes is None
            else GAP + LANE * len(film.lanes.begin) + AXIS + 12.0 * len(film.lanes.lines)
        )
        tall = 2 * math.ceil(0.5 * (bottom + lanes + FOOT))  # even, as the codecs of mp4 ask
        return cls(
            film, scale, (left - scale * float(lo[0]), TOP + scale * float(hi[1])), bottom, (wide, tall)
        )

    def at(self, points: Any) -> Array:
        """Turn lengths from the joint into pixels."""
        found: Array = np.asarray(points) * np.array([self.scale, -self.scale]) + np.array(self.origin)
        return found

    def lane(self, side: float) -> float:
        """Height of a lane, also between two [pixels]."""
        lines = 0 if self.film.lanes is None else len(self.film.lanes.lines)
        return self.bottom + GAP + 12.0 * lines + LANE * (side + 0.35)

    # ---------------------------------------------------------------- what does not move

    def still(self) -> list[Shape]:
        """Everything that stays where it is."""
        film = self.film
        found = [_shape("polygon", self._in_sight(each), fill=GROUND, what="ground") for each in film.ground]
        found += [
            _shape("line", [*self._in_sight(each), self._in_sight(each)[0]], stroke="#9a9a9a", width=1.0)
            for each in film.ground
        ]
        if film.lanes is not None:
            found += self._lanes()
        words = f"{film.title}: {film.about}" if film.about else film.title
        for number, line in enumerate(_wrapped(words, int(self.size[0] / 6.6))):
            y = self.size[1] - 22.0 + 14.0 * number
            found.append(_text(line, 12.0, y, size=11.0, fill="#5a5a5a", what="about"))
        return found

    def _in_sight(self, polygon: Array) -> Array:
        """Clip a polygon to the upper part: ground is as thick as parts are long."""
        found = self.at(polygon)
        return np.clip(found, (2.0, TOP - 20.0), (self.size[0] - 2.0, self.bottom))

    def _lanes(self) -> list[Shape]:
        film, lanes = self.film, self.film.lanes
        assert lanes is not None  # asked before
        top, foot = self.lane(-0.45), self.lane(len(lanes.begin) - 0.5)
        found = []
        for side, begin in enumerate(lanes.begin):
            y, ends = self.lane(side), self.at([(begin, 0.0), (lanes.end, 0.0)])[:, 0]
            found.append(_text(f"side {side}", 8.0, y + 4.5, size=13.0))
            found.append(_shape("line", [(ends[0], y), (ends[1], y)], stroke="#b9b9b9", width=1.0))
        for number, extents in enumerate(lanes.sets):
            face, _ = style.SETS[number % len(style.SETS)]
            found += self.bars(extents, 6.0, fill=face, stroke=style.INK, width=0.8, what="limit set")
        for side, points in lanes.critical.items():
            for x in points:
                px, y = self.at((x, 0.0))[0], self.lane(side)
                found.append(
                    _shape("line", [(px, y - 10), (px, y + 10)], stroke=style.INK, width=2.2, what="critical")
                )
        for number, (x, words) in enumerate(lanes.lines):
            found += self._upright(x, top - 12.0 * (number + 1), foot, style.INK, (6.0, 3.0), words)
        if lanes.goal is not None:
            x, side = lanes.goal
            words = f"goal: side {side} from {x:g} {film.unit} on"
            found += self._upright(x, top, foot, style.GOAL, (2.0, 2.5), words)
        return [*found, *self._axis(foot), *self._key(foot + AXIS + 16.0)]

    def _axis(self, y: float) -> list[Shape]:
        """Draw ticks of x under the lanes."""
        lanes, unit = self.film.lanes, self.film.unit
        assert lanes is not None  # asked before
        end = lanes.end
        step = next(
            (
                each * ten
                for ten in (0.01, 0.1, 1.0, 10.0, 100.0)
                for each in (1, 2, 5)
                if each * ten * 8 >= end
            ),
            end,
        )
        found = []
        for k in range(int(end / step) + 1):
            px = float(self.at((k * step, 0.0))[0])
            words = f"{k * step:g} {unit}" if k == int(end / step) else f"{k * step:g}"
            found.append(_shape("line", [(px, y), (px, y + 4.0)], stroke="#8c8c8c", width=1.0))
            found.append(_text(words, px, y + 15.0, anchor="middle", size=11.0, fill="#5a5a5a"))
        return found

    def _key(self, y: float) -> list[Shape]:
        """Say what the signs in the lanes mean."""
        lanes, x, found = self.film.lanes, LEFT, []
        assert lanes is not None  # asked before
        small: dict[str, Any] = {"size": 11.0, "fill": "#3d3d3d"}
        if lanes.sets:
            bar = [(x, y - 7), (x + 18, y - 7), (x + 18, y + 1), (x, y + 1)]
            found.append(_shape("polygon", bar, fill=style.SETS[0][0], stroke=style.INK, width=0.8))
            found.append(_text("limit set", x + 23, y, **small))
            x += 88
        if any(lanes.critical.values()):
            found.append(_shape("line", [(x + 3, y - 10), (x + 3, y + 3)], stroke=style.INK, width=2.2))
            found.append(_text("critical point", x + 10, y, **small))
            x += 100
        if lanes.known:
            bar = [(x, y - 8), (x + 18, y - 8), (x + 18, y + 2), (x, y + 2)]
            found.append(_shape("polygon", bar, fill=KNOWN["fill"], stroke=KNOWN["stroke"], width=0.8))
            found.append(_text("known to be here", x + 23, y, **small))
            x += 132
        found.append(
            _shape("circle", (x + 5, y - 4), radius=5.5, fill=style.FLIP, stroke="#ffffff", width=1.2)
        )
        found.append(_text("the part", x + 14, y, **small))
        found.append(_shape("circle", (x + 80, y - 4), radius=3.0, fill=style.INK, opacity=0.55))
        found.append(_text("earlier rests", x + 88, y, **small))
        found.append(_shape("polygon", _pointer(x + 178.0, y - 10.0), fill=style.FLIP))
        return [*found, _text("impact", x + 188, y, **small)]

    def _upright(
        self, x: float, top: float, foot: float, colour: str, dash: tuple[float, ...], words: str
    ) -> list[Shape]:
        px = float(self.at((x, 0.0))[0])
        near_right = px > self.size[0] - 190.0
        look = {"anchor": "end" if near_right else "start", "size": 11.5, "fill": colour}
        return [
            _shape("line", [(px, top), (px, foot)], stroke=colour, width=1.6, dash=dash, what=words),
            _text(words, px + (-5.0 if near_right else 5.0), top + 3.0, **look),
        ]

    def bars(self, extents: Extents, half: float, **look: Any) -> list[Shape]:
        """Draw intervals in the lanes."""
        found = []
        for side, parts in extents.items():
            y = self.lane(side)
            for lo, hi in parts:
                (left, _), (right, _) = self.at([(lo, 0.0), (hi, 0.0)])
                right = max(right, left + 1.0)
                corners = [(left, y - half), (right, y - half), (right, y + half), (left, y + half)]
                found.append(_shape("polygon", corners, **look))
        return found

    # ---------------------------------------------------------------- what moves

    def moving(self, k: int) -> list[Shape]:
        """Everything else, in a frame."""
        film = self.film
        found = self._known(k)
        found += self._arm(k)
        first, last = (int(each) for each in film.trail[k])
        if last > first:
            path = self.at(film.poses[first : last + 1, 0, :2])
            ghost = self.at(film.polygon(first))
            found.append(
                _shape("line", [*ghost, ghost[0]], stroke="#a9a9a9", width=1.0, dash=(3.0, 3.0), what="left")
            )
            found.append(_shape("line", path, stroke=style.FLIP, width=1.6, dash=(5.0, 3.0), what="trail"))
        for part in range(len(film.outlines)):
            found += self._part(k, part)
        found += self._marks(k)
        found += self._in_lanes(k)
        caption, note = film.captions[int(film.caption[k])], film.notes[int(film.note[k])]
        clock = f"{film.times[k]:.2f} s" if film.clock == "s" else f"{film.times[k]:.2f} /w"
        found.append(_text(caption, 12.0, 26.0, size=18.0, weight="bold", what="caption"))
        found.append(_text(clock, self.size[0] - 12.0, 26.0, anchor="end", fill="#5a5a5a", what="clock"))
        if note:
            found.append(_text(note, 12.0, 48.0, fill="#3d3d3d", what="note"))
        return found

    def _known(self, k: int) -> list[Shape]:
        lanes, stage = self.film.lanes, int(self.film.stage[k])
        if lanes is None or stage < 0:
            return []
        return self.bars(lanes.known[stage], 10.0, what="known", **KNOWN)

    def _arm(self, k: int) -> list[Shape]:
        if self.film.surface is None:
            return []
        corners = self.at(self.film.arm_polygon(k, THICK * self.film.surface[1] / 28.0))
        joint = np.array(self.origin)
        return [
            _shape("polygon", corners, fill=ARM, what="arm"),
            _shape("line", corners[:2], stroke=style.INK, width=2.2),
            _shape("circle", joint, radius=5.5, fill="#ffffff", stroke=style.INK, width=1.6, what="joint"),
        ]

    def _part(self, k: int, part: int) -> list[Shape]:
        film = self.film
        x, y, angle = film.poses[k, part].tolist()
        if not math.isfinite(x):
            return []
        look = {"fill": PARTS[part % len(PARTS)], "stroke": EDGES[part % len(EDGES)], "width": 2.0}
        found = [_shape("polygon", self.at(film.polygon(k, part)), what="part", **look)]
        cos, sin = math.cos(angle), math.sin(angle)
        for label in film.labels[part]:
            px, py = self.at((x + cos * label.x - sin * label.y, y + sin * label.x + cos * label.y))
            found.append(_text(label.word, px, py + 4.5, anchor="middle", size=13.0, what="label"))
        if film.labels[part]:
            found.append(
                _shape("circle", self.at((x, y)), radius=3.2, fill="#ffffff", stroke=style.INK, width=1.4)
            )
        return found

    def _marks(self, k: int) -> list[Shape]:
        found = []
        for mark in self.film.marks:
            if mark.word in ("impact", "roll") and mark.frame <= k < mark.until:
                x, y = self.at((mark.x, mark.y)).tolist()
                corners = _pointer(x, y)
                fill = style.FLIP if mark.word == "impact" else style.ROLL
                found.append(_shape("polygon", corners, fill=fill, what=mark.word))
        return found

    def _in_lanes(self, k: int) -> list[Shape]:
        film = self.film
        x, side = film.position[k].tolist()
        if film.lanes is None or not math.isfinite(x):
            return []
        found = []
        for rest in film.rests:
            if rest.frame <= k:
                place = self.at((rest.x, 0.0))[0], self.lane(rest.side)
                found.append(
                    _shape("circle", place, radius=3.0, fill=style.INK, opacity=0.55, what="visited")
                )
        px, y = float(self.at((x, 0.0))[0]), self.lane(side)
        centre = self.at(film.poses[k, 0, :2])
        if abs(float(centre[0]) - px) < LEANS:
            found.append(
                _shape("line", [centre, (px, y)], stroke="#7d7d7d", width=0.9, dash=(1.5, 2.5), what="plumb")
            )
        look = {"fill": style.FLIP, "stroke": "#ffffff", "width": 1.4}
        return [*found, _shape("circle", (px, y), radius=6.5, what="here", **look)]


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


def _pointer(x: float, y: float) -> list[tuple[float, float]]:
    """Corners of a sign under a place on the arm."""
    return [(x, y + 1.0), (x - 6.5, y + 14.0), (x + 6.5, y + 14.0)]


def _wrapped(words: str, most: int) -> Sequence[str]:
    import textwrap

    return textwrap.wrap(words, most)[:2]
