"""Validate a TOML structure against the schema; every error is a `SceneError`."""

from __future__ import annotations

import copy
import difflib
import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, TypeAlias, get_args

from limitsets.base.errors import SceneError, shown
from limitsets.feeder.scene.units import UNITS

if TYPE_CHECKING:
    from limitsets.feeder.scene.schema import SceneTable, Table


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
    text = f'"{text}"' if "." in text else text  # the name of a quantity
    return f"{key}.{text}" if key else text


def validate(tree: Tree, file: str | None) -> SceneTable:
    """Check keys, types, numbers and units of a scene.

    Raises
    ------
    SceneError
        For the first thing wrong, in the order of `refusals`.
    """
    table, errors = refusals(tree, file)
    if table is None or errors:
        raise errors[0]
    return table


def refusals(tree: Tree, file: str | None) -> tuple[SceneTable | None, list[SceneError]]:
    """Check a scene's words: its tables, and all that is wrong.

    Unknown keys come first, then values, missing keys, and words that exclude or lack each other.
    """
    model, table, wrong = _read(tree)
    rank = {"extra_forbidden": 0, "missing": 2}
    wrong.sort(key=lambda problem: rank.get(problem["type"], 1))
    errors = [_refusal(problem, model, tree, file) for problem in wrong]
    return table, [*errors, *_contradictions(tree, file)]


def respelled(tree: Tree, file: str | None) -> tuple[Tree, list[SceneError]]:
    """Tell of all unknown keys, each under the name that it is like, where that is free, or else left out."""
    model, _, wrong = _read(tree)
    unknown = [problem for problem in wrong if problem["type"] == "extra_forbidden"]
    errors = [_refusal(problem, model, tree, file) for problem in unknown]
    tree = copy.deepcopy(tree)
    for problem in unknown:
        meant = _meant(problem["loc"], model, tree)
        node = _table_of(problem["loc"], tree)
        value = node.pop(problem["loc"][-1])
        if meant:
            node[meant] = value
    return tree, errors


def _table_of(path: tuple[str | int, ...], tree: Tree) -> Any:
    node: Any = tree
    for word in path[:-1]:
        node = node[word]
    return node


def _meant(path: tuple[str | int, ...], model: type[SceneTable], tree: Tree) -> str | None:
    """Say which free key an unknown one may stand for: one that is like it, else the only one that is missing."""
    node, table = _table_of(path, tree), _table_beside(path, model)
    free = [name for name in sorted(table.model_fields) if name not in node]
    missing = [name for name in free if table.model_fields[name].is_required()]
    near = difflib.get_close_matches(str(path[-1])[:64], free, n=1)
    return near[0] if near else missing[0] if len(missing) == 1 and len(path) > 1 else None


def _read(tree: Tree) -> tuple[type[SceneTable], SceneTable | None, list[Any]]:
    """Read a scene by the schema: the schema, the tables or None, and what is wrong in pydantic's words."""
    # pydantic takes 0.1 s to import
    from pydantic import ValidationError

    from limitsets.feeder.scene.schema import scene_table

    on = tree.get("effects")
    model = scene_table(with_effects=isinstance(on, dict) and bool(on.keys() - {"auto", "contact"}))
    try:
        return model, model.model_validate(tree), []
    except ValidationError as error:
        return model, None, list(error.errors(include_url=False))


# Tables with one of two words each, and what they are about.
_ONE_OF = {
    "part": ("the shape", "sides", "vertices", "sides = [three lengths] or vertices = [[x, y], ...]"),
    "gravity": ("gravity", "acceleration", "tilt", "acceleration or tilt"),
    "throw": ("the throw", "kappa", "speed", "kappa or speed"),
}


def _contradictions(tree: Tree, file: str | None) -> Iterator[SceneError]:
    """Refuse words that exclude each other, half a description, or none; for this no value has to be right."""
    for key, (thing, one, other, allowed) in _ONE_OF.items():
        if not isinstance(tree.get(key), dict):
            continue
        given = [word for word in (one, other) if word in tree[key]]
        if len(given) != 1:
            words = " and ".join(given) or f"neither {one} nor {other}"
            remedy = "give one of them, not both" if given else "give one of them"
            yield SceneError(thing, shown(words), allowed, remedy, key=key, file=file)
        elif given == ["speed"] and "gravity" not in tree:
            allowed = "acceleration or tilt in [gravity]"
            remedy = "a throw given by its speed needs it; add [gravity], or give throw.kappa"
            yield SceneError("gravity", "missing", allowed, remedy, key="throw.speed", file=file)
    mass = tree["part"].get("mass") if isinstance(tree.get("part"), dict) else None
    if isinstance(mass, dict):
        yield from _contradictions_of_mass(mass, file)


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


def _refusal(problem: Any, table: type[SceneTable], tree: Tree, file: str | None) -> SceneError:
    kind, path = problem["type"], problem["loc"]
    key = ""
    for word in path:
        key = _joined(key, word)
    context = problem.get("ctx", {})
    value = shown(problem["input"])
    if kind == "refused":
        return SceneError(context["thing"], value, context["allowed"], context["remedy"], key=key, file=file)
    if kind == "extra_forbidden":
        return _unknown(path, key, table, tree, file)
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


def _unknown(
    path: tuple[str | int, ...], key: str, table: type[SceneTable], tree: Tree, file: str | None
) -> SceneError:
    names = sorted(_table_beside(path, table).model_fields)
    word = str(path[-1])
    meant = _meant(path, table, tree)
    near = [meant] if meant else difflib.get_close_matches(word[:64], names, n=1, cutoff=0.0)
    return SceneError(
        "the key",
        shown(word),
        ", ".join(names),
        f"it is not known; did you mean {near[0]!r}?" if near else "it is not known; leave it out",
        key=key,
        file=file,
    )


def _table_beside(path: tuple[str | int, ...], table: type[Table]) -> type[Table]:
    """Give the table in which an unknown key stands."""
    for word in path[:-1]:
        if isinstance(word, str):
            table = next(model for model in _models_in(table.model_fields[word].annotation))
    return table


def _models_in(annotation: Any) -> list[Any]:
    from limitsets.feeder.scene.schema import Table

    if isinstance(annotation, type) and issubclass(annotation, Table):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]
