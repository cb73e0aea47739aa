"""All that is wrong with a scene, and what is improbable, at once."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from limitsets.errors import SceneError
from limitsets.scene.doubts import Doubt, doubts
from limitsets.scene.reading import structure_of
from limitsets.scene.scene import Scene
from limitsets.scene.starting import example_at
from limitsets.scene.validation import Tree, plain, refusals, respelled

__all__ = ["examined"]

# Without these there is no scene; all other tables can be left out to look at the rest.
NEEDED = ("name", "part", "arm", "throw")

# On these hangs the shape of all else: no other value may stand for them.
SHAPES = (("part",), ("arm", "length"))

# What stands for a table that is refused, since others need one.
INSTEAD = {"throw": {"kappa": "25 in"}, "gravity": {"tilt": "30 deg"}}

# The words of a key: in quotation marks, a number, or plain.
_WORDS = re.compile(r'"([^"]*)"|\[(\d+)\]|([^.\[\]"]+)')

Words: TypeAlias = tuple[str | int, ...]


def examined(source: str | Path | Mapping[str, Any]) -> tuple[tuple[SceneError, ...], tuple[Doubt, ...]]:
    """Find all that is wrong with a scene, and what is improbable in it.

    Words, values and units are looked at all together.  Contradictions are met one after another, each with another
    value in place of the one before and of what was refused; no shape is invented, so that a part whose words are
    wrong hides them.  A wrong number of a list hides those after it.

    Parameters
    ----------
    source : str, Path or mapping
        As for `limitsets.load`.

    Returns
    -------
    (tuple of SceneError, tuple of Doubt)
        What is wrong, empty for a scene that loads; and what is improbable, where part, arm, throw and gravity are not
        wrong.

    Examples
    --------
    >>> wrong = {"part": {"sides": ["5 in"]}, "arm": {"length": 28}, "throw": {"kapa": "25 in"}}
    >>> [error.key for error in examined(wrong)[0]][:4]
    ['throw.kapa', 'arm.length', 'part.mass', 'arm.surface_height']
    """
    try:
        structure, file = structure_of(source)
        tree, found = respelled(plain(structure, file), file)
    except SceneError as error:  # no file, no TOML: there is nothing more to look at
        return (error,), ()
    refused = refusals(tree, file)[1]
    found += refused
    blamed = {_path_of(error) for error in refused}
    looked_at = _mended(tree, blamed)
    if looked_at is None:
        return tuple(found), ()
    while (wrong := _first(looked_at, file)) is not None:
        path = _path_of(wrong)
        if not any(path[: len(each)] == each for each in blamed):
            found.append(wrong)
            blamed.add(path)
        after = _passed(looked_at, wrong, file)
        if after is None:
            return tuple(found), ()
        looked_at = after
    if any(path[0] in ("part", "arm", "throw", "gravity") for path in blamed):
        return tuple(found), ()
    return tuple(found), doubts(Scene.of(looked_at, file))


def _path_of(error: SceneError) -> Words:
    """Take a key apart."""
    return tuple(part[0] or part[2] or int(part[1]) for part in _WORDS.findall(error.key or ""))


def _mended(tree: Tree, blamed: Iterable[Words]) -> Tree | None:
    """Put the schema's examples in place of what was refused; None where the shape of part or arm hangs on it."""
    tree = copy.deepcopy(tree)
    for path in blamed:
        if any(path[: len(each)] == each[: len(path)] for each in SHAPES):
            return None
        first = str(path[0])
        if first in INSTEAD:
            tree[first] = INSTEAD[first]
        elif first == "tolerance" and len(path) > 1:
            tree[first].pop(path[1], None)
        else:
            path, example = example_at(path)
            _at(tree, path[:-1])[path[-1]] = example
    return tree


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
    path = _path_of(error)
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


def _at(tree: Any, path: Words) -> Any:
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
