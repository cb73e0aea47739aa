"""The goals, one dataclass each; `kind` is the word that names it in a scene and in JSON."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias, get_args

from limitsets.errors import AnswerError

__all__ = [
    "AttractsAll",
    "FlipOrder",
    "Goal",
    "OrientedBeyond",
    "Predicate",
    "Reaches",
    "StaysOnArm",
    "unknown_goal",
]


@dataclass(frozen=True)
class OrientedBeyond:
    """Every part at rest beyond x lies on one side.

    Parameters
    ----------
    x : float
        Distance from the joint [scene's length unit].
    side : int
        The side wanted.
    from_anywhere : bool
        Ask it of every throw from every start, not only of the limit set.
    """

    kind: ClassVar[str] = "oriented_beyond"
    x: float
    side: int
    from_anywhere: bool = False


@dataclass(frozen=True)
class Reaches:
    """The part comes to rest on a side at x or beyond.

    Parameters
    ----------
    x : float
        Distance from the joint [scene's length unit].
    side : int
        The side wanted.
    every_orbit : bool
        Every orbit, the repelling periodic ones included, not only almost every one.
    from_anywhere : bool
        Count what is reached on the way to the limit set.
    """

    kind: ClassVar[str] = "reaches"
    x: float
    side: int
    every_orbit: bool = False
    from_anywhere: bool = False


@dataclass(frozen=True)
class AttractsAll:
    """One attractor takes every start."""

    kind: ClassVar[str] = "attracts_all"
    from_anywhere: bool = False


@dataclass(frozen=True)
class FlipOrder:
    """The sides follow each other in one cyclic order.

    Parameters
    ----------
    order : tuple of int
        The sides in cyclic order; where it begins does not matter.
    from_anywhere : bool
        Ask it of every start, not only of the limit set.
    """

    kind: ClassVar[str] = "flip_order"
    order: tuple[int, ...]
    from_anywhere: bool = False


@dataclass(frozen=True)
class StaysOnArm:
    """No throw carries the part off the arm or into the joint."""

    kind: ClassVar[str] = "stays_on_arm"
    from_anywhere: bool = False


@dataclass(frozen=True)
class Predicate:
    """Whatever the caller can say of places: every state is good.  Python only: a scene runs no code.

    Parameters
    ----------
    holds : callable
        ``holds(lo, hi, side)``: from the ends of intervals, float64 of shape (n,), and their one side to bool of shape
        (n,): True where every place in [lo, hi] is good.  Of a single place, lo = hi, it has to be right both ways.
    name : str
        What it says, for people: "below 21 in on side 0".
    cuts : tuple of float
        Places at which it changes, borders of cells [scene's length unit].
    from_anywhere : bool
        Ask it of every landing from every start, not only of the limit set.
    """

    kind: ClassVar[str] = "predicate"
    holds: Callable[[Any, Any, int], Any]
    name: str = "the predicate"
    cuts: tuple[float, ...] = ()
    from_anywhere: bool = False


Goal: TypeAlias = OrientedBeyond | Reaches | AttractsAll | FlipOrder | StaysOnArm | Predicate


def unknown_goal(goal: object) -> AnswerError:
    """Build the error for what is no goal of these: nothing else has a rule and words of its own."""
    kinds = ", ".join(kind.__name__ for kind in get_args(Goal))
    return AnswerError(
        "the goal",
        type(goal).__name__,
        f"a goal of limitsets.goals: {kinds}",
        "say it as a function of places: limitsets.goals.Predicate",
    )
