"""The box twin of the throw with effects; of one whose file has not said that boxes follow it nothing is proved.

The steps are those of `full.py`, each effect's in its own file.  Undecided events are followed in all ways; if a cell
has more than two places of rest, it is undecided, and the caller subdivides it.
"""

from __future__ import annotations

from typing import Any

from limitsets.interval import Interval
from limitsets.jit import entry_of, generic, proof_kernel
from limitsets.maps.kernels import fallback_box, image_box
from limitsets.thrower.arrival_box import landed
from limitsets.thrower.effects.landing import Landing
from limitsets.thrower.effects.roll import Roll
from limitsets.thrower.motion import FullThrow
from limitsets.thrower.motion_box import (
    NOTHING,
    FullSideBox,
    Ways,
    all_enclosed,
    gather_full_box,
    moved_box,
    no_way,
)
from limitsets.thrower.roll_box import rested
from limitsets.thrower.throw_box import sure_throw_box, throw_box


@proof_kernel
def _none() -> Ways:
    ways = no_way()
    return Ways(NOTHING, ways.first, ways.second)


# Not inlined: images, replays and the argument near the joint would each compile it anew.
@generic(proof=True, inlined=False)
def full_ways(part: FullSideBox, x: Interval, state: int, phi: Interval, jog: Interval) -> Ways:
    """Places of rest of every start in x, from what the minimal model proves of their landings."""


@proof_kernel
def _full_ways(part: FullSideBox, x: Interval, state: int, phi: Interval, jog: Interval) -> Ways:
    if (state == NOTHING) | (not all_enclosed(part.effects)):
        return _none()
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
