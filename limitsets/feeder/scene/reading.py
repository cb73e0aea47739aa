"""Read scenes by name, from files, text and structures, also what can be read of a refused one; and write them."""

from __future__ import annotations

import contextlib
import difflib
import errno
import re
import tomllib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.base import SceneError, TipsError, arguments_checked, replaced, shown
from limitsets.feeder.scene.facts import TIPPING
from limitsets.feeder.scene.numbers import Unchecked
from limitsets.feeder.scene.quantities import text_at
from limitsets.feeder.scene.scene import Scene
from limitsets.feeder.scene.units import UNITS, parse
from limitsets.feeder.scene.validation import plain

_BUILTIN = resources.files("limitsets.feeder.scene") / "builtin"
_MOST_BYTES = 1 << 20
_MOST_DOTS = 16
# what may hold a point without being a dotted key; the order is that of TOML's own lexer
_NOT_KEYS = re.compile(
    r'"""(?:[^\\]|\\.)*?"""|' + r"'''.*?'''|" + r'"(?:[^"\\\n]|\\.)*"|' + r"'[^'\n]*'|#[^\n]*", re.DOTALL
)


def scenes() -> list[str]:
    """List the names of the built-in scenes.

    Returns
    -------
    list of str

    Examples
    --------
    >>> scenes()[0]
    'paper-designed'
    """
    names = (entry.name for entry in _BUILTIN.iterdir())
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


def load(source: str | Path | Mapping[str, Any] | Scene) -> Scene:
    """Read a scene.

    Parameters
    ----------
    source : str, Path, mapping or Scene
        The name of a built-in scene, the path of a TOML file, TOML text (any string with a line break in it), or the
        structure of a scene such as `Scene.as_dict` gives.  A built-in name goes before a file of the same name.
        A scene that is loaded is given back.

    Returns
    -------
    Scene
        With its units resolved.

    Raises
    ------
    SceneError
        The file cannot be read, is not TOML, or does not describe a scene; the first thing wrong is named.

    Examples
    --------
    >>> scene = load("paper-designed")
    >>> scene.kappa, scene.unit
    (25.3778518, 'in')
    """
    return source if isinstance(source, Scene) else Scene.of(*structure_of(source))


def load_to_analyse(source: str | Path | Mapping[str, Any] | Scene) -> tuple[Scene, tuple[str, ...]]:
    """Read a scene; of a part that cannot rest on one of its sides with the effects by which it tips on.

    Returns
    -------
    (Scene, tuple of str)
        The scene, and the effects that were switched on for that, mostly none.

    Examples
    --------
    >>> load_to_analyse("paper-designed")[1]
    ()
    """
    if isinstance(source, Scene):
        return source, ()
    structure, file = structure_of(source)
    try:
        return Scene.of(structure, file), ()
    except TipsError:  # the words are in order, so that there is a table of effects or none
        effects = structure.get("effects", {})
        more = tuple(effect for effect in TIPPING if effects.get(effect) is not True)
        return Scene.of({**structure, "effects": {**effects, **dict.fromkeys(more, True)}}, file), more


def structure_of(source: str | Path | Mapping[str, Any]) -> tuple[dict[str, Any], str | None]:
    """Read what `load` takes: the structure, not yet checked, and the file it is from."""
    if isinstance(source, Mapping):
        return {"name": "scene", **source}, None
    if isinstance(source, str) and "\n" in source:
        return {"name": "scene", **_parsed(source, None)}, None
    if hasattr(source, "_fields"):
        remedy = (
            "of a map of one's own: ls.transitions(map, grid) and what follows from it, ls.certify(map, grid)"
        )
        kind = source if isinstance(source, type) else type(source)
        raise SceneError("the source of a scene", f"a map, {kind.__name__}", "a scene", remedy)
    if not isinstance(source, str | Path):
        allowed = "a built-in name, a path, TOML text or a structure"
        raise SceneError("the source of a scene", shown(source), allowed, "give one of these")
    # a name that no terminal can print would fail in the error that reports it
    file = str(source).encode("utf-8", "backslashreplace").decode()
    if isinstance(source, str) and file in scenes():
        text = (_BUILTIN / f"{file}.toml").read_text(encoding="utf-8")
    else:
        text = _decoded(_read(Path(source), file), file)
    stem = Path(file).stem
    return {"name": stem if can_name(stem) else "scene", **_parsed(text, file)}, file


def can_name(stem: str) -> bool:
    """Say whether the stem of a file can name a scene."""
    return re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,63}", stem) is not None


def _read(path: Path, file: str) -> bytes:
    shown_file = str(shown(file))
    try:
        # a pipe or a device may never end
        if path.is_file():
            with path.open("rb") as stream:
                content = stream.read(_MOST_BYTES + 1)
        else:
            raise _not_found(path, shown_file)
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        reason = getattr(error, "strerror", None) or str(error)
        raise SceneError(
            "the file",
            shown_file,
            "a scene that can be read",
            f"it could not be opened: {reason}",
            file=shown_file,
        ) from None
    if len(content) > _MOST_BYTES:
        allowed = f"at most {_MOST_BYTES} bytes"
        raise SceneError("the size of the file", "larger", allowed, "give a scene file", file=file)
    return content


def _not_found(path: Path, file: str) -> SceneError:
    names = scenes()
    near = difflib.get_close_matches(file, names, n=1)
    of_map = "; certify, atlas and explore take a map FILE.py:NAME" if ".py" in path.name else ""
    what = "a folder" if path.is_dir() else "not a regular file" if path.exists() else "not there"
    return SceneError(
        "the scene",
        file,
        f"the path of a TOML file or a built-in scene: {', '.join(names)}",
        f"did you mean {near[0]!r}?" if near else f"this is {what}{of_map}",
        file=file,
    )


def _decoded(content: bytes, file: str) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise SceneError(
            "the text", f"undecodable at byte {error.start}", "UTF-8", "save the file as UTF-8", file=file
        ) from None


def _parsed(text: str, file: str | None) -> dict[str, Any]:
    def refuse(value: str, remedy: str) -> SceneError:
        return SceneError("the text of the scene", value, "TOML", remedy, file=file)

    if len(text) > _MOST_BYTES:
        raise refuse("too long", f"a scene has at most {_MOST_BYTES} bytes")
    # tomllib needs a time quadratic in the length of a dotted key: 26 s for 60 kB
    if any(piece.count(".") > _MOST_DOTS for piece in re.split(r"[,=\[\]{}\n]", _NOT_KEYS.sub("s", text))):
        raise refuse("too deeply nested", "a key has too many points; flatten it")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise refuse("too deeply nested", "flatten it") from None
    except ValueError as error:  # TOMLDecodeError is one; so is a whole number of 5000 digits
        raise refuse("not valid", _why_no_toml(str(error))) from None


def _why_no_toml(message: str) -> str:
    """Keep the line and column at the end of tomllib's message, however long what stands before them is.

    Examples
    --------
    >>> _why_no_toml("Invalid value (at line 11, column 10)")
    'Invalid value (at line 11, column 10); a quantity stands in quotation marks: length = "400 mm"'
    """
    what, at, place = message.rpartition(" (at ")
    words = f"{shown(what)}{at}{place}" if at else str(shown(message))
    return f'{words}; a quantity stands in quotation marks: length = "400 mm"'


# ----------------------------------------------------------------
# Write scenes: TOML text, and files that are replaced whole.


_WIDTH = 100
# tables with a heading of their own below the first level; all others are written in one line
_HEADED = {"part.mass"}


@arguments_checked
def dump(scene: Scene, path: str | Path | None = None) -> str:
    """Write a scene as TOML, every quantity in the words in which it was given.

    Parameters
    ----------
    scene : Scene
        What to write.
    path : str or Path, optional
        File to write the text to as well; one that exists is replaced whole, or not at all.

    Returns
    -------
    str
        The text, from which `limitsets.load` makes an equal scene.

    Raises
    ------
    SceneError
        The file cannot be written.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> dump(load("paper-designed")).splitlines()[0]
    'name = "paper-designed"'
    """
    from tomlkit import dumps

    text = dumps({key: _item(value, key) for key, value in scene.text.items()})
    if path is not None:
        replace_file(Path(path), text)
    return text


def _item(value: Any, path: str) -> Any:
    import tomlkit

    if isinstance(value, dict):
        table = tomlkit.table() if "." not in path or path in _HEADED else tomlkit.inline_table()
        for key, inner in value.items():
            table[key] = _item(inner, f"{path}.{key}")
        return table
    if isinstance(value, list):
        array = tomlkit.array()
        array.extend(_item(each, f"{path}.") for each in value)
        return array.multiline(len(array.as_string()) > _WIDTH)
    return value


def replace_file(path: Path, text: str) -> None:
    """Write the text of a scene to a file, whole or not at all."""
    try:
        if not path.parent.is_dir():  # rather a typing error than a wish
            raise FileNotFoundError(errno.ENOENT, "there is no such folder", str(path.parent))
        with replaced(path.parent) as draft:
            (draft / path.name).write_text(text, encoding="utf-8", newline="\n")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise SceneError(
            "the file",
            str(path),
            "a place that can be written",
            f"it could not be written: {reason}",
            file=str(path),
        ) from None


# ----------------------------------------------------------------
# As much of a part as can be read from a scene that is refused, so that it can be looked at.


class Sketch(NamedTuple):
    """A part as it is written, whether or not it can be one.

    Attributes
    ----------
    name, unit : str
        Of the scene: its name, and its unit of length.
    vertices : ndarray, shape (n, 2)
        As they are given [length]; three lengths that make no triangle lie on one line.
    centre : tuple of float, or None
        Centre of mass where it is measured on a side [length].
    """

    name: str
    unit: str
    vertices: npt.NDArray[np.float64]
    centre: tuple[float, float] | None


def sketch(source: str | Path | Mapping[str, Any]) -> Sketch | None:
    """Read the outline of a part without any check; None where not even that can be read.

    Examples
    --------
    >>> from limitsets.feeder.scene.reading import sketch
    >>> sketch({"part": {"vertices": [["0 in", "0 in"], ["4 in", "0 in"], ["4 in", "-1 ft"]]}}).vertices[2].tolist()
    [4.0, -12.0]
    """
    refused = (SceneError, KeyError, TypeError, ValueError, ZeroDivisionError, IndexError)
    try:
        structure, file = structure_of(source)
        tree = plain(structure, file)
        numbers = Unchecked(tree, _unit_of(tree))
        vertices = numbers.outline(numbers.lengths())
        corners = np.array(vertices, dtype=float)
    except refused:
        return None
    centre = None
    with contextlib.suppress(*refused):
        x, y = numbers.on_side(vertices).in_frame(vertices)
        centre = float(x), float(y)
    return Sketch(str(tree["name"]), numbers.unit, corners, centre)


def _unit_of(tree: Mapping[str, Any]) -> str:
    """Give the unit of the arm's length, or of the first vertex or side where that cannot be read."""
    names = ("arm.length", "part.sides[0]", "part.vertices[0].x")
    for text in (text_at(tree, name) for name in names):
        with contextlib.suppress(SceneError):
            return parse(text, "length").unit
    return UNITS["length"][0]
