"""Where a part of a crowd has come to rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from limitsets.geometry import side_ends

if TYPE_CHECKING:
    from limitsets.engine.ground import Ground
    from limitsets.engine.member import Member
    from limitsets.scene import Cavity

# Farther from flat than this [rad] a part at rest lies on no side.
LEANING = 0.02
# Corners lower than this fraction of the part's size touch the arm.
TOUCHING = 1e-3
# On the ramp, where a part's own errors of contact add up, it is this fraction.
ON_RAMP = 0.01


@dataclass(frozen=True)
class Rest:
    """Where a part is after a throw.

    Attributes
    ----------
    number : int
        The part.
    where : str
        ``"arm"``: on a side, before the end; ``"beyond"``: on a side on the arm with its centre of mass beyond the
        end, balanced or slower than the engine's measure of rest; ``"leaning"``: before the end, on no side;
        ``"cavity"``: at rest beyond the end otherwise; ``"lost"``: it fell off, and is out of play; ``"unfinished"``:
        still in motion when patience ended; ``"out"``: not in play.
    x : float
        Of the centre of mass [length].
    side : int
        The one that lies on the arm or, in the cavity, on the ramp; -1 for none.
    pose : (float, float, float)
        x, y of the centre of mass from the joint [length], and the angle, continuous in time [rad].
    met : tuple of str
        What it came into contact with in this throw, in this order: names of `Piece`, ``"part 1"``, ...
    """

    number: int
    where: str
    x: float
    side: int
    pose: tuple[float, float, float]
    met: tuple[str, ...]


def rest_of(member: Member, ground: Ground, cavity: Cavity | None, asleep: bool) -> Rest:
    """Say where a part in play is."""
    (x, y), angle = member.body.position, member.body.angle
    side = lying(member)
    if not asleep:
        where, side = "unfinished", -1
    elif side >= 0:
        where = "arm" if x <= ground.end else "beyond"
    elif x <= ground.end or cavity is None:
        where = "leaning"
    else:
        where, side = "cavity", _on_ramp(member, ground, cavity)
    return Rest(member.number, where, x, side, (x, y, angle), tuple(member.met))


def lying(member: Member) -> int:
    """Which side lies on the arm; -1 for none."""
    side, off = _nearest(member.body.angle, member.flat)
    height = member.scene.surface_height + float(member.scene.sides.d[side])
    flat = off < LEANING and abs(member.body.position.y - height) < TOUCHING * member.size
    return side if flat else -1


def _nearest(angle: float, flat: Sequence[float]) -> tuple[int, float]:
    """Find the side that is nearest to lie on, and by which angle it is off."""
    off = [abs(math.remainder(angle - each, math.tau)) for each in flat]
    return off.index(min(off)), min(off)


def _on_ramp(member: Member, ground: Ground, cavity: Cavity) -> int:
    side, off = _nearest(member.body.angle + cavity.angle, member.flat)
    corners, ends = member.world(), side_ends(len(member.corners), side)
    slope = math.tan(cavity.angle)
    over = [corners[end][1] - ground.height + slope * (corners[end][0] - ground.end) for end in ends]
    return side if off < LEANING and max(map(abs, over)) < ON_RAMP * member.size else -1


def on_arm(member: Member, ground: Ground) -> bool:
    """Whether the arm carries it: a corner touches the surface, or the centre of mass is before the end."""
    near = TOUCHING * member.size
    touches = any(abs(y - ground.height) < near and x <= ground.end for x, y in member.world())
    return touches or member.body.position.x <= ground.end
