"""What stands around the arm: the cavity at its end, a sensor with throws to choose from, a tray."""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
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
    table: Tree,
    feet: Sequence[float],
    lengths: Sequence[float],
    arm_length: float,
    goal: Goal | None,
    resolver: Resolver,
) -> Cavity:
    """Resolve ``[cavity]`` for a part with these a and lengths of its sides."""
    unit = resolver.unit
    position = resolver.positive(table["position"], "length", "cavity.position")
    if position > arm_length:
        allowed = f"up to the arm's length, {arm_length:.9g} {unit}"
        remedy = "the arm ends where the cavity begins; move the cavity, or lengthen the arm"
        raise resolver.refusal(
            "cavity.position", "the position of the cavity", table["position"], allowed, remedy
        )
    farthest = max(range(len(feet)), key=feet.__getitem__)
    if not position > feet[farthest]:
        allowed = f"more than {feet[farthest]:.6g} {unit}"
        remedy = f"the part resting on side {farthest} needs that much of the arm; move the cavity outward"
        raise resolver.refusal(
            "cavity.position", "the position of the cavity", table["position"], allowed, remedy
        )
    wanted = getattr(goal, "side", None)
    side = min(range(len(lengths)), key=lengths.__getitem__) if wanted is None else wanted
    width = resolver.positive(table["width"], "length", "cavity.width")
    if width < lengths[side]:
        allowed = f"at least {lengths[side]:.6g} {unit}, the length of side {side}"
        raise resolver.refusal(
            "cavity.width",
            "the width of the cavity",
            table["width"],
            allowed,
            "the part cannot lie in it; widen it",
        )
    angle = resolver.value(table["angle"], "angle", "cavity.angle")
    if not 0 < angle < math.pi / 2:
        allowed = "above 0 and below 90 deg"
        raise resolver.refusal(
            "cavity.angle",
            "the angle of the ramp",
            table["angle"],
            allowed,
            "measure it downwards from the arm",
        )
    depth = resolver.positive(table["depth"], "length", "cavity.depth")
    if depth / math.tan(angle) > width * (1.0 + ROUNDED):
        allowed = f"at most {width * math.tan(angle):.6g} {unit}, where the ramp meets the far wall"
        raise resolver.refusal(
            "cavity.depth",
            "the depth of the cavity",
            table["depth"],
            allowed,
            "the ramp is longer than the cavity: make it less deep, or wider",
        )
    return Cavity(position, width, depth, angle, table.get("tips", "moving"))


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


def resolve_feedback(
    table: Tree, count: int, arm_length: float, resolver: Resolver, *, gravity: bool
) -> Feedback:
    """Resolve ``[feedback]`` for a part with `count` sides on an arm of this length."""
    throws: list[ChosenThrow] = []
    for k, each in enumerate(table["throws"]):
        key = f"feedback.throws[{k}]"
        named = [word for word in ("kappa", "speed") if word in each]
        if len(named) != 1:
            given = " and ".join(named) or "none"
            raise resolver.refusal(key, "this throw", given, "kappa or speed", "give it one of the two")
        (word,), name = named, each["name"]
        if name in [other.name for other in throws]:
            allowed = "a name of its own"
            raise resolver.refusal(f"{key}.name", "the name of this throw", name, allowed, "choose another")
        text = each[word]
        resolver.positive(text, "length" if word == "kappa" else "angular speed", f"{key}.{word}")
        if word == "speed" and not gravity:
            remedy = "a speed needs it: add [gravity], or give kappa"
            raise resolver.refusal(f"{key}.speed", "the gravity", "missing", "a table [gravity]", remedy)
        throws.append(ChosenThrow(name, f"throw.{word}", text))
    sensor = _sensor(table["sensor"], count, arm_length, resolver) if "sensor" in table else None
    return Feedback(tuple(throws), sensor)


def _sensor(table: Tree, count: int, arm_length: float, resolver: Resolver) -> Sensor:
    key, named = "feedback.sensor", [word for word in ("beyond", "side") if word in table]
    if len(named) != 1:
        given = " and ".join(named) or "none"
        raise resolver.refusal(key, "the sensor", given, "beyond or side", "it answers one question: name it")
    if "side" in table:
        if "error" in table:
            remedy = "the error of a place: leave it out"
            raise resolver.refusal(f"{key}.error", "the error", table["error"], "none with side", remedy)
        if table["side"] >= count:
            allowed = f"0 to {count - 1}"
            raise resolver.refusal(
                f"{key}.side", "the side", table["side"], allowed, "name a side of this part"
            )
        return SideSensor(table["side"])
    x = resolver.value(table["beyond"], "length", f"{key}.beyond")
    if not 0 <= x <= arm_length:
        allowed = f"from 0 to the arm's length, {arm_length:.9g} {resolver.unit}"
        raise resolver.refusal(f"{key}.beyond", "the sensor's place", table["beyond"], allowed, "correct it")
    error = resolver.value(table["error"], "length", f"{key}.error") if "error" in table else 0.0
    if error < 0:
        raise resolver.refusal(
            f"{key}.error", "the sensor's error", table["error"], "0 or more", "correct it"
        )
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
    table: Tree,
    vertices: npt.NDArray[np.float64],
    lengths: npt.NDArray[np.float64],
    goal: Goal | None,
    resolver: Resolver,
) -> Tray:
    """Resolve ``[tray]`` for a part with these vertices and lengths of its sides."""
    names = ("depression_width", "depression_depth", "pitch", "agitation", "wash")
    sizes = Tray(**{name: resolver.positive(table[name], "length", f"tray.{name}") for name in names})
    corners = [(float(x), float(y)) for x, y in vertices]
    heights, wanted = heights_over_sides(corners), getattr(goal, "side", None)
    fit_for = range(len(heights)) if wanted is None else [wanted]
    side = min(fit_for, key=lengths.__getitem__)
    unit, of_side = resolver.unit, f"of side {side}"
    if sizes.depression_width < lengths[side]:
        allowed = f"at least {lengths[side]:.6g} {unit}, the length {of_side}"
        raise resolver.refusal(
            "tray.depression_width",
            "the width of a depression",
            table["depression_width"],
            allowed,
            "the part cannot lie in it: widen it",
        )
    highest = max(heights[each] for each in fit_for)
    if not sizes.depression_depth < highest:
        allowed = f"below {highest:.6g} {unit}, the height of the part in it"
        raise resolver.refusal(
            "tray.depression_depth",
            "the depth of a depression",
            table["depression_depth"],
            allowed,
            "the depression is deeper than the part, and nothing would pop out: make it less deep",
        )
    if not sizes.pitch > sizes.depression_width:
        allowed = f"above the width of a depression, {sizes.depression_width:.6g} {unit}"
        remedy = "depressions overlap: set them farther apart"
        raise resolver.refusal("tray.pitch", "the pitch", table["pitch"], allowed, remedy)
    return sizes
