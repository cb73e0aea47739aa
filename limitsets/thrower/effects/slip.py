"""Effect `slip`: the struck vertex sticks only where friction can hold it."""

from __future__ import annotations

from typing import Any

from limitsets.jit import kernel
from limitsets.thrower.motion import Arrival, Contact, FullSide, above, right_of

__all__ = ["struck"]


@kernel
def struck(slip: Any, part: FullSide, hit: Arrival) -> Contact:
    """Return the part just after its vertex struck; without the effect it sticks, whatever friction that takes."""
    right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
    inertia = part.own.rho2 + (right * right + high * high)
    omega = (part.own.rho2 * hit.omega + right * hit.vy - high * hit.vx) / inertia
    return Contact(hit.vertex, hit.psi, hit.shift, omega, 0.0, 0.0)
