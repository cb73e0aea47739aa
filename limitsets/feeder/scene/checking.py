"""All that is wrong with a scene, and what is improbable, at once."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from limitsets.base import SceneError, TipsError
from limitsets.feeder.geometry import mass_of
from limitsets.feeder.scene.facts import TIPPING, Scatter
from limitsets.feeder.scene.numbers import hull_of
from limitsets.feeder.scene.quantities import Words, at, find, key_words
from limitsets.feeder.scene.reading import structure_of
from limitsets.feeder.scene.scene import Scene, turns
from limitsets.feeder.scene.starting import example_at
from limitsets.feeder.scene.units import convert, density_dimension, exact_factor, parse
from limitsets.feeder.scene.validation import Tree, plain, refusals, respelled

# ----------------------------------------------------------------
# What is improbable in a scene: values that most often have a wrong unit.  They are told, and not refused.


# A speed in deg/s for rad/s turns a part by 1/3000 of what is usual, one in rpm for deg/s 36 times as far.
LEAST_TURNS, MOST_TURNS = 0.005, 4
USUAL_TURNS = (0.05, 1)


class Doubt(NamedTuple):
    """An improbable value, in the words of an error.

    Parameters
    ----------
    key : str
        Where it stands.
    thing, value : str
        What it comes to, and how it is written.
    allowed, remedy : str
        What is usual, and what to look at.
    file : str or None
        The file.
    """

    key: str
    thing: str
    value: str
    allowed: str
    remedy: str
    file: str | None

    def __str__(self) -> str:
        place = f"{self.file}: {self.key}" if self.file else self.key
        return f"{place}: careful, {self.value!r}: {self.thing}; usual: {self.allowed}; {self.remedy}"


# Key, what is measured of its value, least and largest that is believed, what it comes to, what is usual.
Row: TypeAlias = tuple[str, float, float, float, str, str]


def doubts(scene: Scene) -> tuple[Doubt, ...]:
    """Find what is improbable in a scene: the first of each key.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> doubts(load("paper-designed"))
    ()
    >>> doubts(load("paper-designed").with_values({"arm.surface_height": "-0.2 m"}))[0].thing
    "1.17 times the part's longest side"
    """
    by_key: dict[str, Doubt] = {}
    size = f"{scene.sides.length.max():.4g} {scene.unit}"
    for key, measured, least, most, thing, usual in _rows(scene):
        if not least <= measured <= most and not (key.startswith("throw.") and "arm.length" in by_key):
            thing = thing.format(f"{measured:.3g}" if measured < 1000 else f"{measured:.0f}")
            text = at(scene.text, key_words(key))
            value = size if isinstance(text, list) else str(text)
            by_key.setdefault(key, Doubt(key, thing, value, usual, "has it the right unit?", scene.file))
    return tuple(by_key.values())


def _rows(scene: Scene) -> Iterator[Row]:
    """Give what is measured of a scene."""
    text, unit, metre = scene.text, scene.unit, float(exact_factor(scene.unit, "m"))
    part, (word,) = text["part"], text["throw"]
    arm, size, over = scene.arm_length, float(scene.sides.length.max()), "{} times the part's longest side"
    shape = "part.sides" if "sides" in part else "part.vertices"
    yield shape, size * metre, 1e-4, 1.0, "the longest side is {} m", "1 mm to 0.5 m"
    yield "arm.length", arm * metre, 1e-3, 3.0, "the arm is {} m long", "1 cm to 2 m"
    yield "arm.length", arm / size, 0.0, 40.0, over, "2 to 10 times"
    yield "arm.surface_height", abs(scene.surface_height) / size, 0.0, 0.5, over, "below 0.5 times"
    if "center" in part["mass"]:
        reach = max(math.dist(scene.centre, vertex) for vertex in scene.vertices.tolist())
        key, radius = "part.mass.radius_of_gyration", scene.radius_of_gyration / reach
        said = "{} times the way from the centre of mass to the farthest vertex"
        yield key, radius, 0.02, 1.0, said, "0.2 to 0.7 times"
    else:
        yield from _rows_of_plate(scene, part["mass"], size)
    if scene.gravity is not None:
        (key,), said = text["gravity"], "gravity in the plane of the motion is {} m/s^2"
        yield f"gravity.{key}", scene.gravity * metre, 0.3, 11.0, said, "0.5 to 9.81 m/s^2"
    speeds = [f"{_in_words(scene, word, share):.3g}" for share in USUAL_TURNS]
    usual = f"{USUAL_TURNS[0]} to {USUAL_TURNS[1]} times, here {' to '.join(speeds)}"
    usual = f"{usual} {'deg/s' if word == 'speed' else unit}"
    said, turned = "a part thrown from the arm's end turns {} times before it lands", turns(arm, scene.kappa)
    yield f"throw.{word}", turned, LEAST_TURNS, MOST_TURNS, said, usual
    yield from _rows_of_what_varies(scene, size, over)


def _rows_of_what_varies(scene: Scene, size: float, over: str) -> Iterator[Row]:
    """Give what is measured of tolerances, of scatter and of the world; `size` is the part's longest side."""
    text, small = scene.text, "below 0.05 times"
    for name, deviation in scene.tolerance.items():
        key = f'tolerance."{name}"'
        if find(name).dimension == "length" and not deviation.relative and name != "throw.kappa":
            yield key, deviation.value / size, 0.0, 0.25, over, small
        elif deviation.relative or name != "gravity.tilt" or "tilt" in text["gravity"]:
            share = deviation.value if deviation.relative else deviation.value / abs(scene.value(name))
            yield key, share, 0.0, 0.5, "{} times the value itself", "below 0.1 times"
    scatter = scene.world.scatter or Scatter()
    speed, landing = scatter.speed, scatter.landing
    # a throw given by kappa without gravity has no speed
    if speed is not None and (speed.relative or scene.gravity is not None):
        share = speed.value if speed.relative else speed.value / scene.value("throw.speed")
        yield "world.scatter.speed", share, 0.0, 0.2, "{} times the speed itself", "below 0.03 times"
    if landing is not None:
        yield "world.scatter.landing", landing.value / size, 0.0, 0.25, over, small
    # what a fact of the world is measured in, and what is believed of it
    facts = {
        "friction": (1.0, 0.0, 3.0, "a coefficient of {}", "0.1 to 1"),
        "bounce_threshold": (size, 0.0, 0.25, over, small),
        "throw_rate": (1.0, 0.01, 20.0, "{} throws a second", "0.1 to 10"),
    }
    for name, (whole, *believed) in facts.items():
        if name in text.get("world", {}):
            yield f"world.{name}", getattr(scene.world, name) / whole, *believed


def _in_words(scene: Scene, word: str, turned: float) -> float:
    """Give kappa [length], or the speed [deg/s], with which a part thrown from the arm's end turns so often."""
    kappa = scene.kappa * turns(scene.arm_length, scene.kappa) / turned
    if word == "kappa" or scene.gravity is None:
        return kappa
    return math.degrees(math.sqrt(scene.gravity / kappa))


def _rows_of_plate(scene: Scene, mass: Mapping[str, Any], size: float) -> Iterator[Row]:
    """Give what is measured of a plate with point masses; `size` is the part's longest side."""
    text, thickness, metre = mass["plate_density"], 1.0, float(exact_factor(scene.unit, "m"))
    volume = density_dimension(text) == "mass per volume"
    unit = "kg/m^3" if volume else "kg/m^2"
    density = convert(parse(text, density_dimension(text)), unit)
    least, most, usual = (10.0, 25e3, "500 to 8000 kg/m^3") if volume else (0.02, 1e3, "0.5 to 80 kg/m^2")
    yield "part.mass.plate_density", density, least, most, f"the plate has {{}} {unit}", usual
    if volume:
        thickness, said = (
            convert(parse(mass["plate_thickness"], "length"), "m"),
            "{} times the part's longest side",
        )
        yield "part.mass.plate_thickness", thickness / (size * metre), 0.0, 0.5, said, "below 0.2 times"
    plate = mass_of(scene.outline.tolist(), density * thickness * metre**2, holes=scene.holes).mass
    said = f"{{}} times the plate, which weighs {1000.0 * plate:.3g} g"
    for k, point in enumerate(mass.get("points", ())):
        share = convert(parse(point["mass"], "mass"), "kg") / plate
        yield f"part.mass.points[{k}].mass", share, 0.0, 30.0, said, "up to a few times it"


# ----------------------------------------------------------------
# All that is wrong with a scene, and what is improbable, at once.


# Without these there is no scene; all other tables can be left out to look at the rest.
NEEDED = ("name", "part", "arm", "throw")

# On these hangs the shape of all else: no other value may stand for them.
SHAPES = (("part",), ("arm", "length"))

# What stands for a table that is refused, since others need one.
INSTEAD = {"throw": {"kappa": "25 in"}, "gravity": {"tilt": "30 deg"}}


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
        tree, errors = respelled(plain(structure, file), file)
        while inner := respelled(tree, file)[1]:  # in a table whose own name was misspelt
            tree, errors = respelled(tree, file)[0], errors + inner
    except SceneError as error:  # no file, no TOML: there is nothing more to look at
        return (error,), ()
    refused = refusals(tree, file)
    errors += refused
    blamed = {_path_of(error) for error in refused}
    looked_at = _mended(tree, blamed)
    if looked_at is None:
        return tuple(errors), ()
    instead: set[Words] = set()
    while (wrong := _first(looked_at, file)) is not None:
        path = _path_of(wrong)
        # a tolerance of what is blamed already is not given only because something stands in for that
        about = {path, key_words(str(path[1]))} if path[0] == "tolerance" and len(path) == 2 else {path}
        if not any(each[: len(one)] == one for each in about for one in (*blamed, *instead)):
            errors.append(wrong)
            blamed.add(path)
            instead |= _hanging_on(wrong)
        after = _passed(looked_at, wrong, file)
        if after is None:
            return tuple(errors), ()
        looked_at = after
    # the masses by which a part tips over are looked at, what stands in for another value is not
    tips = {_path_of(error) for error in errors if isinstance(error, TipsError)}
    if any(path[0] in ("part", "arm", "throw", "gravity") for path in blamed - tips):
        return tuple(errors), ()
    return tuple(errors), doubts(Scene.of(looked_at, file))


def _path_of(error: SceneError) -> Words:
    return key_words(error.key or "")


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
            at(tree, path[:-1])[path[-1]] = example
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
    for stand_in in _shapes(tree, error) if path == ("part", "vertices") else _stand_ins(at(tree, path)):
        other = copy.deepcopy(tree)
        node = at(other, path[:-1])
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
