"""Goals as sentences."""

from __future__ import annotations

from collections.abc import Sequence

from limitsets.goals import AttractsAll, FlipOrder, Goal, OrientedBeyond, Predicate, Reaches

__all__ = ["order_of", "question_of"]


def order_of(order: Sequence[int]) -> str:
    """Write a cyclic order of sides.

    Examples
    --------
    >>> order_of((0, 1, 2))
    '0 → 1 → 2 → 0'
    """
    return " → ".join(map(str, [*order, order[0]]))


def question_of(goal: Goal, unit: str) -> str:
    """Say what a goal asks.

    Examples
    --------
    >>> question_of(OrientedBeyond(20.0, 2), "in")
    'every part at rest beyond x = 20 in lies on side 2 (asked of the limit set)'
    """
    if isinstance(goal, AttractsAll):
        return _question(goal, unit)
    where = "every throw from every start" if goal.from_anywhere else "the limit set"
    return f"{_question(goal, unit)} (asked of {where})"


def _question(goal: Goal, unit: str) -> str:
    if isinstance(goal, OrientedBeyond):
        return f"every part at rest beyond x = {goal.x:g} {unit} lies on side {goal.side}"
    if isinstance(goal, Reaches):
        which = "every" if goal.every_orbit else "almost every"
        return f"{which} orbit reaches x = {goal.x:g} {unit} on side {goal.side}"
    if isinstance(goal, AttractsAll):
        return "one limit set takes every start"
    if isinstance(goal, FlipOrder):
        return f"the sides follow each other as {order_of(goal.order)}"
    if isinstance(goal, Predicate):
        return f"every part at rest satisfies: {goal.name}"
    return "no throw carries the part off the arm or into the joint"
