"""What a controller has: throws to choose from, and a sensor that answers one question with yes or no."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.scene.resolve import Resolver

if TYPE_CHECKING:
    from limitsets.cells import Grid
    from limitsets.scene.schema import FeedbackTable, SensorTable

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
    table: FeedbackTable, count: int, arm_length: float, resolver: Resolver, *, gravity: bool
) -> Feedback:
    """Resolve ``[feedback]`` for a part with `count` sides on an arm of this length."""
    throws: list[ChosenThrow] = []
    for k, each in enumerate(table.throws):
        key = f"feedback.throws[{k}]"
        named = [word for word in ("kappa", "speed") if getattr(each, word) is not None]
        if len(named) != 1:
            found = " and ".join(named) or "none"
            raise resolver.refusal(key, "this throw", found, "kappa or speed", "give it one of the two")
        if each.name in [other.name for other in throws]:
            raise resolver.refusal(
                f"{key}.name", "the name of this throw", each.name, "a name of its own", "choose another"
            )
        (word,) = named
        text = getattr(each, word)
        resolver.positive(text, "length" if word == "kappa" else "angular speed", f"{key}.{word}")
        if word == "speed" and not gravity:
            remedy = "a speed needs it: add [gravity], or give kappa"
            raise resolver.refusal(f"{key}.speed", "the gravity", "missing", "a table [gravity]", remedy)
        throws.append(ChosenThrow(each.name, f"throw.{word}", text))
    sensor = None if table.sensor is None else _sensor(table.sensor, count, arm_length, resolver)
    return Feedback(tuple(throws), sensor)


def _sensor(table: SensorTable, count: int, arm_length: float, resolver: Resolver) -> Sensor:
    key, named = "feedback.sensor", [word for word in ("beyond", "side") if getattr(table, word) is not None]
    if len(named) != 1:
        found = " and ".join(named) or "none"
        raise resolver.refusal(key, "the sensor", found, "beyond or side", "it answers one question: name it")
    if table.side is not None:
        if table.error is not None:
            remedy = "the error of a place: leave it out"
            raise resolver.refusal(f"{key}.error", "the error", table.error, "none with side", remedy)
        if table.side >= count:
            allowed = f"0 to {count - 1}"
            raise resolver.refusal(f"{key}.side", "the side", table.side, allowed, "name a side of this part")
        return SideSensor(table.side)
    assert table.beyond is not None
    x = resolver.value(table.beyond, "length", f"{key}.beyond")
    if not 0 <= x <= arm_length:
        allowed = f"from 0 to the arm's length, {arm_length:.9g} {resolver.unit}"
        raise resolver.refusal(f"{key}.beyond", "the sensor's place", table.beyond, allowed, "correct it")
    error = 0.0 if table.error is None else resolver.value(table.error, "length", f"{key}.error")
    if error < 0:
        raise resolver.refusal(f"{key}.error", "the sensor's error", table.error, "0 or more", "correct it")
    return BeyondSensor(x, error)
