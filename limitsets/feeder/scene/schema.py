"""The schema of a scene as pydantic models: leaf types, keys and their allowed values.

Every key says what it means, with an example: the words of `limitsets new`.  Goals, facts and effects are those that
are declared.  Only `validation` and `checking` import this file, lazily: pydantic takes 0.1 s.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import MISSING
from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model
from pydantic_core import PydanticCustomError

from limitsets.base.errors import SceneError
from limitsets.feeder.goals import GOALS, Goal, words_of
from limitsets.feeder.scene.facts import FACTS, Fact
from limitsets.feeder.scene.units import density_dimension, parse

# ----------------------------------------------------------------
# The leaf types of the schema: each carries the allowed values and the remedy, so that errors read alike.  Values
# remain text; `build` gives them units.


def _refusal(thing: str, allowed: str, remedy: str) -> PydanticCustomError:
    return PydanticCustomError("refused", "{thing}", {"thing": thing, "allowed": allowed, "remedy": remedy})


def quantity(dimension: str) -> BeforeValidator:
    """Take a number with a unit of a dimension."""
    return _quantity_of(lambda _: dimension)


def _quantity_of(dimension: Callable[[object], str]) -> BeforeValidator:
    def check(value: object) -> object:
        try:
            parse(value, dimension(value))
        except SceneError as error:
            raise _refusal(error.thing, error.allowed, error.remedy) from None
        return value

    return BeforeValidator(check)


def _fitting(fits: Callable[[Any], bool], thing: str, allowed: str, remedy: str) -> BeforeValidator:
    def check(value: object) -> object:
        if not fits(value):
            raise _refusal(thing, allowed, remedy)
        return value

    return BeforeValidator(check)


def number(thing: str, most: float, example: str) -> BeforeValidator:
    """Take a number without a unit."""

    def fits(value: object) -> bool:
        return isinstance(value, float | int) and not isinstance(value, bool) and 0 <= value <= most

    return _fitting(fits, thing, f"a number from 0 to {most:g}, without a unit", f"write it like {example}")


def word(*words: str) -> BeforeValidator:
    """Take one of a few words."""
    allowed = " or ".join(f'"{word}"' for word in words)
    return _fitting(lambda value: value in words, "this word", allowed, "write one of them")


def _is_side(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1000


def _is_name(value: object) -> bool:
    return (
        isinstance(value, str)
        and 0 < len(value) <= 64
        and value[0].isalnum()
        and all(sign.isalnum() or sign in " ._-" for sign in value)
    )


Length: TypeAlias = Annotated[str, quantity("length")]
Pair: TypeAlias = Annotated[list[Length], Field(min_length=2, max_length=2)]
Angle: TypeAlias = Annotated[str, quantity("angle")]
AngularSpeed: TypeAlias = Annotated[str, quantity("angular speed")]
Acceleration: TypeAlias = Annotated[str, quantity("acceleration")]
Mass: TypeAlias = Annotated[str, quantity("mass")]
Density: TypeAlias = Annotated[str, _quantity_of(density_dimension)]
Flag: TypeAlias = Annotated[
    bool,
    _fitting(lambda value: isinstance(value, bool), "this switch", "true or false", "write it unquoted"),
]
Yes: TypeAlias = Annotated[
    bool,
    _fitting(lambda value: value is True, "this goal", "true", "leave the line out if it is not asked for"),
]
SideNumber: TypeAlias = Annotated[
    int, _fitting(_is_side, "the side", "a whole number from 0", "count the sides in flip order")
]
Flight: TypeAlias = Annotated[str, word("exact", "small-angle", "small-angle-2")]
Flip: TypeAlias = Annotated[str, word("signed", "energy")]
Tips: TypeAlias = Annotated[str, word("moving", "rest")]
Deviation: TypeAlias = Annotated[
    str,
    _fitting(
        lambda value: isinstance(value, str),
        "this deviation",
        'text, "<decimal number> %" or "<decimal number> <unit>"',
        'write it like "1 %"; names with a point are quoted: "throw.speed" = "1 %"',
    ),
]
Name: TypeAlias = Annotated[
    str,
    _fitting(
        _is_name,
        "the name",  # it becomes part of file names
        "1 to 64 letters, digits, blanks and . _ -, beginning with a letter or digit",
        "choose such a name",
    ),
]


def says(text: str, example: object = None) -> Any:
    """Describe a key, with an example of its value: the words of `limitsets new`."""
    return Field(description=text, examples=None if example is None else [example])


# ----------------------------------------------------------------
# The schema of a scene as pydantic models: all keys and their allowed values.


class Table(BaseModel):
    """A table of a scene: no key but those named, no value converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)


class CenterTable(Table):
    """Centre of mass, measured from the left end of a side that lies at the bottom."""

    side: Annotated[SideNumber, says("the side that lies at the bottom", 2)]
    along: Annotated[Length, says("from that side's left end to below the centre of mass", "4.2 in")]
    above: Annotated[Length, says("height of the centre of mass above that side", "0.7 in")]


class PointTable(Table):
    """A point mass, in the frame of the vertices; a triangle given by sides lies on side 0, from the origin."""

    x: Annotated[Length, says("from the origin of the vertices", "4 in")]
    y: Annotated[Length, says("likewise", "0.5 in")]
    mass: Annotated[Mass, says("its mass", "60 g")]


class MassTable(Table):
    """Centre and radius of gyration, or a plate with point masses."""

    center: Annotated[CenterTable | None, says("the centre of mass; with radius_of_gyration")] = None
    radius_of_gyration: Annotated[Length | None, says("about the centre of mass", "1.25 in")] = None
    plate_density: Annotated[
        Density | None,
        says(
            "instead of both: a uniform plate of this mass per area, or per volume with plate_thickness",
            "3 kg/m^2",
        ),
    ] = None
    plate_thickness: Annotated[Length | None, says("of the plate, with a mass per volume", "2 mm")] = None
    points: Annotated[
        Annotated[list[PointTable], Field(max_length=1000)] | None, says("point masses on the plate")
    ] = None


class PartTable(Table):
    """Shape and mass of the part."""

    sides: Annotated[
        Annotated[list[Length], Field(max_length=1000)] | None,
        says("lengths of the sides of a triangle, in flip order", ["5.75 in", "3.6 in", "6.75 in"]),
    ] = None
    vertices: Annotated[
        Annotated[list[Pair], Field(max_length=1000)] | None,
        says(
            "instead of sides: [x, y] of each corner, counterclockwise, convex",
            [["0 in", "0 in"], ["5 in", "0 in"], ["6 in", "3 in"], ["1 in", "4 in"]],
        ),
    ] = None
    mass: MassTable


class ArmTable(Table):
    """The arm; the unit of its length is the scene's unit."""

    surface_height: Annotated[
        Length, says("height of the arm's surface above the joint, signed: negative is below", "-0.2 in")
    ]
    length: Annotated[
        Length, says("largest x at which a part can rest; its unit is the scene's unit", "28 in")
    ]


class ThrowTable(Table):
    """The throw, by kappa or by its angular speed."""

    kappa: Annotated[
        Length | None,
        says("gravity over the squared angular speed, a length; [gravity] then changes no throw", "25.4 in"),
    ] = None
    speed: Annotated[
        AngularSpeed | None,
        says("instead of kappa, with [gravity]: angular speed of the arm when it stops", "158 deg/s"),
    ] = None


class GravityTable(Table):
    """Gravity in the plane of the motion; with kappa given it only tells which speed that is."""

    acceleration: Annotated[Acceleration | None, says("in the plane of the motion", "193.045 in/s^2")] = None
    tilt: Annotated[Angle | None, says("instead: of the table; 90 deg stands upright", "30 deg")] = None


class ModelTable(Table):
    """Which formulas."""

    flight: Annotated[
        Flight, says('the equation of the flight: "exact", "small-angle" or "small-angle-2"', "exact")
    ] = "exact"
    flip: Annotated[Flip, says('when a part flips: "signed" or "energy"', "signed")] = "signed"


class GoalTable(Table):
    """What is asked of the feeder: one goal of those declared, and of what."""

    from_anywhere: Annotated[Flag, says("ask it of every start, not of the limit set alone", True)] = False


class SensorTable(Table):
    """A question that is answered with yes or no: beyond a place, or on a side."""

    beyond: Annotated[Length | None, says("is the part beyond this place?", "15 in")] = None
    error: Annotated[Length | None, says("within this distance the answer may be wrong", "0.1 in")] = None
    side: Annotated[SideNumber | None, says("instead of beyond: does the part lie on this side?", 2)] = None


class ChosenThrowTable(Table):
    """A throw to choose, by kappa or by its angular speed."""

    name: Annotated[Name, says("its name", "soft")]
    kappa: Annotated[Length | None, says("as in [throw]", "25.4 in")] = None
    speed: Annotated[AngularSpeed | None, says("as in [throw]", "158 deg/s")] = None


class FeedbackTable(Table):
    """What a controller has: a sensor of one bit, and throws."""

    sensor: Annotated[SensorTable | None, says("what is asked before each throw")] = None
    throws: Annotated[
        Annotated[list[ChosenThrowTable], Field(min_length=1, max_length=16)],
        says("the throws to choose from"),
    ]


class ScatterTable(Table):
    """Noise at every throw."""

    speed: Annotated[Deviation | None, says("deviation of the speed, at every throw", "0.5 %")] = None
    landing: Annotated[
        Deviation | None, says("deviation of the place of landing, at every throw", "0.5 mm")
    ] = None


class WorldTable(Table):
    """Facts, whether or not an effect uses them: numbers of those declared, and the scatter."""

    scatter: Annotated[ScatterTable | None, says("noise at every throw")] = None


class CavityTable(Table):
    """The cavity at the end of the arm."""

    position: Annotated[
        Length, says("where the arm ends: a part whose centre of mass rests beyond it falls in", "20 in")
    ]
    width: Annotated[Length, says("from the end of the arm to the far wall", "8 in")]
    depth: Annotated[Length, says("of the floor below the arm's surface", "2 in")]
    angle: Annotated[Angle, says("of the ramp from the end of the arm to the floor", "30 deg")]
    tips: Annotated[
        Tips,
        says('how a part begins to tip over the end: "moving", as it came down, or "rest"', "moving"),
    ] = "moving"


class TrayTable(Table):
    """A plate with equal depressions."""

    depression_width: Annotated[Length, says("of each depression", "7 in")]
    depression_depth: Annotated[Length, says("of each depression", "1 in")]
    pitch: Annotated[Length, says("from one depression to the next", "9 in")]
    agitation: Annotated[Length, says("how high a kick of one standard deviation throws a part", "0.3 in")]
    wash: Annotated[Length, says("a fall from this height ends at the largest speed along the plate", "2 in")]


class EffectsTable(Table):
    """What is simulated beyond the minimal model: effects of those declared."""

    contact: Annotated[
        Flag, says("parts meet each other, cavities and depressions, in the rigid-body engine", True)
    ] = False  # by the engine alone: the map is the same
    auto: Annotated[Flag, says("analyse switches on what the audit calls for", True)] = False


class SceneTable(Table):
    """A whole scene."""

    name: Annotated[Name, says("of the scene; part of file names", "mine")]
    part: PartTable
    arm: ArmTable
    throw: ThrowTable
    gravity: GravityTable | None = None
    model: ModelTable = Field(default_factory=ModelTable)
    goal: GoalTable | None = None
    cavity: CavityTable | None = None
    tray: TrayTable | None = None
    world: WorldTable = Field(default_factory=WorldTable)
    effects: EffectsTable = Field(default_factory=EffectsTable)
    tolerance: Annotated[
        dict[str, Deviation],
        says("deviations that a joint margin multiplies, by quantity", {"throw.speed": "1 %"}),
    ] = Field(default_factory=dict)
    feedback: FeedbackTable | None = None


WRITTEN: dict[str, Any] = {
    "place": Annotated[Length, says("distance from the joint", "20 in")],
    "side": Annotated[SideNumber, says("the side wanted", 2)],
    "sides": Annotated[
        list[SideNumber], Field(min_length=1, max_length=1000, description="the sides", examples=[[0, 1, 2]])
    ],
    "flag": Annotated[Flag, says("true or false", True)],
}
"""How a scene writes a field of a goal, by its word of `limitsets.goals.words_of`."""


def _goal_field(goal: type[Goal]) -> Any:
    """Type what is written after a goal's word: `true`, the one field it has, or a table of several."""
    words = words_of(goal)
    if not words:
        return Yes
    if len(words) == 1:
        return WRITTEN[next(iter(words.values()))]
    own = {name: goal.__dataclass_fields__[name].default for name in words}
    given = {
        name: (WRITTEN[word], ... if own[name] is MISSING else own[name]) for name, word in words.items()
    }
    return create_model(goal.__name__, __base__=Table, **given)  # type: ignore[call-overload]  # pydantic has no types for fields by name


def _first_line(goal: type[Goal]) -> str:
    return (goal.__doc__ or "").partition("\n")[0].rstrip(".")


def _lifted(assumption: str) -> str:
    return f"without it the model assumes: {assumption}"


def _fact_words(fact: Fact) -> Any:
    examples = {"length": "1 mm", "angle": "20 deg", "frequency": "2 Hz"}
    example = examples[fact.dimension] if fact.dimension else float(fact.words)
    return says(fact.meaning or fact.thing, example)


def _fact_field(fact: Fact) -> Any:
    if fact.dimension:
        return Annotated[str, quantity(fact.dimension)]
    return Annotated[float, number(fact.thing, fact.most, fact.words)]


def scene_table(*, with_effects: bool) -> type[SceneTable]:
    """Put the declared goals, facts and, where the scene switches any on, effects into the tables that have them."""
    effects: dict[str, tuple[tuple[str, ...], str]] = {}
    if with_effects:
        from limitsets.feeder.thrower.effects import EFFECTS  # lazily: its room loads numba

        effects = {name: (effect.words, effect.lifts) for name, effect in EFFECTS.items()}
    return _scene_table(tuple(GOALS.values()), tuple(FACTS.items()), tuple(effects.items()))


@functools.cache
def _scene_table(
    goals: tuple[type[Goal], ...],
    facts: tuple[tuple[str, Fact], ...],
    effects: tuple[tuple[str, tuple[tuple[str, ...], str]], ...],
) -> type[SceneTable]:
    fields: dict[type[Table], dict[str, Any]] = {
        GoalTable: {
            goal.kind: (Annotated[_goal_field(goal) | None, says(_first_line(goal))], None) for goal in goals
        },
        WorldTable: {
            name: (Annotated[_fact_field(fact) | None, _fact_words(fact)], None) for name, fact in facts
        },
        EffectsTable: {
            name: (Annotated[Annotated[str, word(*words)] | None, says(_lifted(lifts), words[0])], None)
            if words
            else (Annotated[Flag, says(_lifted(lifts), True)], False)
            for name, (words, lifts) in effects
        },
    }
    tables: list[Any] = [
        create_model(base.__name__, __base__=base, __doc__=base.__doc__, **more)
        for base, more in fields.items()
    ]
    goal, world, on = tables
    whole: type[SceneTable] = create_model(
        "SceneTable",
        __base__=SceneTable,
        goal=(goal | None, None),
        world=(world, Field(default_factory=world)),
        effects=(on, Field(default_factory=on)),
    )
    return whole
