"""From a TOML structure to the fields of a `Scene`: units, and what contradicts what."""

from __future__ import annotations

from math import pi, sin
from typing import TYPE_CHECKING, Any

from limitsets.scene.body import resolve_body
from limitsets.scene.facts import Deviation
from limitsets.scene.purpose import resolve_effects, resolve_goal, resolve_world
from limitsets.scene.quantities import STANDARD_GRAVITY, deviation, require
from limitsets.scene.resolve import LEAST, Resolver
from limitsets.scene.units import parse
from limitsets.scene.validation import Tree, plain, validate

if TYPE_CHECKING:
    from limitsets.scene.schema import GravityTable, SceneTable

__all__ = ["resolved"]


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
    arm_length = resolver.positive(table.arm.length, "length", "arm.length")
    body = resolve_body(table.part, resolver)
    _require_reach(body.sides.a.tolist(), arm_length, table, resolver)
    gravity = None if table.gravity is None else _gravity(table.gravity, resolver)
    world = resolve_world(table.world, resolver)
    goal = None
    if table.goal is not None:
        goal = resolve_goal(table.goal, len(body.sides), arm_length, resolver)
    return {
        "name": table.name,
        "unit": unit,
        "vertices": body.vertices,
        "centre": body.centre,
        "radius_of_gyration": body.radius_of_gyration,
        "sides": body.sides,
        "surface_height": resolver.value(table.arm.surface_height, "length", "arm.surface_height"),
        "arm_length": arm_length,
        "kappa": _kappa(table, gravity, resolver),
        "gravity": gravity,
        "flight": table.model.flight,
        "flip": table.model.flip,
        "goal": goal,
        "world": world,
        "effects": resolve_effects(table.effects, world, table.model.flight, resolver),
        "tolerance": _tolerance(tree, table, resolver),
        "file": file,
        "text": tree,
    }


def _require_reach(feet: list[float], arm_length: float, table: SceneTable, resolver: Resolver) -> None:
    for side, a in enumerate(feet):
        if not arm_length > a:
            raise resolver.refusal(
                "arm.length",
                "the length of the arm",
                table.arm.length,
                f"more than {a:.6g} {resolver.unit}",
                f"the part resting on side {side} needs that much before any throw can lift it; lengthen the arm",
            )


def _gravity(table: GravityTable, resolver: Resolver) -> float:
    """Give gravity in the plane of the motion [unit/s^2]."""
    if table.acceleration is not None and table.tilt is not None:
        found, allowed = "acceleration and tilt", "acceleration or tilt"
        raise resolver.refusal("gravity", "gravity", found, allowed, "give one of them, not both")
    if table.acceleration is not None:
        return resolver.positive(table.acceleration, "acceleration", "gravity.acceleration")
    if table.tilt is None:
        raise resolver.refusal("gravity", "gravity", "empty", "acceleration or tilt", "give one of them")
    tilt = resolver.value(table.tilt, "angle", "gravity.tilt")
    if not 0 < tilt <= pi / 2:
        allowed = "above 0 and up to 90 deg"
        raise resolver.refusal("gravity.tilt", "the tilt", table.tilt, allowed, "90 deg is an upright table")
    return resolver.value(STANDARD_GRAVITY, "acceleration", "gravity") * sin(tilt)


def _kappa(table: SceneTable, gravity: float | None, resolver: Resolver) -> float:
    """Give gravity over the squared angular speed [unit]."""
    kappa, speed = table.throw.kappa, table.throw.speed
    if (kappa is None) == (speed is None):
        found = "neither kappa nor speed" if kappa is None else "kappa and speed"
        raise resolver.refusal("throw", "the throw", found, "kappa or speed", "give exactly one of them")
    if kappa is not None:
        return resolver.positive(kappa, "length", "throw.kappa")
    assert speed is not None
    rate = resolver.positive(speed, "angular speed", "throw.speed")
    if gravity is None:
        allowed = "acceleration or tilt in [gravity]"
        remedy = "a throw given by its speed needs it; add [gravity], or give throw.kappa"
        raise resolver.refusal("throw.speed", "gravity", "missing", allowed, remedy)
    resulting = gravity / (rate * rate)
    if not LEAST <= resulting <= 1 / LEAST:
        allowed = f"gravity/speed^2 from {LEAST:g} to {1 / LEAST:g} {resolver.unit}"
        raise resolver.refusal("throw.speed", "this angular speed", speed, allowed, "correct it")
    return resulting


def _tolerance(tree: Tree, table: SceneTable, resolver: Resolver) -> dict[str, Deviation]:
    scales = {}
    for name, text in table.tolerance.items():
        key = f'tolerance."{name}"'
        scales[name] = deviation(text, name, resolver.unit, key=key, file=resolver.file)
        require(tree, name, key, resolver.file)
    return scales
