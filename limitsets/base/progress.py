"""Progress of what lasts: a bar on a terminal or in a notebook, elsewhere a line for what takes over two seconds."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from html import escape
from typing import Any, ParamSpec, TypeAlias, TypeVar

Progress: TypeAlias = Callable[[str, int, int], None]
"""Told the step, how much of it is done, and of how much."""

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")

# What takes longer than this says what it is doing [s].
PATIENCE = 2.0

# Where more time than this is left, the answer is told to take so long [s].
WORTH = 10.0

# A note on Ctrl-C where answers are kept as they come.
GOES_ON = "what is done is kept, the same command goes on with the rest"


class InterruptedRun(Exception):  # noqa: N818 - no error
    """Ctrl-C, with what can be said of the run: typer gives KeyboardInterrupt on without its notes."""


# Bars on a terminal: of the step on its way, and of those before it.
BARS = 4

# A notebook's bar is painted again after this at the earliest [s].
PAINTED = 0.2


def silent(step: str, done: int, of: int) -> None:
    """Say nothing: the progress of whoever gives none."""


def one_by_one(step: str, things: Iterable[T], of: int, progress: Progress | None) -> Iterator[T]:
    """Go through so many things, and say before each how many are done."""
    for done, thing in enumerate(things):
        (progress or silent)(step, done, of)
        yield thing


def added_up(step: str, of: int, progress: Progress | None) -> Callable[[int], None]:
    """Return what is told how much more is done of a step, and says how much that is in all."""
    done = 0

    def told(more: int) -> None:
        nonlocal done
        done = min(done + more, of)
        (progress or silent)(step, done, of)

    return told


def _number(done: int, of: int) -> int:
    """Give the number of the part that is on its way: the last one where all are done."""
    return min(done + 1, max(of, 1))


class _Clock:
    """How long a count that is on its way still lasts, if all its parts take as long as those that are done."""

    def __init__(self) -> None:
        self.begun, self.share = time.monotonic(), 0.0

    def left(self, done: int, of: int) -> str:
        """Give the time left in words, empty below `WORTH` seconds and where nothing is done yet."""
        now, share = time.monotonic(), min(done / max(of, 1), 1.0)
        if share <= 0.0 or share < self.share:  # it counts anew
            self.begun = now
        self.share = share
        seconds = (now - self.begun) * (1.0 - share) / share if share else 0.0
        if seconds < WORTH:
            return ""
        return (
            f", about {seconds:.0f} s left" if seconds < 100.0 else f", about {seconds / 60.0:.0f} min left"
        )


class _Lines:
    """A line for a step that lasts: at once where the last line is two seconds old, else as soon as it is."""

    def __init__(self) -> None:
        self.last, self.timer, self.clock = time.monotonic(), threading.Timer(0.0, print), _Clock()

    def tell(self, step: str, done: int, of: int) -> None:
        self.stop()
        text = f"limitsets: {step}{self.clock.left(done, of)} ({_number(done, of)} of {max(of, 1)})"
        self.timer = threading.Timer(max(self.last + PATIENCE - time.monotonic(), 0.0), self._say, (text,))
        self.timer.daemon = True
        self.timer.start()

    def stop(self) -> None:
        self.timer.cancel()
        if self.timer.is_alive():  # it may be printing: not after the command is over
            self.timer.join()

    def _say(self, text: str) -> None:
        self.last = time.monotonic()
        print(text, file=sys.stderr, flush=True)


class _Notebook:
    """A bar under the cell, from the second second on until the answer is there."""

    def __init__(self) -> None:
        self.begun, self.clock, self.state = time.monotonic(), _Clock(), ("", 0, 1, "")
        self.handle: Any = None
        self.painted, self.over, self.lock = 0.0, False, threading.Lock()
        self.timer = threading.Timer(PATIENCE, self._paint)
        self.timer.daemon = True
        self.timer.start()

    def tell(self, step: str, done: int, of: int) -> None:
        self.state = (step, done, of, self.clock.left(done, of))
        if self.handle is not None and time.monotonic() - self.painted > PAINTED:
            self._paint()

    def stop(self) -> None:
        self.timer.cancel()
        with self.lock:
            self.over = True
            if self.handle is not None:
                self.handle.update(_html(""))

    def _paint(self) -> None:
        from IPython.display import display

        step, done, of, left = self.state
        seconds = time.monotonic() - self.begun
        text = (
            f'<progress value="{done}" max="{max(of, 1)}"></progress> '
            f"{escape(step)} ({_number(done, of)} of {max(of, 1)}), {seconds:.0f} s{left}"
        )
        with self.lock:
            self.painted = time.monotonic()
            if self.over:
                return
            if self.handle is None:
                self.handle = display(_html(text), display_id=True)  # type: ignore[no-untyped-call]  # IPython has no types
            else:
                self.handle.update(_html(text))


def _html(text: str) -> Any:
    from IPython.display import HTML

    return HTML(text)  # type: ignore[no-untyped-call]  # IPython has no types


def in_notebook() -> bool:
    """Whether a notebook's kernel runs this."""
    shell = sys.modules.get("IPython")
    here = None if shell is None else shell.get_ipython()
    return getattr(here, "kernel", None) is not None


@contextmanager
def bar() -> Iterator[Progress]:
    """Show steps: in a notebook under its cell, else on stderr, a bar on a terminal.

    Yields
    ------
    callable
        To be told ``(step, done, of)``.
    """
    shown: _Notebook | _Lines
    if not in_notebook() and sys.stderr.isatty():
        with _on_terminal() as tell:
            yield tell
        return
    shown = _Notebook() if in_notebook() else _Lines()
    try:
        yield shown.tell
    finally:
        shown.stop()


@contextmanager
def _on_terminal() -> Iterator[Progress]:
    from rich.console import Console
    from rich.markup import escape as plain
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[number]} of {task.total:.0f}"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        tasks, so_far = [shown.add_task("reading", total=1, number=1, left="")], 0.0
        clock = _Clock()

        def tell(step: str, done: int, of: int) -> None:
            nonlocal so_far
            note = " (a first run compiles: up to half a minute)" if step == "transitions" else ""
            number, total = _number(done, of), max(of, 1)
            share = min(done / total, 1.0)
            if share < so_far:  # a step that counts anew has a bar of its own, under those that are over
                ended = shown.tasks[-1].total
                shown.update(tasks[-1], completed=ended, number=int(ended or 1), left="")
                shown.stop_task(tasks[-1])
                tasks.append(shown.add_task("", total=total, number=number, left=""))
                shown.update(tasks[-BARS - 1], visible=False) if len(tasks) > BARS else None
            so_far = share
            shown.update(
                tasks[-1],
                description=plain(step) + note,
                completed=min(done, total),
                total=total,
                number=number,
                left=clock.left(done, of).lstrip(", "),
            )

        yield tell


_busy = threading.local()


def shown_in_notebooks(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function that takes `progress` show a bar in a notebook, where its caller gives none.

    Of functions that call each other, the outermost shows one.
    """

    @wraps(function)
    def with_bar(*args: P.args, **kwargs: P.kwargs) -> R:
        if kwargs.get("progress") is not None or getattr(_busy, "now", False) or not in_notebook():
            return function(*args, **kwargs)
        _busy.now = True
        try:
            with bar() as tell:
                kwargs["progress"] = tell
                return function(*args, **kwargs)
        finally:
            _busy.now = False

    return with_bar
