"""Flight: the angle at which the left vertex meets the arm.

With s = sin phi, v = 1 - cos phi, w = phi - sin phi the height of the left vertex over the arm is

    f(phi) = (R - a) phi + a w + d v - (kappa/2) phi^2            (docs/model.md, flight; the arm's height cancels)

a sum that starts at zero with slope R - a and loses no digit for small phi.  The impact is its smallest positive
root.  For kappa > ell = hypot(a, d) the function is strictly concave and has one root, which `impact_angle` finds by
a fixed number of steps and a check; everything else, and whatever fails the check, goes to `first_root`.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.jit import generic, kernel
from limitsets.thrower.params import Exact, Side, SmallAngle, SmallAngle2
from limitsets.thrower.turn import turn

__all__ = ["first_root", "impact_angle", "sure_impact_angle"]

# A last Newton step this small against phi leaves an error of its square, below half an ulp.
CONVERGED = 2.0**-28
# Steps of the march below this fraction of phi no longer move it.
STILL = 2.0**-52


def impact_angle(flight: Any, part: Side, x: float) -> tuple[float, float, bool]:
    """Angle of the impact, its derivative with respect to x, and whether the answer can be vouched for."""


impact_angle = generic(impact_angle)


def sure_impact_angle(flight: Any, part: Side, x: float) -> tuple[float, float]:
    """Angle of the impact (nan: none within a full turn) and its derivative, however long it takes."""


sure_impact_angle = generic(sure_impact_angle)


@kernel
def _guess(part: Side, reach: float) -> float:
    """Right of the root: w <= phi^3/6 and v <= phi^2/2 in f, or f <= R phi + 2 ell - (kappa/2) phi^2."""
    b = 0.5 * (part.kappa - part.d)
    under = b * b - (2.0 / 3.0) * part.a * reach
    cubic = 2.0 * reach / (b + math.sqrt(max(under, 0.0)))
    x = reach + part.a
    far = (x + math.sqrt(x * x + 4.0 * part.kappa * part.ell)) / part.kappa
    return min(cubic, far) if under > 0.0 else far


@kernel
def _exact(flight: Any, part: Side, x: float) -> tuple[float, float, bool]:
    reach = x - part.a
    phi = _guess(part, reach)
    for _ in range(2):  # Halley
        s, v, w = turn(phi)
        f = phi * (reach - 0.5 * part.kappa * phi) + part.a * w + part.d * v
        slope = reach + part.a * v + part.d * s - part.kappa * phi
        bend = part.a * s + part.d * (1.0 - v) - part.kappa
        phi -= f * slope / (slope * slope - 0.5 * f * bend)
    s, v, w = turn(phi)
    f = phi * (reach - 0.5 * part.kappa * phi) + part.a * w + part.d * v
    slope = reach + part.a * v + part.d * s - part.kappa * phi
    step = f / slope
    phi -= step
    settled = part.single_root & (abs(step) <= CONVERGED * phi) & (slope < 0.0)
    return phi, -phi / slope, settled


@kernel
def _height(part: Side, reach: float, phi: float) -> tuple[float, float]:
    """f and f' at phi."""
    s, v, w = turn(phi)
    f = phi * (reach - 0.5 * part.kappa * phi) + part.a * w + part.d * v
    return f, reach + part.a * v + part.d * s - part.kappa * phi


@kernel
def first_root(part: Side, x: float) -> float:
    """Smallest positive root of f, nan where there is none within a full turn.

    A march that cannot step over a root: f'' >= -M with M = kappa + ell, so f stays positive up to the positive
    root of the parabola f + f' t - M t^2/2.  Near a simple root the steps shrink quadratically; near a touching
    one geometrically, and never to nothing while f is positive.
    """
    reach = x - part.a
    bound = part.kappa + part.ell
    phi = 2.0 * reach / bound
    while phi <= 2.0 * math.pi:
        f, slope = _height(part, reach, phi)
        if f <= 0.0:
            return phi
        root = math.sqrt(slope * slope + 2.0 * bound * f)
        step = (slope + root) / bound if slope > 0.0 else 2.0 * f / (root - slope)
        if step <= STILL * phi:
            return phi
        phi += step
    return math.nan


@kernel
def _exact_surely(flight: Any, part: Side, x: float) -> tuple[float, float]:
    phi = first_root(part, x)
    _, slope = _height(part, x - part.a, phi)
    return phi, -phi / slope


@kernel
def _small(flight: Any, part: Side, x: float) -> tuple[float, float, bool]:
    return 2.0 * (x - part.a) / part.kappa, 2.0 / part.kappa, True


@kernel
def _small_surely(flight: Any, part: Side, x: float) -> tuple[float, float]:
    return 2.0 * (x - part.a) / part.kappa, 2.0 / part.kappa


@kernel
def _small2(flight: Any, part: Side, x: float) -> tuple[float, float, bool]:
    return 2.0 * (x - part.a) / (part.kappa - part.d), 2.0 / (part.kappa - part.d), True


@kernel
def _small2_surely(flight: Any, part: Side, x: float) -> tuple[float, float]:
    return 2.0 * (x - part.a) / (part.kappa - part.d), 2.0 / (part.kappa - part.d)


impact_angle.on(Exact, _exact)  # type: ignore[attr-defined]  # generic functions carry `on`
impact_angle.on(SmallAngle, _small)  # type: ignore[attr-defined]
impact_angle.on(SmallAngle2, _small2)  # type: ignore[attr-defined]
sure_impact_angle.on(Exact, _exact_surely)  # type: ignore[attr-defined]
sure_impact_angle.on(SmallAngle, _small_surely)  # type: ignore[attr-defined]
sure_impact_angle.on(SmallAngle2, _small2_surely)  # type: ignore[attr-defined]
