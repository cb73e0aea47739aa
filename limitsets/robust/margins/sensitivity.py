"""Sensitivities of a goal to each quantity, by floats: the worst corner of a box, and the quantity to cut.

The slack before a goal fails (from the highest place on another side to X, from X to the highest place on the wanted
one) is nearly linear in the quantities.  It is read off one long orbit for each change of one quantity.  Nothing is
proved here; it only says in which order to try.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.goals import Goal, OrientedBeyond, Reaches
from limitsets.maps import orbit
from limitsets.proofs.goals.violating_orbits import on_limit_set
from limitsets.proofs.query import Query
from limitsets.proofs.tolerance import SceneBox
from limitsets.robust.margins.vector import Signs, Tolerance, worst_corner

Array = NDArray[np.float64]

# Throws of an orbit that is read, after so many that are not.
LENGTH, BEFORE = 60_000, 2000

# Refinement of the cells with which the cost of a piece is measured.
STEP = 2

# Part of the tolerance by which a quantity is changed to either side.
CHANGE = Fraction(1, 4)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The slack before a goal fails, and how it falls with each quantity.

    Attributes
    ----------
    slack : ndarray, shape (n,)
        In the scene as it is, one number for each way in which a goal can fail; negative where one does.
    fall : ndarray, shape (n, quantities)
        By how much each falls when a quantity rises by its tolerance.
    cost : ndarray, shape (n, quantities)
        By how much less is proved of each when a quantity may be anywhere in its tolerance, proved as noise.
    two_throws : ndarray of bool, shape (n,)
        Whether two throws with the same parameters are looked at: then what is proved falls as the corners do.
    """

    slack: Array
    fall: Array
    cost: Array
    two_throws: NDArray[np.bool_]

    @classmethod
    def none(cls, quantities: int) -> Sensitivity:
        """Return what is known where nothing attracts."""
        nothing = np.zeros((0, quantities))
        return cls(np.zeros(0), nothing, nothing, np.zeros(0, dtype=np.bool_))

    def corners(self) -> list[Signs]:
        """Signs of the worst corner for each way to fail, the worst of all first."""
        cost = np.abs(self.fall).sum(axis=1)
        order = np.argsort(np.where(cost > 0.0, self.slack / np.maximum(cost, 1e-300), math.inf))
        return list(dict.fromkeys(worst_corner(self.fall[k]) for k in order))


@np.errstate(invalid="ignore")  # a side that no part comes to has room without end: inf - inf
def sensitivity_of(query: Query, tolerance: Tolerance) -> Sensitivity:
    """Measure the sensitivity by differences.

    Parameters
    ----------
    query : Query
        The goals.
    tolerance : Tolerance
        Quantities that are fixed but unknown, with sizes.
    """
    count = len(tolerance.scales)
    nominal = query.prove(finest=1) if count else None
    if nominal is None or nominal.found is None or not (nominal.found.component >= 0).any():
        return Sensitivity.none(count)
    start, step = on_limit_set(nominal.found), float(CHANGE)
    slack, level = (
        _slack(query, tolerance.corner(Fraction(0), [0] * count), start),
        _proved_slack(query, None),
    )
    falls, costs = [], []
    for k, one in enumerate(tolerance.scales):
        size = CHANGE * tolerance.sizes[k]
        ends = []
        for sign in (-1, 1):
            try:
                corner = tolerance.corner(CHANGE, [sign * (j == k) for j in range(count)])
                ends.append(_slack(query, corner, start))
            except AnswerError:
                ends.append(slack)
        falls.append((ends[0] - ends[1]) / (2 * step))
        try:
            low = _proved_slack(query, one.piece(one.between(-size, size)))
        except AnswerError:
            low = level
        costs.append((level - low) / step)
    fall = np.array(falls)
    cost = np.maximum(np.array(costs), 1.2 * np.abs(fall))
    usable = np.isfinite(slack) & np.isfinite(fall).all(axis=0) & np.isfinite(cost).all(axis=0)
    sides = query.scene.sides.a
    two_throws = [
        isinstance(goal, OrientedBeyond) and not goal.from_anywhere
        for goal in query.goals
        for _ in _slack_of(goal, sides.tolist())
    ]
    return Sensitivity(
        slack[usable], fall.T[usable], cost.T[usable], np.array(two_throws, dtype=bool)[usable]
    )


def _slack(query: Query, piece: SceneBox | None, start: tuple[float, int]) -> Array:
    """Read the slack of one scene off a long orbit."""
    box = query.box(piece, {})
    path = orbit(box.at_kappa(box.middle_kappa), *start, BEFORE + LENGTH)
    x, side = np.asarray(path.x)[BEFORE:], np.asarray(path.side)[BEFORE:]
    highest = [float(x[side == s].max(initial=-math.inf)) for s in range(box.lo.a.size)]
    return np.array([each for goal in query.goals for each in _slack_of(goal, highest)])


def _slack_of(goal: Goal, highest: Sequence[float]) -> list[float]:
    """Give the slack for each way in which a goal can fail, from the highest place on each side."""
    if isinstance(goal, OrientedBeyond):
        return [goal.x - top for side, top in enumerate(highest) if side != goal.side]
    if isinstance(goal, Reaches):
        return [highest[goal.side] - goal.x]
    return []


def _proved_slack(query: Query, piece: SceneBox | None) -> Array:
    """Say what slack is proved; of a place to be reached, nothing of the kind is."""
    extents = query.cells(piece, STEP).cells.extents()
    sides = range(query.scene.sides.a.size)
    highest = [max((hi for _, hi in extents.get(side, ())), default=-math.inf) for side in sides]
    found: list[float] = []
    for goal in query.goals:
        found += [0.0] if isinstance(goal, Reaches) else _slack_of(goal, highest)
    return np.array(found)
