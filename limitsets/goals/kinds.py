"""The goals, one dataclass each: how an analysis decides it, and how it reads."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from limitsets.errors import AnswerError
from limitsets.goals.goal import GOALS, Extents, Found, Goal, Laid, Place, Side, Sides, Verdict, declare

# fractions are sums over cells: a whole one is 1 up to rounding
_WHOLE = 1 - 1e-12


def _reached(extents: Extents) -> Mapping[int, float]:
    return {side: max((hi for _, hi in parts), default=-math.inf) for side, parts in extents.items()}


def order_of(order: Sequence[int]) -> str:
    """Write a cyclic order of sides.

    Examples
    --------
    >>> order_of((0, 1, 2))
    '0 → 1 → 2 → 0'
    """
    return " → ".join(map(str, [*order, order[0]]))


@declare
@dataclass(frozen=True)
class OrientedBeyond(Goal):
    """Every part at rest beyond x lies on one side.

    Parameters
    ----------
    x : float
        Distance from the joint [length].
    side : int
        The side wanted.
    from_anywhere : bool
        Ask it of every throw from every start, not only of the limit set.
    """

    kind: ClassVar[str] = "oriented_beyond"
    x: Place
    side: Side
    from_anywhere: bool = False
    laid: Laid = ()

    def decide(self, found: Found) -> Verdict:
        """Compare with the farthest place on any other side."""
        others = (x for side, x in _reached(found.extents).items() if side != self.side)
        threshold = max(others, default=-math.inf)
        return Verdict(threshold <= self.x, threshold)

    def question(self, unit: str) -> str:
        """Say what is asked."""
        return f"every part at rest beyond x = {self.x:g} {unit} lies on side {self.side}"

    def explained(self, threshold: float, unit: str) -> str:
        """Say where the sentence begins to be true."""
        return f"The sentence is true from x = {threshold:.3f} {unit} on."

    def wrong(self) -> Callable[[Any, Any], Any]:
        """Beyond x on another side."""
        return lambda x, side: (x > self.x) & (side != self.side)

    @classmethod
    def worst(cls, verdicts: Sequence[Verdict]) -> Verdict:
        """Choose the farthest place: the sentence is about the parts of all limit sets."""
        return max(verdicts, key=lambda each: each.threshold or 0.0)


@declare
@dataclass(frozen=True)
class Reaches(Goal):
    """The part comes to rest on a side at x or beyond.

    Parameters
    ----------
    x : float
        Distance from the joint [length].
    side : int
        The side wanted.
    every_orbit : bool
        Every orbit, the repelling periodic ones included, not only almost every one.
    from_anywhere : bool
        Count what is reached on the way to the limit set.
    """

    kind: ClassVar[str] = "reaches"
    x: Place
    side: Side
    every_orbit: bool = False
    from_anywhere: bool = False
    laid: Laid = ()

    def decide(self, found: Found) -> Verdict:
        """Compare with the farthest place on the side."""
        threshold = _reached(found.extents).get(self.side, -math.inf)
        # extents say how far some orbit gets; that every one does is another question
        return Verdict(None if self.every_orbit and threshold >= self.x else threshold >= self.x, threshold)

    def question(self, unit: str) -> str:
        """Say what is asked."""
        which = "every" if self.every_orbit else "almost every"
        return f"{which} orbit reaches x = {self.x:g} {unit} on side {self.side}"

    def explained(self, threshold: float, unit: str) -> str:
        """Say how far orbits get."""
        return f"The farthest x reached on side {self.side} is {threshold:.3f} {unit}."


@declare
@dataclass(frozen=True)
class AttractsAll(Goal):
    """One attractor takes every start."""

    kind: ClassVar[str] = "attracts_all"
    of_every_start: ClassVar[bool] = True
    from_anywhere: bool = False
    laid: Laid = ()

    def decide(self, found: Found) -> Verdict:
        """Look for one attractor with all starts."""
        return Verdict(len(found.fractions) == 1 and found.fractions[0] >= _WHOLE, None)

    def question(self, unit: str) -> str:
        """Say what is asked."""
        return "one limit set takes every start"


@declare
@dataclass(frozen=True)
class FlipOrder(Goal):
    """The sides follow each other in one cyclic order.

    Parameters
    ----------
    order : tuple of int
        The sides in cyclic order; where it begins does not matter.
    from_anywhere : bool
        Ask it of every start, not only of the limit set.
    """

    kind: ClassVar[str] = "flip_order"
    order: Sides
    from_anywhere: bool = False
    laid: Laid = ()

    def decide(self, found: Found) -> Verdict:
        """Compare with the one order found, wherever it begins."""
        order = tuple(found.flip_order or ())
        return Verdict(self.order in (order[start:] + order[:start] for start in range(len(order))), None)

    def question(self, unit: str) -> str:
        """Say what is asked."""
        return f"the sides follow each other as {order_of(self.order)}"


@declare
@dataclass(frozen=True)
class StaysOnArm(Goal):
    """No throw carries the part off the arm or into the joint."""

    kind: ClassVar[str] = "stays_on_arm"
    from_anywhere: bool = False
    laid: Laid = ()

    def decide(self, found: Found) -> Verdict:
        """Look for starts that leave."""
        return Verdict(found.leaving <= 0, None)

    def question(self, unit: str) -> str:
        """Say what is asked."""
        return "no throw carries the part off the arm or into the joint"


@dataclass(frozen=True)
class Predicate(Goal):
    """Whatever the caller can say of places: every state is good.  Python only: a scene runs no code.

    Parameters
    ----------
    holds : callable
        ``holds(lo, hi, side)``: from the ends of intervals, float64 of shape (n,), and their one side to bool of shape
        (n,): True where every place in [lo, hi] is good.  Of a single place, lo = hi, it has to be right both ways.
    name : str
        What it says, for people: "below 21 in on side 0".
    cuts : tuple of float
        Places at which it changes, borders of cells [length].
    from_anywhere : bool
        Ask it of every landing from every start, not only of the limit set.
    """

    kind: ClassVar[str] = "predicate"
    holds: Callable[[Any, Any, int], Any]
    name: str = "the predicate"
    cuts: tuple[float, ...] = ()
    from_anywhere: bool = False
    laid: Laid = ()

    def decide(self, found: Found) -> Verdict:
        """Ask the caller of every interval."""
        parts = [(side, np.array(spans).reshape(-1, 2)) for side, spans in found.extents.items()]
        return Verdict(all(np.all(self.holds(span[:, 0], span[:, 1], side)) for side, span in parts), None)

    def question(self, unit: str) -> str:
        """Say what is asked."""
        return f"every part at rest satisfies: {self.name}"

    def wrong(self) -> Callable[[Any, Any], Any]:
        """Say where the caller says no."""

        def no(x: Any, side: Any) -> Any:
            bad = np.zeros(x.shape, dtype=bool)
            for s in np.unique(side).tolist():
                bad[side == s] = ~self.holds(x[side == s], x[side == s], s)
            return bad

        return no


def unknown_goal(goal: object) -> AnswerError:
    """Build the error for what is no goal of these: nothing else has a rule and words of its own."""
    kinds = ", ".join([*(kind.__name__ for kind in GOALS.values()), Predicate.__name__])
    return AnswerError(
        "the goal",
        type(goal).__name__,
        f"a goal of limitsets.goals: {kinds}",
        "say it as a function of places: limitsets.goals.Predicate",
    )
