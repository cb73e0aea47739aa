"""A scene to start from: every key that a scene may have, with what it means, in the words of the schema."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from limitsets.base import SceneError
from limitsets.feeder.scene.reading import can_name, load, replace_file
from limitsets.feeder.scene.schema import ByName, Key, Section, Several, schema
from limitsets.feeder.scene.units import UNITS, convert, parse

# The scene that it is, as it stands, under another name.
LIKE = "paper-designed"

# Tables below the first level with a heading of their own.
HEADED = ("part.mass",)

WIDTH = 100

# Lengths and accelerations of that scene, as its text has them.
_LENGTHS = re.compile(r'"([+-]?[0-9.]+) in(/s\^2)?"')

HEAD = """\
# A scene of limitsets: a part, the arm that throws it, and what is asked of them.
#
# A quantity is text, a decimal number and a unit: "5.75 in", "146 mm", "158 deg/s".
# Lines that begin with "#" and a key are optional: take the sign away, and set the value.
# limitsets check {file}     says what is wrong with it
# limitsets analyse {file}   says where the throws lead
"""


def starting_text(name: str, file: str, unit: str = "in", tables: Mapping[str, Any] | None = None) -> str:
    """Write a scene as TOML, its lengths in a unit; it loads as it is.

    Parameters
    ----------
    name, file : str
        Of the scene.
    unit : str
        Of its lengths.
    tables : mapping, optional
        Tables in place of those of the paper's designed feeder; None for a table that is left out.

    Examples
    --------
    >>> load(starting_text("mine", "mine.toml")).name
    'mine'
    """
    given = load(LIKE).as_dict() | {"name": name} | dict(tables or {})
    lines: list[str] = []
    for word, key in schema(with_effects=True).keys.items():
        if isinstance(key.of, Section):
            lines += _table(word, key.of, given.get(word))
        elif isinstance(key.of, ByName):
            lines += [f"# {key.says}", f"# [{word}]"]
            lines += [*(f"# {_word(name)} = {_toml(value)}" for name, value in key.example.items()), ""]
        else:
            lines += [*_line(word, given[word], key), ""]
    body = (
        _LENGTHS.sub(lambda length: _in_unit(length, unit), "\n".join(lines))
        if unit != "in"
        else "\n".join(lines)
    )
    return HEAD.format(file=file) + "\n" + body.rstrip("\n") + "\n"


def _in_unit(length: re.Match[str], unit: str) -> str:
    """Convert a quantity in inches, to 10 digits."""
    value = convert(parse(f"{length[1]} in", "length"), unit)
    return f'"{value:.10g} {unit}{length[2] or ""}"'


def new_scene(file: str | Path, unit: str = "in", tables: Mapping[str, Any] | None = None) -> Path:
    """Write a scene to start from, with comments.

    Parameters
    ----------
    file : str or Path
        Where to: a name that ends in .toml, of a file that is not there yet.
    unit : str
        The unit of its lengths.
    tables : mapping, optional
        As for `starting_text`.

    Raises
    ------
    SceneError
        It is there, cannot be written, or is no such name; or an unknown unit.
    """
    path = Path(file)
    if path.suffix != ".toml":
        raise SceneError("the new scene", str(file), "a name that ends in .toml", f"name it {path.name}.toml")
    if unit not in UNITS["length"]:
        raise SceneError("the unit of the new scene", unit, ", ".join(UNITS["length"]), "name one of them")
    if path.exists():
        raise SceneError("the new scene", str(file), "a file that is not there", "name another one")
    name = path.stem if can_name(path.stem) else "mine"
    replace_file(path, starting_text(name, path.name, unit, tables))
    return path


def example_at(path: tuple[str | int, ...]) -> tuple[tuple[str | int, ...], Any]:
    """Give the example of a key, and the key; of a number in a list those of the list.

    Examples
    --------
    >>> example_at(("goal", "flip_order", 1))
    (('goal', 'flip_order'), [0, 1, 2])
    """
    section = schema(with_effects=path[0] == "effects")
    for depth, word in enumerate(path, 1):
        if isinstance(word, str):
            key, end = section.keys[word], depth
            inner = _inner(key)
            if inner is None:
                break
            section = inner
    return path[:end], _example(key)


def _table(path: str, table: Section, given: Mapping[str, Any] | None) -> Iterator[str]:
    """Write a table under its heading, all of it commented out where it is not given."""
    off = "" if given is not None else "# "
    yield f"# {table.says}"
    yield f"{off}[{path}]"
    below, texts = [], given or {}
    for word, key in table.keys.items():
        inner, on = _inner(key), word in texts
        if inner is not None and f"{path}.{word}" in HEADED:
            below.append((f"{path}.{word}", inner, texts.get(word)))
            continue
        yield from _line(word, texts[word] if on else _example(key), key, on=on)
        if inner is not None:
            yield from (f"#     {name}: {each.says}" for name, each in inner.keys.items())
    yield ""
    for each in below:
        yield from _table(*each)


def _line(word: str, value: Any, key: Key, *, on: bool = True) -> list[str]:
    """Write a key with what it means behind it; above it where the line would be long."""
    line = ("" if on else "# ") + f"{word} = {_toml(value)}"
    whole = f"{line}  # {key.says}"
    if on and isinstance(value, list) and len(line) > WIDTH:  # the corners of a drawing
        return [f"#     {key.says}:", f"{word} = [", *(f"    {_toml(each)}," for each in value), "]"]
    return [whole] if len(whole) <= WIDTH else [f"#     {key.says}:", line]


def _inner(key: Key) -> Section | None:
    """Give the table that a key stands for, or each entry of its list."""
    of = key.of.of if isinstance(key.of, Several) else key.of
    return of if isinstance(of, Section) else None


def _example(key: Key) -> Any:
    """Give the example of a key: its own, or one made of those of its table."""
    inner = _inner(key)
    if inner is None:
        return key.example
    made = {word: _example(each) for word, each in inner.keys.items()}
    if inner.either is not None:
        for word in inner.either.words[1:]:  # one of several ways to say it
            made.pop(word)
    return [made] if isinstance(key.of, Several) else made


def _word(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() else json.dumps(key)


def _toml(value: Any) -> str:
    """Write a value in one line of TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_word(key)} = {_toml(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
