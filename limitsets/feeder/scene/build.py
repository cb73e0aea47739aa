"""From a TOML structure to the fields of a `Scene`: goal, world, effects, units, and what contradicts what."""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.feeder.geometry import RestingSides
from limitsets.feeder.goals import GOALS, Goal, words_of
from limitsets.feeder.scene.facts import (
    NOT_TIPPING,
    SCATTERED,
    WITHOUT_EDGE,
    Deviation,
    Effects,
    Scatter,
    World,
)
from limitsets.feeder.scene.numbers import Floats
from limitsets.feeder.scene.quantities import Resolver, deviation, require
from limitsets.feeder.scene.surroundings import resolve_cavity, resolve_feedback, resolve_tray
from limitsets.feeder.scene.units import parse
from limitsets.feeder.scene.validation import Tree, plain, validate
from limitsets.feeder.world import FACTS

# ----------------------------------------------------------------
# The goal, the world and the effects of a scene.


def resolve_goal(table: Tree, rests: list[bool], arm_length: float, resolver: Resolver) -> Goal:
    """Resolve ``[goal]`` for a part that rests on these of its sides."""
    named = [kind for kind in GOALS if kind in table]
    if len(named) != 1:
        kinds = " and ".join(named) or "none"
        raise resolver.refusal("goal", "the goal", kinds, f"one of {', '.join(GOALS)}", "name exactly one")

    def side(value: int, key: str) -> int:
        sides = [each for each, good in enumerate(rests) if good]
        there, last = value < len(rests), len(rests) - 1
        resolver.require(there, key, "the side", f"0 to {last}", "name a side of this part")
        remedy = "the part cannot rest on it; name another"
        resolver.require(value in sides, key, "the side", ", ".join(map(str, sides)), remedy)
        return value

    def read(word: str, value: Any, key: str) -> Any:
        if word == "sides":
            return tuple(side(each, f"{key}[{i}]") for i, each in enumerate(value))
        if word != "place":
            return side(value, key) if word == "side" else value
        x = resolver.value(key, "length")
        allowed = f"from 0 to below the arm's length, {arm_length:.9g} {resolver.unit}"
        remedy = "nothing comes to rest there; correct it"
        resolver.require(0 <= x < arm_length, key, "the position", allowed, remedy)
        return x

    goal, given, key = GOALS[named[0]], table[named[0]], f"goal.{named[0]}"
    words = words_of(goal)
    if len(words) == 1:  # it stands by itself
        ((name, word),) = words.items()
        values = {name: read(word, given, key)}
    else:
        values = {
            name: read(word, given[name], f"{key}.{name}") for name, word in words.items() if name in given
        }
    return goal(**values, from_anywhere=table.get("from_anywhere", False))  # type: ignore[call-arg]  # a kind is a dataclass


def resolve_world(table: Tree, resolver: Resolver) -> World:
    """Resolve ``[world]``."""
    facts, noise, file = {}, {}, resolver.file
    for name in (name for name in FACTS if name in table):
        fact, key = FACTS[name], f"world.{name}"
        facts[name] = resolver.positive(key, fact.dimension) if fact.dimension else float(table[name])
        resolver.require(not fact.dimension or facts[name] < fact.most, key, fact.thing, fact.words)
    for word, text in table.get("scatter", {}).items():
        key = f"world.scatter.{word}"
        noise[word] = deviation(text, SCATTERED[word], resolver.unit, zero=True, key=key, file=file)
    return World(facts, Scatter(**noise) if noise else None)


def resolve_effects(table: Tree, world: World, flight: str, resolver: Resolver) -> Effects:
    """Resolve ``[effects]``: refuse what excludes each other, and what lacks its facts."""
    given = {name: how for name, how in table.items() if how and name not in ("auto", "contact")}
    switches = {name: table.get(name, False) for name in ("auto", "contact")}
    if not given:
        return Effects(**switches)
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
    return Effects({name: given[name] for name in EFFECTS if name in given}, **switches)


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
    validate(tree, file)
    unit = parse(tree["arm"]["length"], "length", key="arm.length", file=file).unit
    resolver = Resolver(tree, unit, file)
    numbers = Floats(resolver)
    arm_length, body = numbers.number("arm.length"), numbers.body
    _require_reach(body.sides, arm_length, resolver)
    gravity, model = numbers.gravity, {"flight": "exact", "flip": "signed"} | tree.get("model", {})
    world = resolve_world(tree.get("world", {}), resolver)
    goal = cavity = tray = feedback = None
    if "goal" in tree:
        goal = resolve_goal(tree["goal"], body.sides.rests.tolist(), arm_length, resolver)
    if "cavity" in tree:
        cavity = resolve_cavity(body.vertices, body.sides, arm_length, goal, resolver)
    if "tray" in tree:
        tray = resolve_tray(body.vertices, body.sides.length, goal, resolver)
    effects = resolve_effects(tree.get("effects", {}), world, model["flight"], resolver)
    _require_tipping(body.sides, effects, model["flip"], resolver)
    kappa, tolerance = numbers.kappa, _tolerance(tree.get("tolerance", {}), resolver)
    if "feedback" in tree:
        feedback = resolve_feedback(len(body.sides), arm_length, resolver, gravity=gravity is not None)
    return {
        "name": tree["name"],
        "unit": unit,
        **body._asdict(),
        "surface_height": numbers.number("arm.surface_height"),
        "arm_length": arm_length,
        "kappa": kappa,
        "gravity": gravity,
        **model,
        "goal": goal,
        "cavity": cavity,
        "tray": tray,
        "world": world,
        "effects": effects,
        "tolerance": tolerance,
        "feedback": feedback,
        "file": file,
        "text": tree,
    }


def _require_reach(sides: RestingSides, arm_length: float, resolver: Resolver) -> None:
    for side in np.flatnonzero(sides.rests).tolist():
        needed, remedy = float(sides.a[side]), f"the part resting on side {side} needs that much"
        remedy = f"{remedy} before any throw can lift it; lengthen the arm"
        allowed = f"more than {needed:.6g} {resolver.unit}"
        resolver.require(arm_length > needed, "arm.length", "the length of the arm", allowed, remedy)


def _require_tipping(sides: RestingSides, effects: Effects, flip: str, resolver: Resolver) -> None:
    """Refuse what says nothing of a part that tips over on one of its sides."""
    tips = [str(side) for side, rests in enumerate(sides.rests.tolist()) if not rests]
    if not tips:
        return
    where = f"the part cannot rest on side {' and '.join(tips)}"
    remedy = f"{where}, and tips from there the way it turns; correct it"
    allowed = 'flip = "signed" in [model]'
    resolver.require(flip == "signed", "model.flip", "the criterion of a flip", allowed, remedy)
    for effect in NOT_TIPPING:
        if effect in effects.on():
            remedy = f"{where}, but may on an arm that leans; leave it out"
            raise resolver.refusal(f"effects.{effect}", "this effect", effect, "another effect", remedy)
    for key in ("cavity", "tray", "feedback"):
        if key in resolver.tree:
            allowed = "a part that rests on each of its sides"
            raise resolver.refusal(key, "the part", where, allowed, f"leave [{key}] out, or, {WITHOUT_EDGE}")


def _tolerance(table: Tree, resolver: Resolver) -> dict[str, Deviation]:
    scales = {}
    for name, text in table.items():
        key = f'tolerance."{name}"'
        scales[name] = deviation(text, name, resolver.unit, key=key, file=resolver.file)
        require(resolver.tree, name, key, resolver.file)
    return scales
