"""Decide a goal on the extents, flip order and fractions of an answer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from limitsets.goals.goal import Found, Goal, Verdict
from limitsets.goals.kinds import unknown_goal


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
