"""Periodic orbits as answers: one cycle, and a tuple of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.tables import Column, Table, Tabled

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# Orbits closer than this are one, relative to the extent of x.
NEAR = 1e-9


@dataclass(frozen=True, eq=False)
class Cycle:
    """A periodic orbit.

    Attributes
    ----------
    x : ndarray, shape (p,) or (p, 2)
        Its points in the order of the steps, beginning with the least x on the least side.
    side, branches : ndarray of int, shape (p,)
        Side of each point, and the branch taken from it.
    multiplier : float
        Derivative of F^p along the orbit; in two dimensions the largest modulus of its eigenvalues.  The orbit attracts
        where it is below 1 in modulus.
    residual, rounding : float
        Largest distance between the image of a point and the next, on the branch that the map takes there; and what the
        rounding of a step may come to, which the residual does not exceed at any point.
    """

    x: Array
    side: Ints
    branches: Ints
    multiplier: float
    residual: float
    rounding: float

    @property
    def period(self) -> int:
        """p, the smallest one."""
        return int(self.side.size)


class Cycles(tuple[Cycle, ...], Tabled):
    """Cycles by period, then by their least point; a tuple that knows how it came about.

    Attributes
    ----------
    complete : bool
        Whether every itinerary was followed: then none is missing, up to rounding and, where a composed branch bends
        several times across the diagonal between two samples, up to sampling.
    how : str
        The method, and what was cut short.
    """

    complete: bool
    how: str

    def __new__(cls, found: Iterable[Cycle], *, complete: bool, how: str) -> Self:
        """Make a tuple with `complete` and `how`."""
        self = super().__new__(cls, found)
        self.complete, self.how = complete, how
        return self

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (k, each.period, step, side, x, each.multiplier, each.residual)
            for k, each in enumerate(self)
            for step, (side, x) in enumerate(zip(each.side.tolist(), each.x.tolist(), strict=True))
        ]
        heads = ("cycle", "period", "step", "side", Column("x", show=_place))
        more = (Column("multiplier", show=".6g"), Column("residual", show=".1e"))
        return (Table((*heads, *more), rows, f"Cycles: {self.how}", "sampled, not proved"),)


def _place(x: Any) -> str:
    """Write a point, of one dimension or more."""
    return ", ".join(f"{each:.9g}" for each in x) if isinstance(x, list) else f"{x:.9g}"


def require_period(up_to: int) -> None:
    """Refuse a largest period below 1."""
    if up_to < 1:
        raise AnswerError("the largest period", up_to, "an integer from 1", "pass up_to=8")
