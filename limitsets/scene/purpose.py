"""The goal, the world and the effects of a scene."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from limitsets.goals import GOALS, Goal, words_of
from limitsets.scene.facts import FACTS, Deviation, Effects, Scatter, World
from limitsets.scene.quantities import deviation
from limitsets.scene.resolve import Resolver

if TYPE_CHECKING:
    from limitsets.scene.schema import EffectsTable, GoalTable, WorldTable


def resolve_goal(table: GoalTable, rests: list[bool], arm_length: float, resolver: Resolver) -> Goal:
    """Resolve ``[goal]`` for a part that rests on these of its sides."""
    named = [kind for kind in GOALS if getattr(table, kind) is not None]
    if len(named) != 1:
        found = " and ".join(named) or "none"
        raise resolver.refusal("goal", "the goal", found, f"one of {', '.join(GOALS)}", "name exactly one")

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
    scatter, found, own = None, {}, {each.name for each in fields(World)}
    for name, fact in FACTS.items():
        given, key = getattr(table, name), f"world.{name}"
        if given is not None and fact.dimension:
            text, given = given, resolver.positive(given, fact.dimension, key)
            if not given < fact.most:
                raise resolver.refusal(key, fact.thing, text, fact.words, "correct it")
        if given is not None:
            found[name] = given
    if table.scatter is not None and (table.scatter.speed or table.scatter.landing):
        scatter = Scatter(
            _noise(table.scatter.speed, "throw.speed", "world.scatter.speed", resolver),
            _noise(table.scatter.landing, "landing.x", "world.scatter.landing", resolver),
        )
    more = {name: found.pop(name) for name in found.keys() - own}
    return World(**found, scatter=scatter, more=more)


def _noise(text: str | None, name: str, key: str, resolver: Resolver) -> Deviation | None:
    if text is None:
        return None
    return deviation(text, name, resolver.unit, zero=True, key=key, file=resolver.file)


def resolve_effects(table: EffectsTable, world: World, flight: str, resolver: Resolver) -> Effects:
    """Resolve ``[effects]``: refuse what excludes each other, and what lacks its facts."""
    given = {name: how for name, how in table.model_dump().items() if how and name not in ("auto", "contact")}
    if not given:
        return Effects(auto=table.auto, contact=table.contact)
    from limitsets.thrower.effects import EFFECTS  # lazily: its room loads numba

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
