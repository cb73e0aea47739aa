"""The box twin of `effects/landing.py` and `effects/pivot.py`: what may land first, and the sides that come down then.

As long as the bracket of the left vertex's own landing stays at or below the exterior angle there nothing changes.  A
start still in the air at that angle has the next vertex at the same height, which is a concave function of the angle
where kappa exceeds that vertex's distance from the centre of mass: it has one root from there on, bracketed by numbers
that are proposed and then verified by signs.  So on to the next one; a cell may have more than one of these landings.
"""

from __future__ import annotations

import math
from typing import Any

import limitsets.interval as iv
from limitsets.interval.arithmetic import Interval
from limitsets.jit import generic, proof_kernel
from limitsets.thrower.impact_box import decide_box
from limitsets.thrower.motion_box import NOTHING, FullSideBox, box_of, corner_box, vertex_box, wait
from limitsets.thrower.turn_box import exact_turn, turn_box, turn_point

__all__ = ["came_down", "landed"]

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
    _, v, w = turn_point(phi)
    at = (phi, phi)
    fall = iv.sub(iv.add((x, x), p), iv.mul(part.own.kappa, (0.5 * phi, 0.5 * phi)))
    rest = iv.sub(iv.mul(at, fall), iv.add(iv.mul(p, w), iv.mul(q, v)))
    return iv.add(iv.add(part.own.d, q), rest)


@proof_kernel
def _bracket(part: FullSideBox, k: int, x: float, border: Interval) -> tuple[Interval, bool, bool]:
    """Angle at which vertex k lands of a start that is in the air at the angle `border`, for all parameters.

    Returns the bracket, whether it is proved, and whether its lower end is proved to be beyond the border: then the
    vertex has that root whether or not the start is in the air there.
    """
    p, q = vertex_box(part, k)
    mid_p, mid_q, d = 0.5 * (p[0] + p[1]), 0.5 * (q[0] + q[1]), 0.5 * (part.own.d[0] + part.own.d[1])
    kappa, full_turn = part.own.kappa, part.own.flight.full_turn
    first, last = _newton(kappa[1], x, d, mid_p, mid_q), _newton(kappa[0], x, d, mid_p, mid_q)
    step, below, beyond = SLACK * first, first, False
    for _ in range(WIDENINGS):
        below = first - step
        beyond = (below > border[1]) & (_height(part, k, x, below)[0] > 0.0)
        if beyond | (not below > border[1]):
            break
        step *= 2.0
    step, above, proved = SLACK * last, last, False
    for _ in range(WIDENINGS):
        above = max(last + step, border[1])
        proved = (above <= full_turn) & (_height(part, k, x, above)[1] < 0.0)
        if proved | (not above <= full_turn):
            break
        step *= 2.0
    concave = kappa[0] > iv.sqrt(iv.add(iv.sqr(p), iv.sqr(q)))[1]
    return (below if beyond else border[0], above), proved & concave, beyond


@proof_kernel
def _x_and_h(part: FullSideBox, k: int, lo: float, hi: float) -> tuple[Interval, Interval]:
    """X and H: how far the centre of mass is right of vertex k and above it, the part turned by [lo, hi] in all."""
    p, q = vertex_box(part, k)
    s, v, _ = turn_box(lo, hi)
    c = iv.sub((1.0, 1.0), v)
    return iv.sub(iv.mul(q, s), iv.mul(p, c)), iv.neg(iv.add(iv.mul(p, s), iv.mul(q, c)))


@proof_kernel
def _shift(part: FullSideBox, k: int, phi: float) -> Interval:
    """How far the centre of mass moves if the part falls back on side k; its derivative in phi is H - (h + d)."""
    b = box_of(part, k)
    right, _ = _x_and_h(part, k, phi, phi)
    return iv.sub(iv.sub(b.a, right), iv.mul(iv.add(part.own.h, part.own.d), (phi, phi)))


@proof_kernel
def _place(part: FullSideBox, k: int, x: Interval, phi: Interval) -> Interval:
    """Enclose where the centre of mass is if the part falls back on side k."""
    _, above = _x_and_h(part, k, phi[0], phi[1])
    slope = iv.sub(above, iv.add(part.own.h, part.own.d))
    least, most = _shift(part, k, phi[0]), _shift(part, k, phi[1])
    wide = iv.add(least, iv.mul(slope, (0.0, iv.sub((phi[1], phi[1]), (phi[0], phi[0]))[1])))
    grows, falls = slope[0] >= 0.0, slope[1] <= 0.0
    lo = least[0] if grows else (most[0] if falls else wide[0])
    hi = most[1] if grows else (least[1] if falls else wide[1])
    return iv.add(x, (lo, hi))


@proof_kernel
def _place_of_cell(
    part: FullSideBox, k: int, x: Interval, first: Interval, last: Interval, beyond: bool
) -> Interval:
    """`_place` between the brackets of the first start and of the last; by its ends where it grows with the start.

    `beyond`: every start of the cell has this root, those that land on another vertex included.
    """
    phi = (first[0], last[1])
    whole = _place(part, k, x, phi)
    right, above = _x_and_h(part, k, phi[0], phi[1])
    below = iv.add(iv.sub(iv.mul(part.own.kappa, phi), x), right)
    slope = iv.mul(iv.sub(above, iv.add(part.own.h, part.own.d)), iv.div(phi, below))
    rising = beyond & (below[0] > 0.0) & (slope[0] > -1.0)
    least, most = _place(part, k, (x[0], x[0]), first)[0], _place(part, k, (x[1], x[1]), last)[1]
    return max(whole[0], least) if rising else whole[0], min(whole[1], most) if rising else whole[1]


# Not inlined, for it is called in three places: it would be most of the compile time.
@generic(proof=True, inlined=False)
def came_down(part: FullSideBox, k: int, x: Interval, phi: Interval, place: Interval, count: int) -> int:
    """Strike with vertex k and turn about it: the sides the part may come down on wait; how many then do.

    `place`: of the centre of mass, if the part fell back on side k.
    """


@proof_kernel
def _came_down(part: FullSideBox, k: int, x: Interval, phi: Interval, place: Interval, count: int) -> int:
    b, after = box_of(part, k), box_of(part, k + 1)
    right, above = _x_and_h(part, k, phi[0], phi[1])
    turning = iv.mul(right, iv.sub(x, iv.mul(b.kappa, phi)))
    turning = iv.add(turning, iv.mul(above, iv.add(part.own.h, part.own.d)))
    omega = iv.div(iv.add(b.rho2, turning), b.inertia)
    # X |X| / (ell + H), as in impact_box.py
    square = iv.mul(right, iv.absolute(right))
    near = iv.div(square, iv.add(b.ell, above))
    rest = iv.sub(b.ell, above)[1]
    far = (-max(rest, 0.0) if right[0] < 0.0 else 0.0), (max(rest, 0.0) if right[1] > 0.0 else 0.0)
    upright = above[0] > 0.0
    barrier = iv.mul(b.kappa, (near[0] if upright else far[0], near[1] if upright else far[1]))
    margin = decide_box(b.flip, b, omega, barrier)
    kinetic = iv.mul(iv.mul((0.5, 0.5), b.inertia), iv.sqr(omega))
    if not margin[0] > 0.0:
        energy = iv.add(kinetic, iv.mul(b.kappa, iv.sub(above, b.d)))
        count = wait(part, count, k, True, False, energy, place)
    if not margin[1] <= 0.0:
        energy = iv.add(kinetic, iv.mul(b.kappa, iv.sub(above, after.d)))
        count = wait(part, count, k + 1, False, False, energy, iv.sub(place, b.shift))
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
    if _without(landing) or phi[1] <= border[0]:
        return came_down(part, side, x, phi, jog, 0)
    count = 0
    if not phi[0] > border[1]:
        count = came_down(part, side, x, (phi[0], border[1]), jog, 0)
    for k in range(side + 1, side + part.lo.a.size):
        far = iv.add(border, corner_box(part, k))
        first, fine, beyond = _bracket(part, k, x[0], border)
        last, good, _ = _bracket(part, k, x[1], border)
        if not good:
            return NOTHING
        if not first[0] > far[1]:
            place = _place_of_cell(part, k, x, first, last, beyond & fine)
            count = came_down(part, k, x, (first[0], min(last[1], far[1])), place, count)
        if last[1] <= far[0]:
            return count
        border = far
    return NOTHING
