"""Output of commands: JSON or tables on stdout, files that are replaced whole, progress on stderr."""

from __future__ import annotations

import atexit
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from enum import StrEnum
from json import loads
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from limitsets.base.errors import LimitsetsError
from limitsets.base.files import as_json, locked, replaced
from limitsets.base.progress import InterruptedRun, bar
from limitsets.base.tables import aligned

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from limitsets.base.tables import Table
    from limitsets.face.cli.about import About
    from limitsets.feeder.scene import Scene as SceneOf


Words: TypeAlias = list[str] | None

# Folders that this process locks until it ends.
_LOCKED: set[Path] = set()
_LOCKS = ExitStack()
atexit.register(_LOCKS.close)


def option(flags: str, metavar: str, help: str, **limits: Any) -> Any:  # noqa: A002 - typer's word
    """Declare an option that takes a value."""
    return typer.Option(*flags.split(), metavar=metavar, help=help, **limits)


def _names(begun: str) -> list[str]:
    """Give the built-in scenes for the shell's completion; the shell adds files if no scene fits."""
    from limitsets.feeder.scene import scenes

    return [name for name in scenes() if name.startswith(begun)]


Scene = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help="A built-in name (see: limitsets scenes) or a TOML file.",
        autocompletion=_names,
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON, and nothing else, on stdout.")]
Html = Annotated[
    bool, typer.Option("--html", help="Write report.html too: the report in one file, figures inside.")
]
Out = Annotated[Path | None, option("--out -o", "FILE", "Write the JSON to this file as well.")]


class Form(StrEnum):
    """Of a picture."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


Format = Annotated[Form, option("--format", "FORMAT", "Of the figures: png, svg or pdf.")]


def _require_file(file: Path | None) -> Path | None:
    """Refuse a file that clearly cannot be written, before the computation begins."""
    if file is not None and file.is_dir():
        raise LimitsetsError("the table's file", str(file), "a regular file", "it is a folder; name a file")
    if file is not None and not file.parent.is_dir():
        raise LimitsetsError(
            "the table's file",
            str(file),
            "a file in a folder that is there",
            "make the folder, or name another",
        )
    return file


Csv = Annotated[
    Path | None,
    option(
        "--csv",
        "FILE",
        "Write the table as CSV: units in the head, numbers in full.",
        callback=_require_file,
    ),
]


# Width of a line in a pipe: larger than that of any table.
LONGEST = 100_000

# Longer tables are printed without rich, which takes a second for four thousand rows.
LONG = 500


def table(heads: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print a table; outside a terminal its columns are as wide as their text."""
    if len(rows) > LONG:
        print("\n".join(aligned(heads, [[str(cell) for cell in row] for row in rows])))
        return
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    # rich reads the width from the terminal or COLUMNS; without either, lines are not broken
    told = sys.stdout.isatty() or bool(os.environ.get("COLUMNS"))
    grid = Table(box=SIMPLE_HEAD, pad_edge=False)
    for number, head in enumerate(heads):
        # names are not broken if other columns can be: two names could look alike when cut
        names = number == 0 and not any(" " in str(row[0]) for row in rows)
        grid.add_column(escape(head), no_wrap=names or not told, overflow="fold")
    for row in rows:
        grid.add_row(*(escape(str(cell)) for cell in row))
    Console(width=None if told else LONGEST).print(grid)


def show(listing: Table) -> None:
    """Print a table of an answer, its numbers rounded."""
    table(listing.heads, listing.shown())


def opened(
    scene: str, out: Path | None, word: str = "", read: Callable[[str], SceneOf] | None = None
) -> tuple[SceneOf, Path]:
    """Load a scene; refuse a folder, by default NAME-WORD, that cannot be written, before the computation begins.

    `read` loads the scene instead of `limitsets.load`.
    """
    from limitsets.feeder.scene import load

    chosen = (read or load)(scene)
    folder = out or Path(f"{stem_of(chosen)}-{word}")
    if out or word:
        from limitsets.face.report.writing import require_place

        require_place(folder)
        _keep(folder)
        _require_own(folder, chosen)
    return chosen, folder


def _keep(folder: Path) -> None:
    """Lock a folder for this process until it ends."""
    place = folder.resolve()
    if place not in _LOCKED:
        _LOCKS.enter_context(locked(place))
        _LOCKED.add(place)


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
        reason = error.strerror or str(error)
        raise LimitsetsError(
            "the output file", str(file), "a place that can be written", f"it could not be: {reason}"
        ) from None


def answer(
    record: Any,
    json: bool,
    text: Callable[[], None],
    out: Path | None = None,
    csv: tuple[Path | None, Callable[[], Table]] | None = None,
    about: About | None = None,
) -> None:
    """Print an answer as JSON or as text; write it to a file, and its table as CSV, if these are given.

    The text ends with the model of the verdict (`about`); its broken assumptions are computed after the answer is out.
    """
    words = as_json(about.added(record) if json and about is not None else record)
    if csv is not None and csv[0] is not None:
        with saved(csv[0]) as draft:
            draft.write_text(csv[1]().csv(), encoding="utf-8", newline="")
    if out is not None:
        with saved(out) as draft:
            draft.write_text(words, encoding="utf-8", newline="\n")
    if json:
        print(words, end="")
    else:
        text()
        if about is not None:
            sys.stdout.flush()  # printed before the audit, which takes time
            with progress() as tell:
                tell("assumptions on the limit set", 0, 1)
                said = about.line()
            typer.echo(said)


def scene_file(scene: SceneOf, out: Path | None) -> str:
    """Name the file of a design, from `out`; empty if none is written."""
    return "" if out is None else str(out if out.suffix == ".toml" else out / f"{scene.name}.toml")


def save_scene(scene: SceneOf, file: Path) -> list[Path]:
    """Write the scene alone."""
    from limitsets.feeder.scene import dump

    with saved(file) as draft:
        draft.write_text(dump(scene), encoding="utf-8", newline="\n")
    return [file]


def show_scene(scene: SceneOf, files: list[Path], about: About | None) -> None:
    """Name the file of a design, or print the design if there is no file; say so if it is a near miss only.

    Parameters
    ----------
    scene : Scene
        The design.
    files : list of Path
        Written files, with the scene.
    about : About or None
        The model of the design; None for a near miss, for which nothing is printed that looks like an answer.
    """
    from limitsets.feeder.scene import dump

    file = next((str(path) for path in files if path.suffix == ".toml"), None)
    if about is not None:
        typer.echo(about.line())
    elif file is None:
        typer.echo("the values above are the nearest miss, no answer; add -o FILE.toml to save that scene")
        return
    if file is not None:
        typer.echo(f"scene: {file}" + ("" if about else " (the nearest miss, no answer)"))
        return
    typer.echo(f"scene (add -o {quote(f'{scene.name}.toml')} to save it):\n\n{dump(scene)}".rstrip("\n"))


class _Interrupts:
    """Remember Ctrl-C: an exception raised inside a callback from foreign C code may be lost.

    The next step raises it again, so that no file is replaced after it; an error that comes of it is it, and Python's
    words on what was lost are not shown.
    """

    def __init__(self) -> None:
        self.pressed = False
        self.told_before = sys.unraisablehook

    def lost(self, found: sys.UnraisableHookArgs) -> None:
        """Hear of an exception that could not be raised."""
        if not self.pressed:
            self.told_before(found)

    def __call__(self, *_: object) -> None:
        self.pressed = True
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
