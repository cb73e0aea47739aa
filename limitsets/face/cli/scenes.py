"""Commands about scenes and this installation: `scenes`, `check`, `doctor`, `explore`."""

from __future__ import annotations

import math
import platform
import re
import shutil
from collections.abc import Iterator
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import limitsets as ls
from limitsets.base import Column, LimitsetsError, Table, picked
from limitsets.face.cli.commands import Answer, Run, Scene, Words, command, limits
from limitsets.face.cli.subjects import MapOfFile, domain_of, of_map_alone, of_scene_alone, subject

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene as SceneOf


SCENE_COLUMNS: dict[str, Column | str] = {
    "name": "scene",
    "sides": "sides",
    "kappa": Column("kappa", show=".6g"),
    "arm_length": Column("arm", show="g"),
    "unit": "unit",
    "flight": "flight",
    "flip": "flip",
    "goal": "goal",
}


@command()
def scenes(run: Run) -> Answer:
    """List the built-in scenes."""
    records = [
        {
            "name": scene.name,
            "sides": len(scene.sides),
            **picked(scene, "unit", "kappa", "arm_length", "flight", "flip"),
            "goal": None if scene.goal is None else scene.goal.kind,
        }
        for scene in map(ls.load, ls.scenes())
    ]
    rows = [[record[word] for word in SCENE_COLUMNS] for record in records]
    listing = Table(list(SCENE_COLUMNS.values()), rows, "Built-in scenes")
    return Answer(records, lambda: [listing], lambda: listing)


# ----------------------------------------------------------------
# `limitsets check`: all errors of a scene at once.


WORDS = ("key", "thing", "value", "allowed", "remedy")


@command()
def check(run: Run, scene: Scene) -> Answer:
    """Say all that is wrong with a scene: unknown keys, values, units, contradictions, improbable values.

    A line each; exit 2 where anything is wrong.
    """
    from limitsets.feeder.scene import examined

    errors, doubts = examined(scene)
    records = [{"improbable": False, **picked(error, *WORDS, "file")} for error in errors]
    records += [{"improbable": True, **picked(doubt, *WORDS, "file")} for doubt in doubts]
    heads = (*WORDS, "improbable")
    rows = Table(heads, [[str(record[word] or "") for word in heads] for record in records], scene)
    unlikely = f", {_count(len(doubts), 'improbable')}" if doubts else ""
    words = [*map(str, errors), *map(str, doubts), f"{scene}: {_count(len(errors), 'wrong')}{unlikely}"]
    if not errors and (note := _beside_kappa(ls.load(scene))):
        words.append(f"{scene}: {note}")
    return Answer(records, lambda: words, lambda: rows, code=2 if errors else 0)


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


@command()
def doctor(run: Run, *, clear: bool = False) -> Answer:
    """Say what is installed, which extras are missing and how to get them, and where the compiled code lies.

    Exit 1 where a package is missing that every command needs.

    Parameters
    ----------
    clear
        Delete the compiled code; the next run compiles.
    """
    packages = _packages()
    missing = sorted({each["extra"] for each in packages if each["version"] is None and each["extra"]})
    lost = [each["package"] for each in packages if each["version"] is None and not each["extra"]]
    record = {
        "limitsets": ls.__version__,
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
    return Answer(record, lambda: _text(record, table), lambda: table, code=1 if lost else 0)


def _packages() -> list[dict[str, str | None]]:
    """List the required packages, each with its installed version and the extra that requires it."""
    lines: list[str] = []
    with suppress(PackageNotFoundError):  # a folder on the path, not installed
        lines = requires("limitsets") or []
    packages: list[dict[str, str | None]] = []
    for match in filter(None, map(_REQUIREMENT.match, lines)):
        if match[2] not in INNER and match[1] != "limitsets":
            packages.append({"package": match[1], "version": None, "extra": match[2]})
            with suppress(PackageNotFoundError):
                packages[-1]["version"] = version(match[1])
    return packages


def _cache(*, clear: bool) -> dict[str, Any]:
    """Measure the folder of the compiled code, and delete it if asked."""
    none = {"folder": None, "bytes": 0, "versions": 0, "cleared": False, "reason": "it cannot be written"}
    try:
        from limitsets.numbers.jit.cache import FOLDER
    except ImportError as error:  # numba is missing or broken
        return none | {"reason": str(error)}
    if FOLDER is None:
        return none
    root = FOLDER.parent
    record = {
        "folder": str(root),
        "bytes": sum(each.stat().st_size for each in root.rglob("*") if each.is_file()),
        "versions": sum(each.is_dir() for each in root.iterdir()),
        "cleared": clear,
        "reason": None,
    }
    if clear:
        try:
            shutil.rmtree(root)
        except OSError as error:
            allowed, remedy = "a folder that can be deleted", f"it could not be: {error.strerror}"
            raise LimitsetsError("the compiled code", str(root), allowed, remedy) from None
    return record


def _text(record: dict[str, Any], table: Table) -> Iterator[str | Table]:
    yield f"limitsets {record['limitsets']} in {record['folder']}"
    yield f"Python {record['python']}, {record['platform']}"
    if table.rows:
        yield table
    else:
        yield "it is not installed, but found on the path: what it needs is not listed"
    for package in record["missing"]:
        yield f"missing, and needed by every command: pip install {package}"
    for extra, line in record["missing_extras"].items():
        yield f"extra {extra} is missing: {line}"
    cache = record["cache"]
    if cache["folder"] is None:
        yield f"compiled code is not kept: {cache['reason']}"
        return
    size = f"{cache['bytes'] / 1e6:.3g} MB of {cache['versions']} versions of the source"
    done = "deleted: " if cache["cleared"] else ""
    yield f"compiled code: {done}{size} in {cache['folder']}"
    if not cache["cleared"]:
        yield "limitsets doctor --clear deletes it; the next run compiles for about half a minute"


# ----------------------------------------------------------------
# `limitsets explore`: a page in the browser where sliders move a scene.


FIRST = "paper-designed"


@command(out=False, csv=False, json=False)
def explore(
    run: Run,
    scene: str | None = None,
    *,
    atlas: Path | None = None,
    set_: Words = None,
    domain: str | None = None,
    port: Annotated[int, limits(min=0, max=65_535)] = 5006,
    address: str = "127.0.0.1",
    allow_origin: list[str] | None = None,
    no_show: bool = False,
) -> Answer:
    """Open a page where sliders move a scene or a map, and its limit sets, basins and goal follow.

    Parameters
    ----------
    scene : SCENE
        A built-in name, a TOML file, or a map FILE.py:NAME (the Python file is run); paper-designed by default.
    atlas : STORE
        The store of an atlas of the scene, shown beside it; without SCENE its scene is opened.
    set_ : NAME=NUMBER
        Of a map: the value of a parameter to begin with, like a=1.4; repeatable.
    domain : LO:HI,LO:HI
        Of a map: a range for each coordinate.
    port : N
        0 for any that is free.
    address : HOST
        Where the page listens; any other than 127.0.0.1 needs --allow-origin.
    allow_origin : HOST:PORT
        A name with its port under which browsers may ask for the page.
    no_show
        Do not open a browser.
    """
    from limitsets.face.explorer.exploring import required

    required()
    from limitsets.face.explorer.visits import stored_atlas

    about = stored_atlas(atlas)[0] if scene is None and atlas is not None else subject(scene or FIRST, set_)
    if isinstance(about, MapOfFile):
        of_map_alone({"--atlas": atlas})
        explorer = ls.explore(about.one(), domain=domain_of(about, domain))
    else:
        explorer = ls.explore(of_scene_alone(about, {"--domain": domain}), atlas=atlas)
    explorer.prepare(run.tell)

    def words() -> tuple[str, ...]:
        explorer.show(address=address, port=port, origins=allow_origin or (), show=not no_show)
        return ()

    return Answer(None, words)
