"""A command from a function: the options that all share, the run of one, and how its answer is printed and written.

A command is a function of a `Run` and its own options that gives an `Answer`, under `@command`.  Its options come from
its annotations, its help and theirs from its docstring; positional parameters are arguments.  Options that all have
(--out, --format, --html, --csv, --json) are added here, and what they ask for is done here.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from functools import cached_property
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_args, get_origin

import typer

import limitsets as ls
from limitsets.base import LimitsetsError, Table, as_json, as_plain
from limitsets.face import report
from limitsets.face.cli.output import place_for, progress, saved, show, stem_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from limitsets.base.progress import Progress
    from limitsets.feeder.scene import Model, Scene as SceneOf


# ----------------------------------------------------------------
# Options that several commands have: their kinds, and what is said of them where the command's docstring does not.


def _names(begun: str) -> list[str]:
    """Give the built-in scenes for the shell's completion; the shell adds files if no scene fits."""
    return [name for name in ls.scenes() if name.startswith(begun)]


def _require_file(file: Path | None) -> Path | None:
    """Refuse a file that clearly cannot be written, before the computation begins."""
    if file is not None and file.is_dir():
        raise LimitsetsError("the table's file", str(file), "a regular file", "it is a folder; name a file")
    if file is not None and not file.parent.is_dir():
        allowed, remedy = "a file in a folder that is there", "make the folder, or name another"
        raise LimitsetsError("the table's file", str(file), allowed, remedy)
    return file


class Form(StrEnum):
    """Of a picture."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"


def limits(**ends: float) -> dict[str, float]:
    """Give the least and the largest value of an option."""
    return ends


Words: TypeAlias = list[str] | None
Scene = Annotated[str, {"autocompletion": _names}]
Seed = Annotated[int, limits(min=0)]

_OUT = Parameter("out", Parameter.KEYWORD_ONLY, annotation=Path | None, default=None)
_SHARED = {
    "out": _OUT,
    "html": _OUT.replace(name="html", annotation=bool, default=True),
    "form": _OUT.replace(name="form", annotation=Form, default=Form.PNG),
    "csv": _OUT.replace(name="csv", annotation=Annotated[Path | None, {"callback": _require_file}]),
    "json": _OUT.replace(name="json", annotation=bool, default=False),
}

_FLAGS = {
    "out": ("--out", "-o"),
    "html": ("--html/--no-html",),
    "form": ("--format",),
    "from_": ("--from",),
    "set_": ("--set",),
    "claim": ("--claim", "--claims"),
}

_LAID = (
    "Where parts are laid down, like 0=8:20 or 0='8 in:20 in'; repeatable. The goal's starts are these; "
    "default: the whole arm."
)

_DOCUMENTED = {
    "scene": ("SCENE", "A built-in name (see: limitsets scenes) or a TOML file."),
    "out": ("FILE", "Write the JSON to this file as well."),
    "html": ("", "Write report.html beside report.md: one file that stands alone, figures inside."),
    "form": ("FORMAT", "Of the figures: png, svg or pdf."),
    "csv": ("FILE", "Write the table as CSV: units in the head, numbers in full."),
    "json": ("", "Print JSON, and nothing else, on stdout."),
    "law": ("LAW", "Of --scatter: gaussian (standard deviations) or bounded."),
    "laid": ("SIDE=LO:HI", _LAID),
    "fitted": (
        "FIT.json",
        "The machine, how far off it may be, and its scatter: fit.json of limitsets fit -o DIR.",
    ),
    "no_recheck": ("", "Write certificates without checking them first."),
    "seed": ("N", "Of all random numbers."),
}


def _documented(text: str) -> tuple[str, dict[str, tuple[str, str]]]:
    """Split a docstring into the help and its parameters: what stands for the value, and the help of each."""
    about, _, section = inspect.cleandoc(text).partition("\n\nParameters\n----------\n")
    entries = re.findall(r"^(\w+)(?: : (.+))?\n((?:    .*\n?)+)", section, re.MULTILINE)
    return about, {name: (metavar, " ".join(words.split())) for name, metavar, words in entries}


def _declared(parameter: Parameter, metavar: str, words: str, more_flags: Sequence[str] = ()) -> Parameter:
    """Make an option of a parameter, or an argument of one that is positional."""
    kind, more = parameter.annotation, {}
    if get_origin(kind) is Annotated:
        kind, more = get_args(kind)
    if parameter.kind is Parameter.KEYWORD_ONLY:
        flags = _FLAGS.get(parameter.name, (f"--{parameter.name.replace('_', '-')}",))
        about = typer.Option(*flags, *more_flags, metavar=metavar or None, help=words, **more)
    else:
        about = typer.Argument(metavar=metavar, help=words, **more)
    return parameter.replace(kind=Parameter.KEYWORD_ONLY, annotation=Annotated[kind, about])


# ----------------------------------------------------------------
# The run of a command, and its answer.


@dataclass(frozen=True)
class About:
    """The model and the scene of an answer.

    Attributes
    ----------
    model : Model
        The model of the answer.
    name : str
        Name or file of the scene, as other commands take it.
    scene : Scene or None
        The scene, if the answer is to say which assumptions of the model it breaks; else None.
    """

    model: Model
    name: str
    scene: SceneOf | None = None

    @cached_property
    def audited(self) -> Model:
        """The model with the assumptions that break on the limit set, computed at the first use."""
        if self.scene is None or self.model.broken is not None:
            return self.model
        from limitsets.proofs.auditing import audited

        return audited(self.model, self.scene)

    def added(self, record: Any) -> Any:
        """Give an answer as plain tables for JSON, each with the model."""
        plain = as_plain(record)
        for each in plain if isinstance(plain, list) else [plain]:
            each["model"] = self.audited.to_json()
        return plain

    def line(self) -> str:
        """Give the line of text that names the model."""
        return self.audited.line(self.name)


@dataclass
class Run:
    """The shared options of a command as they are given, and what it has written.

    Attributes
    ----------
    tell : callable
        Called as ``tell(step, done, of)``.
    out : Path or None
        Of --out.
    form : str
        Of --format.
    html, json : bool
        Whether report.html is written, and whether --json is given.
    csv : Path or None
        Of --csv.
    files : list of Path
        What is written into the folder of --out.
    source : str
        The scene, as it is given.
    """

    tell: Progress
    out: Path | None = None
    form: str = Form.PNG
    html: bool = True
    csv: Path | None = None
    json: bool = False
    files: list[Path] = field(default_factory=list)
    source: str = ""

    @property
    def folder(self) -> Path:
        """That of --out, where it is given."""
        assert self.out is not None
        return self.out

    def opened(self, source: str, word: str = "", read: Callable[[str], SceneOf] | None = None) -> SceneOf:
        """Load a scene; refuse a folder that cannot be written, before the computation begins.

        With `word` the folder is NAME-WORD by default; `read` loads the scene instead of `limitsets.load`.
        """
        scene = (read or ls.load)(source)
        if word and self.out is None:
            self.out = Path(f"{stem_of(scene)}-{word}")
        if self.out is not None:
            place_for(scene, self.out)
        return scene

    def about(self, model: Model, scene: SceneOf | None = None) -> About:
        """Give the model of the answer; with `scene` it says which assumptions break there."""
        return About(model, self.source, scene)

    def write(self, drawn: Iterable[tuple[str, Figure]], texts: Mapping[str, Any]) -> None:
        """Write figures, and texts or answers as JSON, into the folder of --out, all of them or none."""
        whole = {name: text if isinstance(text, str) else as_json(text) for name, text in texts.items()}
        self.files = report.writing.laid(self.folder, drawn, lambda _: whole, self.form)


@dataclass(frozen=True)
class Answer:
    """What a command says.

    Attributes
    ----------
    record : object
        What is printed as JSON; a function is called for it.
    words : callable
        Gives the lines and tables of the text.
    table : callable or None
        Gives the table that --csv saves.
    code : int
        The exit code.
    about : About or None
        The model of the answer: its last line, and a key of its JSON.
    notes : sequence of str
        Lines for stderr.
    """

    record: Any
    words: Callable[[], Iterable[str | Table]]
    table: Callable[[], Table] | None = None
    code: int = 0
    about: About | None = None
    notes: Sequence[str] = ()


# The commands of each file.
COMMANDS: defaultdict[str, list[Callable[..., None]]] = defaultdict(list)


def command(
    *, out: bool | str = True, html: bool = False, form: bool = False, csv: bool = True, json: bool = True
) -> Callable[[Callable[..., Answer]], Callable[..., None]]:
    """Make a command of a function of a `Run`, with the shared options that are wanted here.

    What its docstring says of `out` is a folder, or a file of its own; else the file is that of the JSON.  Where `out`
    is a text, it is one more name of that option.
    """
    wanted = {"out": out, "html": html, "form": form, "csv": csv, "json": json}
    shared = [parameter for name, parameter in _SHARED.items() if wanted[name]]

    def of(function: Callable[..., Answer]) -> Callable[..., None]:
        about, own = _documented(function.__doc__ or "")
        words = _DOCUMENTED | own
        _, *parameters = inspect.signature(function, eval_str=True).parameters.values()

        def run(**options: Any) -> None:
            common = {parameter.name: options.pop(parameter.name) for parameter in shared}
            arguments = [options.pop(each.name) for each in parameters if each.kind is not each.KEYWORD_ONLY]
            with progress() as tell:
                state = Run(tell, **common, source=str(arguments[0]) if arguments else "")
                answer = function(state, *arguments, **options)
            _give(state, answer, None if "out" in own else state.out)
            raise typer.Exit(answer.code)

        none = "", ""  # under python -OO there are no docstrings
        also = {"out": [out]} if isinstance(out, str) else {}
        declared = [
            _declared(each, *words.get(each.name, none), also.get(each.name, ()))
            for each in (*parameters, *shared)
        ]
        vars(run)["__signature__"] = inspect.Signature(declared)
        run.__name__, run.__doc__, run.__annotations__ = function.__name__, about, {}
        COMMANDS[function.__module__].append(run)
        return run

    return of


def _give(run: Run, answer: Answer, file: Path | None) -> None:
    """Write the table and the JSON where these are asked for, and print the answer as JSON or as text.

    The text ends with the model of the verdict; its broken assumptions are computed after the answer is out.
    """
    record, about = "", answer.about
    if run.json or file is not None:
        content = answer.record() if callable(answer.record) else answer.record
        record = as_json(about.added(content) if run.json and about is not None else content)
    if run.csv is not None and answer.table is not None:
        with saved(run.csv) as draft:
            draft.write_text(answer.table().csv(), encoding="utf-8", newline="")
    if file is not None:
        with saved(file) as draft:
            draft.write_text(record, encoding="utf-8", newline="\n")
    for note in answer.notes:
        print(f"limitsets: {' '.join(note.split())}", file=sys.stderr, flush=True)
    if run.json:
        print(record, end="")
        return
    for part in answer.words():
        show(part) if isinstance(part, Table) else typer.echo(part)
    if run.files:
        names = ", ".join(file.name for file in run.files)
        page = run.files[0].suffix == ".md"
        typer.echo(f"report: {run.files[0]}" if page else f"written to {run.out}: {names}")
    if about is not None:
        sys.stdout.flush()  # printed before the audit, which takes time
        with progress() as tell:
            tell("assumptions on the limit set", 0, 1)
            line = about.line()
        typer.echo(line)
