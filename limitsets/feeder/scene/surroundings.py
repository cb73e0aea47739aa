"""What stands around the arm: the cavity at its end, a sensor with throws to choose from, a tray."""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from itertools import pairwise
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from limitsets.feeder.geometry.polygon import Scalar, Vector, above_side, side_ends
from limitsets.feeder.scene.quantities import Resolver
from limitsets.feeder.scene.validation import Tree

if TYPE_CHECKING:
    from limitsets.feeder.geometry import RestingSides
    from limitsets.feeder.goals import Goal
    from limitsets.systems.cells import Grid


# ----------------------------------------------------------------
# The outline of the ground of a cavity or a depression, where it is a polygon.


Outline = tuple[tuple[float, float], ...]
"""Corners of the ground, x outward and y upward, from where it begins to fall at (0, 0); () where it is no polygon."""


def _outline(table: str, vertices: npt.NDArray[np.float64], goal: Goal | None, resolver: Resolver) -> Outline:
    """Resolve the outline of a cavity or a depression: its vertices, or the room that the part needs; else ()."""
    key, given = f"{table}.vertices", resolver.tree[table]
    if "vertices" not in given and "outline" not in given:
        return ()
    if "outline" in given:
        side = given.get("side", getattr(goal, "side", None))
        if side is None or side >= len(vertices):
            allowed, remedy = f"0 to {len(vertices) - 1}", f"add {table}.side, or a goal with a side"
            raise resolver.refusal(f"{table}.side", "the side of the part", side, allowed, remedy)
        angle = resolver.value(f"{table}.angle", "angle") if table == "cavity" else 0.0
        depth = None if table == "cavity" else resolver.positive(f"{table}.depression_depth", "length")
        return room_of(vertices, side, resolver.positive(f"{table}.play", "length"), angle, depth)
    last = len(given["vertices"]) - 1
    x, y = ([resolver.value(f"{key}[{k}].{axis}", "length") for k in range(last + 1)] for axis in "xy")
    allowed, remedy = "0, 0", "measure from where the ground begins to fall"
    resolver.require(x[0] == y[0] == 0.0, f"{key}[0]", "the first corner", allowed, remedy)
    for k in range(1, last + 1):
        allowed = "not below that of the corner before, above that of the one before that"
        resolver.require(
            x[k] >= x[k - 1] and (k < 2 or x[k] > x[k - 2]),
            f"{key}[{k}].x",
            "the x of this corner",
            allowed,
            "go outward: overhangs are not simulated",
        )
        remedy = "go down into the ground, and up to its surface with the last corner"
        top = y[k] >= 0.0 if table == "cavity" else y[k] == 0.0
        allowed = "below 0" if k < last else "0 or above" if table == "cavity" else "0"
        resolver.require(top if k == last else y[k] < 0.0, f"{key}[{k}].y", "the height", allowed, remedy)
    return tuple(zip(x, y, strict=True))


def room_of(
    vertices: npt.NDArray[np.float64], side: int, play: float, angle: float, depth: float | None
) -> Outline:
    """Give the ground under a convex part with so much play, into which it comes straight down.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2)
        The part, counterclockwise [length].
    side : int
        The one that lies on the ramp or the floor.
    play : float
        Between each side and the ground [length].
    angle : float
        By which that side falls outward [rad].
    depth : float or None
        Of the side's right end below the surface; None: the part's top is as high as the surface [length].

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    >>> room_of(square, 0, 0.5, 0.0, 1.0)
    ((0.0, 0.0), (0.0, -1.0), (3.0, -1.0), (3.0, 0.0))
    """
    left, right = side_ends(len(vertices), side)
    ways = np.roll(vertices, -1, axis=0) - vertices
    outward = np.stack([ways[:, 1], -ways[:, 0]], axis=1) / np.hypot(*ways.T)[:, None]
    before = np.roll(outward, 1, axis=0)
    corners = vertices + play * (outward + before) / (1.0 + (outward * before).sum(axis=1))[:, None]
    turn = -angle - math.atan2(*(vertices[right] - vertices[left])[::-1])
    cos, sin = math.cos(turn), math.sin(turn)
    corners = np.roll(corners, -right, axis=0) @ np.array([[cos, sin], [-sin, cos]])
    corners -= corners[0]  # its right end, and up from there
    if depth is not None:
        corners[:, 1] -= depth
        corners[-1, 1] = -depth  # the floor is level, to the last digit
        walls = _upward(corners[::-1] * (-1.0, 1.0)), _upward(corners)
        way = [(-x, y) for x, y in reversed(walls[0])] + walls[1]
        return tuple((x - way[0][0], y) for x, y in way)
    top = float(corners[:, 1].max())
    corners += (top / math.tan(angle), -top)
    return ((0.0, 0.0), *_upward(corners))


def _upward(corners: npt.NDArray[np.float64]) -> list[tuple[float, float]]:
    """Follow corners outward from the lowest, until they turn back or come to the surface, and go up to it there."""
    way = [(float(corners[0, 0]), float(corners[0, 1]))]
    for x, y in corners[1:].tolist():
        (x0, y0) = way[-1]
        if x <= x0:
            break
        if y >= 0.0:
            return [*way, (x0 - y0 * (x - x0) / (y - y0), 0.0)]
        way.append((x, y))
    return [*way, (way[-1][0], 0.0)]


# ----------------------------------------------------------------
# The cavity at the end of the arm: a ramp that falls from the end down to the foot of an upright far wall.


# A ramp may be longer than its cavity by this share: its sizes are decimals, and what fits exactly is rounded.
ROUNDED = 1e-6


@dataclass(frozen=True)
class Cavity:
    """Where the arm ends, and what lies beyond its end.

    Parameters
    ----------
    position : float
        Where the arm ends and the ramp begins: a part whose centre of mass rests beyond it falls in [length].
    width : float
        Of the mouth, from the end of the arm to the far wall [length].
    depth : float
        Of the floor below the arm's surface, where the ramp ends and the wall begins [length].
    angle : float
        Of the ramp below the arm's surface [rad].
    tips : str
        How a part that comes down beyond the end begins to tip over it: ``"moving"``, with the angular momentum about
        the end with which it came down, or ``"rest"``.
    outline : tuple of (float, float)
        The ground where it is a polygon, from the end of the arm: width is that of the mouth then, depth that of the
        lowest corner, the ramp its first edge; above the last corner an upright wall goes on [length].
    """

    position: float
    width: float
    depth: float
    angle: float
    tips: str = "moving"
    outline: Outline = ()

    @property
    def line(self) -> Outline:
        """The ground from the end of the arm to the top of the far wall [length]."""
        foot = self.depth / math.tan(self.angle), -self.depth
        return self.outline or ((0.0, 0.0), foot, (self.width, -self.depth), (self.width, 0.0))


def resolve_cavity(
    vertices: npt.NDArray[np.float64],
    sides: RestingSides,
    arm_length: float,
    goal: Goal | None,
    resolver: Resolver,
) -> Cavity:
    """Resolve ``[cavity]`` for a part with these vertices and sides."""
    feet, lengths = sides.a.tolist(), sides.length.tolist()
    unit, key, thing = resolver.unit, "cavity.position", "the position of the cavity"
    position = resolver.positive(key, "length")
    remedy = "the arm ends where the cavity begins; move the cavity, or lengthen the arm"
    allowed = f"up to the arm's length, {arm_length:.9g} {unit}"
    resolver.require(position <= arm_length, key, thing, allowed, remedy)
    farthest = max(range(len(feet)), key=feet.__getitem__)
    remedy = f"the part resting on side {farthest} needs that much of the arm; move the cavity outward"
    resolver.require(position > feet[farthest], key, thing, f"more than {feet[farthest]:.6g} {unit}", remedy)
    tips, wanted = resolver.text("cavity.tips") or "moving", getattr(goal, "side", None)
    if "vertices" not in resolver.tree["cavity"]:
        angle, thing = resolver.value("cavity.angle", "angle"), "the angle of the ramp"
        allowed, remedy = "above 0 and below 90 deg", "measure it downwards from the arm"
        resolver.require(0 < angle < math.pi / 2, "cavity.angle", thing, allowed, remedy)
    if outline := _outline("cavity", vertices, goal, resolver):
        (x, fall), (before, low), (end, top) = outline[1], *outline[-2:]
        allowed, remedy = "above 0: the first edge is the ramp", "let it fall under less than 90 deg"
        resolver.require(x > 0.0, "cavity.vertices[1].x", "the x of this corner", allowed, remedy)
        width = before - low * (end - before) / (top - low)  # where the wall comes to the arm's height
        return Cavity(
            position, width, -min(outline, key=itemgetter(1))[1], math.atan2(-fall, x), tips, outline
        )
    side = min(range(len(lengths)), key=lengths.__getitem__) if wanted is None else wanted
    width, thing = resolver.positive("cavity.width", "length"), "the width of the cavity"
    allowed = f"at least {lengths[side]:.6g} {unit}, the length of side {side}"
    remedy = "the part cannot lie in it; widen it"
    resolver.require(width >= lengths[side], "cavity.width", thing, allowed, remedy)
    depth, most = resolver.positive("cavity.depth", "length"), width * math.tan(angle)
    allowed = f"at most {most:.6g} {unit}, where the ramp meets the far wall"
    remedy = "the ramp is longer than the cavity: make it less deep, or wider"
    fits = depth / math.tan(angle) <= width * (1.0 + ROUNDED)
    resolver.require(fits, "cavity.depth", "the depth of the cavity", allowed, remedy)
    return Cavity(position, width, depth, angle, tips)


# ----------------------------------------------------------------
# What a controller has: throws to choose from, and a sensor that answers one question with yes or no.


Mask = NDArray[np.bool_]


def exact_text(x: float) -> str:
    """Write a float in full, so that no digit of it is lost."""
    return f"{Decimal(x):f}"


def _below(x: Fraction) -> float:
    """Give the largest float that is not above."""
    nearest = float(x)
    return nearest if Fraction(nearest) <= x else math.nextafter(nearest, -math.inf)


class Sensor(ABC):
    """A question about a part at rest, answered with yes or no."""

    @abstractmethod
    def question(self, unit: str) -> str:
        """Say what is asked, a clause."""

    @abstractmethod
    def as_text(self, unit: str) -> Mapping[str, str | int]:
        """Write it as a scene does."""

    @abstractmethod
    def answers(self, grid: Grid) -> dict[str, Mask]:
        """Give the cells in which the answer may be "yes", and those in which it may be "no", shape (n_cells,)."""

    @abstractmethod
    def read(self, x: Any, side: Any, offset: Any) -> Any:
        """Tell whether the answer is yes, for arrays of states; `offset`, from -1 to 1, is the share of the error."""


@dataclass(frozen=True)
class BeyondSensor(Sensor):
    """Ask whether the centre of mass is beyond x.

    Parameters
    ----------
    x : float
        Where the sensor stands [length].
    error : float
        The answer is right where the part is farther from x than this; nearer it may be either [length].
    """

    x: float
    error: float = 0.0

    @property
    def cuts(self) -> tuple[float, float]:
        """The largest floats not above s - error and s + error; between them either answer may come."""
        place, error = Fraction(self.x), Fraction(repr(self.error))
        return _below(place - error), _below(place + error)

    def as_text(self, unit: str) -> dict[str, str]:
        """Write it as a scene does: the place exactly, the error as decimals are read."""
        return {"beyond": f"{exact_text(self.x)} {unit}", "error": f"{self.error!r} {unit}"}

    def question(self, unit: str) -> str:
        """Say what is asked, a clause."""
        more = f" (to {self.error:g} {unit})" if self.error else ""
        return f"is the part beyond {self.x:.9g} {unit}{more}?"

    def answers(self, grid: Grid) -> dict[str, Mask]:
        """Give the cells in which the answer may be yes, x > s - error, and those in which it may be no."""
        lowest, highest = self.cuts
        ends = [(edges[:-1], edges[1:]) for (edges,) in grid.edges]
        return {
            "yes": np.concatenate([hi > lowest for _, hi in ends]),
            "no": np.concatenate([lo <= highest for lo, _ in ends]),
        }

    def read(self, x: Any, side: Any, offset: Any) -> Any:
        """Tell whether the answer is yes."""
        return x > self.x + offset * self.error


@dataclass(frozen=True)
class SideSensor(Sensor):
    """Ask whether the part lies on this side.

    Parameters
    ----------
    side : int
        The side.
    """

    side: int

    def as_text(self, unit: str) -> dict[str, int]:
        """Write it as a scene does."""
        return {"side": self.side}

    def question(self, unit: str) -> str:
        """Say what is asked, a clause."""
        return f"does the part lie on side {self.side}?"

    def answers(self, grid: Grid) -> dict[str, Mask]:
        """Give the cells of the side, and all others."""
        on = np.zeros(grid.n_cells, dtype=bool)
        on[grid.of_side(self.side)] = True
        return {"yes": on, "no": ~on}

    def read(self, x: Any, side: Any, offset: Any) -> Any:
        """Tell whether the answer is yes."""
        return side == self.side


@dataclass(frozen=True)
class ChosenThrow:
    """A throw that a controller can choose.

    Parameters
    ----------
    name : str
        Its name.
    quantity : str
        ``"throw.kappa"`` or ``"throw.speed"``: how it is written.
    text : str
        Its value as written.
    """

    name: str
    quantity: str
    text: str


@dataclass(frozen=True)
class Feedback:
    """Sensor and throws of a scene.

    Parameters
    ----------
    throws : tuple of ChosenThrow
        The throws, one at least.
    sensor : Sensor or None
        What is asked after every throw.
    """

    throws: tuple[ChosenThrow, ...]
    sensor: Sensor | None = None


def resolve_feedback(count: int, arm_length: float, resolver: Resolver, *, gravity: bool) -> Feedback:
    """Resolve ``[feedback]`` for a part with `count` sides on an arm of this length."""
    throws: list[ChosenThrow] = []
    for k, each in enumerate(resolver.text("feedback.throws")):
        key = f"feedback.throws[{k}]"
        word = "kappa" if "kappa" in each else "speed"
        unique = each["name"] not in [other.name for other in throws]
        thing, allowed = "the name of this throw", "a name of its own"
        resolver.require(unique, f"{key}.name", thing, allowed, "choose another")
        resolver.positive(f"{key}.{word}", "length" if word == "kappa" else "angular speed")
        if word == "speed" and not gravity:
            remedy = "a speed needs it: add [gravity], or give kappa"
            raise resolver.refusal(f"{key}.speed", "the gravity", "missing", "a table [gravity]", remedy)
        throws.append(ChosenThrow(each["name"], f"throw.{word}", each[word]))
    table = resolver.text("feedback.sensor")
    sensor = None if table is None else _sensor(table, count, arm_length, resolver)
    return Feedback(tuple(throws), sensor)


def _sensor(table: Tree, count: int, arm_length: float, resolver: Resolver) -> Sensor:
    key = "feedback.sensor"
    if "side" in table:
        remedy = "the error of a place: leave it out"
        resolver.require("error" not in table, f"{key}.error", "the error", "none with side", remedy)
        there, remedy = table["side"] < count, "name a side of this part"
        resolver.require(there, f"{key}.side", "the side", f"0 to {count - 1}", remedy)
        return SideSensor(table["side"])
    x = resolver.value(f"{key}.beyond", "length")
    allowed = f"from 0 to the arm's length, {arm_length:.9g} {resolver.unit}"
    resolver.require(0 <= x <= arm_length, f"{key}.beyond", "the sensor's place", allowed)
    error = resolver.value(f"{key}.error", "length") if "error" in table else 0.0
    resolver.require(error >= 0, f"{key}.error", "the sensor's error", "0 or more")
    return BeyondSensor(x, error)


# ----------------------------------------------------------------
# A tray: a plate with equal depressions, over which parts wash again and again.


@dataclass(frozen=True)
class Tray:
    """A plate with equal depressions, each with upright walls and a level floor.

    Parameters
    ----------
    depression_width, depression_depth : float
        Of each depression [length].
    pitch : float
        From one depression to the next [length].
    agitation : float
        The height that a kick of one standard deviation throws a part to [length].
    wash : float
        The height of a fall that ends at the largest speed with which parts come along the plate [length].
    outline : tuple of (float, float)
        Of each depression from its left edge, where it is a polygon: the width is that of its mouth then, the depth
        that of its lowest corner [length].
    """

    depression_width: float
    depression_depth: float
    pitch: float
    agitation: float
    wash: float
    outline: Outline = ()

    @property
    def floor(self) -> tuple[float, float]:
        """From where to where the level floor goes, from the depression's left edge; (0, 0) where there is none."""
        level = (
            (x, end) for (x, y), (end, low) in pairwise(self.outline) if y == low == -self.depression_depth
        )
        return next(level, (0.0, 0.0)) if self.outline else (0.0, self.depression_width)


def heights_over_sides(
    vertices: Sequence[Vector],
    sqrt: Callable[[Scalar], Scalar] = math.sqrt,
    larger: Callable[[Scalar, Scalar], Scalar] = max,
) -> list[Scalar]:
    """How high the part stands when it lies on each side [length]."""
    ends = (side_ends(len(vertices), side) for side in range(len(vertices)))
    measured = (
        (above_side(vertices[left], vertices[right], corner, sqrt)[1] for corner in vertices)
        for left, right in ends
    )
    return [functools.reduce(larger, heights) for heights in measured]


def resolve_tray(
    vertices: npt.NDArray[np.float64], lengths: npt.NDArray[np.float64], goal: Goal | None, resolver: Resolver
) -> Tray:
    """Resolve ``[tray]`` for a part with these vertices and lengths of its sides."""
    outline = _outline("tray", vertices, goal, resolver)
    depression = ["depression_width", "depression_depth"] if not outline else []
    words = [*depression, "pitch", "agitation", "wash"]
    sizes = {word: resolver.positive(f"tray.{word}", "length") for word in words}
    if outline:
        sizes |= {"depression_width": outline[-1][0], "depression_depth": -min(y for _, y in outline)}
    tray = Tray(**sizes, outline=outline)
    heights, wanted = heights_over_sides(vertices.tolist()), getattr(goal, "side", None)
    fit_for = range(len(heights)) if wanted is None else [wanted]
    side = min(fit_for, key=lengths.__getitem__)
    unit, width, depth = resolver.unit, tray.depression_width, tray.depression_depth
    key, thing = "tray.depression_width", "the width of a depression"
    if outline:
        key, thing = "tray.vertices", "the level floor of a depression"
    remedy, floor = "the part cannot lie in it: widen it", tray.floor[1] - tray.floor[0]
    allowed = f"at least {lengths[side]:.6g} {unit}, the length of side {side}"
    resolver.require(floor >= lengths[side], key, thing, allowed, remedy)
    highest = max(heights[each] for each in fit_for)
    remedy = "the depression is deeper than the part, and nothing would pop out: make it less deep"
    allowed = f"below {highest:.6g} {unit}, the height of the part in it"
    key = "tray.vertices" if "vertices" in resolver.tree["tray"] else "tray.depression_depth"
    resolver.require(depth < highest, key, "the depth of a depression", allowed, remedy)
    allowed = f"above the width of a depression, {width:.6g} {unit}"
    remedy = "depressions overlap: set them farther apart"
    resolver.require(tray.pitch > width, "tray.pitch", "the pitch", allowed, remedy)
    return tray
