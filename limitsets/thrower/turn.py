"""sin phi, 1 - cos phi and phi - sin phi together, for angles up to a full turn, without cancellation.

The three are summed from their series at t = phi/8 <= pi/4 and doubled three times with

    sin 2t = 2 sin t cos t,   1 - cos 2t = 2 sin^2 t,   2t - sin 2t = 2 (t - sin t) + 2 sin t (1 - cos t),

in which every sum for t <= pi/2 has terms of one sign.  No branch and no library call: the loop vectorises.
"""

from __future__ import annotations

import math

from limitsets.jit import kernel

__all__ = ["turn"]

# (phi - sin phi)/phi^3 and (1 - cos phi)/phi^2 in powers of phi^2.  At phi = pi/4 the first term left out is
# below 1e-17 of the sum.
W0, W1, W2, W3, W4, W5, W6, W7 = ((-1) ** k / math.factorial(2 * k + 3) for k in range(8))
V0, V1, V2, V3, V4, V5, V6, V7 = ((-1) ** k / math.factorial(2 * k + 2) for k in range(8))


@kernel
def turn(phi: float) -> tuple[float, float, float]:
    """``(sin phi, 1 - cos phi, phi - sin phi)`` for 0 <= phi <= 2 pi [rad]."""
    t = 0.125 * phi
    q = t * t
    w = t * q * (W0 + q * (W1 + q * (W2 + q * (W3 + q * (W4 + q * (W5 + q * (W6 + q * W7)))))))
    v = q * (V0 + q * (V1 + q * (V2 + q * (V3 + q * (V4 + q * (V5 + q * (V6 + q * V7)))))))
    s = t - w
    w, v, s = 2.0 * (w + s * v), 2.0 * s * s, 2.0 * s * (1.0 - v)
    w, v, s = 2.0 * (w + s * v), 2.0 * s * s, 2.0 * s * (1.0 - v)
    w, v, s = 2.0 * (w + s * v), 2.0 * s * s, 2.0 * s * (1.0 - v)
    return s, v, w
