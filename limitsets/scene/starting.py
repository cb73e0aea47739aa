"""A scene to start from: every key that a scene may have, with what it means, in the words of the schema."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args, get_origin

from limitsets.errors import SceneError
from limitsets.scene.reading import can_name, load
from limitsets.scene.units import UNITS, convert, parse
from limitsets.scene.writing import replace_file

if TYPE_CHECKING:
    from pydantic.fields import FieldInfo

    from limitsets.scene.schema import Table

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


def starting_text(name: str, file: str, unit: str = "in") -> str:
    """Write the scene as TOML, its lengths in a unit; it loads as it is.

    Examples
    --------
    >>> load(starting_text("mine", "mine.toml")).name
    'mine'
    """
    from limitsets.scene.schema import scene_table

    given = load(LIKE).as_dict() | {"name": name}
    lines: list[str] = []
    for key, field in scene_table(with_effects=True).model_fields.items():
        inner = _model(field.annotation)
        if inner is not None:
            lines += _table(key, inner, given.get(key))
        elif key in given:
            lines += [*_line(key, given[key], field), ""]
        else:
            lines += [*_quantities(key, field), ""]
    body = (
        _LENGTHS.sub(lambda found: _in_unit(found, unit), "\n".join(lines))
        if unit != "in"
        else "\n".join(lines)
    )
    return HEAD.format(file=file) + "\n" + body.rstrip("\n") + "\n"


def _in_unit(found: re.Match[str], unit: str) -> str:
    """Convert a quantity in inches, to 10 digits."""
    value = convert(parse(f"{found[1]} in", "length"), unit)
    return f'"{value:.10g} {unit}{found[2] or ""}"'


def new_scene(file: str | Path, unit: str = "in") -> Path:
    """Write a scene to start from, with comments.

    Parameters
    ----------
    file : str or Path
        Where to: a name that ends in .toml, of a file that is not there yet.
    unit : str
        The unit of its lengths.

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
    replace_file(path, starting_text(name, path.name, unit))
    return path


def example_at(path: tuple[str | int, ...]) -> tuple[tuple[str | int, ...], Any]:
    """Give the example of a key, and the key; of a number in a list those of the list.

    Examples
    --------
    >>> example_at(("goal", "flip_order", 1))
    (('goal', 'flip_order'), [0, 1, 2])
    """
    from limitsets.scene.schema import scene_table

    table: Any = scene_table(with_effects=path[0] == "effects")
    for k, word in enumerate(path):
        if isinstance(word, str):
            field, end = table.model_fields[word], k + 1
            table = _model(field.annotation)
            if table is None:
                break
    return path[:end], _example(field)


def _table(path: str, table: type[Table], given: Mapping[str, Any] | None) -> Iterator[str]:
    """Write a table under its heading, all of it commented out where it is not given."""
    off = "" if given is not None else "# "
    yield f"# {(table.__doc__ or '').strip()}"
    yield f"{off}[{path}]"
    below = []
    for key, field in table.model_fields.items():
        inner = _model(field.annotation)
        if f"{path}.{key}" in HEADED and inner is not None:
            below.append((f"{path}.{key}", inner, None if given is None else given.get(key)))
            continue
        on = given is not None and key in given
        yield from _line(key, given[key] if given is not None and on else _example(field), field, on=on)
        if inner is not None:
            yield from (f"#     {word}: {each.description}" for word, each in inner.model_fields.items())
    yield ""
    for each in below:
        yield from _table(*each)


def _quantities(key: str, field: FieldInfo) -> Iterator[str]:
    """Write a table whose keys are names of quantities."""
    yield f"# {field.description}"
    yield f"# [{key}]"
    yield from (f"# {_word(name)} = {_toml(value)}" for name, value in _example(field).items())


def _line(key: str, value: Any, field: FieldInfo, *, on: bool = True) -> list[str]:
    """Write a key with what it means behind it; above it where the line would be long."""
    line = ("" if on else "# ") + f"{key} = {_toml(value)}"
    whole = f"{line}  # {field.description}"
    return [whole] if len(whole) <= WIDTH else [f"#     {field.description}:", line]


def _model(annotation: Any) -> type[Table] | None:
    """Find the table in an annotation: itself, of several, or None."""
    from limitsets.scene.schema import Table

    if isinstance(annotation, type) and issubclass(annotation, Table):
        return annotation
    return next((found for part in get_args(annotation) if (found := _model(part)) is not None), None)


def _example(field: FieldInfo) -> Any:
    """Give the example of a key: its own, that of its type, or one made of those of its table."""
    for examples in (field.examples, *_examples(field.annotation)):
        if examples:
            return examples[0]
    inner = _model(field.annotation)
    if inner is None:  # a switch
        return True
    made = {key: _example(each) for key, each in inner.model_fields.items()}
    for instead in ("side" if "beyond" in made else "", "speed" if "name" in made else ""):
        made.pop(instead, None)  # one of two ways to say it
    return [made] if _is_list(field.annotation) else made


def _examples(annotation: Any) -> Iterator[Any]:
    """Give the examples that the types in an annotation carry."""
    for part in get_args(annotation):
        if (found := getattr(part, "examples", None)) is not None:
            yield found
        yield from _examples(part)


def _is_list(annotation: Any) -> bool:
    return get_origin(annotation) is list or any(map(_is_list, get_args(annotation)))


def _word(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() else json.dumps(key)


def _toml(value: Any) -> str:
    """Write a value in one line of TOML."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_word(key)} = {_toml(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)
