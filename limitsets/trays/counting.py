"""What a depression does with parts that come by and with kicks, counted in the engine."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.engine.depression import EMPTY, UNFINISHED, Pose, Rest
from limitsets.errors import AnswerError
from limitsets.files import as_table
from limitsets.robust.noise.proportions import binomial_interval
from limitsets.trays.passing import Passes, random_of

Progress = Callable[[str, int, int], None]

# Trials of one task, and the streams of random numbers: a part that comes by; from here on kicks, by state.
BLOCK, ARRIVALS, KICKS = 50, 0, 1


@dataclass(frozen=True, eq=False)
class Counts:
    """Counts of what a depression did.

    Attributes
    ----------
    states : tuple of str
        Names of the states, by number; 0 is the empty depression.
    right : int
        Number of the state wanted.
    captured : ndarray of int64, shape (states,)
        States in which parts that came by an empty depression left it.
    kicked : ndarray of int64, shape (states, states)
        By the state before, the states in which one kick left it; rows of states that never came about are 0.
    unfinished : int
        Parts that had not come to rest when patience ended; they are in none of the counts.
    poses : dict of int to Pose
        Where the first part in each state lay.
    """

    states: tuple[str, ...]
    right: int
    captured: NDArray[np.int64]
    kicked: NDArray[np.int64]
    unfinished: int
    poses: dict[int, Pose]

    @property
    def met(self) -> list[int]:
        """Numbers of the states that came about, and that wanted, without the empty one."""
        return [k for k in range(1, len(self.states)) if k == self.right or self.kicked[k].any()]

    def to_json(self) -> dict[str, Any]:
        """Give counts and Clopper-Pearson intervals of 95 %, by the names of states."""
        names = ["empty", *(self.states[k] for k in self.met)]
        numbers = [EMPTY, *self.met]

        def row(counts: NDArray[np.int64]) -> dict[str, Any]:
            found, of = (
                {name: int(counts[k]) for name, k in zip(names, numbers, strict=True)},
                int(counts.sum()),
            )
            intervals = {name: binomial_interval(n, of) if of else (0.0, 1.0) for name, n in found.items()}
            return {"counts": found, "of": of, "intervals": intervals}

        kicked = {self.states[k]: row(self.kicked[k]) for k in self.met}
        return as_table(arrivals=row(self.captured), kicks=kicked, unfinished=self.unfinished)


def _arrivals(passes: Passes, seed: int, numbers: Sequence[int]) -> list[Rest]:
    """Let parts come by an empty depression."""
    trials = (passes.arrival(random_of(seed, ARRIVALS, k)) for k in numbers)
    return [passes.plate.settle(*trial) for trial in trials]


def _kicks(
    passes: Passes, seed: int, state: int, poses: Sequence[Pose], numbers: Sequence[int]
) -> list[Rest]:
    """Kick parts that lie in a depression, each as one of those that came to lie so."""
    found = []
    for k in numbers:
        motion = passes.kick(random_of(seed, KICKS + state, k))
        found.append(passes.plate.settle(poses[k % len(poses)], motion))
    return found


def spread_over(
    executor: Executor | None, task: Callable[[Any], list[Any]], blocks: Iterable[Any]
) -> Iterable[Any]:
    """Run a task on blocks, here or by an executor, and give the answers in the order of the blocks."""
    return map(task, blocks) if executor is None else executor.map(task, blocks)


def _run(
    task: Callable[[Any], list[Rest]],
    trials: int,
    executor: Executor | None,
    told: Callable[[int], None],
) -> list[Rest]:
    blocks = [range(lo, min(lo + BLOCK, trials)) for lo in range(0, trials, BLOCK)]
    rests: list[Rest] = []
    for found in spread_over(executor, task, blocks):
        rests += found
        told(len(rests))
    return rests


def _tally(rests: Sequence[Rest], states: int, which: str) -> NDArray[np.int64]:
    """Count states; without any the chain would have a row of nothing."""
    done = [rest.state for rest in rests if rest.state != UNFINISHED]
    if not done:
        remedy = "make more of them, or agitate less: these were still in motion when patience ended"
        raise AnswerError(f"the parts at rest, of those {which},", 0, f"some of {len(rests)}", remedy)
    return np.bincount(np.array(done, dtype=np.int64), minlength=states)


def count(
    passes: Passes,
    drops: int,
    kicks: int,
    seed: int,
    *,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Counts:
    """Count captures of `drops` parts that come by, and what `kicks` kicks do in each state that comes about.

    A state's kicks begin from the poses, in turn, in which parts came to lie in it: from those that came by or, where
    none did, from those kicked into it.

    Raises
    ------
    AnswerError
        No drops or no kicks, or of those from some state none came to rest.
    """
    if drops < 1 or kicks < 1:
        raise AnswerError("the drops and kicks", (drops, kicks), "1 or more", "let some parts fall")
    states = len(passes.states)

    def told(stage: str, of: int) -> Callable[[int], None]:
        return lambda done: None if progress is None else progress(stage, min(done, of - 1), of)

    rests = _run(functools.partial(_arrivals, passes, seed), drops, executor, told("drops", drops))
    captured = _tally(rests, states, "that came by")
    kicked = np.zeros((states, states), dtype=np.int64)
    poses: dict[int, list[Pose]] = {passes.right: []}
    every = list(rests)
    for rest in rests:
        poses.setdefault(rest.state, []).append(rest.pose)
    if not poses[passes.right]:
        poses[passes.right] = [passes.plate.seated(passes.side)]
    waiting = [k for k in sorted(poses) if k > EMPTY]
    while waiting:
        state = waiting.pop(0)
        task = functools.partial(_kicks, passes, seed, state, poses[state])
        after = _run(task, kicks, executor, told(f"kicks, {passes.states[state]}", kicks))
        kicked[state] = _tally(after, states, f"kicked from {passes.states[state]}")
        every += after
        fresh: dict[int, list[Pose]] = {}
        for rest in after:
            if rest.state > EMPTY and rest.state not in poses:
                fresh.setdefault(rest.state, []).append(rest.pose)
        poses |= fresh
        waiting += sorted(fresh)
    unfinished = sum(rest.state == UNFINISHED for rest in every)
    first = {state: found[0] for state, found in sorted(poses.items()) if state > EMPTY}
    return Counts(passes.states, passes.right, captured, kicked, unfinished, first)
