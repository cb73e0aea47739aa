"""From a TOML structure to the fields of a `Scene`: units, and what contradicts what."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from limitsets.scene.cavity import resolve_cavity
from limitsets.scene.facts import Deviation
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
    numbers = Floats(tree, resolver)
    arm_length, body = numbers.number("arm.length"), numbers.body
    _require_reach(body.sides.a.tolist(), arm_length, table, resolver)
    gravity = numbers.gravity
    world = resolve_world(table.world, resolver)
    goal = None
    if table.goal is not None:
        goal = resolve_goal(table.goal, len(body.sides), arm_length, resolver)
    cavity = None
    if table.cavity is not None:
        feet, lengths = body.sides.a.tolist(), body.sides.length.tolist()
        cavity = resolve_cavity(table.cavity, feet, lengths, arm_length, goal, resolver)
    tray = None
    if table.tray is not None:
        tray = resolve_tray(table.tray, body.vertices, body.sides.length, goal, resolver)
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
        "effects": resolve_effects(table.effects, world, table.model.flight, resolver),
        "tolerance": _tolerance(tree, table, resolver),
        "feedback": _feedback(table, len(body.sides), arm_length, resolver, gravity=gravity is not None),
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
