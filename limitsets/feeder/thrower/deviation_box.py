"""How far effects move a landing from where the minimal model has it: enclosed for cells of starts.

Proof kernels.  `landing` and `roll` are followed by `full_box.py`: where the left vertex lands and the part then lies
still, a throw is that of the minimal model.  `slip` is followed where the landing sticks: then the hinge is that of the
minimal model, and only the side that comes down may slide on.  With the vertex that the part turned about at the
distance `near` from the foot of the centre of mass, and the rate omega at which the side comes down,

    the side slides where mu near < d, and then by  (d - mu near)^2 omega^2 / (2 mu kappa).

The other end, at the distance `far`, sticks where far d <= mu (rho^2 + d^2), and leaves the rate
omega (rho^2 + d^2 - a (L - a)) / (rho^2 + d^2 + far^2); where friction cannot hold that end, this rate is
omega (rho^2 + mu d near - a (L - a)) / (rho^2 + far^2 - mu d far), and the end slides at
|omega| L (far d - mu (rho^2 + d^2)) / (rho^2 + far^2 - mu d far).
Source: docs/model.md, effects; the steps are those of `effects/slip.py`, whose results are the test.
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.feeder.thrower.effects.landing import Landing
from limitsets.feeder.thrower.effects.roll import Roll
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.feeder.thrower.flight_box import turn_box
from limitsets.feeder.thrower.full_box import absent, full_ways
from limitsets.feeder.thrower.impact import margin, pose, swing
from limitsets.feeder.thrower.motion import (
    NOTHING,
    ROLLED,
    FullSideBox,
    FullThrow,
    box_of,
    corner_box,
    gather_full_box,
    tips_box,
)
from limitsets.feeder.thrower.params import SideBox
from limitsets.feeder.thrower.throw_box import BOTH, sure_throw_box, throw_box
from limitsets.numbers.interval import Interval, guard
from limitsets.numbers.interval.number import smaller, square_root
from limitsets.numbers.interval.rounding import down, up
from limitsets.numbers.jit import entry_of, proof_kernel
from limitsets.systems.maps import codes


class Compared(IntEnum):
    """What is proved of a cell: nothing, that the part comes to the same side, or that it comes to another one."""

    UNKNOWN = 0
    SAME = 1
    CHANGED = 2


UNKNOWN, SAME, CHANGED = map(int, Compared)


@proof_kernel
def _stays(mu: Interval, part: FullSideBox, k: int, near: Interval, far: Interval, kinetic: Interval) -> bool:
    """Whether the part lies still on side k once its other end has struck, friction being mu."""
    b, before = box_of(part, k), box_of(part, k - 1)
    flat, product = b.rho2 + b.d**2, near * far
    rate2 = 2.0 * kinetic / (flat + near**2)
    hold = mu * flat - far * b.d  # positive where the end sticks
    sticks = Interval(0.5, 0.5) * (flat + far**2) * ((flat - product) / (flat + far**2)) ** 2
    lower = b.rho2 + far**2 - mu * (b.d * far)
    turns = (b.rho2 + mu * (b.d * near) - product) / lower
    slides = (near + far) * Interval(max((-hold).lo, 0.0), max((-hold).hi, 0.0)) / lower
    moving = (b.rho2 + far**2) * turns**2 + (slides + abs(turns) * b.d) ** 2
    left = rate2.hi * max(
        sticks.hi if hold.hi >= 0.0 else 0.0, (0.5 * moving).hi if not hold.lo >= 0.0 else 0.0
    )
    halts = ((flat - product).hi <= 0.0) & ((hold.lo >= 0.0) | (turns.hi <= 0.0))
    right = before.shift - before.a
    at_left = b.kappa * (b.a**2 / (b.ell + b.d))
    at_right = b.kappa * (right**2 / (square_root(right**2 + b.d**2) + b.d))
    plain = (tips_box(part, k) == 0) & (tips_box(part, k + 1) != -1) & (tips_box(part, k - 1) != 1)
    known = (lower.lo > 0.0) | (hold.lo >= 0.0)
    return plain & known & (halts | (up(left) <= smaller(at_left, at_right).lo))


@proof_kernel
def _slid_on(mu: Interval, part: FullSideBox, k: int, left: bool, kinetic: Interval) -> tuple[int, Interval]:
    """By how much a part slides on that comes down on side k about one end; UNKNOWN where it may not stay there."""
    b, before = box_of(part, k), box_of(part, k - 1)
    right = before.shift - before.a
    near, far = Interval(b.a.lo, b.a.hi), Interval(right.lo, right.hi)
    if not left:
        near, far = far, near
    if not (absent(entry_of(part.effects, Roll)) or _stays(mu, part, k, near, far, kinetic)):
        return UNKNOWN, Interval(0.0, 0.0)
    excess = b.d - mu * near
    if excess.hi <= 0.0:
        return SAME, Interval(0.0, 0.0)
    if (mu * b.d).hi > far.lo:  # it tips over its leading end, outside the model
        return UNKNOWN, Interval(0.0, 0.0)
    excess = Interval(max(excess.lo, 0.0), excess.hi)
    slide = excess**2 * kinetic / ((b.rho2 + b.d**2 + near**2) * (mu * b.kappa))
    return SAME, Interval(slide.lo, slide.hi) if left else Interval(-slide.hi, -slide.lo)


@proof_kernel
def _sticks(
    mu: Interval, b: SideBox, right: Interval, above: Interval, omega: Interval, falling: Interval
) -> bool:
    """Whether friction holds the vertex that lands."""
    press = omega * right - falling
    along = abs(b.h + b.d - omega * above)
    held = mu * (b.rho2 + above**2) - abs(right * above)
    return ((mu * press - along).lo >= 0.0) & (
        held.lo >= 0.0
    )  # the first holds of an impulse that presses only


@proof_kernel
def _by_slip(slip: Any, part: FullSideBox, x: Interval, phi: Interval) -> tuple[int, Interval]:
    """Deviation of throws whose left vertex lands."""
    b, after = part.own, box_of(part, part.own.side + 1)
    mu = Interval(down(slip.friction), up(slip.friction))
    right, above = pose(b, turn_box(phi))
    falling = x - b.kappa * phi
    omega, barrier = swing(b, right, above, falling, b.h + b.d)
    if not ((mu.lo > 0.0) & _sticks(mu, b, right, above, omega, falling)):
        return UNKNOWN, Interval(0.0, 0.0)
    flips = margin(b.flip, b.inertia, omega, barrier)
    kinetic = 0.5 * b.inertia * omega**2
    state, lo, hi = SAME, math.inf, -math.inf
    if not flips.lo > 0.0:
        energy = kinetic + b.kappa * (above - b.d)
        state, slide = _slid_on(mu, part, b.side, True, Interval(max(energy.lo, 0.0), max(energy.hi, 0.0)))
        lo, hi = min(lo, slide.lo), max(hi, slide.hi)
    if (state == SAME) & (not flips.hi <= 0.0):
        energy = kinetic + b.kappa * (above - after.d)
        state, slide = _slid_on(
            mu, part, b.side + 1, False, Interval(max(energy.lo, 0.0), max(energy.hi, 0.0))
        )
        lo, hi = min(lo, slide.lo), max(hi, slide.hi)
    return state, Interval(lo, hi)


@proof_kernel
def _compared(slip: Any, part: FullSideBox, x: Interval) -> tuple[int, Interval]:
    """Return what is proved of one cell, and how far its landings are moved."""
    b, none = part.own, Interval(0.0, 0.0)
    state, jog, phi, _, _ = throw_box(b, x)
    if state == NOTHING:
        state, jog, phi, _, _ = sure_throw_box(b, x)
    if state == NOTHING:
        return UNKNOWN, none
    left = absent(entry_of(part.effects, Landing)) or phi.hi <= corner_box(part, b.side).lo
    if slip is not None:
        return _by_slip(slip, part, x, phi) if left else (UNKNOWN, none)
    ways = full_ways(part, x, state, phi, jog)
    if ways.number <= 0:
        return UNKNOWN, none
    rolled = (ways.first.branch == ROLLED) | ((ways.number == 2) & (ways.second.branch == ROLLED))
    if left and not rolled:
        return SAME, none
    if (state == BOTH) | (ways.number != 1):
        return UNKNOWN, none
    flips = state == codes.FLIP
    if ways.first.turned != (1 if flips else 0):
        return CHANGED, none
    flip = jog - b.shift
    place = Interval(flip.lo if flips else jog.lo, flip.hi if flips else jog.hi)
    return SAME, Interval(ways.first.lo, ways.first.hi) - place


@proof_kernel(entry=True)
def _cells(slip: Any, lo: FullThrow, hi: FullThrow, side: int, x_lo: Any, x_hi: Any, out: Any) -> None:
    part = gather_full_box(lo, hi, side, Interval(lo.bare.kappa, hi.bare.kappa))
    for k in range(x_lo.size):
        state, moved = _compared(slip, part, Interval(x_lo[k], x_hi[k]))
        out[k, 0], out[k, 1], out[k, 2] = state, moved.lo, moved.hi


def deviations(
    lo: FullThrow, hi: FullThrow, slip: Slip | None, side: int, x_lo: ArrayLike, x_hi: ArrayLike
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Enclose how far effects move the landings of cells, and whether the part then lies on another side.

    Parameters
    ----------
    lo, hi : FullThrow
        Corners of a box of parameters, with `landing` and `roll`, either, or neither as effects.
    slip : Slip or None
        The friction of landings, if it is to be followed.
    side : int
        The side that the part rests on.
    x_lo, x_hi : array_like, shape (n,)
        Cells of starts [length].

    Returns
    -------
    ndarray of int, shape (n,)
        Per cell a number of `Compared`.
    ndarray, shape (n, 2)
        Bounds of x' with effects less x' without, where that is `Compared.SAME` [length].
    """
    guard()
    first, last = (np.ascontiguousarray(ends, dtype=np.float64) for ends in (x_lo, x_hi))
    out = np.empty((first.size, 3))
    _cells(slip, lo, hi, side, first, last, out)
    return out[:, 0].astype(np.int64), out[:, 1:]
