"""The goals, one dataclass each: what it says of itself, how an analysis decides it, and how it reads."""

from __future__ import annotations

import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, TypeAlias, get_type_hints

import numpy as np

from limitsets.base import AnswerError

# ----------------------------------------------------------------
# What a goal says of itself, and the table of those that a scene can name.
#
# A goal is a frozen dataclass with a `kind`, its word in ``[goal]``, and one field per number that is asked for; all
# who read, answer, print or draw goals ask the class.  What proves it stands in `limitsets/proofs/prover/goals/`.


Place: TypeAlias = Annotated[float, "place"]
"""A field that a scene writes as a length, where parts can come to rest [length]."""

Side: TypeAlias = Annotated[int, "side"]
"""A field that is the number of a side."""

Sides: TypeAlias = Annotated[tuple[int, ...], "sides"]
"""A field that is a list of sides."""

Laid: TypeAlias = tuple[tuple[int, float, float], ...]
"""Where parts are laid down: side and both ends of each range of x, ascending [length]; () for the whole arm."""

Extents: TypeAlias = Mapping[int, Sequence[tuple[float, float]]]


class Verdict(NamedTuple):
    """Whether a goal holds, and where it begins to.

    Parameters
    ----------
    holds : bool or None
        None where these facts cannot decide it.
    threshold : float or None
        oriented_beyond: the smallest X for which "x > X implies the side" holds, -inf where the part is never on
        another side.  reaches: the largest x reached on the side, -inf where it is never on it.  None for the
        others [length].
    """

    holds: bool | None
    threshold: float | None


class Found(NamedTuple):
    """What an analysis found, of which a goal is asked; as in `limitsets.goals.evaluate`.

    Attributes
    ----------
    extents : mapping of int to sequence of (float, float)
        Intervals of the limit set by side [length].
    flip_order : sequence of int, or None
        Order of the sides, None where there is none.
    fractions : sequence of float
        Shares of the starts that come to each attractor.
    leaving : float
        Share of the starts that leave the arm.
    """

    extents: Extents
    flip_order: Sequence[int] | None = None
    fractions: Sequence[float] = ()
    leaving: float = 0.0


class Goal(ABC):
    """What a goal of any kind is asked.

    Attributes
    ----------
    kind : str
        The word that names it in a scene and in JSON.
    of_every_start : bool
        Whether it speaks of every start by what it says, not only with `from_anywhere`.
    from_anywhere : bool
        Whether it is asked of every start, not only of the limit set.
    laid : Laid
        Its starts, where parts are laid down; () for every start on the arm.
    """

    __dataclass_fields__: ClassVar[dict[str, Any]]  # every kind of goal is a dataclass
    kind: ClassVar[str]
    of_every_start: ClassVar[bool] = False
    from_anywhere: bool = False
    laid: Laid = ()

    @abstractmethod
    def decide(self, analysis: Found) -> Verdict:
        """Decide it from what an analysis found."""

    @abstractmethod
    def question(self, unit: str) -> str:
        """Say what is asked, a main clause."""

    def explained(self, threshold: float, unit: str) -> str:
        """Say what a threshold means, a sentence; empty for goals that have none."""
        return ""

    def wrong(self) -> Callable[[Any, Any], Any] | None:
        """From places and sides, arrays, to whether each violates it; None where no single place does."""
        return None

    @classmethod
    def worst(cls, verdicts: Sequence[Verdict]) -> Verdict:
        """Choose the verdict that stands for those of several limit sets: it has to hold of each."""
        return min(verdicts, key=lambda each: ((False, None, True).index(each.holds), each.threshold or 0.0))


GOALS: dict[str, type[Goal]] = {}
"""The goals that a scene can name, by their word."""


@functools.cache  # a scene is read many times in a search
def words_of(goal: type[Goal]) -> dict[str, str]:
    """Name what a scene writes of a goal: "place", "side", "sides" or "flag", by field.

    Several stand in a table, one by itself, and a goal that asks for none is written `true`.

    Examples
    --------
    >>> from limitsets.goals import Reaches
    >>> words_of(Reaches)
    {'x': 'place', 'side': 'side', 'every_orbit': 'flag'}
    """
    hints = get_type_hints(goal, include_extras=True)
    names = [each.name for each in fields(goal) if each.name not in ("from_anywhere", "laid")]
    return {name: getattr(hints[name], "__metadata__", ("flag",))[0] for name in names}


def as_written(goal: Goal, unit: str) -> dict[str, Any]:
    """Give a goal as a scene would write it; `laid`, which no scene has, by side, where parts are laid down."""
    table: dict[str, Any] = asdict(goal)
    anywhere, words = table.pop("from_anywhere"), words_of(type(goal))
    laid = by_side(table.pop("laid", ()))
    for name, word in words.items():
        if word == "place":
            table[name] = f"{table[name]!r} {unit}"
        if word == "sides":
            table[name] = list(table[name])
    alone = next(iter(table.values())) if len(table) == 1 else table or True
    return {goal.kind: alone, "from_anywhere": anywhere} | ({"laid": laid} if laid else {})


def by_side(laid: Laid) -> dict[str, list[list[float]]]:
    """Give ranges by side, as in JSON.

    Examples
    --------
    >>> by_side(((0, 8.0, 12.0), (0, 14.0, 16.0)))
    {'0': [[8.0, 12.0], [14.0, 16.0]]}
    """
    ranges: dict[str, list[list[float]]] = {}
    for side, lo, hi in laid:
        ranges.setdefault(str(side), []).append([lo, hi])
    return ranges


def laid_words(laid: Laid, unit: str) -> str:
    """Name ranges for people.

    Examples
    --------
    >>> laid_words(((0, 8.0, 12.0), (2, 14.0, 16.0)), "in")
    'x = 8 to 12 in on side 0, x = 14 to 16 in on side 2'
    """
    return ", ".join(f"x = {lo:.6g} to {hi:.6g} {unit} on side {side}" for side, lo, hi in laid)


def declare(goal: type[Goal]) -> type[Goal]:
    """Let scenes name a goal.

    Raises
    ------
    AnswerError
        For a class that is no dataclass, or a kind that is taken.
    """
    if not is_dataclass(goal) or goal.kind in GOALS:
        allowed = "a dataclass, and a Goal, whose kind is a new word"
        raise AnswerError("the goal", goal.__name__, allowed, "decorate it, or choose another word")
    GOALS[goal.kind] = goal
    return goal


# ----------------------------------------------------------------
# The goals, one dataclass each: how an analysis decides it, and how it reads.


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

    def decide(self, analysis: Found) -> Verdict:
        """Compare with the farthest place on any other side."""
        others = (x for side, x in _reached(analysis.extents).items() if side != self.side)
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

    def decide(self, analysis: Found) -> Verdict:
        """Compare with the farthest place on the side."""
        threshold = _reached(analysis.extents).get(self.side, -math.inf)
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

    def decide(self, analysis: Found) -> Verdict:
        """Look for one attractor with all starts."""
        return Verdict(len(analysis.fractions) == 1 and analysis.fractions[0] >= _WHOLE, None)

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

    def decide(self, analysis: Found) -> Verdict:
        """Compare with the one order found, wherever it begins."""
        order = tuple(analysis.flip_order or ())
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

    def decide(self, analysis: Found) -> Verdict:
        """Look for starts that leave."""
        return Verdict(analysis.leaving <= 0, None)

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

    def decide(self, analysis: Found) -> Verdict:
        """Ask the caller of every interval."""
        parts = [(side, np.array(spans).reshape(-1, 2)) for side, spans in analysis.extents.items()]
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


# ----------------------------------------------------------------
# Decide a goal on the extents, flip order and fractions of an answer.


def evaluate(
    goal: Goal,
    extents: Mapping[int, Sequence[tuple[float, float]]],
    *,
    flip_order: Sequence[int] | None = None,
    fractions: Sequence[float] = (),
    leaving: float = 0.0,
) -> Verdict:
    """Decide a goal from what an analysis found.

    The caller chooses what the facts are about: the limit set, or, where the goal says `from_anywhere`, everything
    that is reached from any start.

    Parameters
    ----------
    goal : Goal
        What is asked.
    extents : mapping of side to intervals (lo, hi)
        Where the part comes to rest [length].
    flip_order : sequence of int, optional
        The sides in cyclic order, where only one order occurs.
    fractions : sequence of float
        Share of starts that each attractor takes.
    leaving : float
        Share of starts that leave the arm, its model included.

    Returns
    -------
    Verdict

    Raises
    ------
    AnswerError
        No goal of `limitsets.goals`.

    Examples
    --------
    >>> from limitsets.goals import OrientedBeyond
    >>> found = {0: [(15.2, 19.75)], 1: [(12.6, 17.4)], 2: [(8.9, 23.4)]}
    >>> evaluate(OrientedBeyond(x=20.0, side=2), found)
    Verdict(holds=True, threshold=19.75)
    """
    if not isinstance(goal, Goal):
        raise unknown_goal(goal)
    return goal.decide(Found(extents, flip_order, fractions, leaving))
