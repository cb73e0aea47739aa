"""Effect `roll`: the part rolls on, or rocks, over the other end of the side it came down on.

Coming down on a side about one of its ends, the part strikes the arm with the other end k', which sticks:

    omega' = omega [rho^2 + r_k . r_k'] / M_k',        r_k . r_k' = d^2 - a (L - a),

a stop where the bracket is negative.  What is then left of the energy may lift it over k', or only rock it up and down
again; each impact keeps a part of the energy smaller than one, and the part rests when it can be lifted over neither
end.  Oracle: Housner's rocking block, whose rates are as 1 - (3/2) sin^2 alpha.  Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.jit import kernel
from limitsets.thrower.effects.drive import leant
from limitsets.thrower.motion import Arrival, Face, FullSide, on_to_next, side_number
from limitsets.thrower.turn import turn

__all__ = ["Roll", "next_arrival"]


class Roll(NamedTuple):
    """The part may roll on."""

    most: float = 1e6  # impacts, far above what the energy allows


@kernel
def next_arrival(roll: Any, part: FullSide, face: Face) -> tuple[Arrival, bool]:
    """Return the strike of the side's other end, and whether anything moves after it; without the effect it rests."""
    k = side_number(part, face.side)
    a, d, right = part.a[k], part.d[k], part.length[k] - part.a[k]
    left_end = face.vertex == face.side
    other = face.side - 1 if left_end else face.side
    reach = a if left_end else -right  # X of the vertex it turned about
    psi = turn(part.corner[side_number(part, other)]) if left_end else turn(0.0)
    # about the right end the part has turned by all of the angle there, and would lie one side back
    shift = face.shift + on_to_next(part, other) if left_end else face.shift
    hit = Arrival(other, psi, shift, face.slide - face.omega * d, face.omega * reach, face.omega)
    if roll is None:
        return hit, False
    keeps = part.own.rho2 + d * d - a * right
    inertia = part.own.rho2 + d * d + (right * right if left_end else a * a)
    omega = face.omega * keeps / inertia
    kinetic = 0.5 * inertia * omega * omega
    lift = min(_lift(part, a, d), _lift(part, -right, d))
    return hit, (keeps > 0.0) & (kinetic > lift)


@kernel
def _lift(part: FullSide, foot: float, d: float) -> float:
    """Energy it takes from lying on a side to the top over one of its ends, which is `foot` left of the centre."""
    gravity, right, high = leant(part.drive, part.own.kappa, foot, d)
    return gravity * right * right / (math.sqrt(right * right + high * high) + high)  # ell - H
