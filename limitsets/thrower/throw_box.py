"""The box twin of the throw: enclosures of where a whole cell of starts goes, for a whole box of parameters.

Proof kernels on intervals, in the same steps as `throw.py`.  Where the displacement is proved to be monotone on the
cell its image is spanned by its ends; where the decision between jog and flip is not proved the cell has both images.
"""

from __future__ import annotations

import math
from typing import Any

import limitsets.interval as iv
from limitsets.interval.arithmetic import Interval
from limitsets.interval.rounding import down, up
from limitsets.jit import proof_kernel
from limitsets.maps import codes
from limitsets.thrower.flight_box import angle_slope, bracket, sure_bracket
from limitsets.thrower.impact_box import decide_box, displacement_box, strike_box
from limitsets.thrower.params import Throw
from limitsets.thrower.side_box import SideBox, gather_box

__all__ = ["gather_pair", "side_image_box", "throw_box", "throw_image_box"]

NOTHING, DECIDED, BOTH = -1, 1, 2


@proof_kernel
def throw_box(b: SideBox, lo: float, hi: float) -> tuple[int, Interval, Interval, Interval, Interval]:
    """Enclose one throw of every start in [lo, hi].

    Returns
    -------
    (state, image, phi, slope, margin)
        `state`: -1 nothing is proved; 0 jog, 1 flip; 2 either.  `image`: of a jog (a flip moves by `shift` less).
        `phi`: impact angles.  `slope`: of x' against x.  `margin`: of the decision.
    """
    first, good = bracket(b.flight, b, lo)
    last, fine = bracket(b.flight, b, hi)
    return _between(b, lo, hi, first, last, good & fine)


@proof_kernel
def sure_throw_box(b: SideBox, lo: float, hi: float) -> tuple[int, Interval, Interval, Interval, Interval]:
    """As `throw_box`, with the smallest root found by a march where there may be several."""
    first, good = sure_bracket(b.flight, b, lo)
    last, fine = sure_bracket(b.flight, b, hi)
    return _between(b, lo, hi, first, last, good & fine)


@proof_kernel
def _between(
    b: SideBox, lo: float, hi: float, first: Interval, last: Interval, proved: bool
) -> tuple[int, Interval, Interval, Interval, Interval]:
    """Enclose the throws of a cell from the brackets at its ends: the angle grows with x, if need be by jumps."""
    phi, x = (first[0], last[1]), (lo, hi)
    shift, shift_slope = displacement_box(b.flight, b, phi)
    slope = iv.add((1.0, 1.0), iv.mul(shift_slope, angle_slope(b.flight, b, x, phi)))
    # With the parameters known within wide bounds the brackets are wide: where the displacement is proved to grow
    # with phi only the outer ends of them matter.
    grows = shift_slope[0] > 0.0
    outer_lo, outer_hi = (first[0], first[0]), (last[1], last[1])
    least = displacement_box(b.flight, b, outer_lo)[0][0], displacement_box(b.flight, b, first)[0][0]
    most = displacement_box(b.flight, b, outer_hi)[0][1], displacement_box(b.flight, b, last)[0][1]
    # Both are found and one is chosen: the turns at the ends of the brackets are known, at a chosen angle they are not.
    at_lo, at_hi = least[0] if grows else least[1], most[0] if grows else most[1]
    ends = down(lo + at_lo), up(hi + at_hi)
    whole = iv.add(x, shift)
    rising = slope[0] > 0.0
    image = (ends[0] if rising else whole[0], ends[1] if rising else whole[1])
    omega, barrier = strike_box(b.flight, b, x, phi)
    margin = decide_box(b.flip, b, omega, barrier)
    state = codes.FLIP if margin[0] > 0.0 else (codes.JOG if margin[1] <= 0.0 else BOTH)
    finite = (image[1] - image[0] < math.inf) & (margin[1] - margin[0] < math.inf)
    return state if proved & finite else NOTHING, image, phi, slope, margin


# ---------------------------------------------------------------- the map contract


@proof_kernel
def gather_pair(lo: Throw, hi: Throw, side: int) -> tuple[SideBox, SideBox]:
    """`on_side_box` of the throw: the same intervals stand for both corners."""
    b = gather_box(lo, hi, side)
    return b, b


@proof_kernel
def side_image_box(b: SideBox, same: SideBox, lo: float, hi: float, side: int) -> Any:
    """`image_box` of the throw on one side; the witness is the bracket of the impact angle."""
    state, jog, phi, _, _ = throw_box(b, lo, hi)
    return _slots(b, state, jog, phi)


@proof_kernel
def side_fallback_box(b: SideBox, same: SideBox, lo: float, hi: float, side: int) -> Any:
    """`fallback_box` of the throw on one side."""
    state, jog, phi, _, _ = sure_throw_box(b, lo, hi)
    return _slots(b, state, jog, phi)


@proof_kernel
def _slots(b: SideBox, state: int, jog: Interval, phi: Interval) -> Any:
    """Count, images per branch, witness."""
    flip = iv.sub(jog, b.shift)
    flips = state == codes.FLIP
    first = (
        flip[0] if flips else jog[0],
        flip[1] if flips else jog[1],
        b.next if flips else b.side,
        1 if flips else 0,
    )
    count = state if (state == NOTHING) | (state == BOTH) else DECIDED
    return count, first, (flip[0], flip[1], b.next, 1), phi


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
