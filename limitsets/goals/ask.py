"""Read a goal off an answer's extents, flip order and fractions."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from limitsets.goals.kinds import (
    AttractsAll,
    FlipOrder,
    Goal,
    OrientedBeyond,
    Predicate,
    Reaches,
    StaysOnArm,
    unknown_goal,
)

__all__ = ["Verdict", "evaluate"]

# fractions are sums over cells: a whole one is 1 up to rounding
_WHOLE = 1 - 1e-12


class Verdict(NamedTuple):
    """Whether a goal holds, and where it begins to.

    Parameters
    ----------
    holds : bool or None
        None where these facts cannot decide it.
    threshold : float or None
        oriented_beyond: the smallest X for which "x > X implies the side" holds, -inf where the part is never on
        another side.  reaches: the largest x reached on the side, -inf where it is never on it.  None for the
        others [scene's length unit].
    """

    holds: bool | None
    threshold: float | None


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
        Where the part comes to rest [scene's length unit].
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
    >>> found = {0: [(15.2, 19.75)], 1: [(12.6, 17.4)], 2: [(8.9, 23.4)]}
    >>> evaluate(OrientedBeyond(x=20.0, side=2), found)
    Verdict(holds=True, threshold=19.75)
    """
    reached = {side: max((hi for _, hi in parts), default=-math.inf) for side, parts in extents.items()}
    if isinstance(goal, OrientedBeyond):
        threshold = max((x for side, x in reached.items() if side != goal.side), default=-math.inf)
        return Verdict(threshold <= goal.x, threshold)
    if isinstance(goal, Reaches):
        threshold = reached.get(goal.side, -math.inf)
        # extents say how far some orbit gets; that every one does is another question
        return Verdict(None if goal.every_orbit and threshold >= goal.x else threshold >= goal.x, threshold)
    if isinstance(goal, AttractsAll):
        return Verdict(len(fractions) == 1 and fractions[0] >= _WHOLE, None)
    if isinstance(goal, Predicate):
        parts = [(side, np.array(spans).reshape(-1, 2)) for side, spans in extents.items()]
        return Verdict(all(np.all(goal.holds(span[:, 0], span[:, 1], side)) for side, span in parts), None)
    if isinstance(goal, FlipOrder):
        return Verdict(flip_order is not None and _same_cycle(tuple(flip_order), goal.order), None)
    if isinstance(goal, StaysOnArm):
        return Verdict(leaving <= 0, None)
    raise unknown_goal(goal)


def _same_cycle(found: tuple[int, ...], asked: tuple[int, ...]) -> bool:
    rotations = (found[start:] + found[:start] for start in range(len(found)))
    return asked in rotations
