"""The driver: hands chunks out in a bounded window, writes what comes back, and starts workers again that died."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Collection
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from limitsets.errors import LimitsetsError
from limitsets.progress import GOES_ON

if TYPE_CHECKING:
    from pathlib import Path

    from limitsets.sweep.executors import Given, Processes

Progress: TypeAlias = Callable[[str, int, int], None]

# How often a chunk may kill the worker that computes it, alone.
_MOST_DEATHS = 3
_SECONDS = 0.5


@dataclass(frozen=True)
class Work:
    """What is to be computed, in numbered chunks.

    Attributes
    ----------
    chunks : int
        How many there are.
    function : callable
        Importable by workers: called with `given` and the number of a chunk.
    given : tuple
        What it is given before the number.
    size : callable
        Points in the chunk of a number.
    place : callable
        The same in words, for errors.
    task, name, points : str
        What answers, what is said to be done, and what its points are, in words.
    """

    chunks: int
    function: Callable[..., Any]
    given: tuple[Any, ...]
    size: Callable[[int], int]
    place: Callable[[int], str]
    task: str
    name: str
    points: str


class Kept(Protocol):
    """Where answers are kept, so that a run that was cut off goes on with the rest."""

    path: Path | None

    @property
    def done(self) -> Collection[int]:
        """Numbers of the chunks that are kept."""
        ...

    def write(self, found: Any) -> None:
        """Keep the answer of a chunk."""
        ...


class _Told:
    """What is said while chunks are computed: how many points a second, and how long it will take."""

    def __init__(self, work: Work, store: Kept, progress: Progress | None) -> None:
        self.work, self.store, self.progress = work, store, progress
        self.began, self.before = time.monotonic(), len(store.done)
        self.points = 0

    def tell(self) -> None:
        """Say it."""
        if self.progress is None:
            return
        done, of = len(self.store.done), self.work.chunks
        if done == of:
            return
        seconds = time.monotonic() - self.began
        words = f"{self.work.name} (a first run compiles: up to two minutes)"
        if self.points and seconds > 0:
            rate = self.points / seconds
            left = (of - done) * seconds / (done - self.before)
            speed = f"{rate:,.0f}" if rate >= 10.0 else f"{rate:.2g}"
            words = f"{self.work.name}, {speed} {self.work.points} a second, {_in_words(left)} left"
        self.progress(words, done, of)


def _in_words(seconds: float) -> str:
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def drive(work: Work, store: Kept, pool: Given | Processes, progress: Progress | None = None) -> None:
    """Compute the chunks that a store does not hold yet.

    A chunk whose worker died is computed again alone, so that nothing else can have ended its worker.

    Raises
    ------
    LimitsetsError
        The task failed, a chunk kills its worker again and again, or the store cannot be written.
    """
    todo = deque(k for k in range(work.chunks) if k not in store.done)
    again: deque[int] = deque()
    deaths: Counter[int] = Counter()
    flight: dict[Future[Any], int] = {}
    told = _Told(work, store, progress)

    def lost(number: int) -> None:
        deaths[number] += 1
        if deaths[number] == _MOST_DEATHS:
            raise LimitsetsError(
                "a worker", f"killed {_MOST_DEATHS} times by one chunk", "a chunk that a worker survives",
                f"it is the one at {work.place(number)}; look at its memory and at the task there",
            )  # fmt: skip
        again.append(number)
        pool.restart()

    try:
        while todo or again or flight:
            told.tell()
            alone = again or any(k in deaths for k in flight.values())
            while (todo or again) and len(flight) < (1 if alone else pool.window):
                number = (again or todo).popleft()
                try:
                    flight[pool.submit(work.function, *work.given, number)] = number
                except BrokenExecutor:
                    lost(number)
            for future in wait(flight, timeout=_SECONDS, return_when=FIRST_COMPLETED).done:
                number = flight.pop(future)
                if not _kept(work, store, future, number, told):
                    lost(number)
    except BaseException as error:
        for future in flight:
            future.cancel()
        pool.abandon()
        if isinstance(error, KeyboardInterrupt) and store.path is not None:
            error.add_note(GOES_ON)
        raise
    pool.end()


def _kept(work: Work, store: Kept, future: Future[Any], number: int, told: _Told) -> bool:
    """Write the answers of a chunk; False where the worker died."""
    try:
        found = future.result()
    except BrokenExecutor:
        return False
    except LimitsetsError:
        raise
    except Exception as error:
        raise LimitsetsError(
            work.task, f"{type(error).__name__}: {error}", "a task that answers",
            f"it failed in the chunk at {work.place(number)}",
        ) from error  # fmt: skip
    store.write(found)
    told.points += work.size(number)
    return True
