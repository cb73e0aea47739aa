"""The lanes under the arm: limit sets, critical points, the goal, what a controller knows; one lane for each side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from limitsets.animation.film import Extents, Lanes
from limitsets.animation.shapes import Shape, shape_of, text_of
from limitsets.plot import style

LEFT = 62.0
"""Left of the joint's side of all pictures there is so much room for names [pixels]."""

LANE, GAP, AXIS, LINE = 34.0, 22.0, 22.0, 12.0
KNOWN: dict[str, Any] = {"fill": "#F2C14E", "stroke": "#8A6D00", "width": 0.8, "opacity": 0.75}


def pointer(x: float, y: float) -> list[tuple[float, float]]:
    """Corners of a sign under a place on the arm."""
    return [(x, y + 1.0), (x - 6.5, y + 14.0), (x + 6.5, y + 14.0)]


@dataclass(frozen=True, eq=False)
class LanePicture:
    """Lanes laid out.

    Attributes
    ----------
    lanes : Lanes
        What is in them.
    unit : str
        Of x.
    scale, joint : float
        Pixels for a unit of length, and where x is 0.
    top, wide : float
        Where they begin, and how wide the picture is [pixels].
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
        """Height of a lane, also between two [pixels]."""
        return self.top + GAP + LINE * len(self.lanes.lines) + LANE * (side + 0.35)

    def still(self) -> list[Shape]:
        """Draw everything in the lanes that stays where it is."""
        lanes = self.lanes
        top, foot = self.height(-0.45), self.height(len(lanes.begin) - 0.5)
        found = []
        for side, begin in enumerate(lanes.begin):
            y, ends = self.height(side), (self.place(begin), self.place(lanes.end))
            found.append(text_of(f"side {side}", 8.0, y + 4.5, size=13.0))
            found.append(shape_of("line", [(ends[0], y), (ends[1], y)], stroke="#b9b9b9", width=1.0))
        for number, extents in enumerate(lanes.sets):
            face, _ = style.SETS[number % len(style.SETS)]
            found += self.bars(extents, 6.0, fill=face, stroke=style.INK, width=0.8, what="limit set")
        for side, points in lanes.critical.items():
            for x in points:
                px, y = self.place(x), self.height(side)
                found.append(
                    shape_of(
                        "line", [(px, y - 10), (px, y + 10)], stroke=style.INK, width=2.2, what="critical"
                    )
                )
        for number, (x, words) in enumerate(lanes.lines):
            found += self._upright(x, top - 12.0 * (number + 1), foot, style.INK, (6.0, 3.0), words)
        if lanes.goal is not None:
            x, side = lanes.goal
            words = f"goal: side {side} from {x:g} {self.unit} on"
            found += self._upright(x, top, foot, style.GOAL, (2.0, 2.5), words)
        return [*found, *self._axis(foot), *self._key(foot + AXIS + 16.0)]

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
        found = []
        for k in range(int(end / step) + 1):
            px = self.place(k * step)
            words = f"{k * step:g} {unit}" if k == int(end / step) else f"{k * step:g}"
            found.append(shape_of("line", [(px, y), (px, y + 4.0)], stroke="#8c8c8c", width=1.0))
            found.append(text_of(words, px, y + 15.0, anchor="middle", size=11.0, fill="#5a5a5a"))
        return found

    def _key(self, y: float) -> list[Shape]:
        """Say what the signs in the lanes mean."""
        lanes, x, found = self.lanes, LEFT, []
        small: dict[str, Any] = {"size": 11.0, "fill": "#3d3d3d"}
        if lanes.sets:
            bar = [(x, y - 7), (x + 18, y - 7), (x + 18, y + 1), (x, y + 1)]
            found.append(shape_of("polygon", bar, fill=style.SETS[0][0], stroke=style.INK, width=0.8))
            found.append(text_of("limit set", x + 23, y, **small))
            x += 88
        if any(lanes.critical.values()):
            found.append(shape_of("line", [(x + 3, y - 10), (x + 3, y + 3)], stroke=style.INK, width=2.2))
            found.append(text_of("critical point", x + 10, y, **small))
            x += 100
        if lanes.known:
            bar = [(x, y - 8), (x + 18, y - 8), (x + 18, y + 2), (x, y + 2)]
            found.append(shape_of("polygon", bar, fill=KNOWN["fill"], stroke=KNOWN["stroke"], width=0.8))
            found.append(text_of("known to be here", x + 23, y, **small))
            x += 132
        found.append(
            shape_of("circle", (x + 5, y - 4), radius=5.5, fill=style.FLIP, stroke="#ffffff", width=1.2)
        )
        found.append(text_of("the part", x + 14, y, **small))
        found.append(shape_of("circle", (x + 80, y - 4), radius=3.0, fill=style.INK, opacity=0.55))
        found.append(text_of("earlier rests", x + 88, y, **small))
        found.append(shape_of("polygon", pointer(x + 178.0, y - 10.0), fill=style.FLIP))
        found.append(text_of("impact", x + 188, y, **small))
        if self.rolls:
            found.append(shape_of("polygon", pointer(x + 244.0, y - 10.0), fill=style.ROLL))
            found.append(text_of("rolls on", x + 254, y, **small))
        return found

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
        found = []
        for side, parts in extents.items():
            y = self.height(side)
            for lo, hi in parts:
                left = self.place(lo)
                right = max(self.place(hi), left + 1.0)
                corners = [(left, y - half), (right, y - half), (right, y + half), (left, y + half)]
                found.append(shape_of("polygon", corners, **look))
        return found
