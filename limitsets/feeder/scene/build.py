"""From a TOML structure to the fields of a `Scene`: goal, world, effects, units, and what contradicts what."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from limitsets.feeder.geometry import RestingSides
from limitsets.feeder.goals import GOALS, Goal, words_of
from limitsets.feeder.scene.facts import (
    FACTS,
    NOT_TIPPING,
    WITHOUT_EDGE,
    Deviation,
    Effects,
    Scatter,
    World,
)
from limitsets.feeder.scene.numbers import Floats
from limitsets.feeder.scene.quantities import Resolver, deviation, require
from limitsets.feeder.scene.surroundings import Feedback, resolve_cavity, resolve_feedback, resolve_tray
from limitsets.feeder.scene.units import parse
from limitsets.feeder.scene.validation import Tree, plain, validate

if TYPE_CHECKING:
    from limitsets.feeder.scene.schema import EffectsTable, GoalTable, SceneTable, WorldTable


# ----------------------------------------------------------------
# The goal, the world and the effects of a scene.


def resolve_goal(table: GoalTable, rests: list[bool], arm_length: float, resolver: Resolver) -> Goal:
    """Resolve ``[goal]`` for a part that rests on these of its sides."""
    named = [kind for kind in GOALS if getattr(table, kind) is not None]
    if len(named) != 1:
        kinds = " and ".join(named) or "none"
        raise resolver.refusal("goal", "the goal", kinds, f"one of {', '.join(GOALS)}", "name exactly one")

    def side(value: int, key: str) -> int:
        if value >= len(rests):
            allowed = f"0 to {len(rests) - 1}"
            raise resolver.refusal(key, "the side", value, allowed, "name a side of this part")
        if not rests[value]:
            allowed = ", ".join(str(each) for each, good in enumerate(rests) if good)
            raise resolver.refusal(
                key, "the side", value, allowed, "the part cannot rest on it; name another"
            )
        return value

    def position(text: str, key: str) -> float:
        x = resolver.value(text, "length", key)
        if not 0 <= x < arm_length:
            allowed = f"from 0 to below the arm's length, {arm_length:.9g} {resolver.unit}"
            raise resolver.refusal(
                key, "the position", text, allowed, "nothing comes to rest there; correct it"
            )
        return x

    def read(word: str, value: Any, key: str) -> Any:
        if word == "place":
            return position(value, key)
        if word == "sides":
            return tuple(side(each, f"{key}[{i}]") for i, each in enumerate(value))
        return side(value, key) if word == "side" else value

    goal, given, key = GOALS[named[0]], getattr(table, named[0]), f"goal.{named[0]}"
    words = words_of(goal)
    if len(words) == 1:  # it stands by itself
        ((name, word),) = words.items()
        values = {name: read(word, given, key)}
    else:
        values = {name: read(word, getattr(given, name), f"{key}.{name}") for name, word in words.items()}
    return goal(**values, from_anywhere=table.from_anywhere)  # type: ignore[call-arg]  # a kind is a dataclass


def resolve_world(table: WorldTable, resolver: Resolver) -> World:
    """Resolve ``[world]``."""
    scatter, facts, own = None, {}, {each.name for each in fields(World)}
    for name, fact in FACTS.items():
        given, key = getattr(table, name), f"world.{name}"
        if given is not None and fact.dimension:
            text, given = given, resolver.positive(given, fact.dimension, key)
            if not given < fact.most:
                raise resolver.refusal(key, fact.thing, text, fact.words, "correct it")
        if given is not None:
            facts[name] = given
    if table.scatter is not None and (table.scatter.speed or table.scatter.landing):
        scatter = Scatter(
            _noise(table.scatter.speed, "throw.speed", "world.scatter.speed", resolver),
            _noise(table.scatter.landing, "landing.x", "world.scatter.landing", resolver),
        )
    more = {name: facts.pop(name) for name in facts.keys() - own}
    return World(**facts, scatter=scatter, more=more)


def _noise(text: str | None, name: str, key: str, resolver: Resolver) -> Deviation | None:
    if text is None:
        return None
    return deviation(text, name, resolver.unit, zero=True, key=key, file=resolver.file)


def resolve_effects(table: EffectsTable, world: World, flight: str, resolver: Resolver) -> Effects:
    """Resolve ``[effects]``: refuse what excludes each other, and what lacks its facts."""
    given = {name: how for name, how in table.model_dump().items() if how and name not in ("auto", "contact")}
    if not given:
        return Effects(auto=table.auto, contact=table.contact)
    from limitsets.feeder.thrower.effects import EFFECTS  # lazily: its room loads numba

    for effect in given:
        key = f"effects.{effect}"
        if flight != "exact":
            allowed = 'flight = "exact" in [model]'
            raise resolver.refusal(
                key, "the flight", flight, allowed, f"{effect} has no meaning in it; use the exact one"
            )
        for other in EFFECTS[effect].excludes:
            if other in given:
                allowed = f"{effect} or {other}"
                raise resolver.refusal(
                    key,
                    "this pair of effects",
                    f"{effect} and {other}",
                    allowed,
                    "they cannot be simulated together",
                )
        for fact in EFFECTS[effect].needs:
            if getattr(world, fact) is None:
                raise resolver.refusal(
                    key,
                    f"the fact world.{fact}",
                    "missing",
                    f"{fact} in [world]",
                    f"{effect} needs it: add world.{fact}, or leave {key} out",
                )
    return Effects({name: given[name] for name in EFFECTS if name in given}, table.auto, table.contact)


# ----------------------------------------------------------------
# From a TOML structure to the fields of a `Scene`: units, and what contradicts what.


def resolved(structure: object, file: str | None) -> dict[str, Any]:
    """Check a structure and resolve it: the fields of its `Scene`, by name.

    Parameters
    ----------
    structure : object
        What TOML held; anything is accepted here and refused with reasons.
    file : str or None
        Where it was read from.

    Raises
    ------
    SceneError
        For the first thing wrong, with file, key, value, what is allowed and what to do.
    """
    tree = plain(structure, file)
    table = validate(tree, file)
    unit = parse(table.arm.length, "length", key="arm.length", file=file).unit
    resolver = Resolver(unit, file)
    numbers = Floats(tree, resolver)
    arm_length, body = numbers.number("arm.length"), numbers.body
    _require_reach(body.sides, arm_length, table, resolver)
    gravity = numbers.gravity
    world = resolve_world(table.world, resolver)
    goal = None
    if table.goal is not None:
        goal = resolve_goal(table.goal, body.sides.rests.tolist(), arm_length, resolver)
    cavity = None
    if table.cavity is not None:
        feet, lengths = body.sides.a.tolist(), body.sides.length.tolist()
        cavity = resolve_cavity(table.cavity, feet, lengths, arm_length, goal, resolver)
    tray = None
    if table.tray is not None:
        tray = resolve_tray(table.tray, body.vertices, body.sides.length, goal, resolver)
    effects = resolve_effects(table.effects, world, table.model.flight, resolver)
    _require_tipping(body.sides, effects, table, resolver)
    return {
        "name": table.name,
        "unit": unit,
        **body._asdict(),
        "surface_height": numbers.number("arm.surface_height"),
        "arm_length": arm_length,
        "kappa": numbers.kappa,
        "gravity": gravity,
        "flight": table.model.flight,
        "flip": table.model.flip,
        "goal": goal,
        "cavity": cavity,
        "tray": tray,
        "world": world,
        "effects": effects,
        "tolerance": _tolerance(tree, table, resolver),
        "feedback": _feedback(table, len(body.sides), arm_length, resolver, gravity=gravity is not None),
        "file": file,
        "text": tree,
    }


def _require_reach(sides: RestingSides, arm_length: float, table: SceneTable, resolver: Resolver) -> None:
    for side, (a, rests) in enumerate(zip(sides.a.tolist(), sides.rests.tolist(), strict=True)):
        if rests and not arm_length > a:
            raise resolver.refusal(
                "arm.length",
                "the length of the arm",
                table.arm.length,
                f"more than {a:.6g} {resolver.unit}",
                f"the part resting on side {side} needs that much before any throw can lift it; lengthen the arm",
            )


def _require_tipping(sides: RestingSides, effects: Effects, table: SceneTable, resolver: Resolver) -> None:
    """Refuse what says nothing of a part that tips over on one of its sides."""
    tips = [str(side) for side, rests in enumerate(sides.rests.tolist()) if not rests]
    if not tips:
        return
    where = f"the part cannot rest on side {' and '.join(tips)}"
    if table.model.flip != "signed":
        allowed = 'flip = "signed" in [model]'
        remedy = f"{where}, and tips from there the way it turns; correct it"
        raise resolver.refusal("model.flip", "the criterion of a flip", table.model.flip, allowed, remedy)
    for effect in NOT_TIPPING:
        if effect in effects.on():
            remedy = f"{where}, but may on an arm that leans; leave it out"
            raise resolver.refusal(f"effects.{effect}", "this effect", effect, "another effect", remedy)
    for key, given in (("cavity", table.cavity), ("tray", table.tray), ("feedback", table.feedback)):
        if given is not None:
            allowed = "a part that rests on each of its sides"
            raise resolver.refusal(key, "the part", where, allowed, f"leave [{key}] out, or, {WITHOUT_EDGE}")


def _tolerance(tree: Tree, table: SceneTable, resolver: Resolver) -> dict[str, Deviation]:
    scales = {}
    for name, text in table.tolerance.items():
        key = f'tolerance."{name}"'
        scales[name] = deviation(text, name, resolver.unit, key=key, file=resolver.file)
        require(tree, name, key, resolver.file)
    return scales


def _feedback(
    table: SceneTable, count: int, arm_length: float, resolver: Resolver, *, gravity: bool
) -> Feedback | None:
    if table.feedback is None:
        return None
    return resolve_feedback(table.feedback, count, arm_length, resolver, gravity=gravity)
