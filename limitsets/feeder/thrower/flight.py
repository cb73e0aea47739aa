"""Flight: sin phi, 1 - cos phi and phi - sin phi, and the angle at which the left vertex meets the arm.

With s = sin phi, v = 1 - cos phi, w = phi - sin phi the height of the left vertex over the arm is

    f(phi) = (R - a) phi + a w + d v - (kappa/2) phi^2            (docs/model.md, flight; the arm's height cancels)

a sum that starts at zero with slope R - a and loses no digit for small phi.  The impact is its smallest positive
root.  For kappa > ell = hypot(a, d) the function is strictly concave and has one root, which `impact_angle` finds by
a fixed number of steps and a check; everything else, and whatever fails the check, goes to `first_root`.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.feeder.thrower.params import Exact, Side, SmallAngle, SmallAngle2
from limitsets.numbers.jit import generic, kernel

# ----------------------------------------------------------------
# sin phi, 1 - cos phi and phi - sin phi together, for angles up to a full turn, without cancellation.
#
# The three are summed from their series at t = phi/8 <= pi/4 and doubled three times with
#
#     sin 2t = 2 sin t cos t,   1 - cos 2t = 2 sin^2 t,   2t - sin 2t = 2 (t - sin t) + 2 sin t (1 - cos t),
#
# in which every sum for t <= pi/2 has terms of one sign.  No branch and no library call: the loop vectorises.  Near an
# angle already turned to, `turn_back` and `turn_back_slightly` cost a fraction of that.


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


# ----------------------------------------------------------------
# Flight: the angle at which the left vertex meets the arm.


# Halley's method: the step before the last is small enough for `turn_back`, and a last step this small against phi
# leaves an error of its cube, below half an ulp.
SMALL = 2.0**-4
CONVERGED = 2.0**-18
# A bound of the second derivative has to stay positive; any larger one is a bound too.
LEAST_BEND = 2.0**-20
# Steps of the march below this fraction of phi no longer move it.
STILL = 2.0**-52


@generic
def impact_angle(flight: Any, part: Side, x: float) -> tuple[Turned, float, bool]:
    """Turn up to the impact, the angle's derivative with respect to x, and whether the answer can be vouched for."""


# Not inlined: one piece of machine code then finds the angle for every caller, and x' is x plus the displacement told.
@generic(inlined=False)
def sure_impact_angle(flight: Any, part: Side, x: float) -> tuple[Turned, float]:
    """Turn up to the impact (nan: none within a full turn) and the angle's derivative, however long it takes."""


@kernel
def _guess(part: Side, reach: float) -> float:
    """Return a fraction fitted to the roots: 6 % off at most on the paper's parts, up to a full turn.

    Farther off for kappa near ell, where more throws fail the check and go to the second pass.
    """
    z = part.per_b * reach
    return z * (1.0 + part.over * z) / (1.0 + z * (part.under + part.under2 * z))


@kernel
def _height(part: Side, reach: float, at: Turned) -> tuple[float, float]:
    """f and f' where the part has turned."""
    f = at.phi * (reach - 0.5 * part.kappa * at.phi) + part.a * at.phi_minus_sin + part.d * at.versin
    return f, reach + part.a * at.versin + part.d * at.sin - part.kappa * at.phi


@kernel
def _halley(part: Side, reach: float, at: Turned) -> tuple[float, float]:
    """Return the step of Halley's method, to be taken off, and f'."""
    f, slope = _height(part, reach, at)
    bend = part.a * at.sin + part.d * (1.0 - at.versin) - part.kappa
    return f * slope / (slope * slope - 0.5 * f * bend), slope


@kernel
def _exact(flight: Any, part: Side, x: float) -> tuple[Turned, float, bool]:
    reach = x - part.a
    at = rough_turn(_guess(part, reach))
    step, _ = _halley(part, reach, at)
    at = turn(at.phi - step)
    second, _ = _halley(part, reach, at)
    at = turn_back(at, second)
    step, slope = _halley(part, reach, at)
    at = turn_back_slightly(at, step)
    settled = part.single_root & (abs(second) <= SMALL) & (abs(step) <= CONVERGED * at.phi) & (slope < 0.0)
    return at, -at.phi / slope, settled


@kernel
def sure_step(f: float, slope: float, bound: float) -> float:
    """How far a function surely stays positive that is f > 0 now, rises by `slope` and bends by `bound` at most.

    Where f'' >= -bound, f stays positive up to the positive root of the parabola f + f' t - bound t^2/2.  Near a simple
    root such steps of a march shrink quadratically, near a touching one geometrically.
    """
    root = math.sqrt(slope * slope + 2.0 * bound * f)
    return (slope + root) / bound if slope > 0.0 else 2.0 * f / (root - slope)


@kernel
def first_root(part: Side, x: float) -> float:
    """Smallest positive root of f, nan where there is none within a full turn.

    A march that cannot step over a root: f'' >= -M with M = kappa + ell, so f stays positive up to the positive
    root of the parabola f + f' t - M t^2/2.  Over the next t <= phi the third derivative is -(a + 2 d phi) at least,
    which bounds f'' by its value here: near the vertex, for kappa near d, that takes a dozen steps where M takes
    millions.  Near a simple root the steps shrink quadratically; near a touching one geometrically, and never to
    nothing while f is positive.
    """
    reach = x - part.a
    most = part.kappa + part.ell
    phi = 2.0 * reach / most
    while phi <= 2.0 * math.pi:
        at = turn(phi)
        f, slope = _height(part, reach, at)
        if f <= 0.0:
            return phi
        bend = (part.kappa - part.d) + part.d * at.versin - part.a * at.sin
        here = max(bend + phi * (part.a + 2.0 * part.d * phi) / 3.0, LEAST_BEND * most)
        bound = min(here, most)
        step = sure_step(f, slope, bound)
        step = min(step, phi) if here < most else step
        if step <= STILL * phi:
            return phi
        phi += step
    return math.nan


@kernel
def _exact_surely(flight: Any, part: Side, x: float) -> tuple[Turned, float]:
    phi = first_root(part, x)
    at = turn(phi)
    _, slope = _height(part, x - part.a, at)
    return at, -phi / slope


def _whole(flight: Any, part: Any) -> Any:
    return part.kappa


def _less_height(flight: Any, part: Any) -> Any:
    return part.kappa - part.d


@generic
def pull(flight: Any, part: Any) -> Any:
    """Return what pulls the vertex back in a small-angle flight, phi = 2 (R - a) / pull, for every kind of number."""


@kernel
def _small(flight: Any, part: Side, x: float) -> tuple[Turned, float, bool]:
    fall = pull(flight, part)
    return Turned(2.0 * (x - part.a) / fall, 0.0, 0.0, 0.0), 2.0 / fall, True


@kernel
def _small_surely(flight: Any, part: Side, x: float) -> tuple[Turned, float]:
    at, slope, _ = _small(flight, part, x)
    return at, slope


pull.on(SmallAngle, _whole)
pull.on(SmallAngle2, _less_height)
impact_angle.on(Exact, _exact)
impact_angle.on(SmallAngle, _small)
impact_angle.on(SmallAngle2, _small)
sure_impact_angle.on(Exact, _exact_surely)
sure_impact_angle.on(SmallAngle, _small_surely)
sure_impact_angle.on(SmallAngle2, _small_surely)
