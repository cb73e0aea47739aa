"""Validate a TOML structure against the schema; every error is a `SceneError`."""

from __future__ import annotations

import difflib
import math
from typing import TYPE_CHECKING, Any, TypeAlias, get_args

from limitsets.errors import SceneError, shown

if TYPE_CHECKING:
    from limitsets.scene.schema import SceneTable, Table

__all__ = ["Tree", "plain", "refusals", "validate"]

Tree: TypeAlias = dict[str, Any]
"""A scene as TOML holds it: tables, lists, text, switches and numbers."""

_DEEPEST = 8
_TABLES = {"model_type": "a table", "dict_type": "a table", "list_type": "a list", "missing": "a value"}


def plain(tree: object, file: str | None) -> Tree:
    """Copy a structure, refusing what TOML could not hold or what no scene can need."""
    if not isinstance(tree, dict):
        raise SceneError("the scene", shown(tree), "a table", "give the structure of a scene file", file=file)
    copied: Tree = _plain(tree, "", 0, file)
    return copied


def _plain(value: object, key: str, depth: int, file: str | None) -> Any:
    if depth > _DEEPEST:
        raise SceneError(
            "the nesting", f"deeper than {_DEEPEST}", f"at most {_DEEPEST}", "flatten it", file=file
        )
    if isinstance(value, dict):
        for word in value:
            if not isinstance(word, str):
                raise SceneError(
                    "a key", shown(word), "text", "write keys as text", key=key or None, file=file
                )
        return {word: _plain(item, _joined(key, word), depth + 1, file) for word, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item, f"{key}[{index}]", depth + 1, file) for index, item in enumerate(value)]
    if isinstance(value, str | bool | int):
        return value
    if isinstance(value, float) and math.isfinite(value):
        return value
    raise SceneError(
        "this value",
        shown(value),
        "text, a finite number, true, false, a list or a table",
        "write one of these",
        key=key,
        file=file,
    )


def _joined(key: str, word: object) -> str:
    if isinstance(word, int):
        # a vertex is a pair; its coordinates bear the names that quantities give them
        coordinate = key.startswith("part.vertices[") and word < 2
        return f"{key}.{'xy'[word]}" if coordinate else f"{key}[{word}]"
    text = str(shown(word))
    return f"{key}.{text}" if key else text


def validate(tree: Tree, file: str | None) -> SceneTable:
    """Check keys, types, numbers and units of a scene.

    Raises
    ------
    SceneError
        For the first thing wrong: unknown keys before values, values before missing keys.
    """
    table, found = refusals(tree, file)
    if table is None:
        raise found[0]
    return table


def refusals(tree: Tree, file: str | None) -> tuple[SceneTable | None, list[SceneError]]:
    """Check a scene's words: its tables, or all that is wrong: unknown keys, then values, then missing keys."""
    # pydantic takes 0.1 s to import
    from pydantic import ValidationError

    from limitsets.scene.schema import scene_table

    on = tree.get("effects")
    table = scene_table(with_effects=isinstance(on, dict) and bool(on.keys() - {"auto", "contact"}))
    try:
        return table.model_validate(tree), []
    except ValidationError as error:
        wrong = error.errors(include_url=False)
    rank = {"extra_forbidden": 0, "missing": 2}
    wrong.sort(key=lambda problem: rank.get(problem["type"], 1))
    return None, [_refusal(problem, table, file) for problem in wrong]


def _refusal(problem: Any, table: type[SceneTable], file: str | None) -> SceneError:
    kind, path = problem["type"], problem["loc"]
    key = ""
    for word in path:
        key = _joined(key, word)
    context = problem.get("ctx", {})
    value = shown(problem["input"])
    if kind == "refused":
        return SceneError(context["thing"], value, context["allowed"], context["remedy"], key=key, file=file)
    if kind == "extra_forbidden":
        return _unknown(path, key, table, file)
    if kind == "missing":
        return SceneError("a required key", "missing", "a value for it", "add it", key=key, file=file)
    if kind in ("too_short", "too_long"):
        short = kind == "too_short"
        allowed = f"at least {context['min_length']}" if short else f"at most {context['max_length']}"
        return SceneError(
            "the number of entries", context["actual_length"], allowed, "correct the list", key=key, file=file
        )
    return SceneError(
        "this entry", value, _TABLES.get(kind, problem["msg"]), "write it so", key=key, file=file
    )


def _unknown(path: tuple[str | int, ...], key: str, table: type[SceneTable], file: str | None) -> SceneError:
    names = _names_beside(path, table)
    word = str(path[-1])
    near = difflib.get_close_matches(word[:64], names, n=1, cutoff=0.0)
    return SceneError(
        "the key",
        shown(word),
        ", ".join(names),
        f"it is not known; did you mean {near[0]!r}?" if near else "it is not known; leave it out",
        key=key,
        file=file,
    )


def _names_beside(path: tuple[str | int, ...], table: type[Table]) -> list[str]:
    """Give the keys that the table of an unknown key may have."""
    for word in path[:-1]:
        if isinstance(word, str):
            table = next(model for model in _models_in(table.model_fields[word].annotation))
    return sorted(table.model_fields)


def _models_in(annotation: Any) -> list[Any]:
    from limitsets.scene.schema import Table

    if isinstance(annotation, type) and issubclass(annotation, Table):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]
