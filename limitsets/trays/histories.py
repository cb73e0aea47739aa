"""Histories of one depression in the engine, pass by pass, and whether it forgets between passes."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.engine.depression import EMPTY, UNFINISHED, Pose
from limitsets.files import as_table
from limitsets.robust.noise.proportions import binomial_interval
from limitsets.trays.counting import Progress, spread_over
from limitsets.trays.passing import Passes, random_of

# The streams of random numbers, beyond those of kicks: 2 + n states at most.
FRESH, RETURNING = 10_001, 10_002
# So many past misses are told apart.
PAST = 3

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Histories:
    """What became of one depression, from the empty one, in histories that share nothing.

    Attributes
    ----------
    after_kick, after_pass : ndarray of int64, shape (histories, passes)
        Its state after the kick, and after the part that came by, of each pass; -1 from where a part did not come to
        rest.
    returning : bool
        Whether a part that missed comes by again in the next pass, as it lies, or a new one does.
    right : int
        Number of the state wanted.
    """

    after_kick: Ints
    after_pass: Ints
    returning: bool
    right: int

    @property
    def filled(self) -> NDArray[np.float64]:
        """Fraction filled rightly after 0, 1, ... passes, shape (passes + 1,)."""
        return np.concatenate([[0.0], (self.after_pass == self.right).mean(axis=0)])

    def interval(self, after: int) -> tuple[float, float]:
        """Give the interval of the fraction after so many passes; histories are independent."""
        found = int((self.after_pass[:, after - 1] == self.right).sum()) if after else 0
        return binomial_interval(found, self.after_pass.shape[0])

    def captures(self) -> list[tuple[int, int]]:
        """Give (right captures, parts that came by) of an empty depression: after 0, 1 and 2 or more misses in turn."""
        found = [[0, 0] for _ in range(PAST)]
        for kicked, passed in zip(self.after_kick.tolist(), self.after_pass.tolist(), strict=True):
            misses = 0
            for before, after in zip(kicked, passed, strict=True):
                if before == EMPTY and after != UNFINISHED:
                    found[min(misses, PAST - 1)][0] += after == self.right
                    found[min(misses, PAST - 1)][1] += 1
                misses = misses + 1 if before == EMPTY and after == EMPTY else 0
        return [(right, of) for right, of in found]

    def releases(self) -> list[tuple[int, int]]:
        """Give (releases, kicks) of the right state: after it stood 0, 1 and 2 or more kicks."""
        found = [[0, 0] for _ in range(PAST)]
        for kicked, passed in zip(self.after_kick.tolist(), self.after_pass.tolist(), strict=True):
            stood = -1
            for last, now, after in zip([EMPTY, *passed[:-1]], kicked, passed, strict=True):
                if last == self.right and now != UNFINISHED:
                    found[min(stood, PAST - 1)][0] += now != self.right
                    found[min(stood, PAST - 1)][1] += 1
                if after == self.right:
                    stood = stood + 1 if last == self.right and now == self.right else 0
        return [(out, of) for out, of in found]

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""

        def table(counts: list[tuple[int, int]]) -> list[dict[str, Any]]:
            return [
                {"count": n, "of": of, "interval": binomial_interval(n, of) if of else (0.0, 1.0)}
                for n, of in counts
            ]

        return as_table(
            histories=self.after_pass.shape[0],
            returning=self.returning,
            right=self.filled,
            interval=[self.interval(k) for k in range(self.filled.size)],
            captured_after_misses=table(self.captures()),
            released_after_stood=table(self.releases()),
            unfinished=int((self.after_pass == UNFINISHED).any(axis=1).sum()),
        )


def _history(
    passes: Passes, count: int, seed: int, returning: bool, numbers: Sequence[int]
) -> list[list[tuple[int, int]]]:
    """Follow depressions from empty ones: states after kick and pass."""
    found = []
    for number in numbers:
        random = random_of(seed, RETURNING if returning else FRESH, number)
        state, pose, on_plate, rows = EMPTY, Pose(0.0, 0.0, 0.0), None, []
        for _ in range(count):
            if state > EMPTY:
                rest = passes.plate.settle(pose, passes.kick(random))
                state, pose = rest.state, rest.pose
                # what popped out is washed on with the parts that pass; it does not come by again in this pass
            after_kick = state
            if state == EMPTY:
                again = on_plate is not None and returning
                came = passes.again(on_plate, random) if again and on_plate else passes.arrival(random)
                rest = passes.plate.settle(*came)
                state, pose = rest.state, rest.pose
                on_plate = pose if state == EMPTY and rest.side >= 0 else None
            rows.append((after_kick, state))
            if state == UNFINISHED:
                rows += [(UNFINISHED, UNFINISHED)] * (count - len(rows))
                break
        found.append(rows)
    return found


def histories(
    passes: Passes,
    number: int,
    count: int,
    seed: int,
    *,
    returning: bool = False,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Histories:
    """Follow `number` depressions for `count` passes each.

    Parameters
    ----------
    passes : Passes
        The plate and the laws.
    number, count : int
        Histories, and passes of each.
    seed : int
        Of all draws.
    returning : bool
        Whether a part that missed comes by again, kicked and washed on from where it lies: the next depression is equal
        to this one.  Else each pass has a part of its own, as it has after a capture or a part that lies on no side.
    executor, progress
        As in `limitsets.tray`.
    """
    task = functools.partial(_history, passes, count, seed, returning)
    rows: list[list[tuple[int, int]]] = []
    for found in spread_over(executor, task, [[k] for k in range(number)]):
        if progress is not None:
            progress("histories", len(rows), number)
        rows += found
    table = np.array(rows, dtype=np.int64).reshape(number, count, 2)
    return Histories(table[..., 0].copy(), table[..., 1].copy(), returning, passes.right)
