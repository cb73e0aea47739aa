"""Where chunks are computed: processes on this machine, a Dask cluster, or an executor that the caller gives."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from types import ModuleType
from typing import Any

from limitsets.errors import LimitsetsError
from limitsets.sweep.store import imported

__all__ = ["Given", "Here", "Processes", "chosen_pool", "on_cluster", "present_cores"]

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


class Processes(Given):
    """Processes on this machine, which end when the driver ends, however it ends."""

    def __init__(self, workers: int) -> None:
        self.workers = workers
        super().__init__(self._started(), _WAITING * workers)

    def _started(self) -> Executor:
        # not fork: compiled code and zarr have threads
        methods = multiprocessing.get_all_start_methods()
        context: Any = multiprocessing.get_context("forkserver" if "forkserver" in methods else "spawn")
        if "forkserver" in methods:
            context.set_forkserver_preload(["limitsets.sweep.work"])
        self.heard, self.alive = context.Pipe(duplex=False)
        return ProcessPoolExecutor(self.workers, context, initializer=_begin, initargs=(self.heard,))

    def submit(self, function: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Begin to compute something; processes are started here as they are needed."""
        with _no_script():
            return super().submit(function, *arguments)

    def restart(self) -> None:
        """Start new processes in place of those of which one died."""
        self.abandon()
        self.executor = self._started()

    def end(self) -> None:
        """End the processes, which have nothing left to do."""
        self.executor.shutdown()
        self._closed()

    def abandon(self) -> None:
        """End the processes at once, whatever they do."""
        self._closed()
        self.executor.shutdown(cancel_futures=True)

    def _closed(self) -> None:
        self.alive.close()
        self.heard.close()


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


def _begin(heard: Any) -> None:
    """Begin a worker: Ctrl-C is the driver's, and a driver that is gone is heard by the end of its pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_listen, args=(heard,), daemon=True).start()


def _listen(heard: Any) -> None:
    with contextlib.suppress(EOFError, OSError):
        heard.recv_bytes()
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
) -> Iterator[Given]:
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
    elif chunks == 1:  # to start a process takes longer than most single chunks
        yield Given(Here(), 1)
    else:
        yield Processes(min(workers or present_cores(), chunks))
