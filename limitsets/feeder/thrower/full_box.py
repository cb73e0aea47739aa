"""The box twin of the throw with effects; of one whose file has not said that boxes follow it nothing is proved.

The steps are those of `full.py`, each effect's in its own file.  Undecided events are followed in all ways; if a cell
has more than two places of rest, it is undecided, and the caller subdivides it.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.feeder.thrower.effects.landing import Landing
from limitsets.feeder.thrower.effects.roll import Roll
from limitsets.feeder.thrower.flight_box import exact_turn, turn_box, turn_point
from limitsets.feeder.thrower.impact import margin, swing
from limitsets.feeder.thrower.motion import (
    NOTHING,
    ROOM,
    FullSideBox,
    FullThrow,
    Ways,
    all_enclosed,
    box_of,
    corner_box,
    gather_full_box,
    moved_box,
    no_way,
    put,
    tips_box,
    vertex_box,
    wait,
)
from limitsets.feeder.thrower.throw_box import sure_throw_box, throw_box
from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.number import smaller, square_root
from limitsets.numbers.jit import entry_of, generic, proof_kernel
from limitsets.systems.maps.kernels import fallback_box, image_box

# ----------------------------------------------------------------
# The box twin of `effects/landing.py` and `effects/pivot.py`: possible first vertices, and the sides that come
# down.
#
# As long as the bracket of the left vertex's own landing stays at or below the exterior angle there nothing changes.  A
# start still in the air at that angle has the next vertex at the same height, which is a concave function of the angle
# where kappa exceeds that vertex's distance from the centre of mass: it has one root from there on, bracketed by
# numbers that are proposed and then verified by signs.  So on to the next one; a cell may have more than one of these
# landings.


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
    height = behind if left else (ahead if right else barrier)
    return Interval(height.lo, height.hi)


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
def absent(effect: Any) -> bool:
    """Whether an effect is not simulated."""
    return effect is None


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
    if absent(landing) or phi.hi <= border.lo:
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


# ----------------------------------------------------------------
# The box twin of `effects/roll.py`: whether the part rests on a side that came down, or goes on over one of its
# ends.
#
# Only energies matter.  Coming down on side k about one end with kinetic energy E, of which the strike of the other end
# leaves E' = E [rho^2 + d^2 - a (L - a)]^2 / (M M') or nothing, the part rests where E' lifts it over neither end; over
# the other end it comes down on the next side, with E' and the height lost; otherwise it rocks back onto side k, with
# E'. If that is undecided, all possibilities are followed.  On a side on which it cannot rest it never stays, and the
# end over which it tips has no top; a neighbour of such a side is left by way of that side's height, which is below
# the top. If it depends on the parameters whether the part can rest on a side, nothing is proved.


# Strikes of one cell, in all its ways, after which it is given up.
MOST_STRIKES = 512


@proof_kernel
def rested(roll: Any, part: FullSideBox, count: int) -> Ways:
    """Follow all that waits until it rests; without the effect it does so where it came down."""
    ways = no_way(0)
    if (count <= 0) | (count > ROOM):
        return no_way(NOTHING)
    if roll is None:
        for number in range(count):
            row = part.waiting[number]
            ways = put(ways, int(row[0]) - part.own.side, False, Interval(row[5], row[6]))
        return ways
    # a part that is said to turn on whichever way it rotates has no energy to follow
    strikes = 0 if (part.own.flip.sign > 0.0) & _known(part) else MOST_STRIKES
    while (count > 0) & (count <= ROOM) & (strikes < MOST_STRIKES) & (ways.number >= 0):
        count -= 1
        ways, count = _strike(part, ways, count)
        strikes += 1
    return ways if count == 0 else no_way(NOTHING)


@proof_kernel
def rested_one_way(roll: Any, part: FullSideBox, count: int) -> Ways:
    """As `rested`, if one side came down and it is decided at every strike what comes next; no way otherwise."""
    ways = no_way(0)
    if count != 1:
        return no_way(NOTHING)
    if roll is None:
        row = part.waiting[0]
        return put(ways, int(row[0]) - part.own.side, False, Interval(row[5], row[6]))
    strikes = 0 if (part.own.flip.sign > 0.0) & _known(part) else MOST_STRIKES
    while (count == 1) & (ways.number == 0) & (strikes < MOST_STRIKES):
        ways, count = _strike(part, ways, 0)
        strikes += 1
    return ways if count == 0 else no_way(NOTHING)


@proof_kernel
def _known(part: FullSideBox) -> bool:
    """Whether it is proved of every side that the part rests there or tips, and of this one that it rests."""
    known = tips_box(part, part.own.side) == 0
    for k in range(part.lo.a.size):
        known = known & (tips_box(part, k) != 2)
    return known


@proof_kernel
def _strike(part: FullSideBox, ways: Ways, count: int) -> tuple[Ways, int]:
    """Let the last side that waits come down: it rests there, or another one waits."""
    row = part.waiting[count]
    k, left, rolled = int(row[0]), row[1] > 0.0, row[2] > 0.0
    energy, x = Interval(row[3], row[4]), Interval(row[5], row[6])
    b, before, after = box_of(part, k), box_of(part, k - 1), box_of(part, k + 1)
    right = before.shift - before.a  # L - a, of this side
    flat = b.rho2 + b.d**2
    reach2 = right**2
    keeps = flat - b.a * right
    share = keeps**2 / (b.inertia * (flat + reach2))
    kinetic = energy * share
    at_left = b.kappa * (b.a**2 / (b.ell + b.d))
    at_right = b.kappa * (reach2 / (square_root(reach2 + b.d**2) + b.d))
    tipping = tips_box(part, k)
    rests = tipping == 0
    at_left = _top(tipping == 1, tips_box(part, k + 1) == -1, at_left, b.kappa * (after.d - b.d))
    at_right = _top(tipping == -1, tips_box(part, k - 1) == 1, at_right, b.kappa * (before.d - b.d))
    lift, top = smaller(at_left, at_right), at_right if left else at_left
    stops = rests & ((keeps.hi <= 0.0) | (kinetic.hi <= lift.lo))
    moves = (not rests) | ((keeps.lo > 0.0) & (kinetic.lo > lift.hi))
    if not moves:
        ways = put(ways, k - part.own.side, rolled, x)
    if stops:
        return ways, count
    if not kinetic.lo > top.hi:
        count = wait(part, count, k, not left, rolled, kinetic, x)
    if not kinetic.hi < top.lo:
        to, there = (k - 1, before.d) if left else (k + 1, after.d)
        place = (x + before.shift) if left else (x - b.shift)
        higher = kinetic + b.kappa * (b.d - there)
        count = wait(part, count, to, left, True, higher, place)
    return ways, count


@proof_kernel
def _top(tips: bool, beside: bool, top: Interval, side: Interval) -> Interval:
    """Energy to get over an end: none where the part tips over it, and to the next side where that is no rest."""
    lo = -1.0 if tips else (side.lo if beside else top.lo)
    hi = -1.0 if tips else (side.hi if beside else top.hi)
    return Interval(lo, hi)


# ----------------------------------------------------------------


# Not inlined: images, replays and the argument near the joint would each compile it anew.
@generic(proof=True, inlined=False)
def full_ways(part: FullSideBox, x: Interval, state: int, phi: Interval, jog: Interval) -> Ways:
    """Places of rest of every start in x, from what the minimal model proves of their landings."""


@proof_kernel
def _full_ways(part: FullSideBox, x: Interval, state: int, phi: Interval, jog: Interval) -> Ways:
    if (state == NOTHING) | (not all_enclosed(part.effects)):
        return no_way(NOTHING)
    count = landed(entry_of(part.effects, Landing), part, x, phi, jog)
    return rested(entry_of(part.effects, Roll), part, count)


full_ways.on(FullSideBox, _full_ways)


@proof_kernel
def _slots(part: FullSideBox, ways: Ways, phi: Interval) -> Any:
    """Count, images per branch, witness."""
    n = part.lo.a.size
    one, two = ways.first, ways.second
    first = moved_box(part.effects, Interval(one.lo, one.hi))
    second = moved_box(part.effects, Interval(two.lo, two.hi))
    return (
        ways.number if ways.number > 0 else NOTHING,
        (first.lo, first.hi, (part.own.side + one.turned) % n, one.branch),
        (second.lo, second.hi, (part.own.side + two.turned) % n, two.branch),
        (phi.lo, phi.hi),
    )


@proof_kernel
def side_full_image_box(part: FullSideBox, same: FullSideBox, lo: float, hi: float, side: int) -> Any:
    """`image_box` on one side; the witness is the bracket of the left vertex's own landing."""
    x = Interval(lo, hi)
    state, jog, phi, _, _ = throw_box(part.own, x)
    return _slots(part, full_ways(part, x, state, phi, jog), phi)


@proof_kernel
def side_full_fallback_box(part: FullSideBox, same: FullSideBox, lo: float, hi: float, side: int) -> Any:
    """`fallback_box` on one side."""
    x = Interval(lo, hi)
    state, jog, phi, _, _ = sure_throw_box(part.own, x)
    return _slots(part, full_ways(part, x, state, phi, jog), phi)


@proof_kernel
def gather_full_pair(lo: FullThrow, hi: FullThrow, side: int) -> tuple[FullSideBox, FullSideBox]:
    """`on_side_box`: the same intervals stand for both corners."""
    part = gather_full_box(lo, hi, side, Interval(lo.bare.kappa, hi.bare.kappa))
    return part, part


@proof_kernel
def full_image_box(lo_params: FullThrow, hi_params: FullThrow, lo: float, hi: float, side: int) -> Any:
    """`image_box` of the throw with effects."""
    part, same = gather_full_pair(lo_params, hi_params, side)
    return side_full_image_box(part, same, lo, hi, side)


@proof_kernel
def full_fallback_box(lo_params: FullThrow, hi_params: FullThrow, lo: float, hi: float, side: int) -> Any:
    """`fallback_box` of the throw with effects."""
    part, same = gather_full_pair(lo_params, hi_params, side)
    return side_full_fallback_box(part, same, lo, hi, side)


image_box.on(FullSideBox, side_full_image_box)
fallback_box.on(FullSideBox, side_full_fallback_box)
