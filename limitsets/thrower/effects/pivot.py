"""Effect `pivot`: the struck vertex is held by friction and its own weight only, not by a hinge."""

from __future__ import annotations

import math
from typing import Any

from limitsets.jit import kernel
from limitsets.thrower.effects.drive import leant
from limitsets.thrower.impact import decide
from limitsets.thrower.motion import Contact, Face, FullSide, above, on_to_next, right_of, side_number

__all__ = ["turned_down"]


@kernel
def turned_down(pivot: Any, part: FullSide, hit: Contact) -> Face:
    """Turn the part about its vertex until a side comes down; without the effect the vertex is a hinge.

    By energy: over the top or back, then down with what was there at the start and the height lost.
    """
    right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
    inertia = part.own.rho2 + (right * right + high * high)
    kinetic = 0.5 * inertia * hit.omega * hit.omega
    ell = math.sqrt(right * right + high * high)
    gravity, right, high = leant(part.drive, part.own.kappa, right, high)
    near = right * abs(right) / (ell + abs(high))  # sgn(X) (ell - H), see impact.py
    far = (ell - high) if right > 0.0 else (high - ell)
    barrier = gravity * (near if high > 0.0 else far)
    over = decide(part.own.flip, hit.omega, kinetic, barrier) > 0.0
    side = hit.vertex + 1 if over else hit.vertex
    k = side_number(part, side)
    foot = part.a[k] - part.length[k] if over else part.a[k]
    _, _, low = leant(part.drive, part.own.kappa, foot, part.d[k])
    energy = kinetic + gravity * (high - low)
    rate = math.sqrt(max(2.0 * energy / inertia, 0.0))
    shift = hit.shift - on_to_next(part, hit.vertex) if over else hit.shift
    return Face(side, shift, hit.vertex, rate if over else -rate, hit.slide)
