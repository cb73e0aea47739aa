"""Periodic orbits as answers: one cycle, a tuple of them, and when two are the same."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.tables import Column, Table, Tabled

__all__ = ["NEAR", "Array", "Cycle", "Cycles", "Ints", "distinct", "require_period"]

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
    residual : float
        Largest distance between the image of a point and the next.
    admissible : bool
        Whether the map takes these branches at these points.  False for an orbit through a change of branch that only
        the one-sided limit there makes periodic.
    """

    x: Array
    side: Ints
    branches: Ints
    multiplier: float
    residual: float
    admissible: bool

    @property
    def period(self) -> int:
        """p, the smallest one."""
        return int(self.side.size)

    @classmethod
    def through(cls, x: Array, side: Ints, branches: Ints, multiplier: float, residual: float) -> Cycle:
        """Return the cycle through points given in the order of the steps, from whichever point."""
        first = int(np.lexsort((*np.atleast_2d(x.T)[::-1], side))[0])
        ahead = (np.arange(side.size) + first) % side.size
        return cls(x[ahead], side[ahead], branches[ahead], multiplier, residual, True)


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
            (k, each.period, step, side, x, each.multiplier, each.admissible)
            for k, each in enumerate(self)
            for step, (side, x) in enumerate(zip(each.side.tolist(), each.x.tolist(), strict=True))
        ]
        heads = ("cycle", "period", "step", "side", Column("x", show=_place))
        more = (Column("multiplier", show=".6g"), "admissible")
        return (Table((*heads, *more), rows, f"Cycles: {self.how}", "sampled, not proved"),)


def _place(x: Any) -> str:
    """Write a point, of one dimension or more."""
    return ", ".join(f"{each:.9g}" for each in x) if isinstance(x, list) else f"{x:.9g}"


def require_period(up_to: int) -> None:
    """Refuse a largest period below 1."""
    if up_to < 1:
        raise AnswerError("the largest period", up_to, "an integer from 1", "pass up_to=8")


def _distance(one: Cycle, other: Cycle, shift: int) -> float:
    """Largest distance between corresponding points, the second orbit taken `shift` steps ahead."""
    if one.period != other.period or (one.side != np.roll(other.side, -shift)).any():
        return np.inf
    return float(np.abs(one.x - np.roll(other.x, -shift, axis=0)).max())


def _runs_twice(cycle: Cycle, near: float) -> bool:
    """Whether a shorter orbit is run through several times."""
    divisors = [d for d in range(1, cycle.period) if cycle.period % d == 0]
    return any(_distance(cycle, cycle, d) <= near for d in divisors)


def _least(cycle: Cycle) -> float:
    return float(np.ravel(cycle.x)[0])


def distinct(found: Iterable[Cycle], near: float) -> list[Cycle]:
    """Each orbit once, with its smallest period, by period and least point; admissible ones are kept first."""
    kept: list[Cycle] = []
    for cycle in sorted(found, key=lambda each: (each.period, each.side[0], _least(each))):
        if _runs_twice(cycle, near):
            continue
        twin = None
        for number in range(len(kept) - 1, -1, -1):
            other = kept[number]
            if other.period != cycle.period or _least(other) < _least(cycle) - near:
                break
            # Points that agree to rounding may begin at another one of them.
            if any(_distance(cycle, other, shift) <= near for shift in range(cycle.period)):
                twin = number
        if twin is None:
            kept.append(cycle)
        elif cycle.admissible and not kept[twin].admissible:
            kept[twin] = cycle
    return kept
