"""The cavity at the end of the arm: a ramp that falls from the end down to the foot of an upright far wall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from limitsets.scene.resolve import Resolver

if TYPE_CHECKING:
    from limitsets.goals import Goal
    from limitsets.scene.schema import CavityTable

# A ramp may be longer than its cavity by this share: its sizes are decimals, and what fits exactly is rounded.
ROUNDED = 1e-6


@dataclass(frozen=True)
class Cavity:
    """Where the arm ends, and what lies beyond its end.

    Parameters
    ----------
    position : float
        Where the arm ends and the ramp begins: a part whose centre of mass rests beyond it falls in [length].
    width : float
        Of the mouth, from the end of the arm to the far wall [length].
    depth : float
        Of the floor below the arm's surface, where the ramp ends and the wall begins [length].
    angle : float
        Of the ramp below the arm's surface [rad].
    tips : str
        How a part that comes down beyond the end begins to tip over it: ``"moving"``, with the angular momentum about
        the end with which it came down, or ``"rest"``.
    """

    position: float
    width: float
    depth: float
    angle: float
    tips: str = "moving"


def resolve_cavity(
    table: CavityTable,
    feet: Sequence[float],
    lengths: Sequence[float],
    arm_length: float,
    goal: Goal | None,
    resolver: Resolver,
) -> Cavity:
    """Resolve ``[cavity]`` for a part with these a and lengths of its sides."""
    unit = resolver.unit
    position = resolver.positive(table.position, "length", "cavity.position")
    if position > arm_length:
        allowed = f"up to the arm's length, {arm_length:.9g} {unit}"
        remedy = "the arm ends where the cavity begins; move the cavity, or lengthen the arm"
        raise resolver.refusal(
            "cavity.position", "the position of the cavity", table.position, allowed, remedy
        )
    farthest = max(range(len(feet)), key=feet.__getitem__)
    if not position > feet[farthest]:
        allowed = f"more than {feet[farthest]:.6g} {unit}"
        remedy = f"the part resting on side {farthest} needs that much of the arm; move the cavity outward"
        raise resolver.refusal(
            "cavity.position", "the position of the cavity", table.position, allowed, remedy
        )
    wanted = getattr(goal, "side", None)
    side = min(range(len(lengths)), key=lengths.__getitem__) if wanted is None else wanted
    width = resolver.positive(table.width, "length", "cavity.width")
    if width < lengths[side]:
        allowed = f"at least {lengths[side]:.6g} {unit}, the length of side {side}"
        raise resolver.refusal(
            "cavity.width",
            "the width of the cavity",
            table.width,
            allowed,
            "the part cannot lie in it; widen it",
        )
    angle = resolver.value(table.angle, "angle", "cavity.angle")
    if not 0 < angle < math.pi / 2:
        allowed = "above 0 and below 90 deg"
        raise resolver.refusal(
            "cavity.angle", "the angle of the ramp", table.angle, allowed, "measure it downwards from the arm"
        )
    depth = resolver.positive(table.depth, "length", "cavity.depth")
    if depth / math.tan(angle) > width * (1.0 + ROUNDED):
        allowed = f"at most {width * math.tan(angle):.6g} {unit}, where the ramp meets the far wall"
        raise resolver.refusal(
            "cavity.depth",
            "the depth of the cavity",
            table.depth,
            allowed,
            "the ramp is longer than the cavity: make it less deep, or wider",
        )
    return Cavity(position, width, depth, angle, table.tips)
