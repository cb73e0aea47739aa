"""What a goal says of itself, and the table of those that a scene can name.

A goal is a frozen dataclass with a `kind`, its word in ``[goal]``, and one field per number that is asked for; all who
read, answer, print or draw goals ask the class.  What proves it stands in `limitsets/proofs/goals/`.
"""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields, is_dataclass
from typing import Annotated, Any, ClassVar, NamedTuple, TypeAlias, get_type_hints

from limitsets.errors import AnswerError

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
    def decide(self, found: Found) -> Verdict:
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
def _hints_of(goal: Any) -> dict[str, Any]:
    return get_type_hints(goal, include_extras=True)


def words_of(goal: type[Goal]) -> dict[str, str]:
    """Name what a scene writes of a goal: "place", "side", "sides" or "flag", by field.

    Several stand in a table, one by itself, and a goal that asks for none is written `true`.

    Examples
    --------
    >>> from limitsets.goals import Reaches
    >>> words_of(Reaches)
    {'x': 'place', 'side': 'side', 'every_orbit': 'flag'}
    """
    hints = _hints_of(goal)
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
    found: dict[str, list[list[float]]] = {}
    for side, lo, hi in laid:
        found.setdefault(str(side), []).append([lo, hi])
    return found


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
