"""Effect `slip`: the struck vertex sticks only where friction can hold it.

With the centre of mass X right of the contact and H above it, an impulse (J_t, J_n) changes the contact's velocity by

    A J_t + B J_n along the arm,  B J_t + C J_n off it,   A = 1 + H^2/rho^2,  B = -X H/rho^2,  C = 1 + X^2/rho^2.

Routh's method: J_n grows and friction is -mu J_n against the sliding; when the sliding stops on the way, the vertex
sticks if |B| <= mu A, else it slides the other way, that of B; compression ends when the contact no longer approaches
the arm.  What comes out has no jump.  The vertex sticks, as the bare map has it, where the impulse that stops it pushes
and mu is at least |J_t|/J_n of that impulse and |B|/A; where that impulse would have to pull it slides on, with any
friction.  With mu = 0 the centre of mass keeps its horizontal velocity.  A part that stays on a side slides on there by
xdot^2/(2 mu kappa).
Source: docs/model.md, effects; Wang and Mason, J. Applied Mechanics 59, 1992.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.feeder.thrower.motion import (
    Arrival,
    Contact,
    Effect,
    Face,
    FullSide,
    above,
    declare,
    moved,
    right_of,
    side_number,
)
from limitsets.numbers.jit import kernel


class Slip(NamedTuple):
    """Friction of finite strength at an impact, and on the side the part comes to lie on."""

    friction: float


@kernel
def _dragged(mu: float, a: float, b: float, slide: float, push: float) -> tuple[float, float]:
    """Return friction's impulse, and the sliding after it, while the normal impulse grows by `push`; A, B as above."""
    way = math.copysign(1.0, slide)
    closing = mu * a - way * b
    stop = abs(slide) / closing if closing > 0.0 else math.inf
    stop = 0.0 if slide == 0.0 else stop
    if push <= stop:
        return -mu * way * push, slide - way * closing * push
    rest = push - stop
    if abs(b) <= mu * a:
        return -mu * way * stop - b / a * rest, 0.0
    back = math.copysign(1.0, b)
    return -mu * (way * stop + back * rest), back * (abs(b) - mu * a) * rest


@kernel
def dragged(slip: Any, part: FullSide, hit: Contact, push: float) -> tuple[float, float]:
    """Return friction's impulse, and the sliding after it, for a normal impulse; without the effect it sticks."""
    right, high, rho2 = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi), part.own.rho2
    if slip is None:
        return right * high / (rho2 + high * high) * push, 0.0
    return _dragged(slip.friction, 1.0 + high * high / rho2, -right * high / rho2, hit.slide, push)


@kernel
def _compression(mu: float, a: float, b: float, c: float, along: float, off: float) -> float:
    """Return the normal impulse at which a contact that moves `along` the arm, and `off` it, stops approaching."""
    way = math.copysign(1.0, along)
    closing, slowing = mu * a - way * b, c - mu * way * b
    stop = abs(along) / closing if closing > 0.0 else math.inf
    stop = 0.0 if along == 0.0 else stop
    push = max(-off, 0.0) / slowing if slowing > 0.0 else math.inf
    if push <= stop:
        return push
    then = c - b * b / a if abs(b) <= mu * a else c - mu * abs(b)
    return stop + max(-(off + slowing * stop), 0.0) / then


@kernel
def compressed(slip: Any, part: FullSide, hit: Arrival) -> tuple[Contact, float]:
    """Return the part at the end of compression, and the normal impulse; without the effect its vertex sticks."""
    right, high, rho2 = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi), part.own.rho2
    inertia = rho2 + (right * right + high * high)
    omega = (rho2 * hit.omega + right * hit.vy - high * hit.vx) / inertia
    stuck = Contact(hit.vertex, hit.psi, hit.shift, omega, 0.0, 0.0)
    if slip is None:
        return stuck, omega * right - hit.vy
    a, b, c = 1.0 + high * high / rho2, -right * high / rho2, 1.0 + right * right / rho2
    along, off = hit.vx + hit.omega * high, hit.vy - hit.omega * right
    push = _compression(slip.friction, a, b, c, along, off)
    drag, slide = _dragged(slip.friction, a, b, along, push)
    if slide == 0.0:  # still along the arm and off it: rounded as the bare map rounds it
        return stuck, push
    omega = hit.omega + (high * drag - right * push) / rho2
    return Contact(hit.vertex, hit.psi, hit.shift, omega, slide, 0.0), push


@kernel
def _slid_on(slip: Slip, shift: float, part: FullSide, face: Face) -> float:
    """Shift of a part that slides on, on the side it stays on [length]; nan or inf where the model does not say.

    The stop is one impact of both ends: J_n is what stops the fall, and the side's one velocity along the arm follows
    Routh's method with A = 1 and B = -omega d / J_n, all of the rotation gone at its end.  A part that tips over its
    leading end, or finds no friction, is outside the model.
    """
    mu, k = slip.friction, side_number(part, face.side)
    reach = part.a[k] if face.vertex == face.side else part.length[k] - part.a[k]
    b = -math.copysign(part.d[k] / reach, face.omega)
    _, slide = _dragged(mu, 1.0, b, face.slide, abs(face.omega) * reach)
    if slide == 0.0:
        return shift
    ahead = part.length[k] - part.a[k] if slide > 0.0 else part.a[k]
    if mu * part.d[k] > ahead:
        return math.nan
    return shift + math.copysign(slide * slide / (2.0 * mu * part.own.kappa), slide)


moved.on(Slip, _slid_on)
declare(
    Effect(
        "slip",
        Slip,
        lambda world, how: Slip(float(world.friction)),
        "the vertex that lands sticks without slipping",
        ("friction",),
    )
)
