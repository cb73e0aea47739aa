"""Commands that an answer proposes: they run as they stand, in the shell and folder of whoever reads them."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from shlex import quote


def proposed(*words: object) -> str:
    """Write a command of this package, by the program as the user started it, its words quoted for the shell.

    Parameters
    ----------
    *words : object
        The command and what follows it.

    Examples
    --------
    >>> proposed("certify", "my part.toml", "--cells", 512)
    "limitsets certify 'my part.toml' --cells 512"
    """
    return " ".join([_program(), *(quote(str(word)) for word in words)])


def _program() -> str:
    """Name the program that runs: the command, or Python with the package; the command where neither runs."""
    started = Path(sys.argv[0])
    if started.name == "__main__.py" and started.parent.name == "limitsets":
        return f"{_typed(Path(sys.executable))} -m limitsets"
    return _typed(started) if started.stem == "limitsets" else "limitsets"


def _typed(program: Path) -> str:
    """Write the path of a program as short as a shell takes it from the present folder."""
    if shutil.which(program.name) == str(program):
        return program.name
    here = Path.cwd()
    return quote(str(program.relative_to(here) if program.is_relative_to(here) else program))
