"""sin phi, 1 - cos phi and phi - sin phi together, for angles up to a full turn, without cancellation.

The three are summed from their series at t = phi/8 <= pi/4 and doubled three times with

    sin 2t = 2 sin t cos t,   1 - cos 2t = 2 sin^2 t,   2t - sin 2t = 2 (t - sin t) + 2 sin t (1 - cos t),

in which every sum for t <= pi/2 has terms of one sign.  No branch and no library call: the loop vectorises.  Near an
angle already turned to, `turn_back` and `turn_back_slightly` cost a fraction of that.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.jit import kernel

# (phi - sin phi)/phi^3 and (1 - cos phi)/phi^2 in powers of phi^2.  At phi = pi/4 the first term left out is
# below 1e-17 of the sum.
W0, W1, W2, W3, W4, W5, W6, W7 = ((-1) ** k / math.factorial(2 * k + 3) for k in range(8))
V0, V1, V2, V3, V4, V5, V6, V7 = ((-1) ** k / math.factorial(2 * k + 2) for k in range(8))


class Turned(NamedTuple):
    """An angle with its sine, 1 - cosine, and what the sine is short of it; of any kind of number."""

    phi: Any
    sin: Any
    versin: Any
    phi_minus_sin: Any


@kernel
def _double(s: float, v: float, w: float) -> tuple[float, float, float]:
    return 2.0 * s * (1.0 - v), 2.0 * s * s, 2.0 * (w + s * v)


@kernel
def turn(phi: float) -> Turned:
    """Turn by 0 <= phi <= 2 pi [rad]. The series are summed in pairs: Horner's rule would wait for each term."""
    t = 0.125 * phi
    q = t * t
    q2 = q * q
    q4 = q2 * q2
    w = t * q * (((W0 + q * W1) + q2 * (W2 + q * W3)) + q4 * ((W4 + q * W5) + q2 * (W6 + q * W7)))
    v = q * (((V0 + q * V1) + q2 * (V2 + q * V3)) + q4 * ((V4 + q * V5) + q2 * (V6 + q * V7)))
    s = t - w
    s, v, w = _double(s, v, w)
    s, v, w = _double(s, v, w)
    s, v, w = _double(s, v, w)
    return Turned(phi, s, v, w)


@kernel
def rough_turn(phi: float) -> Turned:
    """As `turn`, to about 1e-4 for angles up to a full turn."""
    t = 0.125 * phi
    q = t * t
    w = t * q * (W0 + q * (W1 + q * W2))
    v = q * (V0 + q * (V1 + q * V2))
    s = t - w
    s, v, w = _double(s, v, w)
    s, v, w = _double(s, v, w)
    s, v, w = _double(s, v, w)
    return Turned(phi, s, v, w)


@kernel
def turn_back(to: Turned, e: float) -> Turned:
    """Turn by phi - e, to rounding for abs(e) <= 2^-4."""
    q = e * e
    w = e * q * (W0 + q * (W1 + q * W2))
    v = q * (V0 + q * (V1 + q * V2))
    s = e - w
    c = 1.0 - to.versin
    return Turned(
        to.phi - e,
        to.sin - to.sin * v - c * s,
        to.versin + c * v - to.sin * s,
        to.phi_minus_sin - w - to.versin * s + to.sin * v,
    )


@kernel
def turn_back_slightly(to: Turned, e: float) -> Turned:
    """Turn by phi - e, to rounding for abs(e) <= 2^-18 phi."""
    c = 1.0 - to.versin
    h = 0.5 * e
    return Turned(
        to.phi - e,
        to.sin - e * (c + h * to.sin),
        to.versin - e * (to.sin - h * c),
        to.phi_minus_sin - e * (to.versin - h * to.sin),
    )
