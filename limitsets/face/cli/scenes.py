"""Commands about scenes and this installation: `scenes`, `new`, `check`, `doctor`, `explore`."""

from __future__ import annotations

import math
import platform
import re
import shutil
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from limitsets.base.errors import LimitsetsError
from limitsets.base.files import picked
from limitsets.base.proposals import proposed
from limitsets.base.tables import Column, Table
from limitsets.face.cli.output import Csv, Json, Out, Scene, answer, option, progress, show

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene as SceneOf


def scenes(out: Out = None, csv: Csv = None, json: Json = False) -> None:
    """List the built-in scenes."""
    from limitsets.feeder.scene import load
    from limitsets.feeder.scene import scenes as names

    records = [
        {
            "name": scene.name,
            "sides": len(scene.sides),
            "unit": scene.unit,
            "kappa": scene.kappa,
            "arm_length": scene.arm_length,
            "flight": scene.flight,
            "flip": scene.flip,
            "goal": None if scene.goal is None else scene.goal.kind,
        }
        for scene in map(load, names())
    ]

    columns = (
        "scene",
        "sides",
        Column("kappa", show=".6g"),
        Column("arm", show="g"),
        "unit",
        "flight",
        "flip",
        "goal",
    )
    words = ("name", "sides", "kappa", "arm_length", "unit", "flight", "flip", "goal")
    listing = Table(columns, [[record[word] for word in words] for record in records], "Built-in scenes")
    answer(records, json, lambda: show(listing), out, (csv, lambda: listing))


# ---------------------------------------------------------------- `limitsets new`: a scene to start from


def new(
    file: Annotated[
        Path, typer.Argument(metavar="FILE.toml", help="The file to write; it must not be there.")
    ],
    unit: Annotated[str, option("--unit", "UNIT", "Of its lengths: mm, cm, m, in, ...")] = "in",
    json: Json = False,
) -> None:
    """Write a scene to start from: every key that a scene may have, with what it means."""
    from limitsets.feeder.scene.checking import new_scene

    written = new_scene(file, unit)

    def text() -> None:
        typer.echo(f"scene: {written}")
        typer.echo(f"next: edit it, then {proposed('check', written)} and {proposed('analyse', written)}")

    answer({"scene": str(written)}, json, text)


# ----------------------------------------------------------------
# `limitsets check`: all errors of a scene at once.


WORDS = ("key", "thing", "value", "allowed", "remedy")


def check(scene: Scene, out: Out = None, csv: Csv = None, json: Json = False) -> None:
    """Say all that is wrong with a scene: unknown keys, values, units, contradictions, improbable values.

    A line each; exit 2 where anything is wrong.
    """
    from limitsets.feeder.scene import load
    from limitsets.feeder.scene.checking import examined

    errors, doubts = examined(scene)
    records = [{"improbable": False, **picked(error, *WORDS, "file")} for error in errors]
    records += [{"improbable": True, **picked(doubt, *WORDS, "file")} for doubt in doubts]
    heads = (*WORDS, "improbable")
    rows = Table(heads, [[str(record[word] or "") for word in heads] for record in records], scene)

    def text() -> None:
        for each in (*errors, *doubts):
            typer.echo(str(each))
        unlikely = f", {_count(len(doubts), 'improbable')}" if doubts else ""
        typer.echo(f"{scene}: {_count(len(errors), 'wrong')}{unlikely}")
        if not errors and (note := _beside_kappa(load(scene))):
            typer.echo(f"{scene}: {note}")

    answer(records, json, text, out, (csv, lambda: rows))
    raise typer.Exit(2 if errors else 0)


def _beside_kappa(scene: SceneOf) -> str:
    """Explain a gravity that changes no throw; empty if it changes throws, or is not given."""
    if scene.gravity is None or "kappa" not in scene.text["throw"]:
        return ""
    speed = math.degrees(scene.value("throw.speed"))
    return f"throw.kappa gives the throw, and gravity changes none: it tells which speed that is, {speed:.4g} deg/s"


def _count(number: int, word: str) -> str:
    things = "nothing is" if not number else "1 thing is" if number == 1 else f"{number} things are"
    return f"{things} {word}"


# ----------------------------------------------------------------
# `limitsets doctor`: the installed packages, and the folder of the compiled code.


# Extras that are needed only to develop the package itself.
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
        "folder": str(Path(__file__).parents[2]),
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
    """List the required packages, each with its installed version and the extra that requires it."""
    try:
        lines = requires("limitsets") or []
    except PackageNotFoundError:  # a folder on the path, not installed
        return []
    packages: list[dict[str, str | None]] = []
    for line in lines:
        match = _REQUIREMENT.match(line)
        if match is None or match[2] in INNER or match[1] == "limitsets":
            continue
        try:
            there: str | None = version(match[1])
        except PackageNotFoundError:
            there = None
        packages.append({"package": match[1], "version": there, "extra": match[2]})
    return packages


def _cache(*, clear: bool) -> dict[str, Any]:
    """Measure the folder of the compiled code, and delete it if asked."""
    try:
        from limitsets.numbers.jit.cache import FOLDER
    except ImportError as error:  # numba is missing or broken
        return {"folder": None, "bytes": 0, "versions": 0, "cleared": False, "reason": str(error)}
    if FOLDER is None:
        return {"folder": None, "bytes": 0, "versions": 0, "cleared": False, "reason": "it cannot be written"}
    root = FOLDER.parent
    files = [each for each in root.rglob("*") if each.is_file()]
    record = {
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
    return record


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


# ----------------------------------------------------------------
# `limitsets explore`: a page in the browser where sliders move a scene.


FIRST = "paper-designed"
HELP_ADDRESS = "Where the page listens; any other than 127.0.0.1 needs --allow-origin."
HELP_ORIGIN = "A name with its port under which browsers may ask for the page."
HELP_ATLAS = "The store of an atlas of the scene, shown beside it; without SCENE its scene is opened."


def explore(
    scene: Annotated[
        str | None,
        typer.Argument(metavar="[SCENE]", help=f"A built-in name or a TOML file; {FIRST} by default."),
    ] = None,
    atlas: Annotated[Path | None, option("--atlas", "STORE", HELP_ATLAS)] = None,
    port: Annotated[int, option("--port", "N", "0 for any that is free.", min=0, max=65535)] = 5006,
    address: Annotated[str, option("--address", "HOST", HELP_ADDRESS)] = "127.0.0.1",
    allow_origin: Annotated[list[str] | None, option("--allow-origin", "HOST:PORT", HELP_ORIGIN)] = None,
    no_show: Annotated[bool, typer.Option("--no-show", help="Do not open a browser.")] = False,
) -> None:
    """Open a page where sliders move a scene, and its limit sets, basins and goal follow."""
    from limitsets.face.explorer import explore as open_page
    from limitsets.face.explorer.exploring import required

    required()
    from limitsets.face.explorer.visits import stored_atlas

    with progress() as tell:
        chosen = scene if scene is not None else FIRST if atlas is None else stored_atlas(atlas)[0]
        explorer = open_page(chosen, atlas=atlas)
        explorer.prepare(tell)
    explorer.show(
        address=address,
        port=port,
        origins=allow_origin or (),
        show=not no_show,
    )
