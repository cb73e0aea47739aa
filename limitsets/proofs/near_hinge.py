"""Near the hinge: every start on (a_i, a_i + delta_i] is thrown outward, by a proved factor.

For h < 0 and R - a = r small the throw is a decided jog with R' - a = r - h phi + a v - d w, v = 1 - cos phi,
w = phi - sin phi, and

    phi >= 2 r / kappa                      (f(phi) = r phi + a w + d v - (kappa/2) phi^2 is positive before that),
    a v - d w >= phi^2 (a/2 - a phi^2/24 - d phi/6) >= 0      where the bracket is proved positive,

so R' - a >= q r with q = 1 + 2 |h| / kappa > 1: the orbit leaves the interval after ln(delta/r) / ln q throws at most.
With effects the left vertex has to land first, phi at most the exterior angle there, and a part that rolls on has to
come to rest in the cells: every start then either rests as above, or is in the cells at once.
The small-angle flights have phi >= 2 r / kappa and no v and w in the displacement, so the same q serves.
For h > 0 see `fixed_point.py`.
Source: docs/model.md, "Conventions": near a_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.interval import Interval
from limitsets.jit import proof_kernel
from limitsets.proofs.cover import Cover
from limitsets.proofs.fixed_point import leaves
from limitsets.thrower.flight_box import bracket, sure_bracket
from limitsets.thrower.full_box import full_ways
from limitsets.thrower.impact import jog_displacement, margin, strike
from limitsets.thrower.motion_box import gather_full_box
from limitsets.thrower.side_box import gather_box
from limitsets.thrower.turn_box import turn_box

# q - 1 is lowered by this share, so that other arithmetic can confirm it where the parameters are wide.
SLACK_OF_Q = 2.0**-26


@dataclass(frozen=True)
class NearHinge:
    """What is proved of starts between a_i and the first cell of side i.

    Attributes
    ----------
    x : float
        Where the cells begin.
    q : float
        R' - a >= q (R - a) on (a_i, x]; or, if there is a fixed point R*, R' - R* >= q (R - R*) on (R*, x], and starts
        in (a_i, R*) tend to a_i.
    reach : float
        No throw from (a_i, x] lands beyond it.
    rises : bool
        Whether R' is proved to grow with R on (a_i, x] at least as fast: the displacement grows with the angle.
    proved : bool
        Whether q > 1 and all that it rests on is proved.
    reason : str
        What is missing, empty if nothing.
    fixed_point : (float, float) or None
        With the arm's surface above the joint: R* lies between them.
    rolls : bool
        Whether a throw from (a_i, x] may roll on to another side.
    empty : bool
        Whether no throw begins on this side, for the part cannot rest on it; all is proved of no starts.
    """

    x: float
    q: float
    reach: float
    rises: bool
    proved: bool
    reason: str
    fixed_point: tuple[float, float] | None = None
    rolls: bool = False
    empty: bool = False


# Of a side on which the part cannot rest.
NO_STARTS = NearHinge(np.inf, np.inf, -np.inf, True, True, "", empty=True)


@proof_kernel(entry=True)
def _near(lo: Any, hi: Any, side: int, x: float, out: Any) -> None:
    """Root found, jog decided, bracket, -h, room on the arm: positive if proved; q, reach, slope."""
    b = gather_box(lo, hi, side)
    last, good = bracket(b.flight, b, x)
    if not good:  # so near to the joint its starts may lie far apart, where a is known to a tolerance only
        last, good = sure_bracket(b.flight, b, x)
    phi, starts = Interval(0.0, last.hi), Interval(b.a.lo, x)
    at = turn_box(phi)
    omega, barrier = strike(b.flight, b, starts, at)
    flips = margin(b.flip, b.inertia, omega, barrier)
    square = b.a * phi**2
    left = b.a * 0.5 - square / 24.0
    left = left - b.d * phi / 6.0
    shift, rise = jog_displacement(b.flight, b, at)
    reached = (x + shift).hi
    out[0] = 1.0 if good else -1.0
    out[1] = -flips.hi
    out[2] = left.lo
    out[3] = -b.h.hi
    out[4] = (lo.arm_length - Interval(reached, reached)).lo
    gain = 2.0 * -b.h / b.kappa
    out[5] = (1.0 + gain).lo
    out[6] = reached
    out[7] = rise.lo


@proof_kernel(entry=True)
def _near_ways(lo: Any, hi: Any, side: int, x: float, corner: Any, turned: Any, place: Any) -> int:
    """Places of rest with effects, of starts up to x, their sides turned and bounds; how many, -1 if not known.

    `corner`: by how much the exterior angle at the left vertex exceeds the angle of impact.
    """
    part = gather_full_box(lo, hi, side, Interval(lo.bare.kappa, hi.bare.kappa))
    b = part.own
    last, good = bracket(b.flight, b, x)
    phi, starts = Interval(0.0, last.hi), Interval(b.a.lo, x)
    shift, _ = jog_displacement(b.flight, b, turn_box(phi))
    corner[0] = (lo.bare.corner[side] - Interval(last.hi, last.hi)).lo
    ways = full_ways(part, starts, 0 if good else -1, phi, starts + shift)
    turned[0], turned[1] = ways.first.turned, ways.second.turned
    place[0, 0], place[0, 1] = ways.first.lo, ways.first.hi
    place[1, 0], place[1, 1] = ways.second.lo, ways.second.hi
    return ways.number


REASONS = (
    "the impact is not enclosed",
    "the jog is not decided",
    "the displacement is not proved to grow",
    "the arm's surface is not below the joint (h < 0)",
    "the throw may reach beyond the arm",
    "no expansion is proved",
)

SCATTERED = (
    "with noise of landing.x a part that lies nearer to a than that may land at x <= a, and leave inward"
)

SCATTERED_BEYOND = (
    "with noise of landing.x a part may come to either side of the unstable fixed point of the jog"
)


def near_hinge(found: Cover) -> tuple[NearHinge, ...]:
    """Prove the expansion near a_i, or from the fixed point of the jog on, on every side.

    Parameters
    ----------
    found : Cover
        The cells, which say where "near" ends.

    Returns
    -------
    tuple of NearHinge
        One per side.
    """
    answers = []
    for side, (edges,) in enumerate(found.grid.edges):
        if not found.box.rests[side]:
            answers.append(NO_STARTS)
            continue
        if found.points:
            answers.append(_beyond(found, side, float(edges[0])))
            continue
        out = np.full(8, np.nan)
        _near(*found.box.bare, side, float(edges[0]), out)
        q = 1.0 + (float(out[5]) - 1.0) * (1.0 - SLACK_OF_Q)
        good = [*(out[:5] > 0.0), q > 1.0]
        reason = "" if all(good) else REASONS[good.index(False)]
        if found.box.landing > 0.0 and not reason:
            reason = SCATTERED
        rises, x, reach = bool(out[7] > 0.0), float(edges[0]), float(out[6])
        rolls = False
        if found.box.effects and not reason:
            reach, rolls, reason = _rolled(found, side, x, reach)
        answers.append(NearHinge(x, q, reach, rises, not reason, reason, rolls=rolls))
    return tuple(answers)


def _rolled(found: Cover, side: int, x: float, reach: float) -> tuple[float, bool, str]:
    """Prove that what is thrown from (a_i, x] rests as in the minimal model, or rolls into the cells.

    Returns the farthest place of all, whether anything may roll to another side, and what is missing.
    """
    corner, turned, place = np.full(1, np.nan), np.zeros(2, np.int64), np.full((2, 2), np.nan)
    count = _near_ways(found.box.lo, found.box.hi, side, x, corner, turned, place)
    if not corner[0] >= 0.0:
        return reach, True, "another vertex than the left one may land first"
    if count < 1:
        return reach, True, "where the part rolls to is not enclosed"
    sides, end = found.grid.sides, found.box.bare[0].arm_length
    rolls = [k for k in range(count) if turned[k] != 0]
    for k in rolls:
        lo, hi = place[k]
        edges = found.grid.edges[(side + int(turned[k])) % sides][0]
        if not (lo >= edges[0] and hi <= edges[-1] and hi <= end):
            return reach, True, "the part may roll to where it is not on the arm, or near to the joint again"
        reach = max(reach, float(hi))
    return reach, bool(rolls), ""


def _beyond(found: Cover, side: int, x: float) -> NearHinge:
    """Prove it where the arm's surface is above the joint."""
    point = found.points[side]
    if point.reason:
        return NearHinge(x, np.nan, np.inf, False, False, point.reason)
    q, reason = leaves(found.box, side, point, x)
    reason = SCATTERED_BEYOND if found.box.landing > 0.0 else reason
    # R' grows with R there, by a factor of q at least
    return NearHinge(x, q, np.inf, not reason, not reason, reason, (point.lo, point.hi))
