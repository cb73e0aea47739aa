"""The values of one quantity in a plan, the same floats on every machine."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.errors import LimitsetsError

_BARE = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,3})?")
_MOST = 10_000_000
ALLOWED = 'NAME=LO:HI:COUNT, like throw.speed=120:180:1000 or "throw.speed=120 deg/s:180 deg/s:1000"'


@dataclass(frozen=True, eq=False)
class Axis:
    """Values of one quantity.

    Attributes
    ----------
    name : str
        The quantity of a scene, or the field of a map's parameters.
    values : ndarray, shape (n,)
        Its values [`unit`], in ascending order.
    unit : str
        Their unit; empty for a field of a map.

    Raises
    ------
    LimitsetsError
        No values, values that are not finite, or not in ascending order.

    Examples
    --------
    >>> Axis("arm.surface_height", [-1.0, -0.5, 0.2], "in").values.size
    3
    """

    name: str
    values: npt.NDArray[np.float64]
    unit: str = ""

    def __post_init__(self) -> None:
        values = np.array(self.values, dtype=np.float64)
        good = values.ndim == 1 and 0 < values.size <= _MOST and np.isfinite(values).all()
        if not good or (np.diff(values) <= 0).any():
            raise LimitsetsError(
                f"the values of {self.name}", f"{values.size} numbers", "finite numbers in ascending order",
                f"give from 1 to {_MOST} of them",
            )  # fmt: skip
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    @property
    def record(self) -> dict[str, Any]:
        """What a store keeps of it, to recognise it again."""
        ends = {"first": float(self.values[0]), "last": float(self.values[-1]), "count": self.values.size}
        digest = hashlib.sha256(self.values.astype("<f8").tobytes()).hexdigest()
        return {"name": self.name, "unit": self.unit, **ends, "sha256": digest}


def axis_of(text: object, unit_of: Callable[[str, str | None], str]) -> Axis:
    """Read an axis.

    Parameters
    ----------
    text : str or Axis
        ``"NAME=LO:HI:COUNT"``; the two ends with units, or bare in the unit in which people read the quantity.
    unit_of : callable
        The unit of a quantity, from its name and the text of an end with a unit, or None.

    Returns
    -------
    Axis
        Value k is the float nearest to LO + k (HI - LO)/(COUNT - 1), computed in fractions.

    Raises
    ------
    LimitsetsError
        Text of another form, or no such quantity.

    Examples
    --------
    >>> axis_of("r=2.8:4:5", lambda name, text: "").values.tolist()
    [2.8, 3.1, 3.4, 3.7, 4.0]
    """
    if isinstance(text, Axis):
        unit_of(text.name, f"1 {text.unit}" if text.unit else None)
        return text
    name, sign, rest = (part.strip() for part in str(text).partition("="))
    parts = [part.strip(" '\"") for part in rest.split(":")]
    if not sign or len(parts) != 3:
        raise LimitsetsError("the axis", text, ALLOWED, "correct it")
    ends, units = zip(*(_taken_apart(part, text) for part in parts[:2]), strict=True)
    if (units[0] is None) != (units[1] is None) or len(set(units)) > 1:
        raise LimitsetsError("the axis", text, ALLOWED, "give both ends in one unit, or both without")
    unit = unit_of(name, None if units[0] is None else parts[0])
    count = int(parts[2]) if re.fullmatch("[0-9]{1,9}", parts[2]) else 0
    lo, hi = ends
    if not ((2 <= count <= _MOST and lo < hi) or (count == 1 and lo == hi)):
        remedy = f"LO has to be below HI, and COUNT from 2 to {_MOST} (1 where LO is HI)"
        raise LimitsetsError("the axis", text, ALLOWED, remedy)
    exact = (lo + (hi - lo) * k / max(count - 1, 1) for k in range(count))
    return Axis(name, np.array([float(each) for each in exact]), unit)


def _taken_apart(word: str, text: object) -> tuple[Fraction, str | None]:
    number, _, unit = word.partition(" ")
    if not _BARE.fullmatch(number):
        raise LimitsetsError(
            "the axis", text, ALLOWED, f"{word!r} is no number, or lacks the blank before its unit"
        )
    return Fraction(number), unit.strip() or None
