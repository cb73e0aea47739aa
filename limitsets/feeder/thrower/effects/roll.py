"""Effect `roll`: the part rolls on, or rocks, over the other end of the side it came down on.

Coming down on a side about one of its ends, the part strikes the arm with the other end k', which sticks:

    omega' = omega [rho^2 + r_k . r_k'] / M_k',        r_k . r_k' = d^2 - a (L - a),

a stop where the bracket is negative.  What is then left of the energy may lift it over k', or only rock it up and down
again; each impact keeps a part of the energy smaller than one, and the part rests when it can be lifted over neither
end.  On a side beside which its centre of mass stands, a chamfer, it never rests: it tips over the end that is nearer,
at the latest after it has rocked on the other one, and no throw begins there.
Oracle: Housner's rocking block, whose rates are as 1 - (3/2) sin^2 alpha.  Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.feeder.thrower.effects.bounce import struck
from limitsets.feeder.thrower.effects.drive import Drive, leant
from limitsets.feeder.thrower.flight import turn
from limitsets.feeder.thrower.motion import (
    Arrival,
    Contact,
    Effect,
    Face,
    FullSide,
    declare,
    enclosed,
    encloses,
    on_to_next,
    possible,
    right_of,
    side_number,
    tips,
)
from limitsets.numbers.jit import entry_of, kernel

# A part that slides and turns with less than this share of the energy that would lift it lies flat: what is left is
# rocking without end, by which it moves less than its size times the share's root.
FLAT = 1e-12


class Roll(NamedTuple):
    """The part may roll on."""

    most: float = 1e6  # impacts, far above what the energy allows


@kernel
def _other_end(part: FullSide, face: Face) -> Arrival:
    """Return the strike of the end of a side that comes down after the other."""
    k = side_number(part, face.side)
    a, d, right = part.a[k], part.d[k], part.length[k] - part.a[k]
    left_end = face.vertex == face.side
    other = face.side - 1 if left_end else face.side
    reach = a if left_end else -right  # X of the vertex it turned about
    psi = turn(part.corner[side_number(part, other)]) if left_end else turn(0.0)
    # about the right end the part has turned by all of the angle there, and would lie one side back
    shift = face.shift + on_to_next(part, other) if left_end else face.shift
    return Arrival(other, psi, shift, face.slide - face.omega * d, face.omega * reach, face.omega)


@kernel
def _rolls(roll: Any, part: FullSide, face: Face, after: Contact) -> bool:
    """Whether a part that does not bounce moves on over the end that struck.

    It has to turn on the same way, not against the side's other end, with energy enough to be lifted over the nearer
    end, however much of that it has by sliding; but not just by sliding, flat on its side.  Where it cannot rest it
    moves on with whatever is left.
    """
    if roll is None:
        return False
    if tips(part, face.side) != 0:
        return True
    lift = min(_lift(part, face.side, 1), _lift(part, face.side, -1))  # over the nearer end
    right = right_of(part, after.vertex, after.psi)
    along, up = after.slide - after.omega * part.d[side_number(part, face.side)], after.omega * right
    turning = part.own.rho2 * after.omega * after.omega + up * up
    # kernels take arrays as Any, and with them d and all that comes of it
    return (after.omega * face.omega > 0.0) & (turning + along * along > 2.0 * lift) & (turning > FLAT * lift)  # type: ignore[no-any-return]


@kernel
def next_arrival(roll: Any, bounce: Any, slip: Any, part: FullSide, face: Face) -> tuple[Arrival, bool]:
    """Return the strike of the side's other end, and whether anything moves after it; without an effect it rests."""
    hit = _other_end(part, face)
    if roll is None and bounce is None:
        return hit, False
    after = struck(bounce, slip, part, hit)
    return hit, after.lift > 0.0 or _rolls(roll, part, face, after)


@kernel
def _lift(part: FullSide, side: int, way: int) -> float:
    """Energy to get over an end of a side, `way` 1 the left and -1 the right one.

    To the top, or on to a next side that is lower than that.
    """
    k, beside = side_number(part, side), side_number(part, side + way)
    if way * tips(part, side + way) < 0:
        return part.own.kappa * (part.d[beside] - part.d[k])  # type: ignore[no-any-return]  # kernels take arrays as Any
    foot = part.a[k] if way > 0 else part.a[k] - part.length[k]
    gravity, right, high = leant(entry_of(part.effects, Drive), part.own.kappa, foot, part.d[k])
    return gravity * right * right / (math.hypot(right, high) + high)  # ell - H


@kernel
def _begins(roll: Roll, so_far: bool, part: FullSide, x: float) -> bool:
    """Whether a throw can begin on a side: not where the part cannot rest."""
    return so_far and tips(part, part.own.side) == 0


possible.on(Roll, _begins)
encloses.on(Roll, enclosed)
declare(
    Effect("roll", Roll, lambda world, how: Roll(), "the part then stays where it is until the next throw")
)
