"""What a command is about: a scene by its name or its TOML file, or a map of a Python file, ``FILE.py:NAME``.

The file is run, as `python FILE.py` runs it but for ``__main__``: its own folder comes first on the path, and what it
prints goes to stderr, so that stdout stays the command's.
"""

from __future__ import annotations

import contextlib
import re
import sys
import traceback
from dataclasses import dataclass
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import FunctionType, ModuleType
from typing import TYPE_CHECKING, Any

import limitsets as ls
from limitsets.base import LimitsetsError, MapError, shown
from limitsets.face.cli.arguments import named, number

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene

FORM = re.compile(r"(?P<file>.+\.py)(?::(?P<name>[^:]*))?", re.DOTALL)

# Modules that this process made of files, by the name under which other processes import them.
_RUN: dict[str, ModuleType] = {}


@dataclass(frozen=True)
class MapOfFile:
    """A map of a Python file.

    Attributes
    ----------
    name : str
        What the file calls it.
    lower, upper : NamedTuple
        The corners of its parameters; the same without a range.
    """

    name: str
    lower: Any
    upper: Any

    def one(self) -> Any:
        """Give the map where no range is allowed.

        Raises
        ------
        LimitsetsError
            A parameter has a range.
        """
        for name, low, high in zip(self.lower._fields, self.lower, self.upper, strict=True):
            if low is not high and low != high:
                remedy = "give one number; certify takes a range"
                raise LimitsetsError(
                    f"the value of {name}", f"{low!r}:{high!r}", "a number here", remedy, key="--set"
                )
        return self.lower


def subject(source: str, settings: list[str] | None = None) -> Scene | MapOfFile:
    """Read the subject of a command.

    Parameters
    ----------
    source : str
        A built-in scene, a TOML file, or ``FILE.py:NAME``, which runs the file.
    settings : list of str, optional
        Of a map: ``NAME=NUMBER`` or, for a range of it, ``NAME=LOW:HIGH``.

    Raises
    ------
    LimitsetsError
        What cannot be read or made: the file, the name in it, a value.
    """
    match = FORM.fullmatch(source)
    if match is None:
        return of_scene_alone(ls.load(source), {"--set": settings})
    pairs = named(settings, "--set", "the value of a parameter", form="NAME=NUMBER", remedy="write a=1.4")
    values = {name: _ends(name, text) for name, text in pairs}
    thing = _thing(Path(match["file"]), match["name"])
    lower, upper = (_made(thing, {name: ends[k] for name, ends in values.items()}) for k in (0, -1))
    return MapOfFile(match["name"], lower, upper)


def of_scene_alone(scene: Scene, given: dict[str, Any]) -> Scene:
    """Refuse options of a map beside a scene."""
    _require_none(given, "a scene", "leave it out; a map is named FILE.py:NAME")
    return scene


def of_map_alone(given: dict[str, Any]) -> None:
    """Refuse options of a scene beside a map."""
    _require_none(given, "a map", "leave it out; a map has --set")


def _require_none(given: dict[str, Any], beside: str, remedy: str) -> None:
    for option, value in given.items():
        if value is not None:
            words = " ".join(value) if isinstance(value, list) else str(value)
            raise LimitsetsError(f"the option {option}", words, f"none beside {beside}", remedy)


def _ends(name: str, text: str) -> list[float]:
    """Read a number, or the two of a range."""
    numbers = [number(word) for word in text.split(":")]
    ends = [each for each in numbers if isinstance(each, float)]
    if not len(ends) == len(numbers) <= 2:
        allowed = "a number, or LOW:HIGH for a range"
        raise LimitsetsError(f"the value of {name}", text, allowed, f"write {name}=1.4", key="--set")
    return ends


# ---------------------------------------------------------------- the file


def _thing(file: Path, name: str | None) -> Any:
    """Give what a file calls by a name."""
    module = _module(file)
    things = {key: each for key, each in vars(module).items() if key[:1] != "_" and _may_be_map(each, module)}
    if name and name in vars(module):
        return vars(module)[name]
    there = ", ".join(things) or "nothing that is a map: define def f(x, a): return ..."
    raise LimitsetsError(
        "the map", f"{file}:{name or ''}", f"{file}:NAME", f"the names in this file are {there}"
    )


def _may_be_map(thing: Any, module: ModuleType) -> bool:
    """Whether a name is worth listing: a function of the file, or a map."""
    if isinstance(thing, FunctionType):
        return thing.__module__ == module.__name__
    return _is_map(thing) or (isinstance(thing, type) and hasattr(thing, "_fields"))


def _is_map(thing: Any) -> bool:
    from limitsets.systems.maps import kind_of

    with contextlib.suppress(MapError):
        return bool(kind_of(thing))
    return False


def _module(file: Path) -> ModuleType:
    """Run a file as a module of its own name, which other processes can import from its folder."""
    if not file.is_file():
        raise LimitsetsError(
            "the file of the map", str(file), "a Python file that is there", "correct the path"
        )
    name, folder = file.stem, str(file.resolve().parent)
    if name in sys.modules and sys.modules[name] is not _RUN.get(name):
        remedy = f"rename it: a module {name} is in use"
        raise LimitsetsError("the file of the map", str(file), "a name of its own", remedy)
    if folder not in sys.path:
        sys.path.insert(0, folder)
    spec = spec_from_file_location(name, file.resolve())
    assert spec is not None  # a name that ends in .py has a loader
    assert spec.loader is not None
    sys.modules[name] = _RUN[name] = module = module_from_spec(spec)
    try:
        with contextlib.redirect_stdout(sys.stderr):
            spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        frames = [
            frame.lineno
            for frame in traceback.extract_tb(error.__traceback__)
            if frame.filename == spec.origin
        ]
        line = error.lineno if isinstance(error, SyntaxError) else (frames or [None])[-1]
        reason = error if isinstance(error, LimitsetsError) else f"{type(error).__name__}: {error}"
        raise LimitsetsError(
            f"what {file} does in line {line}",
            str(reason),
            "a file that runs",
            "correct it; python shows where",
        ) from error
    return module


def _made(thing: Any, values: dict[str, float]) -> Any:
    """Make a map with these values: of a function, of a map, or of a registered class."""
    if isinstance(thing, FunctionType) or hasattr(thing, "py_func"):
        more: Any = values
        return ls.map(thing, **more)
    fields: tuple[str, ...] = getattr(thing, "_fields", ())
    unknown = next((name for name in values if name not in fields), None)
    if fields and unknown is not None:
        allowed = f"a value of {', '.join(fields)}"
        raise MapError("the parameter", unknown, allowed, "correct the name", key="--set")
    if isinstance(thing, type) and fields:
        missing = [
            name
            for name in fields
            if name not in values and name not in getattr(thing, "_field_defaults", ())
        ]
        if missing:
            allowed, remedy = f"a number for each of {', '.join(fields)}", f"add --set {missing[0]}=1.4"
            raise MapError("the value of a parameter", f"none for {missing[0]}", allowed, remedy, key="--set")
        thing = thing(**values)
    if not _is_map(thing):
        allowed = "a function def f(x, a), a map of limitsets.map, or parameters of a registered class"
        raise MapError("the map", shown(thing), allowed, "name one of these in the file")
    return thing._replace(**values)


# ---------------------------------------------------------------- where it is looked at


def spans(text: str, option: str) -> list[tuple[float, float]]:
    """Read ``LO:HI,LO:HI``, one for each axis.

    Examples
    --------
    >>> spans("-1.5:1.5,-0.5:0.5", "--domain")
    [(-1.5, 1.5), (-0.5, 0.5)]
    """
    ends = [[number(word) for word in axis.split(":")] for axis in text.split(",")]
    pairs = [(lo, hi) for lo, hi in (e if len(e) == 2 else ("", "") for e in ends)]
    numbers = [(lo, hi) for lo, hi in pairs if isinstance(lo, float) and isinstance(hi, float) and lo < hi]
    if len(numbers) < len(ends):
        allowed = "LO:HI with LO below HI for each coordinate, and commas between"
        raise LimitsetsError("the box", text, allowed, f'write {option} "-1.5:1.5,-0.5:0.5"', key=option)
    return numbers


def domain_of(chosen: MapOfFile, text: str | None) -> list[tuple[float, float]]:
    """Read --domain of a map.

    Raises
    ------
    LimitsetsError
        It is missing, or of another dimension than the map.
    """
    from limitsets.systems.maps import kind_of

    dimension = kind_of(chosen.lower).dimension
    example = f'--domain "{",".join(["0:1"] * dimension)}"'
    if text is None:
        allowed = "LO:HI for each coordinate: where the map is looked at"
        raise LimitsetsError(f"the domain of {chosen.name}", None, allowed, f"add {example}", key="--domain")
    box = spans(text, "--domain")
    if len(box) != dimension:
        allowed = f"one LO:HI for each of its {dimension} coordinates" if dimension > 1 else "one LO:HI"
        raise LimitsetsError(
            f"the domain of {chosen.name}", text, allowed, f"write {example}", key="--domain"
        )
    return box
