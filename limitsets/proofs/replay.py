"""Orbits replayed in interval arithmetic: every decision proved, every state enclosed.

Every start of an interval, and every kappa, has the same itinerary: where the impact is the one root of a concave
function, kappa > sqrt(a^2 + d^2), the last state is a continuous function of both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.interval import Interval
from limitsets.jit import entry_of, proof_kernel
from limitsets.maps import codes
from limitsets.proofs.parameters import ParameterBox
from limitsets.thrower.arrival_box import landed
from limitsets.thrower.effects.landing import Landing
from limitsets.thrower.effects.roll import Roll
from limitsets.thrower.motion_box import all_enclosed, gather_full_box
from limitsets.thrower.roll_box import rested_one_way
from limitsets.thrower.side_box import gather_box, with_kappa
from limitsets.thrower.throw_box import NOTHING, sure_throw_box, throw_box


@proof_kernel(entry=True)
def _replay(lo_map: Any, hi_map: Any, kappa: Any, landing: Any, lo: Any, hi: Any, side: Any) -> int:
    """Fill the enclosures after the first; the number of throws whose decision is proved."""
    for k in range(lo.size - 1):
        b = with_kappa(gather_box(lo_map, hi_map, side[k]), kappa[0, k], kappa[1, k])
        state, jog, _, _, _ = throw_box(b, Interval(lo[k], hi[k]))
        if state == codes.JOG:
            after, side[k + 1] = jog, b.side
        elif state == codes.FLIP:
            after, side[k + 1] = jog - b.shift, b.next
        else:
            return k
        after = after + landing[k]
        lo[k + 1], hi[k + 1] = after.lo, after.hi
    return int(lo.size - 1)


@proof_kernel(entry=True)
def _replay_full(lo_map: Any, hi_map: Any, kappa: Any, landing: Any, lo: Any, hi: Any, side: Any) -> int:
    """As `_replay`, with effects."""
    for k in range(lo.size - 1):
        part = gather_full_box(lo_map, hi_map, side[k], Interval(kappa[0, k], kappa[1, k]))
        x = Interval(lo[k], hi[k])
        state, jog, phi, _, _ = sure_throw_box(part.own, x)
        if (state == NOTHING) | (not all_enclosed(part.effects)):
            return k
        count = landed(entry_of(part.effects, Landing), part, x, phi, jog)
        ways = rested_one_way(entry_of(part.effects, Roll), part, count)
        if ways.number != 1:
            return k
        after = Interval(ways.first.lo, ways.first.hi) + landing[k]
        lo[k + 1], hi[k + 1] = after.lo, after.hi
        side[k + 1] = (side[k] + ways.first.turned) % lo_map.bare.a.size
    return int(lo.size - 1)


def replay(
    box: ParameterBox,
    start: tuple[float, float],
    side: int,
    kappa: NDArray[np.float64],
    landing: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]:
    """Enclose an orbit.

    Parameters
    ----------
    box : ParameterBox
        The scene's parameters.
    start : (float, float)
        Least and largest start.
    side : int
        Its side.
    kappa : ndarray, shape (2, throws)
        Bounds of kappa at each throw; fewer throws are returned where a decision cannot be proved.
    landing : ndarray, shape (throws,)
        How far beyond the model's place each throw lands.

    Returns
    -------
    lo, hi : ndarray, shape (m + 1,)
        Enclosures of the states, the start first.
    side : ndarray of int, shape (m + 1,)
        Their sides.
    """
    throws = kappa.shape[1]
    lo, hi, sides = np.empty(throws + 1), np.empty(throws + 1), np.empty(throws + 1, np.int64)
    lo[0], hi[0], sides[0] = *start, side
    follow = _replay_full if box.effects else _replay
    made = follow(box.lo, box.hi, np.ascontiguousarray(kappa), landing, lo, hi, sides)
    return lo[: made + 1], hi[: made + 1], sides[: made + 1]
