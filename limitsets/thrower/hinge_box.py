"""The force that holds the struck vertex while the part turns about it, enclosed.

With H the height of the centre of mass over the vertex, X^2 = ell^2 - H^2, M = rho^2 + ell^2 and e = E / kappa, the
part's energy as a height, the vertex has to be pressed up with n weights and held along the arm with f of them:

    n = (rho^2 + 3 H^2 - 2 e H) / M,        f = X (3 H - 2 e) / M,

so n is least at H = e/3, or at the end of the heights passed that is nearest to it.
Source: docs/model.md, "What the minimal model assumes".
"""

from __future__ import annotations

import math

import limitsets.interval as iv
from limitsets.interval.arithmetic import Interval
from limitsets.jit import proof_kernel

__all__ = ["hinge_force", "peak"]

# Slices of the way on which the friction is enclosed; at their borders it is attained.
SLICES = 48


@proof_kernel
def peak(
    ell: Interval, right: Interval, start: Interval, omega: Interval, energy: Interval, jog: bool
) -> Interval:
    """Enclose the greatest height that the centre of mass passes."""
    climbs = (min(max(energy[0], start[0]), ell[0]), max(min(energy[1], ell[1]), start[1]))
    over = (ell[0], max(ell[1], start[1]))
    if jog and right[0] > 0.0:
        if omega[0] > 0.0:
            return climbs
        return start if omega[1] < 0.0 else (start[0], climbs[1])
    if not jog and right[0] > 0.0:
        return over
    if not jog and right[1] < 0.0 and omega[0] > 0.0:
        return start
    return start[0], over[1]


@proof_kernel
def _press(rho2: Interval, energy: Interval, height: float) -> Interval:
    """M n at a height."""
    h = (height, height)
    slope = iv.sub(iv.mul((3.0, 3.0), h), iv.mul((2.0, 2.0), energy))
    return iv.add(rho2, iv.mul(h, slope))


@proof_kernel
def _least(rho2: Interval, energy: Interval, outer: Interval, inner: Interval) -> Interval:
    """Bounds of the least M n: from below by a tangent of the convex function, from above by a height surely passed."""
    best = (energy[0] + energy[1]) / 6.0
    at = min(max(best, outer[0]), outer[1])
    slope = iv.sub(iv.mul((6.0, 6.0), (at, at)), iv.mul((2.0, 2.0), energy))
    rest = iv.mul(slope, iv.sub(outer, (at, at)))
    below = iv.add(_press(rho2, energy, at), rest)[0]
    sure = inner[0] <= inner[1]
    passed = min(max(best, inner[0]), inner[1])
    ends = max(_press(rho2, energy, outer[0])[1], _press(rho2, energy, outer[1])[1])
    return below, _press(rho2, energy, passed)[1] if sure else ends


@proof_kernel
def _friction(ell: Interval, rho2: Interval, energy: Interval, height: Interval) -> Interval:
    """Enclose |f| / n for heights between two."""
    square = iv.sub(iv.sqr(ell), iv.sqr(height))
    across = iv.sqrt((max(square[0], 0.0), square[1]))  # only rounding and dependency carry it below 0
    slope = iv.sub(iv.mul((3.0, 3.0), height), iv.mul((2.0, 2.0), energy))
    press = iv.add(rho2, iv.mul(height, slope))
    ratio = iv.div(iv.mul(across, iv.absolute(slope)), press)
    good = (press[0] > 0.0) & (ratio[1] >= 0.0)
    return ratio[0] if good else 0.0, ratio[1] if good else math.inf


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
    outer = (min(start[0], end[0]), max(max(start[1], end[1]), top[1]))
    inner = (min(start[1], end[1]), max(max(start[0], end[0]), top[0]))
    least = _least(rho2, energy, outer, inner)
    force = iv.div(least, inertia)
    if not force[0] > 0.0:
        surely = math.inf if force[1] < 0.0 else 0.0
        return force, (surely, math.inf)
    most, attained = 0.0, 0.0
    step = (outer[1] - outer[0]) / SLICES
    for k in range(SLICES):
        first = outer[0] + k * step
        last = outer[1] if k == SLICES - 1 else outer[0] + (k + 1) * step
        most = max(most, _friction(ell, rho2, energy, (first, last))[1])
        for border in (first, last):
            height = min(max(border, inner[0]), inner[1])
            if inner[0] <= inner[1]:
                attained = max(attained, _friction(ell, rho2, energy, (height, height))[0])
    return force, (attained, most)
