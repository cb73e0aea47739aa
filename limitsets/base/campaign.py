"""Runs of many chunks or trials: where they are computed, who hands them out, and finished ones kept in a file."""

from __future__ import annotations

import contextlib
import json
import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
import time
import traceback
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, Protocol, TypeVar

from limitsets.base.errors import AnswerError, LimitsetsError
from limitsets.base.files import as_json, as_plain, code_digest, locked, replaced
from limitsets.base.progress import GOES_ON, Progress, one_by_one

R = TypeVar("R")

# ----------------------------------------------------------------
# Where chunks are computed: processes on this machine, a Dask cluster, or an executor that the caller gives.


# Chunks that wait beside those that are computed: enough that no worker ever waits for the driver; and chunks that an
# executor is given at once whose workers nobody has counted.
_WAITING, _GIVEN = 2, 32


def present_cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Here(Executor):
    """Computes in this thread what it is given, at once: Ctrl-C ends it."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        """Compute something, and return that it is done."""
        done: Future[Any] = Future()
        try:
            done.set_result(function(*arguments, **options))
        except Exception as error:  # noqa: BLE001 - whoever asks for the result gets it
            done.set_exception(error)
        return done


class WorkerDiedError(LimitsetsError, BrokenExecutor):
    """A process that computed something ended before it answered."""


class Processes(Executor):
    """Processes on this machine, each with a pipe of its own, which end when the driver ends, however it ends.

    The pools of the standard library have one pipe for the answers of all processes: of a process that ends amid a
    long answer they wait for the rest for ever.  Here the end of a process is the end of its pipe.

    Parameters
    ----------
    workers : int
        How many there are at most; each is started when there is work for it.

    Examples
    --------
    >>> import math
    >>> with Processes(2) as pool:
    ...     list(pool.map(math.sqrt, [4.0, 9.0]))
    [2.0, 3.0]
    """

    def __init__(self, workers: int) -> None:
        self._max_workers = workers  # under the name that pools of the standard library have for it
        self._tasks: queue.SimpleQueue[tuple[Future[Any], tuple[Any, ...]] | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._running: set[Any] = set()
        self._threads: list[threading.Thread] = []
        self._over = False
        methods = multiprocessing.get_all_start_methods()
        # not fork: compiled code and zarr have threads
        self._context: Any = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
        if "forkserver" in methods:
            self._context.set_forkserver_preload(["limitsets.parameters.atlas.work"])

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        """Begin to compute something."""
        future: Future[Any] = Future()
        self._tasks.put((future, (function, arguments, options)))
        if len(self._threads) < self._max_workers:
            self._threads.append(threading.Thread(target=self._serve, daemon=True))
            self._threads[-1].start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes when they have done what they were given; what has not begun can be cancelled."""
        if cancel_futures:
            with contextlib.suppress(queue.Empty):
                while task := self._tasks.get_nowait():
                    task[0].cancel()
        for _ in self._threads:
            self._tasks.put(None)
        for thread in self._threads if wait else ():
            thread.join()

    end = shutdown

    def abandon(self) -> None:
        """End the processes at once, whatever they do."""
        with self._lock:
            self._over = True
            for process in self._running:
                process.kill()
        self.shutdown(cancel_futures=True)

    def _serve(self) -> None:
        """Hand one process after the other what waits, and its answers to those who asked."""
        process: Any = None
        pipe: Any = None
        while task := self._tasks.get():
            future, call = task
            if not future.set_running_or_notify_cancel():
                continue
            try:
                if process is None:
                    process, pipe = self._started()
                pipe.send(call)
                good, answer = pipe.recv()
            except (EOFError, OSError):
                self._ended(process, pipe)
                process = pipe = None
                remedy = "give it more memory, or ask for fewer workers"
                died = WorkerDiedError("a worker process", "dead", "one that lives until it answers", remedy)
                future.set_exception(died)
            except Exception as error:  # noqa: BLE001 - what cannot be sent: whoever asks for the result gets it
                future.set_exception(error)
            else:
                future.set_result(answer) if good else future.set_exception(answer)
        self._ended(process, pipe)

    def _started(self) -> tuple[Any, Any]:
        """Start a process."""
        pipe, theirs = self._context.Pipe()
        process = self._context.Process(target=_work, args=(theirs,), daemon=True)
        with self._lock, _no_script():
            if self._over:
                raise EOFError
            process.start()
            self._running.add(process)
        theirs.close()  # so that the pipe ends with the process
        return process, pipe

    def _ended(self, process: Any, pipe: Any) -> None:
        """Wait for the end of a process whose pipe is closed."""
        if process is not None:
            pipe.close()
            process.join()
            with self._lock:
                self._running.discard(process)


@contextmanager
def _no_script() -> Iterator[None]:
    """Start processes that do not run the script that started them: tasks never stand in it.

    Python would import it in each, which begins the sweep again unless the script has a guard.
    """
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


def _work(pipe: Any) -> None:
    """Compute what comes through a pipe, one after the other; Ctrl-C is the driver's."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    calls: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(pipe, calls), daemon=True).start()
    while True:
        try:
            function, arguments, options = pickle.loads(calls.get())
            answer = True, function(*arguments, **options)
        except Exception as error:  # noqa: BLE001 - whoever asks for the result gets it
            error.add_note(traceback.format_exc())
            answer = False, error
        try:
            pipe.send(answer)
        except (TypeError, ValueError, AttributeError, pickle.PicklingError) as error:
            pipe.send((False, TypeError(f"an answer that cannot be sent: {error}")))


def _listen(pipe: Any, calls: queue.SimpleQueue[bytes]) -> None:
    """Take calls, also while one is computed: a driver that is gone is heard by the end of its pipe."""
    with contextlib.suppress(EOFError, OSError):
        while True:
            calls.put(pipe.recv_bytes())
    os._exit(1)


@contextmanager
def on_cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """Use a Dask cluster, by the address of its scheduler: its executor, and how many chunks it is given at once."""
    distributed = imported("distributed")
    try:
        client = distributed.Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise LimitsetsError(
            "the cluster", address, "the address of a Dask scheduler, like tcp://10.0.0.1:8786", f"{error}"
        ) from None
    with client:
        yield client.get_executor(pure=False), _WAITING * max(sum(client.nthreads().values()), 1)


@contextmanager
def chosen_pool(
    chunks: int, executor: Executor | None, cluster: str | None, workers: int | None
) -> Iterator[tuple[Executor, int]]:
    """Choose where so many chunks are computed: an executor, and how many it is given at once.

    Raises
    ------
    LimitsetsError
        More than one place is named, or no workers are asked for.
    """
    if (executor is not None) + (cluster is not None) + (workers is not None) > 1:
        raise LimitsetsError("the workers", "given twice", "executor, cluster or workers", "give one of them")
    if workers is not None and workers < 1:
        raise LimitsetsError("the number of workers", workers, "1 or more", "correct it")
    if executor is not None:
        yield executor, _GIVEN
    elif cluster is not None:
        with on_cluster(cluster) as pool:
            yield pool
    elif chunks == 1 and workers is None:  # to start a process takes longer than most single chunks
        yield Here(), 1
    else:
        count = min(workers or present_cores(), chunks)
        with Processes(count) as processes:
            yield processes, _WAITING * count


def in_order(
    step: str,
    task: Callable[[Any], R],
    things: Sequence[Any],
    executor: Executor | None,
    progress: Progress | None,
) -> list[R]:
    """Run a task on things, here or by an executor: the answers in their order, the same wherever it runs."""
    answers = map(task, things) if executor is None else executor.map(task, things)
    return list(one_by_one(step, answers, len(things), progress))


def imported(module: str) -> Any:
    """Import a library of the extra `atlas`, or say in one line how to get it."""
    from importlib import import_module

    try:
        return import_module(module)
    except ImportError:
        extra = "cluster" if module == "distributed" else "atlas"
        raise LimitsetsError(
            f"the library {module}", "missing", f"the extra {extra}", f"pip install 'limitsets[{extra}]'"
        ) from None


# ----------------------------------------------------------------
# The driver: hands chunks out in a bounded window, writes what comes back, and starts workers again that died.


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

    def write(self, answer: Any) -> None:
        """Keep the answer of a chunk."""
        ...


class _Pace:
    """What is said while chunks are computed: how many points a second, and how long it will take."""

    def __init__(self, work: Work, store: Kept, progress: Progress | None) -> None:
        self.work, self.store, self.progress = work, store, progress
        self.began, self.before = time.monotonic(), len(store.done)
        self.points = 0

    def tell(self) -> None:
        """Say it."""
        done, of = len(self.store.done), self.work.chunks
        if self.progress is None or done == of:
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


def _require_another_worker(work: Work, pool: Executor, number: int, deaths: int) -> None:
    """Refuse to go on where a chunk kills each worker, or where nobody starts another one."""
    if deaths == _MOST_DEATHS:
        raise LimitsetsError(
            "a worker", f"killed {_MOST_DEATHS} times by one chunk", "a chunk that a worker survives",
            f"it is the one at {work.place(number)}; look at its memory and at the task there",
        )  # fmt: skip
    if not isinstance(pool, Processes):
        raise LimitsetsError(
            "the executor", "broken: one of its workers died", "one whose workers live",
            "start a new one; the same call goes on with what is left",
        )  # fmt: skip


def _answer_of(future: Future[Any], work: Work, number: int) -> Any:
    """Return the answer of a chunk; an error of the task names the task and the chunk."""
    try:
        return future.result()
    except (BrokenExecutor, LimitsetsError):
        raise
    except Exception as error:
        raise LimitsetsError(
            work.task, f"{type(error).__name__}: {error}", "a task that answers",
            f"it failed in the chunk at {work.place(number)}",
        ) from error  # fmt: skip


def drive(
    work: Work, store: Kept, pool: Executor, window: int = _GIVEN, progress: Progress | None = None
) -> None:
    """Compute the chunks that a store does not hold yet, of which the pool is given so many at once.

    A chunk whose worker died is computed again alone, so that nothing else can have ended its worker: in its place
    another process is started when there is work for it.  An executor that somebody else started is not started again.

    Raises
    ------
    LimitsetsError
        The task failed, a chunk kills its worker again and again, or the store cannot be written.
    """
    todo = deque(k for k in range(work.chunks) if k not in store.done)
    again: deque[int] = deque()
    deaths: Counter[int] = Counter()
    flight: dict[Future[Any], int] = {}
    pace = _Pace(work, store, progress)

    def lost(number: int) -> None:
        deaths[number] += 1
        _require_another_worker(work, pool, number, deaths[number])
        again.append(number)

    try:
        while todo or again or flight:
            pace.tell()
            alone = again or any(k in deaths for k in flight.values())
            while (todo or again) and len(flight) < (1 if alone else window):
                number = (again or todo).popleft()
                try:
                    flight[pool.submit(work.function, *work.given, number)] = number
                except BrokenExecutor:
                    lost(number)
            for future in wait(flight, timeout=_SECONDS, return_when=FIRST_COMPLETED).done:
                number = flight.pop(future)
                try:
                    answer = _answer_of(future, work, number)
                except BrokenExecutor:
                    lost(number)
                    continue
                store.write(answer)
                pace.points += work.size(number)
    except BaseException as error:
        for future in flight:
            future.cancel()
        if isinstance(pool, Processes):
            pool.abandon()
        if isinstance(error, KeyboardInterrupt) and store.path is not None:
            error.add_note(GOES_ON)
        raise


# ----------------------------------------------------------------
# Finished trials, kept in a file that is replaced whole: a run that is cut off goes on with what is left.


Row = dict[str, Any]


class TrialFile:
    """Trials by their numbers, in chunks; without a path they are kept in memory alone.

    What was asked is that of this very code: its digest is part of the question.

    Parameters
    ----------
    path : Path or None
        The file, JSON: the question, and the trials.
    question : mapping
        What was asked, as JSON holds it: trials of another question are refused.
    trials, chunk : int
        How many trials are wanted, and how many make a chunk.

    Raises
    ------
    AnswerError
        The file cannot be read, or holds trials of another question.

    Examples
    --------
    >>> kept = TrialFile(None, {}, 5, 2)
    >>> kept.write([(0, {"outcome": "assembled"}), (1, {"outcome": "wrong"})])
    >>> kept.chunks, sorted(kept.done)
    (3, [0])
    """

    def __init__(self, path: Path | None, question: dict[str, Any], trials: int, chunk: int) -> None:
        self.path, self.trials, self.chunk = path, trials, chunk
        self.question = as_plain({"limitsets": code_digest(), **question})
        self.rows = _read(path, self.question) if path is not None and path.exists() else {}

    @property
    def chunks(self) -> int:
        """How many chunks there are."""
        return -(-self.trials // self.chunk)

    def numbers(self, chunk: int) -> range:
        """Numbers of the trials of a chunk."""
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.trials))

    @property
    def done(self) -> set[int]:
        """Numbers of the chunks of which every trial is kept."""
        return {k for k in range(self.chunks) if all(number in self.rows for number in self.numbers(k))}

    def write(self, trials: list[tuple[int, Row]]) -> None:
        """Keep trials."""
        self.rows |= {number: as_plain(row) for number, row in trials}
        if self.path is None:
            return
        rows = {str(number): self.rows[number] for number in sorted(self.rows)}
        with replaced(self.path.parent) as draft:
            text = as_json({"question": self.question, "trials": rows})
            (draft / self.path.name).write_text(text, encoding="utf-8")

    def __iter__(self) -> Iterator[Row]:
        """Give the trials wanted, in the order of their numbers."""
        return (self.rows[number] for number in range(self.trials))


class TrialMaker(Protocol):
    """What makes trials, as workers are sent it."""

    def question(self) -> dict[str, Any]:
        """Give what is asked, for the file of the trials: everything but how many they are."""
        ...

    def row(self, number: int) -> Row:
        """Make the trial of a number."""
        ...


def finished_trials(
    maker: TrialMaker,
    trials: int,
    chunk: int,
    name: str,
    points: str,
    *,
    file: str | Path | None = None,
    executor: Executor | None = None,
    cluster: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> tuple[Row, ...]:
    """Make the trials that are not in the file yet, here or where one of the arguments says, and give all of them.

    Parameters
    ----------
    maker : TrialMaker
        What makes them; workers are sent it.
    trials, chunk : int
        How many trials, and how many of them a worker makes at once.
    name, points : str
        What is done, and what is counted, in words.
    file, executor, cluster, workers, progress
        As in `limitsets.assemble`.
    """
    kept = TrialFile(None if file is None else Path(file), maker.question(), trials, chunk)
    if len(kept.done) == kept.chunks:
        return tuple(kept)
    work = Work(
        kept.chunks,
        _made,
        (maker, trials, chunk),
        size=lambda chunk: len(kept.numbers(chunk)),
        place=lambda chunk: f"{points} {kept.numbers(chunk).start} to {kept.numbers(chunk).stop - 1}",
        task=f"the {points}",
        name=name,
        points=points,
    )
    here = executor is None and cluster is None and workers is None
    alone = nullcontext() if kept.path is None else locked(kept.path)
    with alone, chosen_pool(1 if here else kept.chunks, executor, cluster, workers) as (pool, window):
        drive(work, kept, pool, window, progress)
    return tuple(kept)


def _made(maker: TrialMaker, trials: int, chunk: int, number: int) -> list[tuple[int, Row]]:
    """Make the trials of a chunk: what a worker does."""
    return [(k, maker.row(k)) for k in range(number * chunk, min((number + 1) * chunk, trials))]


def _read(path: Path, question: dict[str, Any]) -> dict[int, Row]:
    remedy = "name another file, or delete this one"
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        asked, rows = held["question"], {int(number): row for number, row in held["trials"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        allowed = "a file of trials that this call wrote"
        raise AnswerError("the file of trials", str(path), allowed, remedy) from None
    if asked != question:
        other = next(name for name in (*question, *asked) if asked.get(name) != question.get(name))
        allowed = f"trials of the same scenes, noise, seed and contact; {other} differs"
        raise AnswerError("the file of trials", str(path), allowed, remedy)
    return rows
