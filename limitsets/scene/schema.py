"""The schema of a scene as pydantic models: all keys and their allowed values.

Values remain text; `build` gives them units.  Each leaf type carries the allowed values and the remedy, so that errors
about types, ranges and units read alike.  Goals, facts and effects are those
that are declared.  Only `validation` imports this file, lazily: pydantic takes 0.1 s.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import MISSING
from typing import Annotated, Any, TypeAlias

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, create_model
from pydantic_core import PydanticCustomError

from limitsets.errors import SceneError
from limitsets.goals import GOALS, Goal, words_of
from limitsets.scene.facts import FACTS, Fact
from limitsets.scene.units import density_dimension, parse

__all__ = ["SceneTable", "Table", "scene_table"]


def _refusal(thing: str, allowed: str, remedy: str) -> PydanticCustomError:
    return PydanticCustomError("refused", "{thing}", {"thing": thing, "allowed": allowed, "remedy": remedy})


def _quantity(dimension: str) -> BeforeValidator:
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


def _number(thing: str, most: float, example: str) -> BeforeValidator:
    def fits(value: object) -> bool:
        return isinstance(value, float | int) and not isinstance(value, bool) and 0 <= value <= most

    return _fitting(fits, thing, f"a number from 0 to {most:g}, without a unit", f"write it like {example}")


def _word(*words: str) -> BeforeValidator:
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


Length: TypeAlias = Annotated[str, _quantity("length")]
Pair: TypeAlias = Annotated[list[Length], Field(min_length=2, max_length=2)]
Angle: TypeAlias = Annotated[str, _quantity("angle")]
AngularSpeed: TypeAlias = Annotated[str, _quantity("angular speed")]
Acceleration: TypeAlias = Annotated[str, _quantity("acceleration")]
Mass: TypeAlias = Annotated[str, _quantity("mass")]
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
Flight: TypeAlias = Annotated[str, _word("exact", "small-angle", "small-angle-2")]
Flip: TypeAlias = Annotated[str, _word("signed", "energy")]
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


class Table(BaseModel):
    """A table of a scene: no key but those named, no value converted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, defer_build=True)


class CenterTable(Table):
    """Centre of mass, measured from the left end of a side that lies at the bottom."""

    side: SideNumber
    along: Length
    above: Length


class PointTable(Table):
    """A point mass, in the frame of the vertices; a triangle given by sides lies on side 0, from the origin."""

    x: Length
    y: Length
    mass: Mass


class MassTable(Table):
    """Centre and radius of gyration, or a plate with point masses."""

    center: CenterTable | None = None
    radius_of_gyration: Length | None = None
    plate_density: Density | None = None
    plate_thickness: Length | None = None
    points: Annotated[list[PointTable], Field(max_length=1000)] | None = None


class PartTable(Table):
    """Shape and mass of the part."""

    sides: Annotated[list[Length], Field(max_length=1000)] | None = None
    vertices: Annotated[list[Pair], Field(max_length=1000)] | None = None
    mass: MassTable


class ArmTable(Table):
    """The arm; the unit of its length is the scene's unit."""

    surface_height: Length
    length: Length


class ThrowTable(Table):
    """The throw, by kappa or by its angular speed."""

    kappa: Length | None = None
    speed: AngularSpeed | None = None


class GravityTable(Table):
    """Gravity in the plane of the motion."""

    acceleration: Acceleration | None = None
    tilt: Angle | None = None


class ModelTable(Table):
    """Which formulas."""

    flight: Flight = "exact"
    flip: Flip = "signed"


class GoalTable(Table):
    """What is asked of the feeder: one goal of those declared, and of what."""

    from_anywhere: Flag = False


class SensorTable(Table):
    """A question that is answered with yes or no: beyond a place, or on a side."""

    beyond: Length | None = None
    error: Length | None = None
    side: SideNumber | None = None


class ChosenThrowTable(Table):
    """A throw to choose, by kappa or by its angular speed."""

    name: Name
    kappa: Length | None = None
    speed: AngularSpeed | None = None


class FeedbackTable(Table):
    """What a controller has: a sensor of one bit, and throws."""

    sensor: SensorTable | None = None
    throws: Annotated[list[ChosenThrowTable], Field(min_length=1, max_length=16)]


class ScatterTable(Table):
    """Noise at every throw."""

    speed: Deviation | None = None
    landing: Deviation | None = None


class WorldTable(Table):
    """Facts, whether or not an effect uses them: numbers of those declared, and the scatter."""

    scatter: ScatterTable | None = None


class CavityTable(Table):
    """The cavity at the end of the arm."""

    position: Length
    width: Length
    depth: Length
    angle: Angle


class TrayTable(Table):
    """A plate with equal depressions."""

    depression_width: Length
    depression_depth: Length
    pitch: Length
    agitation: Length
    wash: Length


class EffectsTable(Table):
    """What is simulated beyond the minimal model: effects of those declared."""

    contact: Flag = False  # by the engine alone: the map is the same
    auto: Flag = False


class SceneTable(Table):
    """A whole scene."""

    name: Name
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
    tolerance: dict[str, Deviation] = Field(default_factory=dict)
    feedback: FeedbackTable | None = None


WRITTEN: dict[str, Any] = {
    "place": Length,
    "side": SideNumber,
    "sides": Annotated[list[SideNumber], Field(min_length=1, max_length=1000)],
    "flag": Flag,
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


def _fact_field(fact: Fact) -> Any:
    if fact.dimension:
        return Annotated[str, _quantity(fact.dimension)]
    return Annotated[float, _number(fact.thing, fact.most, fact.words)]


def scene_table(*, with_effects: bool) -> type[SceneTable]:
    """Put the declared goals, facts and, where the scene switches any on, effects into the tables that have them."""
    effects: dict[str, tuple[str, ...]] = {}
    if with_effects:
        from limitsets.thrower.effects import EFFECTS  # lazily: its room loads numba

        effects = {name: effect.words for name, effect in EFFECTS.items()}
    return _scene_table(tuple(GOALS.values()), tuple(FACTS.items()), tuple(effects.items()))


@functools.cache
def _scene_table(
    goals: tuple[type[Goal], ...],
    facts: tuple[tuple[str, Fact], ...],
    effects: tuple[tuple[str, tuple[str, ...]], ...],
) -> type[SceneTable]:
    fields: dict[type[Table], dict[str, Any]] = {
        GoalTable: {goal.kind: (_goal_field(goal) | None, None) for goal in goals},
        WorldTable: {name: (_fact_field(fact) | None, None) for name, fact in facts},
        EffectsTable: {
            name: (Annotated[str, _word(*words)] | None, None) if words else (Flag, False)
            for name, words in effects
        },
    }
    tables: list[Any] = [create_model(base.__name__, __base__=base, **more) for base, more in fields.items()]
    goal, world, on = tables
    whole: type[SceneTable] = create_model(
        "SceneTable",
        __base__=SceneTable,
        goal=(goal | None, None),
        world=(world, Field(default_factory=world)),
        effects=(on, Field(default_factory=on)),
    )
    return whole
