"""Goals as sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

from limitsets.goals import Goal, OrientedBeyond, StaysOnArm, unknown_goal

if TYPE_CHECKING:
    from limitsets.analysis import GoalOutcome

__all__ = ["goal_sentence", "verdict_of", "void_of"]


def goal_sentence(goal: Goal, unit: str) -> str:
    """Say what a goal asks, and of what.

    Examples
    --------
    >>> goal_sentence(OrientedBeyond(20.0, 2), "in")
    'every part at rest beyond x = 20 in lies on side 2 (asked of the limit set)'
    """
    if not isinstance(goal, Goal):
        raise unknown_goal(goal)
    if goal.of_every_start:
        return goal.question(unit)
    where = "every throw from every start" if goal.from_anywhere else "the limit set"
    return f"{goal.question(unit)} (asked of {where})"


def verdict_of(outcome: GoalOutcome) -> str:
    """Say in a word or two what became of a goal.

    Examples
    --------
    >>> from limitsets.analysis import GoalOutcome
    >>> verdict_of(GoalOutcome(OrientedBeyond(20.0, 2), True, 17.5, reach=(19.0,)))
    'holds vacuously'
    """
    if outcome.vacuous:
        return "holds vacuously"
    return {True: "holds", False: "does not hold", None: "was not decided"}[outcome.holds]


def void_of(outcome: GoalOutcome, unit: str) -> str:
    """Say where a goal that holds speaks of nothing; empty where it does not.

    Examples
    --------
    >>> from limitsets.analysis import GoalOutcome
    >>> void_of(GoalOutcome(OrientedBeyond(20.0, 2), True, 17.5, reach=(19.0,)), "in")
    'no part gets there: the limit set ends at x = 19.000 in, before x = 20 in'
    """
    goal = outcome.goal
    if isinstance(goal, StaysOnArm) and outcome.holds and not goal.from_anywhere:
        return "no throw leads out of any limit set; from_anywhere = true asks it of every start"
    if not isinstance(goal, OrientedBeyond) or not outcome.holds:
        return ""
    short = [k for k, x in enumerate(outcome.reach) if x <= goal.x]
    if goal.from_anywhere:
        ends = [f"the farthest landing is at x = {outcome.reach[k]:.3f} {unit}" for k in short]
    elif len(outcome.reach) == 1:
        ends = [f"the limit set ends at x = {outcome.reach[k]:.3f} {unit}" for k in short]
    else:
        ends = [f"limit set {k} ends at x = {outcome.reach[k]:.3f} {unit}" for k in short]
    who = "no part gets there" if outcome.vacuous else "not every part gets there"
    return f"{who}: {', '.join(ends)}, before x = {goal.x:g} {unit}" if ends else ""
