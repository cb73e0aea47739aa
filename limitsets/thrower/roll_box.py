"""The box twin of `effects/roll.py`: whether the part rests on a side that came down, or goes on over one of its ends.

Only energies matter.  Coming down on side k about one end with kinetic energy E, of which the strike of the other end
leaves E' = E [rho^2 + d^2 - a (L - a)]^2 / (M M') or nothing, the part rests where E' lifts it over neither end; over
the other end it comes down on the next side, with E' and the height lost; otherwise it rocks back onto side k, with E'.
If that is undecided, all possibilities are followed.  On a side on which it cannot rest it never stays, and the end
over which it tips has no top; a neighbour of such a side is left by way of that side's height, which is below the top.
If it depends on the parameters whether the part can rest on a side, nothing is proved.
"""

from __future__ import annotations

from typing import Any

from limitsets.interval import Interval
from limitsets.interval.number import smaller, square_root
from limitsets.jit import proof_kernel
from limitsets.thrower.motion_box import (
    NOTHING,
    ROOM,
    FullSideBox,
    Ways,
    box_of,
    no_way,
    put,
    tips_box,
    wait,
)

# Strikes of one cell, in all its ways, after which it is given up.
MOST_STRIKES = 512


@proof_kernel
def rested(roll: Any, part: FullSideBox, count: int) -> Ways:
    """Follow all that waits until it rests; without the effect it does so where it came down."""
    ways = no_way()
    if (count <= 0) | (count > ROOM):
        return Ways(NOTHING, ways.first, ways.second)
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
    return ways if count == 0 else Ways(NOTHING, ways.first, ways.second)


@proof_kernel
def rested_one_way(roll: Any, part: FullSideBox, count: int) -> Ways:
    """As `rested`, if one side came down and it is decided at every strike what comes next; no way otherwise."""
    ways = no_way()
    none = Ways(NOTHING, ways.first, ways.second)
    if count != 1:
        return none
    if roll is None:
        row = part.waiting[0]
        return put(ways, int(row[0]) - part.own.side, False, Interval(row[5], row[6]))
    strikes = 0 if (part.own.flip.sign > 0.0) & _known(part) else MOST_STRIKES
    while (count == 1) & (ways.number == 0) & (strikes < MOST_STRIKES):
        ways, count = _strike(part, ways, 0)
        strikes += 1
    return ways if count == 0 else none


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
