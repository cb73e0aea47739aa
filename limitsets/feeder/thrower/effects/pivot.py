"""Effect `pivot`: the struck vertex is held by friction and the part's own weight only, not by a hinge.

It is held while the force that takes lies in the cone of friction (`held.py`), slides where it does not
(`sliding.py`), and leaves the arm where that force would have to pull; the part then flies on to its next contact.
Where the force stays in the cone until a side is down, that is the hinge, to the last digit.

With `slip` but without this effect a vertex that slides after its impact slides on in the same way, until it stops at
a moment at which friction can hold it: from there on it is a hinge, as one that has stuck from the impact on.
Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.feeder.thrower.contact import gives_way, holds_now, lets_go, slide_on
from limitsets.feeder.thrower.effects.drive import Drive, leant
from limitsets.feeder.thrower.impact import margin
from limitsets.feeder.thrower.motion import (
    DOWN,
    LOST,
    OFF,
    ON,
    Contact,
    Effect,
    Face,
    FullSide,
    above,
    declare,
    on_to_next,
    right_of,
    side_number,
    tips,
)
from limitsets.numbers.interval.number import signed_square
from limitsets.numbers.jit import entry_of, kernel

# Times that a vertex may stop and slide again before a side is down.
MOST_SLIDES = 1000


class Pivot(NamedTuple):
    """Friction that holds a vertex."""

    friction: float


@kernel
def _held_by(pivot: Any) -> float:
    if pivot is None:
        return 0.0
    return pivot.friction  # type: ignore[no-any-return]  # it comes as Any


@kernel
def _friction(pivot: Any, slip: Any) -> float:
    """Of whichever effect is there: both read the one fact."""
    if slip is None:
        return _held_by(pivot)
    return slip.friction  # type: ignore[no-any-return]  # it comes as Any


@kernel
def _margin(pivot: Any, part: FullSide, inertia: float, omega: float, barrier: float) -> float:
    """Positive where the part gets over its vertex; one that is held by no hinge does not ask for a criterion."""
    if pivot is None:
        excess: float = margin(part.own.flip, inertia, omega, barrier)
        return excess
    return 0.5 * inertia * signed_square(omega) - barrier


@kernel
def _over(roll: Any, part: FullSide, hit: Contact, kinetic: float, high: float, over: bool) -> bool:
    """Whether the part gets over its vertex, sides on which it cannot rest counted in.

    About an end over which the part tips, that side's height is the greatest that the centre of mass passes: there is
    no top to climb beyond it.
    """
    if roll is None:
        return over
    k, after = side_number(part, hit.vertex), side_number(part, hit.vertex + 1)
    if tips(part, hit.vertex) > 0:
        return hit.omega >= 0.0 or kinetic < part.own.kappa * (part.d[k] - high)
    if tips(part, hit.vertex + 1) < 0:
        return hit.omega > 0.0 and kinetic > part.own.kappa * (part.d[after] - high)
    return over


@kernel
def _hinged(pivot: Any, roll: Any, part: FullSide, hit: Contact) -> Face:
    """Turn the part about its vertex until a side comes down.

    By energy: over the top or back, then down with what was there at the start and the height lost.
    """
    right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
    inertia = part.own.rho2 + (right * right + high * high)
    kinetic = 0.5 * inertia * hit.omega * hit.omega
    ell = math.sqrt(right * right + high * high)
    drive = entry_of(part.effects, Drive)
    gravity, right, high = leant(drive, part.own.kappa, right, high)
    near = right * abs(right) / (ell + abs(high))  # sgn(X) (ell - H), see impact.py
    far = (ell - high) if right > 0.0 else (high - ell)
    barrier = gravity * (near if high > 0.0 else far)
    over = _margin(pivot, part, inertia, hit.omega, barrier) > 0.0
    over = _over(roll, part, hit, kinetic, above(part, hit.vertex, hit.psi), over)
    side = hit.vertex + 1 if over else hit.vertex
    k = side_number(part, side)
    foot = part.a[k] - part.length[k] if over else part.a[k]
    _, _, low = leant(drive, part.own.kappa, foot, part.d[k])
    energy = kinetic + gravity * (high - low)
    rate = math.sqrt(max(2.0 * energy / inertia, 0.0))
    shift = hit.shift - on_to_next(part, hit.vertex) if over else hit.shift
    return Face(side, shift, hit.vertex, rate if over else -rate, hit.slide)


@kernel
def _come_down(part: FullSide, hit: Contact) -> Face:
    """Return the side that has come down about a sliding vertex."""
    over = hit.psi.phi > 0.5 * part.corner[side_number(part, hit.vertex)]
    shift = hit.shift - on_to_next(part, hit.vertex) if over else hit.shift
    return Face(hit.vertex + 1 if over else hit.vertex, shift, hit.vertex, hit.omega, hit.slide)


@kernel
def _holds(pivot: Any, part: FullSide, mu: float, hit: Contact, slid: bool) -> tuple[Contact, bool]:
    """Whether a vertex at rest stays there until a side is down, and if not, where it lets go."""
    if pivot is None:
        return hit, not slid or holds_now(part, mu, hit)
    at, slips = lets_go(part, mu, hit)
    return at, not slips


@kernel
def turned_down(
    pivot: Any, slip: Any, roll: Any, part: FullSide, struck: Contact
) -> tuple[Contact, Face, int]:
    """Turn the part about its vertex until a side comes down (DOWN), the vertex lets go (OFF), or it is LOST."""
    hit, ends = struck, OFF if struck.lift > 0.0 else ON
    if pivot is None and slip is None:
        return hit, _hinged(pivot, roll, part, hit), DOWN if ends == ON else OFF
    mu = _friction(pivot, slip)
    way = 0 if hit.slide == 0.0 else int(math.copysign(1.0, hit.slide))
    for slides in range(MOST_SLIDES):
        if ends == ON and way == 0:
            hit, holds = _holds(pivot, part, mu, hit, slides > 0)
            if holds:
                return hit, _hinged(pivot, roll, part, hit), DOWN
            way, ends = gives_way(part, mu, hit)
        if ends == ON:
            hit, ends = slide_on(part, mu, way, hit)
            way = 0
        if ends != ON:
            return hit, _come_down(part, hit), ends
    return hit, _come_down(part, hit), LOST


declare(
    Effect(
        "pivot",
        Pivot,
        lambda world, how: Pivot(float(world.friction)),
        "it acts as a hinge until a side lies flat",
        ("friction",),
    )
)
