"""The commands, the options they share, and errors as one line on stderr with an exit code."""

from __future__ import annotations

import contextlib
import difflib
import gc
import io
import os
import re
import signal
import sys
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer

from limitsets.base import InterruptedRun, LimitsetsError
from limitsets.face.cli import (
    absorption,
    analyse,
    average,
    cell,
    certify,
    design,
    feedback,
    film,
    margin,
    part,
    scenes,
    throw,
)
from limitsets.face.cli.commands import COMMANDS

app = typer.Typer(
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
)


def _version(wanted: bool) -> None:
    if wanted:
        from limitsets import __version__

        typer.echo(f"limitsets {__version__}")
        raise typer.Exit


@app.callback()
def limitsets(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    """Where do the throws lead?  Limit sets, attractors and basins of a throw-and-catch parts feeder.

    SCENE is the name of a built-in scene or the path of a TOML file.
    """


for file in (
    scenes,
    part,
    analyse,
    throw,
    certify,
    average,
    absorption,
    margin,
    design,
    cell,
    feedback,
    film,
):
    for command in COMMANDS[file.__name__]:
        # click would cut the summary where a line ends
        app.command(short_help=(command.__doc__ or "").partition("\n")[0])(command)


# ----------------------------------------------------------------
# Around every command: every error ends in one line on stderr and an exit code, never in a traceback.


BAD_INPUT, INTERRUPTED = 2, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Instead of those of the process.

    Returns
    -------
    int
        The exit code.

    Examples
    --------
    >>> main(["scenes", "--json", "--out", "/dev/null/x"])  # the reason goes to stderr
    2
    """
    # a command ends before its garbage matters, and is 5 to 8 % faster without collection
    if arguments is None:
        gc.disable()
        # a signal ends the command as Ctrl-C does: unfinished files are removed
        for name in ("SIGTERM", "SIGHUP"):
            if number := getattr(signal, name, None):
                signal.signal(number, _ended)
    try:
        _ready_streams()
        code = _run(arguments)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _end("interrupted", INTERRUPTED)
    except InterruptedRun as error:
        return _end(f"interrupted; {error}", INTERRUPTED)
    except (BrokenPipeError, SystemExit) as error:
        if not isinstance(error if isinstance(error, OSError) else error.__context__, BrokenPipeError):
            raise
        # The reader has closed the pipe; flushing the rest of the buffer must not fail again when Python exits.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 0
    except LimitsetsError as error:
        return _end(str(error), BAD_INPUT)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        return _end(f"{place}{error.strerror or error}", BAD_INPUT)
    except MemoryError:
        return _end("not enough memory: ask for fewer cells or throws", BAD_INPUT)
    except Exception as error:  # a bug; `python -X dev -m limitsets` shows where
        if sys.flags.dev_mode:
            raise
        return _end(f"this is a bug in limitsets: {type(error).__name__}: {error}", BAD_INPUT)
    return code


def _ended(number: int, _: object) -> None:
    """Raise, so that every `with` block is left; the signal alone would not leave them."""
    raise SystemExit(128 + number)


def _ready_streams() -> None:
    """Prepare the streams: neither a closed one nor a character that the terminal lacks stops a command."""
    sys.stdout = sys.stdout or Path(os.devnull).open("w")  # noqa: SIM115 - it lives as long as the process
    sys.stderr = sys.stderr or Path(os.devnull).open("w")  # noqa: SIM115 - likewise
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")


def _end(reason: str, code: int) -> int:
    with contextlib.suppress(OSError):  # stderr may be closed
        print("limitsets:", " ".join(reason.split()), file=sys.stderr, flush=True)
    return code


def _run(arguments: Sequence[str] | None) -> int:
    usage_error: Any = typer.BadParameter.__base__
    refused: Any = usage_error.__base__
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(words or ["--help"], prog_name="limitsets", standalone_mode=False)
    except typer.Abort:
        raise KeyboardInterrupt from None
    except refused as error:
        usage: Any = error
        of = usage.ctx.command_path if isinstance(error, usage_error) and usage.ctx else "limitsets"
        hint = f"; {of} --help lists what there is" if isinstance(error, usage_error) else ""
        return _end(f"{_plain(error.format_message().rstrip('.'), words)}{hint}", BAD_INPUT)
    if code == INTERRUPTED:  # typer's word for Ctrl-C
        raise KeyboardInterrupt
    return code if isinstance(code, int) else 0


def _plain(message: str, words: Sequence[str]) -> str:
    """Put a message of the parser into the words of this package, with the given value and the nearest right one.

    Examples
    --------
    >>> words = ["--side", "two"]
    >>> _plain("Invalid value for '--side': Input should be a valid integer, unable to parse string", words)
    "Invalid value for '--side': 'two' is not a whole number"
    """
    kinds = {"integer": "a whole number", "number": "a number", "boolean": "true or false"}
    about, colon, reason = message.partition(": ")
    if match := re.match(r"Input should be a valid (integer|number|boolean)", reason):
        name = next(iter(re.findall(r"'(--?[\w-]+)'", about)), "")
        given = next((after for word, after in pairwise(words) if word == name), "")
        return f"{about}{colon}{repr(given) + ' is not' if given else 'it is not'} {kinds[match[1]]}"
    reason = reason.removeprefix("Value error, ")
    if match := re.match(r"'([^']*)' is not one of (.*)", reason):
        (near,) = difflib.get_close_matches(match[1], re.findall(r"'([^']*)'", match[2]), n=1, cutoff=0.0)
        return f"{about}{colon}{reason}; did you mean {near!r}?"
    value_set = next((word for word in words if re.fullmatch(r"[a-z][\w.\[\]]*=[^=]+", word)), None)
    if value_set and about.startswith(("Got unexpected extra argument", "No such option")):
        name, _, value = value_set.partition("=")
        value = f"{value} UNIT" if value.replace(".", "", 1).isdigit() else value
        way = f"write it into the scene's file, or in Python scene.with_values({{{name!r}: {value!r}}})"
        return f"{message}; a command takes the quantities of a scene as they stand: {way}"
    return message
