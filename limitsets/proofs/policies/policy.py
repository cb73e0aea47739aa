"""Policies as tables: which throw in which state, which state after which answer; and the search for one."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.base import Table, Tabled
from limitsets.base.arrays import Ints, Mask
from limitsets.proofs.policies.game import Bits, Game, Kept, cells_of

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
    first: Ints
    belief: Mask
    throw: Ints
    after: Ints
    left: Ints

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

        def by_answer(numbers: Ints) -> dict[str, int | None]:
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
        belief=belief,
        throw=np.array([choices[number][0] for number in kept], dtype=np.int64),
        after=after,
        left=solved.throws[kept].copy(),
    )


def broken(policy: Policy, game: Game, starts: Mask) -> str:
    """Name the rule that a policy breaks: inclusion after every throw, falling counts, targets; "" for none.

    The check uses the images of the game, and no result of the search.
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


# ----------------------------------------------------------------
# Search for a policy: deeper and deeper, beliefs remembered.
#
# A belief is solved within n throws where some throw leads, whatever is answered, to beliefs that are solved within
# n - 1.  Every subset of a solved belief is solved within as many throws, and no superset of an unsolved belief is
# solved: a belief is dropped where a superset is solved in as few throws, or a subset is unsolved in as many.  A belief
# is unsolved if it holds a cell from which a controller who sees the cell does not win in time.


SOLVED, NOT_SOLVED, NOT_DECIDED = "solved", "not-solved", "not-decided"

# The clock is read once in so many beliefs.
BEAT = 64


@dataclass(frozen=True, eq=False)
class Found:
    """How a search ended.

    Attributes
    ----------
    verdict : str
        "solved"; "not-solved": not within `throws` throws on these cells, by whatever policy; or "not-decided".
    throws : int
        Solved: an upper bound of the throws needed, the least on these cells.  Otherwise the largest number within
        which there is proved to be no policy on these cells, -1 if none.
    policy : Policy or None
        What to do, where it is solved.
    beliefs : int
        Beliefs looked at.
    seconds : float
        Time it took.
    reason : str
        What ended the search, where it is not decided.
    """

    verdict: str
    throws: int
    policy: Policy | None
    beliefs: int
    seconds: float
    reason: str = ""


class _SpentError(Exception):
    """Time or memory is used up."""


class _Search:
    def __init__(self, game: Game, throws: int, until: float, most: int) -> None:
        self.game, self.until, self.most = game, until, most
        self.seen, self.reason = 0, ""
        self.seeing = game.seeing(throws)
        self.solved, self.failed = Kept(game.won.size), Kept(game.won.size)
        self.choices: list[tuple[int, tuple[int, ...]]] = []
        self.not_within: dict[bytes, int] = {}
        if game.wrong is None:
            self._keep(game.won, 0, -1, ())

    def _keep(self, belief: Bits, throws: int, throw: int, after: tuple[int, ...]) -> int:
        self.choices.append((throw, after))
        return self.solved.add(belief, throws)

    def hopeless(self, belief: Bits, left: int) -> bool:
        return bool((belief & ~self.seeing[left]).any())

    def solve(self, belief: Bits, left: int) -> int:
        """Find a solved belief that holds this one and needs no more throws than are left; -1 for none."""
        known = self.solved.superset(belief, left)
        if known >= 0 or left == 0 or self.hopeless(belief, left):
            return known
        key = belief.tobytes()
        if self.not_within.get(key, -1) >= left or self.failed.subset(belief, left) >= 0:
            return -1
        self._count()
        for throw in range(len(self.game.throws)):
            heard = self.game.after(belief, throw)
            if heard is None or any(self.hopeless(part, left - 1) for part in heard):
                continue
            after = self._all(heard, left - 1)
            if after is not None:
                most = max((int(self.solved.throws[number]) for number in after if number >= 0), default=0)
                return self._keep(belief, 1 + most, throw, after)
        self.not_within[key] = left
        self.failed.add(belief, left)
        return -1

    def _all(self, heard: tuple[Bits, ...], left: int) -> tuple[int, ...] | None:
        """Solve the beliefs of all answers, the hardest first; -1 for an answer that cannot come."""
        after = [-1] * len(heard)
        sizes = [int(np.bitwise_count(part).sum()) for part in heard]
        for k in sorted(range(len(heard)), key=lambda k: -sizes[k]):
            if sizes[k]:
                after[k] = self.solve(heard[k], left)
                if after[k] < 0:
                    return None
        return tuple(after)

    def start(self, starts: Mask, left: int) -> tuple[int, ...] | None:
        return self._all(self.game.at_first(starts), left)

    def _count(self) -> None:
        self.seen += 1
        if self.seen % BEAT == 0 and time.monotonic() > self.until:
            self.reason = "the time is used up"
        if len(self.not_within) > self.most:
            self.reason = f"{self.most} beliefs are remembered, and no more are"
        if self.reason:
            raise _SpentError


def search(
    game: Game,
    starts: Mask,
    throws: int,
    *,
    seconds: float = 60.0,
    beliefs: int = 400_000,
    progress: Callable[[str, int, int], None] | None = None,
) -> Found:
    """Look for a policy of at most so many throws.

    Parameters
    ----------
    game : Game
        From `game_of`.
    starts : ndarray of bool, shape (n_cells,)
        The cells in which the part may lie at first; where parts are caught, those that catch it are left out.
    throws : int
        The most throws.
    seconds : float
        The most time [s].
    beliefs : int
        The most beliefs to remember.
    progress : callable, optional
        Told the step, its number and how many there are.

    Returns
    -------
    Found

    Examples
    --------
    >>> import numpy as np
    >>> from limitsets.proofs.policies.game import game_of
    >>> ring = {"turn": lambda cells: np.roll(cells, 1)}
    >>> game = game_of(ring, None, np.array([False, False, True]))
    >>> search(game, np.array([True, False, False]), 5).throws
    2
    """
    begin = time.monotonic()
    run = _Search(game, throws, begin + seconds, beliefs)
    if game.lost is not None:
        starts = starts & ~game.target & ~game.lost
    best = -1
    try:
        for left in range(throws + 1):
            if progress is not None:
                progress(f"policies of {left} throws", left, throws + 1)
            roots = run.start(starts, left)
            if roots is not None:
                policy = policy_of(game, roots, run.choices, run.solved)
                return Found(SOLVED, left, policy, run.seen, time.monotonic() - begin)
            best = left
    except _SpentError:
        return Found(NOT_DECIDED, best, None, run.seen, time.monotonic() - begin, run.reason)
    return Found(NOT_SOLVED, best, None, run.seen, time.monotonic() - begin)
