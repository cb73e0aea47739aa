"""Free flight of a part that leaves the arm again, up to the next vertex that strikes.

Only one vertex can be the lowest while the part has turned from lying on its side by less than the exterior angle
there; at the ends of that range a neighbour is as low and takes over.  From the start of such a range, with the lowest
vertex `height` over the arm, rising by `slope` and the centre of mass X right of it and H above it,

    f(t) = height + slope t - (kappa/2) t^2 + X (theta - sin theta) + H (1 - cos theta),     theta = omega t,

in which nothing cancels, and f'' >= -(kappa + omega^2 ell): the march of `flight.first_root`, range by range, for
either direction of rotation.  Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.jit import kernel
from limitsets.thrower.march import STILL, sure_step
from limitsets.thrower.motion import Arrival, Contact, FullSide, above, right_of, side_number
from limitsets.thrower.turn import Turned, turn

# Vertices that may be the lowest in turn before a flight is given up: no throw turns a part that far.
MOST_RANGES = 10_000


@kernel
def _just_off(slope: float, kappa: float, omega: float, right: float, high: float) -> float:
    """Return a time up to which a vertex that leaves the arm now is surely above it, not zero if it leaves at all.

    By its slope; without one, where the force has just fallen to nothing, by f'' and f''' and |f''''| <= omega^4 ell.
    """
    ell = math.hypot(right, high)
    if slope > 0.0:
        return slope / (kappa + omega * omega * ell)
    bend, third = max(omega * omega * high - kappa, 0.0), omega * omega * omega * right
    bound = omega * omega * omega * omega * ell / 12.0
    return 0.5 * (third / 6.0 + math.sqrt(third * third / 36.0 + 2.0 * bound * bend)) / bound


@kernel
def _descent(
    kappa: float,
    omega: float,
    right: float,
    high: float,
    height: float,
    slope: float,
    begin: float,
    end: float,
) -> tuple[float, float]:
    """Time and height at the first root from `begin` on, or at `end` where there is none before; f as above."""
    bound = kappa + omega * omega * math.hypot(right, high)
    sign = math.copysign(1.0, omega)
    t = begin
    while t < end:
        at = turn(abs(omega) * t)
        f = height + t * (slope - 0.5 * kappa * t) + sign * right * at.phi_minus_sin + high * at.versin
        if f <= 0.0:
            return t, f
        step = sure_step(f, slope - kappa * t + omega * (right * at.versin + sign * high * at.sin), bound)
        if step <= STILL * t:
            return t, 0.0
        t += step
    at = turn(abs(omega) * end)
    return end, height + end * (
        slope - 0.5 * kappa * end
    ) + sign * right * at.phi_minus_sin + high * at.versin


@kernel
def _inward_of(part: FullSide, vertex: int, psi: Turned) -> float:
    """Return how far the centre of mass is left of where it would be on side `vertex`, about the same vertex."""
    k = side_number(part, vertex)
    return part.a[k] * psi.versin + part.d[k] * psi.sin  # type: ignore[no-any-return]  # kernels take arrays as Any


@kernel
def next_contact(part: FullSide, start: Contact) -> tuple[Arrival, bool]:
    """Return the next vertex to strike after a contact that lets go, and whether there is one."""
    kappa, omega, vertex, psi = part.own.kappa, start.omega, start.vertex, start.psi
    right, high = right_of(part, vertex, psi), above(part, vertex, psi)
    centre = start.shift - _inward_of(part, vertex, psi)
    vx, rise = start.slide - omega * high, start.lift + omega * right
    height, slope, begin = 0.0, start.lift, _just_off(start.lift, kappa, omega, right, high)
    for _ in range(MOST_RANGES):
        corner = part.corner[side_number(part, vertex)]
        border = corner if omega > 0.0 else 0.0
        end = abs(border - psi.phi) / abs(omega) if omega != 0.0 else math.inf
        t, left = _descent(kappa, omega, right, high, height, slope, begin, end)
        centre, rise = centre + vx * t, rise - kappa * t
        if t < end:
            psi = turn(min(max(psi.phi + omega * t, 0.0), corner))
            shift = centre + _inward_of(part, vertex, psi)
            return Arrival(vertex, psi, shift, vx, rise, omega), True
        vertex += 1 if omega > 0.0 else -1
        psi = turn(0.0 if omega > 0.0 else part.corner[side_number(part, vertex)])
        right, high = right_of(part, vertex, psi), above(part, vertex, psi)
        height, slope, begin = left, rise - omega * right, 0.0
        if height <= 0.0 and slope <= 0.0:
            shift = centre + _inward_of(part, vertex, psi)
            return Arrival(vertex, psi, shift, vx, rise, omega), True
        if height <= 0.0:
            height = 0.0
            begin = _just_off(slope, kappa, omega, right, high)
    return Arrival(vertex, psi, centre, vx, rise, omega), False


@kernel
def fly_on(
    pivot: Any, slip: Any, bounce: Any, part: FullSide, start: Contact, hit: Arrival
) -> tuple[Arrival, bool]:
    """Return the strike after a flight; without the effects by which a contact lets go there is none."""
    if pivot is None and slip is None and bounce is None:
        return hit, False
    return next_contact(part, start)
