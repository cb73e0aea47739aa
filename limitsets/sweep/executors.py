"""Where chunks are computed: processes on this machine, a Dask cluster, or an executor that the caller gives."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import queue
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from limitsets.errors import LimitsetsError
from limitsets.sweep.store import imported

# Chunks that wait beside those that are computed: enough that no worker ever waits for the driver.
_WAITING = 2


def present_cores() -> int:
    """Count the cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Given:
    """An executor that somebody else starts and ends.

    Parameters
    ----------
    executor : concurrent.futures.Executor
        It computes the chunks.
    window : int
        How many chunks it is given at once.
    """

    def __init__(self, executor: Executor, window: int = 32) -> None:
        self.executor, self.window = executor, window

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Begin to compute something."""
        return self.executor.submit(function, *arguments)

    def restart(self) -> None:
        """Refuse to go on with an executor that broke: it is not ours to start again."""
        raise LimitsetsError(
            "the executor", "broken: one of its workers died", "one whose workers live",
            "start a new one; the same call goes on with what is left",
        )  # fmt: skip

    def end(self) -> None:
        """Leave it as it is."""

    abandon = end


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
        self.window = _WAITING * workers
        self._tasks: queue.SimpleQueue[tuple[Future[Any], tuple[Any, ...]] | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._running: set[Any] = set()
        self._threads: list[threading.Thread] = []
        self._over = False
        methods = multiprocessing.get_all_start_methods()
        # not fork: compiled code and zarr have threads
        self._context: Any = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
        if "forkserver" in methods:
            self._context.set_forkserver_preload(["limitsets.sweep.work"])

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        """Begin to compute something."""
        future: Future[Any] = Future()
        self._tasks.put((future, (function, arguments, options)))
        if len(self._threads) < self._max_workers:
            self._threads.append(threading.Thread(target=self._serve, daemon=True))
            self._threads[-1].start()
        return future

    def restart(self) -> None:
        """Do nothing: in place of a process that died another one is started when there is work for it."""

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

    def end(self) -> None:
        """End the processes, which have nothing left to do."""
        self.shutdown()

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
                allowed, remedy = (
                    "one that lives until it answers",
                    "give it more memory, or ask for fewer workers",
                )
                future.set_exception(WorkerDiedError("a worker process", "dead", allowed, remedy))
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
def on_cluster(address: str) -> Iterator[Given]:
    """Use a Dask cluster, by the address of its scheduler."""
    distributed = imported("distributed")
    try:
        client = distributed.Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError) as error:
        raise LimitsetsError(
            "the cluster", address, "the address of a Dask scheduler, like tcp://10.0.0.1:8786", f"{error}"
        ) from None
    with client:
        threads = sum(client.nthreads().values())
        yield Given(client.get_executor(pure=False), _WAITING * max(threads, 1))


@contextmanager
def chosen_pool(
    chunks: int, executor: Executor | None, cluster: str | None, workers: int | None
) -> Iterator[Given | Processes]:
    """Choose where so many chunks are computed.

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
        yield Given(executor)
    elif cluster is not None:
        with on_cluster(cluster) as pool:
            yield pool
    elif chunks == 1 and workers is None:  # to start a process takes longer than most single chunks
        yield Given(Here(), 1)
    else:
        yield Processes(min(workers or present_cores(), chunks))
