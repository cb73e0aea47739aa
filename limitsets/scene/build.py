"""From a TOML structure to the fields of a `Scene`: units, and what contradicts what."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from limitsets.geometry import RestingSides
from limitsets.scene.cavity import resolve_cavity
from limitsets.scene.facts import NOT_TIPPING, WITHOUT_EDGE, Deviation, Effects
from limitsets.scene.floats import Floats
from limitsets.scene.purpose import resolve_effects, resolve_goal, resolve_world
from limitsets.scene.quantities import deviation, require
from limitsets.scene.resolve import Resolver
from limitsets.scene.sensing import Feedback, resolve_feedback
from limitsets.scene.tray import resolve_tray
from limitsets.scene.units import parse
from limitsets.scene.validation import Tree, plain, validate

if TYPE_CHECKING:
    from limitsets.scene.schema import SceneTable


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
