"""`limitsets doctor`: what is installed, and where the compiled code lies."""

from __future__ import annotations

import platform
import re
import shutil
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import Annotated, Any

import typer

from limitsets.cli.output import Csv, Json, Out, answer, show
from limitsets.errors import LimitsetsError
from limitsets.tables import Table

# Extras that only whoever works on the package itself needs.
INNER = ("bench", "dev")

_REQUIREMENT = re.compile(r"""([A-Za-z0-9._-]+)[^;]*(?:;.*\bextra\s*==\s*["']([^"']+)["'])?""")


def doctor(
    clear: Annotated[
        bool, typer.Option("--clear", help="Delete the compiled code; the next run compiles.")
    ] = False,
    out: Out = None,
    csv: Csv = None,
    json: Json = False,
) -> None:
    """Say what is installed, which extras are missing and how to get them, and where the compiled code lies.

    Exit 1 where a package is missing that every command needs.
    """
    packages = _packages()
    missing = sorted({each["extra"] for each in packages if each["version"] is None and each["extra"]})
    lost = [each["package"] for each in packages if each["version"] is None and not each["extra"]]
    from limitsets import __version__

    record = {
        "limitsets": __version__,
        "folder": str(Path(__file__).parents[1]),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": packages,
        "missing": lost,
        "missing_extras": {extra: f"pip install 'limitsets[{extra}]'" for extra in missing},
        "cache": _cache(clear=clear),
    }
    rows = [
        (each["package"], each["version"] or "missing", each["extra"] or "everything") for each in packages
    ]
    table = Table(("package", "version", "needed for"), rows, "Packages")
    answer(record, json, lambda: _text(record, table), out, (csv, lambda: table))
    raise typer.Exit(1 if lost else 0)


def _packages() -> list[dict[str, str | None]]:
    """List what the package asks for, each with the version that is there, and the extra that needs it."""
    try:
        lines = requires("limitsets") or []
    except PackageNotFoundError:  # a folder on the path, not installed
        return []
    found: list[dict[str, str | None]] = []
    for line in lines:
        match = _REQUIREMENT.match(line)
        if match is None or match[2] in INNER or match[1] == "limitsets":
            continue
        try:
            there: str | None = version(match[1])
        except PackageNotFoundError:
            there = None
        found.append({"package": match[1], "version": there, "extra": match[2]})
    return found


def _cache(*, clear: bool) -> dict[str, Any]:
    """Measure the folder of the compiled code, and delete it if asked."""
    try:
        from limitsets.jit.cache import FOLDER
    except ImportError as error:  # numba is missing or broken
        return {"folder": None, "bytes": 0, "versions": 0, "cleared": False, "reason": str(error)}
    if FOLDER is None:
        return {"folder": None, "bytes": 0, "versions": 0, "cleared": False, "reason": "it cannot be written"}
    root = FOLDER.parent
    files = [each for each in root.rglob("*") if each.is_file()]
    found = {
        "folder": str(root),
        "bytes": sum(each.stat().st_size for each in files),
        "versions": sum(each.is_dir() for each in root.iterdir()),
        "cleared": clear,
        "reason": None,
    }
    if clear:
        try:
            shutil.rmtree(root)
        except OSError as error:
            raise LimitsetsError(
                "the compiled code",
                str(root),
                "a folder that can be deleted",
                f"it could not be: {error.strerror}",
            ) from None
    return found


def _text(record: dict[str, Any], table: Table) -> None:
    typer.echo(f"limitsets {record['limitsets']} in {record['folder']}")
    typer.echo(f"Python {record['python']}, {record['platform']}")
    if table.rows:
        show(table)
    else:
        typer.echo("it is not installed, but found on the path: what it needs is not listed")
    for package in record["missing"]:
        typer.echo(f"missing, and needed by every command: pip install {package}")
    for extra, line in record["missing_extras"].items():
        typer.echo(f"extra {extra} is missing: {line}")
    cache = record["cache"]
    if cache["folder"] is None:
        typer.echo(f"compiled code is not kept: {cache['reason']}")
        return
    size = f"{cache['bytes'] / 1e6:.3g} MB of {cache['versions']} versions of the source"
    done = "deleted: " if cache["cleared"] else ""
    typer.echo(f"compiled code: {done}{size} in {cache['folder']}")
    if not cache["cleared"]:
        typer.echo("limitsets doctor --clear deletes it; the next run compiles for about half a minute")
