"""Output of commands: JSON or tables on stdout, files that are replaced whole, progress on stderr."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from limitsets.errors import LimitsetsError
from limitsets.files import as_json, replaced

if TYPE_CHECKING:
    from limitsets.scene import Scene as SceneOf

__all__ = [
    "Json",
    "Out",
    "Scene",
    "Words",
    "answer",
    "opened",
    "option",
    "progress",
    "save_scene",
    "saved",
    "show_scene",
    "table",
]

Words: TypeAlias = list[str] | None


def option(flags: str, metavar: str, help: str, **limits: Any) -> Any:  # noqa: A002 - typer's word
    """Declare an option that takes a value."""
    return typer.Option(*flags.split(), metavar=metavar, help=help, **limits)


Scene = Annotated[
    str, typer.Argument(metavar="SCENE", help="A built-in name (see: limitsets scenes) or a TOML file.")
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else, on stdout.")]
Out = Annotated[Path | None, option("--out -o", "FILE", "Write the JSON to this file as well.")]

# What takes longer than this says what it is doing.
PATIENCE = 2.0


def table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table, wide enough for its text where nobody looks at it on a terminal."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    grid = Table(box=SIMPLE_HEAD, pad_edge=False)
    for head in heads:
        grid.add_column(escape(head), no_wrap=not sys.stdout.isatty())
    for row in rows:
        grid.add_row(*(escape(str(cell)) for cell in row))
    Console(width=None if sys.stdout.isatty() else 200).print(grid)


def opened(scene: str, out: Path | None, word: str = "") -> tuple[SceneOf, Path]:
    """Load a scene; a folder, by default NAME-WORD, that cannot be written is refused before anything is computed."""
    from limitsets.scene import load

    chosen = load(scene)
    folder = out or Path(f"{chosen.name}-{word}")
    if out or word:
        from limitsets.report.writing import require_place

        require_place(folder)
    return chosen, folder


@contextmanager
def saved(file: Path) -> Iterator[Path]:
    """Write one file whole: a draft to write to, which takes its place at the end."""
    if file.exists() and not file.is_file():
        raise LimitsetsError(
            "the output file", str(file), "a regular file", "it is a folder or a device; name a file"
        )
    try:
        with replaced(file.parent) as draft:
            yield draft / file.name
    except OSError as error:
        reason = error.strerror or str(error)
        raise LimitsetsError(
            "the output file", str(file), "a place that can be written", f"it could not be: {reason}"
        ) from None


def answer(record: Any, json: bool, text: Callable[[], None], out: Path | None = None) -> None:
    """Give an answer as JSON or as text, and write it to a file where one is named."""
    words = as_json(record)
    if out is not None:
        with saved(out) as draft:
            draft.write_text(words, encoding="utf-8", newline="\n")
    if json:
        print(words, end="")
    else:
        text()


def save_scene(scene: SceneOf, file: Path) -> list[Path]:
    """Write the scene alone."""
    from limitsets.scene import dump

    with saved(file) as draft:
        draft.write_text(dump(scene), encoding="utf-8", newline="\n")
    return [file]


def show_scene(scene: SceneOf, files: list[Path]) -> None:
    """Say where the scene is, or print it where it is in no file."""
    from limitsets.scene import dump

    typer.echo(f"scene: {files[0]}" if files else "\n" + dump(scene).rstrip("\n"))


class _Lines:
    """A line for a step that lasts: at once where the last line is two seconds old, else as soon as it is."""

    def __init__(self) -> None:
        self.last, self.timer = time.monotonic(), threading.Timer(0.0, print)

    def tell(self, step: str, done: int, of: int) -> None:
        self.stop()
        text = f"limitsets: {step} ({done + 1} of {of})"
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


class _Interrupts:
    """Ctrl-C, remembered: raised inside a callback of somebody else's C code an exception may be lost on the way.

    The next step raises it again, so that no file is replaced after it.
    """

    def __init__(self) -> None:
        self.pressed = False

    def __call__(self, *_: object) -> None:
        self.pressed = True
        raise KeyboardInterrupt

    def check(self) -> None:
        if self.pressed:
            raise KeyboardInterrupt


@contextmanager
def progress() -> Iterator[Callable[[str, int, int], None]]:
    """Show steps on stderr: a bar on a terminal, elsewhere a line for what takes over two seconds."""
    interrupts = _Interrupts()
    ours = (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )
    if ours:
        signal.signal(signal.SIGINT, interrupts)
    try:
        with _shown() as show:

            def tell(step: str, done: int, of: int) -> None:
                interrupts.check()
                show(step, done, of)

            yield tell
    finally:
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)
    interrupts.check()


@contextmanager
def _shown() -> Iterator[Callable[[str, int, int], None]]:
    if not sys.stderr.isatty():
        lines = _Lines()
        try:
            yield lines.tell
        finally:
            lines.stop()
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading")

        def show(step: str, done: int, of: int) -> None:
            note = " (a first run compiles: up to half a minute)" if step == "transitions" else ""
            bar.update(task, description=step + note, completed=done, total=of)

        yield show
