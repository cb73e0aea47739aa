"""All that is wrong with a scene, at once."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from limitsets.errors import SceneError
from limitsets.scene.reading import structure_of
from limitsets.scene.scene import Scene
from limitsets.scene.validation import Tree, plain, refusals

__all__ = ["problems"]

# Without these there is no scene; all other tables can be left out to look at the rest.
NEEDED = ("name", "part", "arm", "throw")

# The words of a key: in quotation marks, a number, or plain.
_WORDS = re.compile(r'"([^"]*)"|\[(\d+)\]|([^.\[\]"]+)')


def problems(source: str | Path | Mapping[str, Any]) -> tuple[SceneError, ...]:
    """Find all that is wrong with a scene.

    Words, values and units are looked at all together; contradictions between them one after another, each with
    another value in place of the one before.  A wrong number of a list hides those after it.

    Parameters
    ----------
    source : str, Path or mapping
        As for `limitsets.load`.

    Returns
    -------
    tuple of SceneError
        Empty for a scene that loads.

    Examples
    --------
    >>> wrong = {"part": {"sides": ["5 in"]}, "arm": {"length": 28}, "throw": {"kapa": "25 in"}}
    >>> [error.key for error in problems(wrong)][:4]
    ['throw.kapa', 'arm.length', 'part.mass', 'arm.surface_height']
    """
    try:
        structure, file = structure_of(source)
        tree = plain(structure, file)
    except SceneError as error:  # no file, no TOML: there is nothing more to look at
        return (error,)
    found = refusals(tree, file)[1]
    blamed = {_table_of(error) for error in found}
    if blamed & {*NEEDED, ""}:
        return tuple(found)
    looked_at: Tree | None = {key: value for key, value in tree.items() if key not in blamed}
    while looked_at is not None:
        wrong = _first(looked_at, file)
        if wrong is None or _table_of(wrong) in blamed:  # of what was left out, and so no news
            break
        found.append(wrong)
        looked_at = _passed(looked_at, wrong, file)
        blamed |= tree.keys() - (looked_at or tree).keys()
    return tuple(found)


def _first(tree: Tree, file: str | None) -> SceneError | None:
    """Find the first thing wrong."""
    try:
        Scene.of(tree, file)
    except SceneError as error:
        return error
    return None


def _passed(tree: Tree, error: SceneError, file: str | None) -> Tree | None:
    """Give the scene without a contradiction, so that the next one is met; None where there is none to go on with.

    Another value stands in for what is wrong, or nothing; where neither helps, the whole table is left out.
    """
    path = [part[0] or part[2] or int(part[1]) for part in _WORDS.findall(error.key or "")]
    usable: list[Tree] = []
    for stand_in in _stand_ins(_at(tree, path)):
        other = copy.deepcopy(tree)
        node = _at(other, path[:-1])
        if stand_in is not None:
            node[path[-1]] = stand_in
        elif isinstance(node, dict):
            del node[path[-1]]
        else:
            continue
        after = _first(other, file)
        if after is None:  # a further error may be of the stand-in itself, where another one has none
            return other
        if not f"{error.key}.".startswith(f"{after.key}."):
            usable.append(other)
    if usable:
        return usable[0]
    if not path or path[0] in NEEDED:
        return None
    return {key: value for key, value in tree.items() if key != path[0]}


def _at(tree: Any, path: list[str | int]) -> Any:
    """Return what stands there, None where nothing does."""
    for word in path:
        try:
            tree = tree[word]
        except (KeyError, IndexError, TypeError):
            return None
    return tree


def _stand_ins(value: Any) -> Iterator[Any]:
    """Give values that may be right where this one is wrong, and None for nothing at all."""
    if isinstance(value, str):
        unit = value.lstrip("+-.0123456789eE ")
        yield from (f"{number} {unit}" for number in (1, 0, 1000))
    elif isinstance(value, int) and not isinstance(value, bool):
        yield from (0, 1)
    if value is not None:
        yield None


def _table_of(error: SceneError) -> str:
    """Name the table of the first level that an error is about."""
    return (error.key or "").partition(".")[0].partition("[")[0]
