"""What stands around the arm: the cavity at its end, a sensor with throws to choose from, a tray."""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray

from limitsets.feeder.geometry.polygon import Scalar, Vector, above_side, side_ends
from limitsets.feeder.scene.quantities import Resolver
from limitsets.feeder.scene.validation import Tree

if TYPE_CHECKING:
    from limitsets.feeder.goals import Goal
    from limitsets.systems.cells import Grid


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
    """

    position: float
    width: float
    depth: float
    angle: float
    tips: str = "moving"


def resolve_cavity(
    feet: Sequence[float], lengths: Sequence[float], arm_length: float, goal: Goal | None, resolver: Resolver
) -> Cavity:
    """Resolve ``[cavity]`` for a part with these a and lengths of its sides."""
    unit, key, thing = resolver.unit, "cavity.position", "the position of the cavity"
    position = resolver.positive(key, "length")
    remedy = "the arm ends where the cavity begins; move the cavity, or lengthen the arm"
    allowed = f"up to the arm's length, {arm_length:.9g} {unit}"
    resolver.require(position <= arm_length, key, thing, allowed, remedy)
    farthest = max(range(len(feet)), key=feet.__getitem__)
    remedy = f"the part resting on side {farthest} needs that much of the arm; move the cavity outward"
    resolver.require(position > feet[farthest], key, thing, f"more than {feet[farthest]:.6g} {unit}", remedy)
    wanted = getattr(goal, "side", None)
    side = min(range(len(lengths)), key=lengths.__getitem__) if wanted is None else wanted
    width, thing = resolver.positive("cavity.width", "length"), "the width of the cavity"
    allowed = f"at least {lengths[side]:.6g} {unit}, the length of side {side}"
    remedy = "the part cannot lie in it; widen it"
    resolver.require(width >= lengths[side], "cavity.width", thing, allowed, remedy)
    angle, thing = resolver.value("cavity.angle", "angle"), "the angle of the ramp"
    allowed, remedy = "above 0 and below 90 deg", "measure it downwards from the arm"
    resolver.require(0 < angle < math.pi / 2, "cavity.angle", thing, allowed, remedy)
    depth, most = resolver.positive("cavity.depth", "length"), width * math.tan(angle)
    allowed = f"at most {most:.6g} {unit}, where the ramp meets the far wall"
    remedy = "the ramp is longer than the cavity: make it less deep, or wider"
    fits = depth / math.tan(angle) <= width * (1.0 + ROUNDED)
    resolver.require(fits, "cavity.depth", "the depth of the cavity", allowed, remedy)
    return Cavity(position, width, depth, angle, resolver.text("cavity.tips") or "moving")


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
    """

    depression_width: float
    depression_depth: float
    pitch: float
    agitation: float
    wash: float


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
    sizes = Tray(*(resolver.positive(f"tray.{field.name}", "length") for field in fields(Tray)))
    heights, wanted = heights_over_sides(vertices.tolist()), getattr(goal, "side", None)
    fit_for = range(len(heights)) if wanted is None else [wanted]
    side = min(fit_for, key=lengths.__getitem__)
    unit, width, depth = resolver.unit, sizes.depression_width, sizes.depression_depth
    key, thing, remedy = (
        "tray.depression_width",
        "the width of a depression",
        "the part cannot lie in it: widen it",
    )
    allowed = f"at least {lengths[side]:.6g} {unit}, the length of side {side}"
    resolver.require(width >= lengths[side], key, thing, allowed, remedy)
    highest = max(heights[each] for each in fit_for)
    remedy = "the depression is deeper than the part, and nothing would pop out: make it less deep"
    allowed = f"below {highest:.6g} {unit}, the height of the part in it"
    resolver.require(depth < highest, "tray.depression_depth", "the depth of a depression", allowed, remedy)
    allowed = f"above the width of a depression, {width:.6g} {unit}"
    remedy = "depressions overlap: set them farther apart"
    resolver.require(sizes.pitch > width, "tray.pitch", "the pitch", allowed, remedy)
    return sizes
