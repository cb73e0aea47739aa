"""Output of commands: JSON or tables on stdout, files that are replaced whole, progress on stderr."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from json import loads
from pathlib import Path
from typing import TYPE_CHECKING

from limitsets.base import InterruptedRun, LimitsetsError, aligned, bar, locked, replaced

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from limitsets.base.tables import Table
    from limitsets.feeder.scene import Scene as SceneOf


# Locks of folders, held until this process ends.
_LOCKS = ExitStack()
atexit.register(_LOCKS.close)


@cache
def _lock(folder: Path) -> None:
    """Lock a folder, once."""
    _LOCKS.enter_context(locked(folder))


# Width of a line in a pipe: larger than that of any table.
LONGEST = 100_000

# Longer tables are printed without rich, which takes a second for four thousand rows.
LONG = 500


def show(listing: Table) -> None:
    """Print a table, its numbers rounded; outside a terminal its columns are as wide as their text."""
    heads, rows = listing.heads, listing.shown()
    if len(rows) > LONG:
        print("\n".join(aligned(heads, rows)))
        return
    from rich import box, console, markup, table

    # rich reads the width from the terminal or COLUMNS; without either, lines are not broken
    fitted = sys.stdout.isatty() or bool(os.environ.get("COLUMNS"))
    grid = table.Table(box=box.SIMPLE_HEAD, pad_edge=False)
    # names are not broken if other columns can be: two names could look alike when cut
    whole = not any(" " in row[0] for row in rows)
    for number, head in enumerate(heads):
        grid.add_column(markup.escape(head), no_wrap=not fitted or (number == 0 and whole), overflow="fold")
    for row in rows:
        grid.add_row(*map(markup.escape, row))
    console.Console(width=None if fitted else LONGEST).print(grid)


def place_for(scene: SceneOf, folder: Path) -> None:
    """Keep a folder for a scene's report until the process ends; refuse one that cannot be, or is another scene's."""
    from limitsets.face.report.writing import require_place

    require_place(folder)
    _lock(folder.resolve())
    _require_own(folder, scene)


def stem_of(scene: SceneOf) -> str:
    """Give the stem for names of a scene's output: that of its file, or the name of a built-in scene.

    Examples
    --------
    >>> import limitsets as ls
    >>> stem_of(ls.load("paper-designed"))
    'paper-designed'
    """
    return Path(scene.file).stem if scene.file and scene.file.endswith(".toml") else scene.name


def _require_own(folder: Path, scene: SceneOf) -> None:
    """Refuse a folder with the report of another scene; warn if the report is of this scene with other values."""
    for file in sorted(folder.glob("*.json")):
        record = {}
        with suppress(OSError, ValueError, TypeError, KeyError):
            record = dict(loads(file.read_text(encoding="utf-8"))["scene"])
        if record:
            refuse_other("the report", folder, str(record.get("name")), scene)
        if record and record != scene.as_dict():
            say_other("the report", folder, scene.name)
            return


def refuse_other(what: str, place: Path, name: str, scene: SceneOf) -> None:
    """Refuse a place that holds what is of a scene of another name."""
    if name != scene.name:
        remedy = f"it is of {name}; name another with --out, or delete it"
        raise LimitsetsError(f"the place of {what}", str(place), f"one of {scene.name}, or a new one", remedy)


def say_other(what: str, place: Path, name: str) -> None:
    """Say that what is of other values of this scene is replaced: whoever edits a scene wants the new answer."""
    print(f"limitsets: {place}: {what} of {name} with other values is replaced", file=sys.stderr, flush=True)


@contextmanager
def saved(file: Path) -> Iterator[Path]:
    """Give a draft to write to, which replaces the file at the end."""
    if file.exists() and not file.is_file():
        raise LimitsetsError(
            "the output file", str(file), "a regular file", "it is a folder or a device; name a file"
        )
    try:
        with replaced(file.parent) as draft:
            yield draft / file.name
    except OSError as error:
        reason = f"it could not be: {error.strerror or error}"
        raise LimitsetsError("the output file", str(file), "a place that can be written", reason) from None


class _Interrupts:
    """Remember Ctrl-C: an exception raised inside a callback from foreign C code may be lost.

    The next step raises it again, so that no file is replaced after it; an error that comes of it is it, and Python's
    words on what was lost are not shown. While numba compiles, the first Ctrl-C waits for the next step: LLVM's
    objects half built make the process crash.
    """

    def __init__(self) -> None:
        self.pressed = False
        self.told_before = sys.unraisablehook

    def lost(self, found: sys.UnraisableHookArgs) -> None:
        """Hear of an exception that could not be raised."""
        if not self.pressed:
            self.told_before(found)

    def __call__(self, *_: object) -> None:
        again, self.pressed = self.pressed, True
        compiler = sys.modules.get("numba.core.compiler_lock")
        if again or compiler is None or not compiler.global_compiler_lock.is_locked():
            raise KeyboardInterrupt

    def check(self) -> None:
        if self.pressed:
            raise KeyboardInterrupt


@contextmanager
def processes(workers: int | None) -> Iterator[Executor | None]:
    """Start processes as tasks come, by default one per core; give None if a single process is enough."""
    from limitsets.base.campaign import Processes, present_cores

    count = workers or present_cores()
    if count == 1:
        yield None
        return
    pool = Processes(count)
    try:
        yield pool
    except BaseException:  # their answers are not needed any more
        pool.abandon()
        raise
    pool.end()


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show steps on stderr: a bar on a terminal, elsewhere a line for each step that takes over two seconds."""
    interrupts = _Interrupts()
    ours = (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if ours:
        signal.signal(signal.SIGINT, interrupts)
        sys.unraisablehook = interrupts.lost
    try:
        with bar() as shown:

            def tell(step: str, done: int, of: int) -> None:
                interrupts.check()
                shown(step, done, of)

            yield tell
    except KeyboardInterrupt as error:
        if notes := getattr(error, "__notes__", ()):
            raise InterruptedRun("; ".join(notes)) from None
        raise
    except Exception:
        interrupts.check()
        raise
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sys.unraisablehook = interrupts.told_before
    interrupts.check()
