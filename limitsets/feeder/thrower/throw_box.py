"""The box twin of the throw: enclosures of the image of a cell of starts, over a box of parameters.

Proof kernels on intervals, in the same steps as `throw.py`.  Where the displacement is proved to be monotone on the
cell its image is spanned by its ends; where the decision between jog and flip is not proved the cell has both images.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.feeder.thrower.flight_box import angle_slope, bracket, sure_bracket, turn_box, turn_point
from limitsets.feeder.thrower.impact import jog_displacement, margin, strike
from limitsets.feeder.thrower.params import SideBox, Throw, gather_box
from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.rounding import down, up
from limitsets.numbers.jit import proof_kernel
from limitsets.systems.maps import codes

NOTHING, DECIDED, BOTH = -1, 1, 2


@proof_kernel
def throw_box(b: SideBox, x: Interval) -> tuple[int, Interval, Interval, Interval, Interval]:
    """Enclose one throw of every start in x.

    Returns
    -------
    (state, image, phi, slope, margin)
        `state`: -1 nothing is proved; 0 jog, 1 flip; 2 either.  `image`: of a jog (a flip moves by `shift` less).
        `phi`: impact angles.  `slope`: of x' against x.  `margin`: of the decision.
    """
    first, good = bracket(b.flight, b, x.lo)
    last, fine = bracket(b.flight, b, x.hi)
    return _between(b, x, first, last, good & fine)


@proof_kernel
def sure_throw_box(b: SideBox, x: Interval) -> tuple[int, Interval, Interval, Interval, Interval]:
    """As `throw_box`, with the smallest root found by a march where there may be several."""
    first, good = sure_bracket(b.flight, b, x.lo)
    last, fine = sure_bracket(b.flight, b, x.hi)
    return _between(b, x, first, last, good & fine)


@proof_kernel
def sure_slope_box(b: SideBox, x: Interval) -> tuple[Interval, bool]:
    """As `slope_between`, with the smallest root found by a march where there may be several."""
    first, good = sure_bracket(b.flight, b, x.lo)
    last, fine = sure_bracket(b.flight, b, x.hi)
    return slope_between(b, x, first, last, good & fine)


@proof_kernel
def slope_between(
    b: SideBox, x: Interval, first: Interval, last: Interval, proved: bool
) -> tuple[Interval, bool]:
    """Enclose the slope of x' against x from the brackets at the ends of x, and say whether it is proved."""
    at = turn_box(Interval(first.lo, last.hi))
    _, shift_slope = jog_displacement(b.flight, b, at)
    slope = 1.0 + shift_slope * angle_slope(b.flight, b, x, at)
    return slope, proved & (slope.hi - slope.lo < math.inf)


@proof_kernel
def _between(
    b: SideBox, x: Interval, first: Interval, last: Interval, proved: bool
) -> tuple[int, Interval, Interval, Interval, Interval]:
    """Enclose the throws of a cell from the brackets at its ends: the angle grows with x, if need be by jumps."""
    phi = Interval(first.lo, last.hi)
    at = turn_box(phi)
    shift, shift_slope = jog_displacement(b.flight, b, at)
    slope = 1.0 + shift_slope * angle_slope(b.flight, b, x, at)
    # With the parameters known within wide bounds the brackets are wide: where the displacement is proved to grow
    # with phi only the outer ends of them matter.
    grows = shift_slope.lo > 0.0
    least, _ = jog_displacement(b.flight, b, turn_point(first.lo))
    most, _ = jog_displacement(b.flight, b, turn_point(last.hi))
    any_first, _ = jog_displacement(b.flight, b, turn_box(first))
    any_last, _ = jog_displacement(b.flight, b, turn_box(last))
    # Both are found and one is chosen: the turns at the ends of the brackets are known, at a chosen angle they are not.
    at_lo = least.lo if grows else any_first.lo
    at_hi = most.hi if grows else any_last.hi
    ends = Interval(down(x.lo + at_lo), up(x.hi + at_hi))
    whole = x + shift
    rising = slope.lo > 0.0
    image = Interval(ends.lo if rising else whole.lo, ends.hi if rising else whole.hi)
    omega, barrier = strike(b.flight, b, x, at)
    flips = margin(b.flip, b.inertia, omega, barrier)
    state = codes.FLIP if flips.lo > 0.0 else (codes.JOG if flips.hi <= 0.0 else BOTH)
    finite = (image.hi - image.lo < math.inf) & (flips.hi - flips.lo < math.inf)
    return state if proved & finite else NOTHING, image, phi, slope, flips


# ---------------------------------------------------------------- the map contract


@proof_kernel
def gather_pair(lo: Throw, hi: Throw, side: int) -> tuple[SideBox, SideBox]:
    """`on_side_box` of the throw: the same intervals stand for both corners."""
    b = gather_box(lo, hi, side)
    return b, b


@proof_kernel
def side_image_box(b: SideBox, same: SideBox, lo: float, hi: float, side: int) -> Any:
    """`image_box` of the throw on one side; the witness is the bracket of the impact angle."""
    state, jog, phi, _, _ = throw_box(b, Interval(lo, hi))
    return _slots(b, state, jog, phi)


@proof_kernel
def side_fallback_box(b: SideBox, same: SideBox, lo: float, hi: float, side: int) -> Any:
    """`fallback_box` of the throw on one side."""
    state, jog, phi, _, _ = sure_throw_box(b, Interval(lo, hi))
    return _slots(b, state, jog, phi)


@proof_kernel
def _slots(b: SideBox, state: int, jog: Interval, phi: Interval) -> Any:
    """Count, images per branch, witness."""
    flip = jog - b.shift
    flips = state == codes.FLIP
    first = (
        flip.lo if flips else jog.lo,
        flip.hi if flips else jog.hi,
        b.next if flips else b.side,
        1 if flips else 0,
    )
    count = state if (state == NOTHING) | (state == BOTH) else DECIDED
    return count, first, (flip.lo, flip.hi, b.next, 1), (phi.lo, phi.hi)


@proof_kernel
def throw_fallback_box(lo_params: Throw, hi_params: Throw, lo: float, hi: float, side: int) -> Any:
    """`fallback_box` of the throw."""
    b = gather_box(lo_params, hi_params, side)
    return side_fallback_box(b, b, lo, hi, side)


@proof_kernel
def throw_image_box(lo_params: Throw, hi_params: Throw, lo: float, hi: float, side: int) -> Any:
    """`image_box` of the throw."""
    b = gather_box(lo_params, hi_params, side)
    return side_image_box(b, b, lo, hi, side)
