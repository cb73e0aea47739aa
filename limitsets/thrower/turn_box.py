"""Enclosures of sin phi, 1 - cos phi and phi - sin phi for 0 <= phi <= 2 pi.

The series and doublings of `turn.py`, summed by Horner's rule and compiled without contraction, with the bounds

    |error of s| <= `BOUND` phi,   |error of v| <= `BOUND` phi^2,   |error of w| <= `BOUND` w,

and `TINY` more, which a test proves in exact rationals from the coefficients as they are stored, with room for the
rounding of the bounds themselves.  They are relative where phi is small, so that nothing is lost near the joint.
"""

from __future__ import annotations

import math

from limitsets.interval import Interval
from limitsets.jit import proof_kernel
from limitsets.thrower.turn import V0, V1, V2, V3, V4, V5, V6, V7, W0, W1, W2, W3, W4, W5, W6, W7, Turned

BOUND = 2.0**-45
# Below the normal range errors are absolute.
TINY = 2.0**-1040

HALF_PI_BELOW, HALF_PI_ABOVE = math.nextafter(math.pi / 2, 0.0), math.nextafter(math.pi / 2, 4.0)
PI_BELOW, PI_ABOVE = math.nextafter(math.pi, 0.0), math.nextafter(math.pi, 4.0)
THREE_BELOW, THREE_ABOVE = math.nextafter(1.5 * math.pi, 0.0), math.nextafter(1.5 * math.pi, 9.0)


@proof_kernel
def exact_turn(phi: float) -> tuple[float, float, float]:
    """``(sin phi, 1 - cos phi, phi - sin phi)`` within the bounds of this module."""
    t = 0.125 * phi
    q = t * t
    w = t * q * (W0 + q * (W1 + q * (W2 + q * (W3 + q * (W4 + q * (W5 + q * (W6 + q * W7)))))))
    v = q * (V0 + q * (V1 + q * (V2 + q * (V3 + q * (V4 + q * (V5 + q * (V6 + q * V7)))))))
    s = t - w
    for _ in range(3):
        w, v, s = 2.0 * (w + s * v), 2.0 * s * s, 2.0 * s * (1.0 - v)
    return s, v, w


@proof_kernel
def turn_point(phi: float) -> Turned:
    """Enclosures at one angle; `BOUND` has room for the rounding of the sums below."""
    s, v, w = exact_turn(phi)
    es, ev, ew = BOUND * phi + TINY, BOUND * phi * phi + TINY, BOUND * w + TINY
    return Turned(
        Interval(phi, phi),
        Interval(max(s - es, -1.0), min(s + es, 1.0)),
        Interval(max(v - ev, 0.0), min(v + ev, 2.0)),
        Interval(max(w - ew, 0.0), w + ew),
    )


@proof_kernel
def turn_box(phi: Interval) -> Turned:
    """Enclosures over an interval of angles in [0, 2 pi]: w grows throughout, v up to pi, s between its extremes."""
    lo, hi = phi.lo, phi.hi
    first, last = turn_point(lo), turn_point(hi)
    s_lo, s_hi = min(first.sin.lo, last.sin.lo), max(first.sin.hi, last.sin.hi)
    v_lo, v_hi = min(first.versin.lo, last.versin.lo), max(first.versin.hi, last.versin.hi)
    s_hi = 1.0 if (lo <= HALF_PI_ABOVE) & (hi >= HALF_PI_BELOW) else s_hi
    s_lo = -1.0 if (lo <= THREE_ABOVE) & (hi >= THREE_BELOW) else s_lo
    v_hi = 2.0 if (lo <= PI_ABOVE) & (hi >= PI_BELOW) else v_hi
    return Turned(
        phi,
        Interval(s_lo, s_hi),
        Interval(v_lo, v_hi),
        Interval(first.phi_minus_sin.lo, last.phi_minus_sin.hi),
    )
