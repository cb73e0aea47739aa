"""The driver: hands chunks out in a bounded window, writes what comes back, and starts workers again that died."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from typing import TYPE_CHECKING, TypeAlias

from limitsets.errors import LimitsetsError
from limitsets.sweep.plan import Plan
from limitsets.sweep.work import Answer, answer

if TYPE_CHECKING:
    from limitsets.sweep.executors import Given
    from limitsets.sweep.store import Store

__all__ = ["Progress", "drive"]

Progress: TypeAlias = Callable[[str, int, int], None]

# How often a chunk may kill the worker that computes it, alone.
_MOST_DEATHS = 3
_SECONDS = 0.5


class _Told:
    """What is said while chunks are computed: how many points a second, and how long it will take."""

    def __init__(self, plan: Plan, store: Store, progress: Progress | None) -> None:
        self.plan, self.store, self.progress = plan, store, progress
        self.began, self.before = time.monotonic(), len(store.done)
        self.points = 0

    def tell(self) -> None:
        """Say it."""
        if self.progress is None:
            return
        done, of = len(self.store.done), math.prod(self.plan.chunks)
        if done == of:
            return
        words, seconds = "atlas (a first run compiles: up to two minutes)", time.monotonic() - self.began
        if self.points and seconds > 0:
            rate = self.points / seconds
            left = (of - done) * seconds / (done - self.before)
            words = f"atlas, {rate:,.0f} points a second, {_in_words(left)} left"
        self.progress(words, done, of)


def _in_words(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def drive(plan: Plan, store: Store, pool: Given, progress: Progress | None = None) -> None:
    """Compute the chunks of a plan that its store does not hold yet.

    Raises
    ------
    LimitsetsError
        The task failed, a chunk kills its worker again and again, or the store cannot be written.
    """
    todo = deque(k for k in range(math.prod(plan.chunks)) if k not in store.done)
    flight: dict[Future[Answer], int] = {}
    told = _Told(plan, store, progress)
    try:
        while todo or flight:
            lost: list[int] = []
            told.tell()
            while todo and len(flight) < pool.window and not lost:
                k = todo.popleft()
                try:
                    flight[pool.submit(answer, plan, k)] = k
                except BrokenExecutor:
                    lost.append(k)
            done, _ = wait(flight, timeout=_SECONDS, return_when=FIRST_COMPLETED)
            for future in done:
                k = flight.pop(future)
                if not _kept(plan, store, future, k, told):
                    lost.append(k)
            if lost:
                for future, k in flight.items():
                    if not _kept(plan, store, future, k, told):
                        lost.append(k)
                flight.clear()
                pool.restart()
                _one_by_one(plan, store, pool, sorted(lost), told)
    except BaseException:
        for future in flight:
            future.cancel()
        pool.abandon()
        raise
    pool.end()


def _kept(plan: Plan, store: Store, future: Future[Answer], number: int, told: _Told) -> bool:
    """Write the answers of a chunk; False where the worker died."""
    try:
        found = future.result()
    except BrokenExecutor:
        return False
    except LimitsetsError:
        raise
    except Exception as error:
        raise LimitsetsError(
            f"the task {plan.task}", f"{type(error).__name__}: {error}", "a task that answers",
            f"it failed in the chunk at {plan.words(plan.region(number))}",
        ) from error  # fmt: skip
    store.write(found)
    told.points += math.prod(part.stop - part.start for part in plan.region(number))
    return True


def _one_by_one(plan: Plan, store: Store, pool: Given, lost: list[int], told: _Told) -> None:
    """Compute alone each chunk that may have killed its worker, so that the one that does is known."""
    for number in lost:
        told.tell()
        for _ in range(_MOST_DEATHS):
            try:
                future = pool.submit(answer, plan, number)
            except BrokenExecutor:
                pool.restart()
                continue
            if _kept(plan, store, future, number, told):
                break
            pool.restart()
        else:
            raise LimitsetsError(
                "a worker", f"killed {_MOST_DEATHS} times by one chunk", "a chunk that a worker survives",
                f"it is the one at {plan.words(plan.region(number))}; look at its memory and at the task there",
            )  # fmt: skip
