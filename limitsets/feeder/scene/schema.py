"""The schema of a scene: its tables, their keys, what each means with an example, and what its value has to be.

Every key says what it means: the words of `limitsets new`.  Goals, facts and effects are those that are declared.
Values remain text; `build` gives them units.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import MISSING
from typing import Any, NamedTuple, TypeAlias

from limitsets.base import SceneError, shown
from limitsets.feeder.goals import GOALS, Goal, words_of
from limitsets.feeder.scene.units import UNITS, density_dimension, parse
from limitsets.feeder.world import FACTS, Fact

# ----------------------------------------------------------------
# What a value has to be: each check carries the allowed values and the remedy, so that errors read alike.


Check: TypeAlias = Callable[[Any, str, str | None], object]
"""Refuse a value that stands at a key of a file."""


class Key(NamedTuple):
    """A key of a table.

    Parameters
    ----------
    of : callable, Several, Section or ByName
        What its value has to be.
    says : str
        What it means; a table says it by itself.
    example : object
        A value; a switch and a table need none.
    needed : bool
        Whether it has to be there.
    """

    of: Any
    says: str = ""
    example: Any = None
    needed: bool = False


class Either(NamedTuple):
    """Keys of which a table has one: what they are about, the keys, and what is allowed."""

    thing: str
    words: tuple[str, ...]
    allowed: str


class Section(NamedTuple):
    """A table of a scene: no key but these."""

    says: str
    keys: dict[str, Key]
    either: Either | None = None


class Several(NamedTuple):
    """A list of values of one kind, and how many there may be."""

    of: Any
    least: int = 0
    most: int = 1000


class ByName(NamedTuple):
    """A table with values of one kind, whose keys are checked elsewhere."""

    of: Check


def quantity(dimension: str) -> Check:
    """Take a number with a unit of a dimension."""
    return lambda value, key, file: parse(value, dimension, key=key, file=file)


def fitting(fits: Callable[[Any], bool], thing: str, allowed: str, remedy: str) -> Check:
    """Take what fits."""

    def check(value: Any, key: str, file: str | None) -> None:
        if not fits(value):
            raise SceneError(thing, shown(value), allowed, remedy, key=key, file=file)

    return check


def number(thing: str, most: float, example: str) -> Check:
    """Take a number without a unit."""

    def fits(value: Any) -> bool:
        return isinstance(value, float | int) and not isinstance(value, bool) and 0 <= value <= most

    return fitting(fits, thing, f"a number from 0 to {most:g}, without a unit", f"write it like {example}")


def word(*words: str) -> Check:
    """Take one of a few words."""
    allowed = " or ".join(f'"{word}"' for word in words)
    return fitting(lambda value: value in words, "this word", allowed, "write one of them")


def _density(value: Any, key: str, file: str | None) -> None:
    parse(value, density_dimension(value), key=key, file=file)


def _is_side(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1000


def _is_name(value: Any) -> bool:
    return (
        isinstance(value, str)
        and 0 < len(value) <= 64
        and value[0].isalnum()
        and all(sign.isalnum() or sign in " ._-" for sign in value)
    )


LENGTH, ANGLE, SPEED = quantity("length"), quantity("angle"), quantity("angular speed")
FLAG = fitting(lambda value: isinstance(value, bool), "this switch", "true or false", "write it unquoted")
YES = fitting(lambda value: value is True, "this goal", "true", "leave the line out if it is not asked for")
SIDE = fitting(_is_side, "the side", "a whole number from 0", "count the sides in flip order")
DEVIATION = fitting(
    lambda value: isinstance(value, str),
    "this deviation",
    'text, "<decimal number> %" or "<decimal number> <unit>"',
    'write it like "1 %"; names with a point are quoted: "throw.speed" = "1 %"',
)
NAME = fitting(
    _is_name,
    "the name",  # it becomes part of file names
    "1 to 64 letters, digits, blanks and . _ -, beginning with a letter or digit",
    "choose such a name",
)


# ----------------------------------------------------------------
# The tables of a scene.


CENTER = Section(
    "Centre of mass, measured from the left end of a side that lies at the bottom.",
    {
        "side": Key(SIDE, "the side that lies at the bottom", 2, needed=True),
        "along": Key(LENGTH, "from that side's left end to below the centre of mass", "4.2 in", needed=True),
        "above": Key(LENGTH, "height of the centre of mass above that side", "0.7 in", needed=True),
    },
)
POINT = Section(
    "A point mass, in the frame of the vertices; a triangle given by sides lies on side 0, from the origin.",
    {
        "x": Key(LENGTH, "from the origin of the vertices", "4 in", needed=True),
        "y": Key(LENGTH, "likewise", "0.5 in", needed=True),
        "mass": Key(quantity("mass"), "its mass", "60 g", needed=True),
    },
)
MASS = Section(
    "Centre and radius of gyration, or a plate with point masses.",
    {
        "center": Key(CENTER, "the centre of mass; with radius_of_gyration"),
        "radius_of_gyration": Key(LENGTH, "about the centre of mass", "1.25 in"),
        "plate_density": Key(
            _density,
            "instead of both: a uniform plate of this mass per area, or per volume with plate_thickness",
            "3 kg/m^2",
        ),
        "plate_thickness": Key(LENGTH, "of the plate, with a mass per volume", "2 mm"),
        "points": Key(Several(POINT), "point masses on the plate"),
    },
)
PLACE = Section(
    "A place in the frame of the vertices.",
    {
        "x": Key(LENGTH, "from the origin of the vertices", "30 mm", needed=True),
        "y": Key(LENGTH, "likewise", "20 mm", needed=True),
    },
)
HOLE = Section(
    "A hole in a plate: a circle, or a polygon.",
    {
        "center": Key(PLACE, "of a circle"),
        "diameter": Key(LENGTH, "of a circle", "8 mm"),
        "vertices": Key(
            Several(Several(LENGTH, 2, 2)),
            "instead: [x, y] of each corner of a polygon, counterclockwise",
            [["20 mm", "10 mm"], ["30 mm", "10 mm"], ["30 mm", "16 mm"]],
        ),
    },
    Either("the hole", ("diameter", "vertices"), "center and diameter, or vertices"),
)
PART = Section(
    "Shape and mass of the part.",
    {
        "sides": Key(
            Several(LENGTH),
            "lengths of the sides of a triangle, in flip order",
            ["5.75 in", "3.6 in", "6.75 in"],
        ),
        "vertices": Key(
            Several(Several(LENGTH, 2, 2)),
            "instead of sides: [x, y] of each corner, counterclockwise; a plate may be concave",
            [["0 in", "0 in"], ["5 in", "0 in"], ["6 in", "3 in"], ["1 in", "4 in"]],
        ),
        "holes": Key(Several(HOLE), "holes in a plate"),
        "mass": Key(MASS, needed=True),
    },
    Either("the shape", ("sides", "vertices"), "sides = [three lengths] or vertices = [[x, y], ...]"),
)
ARM = Section(
    "The arm; the unit of its length is the scene's unit.",
    {
        "surface_height": Key(
            LENGTH,
            "height of the arm's surface above the joint, signed: negative is below",
            "-0.2 in",
            needed=True,
        ),
        "length": Key(
            LENGTH, "largest x at which a part can rest; its unit is the scene's unit", "28 in", needed=True
        ),
    },
)
THROW = Section(
    "The throw, by kappa or by its angular speed.",
    {
        "kappa": Key(
            LENGTH,
            "gravity over the squared angular speed, a length; [gravity] then changes no throw",
            "25.4 in",
        ),
        "speed": Key(
            SPEED, "instead of kappa, with [gravity]: angular speed of the arm when it stops", "158 deg/s"
        ),
    },
    Either("the throw", ("kappa", "speed"), "kappa or speed"),
)
GRAVITY = Section(
    "Gravity in the plane of the motion; with kappa given it only tells which speed that is.",
    {
        "acceleration": Key(quantity("acceleration"), "in the plane of the motion", "193.045 in/s^2"),
        "tilt": Key(ANGLE, "instead: of the table; 90 deg stands upright", "30 deg"),
    },
    Either("gravity", ("acceleration", "tilt"), "acceleration or tilt"),
)
MODEL = Section(
    "Which formulas.",
    {
        "flight": Key(
            word("exact", "small-angle", "small-angle-2"),
            'the equation of the flight: "exact", "small-angle" or "small-angle-2"',
            "exact",
        ),
        "flip": Key(word("signed", "energy"), 'when a part flips: "signed" or "energy"', "signed"),
    },
)
GOAL = Section(
    "What is asked of the feeder: one goal of those declared, and of what.",
    {"from_anywhere": Key(FLAG, "ask it of every start, not of the limit set alone", True)},
)
SENSOR = Section(
    "A question that is answered with yes or no: beyond a place, or on a side.",
    {
        "beyond": Key(LENGTH, "is the part beyond this place?", "15 in"),
        "error": Key(LENGTH, "within this distance the answer may be wrong", "0.1 in"),
        "side": Key(SIDE, "instead of beyond: does the part lie on this side?", 2),
    },
    Either("the sensor", ("beyond", "side"), "beyond or side: it answers one question"),
)
CHOSEN_THROW = Section(
    "A throw to choose, by kappa or by its angular speed.",
    {
        "name": Key(NAME, "its name", "soft", needed=True),
        "kappa": Key(LENGTH, "as in [throw]", "25.4 in"),
        "speed": Key(SPEED, "as in [throw]", "158 deg/s"),
    },
    Either("this throw", ("kappa", "speed"), "kappa or speed"),
)
FEEDBACK = Section(
    "What a controller has: a sensor of one bit, and throws.",
    {
        "sensor": Key(SENSOR, "what is asked before each throw"),
        "throws": Key(Several(CHOSEN_THROW, 1, 16), "the throws to choose from", needed=True),
    },
)
SCATTER = Section(
    "Noise at every throw.",
    {
        "speed": Key(DEVIATION, "deviation of the speed, at every throw", "0.5 %"),
        "landing": Key(DEVIATION, "deviation of the place of landing, at every throw", "0.5 mm"),
    },
)
WORLD = Section(
    "Facts, whether or not an effect uses them: numbers of those declared, and the scatter.",
    {"scatter": Key(SCATTER, "noise at every throw")},
)
CAVITY = Section(
    "The cavity at the end of the arm.",
    {
        "position": Key(
            LENGTH,
            "where the arm ends: a part whose centre of mass rests beyond it falls in",
            "20 in",
            needed=True,
        ),
        "width": Key(LENGTH, "from the end of the arm to the far wall; with depth and angle", "8 in"),
        "depth": Key(LENGTH, "of the floor below the arm's surface", "2 in"),
        "angle": Key(ANGLE, "of the ramp from the end of the arm to the floor", "30 deg"),
        "vertices": Key(
            Several(Several(LENGTH, 2, 2), 3),
            "instead of these: [x, y] of each corner of the ground, from the end of the arm outward and upward",
            [["0 in", "0 in"], ["6 in", "-4 in"], ["9 in", "-4 in"], ["9 in", "0 in"]],
        ),
        "outline": Key(
            word("part"), "instead of width and depth: the part itself, its wanted side on the ramp", "part"
        ),
        "play": Key(LENGTH, "with outline: between the part and the ground, all around", "0.5 mm"),
        "side": Key(SIDE, "with outline: the side on the ramp; default: that of the goal", 2),
        "tips": Key(
            word("moving", "rest"),
            'how a part begins to tip over the end: "moving", as it came down, or "rest"',
            "moving",
        ),
    },
    Either(
        "the cavity",
        ("width", "vertices", "outline"),
        "width, depth and angle, or vertices, or outline, angle and play",
    ),
)
TRAY = Section(
    "A plate with equal depressions.",
    {
        "depression_width": Key(LENGTH, "of each depression; with depression_depth", "7 in"),
        "depression_depth": Key(LENGTH, "of each depression", "1 in"),
        "vertices": Key(
            Several(Several(LENGTH, 2, 2), 3),
            "instead of both: [x, y] of each corner of a depression, from its left edge at 0, 0 to its right one",
            [["0 in", "0 in"], ["1 in", "-1 in"], ["8 in", "-1 in"], ["8 in", "0 in"]],
        ),
        "outline": Key(word("part"), "instead of depression_width: the part itself, lying on a side", "part"),
        "play": Key(LENGTH, "with outline: between the part and the walls", "0.5 mm"),
        "side": Key(SIDE, "with outline: the side on the floor; default: that of the goal", 2),
        "pitch": Key(LENGTH, "from one depression to the next", "9 in", needed=True),
        "agitation": Key(
            LENGTH, "how high a kick of one standard deviation throws a part", "0.3 in", needed=True
        ),
        "wash": Key(
            LENGTH, "a fall from this height ends at the largest speed along the plate", "2 in", needed=True
        ),
    },
    Either(
        "a depression",
        ("depression_width", "vertices", "outline"),
        "depression_width and depression_depth, or vertices, or outline, depression_depth and play",
    ),
)
FORMS: dict[str, dict[str, tuple[str, ...]]] = {
    "cavity": {"width": ("depth", "angle"), "vertices": (), "outline": ("angle", "play")},
    "tray": {
        "depression_width": ("depression_depth",),
        "vertices": (),
        "outline": ("depression_depth", "play"),
    },
}
"""By table the ways to give its shape, and the keys that each of them needs; the other keys here it may not have."""
EFFECTS = Section(
    "What is simulated beyond the minimal model: effects of those declared.",
    {
        # by the engine alone: the map is the same
        "contact": Key(
            FLAG, "parts meet each other, cavities and depressions, in the rigid-body engine", True
        ),
        "auto": Key(FLAG, "analyse switches on what the audit calls for", True),
    },
)


# ----------------------------------------------------------------
# Goals, facts and effects that are declared, and the whole.


WRITTEN: dict[str, Key] = {
    "place": Key(LENGTH, "distance from the joint", "20 in"),
    "side": Key(SIDE, "the side wanted", 2),
    "sides": Key(Several(SIDE, 1), "the sides", [0, 1, 2]),
    "flag": Key(FLAG, "true or false", True),
}
"""How a scene writes a field of a goal, by its word of `limitsets.goals.words_of`."""


def _goal_key(goal: type[Goal]) -> Key:
    """Say what is written after a goal's word: `true`, the one field it has, or a table of several."""
    words, says = words_of(goal), (goal.__doc__ or "").partition("\n")[0].rstrip(".")
    if not words:
        return Key(YES, says, True)
    if len(words) == 1:
        return WRITTEN[next(iter(words.values()))]._replace(says=says)
    fields = goal.__dataclass_fields__
    return Key(
        Section(
            says,
            {
                name: WRITTEN[word]._replace(needed=fields[name].default is MISSING)
                for name, word in words.items()
            },
        ),
        says,
    )


def _fact_key(fact: Fact) -> Key:
    says = fact.meaning or fact.thing
    if not fact.dimension:
        return Key(number(fact.thing, fact.most, fact.words), says, float(fact.words))
    example = {"length": "1 mm", "angle": "20 deg", "frequency": "2 Hz"}.get(fact.dimension)
    return Key(quantity(fact.dimension), says, example or f"1 {UNITS[fact.dimension][0]}")


def _effect_key(words: tuple[str, ...], assumption: str) -> Key:
    example = words[0] if words else True
    return Key(word(*words) if words else FLAG, f"without it the model assumes: {assumption}", example)


def schema(*, with_effects: bool) -> Section:
    """Give the table that a whole scene is; the effects among its keys only where a scene switches any on."""
    effects: tuple[tuple[str, tuple[str, ...], str], ...] = ()
    if with_effects:
        from limitsets.feeder.thrower.effects import EFFECTS as DECLARED  # lazily: its room loads numba

        effects = tuple((name, effect.words, effect.lifts) for name, effect in DECLARED.items())
    return _schema(tuple(GOALS.values()), tuple(FACTS.items()), effects)


@functools.lru_cache(maxsize=8)
def _schema(
    goals: tuple[type[Goal], ...],
    facts: tuple[tuple[str, Fact], ...],
    effects: tuple[tuple[str, tuple[str, ...], str], ...],
) -> Section:
    asked = GOAL.keys | {goal.kind: _goal_key(goal) for goal in goals}
    known = WORLD.keys | {name: _fact_key(fact) for name, fact in facts}
    simulated = EFFECTS.keys | {name: _effect_key(words, lifts) for name, words, lifts in effects}
    return Section(
        "A whole scene.",
        {
            "name": Key(NAME, "of the scene; part of file names", "mine", needed=True),
            "part": Key(PART, needed=True),
            "arm": Key(ARM, needed=True),
            "throw": Key(THROW, needed=True),
            "gravity": Key(GRAVITY),
            "model": Key(MODEL),
            "goal": Key(GOAL._replace(keys=asked)),
            "cavity": Key(CAVITY),
            "tray": Key(TRAY),
            "world": Key(WORLD._replace(keys=known)),
            "effects": Key(EFFECTS._replace(keys=simulated)),
            "tolerance": Key(
                ByName(DEVIATION),
                "deviations that a joint margin multiplies, by quantity",
                {"throw.speed": "1 %"},
            ),
            "feedback": Key(FEEDBACK),
        },
    )
