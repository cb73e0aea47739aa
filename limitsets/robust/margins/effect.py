"""How much each quantity matters to a goal, by floats: where the worst corner of a box is, and what to cut.

The distance that is to spare before a goal fails (from the highest place on another side to X, from X to the highest
place on the wanted one) is nearly linear in the quantities.  It is read off one long orbit for each change of one
quantity.  Nothing is proved here; it only says in which order to try.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.goals import Goal, OrientedBeyond, Reaches
from limitsets.maps import orbit
from limitsets.proofs.asked.search import settled
from limitsets.proofs.tolerance import Piece
from limitsets.robust.margins.asking import Question
from limitsets.robust.margins.deviations import Measure

__all__ = ["Effects", "effects_of", "scene_at"]

# Throws of an orbit that is read, after so many that are not.
LENGTH, BEFORE = 60_000, 2000

# Refinement of the cells with which the cost of a piece is measured.
STEP = 2

# Part of the tolerance by which a quantity is changed to either side.
CHANGE = Fraction(1, 4)


def scene_at(measures: Sequence[Measure], sizes: Sequence[Fraction]) -> Piece:
    """Return the one scene in which every quantity deviates by so much."""
    spans = {one.key: one.at(size) for one, size in zip(measures, sizes, strict=True)}
    return Piece(measures[0].scene, spans)


@dataclass(frozen=True, eq=False)
class Effects:
    """What is to spare, and how it falls with each quantity.

    Attributes
    ----------
    spare : ndarray, shape (n,)
        In the scene as it is, one number for each way in which a goal can fail; negative where one does.
    fall : ndarray, shape (n, quantities)
        By how much each falls when a quantity rises by its tolerance.
    cost : ndarray, shape (n, quantities)
        By how much less is proved of each when a quantity may be anywhere in its tolerance, proved as noise.
    kept : ndarray of bool, shape (n,)
        Whether two throws with the same parameters are looked at: then what is proved falls as the corners do.
    """

    spare: NDArray[np.float64]
    fall: NDArray[np.float64]
    cost: NDArray[np.float64]
    kept: NDArray[np.bool_]

    @classmethod
    def none(cls, quantities: int) -> Effects:
        """Return what is known where nothing attracts."""
        return cls(
            np.zeros(0), np.zeros((0, quantities)), np.zeros((0, quantities)), np.zeros(0, dtype=np.bool_)
        )

    def corners(self) -> list[tuple[int, ...]]:
        """Signs of the worst corner for each way to fail, the worst of all first."""
        cost = np.abs(self.fall).sum(axis=1)
        order = np.argsort(np.where(cost > 0.0, self.spare / np.maximum(cost, 1e-300), math.inf))
        signs = [tuple(int(s) for s in np.where(self.fall[k] < 0.0, -1, 1)) for k in order]
        return list(dict.fromkeys(signs))


def _spare(question: Question, piece: Piece, start: tuple[float, int]) -> NDArray[np.float64]:
    box = question.box(piece, {})
    path = orbit(box.at_kappa(box.middle_kappa), *start, BEFORE + LENGTH)
    x, side = np.asarray(path.x)[BEFORE:], np.asarray(path.side)[BEFORE:]
    count = box.lo.a.size
    highest = [float(x[side == s].max(initial=-math.inf)) for s in range(count)]
    found: list[float] = []
    for goal in question.goals:
        found += _to_spare(goal, highest)
    return np.array(found)


def _to_spare(goal: Goal, highest: Sequence[float]) -> list[float]:
    if isinstance(goal, OrientedBeyond):
        return [goal.x - top for side, top in enumerate(highest) if side != goal.side]
    if isinstance(goal, Reaches):
        return [highest[goal.side] - goal.x]
    return []


def effects_of(question: Question, measures: Sequence[Measure], tolerance: Mapping[str, Fraction]) -> Effects:
    """Measure the effects by differences.

    Parameters
    ----------
    question : Question
        The goals.
    measures : sequence of Measure
        Quantities that are fixed but unknown.
    tolerance : mapping of str to Fraction
        A size for each.
    """
    nominal = question.prove(finest=1)
    if nominal.found is None or not (nominal.found.component >= 0).any():
        return Effects.none(len(measures))
    start, none = settled(nominal.found), [Fraction(0)] * len(measures)
    spare = _spare(question, scene_at(measures, none), start)
    falls, costs = [], []
    level = _proved_of(question, None)
    for k, one in enumerate(measures):
        ends = []
        for sign in (-1, 1):
            sizes = [*none]
            sizes[k] = sign * CHANGE * tolerance[one.quantity]
            try:
                ends.append(_spare(question, scene_at(measures, sizes), start))
            except AnswerError:
                ends.append(spare)
        falls.append((ends[0] - ends[1]) / (2 * float(CHANGE)))
        costs.append((level - _over(question, one, CHANGE * tolerance[one.quantity], level)) / float(CHANGE))
    fall = np.array(falls)
    cost = np.maximum(np.array(costs), 1.2 * np.abs(fall))
    usable = np.isfinite(spare) & np.isfinite(fall).all(axis=0) & np.isfinite(cost).all(axis=0)
    kept = [
        isinstance(goal, OrientedBeyond) and not goal.from_anywhere
        for goal in question.goals
        for _ in _to_spare(goal, np.zeros(question.box(None, {}).lo.a.size).tolist())
    ]
    return Effects(spare[usable], fall.T[usable], cost.T[usable], np.array(kept, dtype=np.bool_)[usable])


def _proved_of(question: Question, piece: Piece | None) -> NDArray[np.float64]:
    """Say what is proved to be to spare; of a place to be reached, nothing of the kind is."""
    extents = question.cells(piece, STEP).cells.extents()
    highest = [max((hi for _, hi in parts), default=-math.inf) for _, parts in sorted(extents.items())]
    found: list[float] = []
    for goal in question.goals:
        found += [math.nan] if isinstance(goal, Reaches) else _to_spare(goal, highest)
    return np.where(np.isnan(found), 0.0, np.array(found))


def _over(
    question: Question, one: Measure, size: Fraction, level: NDArray[np.float64]
) -> NDArray[np.float64]:
    try:
        return _proved_of(question, one.piece(one.between(-size, size)))
    except AnswerError:
        return level
