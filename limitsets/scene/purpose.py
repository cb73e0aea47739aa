"""The goal, the world and the effects of a scene."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from limitsets.goals import AttractsAll, FlipOrder, Goal, OrientedBeyond, Reaches, StaysOnArm
from limitsets.scene.facts import Deviation, Effects, Scatter, World
from limitsets.scene.quantities import deviation
from limitsets.scene.resolve import Resolver

if TYPE_CHECKING:
    from limitsets.scene.schema import EffectsTable, GoalTable, WorldTable

__all__ = ["resolve_effects", "resolve_goal", "resolve_world"]

_GOALS = ("oriented_beyond", "reaches", "attracts_all", "flip_order", "stays_on_arm")


def resolve_goal(table: GoalTable, count: int, arm_length: float, resolver: Resolver) -> Goal:
    """Resolve ``[goal]`` for a part with `count` sides."""
    named = [kind for kind in _GOALS if getattr(table, kind) is not None]
    if len(named) != 1:
        found = " and ".join(named) or "none"
        raise resolver.refusal("goal", "the goal", found, f"one of {', '.join(_GOALS)}", "name exactly one")
    anywhere = table.from_anywhere

    def side(value: int, key: str) -> int:
        if value >= count:
            raise resolver.refusal(key, "the side", value, f"0 to {count - 1}", "name a side of this part")
        return value

    def position(text: str, key: str) -> float:
        x = resolver.value(text, "length", key)
        if not 0 <= x < arm_length:
            allowed = f"from 0 to below the arm's length, {arm_length:.9g} {resolver.unit}"
            raise resolver.refusal(
                key, "the position", text, allowed, "nothing comes to rest there; correct it"
            )
        return x

    if (beyond := table.oriented_beyond) is not None:
        key = "goal.oriented_beyond"
        x = position(beyond.x, f"{key}.x")
        return OrientedBeyond(x, side(beyond.side, f"{key}.side"), from_anywhere=anywhere)
    if (reaches := table.reaches) is not None:
        key = "goal.reaches"
        x = position(reaches.x, f"{key}.x")
        return Reaches(x, side(reaches.side, f"{key}.side"), reaches.every_orbit, from_anywhere=anywhere)
    if table.flip_order is not None:
        order = tuple(side(value, f"goal.flip_order[{i}]") for i, value in enumerate(table.flip_order))
        return FlipOrder(order, from_anywhere=anywhere)
    plain: dict[str, type[AttractsAll | StaysOnArm]] = {
        "attracts_all": AttractsAll,
        "stays_on_arm": StaysOnArm,
    }
    return plain[named[0]](anywhere)


def resolve_world(table: WorldTable, resolver: Resolver) -> World:
    """Resolve ``[world]``."""
    threshold = stroke = scatter = None
    if table.bounce_threshold is not None:
        threshold = resolver.positive(table.bounce_threshold, "length", "world.bounce_threshold")
    if table.stroke is not None:
        stroke = resolver.positive(table.stroke, "angle", "world.stroke")
        if not stroke < math.pi / 2:
            allowed = "above 0 and below 90 deg"
            raise resolver.refusal("world.stroke", "the stroke", table.stroke, allowed, "correct it")
    if table.scatter is not None and (table.scatter.speed or table.scatter.landing):
        scatter = Scatter(
            _noise(table.scatter.speed, "throw.speed", "world.scatter.speed", resolver),
            _noise(table.scatter.landing, "landing.x", "world.scatter.landing", resolver),
        )
    return World(table.friction, table.restitution, threshold, stroke, scatter)


def _noise(text: str | None, name: str, key: str, resolver: Resolver) -> Deviation | None:
    if text is None:
        return None
    return deviation(text, name, resolver.unit, zero=True, key=key, file=resolver.file)


def resolve_effects(table: EffectsTable, world: World, flight: str, resolver: Resolver) -> Effects:
    """Resolve ``[effects]``: refuse what this version cannot simulate, then what lacks its facts."""
    effects = Effects(**table.model_dump())
    if not effects.on():
        return effects
    from limitsets.thrower.effects import BUILT  # lazily: its room loads numba

    for effect in effects.on():
        key = f"effects.{effect}"
        if effect not in BUILT:
            allowed = f"the effects that this version can simulate: {', '.join(BUILT)}"
            raise resolver.refusal(key, "the effect", effect, allowed, f"leave {key} out")
        if flight != "exact":
            allowed = 'flight = "exact" in [model]'
            raise resolver.refusal(
                key, "the flight", flight, allowed, f"{effect} has no meaning in it; use the exact one"
            )
        for other in BUILT[effect].excludes:
            if other in effects.on():
                allowed = f"{effect} or {other}"
                raise resolver.refusal(
                    key,
                    "this pair of effects",
                    f"{effect} and {other}",
                    allowed,
                    "they cannot be simulated together",
                )
        for fact in BUILT[effect].needs:
            if getattr(world, fact) is None:
                raise resolver.refusal(
                    key,
                    f"the fact world.{fact}",
                    "missing",
                    f"{fact} in [world]",
                    f"{effect} needs it: add world.{fact}, or leave {key} out",
                )
    return effects
