"""Names of quantities, one list for scenes, calls, commands and JSON; and their text as numbers in the scene's unit."""

from __future__ import annotations

import copy
import difflib
import functools
import numbers
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

from limitsets.base import GeometryError, SceneError, shown
from limitsets.feeder.scene.facts import Deviation
from limitsets.feeder.scene.units import Quantity, convert, parse, written
from limitsets.feeder.scene.validation import Tree

NAMES: dict[str, str] = {
    "throw.speed": "angular speed",
    "throw.kappa": "length",
    "part.mass.center.along": "length",
    "part.mass.center.above": "length",
    "part.mass.radius_of_gyration": "length",
    "part.mass.points[i].x": "length",
    "part.mass.points[i].y": "length",
    "part.mass.points[i].mass": "mass",
    "part.sides[i]": "length",
    "part.vertices[i].x": "length",
    "part.vertices[i].y": "length",
    "arm.surface_height": "length",
    "arm.length": "length",
    "gravity.acceleration": "acceleration",
    "gravity.tilt": "angle",
    "landing.x": "length",
}
"""The quantities and their dimensions; i stands for a number."""

STANDARD_GRAVITY = "9.80665 m/s^2"

# a scene gives one of each pair; naming the other replaces it
_RIVALS = {
    "throw.speed": "throw.kappa",
    "throw.kappa": "throw.speed",
    "gravity.acceleration": "gravity.tilt",
    "gravity.tilt": "gravity.acceleration",
}
NOISE_ONLY = "landing.x"

# Units in which people read what a scene does not give.
READ_IN = {"angular speed": "deg/s", "angle": "deg"}


class Place(NamedTuple):
    """Where a quantity stands in a scene, and its dimension."""

    name: str
    path: tuple[str | int, ...]
    dimension: str


def find(name: object, *, key: str | None = None, file: str | None = None) -> Place:
    """Look a name up.

    Raises
    ------
    SceneError
        No quantity bears this name; the nearest one is named.

    Examples
    --------
    >>> find("part.vertices[3].y").path
    ('part', 'vertices', 3, 1)
    """
    text = name if isinstance(name, str) else ""
    place = _place_of(text)
    if place is None:
        near = difflib.get_close_matches(_pattern_of(text)[:64], NAMES, n=1, cutoff=0.3)
        remedy = f"did you mean {near[0]!r}?" if near else "name one of these, a scene's"
        raise SceneError("the quantity", shown(name), ", ".join(NAMES), remedy, key=key, file=file)
    return place


def _pattern_of(text: str) -> str:
    return re.sub(r"\[(0|[1-9][0-9]{0,3})\]", "[i]", text)


@functools.lru_cache(maxsize=1024)  # a scene is read many times in a search: this took a fifth of the reading
def _place_of(text: str) -> Place | None:
    pattern = _pattern_of(text)
    if pattern not in NAMES or "[i]" in text:
        return None
    path = list(key_words(text))
    if path[1] == "vertices":
        path[-1] = "xy".index(str(path[-1]))
    return Place(text, tuple(path), NAMES[pattern])


def base_unit(dimension: str, unit: str) -> str:
    """Give the unit in which a scene of a length unit holds values of a dimension.

    Examples
    --------
    >>> base_unit("acceleration", "in"), base_unit("angular speed", "in")
    ('in/s^2', 'rad/s')
    """
    return {
        "angle": "rad",
        "angular speed": "rad/s",
        "acceleration": f"{unit}/s^2",
        "mass": "kg",
        "mass per area": f"kg/{unit}^2",
        "mass per volume": f"kg/{unit}^3",
        "frequency": "Hz",
        "share": "",
    }.get(dimension, unit)


def text_at(tree: Mapping[str, Any], name: str) -> Any:
    """Return what stands in a scene's text under the name of a quantity; None if nothing does.

    Examples
    --------
    >>> text_at({"part": {"vertices": [["0 in", "1 in"]]}}, "part.vertices[0].y")
    '1 in'
    """
    return at(tree, find(name).path)


def unit_read(tree: Mapping[str, Any], length: str, name: str) -> str:
    """Give the unit in which people read a quantity of a scene: that of the scene's text, or the usual one.

    Examples
    --------
    >>> unit_read({"throw": {"speed": "2 rad/s"}}, "in", "throw.speed"), unit_read({}, "in", "throw.speed")
    ('rad/s', 'deg/s')
    """
    place, given = find(name), text_at(tree, name)
    if given is not None:
        return parse(given, place.dimension, key=name).unit
    return READ_IN.get(place.dimension) or base_unit(place.dimension, length)


def texts(tree: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Walk a scene's text, or what stands in it under `name`: the quantities in it by name, and what is written there.

    Examples
    --------
    >>> list(texts({"part": {"vertices": [["0 in", "1 in"]]}, "throw": {"kappa": "9 in"}}))[1:]
    [('part.vertices[0].y', '1 in'), ('throw.kappa', '9 in')]
    """
    if re.sub(r"\[[0-9]+\]", "[i]", name) in NAMES:
        yield name, tree
    elif isinstance(tree, Mapping):
        for word, inner in tree.items():
            yield from texts(inner, f"{name}.{word}" if name else word)
    elif isinstance(tree, list):
        corner = name.startswith("part.vertices[")
        for k, inner in enumerate(tree):
            yield from texts(inner, f"{name}.{'xy'[k]}" if corner else f"{name}[{k}]")


def require(tree: Tree, name: str, key: str, file: str | None) -> None:
    """Refuse a quantity of a part that this scene describes in other words, or that the part does not have."""
    place = find(name, key=key, file=file)
    if place.path[0] == "part" and text_at(tree, name) is None:
        raise SceneError(
            "the quantity",
            name,
            "the quantities that this scene is written in",
            "this scene does not give it",
            key=key,
            file=file,
        )


def in_units(unit: str, name: str, value: float | str, *, key: str | None = None) -> float:
    """Give a quantity, a number or text with a unit, in the units of a scene of this unit of length."""
    if not isinstance(value, str):
        return float(value)
    dimension = find(name).dimension
    return convert(parse(value, dimension, key=key), base_unit(dimension, unit))


def replaced(text: Mapping[str, Any], unit: str, file: str | None, values: Mapping[str, float | str]) -> Tree:
    """Write new values into a copy of a scene's text (`Scene.with_values`)."""
    tree = copy.deepcopy(dict(text))
    for name, value in values.items():
        place = find(name, file=file)
        rival = _RIVALS.get(name)
        if name == NOISE_ONLY or rival in values:
            remedy = (
                "it names the noise of landings only"
                if rival is None
                else f"leave out one of {name}, {rival}"
            )
            raise SceneError("the quantity", name, "quantities that can be set", remedy, key=name, file=file)
        require(tree, name, name, file)
        if rival is not None:
            section, other = rival.split(".")
            tree.get(section, {}).pop(other, None)
        node: Any = tree
        for word in place.path[:-1]:
            node = node.setdefault(word, {}) if isinstance(node, dict) else node[word]
        node[place.path[-1]] = _as_text(value, place, unit, file)
    return tree


def _as_text(value: object, place: Place, length: str, file: str | None) -> str:
    unit = base_unit(place.dimension, length)
    if isinstance(value, str):
        quantity = parse(value, place.dimension, key=place.name, file=file)
        # the scene keeps its unit, which is that of the arm's length
        changes_unit = place.name == "arm.length" and quantity.unit != unit
        return written(convert(quantity, unit), unit) if changes_unit else value
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        try:
            return written(float(value), unit)
        except OverflowError:
            pass
    raise SceneError(
        f"this {place.dimension}",
        shown(value),
        f'a number [{unit}] or text "<decimal number> <unit>"',
        "give one of these",
        key=place.name,
        file=file,
    )


def parsed_deviation(text: object, name: str, *, key: str | None = None, file: str | None = None) -> Quantity:
    """Take the text of a deviation apart: a share, or a number with a unit of the quantity's own dimension.

    Examples
    --------
    >>> parsed_deviation("1%", "throw.speed"), parsed_deviation("0.5\u00b0", "gravity.tilt")
    (Quantity(number='1', unit='%'), Quantity(number='0.5', unit='deg'))
    """
    place = find(name, key=key, file=file)
    # where a landing is measured from is a convention: a share of it means nothing
    relative = isinstance(text, str) and text.rstrip().endswith("%") and name != NOISE_ONLY
    return parse(text, "share" if relative else place.dimension, share=name != NOISE_ONLY, key=key, file=file)


def deviation(
    text: object,
    name: str,
    unit: str,
    *,
    zero: bool = False,
    key: str | None = None,
    file: str | None = None,
) -> Deviation:
    """Read a symmetric deviation of a quantity, in percent or with a unit.

    Parameters
    ----------
    text : object
        ``"1 %"`` or ``"0.02 in"``.
    name : str
        The quantity.
    unit : str
        The scene's unit of length.
    zero : bool
        Whether a deviation of zero is allowed.
    key, file : str, optional
        Where it stands, for the error.

    Returns
    -------
    Deviation

    Raises
    ------
    SceneError
        No deviation, a wrong dimension, a negative one, or 100 % and more.

    Examples
    --------
    >>> deviation("1 %", "throw.speed", "in"), deviation("2.54 cm", "arm.length", "in")
    (Deviation(value=0.01, relative=True), Deviation(value=1.0, relative=False))
    """
    given = parsed_deviation(text, name, key=key, file=file)
    relative = given.unit == "%"
    dimension = "share" if relative else find(name).dimension
    value = convert(given, base_unit(dimension, unit))
    if value < 0 or (value == 0 and not zero) or (relative and value >= 1):
        least = "from 0" if zero else "above 0"
        allowed = f"{least}{' and below 100 %' if relative else ''}"
        raise SceneError(f"the deviation of {name}", text, allowed, "correct it", key=key, file=file)
    return Deviation(value, relative)


# ----------------------------------------------------------------
# Convert text to numbers in the scene's unit; every error names its place in the file.


LEAST = 1e-12
"""Least size of what has to be above 0, in the scene's units."""


# The words of a key: in quotation marks, a number, or plain.
_WORDS = re.compile(r'"([^"]*)"|\[(\d+)\]|([^.\[\]"]+)')

Words: TypeAlias = tuple[str | int, ...]


@functools.lru_cache(maxsize=1024)
def key_words(key: str) -> Words:
    """Take a key apart.

    Examples
    --------
    >>> key_words('tolerance."part.sides[1]"'), key_words("goal.flip_order[1]")
    (('tolerance', 'part.sides[1]'), ('goal', 'flip_order', 1))
    """
    return tuple(part[0] or part[2] or int(part[1]) for part in _WORDS.findall(key))


def at(tree: Any, words: Words) -> Any:
    """Return what stands there, None where nothing does; the coordinates of a pair are x and y."""
    try:
        for word in words:
            tree = tree["xy".index(str(word)) if isinstance(tree, list) and word in ("x", "y") else word]
    except (KeyError, IndexError, TypeError):
        return None
    return tree


@dataclass(frozen=True)
class Resolver:
    """Knows a scene's text, its unit of length and its file.

    Parameters
    ----------
    tree : mapping
        The scene as text, its words checked.
    unit : str
        The scene's unit of length.
    file : str or None
        Where the scene was read from.
    """

    tree: Tree
    unit: str
    file: str | None

    def text(self, key: str) -> Any:
        """Give what stands at a key."""
        return at(self.tree, key_words(key))

    def value(self, key: str, dimension: str, text: str | None = None) -> float:
        """Give the quantity at a key, or one that stands for it, in the scene's units."""
        quantity = parse(text or self.text(key), dimension, key=key, file=self.file)
        return convert(quantity, base_unit(dimension, self.unit))

    def positive(self, key: str, dimension: str) -> float:
        """Give a quantity that has to be above 0, and far enough from it for its square to be a number."""
        value = self.value(key, dimension)
        allowed = "above 0" if value <= 0 else f"from {LEAST:g} {base_unit(dimension, self.unit)}"
        self.require(value >= LEAST, key, f"this {dimension}", allowed)
        return value

    def require(self, holds: bool, key: str, thing: str, allowed: str, remedy: str = "correct it") -> None:
        """Refuse what stands at a key where something does not hold of it."""
        if not holds:
            raise self.refusal(key, thing, self.text(key), allowed, remedy)

    def refusal(self, key: str, thing: str, value: object, allowed: str, remedy: str) -> SceneError:
        """Build the error for a key."""
        return SceneError(thing, shown(value), allowed, remedy, key=key, file=self.file)

    @contextmanager
    def at(self, key: str) -> Iterator[None]:
        """Give errors of the geometry their place and their unit."""
        try:
            yield
        except GeometryError as error:
            remedy = error.remedy.replace("[length]", self.unit)
            raise type(error)(
                error.thing, error.value, error.allowed, remedy, key=key, file=self.file
            ) from None
