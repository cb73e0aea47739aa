"""Validate a TOML structure against the schema; every error is a `SceneError`."""

from __future__ import annotations

import copy
import difflib
import math
import re
from collections.abc import Iterator
from typing import Any, NamedTuple, TypeAlias

from limitsets.base import SceneError, shown
from limitsets.feeder.scene.schema import FORMS, ByName, Section, Several, schema
from limitsets.feeder.scene.units import UNITS
from limitsets.feeder.world import FACTS

Tree: TypeAlias = dict[str, Any]
"""A scene as TOML holds it: tables, lists, text, switches and numbers."""

_DEEPEST = 8

_VERTEX = re.compile(r"part\.(holes\[\d+\]\.)?vertices\[\d+\]")


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
    if isinstance(value, str | bool | int) or (isinstance(value, float) and math.isfinite(value)):
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
        coordinate = _VERTEX.fullmatch(key) is not None and word < 2
        return f"{key}.{'xy'[word]}" if coordinate else f"{key}[{word}]"
    text = str(shown(word))
    text = f'"{text}"' if "." in text else text  # the name of a quantity
    return f"{key}.{text}" if key else text


class Unknown(NamedTuple):
    """A key that the schema does not know: the word, the table it stands in, and the schema's table for that place."""

    word: str
    table: Tree
    section: Section


class Wrong(NamedTuple):
    """What is wrong at a place of a scene.

    Parameters
    ----------
    rank : int
        0 for an unknown key, 1 for a value, 2 for a missing key, 3 for both of two that exclude each other, or neither:
        the order in which they are told.
    error : SceneError
        What is said of it.
    unknown : Unknown or None
        The unknown key.
    """

    rank: int
    error: SceneError
    unknown: Unknown | None = None


def validate(tree: Tree, file: str | None) -> None:
    """Check keys, types, numbers and units of a scene.

    Raises
    ------
    SceneError
        For the first thing wrong, in the order of `refusals`.
    """
    errors = refusals(tree, file)
    if errors:
        raise errors[0]


def refusals(tree: Tree, file: str | None) -> list[SceneError]:
    """Find all that is wrong with a scene's words.

    Unknown keys come first, then values, missing keys, and words that exclude or lack each other.
    """
    wrong = sorted(_wrong(tree, file), key=lambda each: each.rank)
    return [*(each.error for each in wrong), *_contradictions(tree, file)]


def respelled(tree: Tree, file: str | None) -> tuple[Tree, list[SceneError]]:
    """Tell of all unknown keys, each under the name that it is like, where that is free, or else left out."""
    tree, errors = copy.deepcopy(tree), []
    for _, error, unknown in list(_wrong(tree, file)):
        if unknown is not None:
            errors.append(error)
            meant = _meant(unknown)
            value = unknown.table.pop(unknown.word)
            if meant:
                unknown.table[meant] = value
    return tree, errors


def _wrong(tree: Tree, file: str | None) -> Iterator[Wrong]:
    """Check a scene by the schema, in the schema's order."""
    on, stated = (
        {*each} if isinstance(each := tree.get(word), dict) else set() for word in ("effects", "world")
    )
    unknown = (on - {"auto", "contact"}) | (stated - {"scatter", *FACTS})  # effects may know them
    return _wrong_in(tree, schema(with_effects=bool(unknown)), "", file)


def _wrong_in(value: Any, of: Any, key: str, file: str | None) -> Iterator[Wrong]:
    if callable(of):
        try:
            of(value, key, file)
        except SceneError as error:
            yield Wrong(1, error)
    elif isinstance(of, Section) and isinstance(value, dict):
        yield from _wrong_in_table(value, of, key, file)
    elif isinstance(of, Several) and isinstance(value, list):
        yield from _wrong_in_list(value, of, key, file)
    elif isinstance(of, ByName) and isinstance(value, dict):
        for name, inner in value.items():
            yield from _wrong_in(inner, of.of, _joined(key, name), file)
    else:
        wanted = "a list" if isinstance(of, Several) else "a table"
        yield Wrong(1, SceneError("this entry", shown(value), wanted, "write it so", key=key, file=file))


def _wrong_in_table(table: Tree, section: Section, key: str, file: str | None) -> Iterator[Wrong]:
    for name, entry in section.keys.items():
        if name in table:
            yield from _wrong_in(table[name], entry.of, _joined(key, name), file)
        elif entry.needed:
            place = _joined(key, name)
            yield Wrong(
                2, SceneError("a required key", "missing", "a value for it", "add it", key=place, file=file)
            )
    for word in [word for word in table if word not in section.keys]:
        unknown = Unknown(word, table, section)
        yield Wrong(0, _refusal(unknown, _joined(key, word), file), unknown)
    if section.either is not None:
        thing, words, allowed = section.either
        given = [word for word in words if word in table]
        said = " and ".join(given) or f"neither {' nor '.join(words)}"
        remedy = "give one of them, not both" if given else "give one of them"
        if len(given) != 1:
            yield Wrong(3, SceneError(thing, said, allowed, remedy, key=key, file=file))


def _wrong_in_list(entries: list[Any], several: Several, key: str, file: str | None) -> Iterator[Wrong]:
    count, wrong = len(entries), False
    for index, entry in enumerate(entries if count <= several.most else ()):
        for each in _wrong_in(entry, several.of, _joined(key, index), file):
            yield each
            wrong = True
    if count > several.most or (count < several.least and not wrong):
        allowed = f"at least {several.least}" if count < several.least else f"at most {several.most}"
        remedy = "correct the list"
        yield Wrong(1, SceneError("the number of entries", count, allowed, remedy, key=key, file=file))


def _meant(unknown: Unknown) -> str | None:
    """Say which free key an unknown one may stand for: one that is like it, else the only one that is missing."""
    keys = unknown.section.keys
    free = [name for name in sorted(keys) if name not in unknown.table]
    missing = [name for name in free if keys[name].needed and "part" not in keys]  # not a whole table
    near = difflib.get_close_matches(unknown.word[:64], free, n=1)
    return near[0] if near else missing[0] if len(missing) == 1 else None


def _refusal(unknown: Unknown, key: str, file: str | None) -> SceneError:
    names, meant = sorted(unknown.section.keys), _meant(unknown)
    near = [meant] if meant else difflib.get_close_matches(unknown.word[:64], names, n=1, cutoff=0.0)
    remedy = f"it is not known; did you mean {near[0]!r}?" if near else "it is not known; leave it out"
    return SceneError("the key", shown(unknown.word), ", ".join(names), remedy, key=key, file=file)


def _contradictions(tree: Tree, file: str | None) -> Iterator[SceneError]:
    """Refuse half a description, or words that exclude each other; for this no value has to be right."""
    throw = tree.get("throw")
    if isinstance(throw, dict) and "speed" in throw and "gravity" not in tree:
        remedy = "a throw given by its speed needs it; add [gravity], or give throw.kappa"
        allowed = "acceleration or tilt in [gravity]"
        yield SceneError("gravity", "missing", allowed, remedy, key="throw.speed", file=file)
    for name, forms in FORMS.items():
        if isinstance(tree.get(name), dict):
            yield from _contradictions_of_form(name, tree[name], forms, file)
    part = tree["part"] if isinstance(tree.get("part"), dict) else {}
    mass, holes = part.get("mass"), part.get("holes")
    if isinstance(mass, dict):
        yield from _contradictions_of_mass(mass, file)
        yield from _contradictions_of_holes(holes if isinstance(holes, list) else [], mass, file)


def _contradictions_of_form(
    name: str, table: Tree, forms: dict[str, tuple[str, ...]], file: str | None
) -> Iterator[SceneError]:
    """Refuse the shape of a cavity or a depression that lacks a key, or has one of another way to give it."""
    given = [form for form in forms if form in table]
    if len(given) != 1:  # refused already
        return
    needed = forms[given[0]]
    for word in (word for word in needed if word not in table):
        remedy = f"{given[0]} needs it: add it"
        yield SceneError(
            "a required key", "missing", "a value for it", remedy, key=f"{name}.{word}", file=file
        )
    known = {"side", *(word for words in forms.values() for word in words)}
    for word in sorted(known & {*table} - {*needed} - ({"side"} if given == ["outline"] else set())):
        said, allowed = f"beside {given[0]}", " and ".join([given[0], *needed])
        yield SceneError("this key", said, allowed, "leave it out", key=f"{name}.{word}", file=file)


def _contradictions_of_mass(mass: Tree, file: str | None) -> Iterator[SceneError]:
    """Refuse a mass that is both measured and computed from a plate, or neither."""
    measured: list[str] = [name for name in ("center", "radius_of_gyration") if name in mass]
    made: list[str] = [name for name in ("plate_density", "plate_thickness", "points") if name in mass]
    allowed = "center and radius_of_gyration, or plate_density and points"
    if measured and made:
        words = " and ".join(measured + made)
        remedy = "give one of the two, not both: a point mass beside a measured part is added to it by hand, by the "
        remedy += "parallel-axis rule (docs/scene.md)"
        yield SceneError("the mass", shown(words), allowed, remedy, key="part.mass", file=file)
    elif len(measured) == 1 or (not measured and "plate_density" not in made):
        words = f"only {' and '.join(measured + made)}" if measured or made else "empty"
        yield SceneError("the mass", shown(words), allowed, "add what is missing", key="part.mass", file=file)
    elif made:
        yield from _contradictions_of_plate(mass["plate_density"], mass.get("plate_thickness"), file)


def _contradictions_of_holes(holes: list[Any], mass: Tree, file: str | None) -> Iterator[SceneError]:
    """Refuse a circle without its centre or a polygon with one, and holes in a part whose mass is measured."""
    for k, hole in enumerate(each for each in holes if isinstance(each, dict)):
        if ("diameter" in hole) != ("center" in hole):
            said = "diameter without center" if "diameter" in hole else "center without diameter"
            allowed, remedy = (
                "center and diameter of a circle, or vertices",
                "give the two of them, or vertices alone",
            )
            yield SceneError("the hole", said, allowed, remedy, key=f"part.holes[{k}]", file=file)
    if holes and "center" in mass:
        remedy = "center and radius_of_gyration that are measured have them already: leave the holes out"
        yield SceneError(
            "holes", "beside a measured mass", "holes in a plate", remedy, key="part.holes", file=file
        )


def _contradictions_of_plate(density: object, thickness: object, file: str | None) -> Iterator[SceneError]:
    """Refuse a mass per volume without a thickness, and a mass per area with one."""
    key, keys = "part.mass.plate_density", "part.mass.plate_thickness"
    unit = str(density).strip(" ").rpartition(" ")[2]
    if unit in UNITS["mass per volume"] and thickness is None:
        allowed, remedy = (
            "a mass per area, or a mass per volume with plate_thickness",
            f'add {keys}, like "2 mm"',
        )
        yield SceneError("this density", shown(density), allowed, remedy, key=key, file=file)
    if unit in UNITS["mass per area"] and thickness is not None:
        allowed = "one beside a mass per volume"
        remedy = (
            f"{density} holds the thickness already: leave it out, or give the density in kg/m^3 or g/cm^3"
        )
        yield SceneError("the thickness", shown(thickness), allowed, remedy, key=keys, file=file)
