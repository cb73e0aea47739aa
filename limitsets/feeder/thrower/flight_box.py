"""The box twin of `flight.py`: enclosures of sine and cosine, brackets of the impact angle, and its derivative.

The impact is enclosed by a bracket: numbers proposed by Halley's method, accepted only when the height of the vertex
is proved positive at (and, being concave, before) the lower one and negative at the upper one.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.feeder.thrower.flight import (
    V0,
    V1,
    V2,
    V3,
    V4,
    V5,
    V6,
    V7,
    W0,
    W1,
    W2,
    W3,
    W4,
    W5,
    W6,
    W7,
    Turned,
    pull,
)
from limitsets.feeder.thrower.params import Exact, SideBox, SmallAngle, SmallAngle2
from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.rounding import down, up
from limitsets.numbers.jit import generic, proof_kernel

# ----------------------------------------------------------------
# Enclosures of sin phi, 1 - cos phi and phi - sin phi for 0 <= phi <= 2 pi.
#
# The series and doublings of `turn.py`, summed by Horner's rule and compiled without contraction, with the bounds
#
#     |error of s| <= `BOUND` phi,   |error of v| <= `BOUND` phi^2,   |error of w| <= `BOUND` w,
#
# and `TINY` more, which a test proves in exact rationals from the coefficients as they are stored, with room for the
# rounding of the bounds themselves.  They are relative where phi is small, so that nothing is lost near the joint.


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


# ----------------------------------------------------------------
# The box twin of `flight.py`: brackets of the impact angle, and its derivative.


# The bracket of an impact reaches this far, relative to phi, beyond what Halley's method proposes: wide against the
# rounding of f (some 2^-46 of its terms), narrow against the 1e-9 asked of end points.
SLACK = 2.0**-43

FULL_TURN = 2.0 * math.pi


@generic(proof=True)
def bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    """Interval that holds the impact angle of a start x for all parameters, and whether that is proved."""


@generic(proof=True)
def sure_bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    """Return the same, however long it takes."""


@generic(proof=True)
def angle_slope(flight: Any, b: SideBox, x: Interval, at: Turned) -> Interval:
    """Return the derivative of the impact angle with respect to x."""


@proof_kernel
def _right_of_root(kappa: float, a: float, d: float, ell: float, reach: float) -> float:
    """Right of the root: w <= phi^3/6 and v <= phi^2/2 in f, or f <= R phi + 2 ell - (kappa/2) phi^2."""
    b = 0.5 * (kappa - d)
    under = b * b - (2.0 / 3.0) * a * reach
    cubic = 2.0 * reach / (b + math.sqrt(max(under, 0.0)))
    x = reach + a
    far = (x + math.sqrt(x * x + 4.0 * kappa * ell)) / kappa
    return min(cubic, far) if under > 0.0 else far


@proof_kernel
def _nearer(kappa: float, a: float, d: float, reach: float, phi: float) -> float:
    """One step of Halley's method: f'' costs little beside f, and three steps do what takes Newton's four to five."""
    s, v, w = exact_turn(phi)
    f = phi * (reach - 0.5 * kappa * phi) + a * w + d * v
    slope = reach + a * v + d * s - kappa * phi
    bend = a * s + d * (1.0 - v) - kappa
    return phi - f * slope / (slope * slope - 0.5 * f * bend)


@proof_kernel
def _least_height(b: SideBox, reach: Interval, phi: float) -> float:
    """Bound on f from below, for all parameters: f grows with reach, a and d (v, w >= 0) and falls with kappa."""
    at = turn_point(phi)
    a, d = b.a.lo, b.d.lo
    fall = down(reach.lo - up(b.kappa.hi * (0.5 * phi)))
    turned = down(
        down(min(a * at.phi_minus_sin.lo, a * at.phi_minus_sin.hi))
        + down(min(d * at.versin.lo, d * at.versin.hi))
    )
    return down(down(phi * fall) + turned)


@proof_kernel
def _most_height(b: SideBox, reach: Interval, phi: float) -> float:
    """Bound on f from above."""
    at = turn_point(phi)
    a, d = b.a.hi, b.d.hi
    fall = up(reach.hi - down(b.kappa.lo * (0.5 * phi)))
    turned = up(
        up(max(a * at.phi_minus_sin.lo, a * at.phi_minus_sin.hi))
        + up(max(d * at.versin.lo, d * at.versin.hi))
    )
    return up(up(phi * fall) + turned)


@proof_kernel
def _exact_bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    reach = x - b.a
    # As f, its root is smallest at one corner of the parameters and largest at the other.
    phi = _right_of_root(b.kappa.hi, b.a.lo, b.d.lo, b.ell.hi, reach.lo)
    for _ in range(3):
        phi = _nearer(b.kappa.hi, b.a.lo, b.d.lo, reach.lo, phi)
    other = phi
    for _ in range(2):
        other = _nearer(b.kappa.lo, b.a.hi, b.d.hi, reach.hi, other)
    lo, hi = phi - SLACK * phi, other + SLACK * other
    proved = (reach.lo > 0.0) & (lo > 0.0) & (hi <= flight.full_turn) & b.single_root
    proved &= (_least_height(b, reach, lo) > 0.0) & (_most_height(b, reach, hi) < 0.0)
    return Interval(lo, hi), proved


@proof_kernel
def _marched(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    """As `_exact_bracket`, however many roots there are: a march that cannot step over the smallest.

    With M >= |f''|, f(t + s) >= f(t) + f'(t) s - M s^2/2, so f stays positive up to the positive root of that parabola,
    shrunk by 2^-20 against rounding.  At the start f(s) >= f'(0) s - M s^2/2.  Where no step is left the lower end is
    reached; the upper end is the next angle tried at which f is proved negative.  Near a double root, or where the
    first root jumps within the parameters, the bracket is wide and still right.
    """
    reach = x - b.a
    bound = (Interval(b.kappa.hi, b.kappa.hi) + b.ell.hi).hi
    shrink = 1.0 - 2.0**-20
    t = shrink * 2.0 * reach.lo / bound
    going = reach.lo > 0.0
    while going and t < FULL_TURN:
        f = _least_height(b, reach, t)
        at = turn_point(t)
        slope = reach + (b.a * at.versin + b.d * at.sin)
        low = (slope - b.kappa * t).lo
        inside = low * low + 2.0 * bound * f
        step = shrink * (low + math.sqrt(max(inside, 0.0))) / bound
        going = (f > 0.0) & (step > 2.0**-40 * t)
        t = t + step if going else t
    # Never 0: it would stay 0, as it would where the start is not proved to be right of a.
    width = max(2.0**-36 * t, 2.0**-1022)
    while t > 0.0 and t + width < FULL_TURN and not _most_height(b, reach, t + width) < 0.0:
        width *= 1.25
    hi = t + width
    proved = (reach.lo > 0.0) & (t > 0.0) & (hi <= FULL_TURN) & (_most_height(b, reach, hi) < 0.0)
    return Interval(t, hi), proved


@proof_kernel
def _exact_slope(flight: Any, b: SideBox, x: Interval, at: Turned) -> Interval:
    reach = x - b.a
    below = b.kappa * at.phi - (reach + (b.a * at.versin + b.d * at.sin))
    slope: Interval = at.phi / below
    return slope


@proof_kernel
def _small_bracket(flight: Any, b: SideBox, x: float) -> tuple[Interval, bool]:
    phi = 2.0 * (x - b.a) / pull(flight, b)
    return phi, (phi.lo > 0.0) & (phi.hi <= flight.full_turn)


@proof_kernel
def _small_slope(flight: Any, b: SideBox, x: Interval, at: Turned) -> Interval:
    slope: Interval = 2.0 / pull(flight, b)
    return slope


sure_bracket.on(Exact, _marched)
sure_bracket.on(SmallAngle, _small_bracket)
sure_bracket.on(SmallAngle2, _small_bracket)
bracket.on(Exact, _exact_bracket)
bracket.on(SmallAngle, _small_bracket)
bracket.on(SmallAngle2, _small_bracket)
angle_slope.on(Exact, _exact_slope)
angle_slope.on(SmallAngle, _small_slope)
angle_slope.on(SmallAngle2, _small_slope)
