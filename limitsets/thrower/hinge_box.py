"""The force that holds the struck vertex while the part turns about it, enclosed.

With H the height of the centre of mass over the vertex, X^2 = ell^2 - H^2, M = rho^2 + ell^2 and e = E / kappa, the
part's energy as a height, the vertex has to be pressed up with n weights and held along the arm with f of them:

    n = (rho^2 + 3 H^2 - 2 e H) / M,        f = X (3 H - 2 e) / M,

so n is least at H = e/3, or at the end of the heights passed that is nearest to it.
Source: docs/model.md, "What the minimal model assumes".
"""

from __future__ import annotations

import math

from limitsets.interval import Interval
from limitsets.interval.number import square_root
from limitsets.jit import proof_kernel

# Slices of the way on which the friction is enclosed; at their borders it is attained.
SLICES = 48


@proof_kernel
def peak(
    ell: Interval, right: Interval, start: Interval, omega: Interval, energy: Interval, jog: bool
) -> Interval:
    """Enclose the greatest height that the centre of mass passes."""
    climbs = Interval(min(max(energy.lo, start.lo), ell.lo), max(min(energy.hi, ell.hi), start.hi))
    over = Interval(ell.lo, max(ell.hi, start.hi))
    if jog and right.lo > 0.0:
        if omega.lo > 0.0:
            return climbs
        return start if omega.hi < 0.0 else Interval(start.lo, climbs.hi)
    if not jog and right.lo > 0.0:
        return over
    if not jog and right.hi < 0.0 and omega.lo > 0.0:
        return start
    return Interval(start.lo, over.hi)


@proof_kernel
def _press(rho2: Interval, energy: Interval, height: float) -> Interval:
    """M n at a height."""
    h = Interval(height, height)
    return rho2 + h * (3.0 * h - 2.0 * energy)


@proof_kernel
def _least(rho2: Interval, energy: Interval, outer: Interval, inner: Interval) -> Interval:
    """Bounds of the least M n: from below by a tangent of the convex function, from above by a height surely passed."""
    best = (energy.lo + energy.hi) / 6.0
    at = min(max(best, outer.lo), outer.hi)
    slope = Interval(6.0, 6.0) * at - 2.0 * energy
    rest = slope * (outer - at)
    below = (_press(rho2, energy, at) + rest).lo
    sure = inner.lo <= inner.hi
    passed = min(max(best, inner.lo), inner.hi)
    ends = max(_press(rho2, energy, outer.lo).hi, _press(rho2, energy, outer.hi).hi)
    return Interval(below, _press(rho2, energy, passed).hi if sure else ends)


@proof_kernel
def _friction(ell: Interval, rho2: Interval, energy: Interval, height: Interval) -> Interval:
    """Enclose |f| / n for heights between two."""
    square = ell**2 - height**2
    # only rounding and dependency carry it below 0
    across = square_root(Interval(max(square.lo, 0.0), square.hi))
    slope = 3.0 * height - 2.0 * energy
    press = rho2 + height * slope
    ratio = across * abs(slope) / press
    good = (press.lo > 0.0) & (ratio.hi >= 0.0)
    return Interval(ratio.lo if good else 0.0, ratio.hi if good else math.inf)


@proof_kernel
def hinge_force(
    ell: Interval,
    rho2: Interval,
    inertia: Interval,
    start: Interval,
    top: Interval,
    end: Interval,
    energy: Interval,
) -> tuple[Interval, Interval]:
    """Enclose the least n, and the greatest |f| / n (inf where n falls below 0).

    Parameters
    ----------
    ell, rho2, inertia : Interval
        Of the part about its vertex.
    start, top, end : Interval
        Heights at the landing, at the highest, and where a side lies flat [length].
    energy : Interval
        The energy as a height [length].
    """
    outer = Interval(min(start.lo, end.lo), max(max(start.hi, end.hi), top.hi))
    inner = Interval(min(start.hi, end.hi), max(max(start.lo, end.lo), top.lo))
    least = _least(rho2, energy, outer, inner)
    force = least / inertia
    if not force.lo > 0.0:
        surely = math.inf if force.hi < 0.0 else 0.0
        return force, Interval(surely, math.inf)
    most, attained = 0.0, 0.0
    step = (outer.hi - outer.lo) / SLICES
    for k in range(SLICES):
        first = outer.lo + k * step
        last = outer.hi if k == SLICES - 1 else outer.lo + (k + 1) * step
        most = max(most, _friction(ell, rho2, energy, Interval(first, last)).hi)
        for border in (first, last):
            height = min(max(border, inner.lo), inner.hi)
            if inner.lo <= inner.hi:
                attained = max(attained, _friction(ell, rho2, energy, Interval(height, height)).lo)
    return force, Interval(attained, most)
