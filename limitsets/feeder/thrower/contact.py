"""The part at or over the arm after an impact: held at a vertex, sliding on it, or in free flight to the next one.

Only one vertex can be the lowest while the part has turned from lying on its side by less than the exterior angle
there; at the ends of that range a neighbour is as low and takes over.  From the start of such a range, with the lowest
vertex `height` over the arm, rising by `slope` and the centre of mass X right of it and H above it,

    f(t) = height + slope t - (kappa/2) t^2 + X (theta - sin theta) + H (1 - cos theta),     theta = omega t,

in which nothing cancels, and f'' >= -(kappa + omega^2 ell): the march of `flight.first_root`, range by range, for
either direction of rotation.  Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

from limitsets.feeder.thrower.flight import STILL, Turned, sure_step, turn
from limitsets.feeder.thrower.motion import (
    DOWN,
    LOST,
    OFF,
    ON,
    Arrival,
    Contact,
    FullSide,
    above,
    right_of,
    side_number,
)
from limitsets.numbers.jit import kernel

# ----------------------------------------------------------------
# A vertex at rest on the arm, about which the part turns, as far as friction can hold it.
#
# While it is held, the part is a pendulum of energy E = (1/2) M omega^2 + kappa H, and the force on the vertex,
#
#     M N = kappa rho^2 + H (3 kappa H - 2 E),      M T = X (3 kappa H - 2 E),
#
# depends on the angle alone, the same on the way up and down again.  It holds while |T| <= mu N.  Where that first
# fails is the first root of mu N - |T| along the way, found by a march: |N''|, |T''| <= (6 kappa ell^2 + 2 |E| ell)/M.
# Source: docs/model.md, effects.


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


# ----------------------------------------------------------------
# A vertex that slides along the arm: integrated until it stops, lifts off, or a side comes down.
#
# With the centre of mass X right of the vertex and H above it, way = 1 for sliding to the right and -1 to the left,
#
#     N = rho^2 (kappa - omega^2 H) / (rho^2 + X^2 + way mu X H)
#     psi' = omega,   omega' = -N (X + way mu H)/rho^2,   slide' = omega^2 X - N [X H + way mu (rho^2 + H^2)]/rho^2.
#
# The vertex lets go where N falls to nothing, which is where omega^2 H reaches kappa.  A denominator that is not
# positive is Painleve's paradox: no force, or more than one, agrees with the motion; the model does not say. The
# integrator is the pair of orders 5 and 4 of Dormand and Prince, going on with order 5; an event within a step is
# found by taking that step again, shorter. Source: docs/model.md, effects; Dormand and Prince, J. Comput. Appl. Math.
# 6, 1980.


# psi, omega, slide, and how far the vertex has slid.
State: TypeAlias = tuple[float, float, float, float]

# Error allowed to a step, against the part's own size and rate.  A slide takes some ten to a hundred steps, so that its
# end is good to about 1e-11: less than a friction coefficient or a cell can tell, at a tenth of the cost of rounding.
TOLERANCE = 1e-13
# Steps of one slide before it is given up: near Painleve's paradox the force grows without end.
MOST_STEPS = 20_000
# An event is found where its function is this small, some units in the last place.
FOUND = 2.0**-50

B2 = (1 / 5,)
B3 = (3 / 40, 9 / 40)
B4 = (44 / 45, -56 / 15, 32 / 9)
B5 = (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729)
B6 = (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656)
B7 = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
# order 5 less order 4
E7 = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)


@kernel
def _sum(weights: Any, rates: Any) -> State:
    p, q, r, s = 0.0, 0.0, 0.0, 0.0
    for k in range(len(weights)):
        p += weights[k] * rates[k][0]
        q += weights[k] * rates[k][1]
        r += weights[k] * rates[k][2]
        s += weights[k] * rates[k][3]
    return p, q, r, s


@kernel
def _on(y: State, h: float, weights: Any, rates: Any) -> State:
    """Return the state a time h on, at the weighted sum of some rates."""
    p, q, r, s = _sum(weights, rates)
    return y[0] + h * p, y[1] + h * q, y[2] + h * r, y[3] + h * s


@kernel
def _arms(part: FullSide, k: int, psi: float) -> tuple[float, float]:
    """X and H, of any angle near those at which the vertex is the lowest."""
    at = turn(psi)
    return part.a[k] * (1.0 - at.versin) - part.d[k] * at.sin, part.a[k] * at.sin + part.d[k] * (
        1.0 - at.versin
    )


@kernel
def _rates(part: FullSide, k: int, drag: float, y: State) -> State:
    """Return the derivative of the state; drag is way mu."""
    rho2, rate2 = part.own.rho2, y[1] * y[1]
    x, high = _arms(part, k, y[0])
    push = (part.own.kappa - rate2 * high) / (rho2 + x * x + drag * x * high)
    return y[1], -push * (x + drag * high), rate2 * x - push * (x * high + drag * (rho2 + high * high)), y[2]


@kernel
def _step(part: FullSide, k: int, drag: float, y: State, f: State, h: float) -> tuple[State, State, State]:
    """Return the state after a step, its derivative there, and the estimate of the step's error."""
    f2 = _rates(part, k, drag, _on(y, h, B2, (f,)))
    f3 = _rates(part, k, drag, _on(y, h, B3, (f, f2)))
    f4 = _rates(part, k, drag, _on(y, h, B4, (f, f2, f3)))
    f5 = _rates(part, k, drag, _on(y, h, B5, (f, f2, f3, f4)))
    f6 = _rates(part, k, drag, _on(y, h, B6, (f, f2, f3, f4, f5)))
    after = _on(y, h, B7, (f, f2, f3, f4, f5, f6))
    f7 = _rates(part, k, drag, after)
    p, q, r, s = _sum(E7, (f, f2, f3, f4, f5, f6, f7))
    return after, f7, (h * p, h * q, h * r, h * s)


@kernel
def _still(part: FullSide, k: int, way: float, speed: float, y: State) -> tuple[float, float, float, float]:
    """Four numbers, positive while the vertex slides `way`, the part is down on neither side, and the arm pushes."""
    _, high = _arms(part, k, y[0])
    return way * y[2] / speed, y[0], part.corner[k] - y[0], 1.0 - y[1] * y[1] * high / part.own.kappa


@kernel
def _least(values: tuple[float, float, float, float]) -> float:
    return min(min(values[0], values[1]), min(values[2], values[3]))


@kernel
def _dip(f: float, slope: float, after: float, slope_after: float, h: float) -> float:
    """Time at which a function, positive at both ends of a step, may have been lowest and negative; h if it was not."""
    if not (f > 0.0 and slope < 0.0 < slope_after):
        return h
    t = h * slope / (slope - slope_after)
    return t if min(f + 0.5 * slope * t, after - 0.5 * slope_after * (h - t)) <= 0.0 else h


@kernel
def _first_dip(
    part: FullSide, k: int, way: float, y: State, f: State, to: State, rate: State, h: float
) -> float:
    """Return the time at which a step may have passed over an event and back; h if it did not."""
    corner = part.corner[k]
    t = min(_dip(way * y[2], way * f[2], way * to[2], way * rate[2], h), _dip(y[0], y[1], to[0], to[1], h))
    return min(t, _dip(corner - y[0], -y[1], corner - to[0], -to[1], h))


@kernel
def _event(
    part: FullSide, k: int, drag: float, way: float, speed: float, y: State, f: State, h: float
) -> State:
    """Return the state at the first event of a step from y, at whose end one is past: regula falsi (Illinois)."""
    to, _, _ = _step(part, k, drag, y, f, h)
    low, high, before, after = 0.0, h, _least(_still(part, k, way, speed, y)), 0.0
    after = _least(_still(part, k, way, speed, to))
    for _ in range(100):
        t = low + (high - low) * before / (before - after) if before > 0.0 else 0.5 * (low + high)
        to, _, _ = _step(part, k, drag, y, f, t)
        left = _least(_still(part, k, way, speed, to))
        if abs(left) <= FOUND or high - low <= FOUND * h:
            break
        if left > 0.0:
            low, before, after = t, left, 0.5 * after
        else:
            high, after, before = t, left, 0.5 * before
    return to


@kernel
def _ended(part: FullSide, k: int, way: float, speed: float, hit: Contact, y: State) -> tuple[Contact, int]:
    """Return the contact at the event that is nearest, and what it has come to: still on the arm if it stopped."""
    slides, low, high, pushed = _still(part, k, way, speed, y)
    least, corner = min(min(slides, low), min(high, pushed)), part.corner[k]
    if low == least or high == least:
        psi = turn(0.0 if low == least else corner)
        return Contact(hit.vertex, psi, hit.shift + y[3], y[1], y[2], 0.0), DOWN
    psi = turn(min(max(y[0], 0.0), corner))
    if pushed == least:
        return Contact(hit.vertex, psi, hit.shift + y[3], y[1], y[2], 0.0), OFF
    return Contact(hit.vertex, psi, hit.shift + y[3], y[1], 0.0, 0.0), ON


@kernel
def slide_on(part: FullSide, mu: float, side_way: int, hit: Contact) -> tuple[Contact, int]:
    """Slide a vertex until it stops (ON), lets go (OFF), a side comes down (DOWN), or the model does not say (LOST)."""
    k, way = side_number(part, hit.vertex), float(side_way)
    drag, corner, rho2 = way * mu, part.corner[k], part.own.rho2
    size = math.hypot(part.a[k], part.d[k])
    rate = math.sqrt(part.own.kappa / size) + abs(hit.omega)
    speed = size * rate + abs(hit.slide)
    y = (min(max(hit.psi.phi, 0.0), corner), hit.omega, hit.slide, 0.0)
    f = _rates(part, k, drag, y)
    falls = y[1] if y[1] != 0.0 else f[1]
    if (y[0] <= 0.0 and falls < 0.0) or (y[0] >= corner and falls > 0.0):
        return hit, DOWN
    h = 0.01 / rate
    for _ in range(MOST_STEPS):
        x, high = _arms(part, k, y[0])
        if not rho2 + x * x + drag * x * high > 0.0:
            return hit, LOST
        if y[1] * y[1] * high > part.own.kappa:
            return Contact(hit.vertex, turn(y[0]), hit.shift + y[3], y[1], y[2], 0.0), OFF
        to, f_to, e = _step(part, k, drag, y, f, h)
        error = max(max(abs(e[0]), abs(e[1]) / rate), max(abs(e[2]) / speed, abs(e[3]) / size)) / TOLERANCE
        if not error <= 1.0:
            h *= max(0.2, 0.9 * error**-0.2) if error < math.inf else 0.2
            continue
        if _least(_still(part, k, way, speed, to)) <= 0.0:
            return _ended(part, k, way, speed, hit, _event(part, k, drag, way, speed, y, f, h))
        dip = _first_dip(part, k, way, y, f, to, f_to, h)
        if dip < h:
            h = dip
            continue
        y, f = to, f_to
        h *= min(5.0, 0.9 * max(error, 1e-4) ** -0.2)
    return hit, LOST


# ----------------------------------------------------------------
# Free flight of a part that leaves the arm again, up to the next vertex that strikes.


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
