"""The box twin of `effects/landing.py` and `effects/pivot.py`: possible first vertices, and the sides that come down.

As long as the bracket of the left vertex's own landing stays at or below the exterior angle there nothing changes.  A
start still in the air at that angle has the next vertex at the same height, which is a concave function of the angle
where kappa exceeds that vertex's distance from the centre of mass: it has one root from there on, bracketed by numbers
that are proposed and then verified by signs.  So on to the next one; a cell may have more than one of these landings.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.interval import Interval
from limitsets.interval.number import square_root
from limitsets.jit import entry_of, generic, proof_kernel
from limitsets.thrower.effects.roll import Roll
from limitsets.thrower.impact import margin, swing
from limitsets.thrower.motion_box import (
    NOTHING,
    FullSideBox,
    box_of,
    corner_box,
    tips_box,
    vertex_box,
    wait,
)
from limitsets.thrower.turn_box import exact_turn, turn_box, turn_point

# A proposed bracket reaches this far, relative to phi, beyond what Newton's method proposes, and then ever farther.
SLACK = 2.0**-40
STEPS, WIDENINGS = 12, 40


@proof_kernel
def _newton(kappa: float, x: float, d: float, p: float, q: float) -> float:
    """Largest root of the height of a vertex, from its right, where the height is concave.  Believed by nobody."""
    most = d + math.sqrt(p * p + q * q)
    phi = (x + math.sqrt(x * x + 2.0 * kappa * most)) / kappa
    for _ in range(STEPS):
        s, v, _ = exact_turn(phi)
        f = (d + q) + phi * (x + p - 0.5 * kappa * phi) - p * (phi - s) - q * v
        slope = x - kappa * phi + p * (1.0 - v) - q * s
        phi = phi - f / slope if slope < 0.0 else math.nan
    return phi


@proof_kernel
def _height(part: FullSideBox, k: int, x: float, phi: float) -> Interval:
    """Height of vertex k over the arm at one angle, for all parameters."""
    p, q = vertex_box(part, k)
    at = turn_point(phi)
    fall = x + p - part.own.kappa * (0.5 * phi)
    rest: Interval = phi * fall - (p * at.phi_minus_sin + q * at.versin)
    return part.own.d + q + rest


@proof_kernel
def _bracket(part: FullSideBox, k: int, x: float, border: Interval) -> tuple[Interval, bool, bool]:
    """Angle at which vertex k lands of a start that is in the air at the angle `border`, for all parameters.

    Returns the bracket, whether it is proved, and whether its lower end is proved to be beyond the border: then the
    vertex has that root whether or not the start is in the air there.
    """
    p, q = vertex_box(part, k)
    mid_p, mid_q, d = 0.5 * (p.lo + p.hi), 0.5 * (q.lo + q.hi), 0.5 * (part.own.d.lo + part.own.d.hi)
    kappa, full_turn = part.own.kappa, part.own.flight.full_turn
    first, last = _newton(kappa.hi, x, d, mid_p, mid_q), _newton(kappa.lo, x, d, mid_p, mid_q)
    step, below, beyond = SLACK * first, first, False
    for _ in range(WIDENINGS):
        below = first - step
        beyond = (below > border.hi) & (_height(part, k, x, below).lo > 0.0)
        if beyond | (not below > border.hi):
            break
        step *= 2.0
    step, above, proved = SLACK * last, last, False
    for _ in range(WIDENINGS):
        above = max(last + step, border.hi)
        proved = (above <= full_turn) & (_height(part, k, x, above).hi < 0.0)
        if proved | (not above <= full_turn):
            break
        step *= 2.0
    concave = kappa.lo > square_root(p**2 + q**2).hi
    return Interval(below if beyond else border.lo, above), proved & concave, beyond


@proof_kernel
def _x_and_h(part: FullSideBox, k: int, phi: Interval) -> tuple[Interval, Interval]:
    """X and H: how far the centre of mass is right of vertex k and above it, the part turned by phi in all."""
    p, q = vertex_box(part, k)
    at = turn_box(phi)
    c = 1.0 - at.versin
    return q * at.sin - p * c, -(p * at.sin + q * c)


@proof_kernel
def _shift(part: FullSideBox, k: int, phi: float) -> Interval:
    """How far the centre of mass moves if the part falls back on side k; its derivative in phi is H - (h + d)."""
    b = box_of(part, k)
    right, _ = _x_and_h(part, k, Interval(phi, phi))
    return b.a - right - (part.own.h + part.own.d) * phi


@proof_kernel
def _place(part: FullSideBox, k: int, x: Interval, phi: Interval) -> Interval:
    """Enclose where the centre of mass is if the part falls back on side k."""
    _, above = _x_and_h(part, k, phi)
    slope = above - (part.own.h + part.own.d)
    least, most = _shift(part, k, phi.lo), _shift(part, k, phi.hi)
    wide = least + slope * Interval(0.0, (Interval(phi.hi, phi.hi) - phi.lo).hi)
    grows, falls = slope.lo >= 0.0, slope.hi <= 0.0
    lo = least.lo if grows else (most.lo if falls else wide.lo)
    hi = most.hi if grows else (least.hi if falls else wide.hi)
    return x + Interval(lo, hi)


@proof_kernel
def _place_of_cell(
    part: FullSideBox, k: int, x: Interval, first: Interval, last: Interval, beyond: bool
) -> Interval:
    """`_place` between the brackets of the first start and of the last; by its ends where it grows with the start.

    `beyond`: every start of the cell has this root, those that land on another vertex included.
    """
    phi = Interval(first.lo, last.hi)
    whole = _place(part, k, x, phi)
    right, above = _x_and_h(part, k, phi)
    below = part.own.kappa * phi - x + right
    slope = (above - (part.own.h + part.own.d)) * (phi / below)
    rising = beyond & (below.lo > 0.0) & (slope.lo > -1.0)
    least = _place(part, k, Interval(x.lo, x.lo), first).lo
    most = _place(part, k, Interval(x.hi, x.hi), last).hi
    return Interval(max(whole.lo, least), min(whole.hi, most)) if rising else whole


# Not inlined, for it is called in three places: it would be most of the compile time.
@generic(proof=True, inlined=False)
def came_down(part: FullSideBox, k: int, x: Interval, phi: Interval, place: Interval, count: int) -> int:
    """Strike with vertex k and turn about it: the sides the part may come down on wait; how many then do.

    `place`: of the centre of mass, if the part fell back on side k.
    """


@proof_kernel
def _barrier(
    roll: Any, part: FullSideBox, k: int, above: Interval, low: Interval, high: Interval, barrier: Interval
) -> Interval:
    """Return sgn(X) V about vertex k, sides on which the part cannot rest counted in: see `pivot._over`.

    `low`, `high`: heights of the centre of mass over side k and over the next one.
    """
    if roll is None:
        return barrier
    kappa = part.own.kappa
    behind, ahead = kappa * (above - low), kappa * (high - above)
    left, right = tips_box(part, k) == 1, tips_box(part, k + 1) == -1
    found = behind if left else (ahead if right else barrier)
    return Interval(found.lo, found.hi)


@proof_kernel
def _came_down(part: FullSideBox, k: int, x: Interval, phi: Interval, place: Interval, count: int) -> int:
    b, after = box_of(part, k), box_of(part, k + 1)
    right, above = _x_and_h(part, k, phi)
    omega, barrier = swing(b, right, above, x - b.kappa * phi, part.own.h + part.own.d)
    barrier = _barrier(entry_of(part.effects, Roll), part, k, above, b.d, after.d, barrier)
    flips = margin(b.flip, b.inertia, omega, barrier)
    kinetic = 0.5 * b.inertia * omega**2
    if not flips.lo > 0.0:
        energy = kinetic + b.kappa * (above - b.d)
        count = wait(part, count, k, True, False, energy, place)
    if not flips.hi <= 0.0:
        energy = kinetic + b.kappa * (above - after.d)
        count = wait(part, count, k + 1, False, False, energy, place - b.shift)
    return count


came_down.on(FullSideBox, _came_down)


@proof_kernel
def _without(landing: Any) -> bool:
    return landing is None


@proof_kernel
def landed(landing: Any, part: FullSideBox, x: Interval, phi: Interval, jog: Interval) -> int:
    """All landings of the starts of a cell: the sides that may come down wait; how many, or NOTHING.

    Parameters
    ----------
    phi : Interval
        Brackets the left vertex's own landing, over the whole cell; proved.
    jog : Interval
        Where the part jogs to from there.
    """
    side = part.own.side
    border = corner_box(part, side)
    if _without(landing) or phi.hi <= border.lo:
        return came_down(part, side, x, phi, jog, 0)
    count = 0
    if not phi.lo > border.hi:
        count = came_down(part, side, x, Interval(phi.lo, border.hi), jog, 0)
    for k in range(side + 1, side + part.lo.a.size):
        far = border + corner_box(part, k)
        first, fine, beyond = _bracket(part, k, x.lo, border)
        last, good, _ = _bracket(part, k, x.hi, border)
        if not good:
            return NOTHING
        if not first.lo > far.hi:
            place = _place_of_cell(part, k, x, first, last, beyond & fine)
            count = came_down(part, k, x, Interval(first.lo, min(last.hi, far.hi)), place, count)
        if last.hi <= far.lo:
            return count
        border = far
    return NOTHING
