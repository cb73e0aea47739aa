"""Map of the line with three constant values."""

from __future__ import annotations

import math
from typing import NamedTuple

import limitsets.interval as iv
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.maps.textbook.domains import DOMAINS
from limitsets.maps.textbook.slots import NO_WITNESS, Line

__all__ = ["ThreeState"]


class ThreeState(NamedTuple):
    """x' = -value for x < -edge, 0 for -edge <= x <= edge, value for x > edge.

    Known answer: for value > edge three attractors, whose basins are the three intervals.

    Attributes
    ----------
    value : float
        Where the outer states lie.
    edge : float
        Where the basins end.
    """

    value: float = 2.0
    edge: float = 1.0


def _image(params: ThreeState, x: float, side: int) -> tuple[float, int, int]:
    code = 1 if x >= -params.edge else 0
    code = 2 if x > params.edge else code
    after = params.value * (code - 1.0)
    return after, side, code if abs(x) < math.inf else codes.OUTSIDE


def _image_on(params: ThreeState, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return params.value * (branch - 1.0), side, 0.0


def _image_box(params_lo: ThreeState, params_hi: ThreeState, lo: float, hi: float, side: int) -> Line:
    """Both values at an edge.  A box over both edges has the first slot from low to middle, the second up to high."""
    v, edge = (params_lo.value, params_hi.value), (params_lo.edge, params_hi.edge)
    low, high = lo <= -edge[0], hi >= edge[0]
    middle = (hi >= -edge[1]) & (lo <= edge[1])
    zero = (0.0, 0.0)
    below, above = iv.neg(v), v
    # Slot 0 holds the lowest value that is possible, slot 1 the highest; the middle is with either or alone.
    first = below if low else (zero if middle else above)
    last = above if high else (zero if middle else below)
    first = iv.hull(first, zero) if low & middle & high else first
    code_first = 0 if low else (1 if middle else 2)
    code_last = 2 if high else (1 if middle else 0)
    two = code_first != code_last
    sound = (v[1] - v[0] < math.inf) & (abs(lo) < math.inf) & (abs(hi) < math.inf) & (low | middle | high)
    count = 2 if two else 1
    return (
        count if sound else -1,
        (first[0], first[1], side, code_first),
        (last[0], last[1], side, code_last),
        NO_WITNESS,
    )


register(
    ThreeState, image=_image, image_on=_image_on, image_box=_image_box, branches=("low", "middle", "high")
)
DOMAINS[ThreeState] = ((-3.0, 3.0),)
