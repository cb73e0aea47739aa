"""Policies as tables: in which state to throw how, and which state comes after which answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.policies.beliefs import Kept, cells_of
from limitsets.policies.game import Game, Mask
from limitsets.tables import Table, Tabled

NONE = -1
"""No throw: stop; or no state: the answer cannot come, or comes of a part that is caught."""


@dataclass(frozen=True, eq=False)
class Policy(Tabled):
    """A table that a controller can run.

    Attributes
    ----------
    answers : tuple of str
        What the sensor may say; one empty word without a sensor.
    throws : tuple of str
        Names of the throws.
    first : ndarray of int, shape (answers,)
        The state to begin in, by the answer before the first throw; -1: it cannot come.
    belief : ndarray of bool, shape (states, n_cells)
        Where the part may lie in each state.
    throw : ndarray of int, shape (states,)
        The throw to make, -1 to stop.
    after : ndarray of int, shape (states, answers)
        The next state by the answer; -1: it cannot come, or the part is caught.
    left : ndarray of int, shape (states,)
        No more throws than this are made from there; it falls with every throw.
    """

    answers: tuple[str, ...]
    throws: tuple[str, ...]
    first: NDArray[np.int64]
    belief: Mask
    throw: NDArray[np.int64]
    after: NDArray[np.int64]
    left: NDArray[np.int64]

    @property
    def states(self) -> int:
        """Number of states."""
        return int(self.throw.size)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        words = [word or "any" for word in self.answers]
        columns = ("state", "begin", "throw", *(f"next_{word}" for word in words), "left")
        rows = []
        for k in range(self.states):
            begin = " ".join(word for word, at in zip(words, self.first.tolist(), strict=True) if at == k)
            throw = "stop" if self.throw[k] == NONE else self.throws[int(self.throw[k])]
            after = [None if number == NONE else number for number in self.after[k].tolist()]
            rows.append((k, begin or None, throw, *after, int(self.left[k])))
        return (Table(columns, rows, "Policy"),)

    def to_json(self) -> dict[str, Any]:
        """Give what a controller needs, without the beliefs."""

        def by_answer(numbers: NDArray[np.int64]) -> dict[str, int | None]:
            return {
                word or "any": None if number == NONE else number
                for word, number in zip(self.answers, numbers.tolist(), strict=True)
            }

        return {
            "first": by_answer(self.first),
            "states": [
                {
                    "state": k,
                    "throw": None if self.throw[k] == NONE else self.throws[int(self.throw[k])],
                    "after": by_answer(self.after[k]),
                    "left": int(self.left[k]),
                }
                for k in range(self.states)
            ],
        }


def policy_of(
    game: Game, roots: Sequence[int], choices: Sequence[tuple[int, tuple[int, ...]]], solved: Kept
) -> Policy:
    """Collect the solved beliefs that come up, numbered in the order in which they do."""
    order: dict[int, int] = {}
    waiting = [number for number in roots if number >= 0]
    while waiting:
        number = waiting.pop(0)
        if number not in order:
            order[number] = len(order)
            waiting += [each for each in choices[number][1] if each >= 0]
    answers, kept = tuple(game.answers), list(order)
    belief = np.zeros((len(kept), game.n_cells), dtype=bool)
    after = np.full((len(kept), len(answers)), NONE, dtype=np.int64)
    for k, number in enumerate(kept):
        belief[k, cells_of(solved.rows[number])] = True
        if choices[number][0] != NONE:
            after[k] = [order.get(each, NONE) for each in choices[number][1]]
    return Policy(
        answers,
        game.throws,
        np.array([order.get(each, NONE) for each in roots], dtype=np.int64),
        belief,
        np.array([choices[number][0] for number in kept], dtype=np.int64),
        after,
        solved.throws[kept].copy(),
    )


def broken(policy: Policy, game: Game, starts: Mask) -> str:
    """Look for what a policy does not keep to: inclusion after every throw, falling counts, targets; "" for nothing.

    It asks the game's images and nothing of the search.
    """
    for word, number in zip(game.answers, policy.first.tolist(), strict=True):
        at_first = starts & game.answers[word]
        if game.lost is not None:
            at_first &= ~game.target & ~game.lost
        if at_first.any() and (number == NONE or (at_first & ~policy.belief[number]).any()):
            return f"the state to begin in does not hold the starts with the answer {word!r}"
    for k in range(policy.states):
        throw, cells = int(policy.throw[k]), np.flatnonzero(policy.belief[k])
        if throw == NONE:
            if game.lost is not None or not game.target[cells].all():
                return f"state {k} stops off the target"
            continue
        if game.leaves[throw, cells].any():
            return f"the throw of state {k} may leave"
        image = np.zeros(game.n_cells, dtype=bool)
        for cell in cells.tolist():
            image[cells_of(game.images[throw, cell])] = True
        if game.lost is not None:
            if (image & game.lost).any():
                return f"the throw of state {k} may be caught wrongly"
            image &= ~game.target
        for word, number in zip(game.answers, policy.after[k].tolist(), strict=True):
            heard = image & game.answers[word]
            if heard.any() and (number == NONE or (heard & ~policy.belief[number]).any()):
                return f"the state after state {k} and the answer {word!r} does not hold what may be"
            if number != NONE and not policy.left[number] < policy.left[k]:
                return f"the count of state {k} does not fall"
    return ""
