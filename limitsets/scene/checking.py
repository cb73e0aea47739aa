"""All that is wrong with a scene, and what is improbable, at once."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from limitsets.errors import SceneError, TipsError
from limitsets.scene.doubts import Doubt, doubts
from limitsets.scene.facts import TIPPING
from limitsets.scene.floats import hull_of
from limitsets.scene.reading import structure_of
from limitsets.scene.scene import Scene
from limitsets.scene.starting import example_at
from limitsets.scene.units import convert, parse
from limitsets.scene.validation import Tree, plain, refusals, respelled

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
    value in place of the one before and of what was refused; of vertices that are not convex the hull stands in, and a
    part whose words are wrong hides them.  A wrong number of a list hides those after it.

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
        while inner := respelled(tree, file)[1]:  # in a table whose own name was misspelt
            tree, found = respelled(tree, file)[0], found + inner
    except SceneError as error:  # no file, no TOML: there is nothing more to look at
        return (error,), ()
    refused = refusals(tree, file)[1]
    found += refused
    blamed = {_path_of(error) for error in refused}
    looked_at = _mended(tree, blamed)
    if looked_at is None:
        return tuple(found), ()
    instead: set[Words] = set()
    while (wrong := _first(looked_at, file)) is not None:
        path = _path_of(wrong)
        # a tolerance of what is blamed already is not given only because something stands in for that
        about = {path, _words_of(str(path[1]))} if path[0] == "tolerance" and len(path) == 2 else {path}
        if not any(each[: len(one)] == one for each in about for one in (*blamed, *instead)):
            found.append(wrong)
            blamed.add(path)
            instead |= _hanging_on(wrong)
        after = _passed(looked_at, wrong, file)
        if after is None:
            return tuple(found), ()
        looked_at = after
    # the masses by which a part tips over are looked at, what stands in for another value is not
    tips = {_path_of(error) for error in found if isinstance(error, TipsError)}
    if any(path[0] in ("part", "arm", "throw", "gravity") for path in blamed - tips):
        return tuple(found), ()
    return tuple(found), doubts(Scene.of(looked_at, file))


def _path_of(error: SceneError) -> Words:
    return _words_of(error.key or "")


def _words_of(key: str) -> Words:
    """Take a key apart."""
    return tuple(part[0] or part[2] or int(part[1]) for part in _WORDS.findall(key))


def _hanging_on(error: SceneError) -> set[Words]:
    """Say of what nothing is told where another shape stands in for the vertices."""
    if error.key != "part.vertices" or error.value == "clockwise":
        return set()
    return {("part",), ("cavity",), ("tray",)}


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
    if isinstance(error, TipsError):
        on = tree.get("effects", {}) | dict.fromkeys(TIPPING, True)
        return None if on == tree.get("effects") else tree | {"model": {}, "effects": on}
    usable: list[Tree] = []
    for stand_in in _shapes(tree, error) if path == ("part", "vertices") else _stand_ins(_at(tree, path)):
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


def _shapes(tree: Tree, error: SceneError) -> Iterator[Any]:
    """Give vertices in the place of those that are no convex part: the other way round, or of the convex hull."""
    given = tree["part"]["vertices"]
    if error.value == "clockwise":
        yield given[::-1]
    else:
        numbers = [[convert(parse(text, "length"), "m") for text in pair] for pair in given]
        yield hull_of(given, np.array(numbers))


def _stand_ins(value: Any) -> Iterator[Any]:
    """Give values that may be right where this one is wrong, and None for nothing at all."""
    if isinstance(value, str):
        unit = value.lstrip("+-.0123456789eE ")
        yield from (f"{number} {unit}" for number in (1, 0, 1000))
    elif isinstance(value, int) and not isinstance(value, bool):
        yield from (0, 1)
    if value is not None:
        yield None
