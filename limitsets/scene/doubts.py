"""What is improbable in a scene: values that most often have a wrong unit.  They are told, and not refused."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, TypeAlias

from limitsets.geometry.mass import mass_of
from limitsets.scene.quantities import find
from limitsets.scene.scene import Scene, turns
from limitsets.scene.units import convert, density_dimension, exact_factor, parse

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


# Key, value as written, what is measured of it, least and largest that is believed, what it comes to, what is usual.
Row: TypeAlias = tuple[str, str, float, float, float, str, str]


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
    found: dict[str, Doubt] = {}
    for key, value, measured, least, most, thing, usual in _rows(scene):
        if not least <= measured <= most and not (key.startswith("throw.") and "arm.length" in found):
            thing = thing.format(f"{measured:.3g}" if measured < 1000 else f"{measured:.0f}")
            found.setdefault(key, Doubt(key, thing, value, usual, "has it the right unit?", scene.file))
    return tuple(found.values())


def _rows(scene: Scene) -> Iterator[Row]:
    """Give what is measured of a scene."""
    text, unit, metre = scene.text, scene.unit, float(exact_factor(scene.unit, "m"))
    part, throw, mass = text["part"], text["throw"], text["part"]["mass"]
    arm, size, over = scene.arm_length, float(scene.sides.length.max()), "{} times the part's longest side"
    shape = "part.sides" if "sides" in part else "part.vertices"
    yield shape, f"{size:.4g} {unit}", size * metre, 1e-4, 1.0, "the longest side is {} m", "1 mm to 0.5 m"
    yield "arm.length", text["arm"]["length"], arm * metre, 1e-3, 3.0, "the arm is {} m long", "1 cm to 2 m"
    yield "arm.length", text["arm"]["length"], arm / size, 0.0, 40.0, over, "2 to 10 times"
    height = abs(scene.surface_height) / size
    yield "arm.surface_height", text["arm"]["surface_height"], height, 0.0, 0.5, over, "below 0.5 times"
    if "center" in mass:
        reach = max(math.dist(scene.centre, vertex) for vertex in scene.vertices.tolist())
        key, radius = "part.mass.radius_of_gyration", scene.radius_of_gyration / reach
        said = "{} times the way from the centre of mass to the farthest vertex"
        yield key, mass["radius_of_gyration"], radius, 0.02, 1.0, said, "0.2 to 0.7 times"
    else:
        yield from _rows_of_plate(mass, (scene.vertices * metre).tolist(), size * metre)
    if scene.gravity is not None:
        ((word, given),) = text["gravity"].items()
        pull = scene.gravity * metre
        said = "gravity in the plane of the motion is {} m/s^2"
        yield f"gravity.{word}", given, pull, 0.3, 11.0, said, "0.5 to 9.81 m/s^2"
    ((word, given),) = throw.items()
    speeds = [f"{_in_words(scene, word, share):.3g}" for share in USUAL_TURNS]
    here = f"{USUAL_TURNS[0]} to {USUAL_TURNS[1]} times, here {' to '.join(speeds)}"
    unit_of_throw = "deg/s" if word == "speed" else unit
    said = "a part thrown from the arm's end turns {} times before it lands"
    turned = turns(arm, scene.kappa)
    yield f"throw.{word}", given, turned, LEAST_TURNS, MOST_TURNS, said, f"{here} {unit_of_throw}"
    for name, deviation in scene.tolerance.items():
        key, given = f'tolerance."{name}"', text["tolerance"][name]
        if find(name).dimension == "length" and not deviation.relative and name != "throw.kappa":
            yield key, given, deviation.value / size, 0.0, 0.25, over, "below 0.05 times"
        elif deviation.relative or name != "gravity.tilt" or "tilt" in text["gravity"]:
            share = deviation.value if deviation.relative else deviation.value / abs(scene.value(name))
            yield key, given, share, 0.0, 0.5, "{} times the value itself", "below 0.1 times"
    scatter = scene.world.scatter
    speed = None if scatter is None else scatter.speed
    # a throw given by kappa without gravity has no speed
    if speed is not None and (speed.relative or scene.gravity is not None):
        share = speed.value if speed.relative else speed.value / scene.value("throw.speed")
        said, given = "{} times the speed itself", text["world"]["scatter"]["speed"]
        yield "world.scatter.speed", given, share, 0.0, 0.2, said, "below 0.03 times"
    if scatter is not None and scatter.landing is not None:
        given = text["world"]["scatter"]["landing"]
        yield (
            "world.scatter.landing",
            given,
            scatter.landing.value / size,
            0.0,
            0.25,
            over,
            "below 0.05 times",
        )
    # what a fact of the world is measured in, and what is believed of it
    facts = {
        "friction": (1.0, 0.0, 3.0, "a coefficient of {}", "0.1 to 1"),
        "bounce_threshold": (size, 0.0, 0.25, over, "below 0.05 times"),
        "throw_rate": (1.0, 0.01, 20.0, "{} throws a second", "0.1 to 10"),
    }
    for name, (one, least, most, said, usual) in facts.items():
        if name in text.get("world", {}):
            given, measured = str(text["world"][name]), getattr(scene.world, name) / one
            yield f"world.{name}", given, measured, least, most, said, usual


def _in_words(scene: Scene, word: str, turned: float) -> float:
    """Give kappa [length], or the speed [deg/s], with which a part thrown from the arm's end turns so often."""
    kappa = scene.kappa * turns(scene.arm_length, scene.kappa) / turned
    if word == "kappa" or scene.gravity is None:
        return kappa
    return math.degrees(math.sqrt(scene.gravity / kappa))


def _rows_of_plate(mass: Mapping[str, Any], vertices: list[Any], size: float) -> Iterator[Row]:
    """Give what is measured of a plate with point masses; vertices and size in metres."""
    text, thickness = mass["plate_density"], 1.0
    volume = density_dimension(text) == "mass per volume"
    unit = "kg/m^3" if volume else "kg/m^2"
    density = convert(parse(text, density_dimension(text)), unit)
    least, most, usual = (10.0, 25e3, "500 to 8000 kg/m^3") if volume else (0.02, 1e3, "0.5 to 80 kg/m^2")
    yield "part.mass.plate_density", text, density, least, most, f"the plate has {{}} {unit}", usual
    if volume:
        thickness = convert(parse(mass["plate_thickness"], "length"), "m")
        said = "{} times the part's longest side"
        key = "part.mass.plate_thickness"
        yield key, mass["plate_thickness"], thickness / size, 0.0, 0.5, said, "below 0.2 times"
    plate = mass_of(vertices, density * thickness).mass
    said = f"{{}} times the plate, which weighs {1000.0 * plate:.3g} g"
    for k, point in enumerate(mass.get("points", ())):
        given, key = point["mass"], f"part.mass.points[{k}].mass"
        yield key, given, convert(parse(given, "mass"), "kg") / plate, 0.0, 30.0, said, "up to a few times it"
