"""A vertex at rest on the arm, about which the part turns, as far as friction can hold it.

While it is held, the part is a pendulum of energy E = (1/2) M omega^2 + kappa H, and the force on the vertex,

    M N = kappa rho^2 + H (3 kappa H - 2 E),      M T = X (3 kappa H - 2 E),

depends on the angle alone, the same on the way up and down again.  It holds while |T| <= mu N.  Where that first
fails is the first root of mu N - |T| along the way, found by a march: |N''|, |T''| <= (6 kappa ell^2 + 2 |E| ell)/M.
Source: docs/model.md, effects.
"""

from __future__ import annotations

import math

from limitsets.jit import kernel
from limitsets.thrower.march import STILL, sure_step
from limitsets.thrower.motion import LOST, OFF, ON, Contact, FullSide, above, right_of, side_number
from limitsets.thrower.turn import turn

# What the march along the way of a held vertex meets first.
FACE, TURNS, SLIPS = range(3)


@kernel
def _inertia(part: FullSide, right: float, high: float) -> float:
    """M: of the part about a vertex."""
    return part.own.rho2 + (right * right + high * high)


@kernel
def force(part: FullSide, hit: Contact) -> tuple[float, float]:
    """Return the force along the arm and off it, times M, that would hold the vertex now."""
    right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
    kappa, rate2 = part.own.kappa, hit.omega * hit.omega
    inertia = _inertia(part, right, high)
    return (
        right * (kappa * high - rate2 * inertia),
        kappa * (part.own.rho2 + high * high) - rate2 * inertia * high,
    )


@kernel
def holds_now(part: FullSide, mu: float, hit: Contact) -> bool:
    """Whether friction can hold the vertex at this moment."""
    along, off = force(part, hit)
    return off > 0.0 and abs(along) <= mu * off


@kernel
def gives_way(part: FullSide, mu: float, hit: Contact) -> tuple[int, int]:
    """Return which way a vertex slides that nothing can hold any more, 1 right, -1 left, and what it comes to.

    It leaves the arm where it would rise by itself, and slides against the force that would be needed to hold it.
    Where a force along the arm of mu N would press the vertex harder into the arm than N lifts it (Painleve's
    paradox), there is none, or more than one: the model does not say.
    """
    right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
    along, _ = force(part, hit)
    way = -1 if along > 0.0 else 1
    if not part.own.rho2 + right * right + mu * way * right * high > 0.0:
        return way, LOST
    return way, OFF if hit.omega * hit.omega * high >= part.own.kappa else ON


@kernel
def _march(
    part: FullSide,
    mu: float,
    right: float,
    high: float,
    energy: float,
    way: float,
    limit: float,
    rising: bool,
) -> tuple[float, int]:
    """Return how far the part turns, `way` round, until friction no longer holds, or it turns back, or is down."""
    kappa, ell = part.own.kappa, math.hypot(right, high)
    bound = (1.0 + mu) * (6.0 * kappa * ell + 2.0 * abs(energy)) * ell
    t = 0.0
    while t < limit:
        at = turn(t)
        x = right * (1.0 - at.versin) - way * high * at.sin
        y = high * (1.0 - at.versin) + way * right * at.sin
        pull = 3.0 * kappa * y - 2.0 * energy
        off, off_slope = kappa * part.own.rho2 + y * pull, way * x * (pull + 3.0 * kappa * y)
        along, along_slope = x * pull, way * (3.0 * kappa * x * x - y * pull)
        hold = mu * off - abs(along)
        left = energy - kappa * y
        if hold < 0.0:
            return t, SLIPS
        if rising and left <= 0.0:
            return t, TURNS
        step = sure_step(mu * off - along, mu * off_slope - along_slope, bound)
        step = min(step, sure_step(mu * off + along, mu * off_slope + along_slope, bound))
        slips = step
        step = min(step, sure_step(left, -way * kappa * x, kappa * ell)) if rising else step
        if step <= STILL * limit:
            return t, SLIPS if slips <= step else TURNS
        t += step
    return limit, FACE


@kernel
def lets_go(part: FullSide, mu: float, hit: Contact) -> tuple[Contact, bool]:
    """Turn the part about its vertex until friction no longer holds it; False where it does until a side is down."""
    right, high = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi)
    inertia, corner = _inertia(part, right, high), part.corner[side_number(part, hit.vertex)]
    energy = 0.5 * inertia * hit.omega * hit.omega + part.own.kappa * high
    way = math.copysign(1.0, hit.omega if hit.omega != 0.0 else -right)
    for leg in range(2):
        limit = corner - hit.psi.phi if way > 0.0 else hit.psi.phi
        rising = leg == 0 and hit.omega != 0.0
        t, event = _march(part, mu, right, high, energy, way, limit, rising)
        if event == SLIPS:
            psi = turn(min(max(hit.psi.phi + way * t, 0.0), corner))
            left = energy - part.own.kappa * above(part, hit.vertex, psi)
            omega = way * math.sqrt(max(2.0 * left / inertia, 0.0)) if t > 0.0 else way * abs(hit.omega)
            return Contact(hit.vertex, psi, hit.shift, omega, 0.0, 0.0), True
        if event == FACE:
            return hit, False
        way = -way
    return hit, False
