"""Impact: the rotation after the plastic, sticking landing on the left vertex, and what a flip would need.

`strike` gives the rate after the impact, the kinetic energy about the vertex K and the barrier B = sgn(X) V: the
potential energy still to be climbed, negative once the centre of mass is past the vertex (X < 0).  `decide` turns
them into one number, positive where the part flips:

    signed:  sgn(omega) K - B        energy:  K - B

In the small-angle models X has no meaning and V keeps its own sign.
"""

from __future__ import annotations

from typing import Any

from limitsets.jit import generic, kernel
from limitsets.thrower.params import Energy, Exact, Side, Signed, SmallAngle, SmallAngle2
from limitsets.thrower.turn import Turned

__all__ = ["decide", "strike"]


@generic
def strike(flight: Any, part: Side, x: float, at: Turned) -> tuple[float, float, float]:
    """Rate after the impact, kinetic energy, barrier."""


@generic
def decide(flip: Any, omega: float, kinetic: float, barrier: float) -> float:
    """Return a number that is positive where the part flips."""


@kernel
def _exact(flight: Any, part: Side, x: float, at: Turned) -> tuple[float, float, float]:
    s, v = at.s, at.v
    right = part.a * (1.0 - v) - part.d * s  # X: the centre right of the vertex
    above = part.a * s + part.d * (1.0 - v)  # H: the centre above it
    omega = (part.rho2 + right * (x - part.kappa * at.phi) + above * (part.h + part.d)) * part.per_inertia
    kinetic = 0.5 * part.inertia * omega * omega
    # ell - H = X^2 / (ell + H) keeps its digits near the top; for H < 0 the difference itself does.
    near = right * abs(right) / (part.ell + abs(above))
    far = (part.ell - above) if right > 0.0 else (above - part.ell)
    return omega, kinetic, part.kappa * (near if above > 0.0 else far)


@kernel
def _small(flight: Any, part: Side, x: float, at: Turned) -> tuple[float, float, float]:
    a, d = part.a, part.d
    omega = (part.rho2 - a * x + 2.0 * a * a + d * d + d * part.h) * part.per_inertia
    kinetic = 0.5 * part.inertia * omega * omega
    return omega, kinetic, part.kappa * (a * a / (part.ell + d)) - 2.0 * a * (x - a)


@kernel
def _signed(flip: Any, omega: float, kinetic: float, barrier: float) -> float:
    return (kinetic if omega > 0.0 else -kinetic) - barrier


@kernel
def _energy(flip: Any, omega: float, kinetic: float, barrier: float) -> float:
    return kinetic - barrier


strike.on(Exact, _exact)
strike.on(SmallAngle, _small)
strike.on(SmallAngle2, _small)
decide.on(Signed, _signed)
decide.on(Energy, _energy)
