"""Enclosures of the numbers behind the model's assumptions, the hinge's force among them, for cells and boxes.

Proof kernels in the steps of `throw_box.py`.  Where the decision between jog and flip is not proved, the enclosures
hold for both.  Mass and the throw's w are 1; forces are given in weights, impulses in that of the throw itself.
Source: docs/model.md, "What the minimal model assumes".
"""

from __future__ import annotations

import math
from enum import IntEnum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.feeder.thrower.flight import Turned
from limitsets.feeder.thrower.flight_box import turn_box, turn_point
from limitsets.feeder.thrower.impact import pose, strike
from limitsets.feeder.thrower.params import Exact, SideBox, SmallAngle, SmallAngle2, Throw, gather_box
from limitsets.feeder.thrower.throw_box import NOTHING, sure_throw_box, throw_box
from limitsets.numbers.interval import Interval, guard
from limitsets.numbers.interval.number import larger, smaller, square_root
from limitsets.numbers.jit import generic, proof_kernel
from limitsets.systems.maps import codes

# ----------------------------------------------------------------
# The force that holds the struck vertex while the part turns about it, enclosed.
#
# With H the height of the centre of mass over the vertex, X^2 = ell^2 - H^2, M = rho^2 + ell^2 and e = E / kappa, the
# part's energy as a height, the vertex has to be pressed up with n weights and held along the arm with f of them:
#
#     n = (rho^2 + 3 H^2 - 2 e H) / M,        f = X (3 H - 2 e) / M,
#
# so n is least at H = e/3, or at the end of the heights passed that is nearest to it.
# Source: docs/model.md, "What the minimal model assumes".


# Slices of the way on which the friction is enclosed; at their borders it is attained.
SLICES = 48


@proof_kernel
def peak(
    ell: Interval, right: Interval, start: Interval, omega: Interval, energy: Interval, jog: bool
) -> Interval:
    """Enclose the greatest height that the centre of mass passes."""
    climbs = Interval(min(max(energy.lo, start.lo), ell.lo), max(min(energy.hi, ell.hi), start.hi))
    over = Interval(ell.lo, max(ell.hi, start.hi))
    if jog and right.lo > 0.0:
        if omega.lo > 0.0:
            return climbs
        return start if omega.hi < 0.0 else Interval(start.lo, climbs.hi)
    if not jog and right.lo > 0.0:
        return over
    if not jog and right.hi < 0.0 and omega.lo > 0.0:
        return start
    return Interval(start.lo, over.hi)


@proof_kernel
def _press(rho2: Interval, energy: Interval, height: float) -> Interval:
    """M n at a height."""
    h = Interval(height, height)
    return rho2 + h * (3.0 * h - 2.0 * energy)


@proof_kernel
def _least(rho2: Interval, energy: Interval, outer: Interval, inner: Interval) -> Interval:
    """Bounds of the least M n: from below by a tangent of the convex function, from above by a height surely passed."""
    best = (energy.lo + energy.hi) / 6.0
    at = min(max(best, outer.lo), outer.hi)
    slope = Interval(6.0, 6.0) * at - 2.0 * energy
    rest = slope * (outer - at)
    below = (_press(rho2, energy, at) + rest).lo
    sure = inner.lo <= inner.hi
    passed = min(max(best, inner.lo), inner.hi)
    ends = max(_press(rho2, energy, outer.lo).hi, _press(rho2, energy, outer.hi).hi)
    return Interval(below, _press(rho2, energy, passed).hi if sure else ends)


@proof_kernel
def _friction(ell: Interval, rho2: Interval, energy: Interval, height: Interval) -> Interval:
    """Enclose |f| / n for heights between two."""
    square = ell**2 - height**2
    # only rounding and dependency carry it below 0
    across = square_root(Interval(max(square.lo, 0.0), square.hi))
    slope = 3.0 * height - 2.0 * energy
    press = rho2 + height * slope
    ratio = across * abs(slope) / press
    good = (press.lo > 0.0) & (ratio.hi >= 0.0)
    return Interval(ratio.lo if good else 0.0, ratio.hi if good else math.inf)


@proof_kernel
def hinge_force(
    ell: Interval,
    rho2: Interval,
    inertia: Interval,
    start: Interval,
    top: Interval,
    end: Interval,
    energy: Interval,
) -> tuple[Interval, Interval]:
    """Enclose the least n, and the greatest |f| / n (inf where n falls below 0).

    Parameters
    ----------
    ell, rho2, inertia : Interval
        Of the part about its vertex.
    start, top, end : Interval
        Heights at the landing, at the highest, and where a side lies flat [length].
    energy : Interval
        The energy as a height [length].
    """
    outer = Interval(min(start.lo, end.lo), max(max(start.hi, end.hi), top.hi))
    inner = Interval(min(start.hi, end.hi), max(max(start.lo, end.lo), top.lo))
    least = _least(rho2, energy, outer, inner)
    force = least / inertia
    if not force.lo > 0.0:
        surely = math.inf if force.hi < 0.0 else 0.0
        return force, Interval(surely, math.inf)
    most, attained = 0.0, 0.0
    step = (outer.hi - outer.lo) / SLICES
    for k in range(SLICES):
        first = outer.lo + k * step
        last = outer.hi if k == SLICES - 1 else outer.lo + (k + 1) * step
        most = max(most, _friction(ell, rho2, energy, Interval(first, last)).hi)
        for border in (first, last):
            height = min(max(border, inner.lo), inner.hi)
            if inner.lo <= inner.hi:
                attained = max(attained, _friction(ell, rho2, energy, Interval(height, height)).lo)
    return force, Interval(attained, most)


# ----------------------------------------------------------------
# Enclosures of the numbers behind the model's assumptions, for cells of starts and boxes of parameters.


class Assumed(IntEnum):
    """Columns of `assumed`."""

    UNDER = 0  # how far inside the side's ends the throw's impulse acts [length]
    RELEASE_FRICTION = 1  # friction that the throw needs
    ANGLE = 2  # turned in the air [rad]
    PRESS = (
        3  # normal impulse of the landing that sticks, in that of the throw; below 0 it would have to pull
    )
    STICK_FRICTION = 4  # friction that sticking needs; inf where it would have to pull
    FORCE = 5  # least normal force at the vertex until a side lies flat, in weights
    HOLD_FRICTION = 6  # friction needed until then; inf where the force would have to pull
    DROP = 7  # height from which a fall is as fast as the landing of the vertex [length]
    ROLL = 8  # energy left after a side has come down, in that needed to roll on or back
    STROKE = 9  # shift of the landing per sine of the stroke [length]
    SPEED = 10  # shift of the landing per relative change of the speed [length]
    ON_ARM = 11  # how far inside the arm the part comes to rest [length]


COUNT = len(Assumed)
UNDER, RELEASE_FRICTION, ANGLE, PRESS, STICK_FRICTION, FORCE = range(6)
HOLD_FRICTION, DROP, ROLL, STROKE, SPEED, ON_ARM = range(6, COUNT)


class Rest(NamedTuple):
    """What else is known of a side on which the part rests or comes down."""

    a: Interval
    d: Interval
    right: Interval  # from the foot of the centre of mass to the right end


class Pose(NamedTuple):
    """The part at its landing, in the terms in which the model of flight has it."""

    right: Interval  # X: the centre of mass right of the vertex
    above: Interval  # H: above it
    falling: Interval  # the centre's vertical velocity before the landing
    start: Interval  # the height from which the energy counts


@generic(proof=True)
def pose_box(flight: Any, b: SideBox, x: Interval, at: Turned) -> Pose:
    """Return the part at its landing."""


@proof_kernel
def _exact(flight: Any, b: SideBox, x: Interval, at: Turned) -> Pose:
    right, above = pose(b, at)
    return Pose(right, above, x - b.kappa * at.phi, above)


@proof_kernel
def _small(flight: Any, b: SideBox, x: Interval, at: Turned) -> Pose:
    # the paper's impact: the vertex as it was at phi = 0, and the velocity after phi = 2 (R - a) / kappa
    reach = x - b.a
    lost = 2.0 * (b.a * reach) / b.kappa
    return Pose(b.a, b.d, b.a - reach, b.d + lost)


pose_box.on(Exact, _exact)
pose_box.on(SmallAngle, _small)
pose_box.on(SmallAngle2, _small)


@proof_kernel
def rest_box(lo: Throw, hi: Throw, side: int) -> Rest:
    """Intervals of a side on which the part rests."""
    a = Interval(lo.a[side], hi.a[side])
    return Rest(a, Interval(lo.d[side], hi.d[side]), Interval(lo.length[side], hi.length[side]) - a)


@proof_kernel
def _needed(b: SideBox, rest: Rest, foot: Interval) -> Interval:
    """Energy needed to lift the part over an end of the side it lies on."""
    square = foot**2
    rise = square / (square_root(square + rest.d**2) + rest.d)
    return b.kappa * rise


@proof_kernel
def _rolls(b: SideBox, rest: Rest, energy: Interval, jog: bool) -> Interval:
    """Energy left after a side has come down, in that needed (`effects/roll.py`).

    The part strikes with the end it did not turn about, and is lifted over it, or rocks back, strikes with the first
    one again, and is lifted over that; every strike leaves less, so no third one does more.
    """
    struck, other = (rest.right, rest.a) if jog else (rest.a, rest.right)
    left = energy - b.kappa * rest.d
    own = b.rho2 + rest.d**2
    keeps = own - rest.a * rest.right
    keeps = Interval(max(keeps.lo, 0.0), max(keeps.hi, 0.0)) ** 2
    share = keeps / ((own + struck**2) * (own + other**2))
    kinetic = share * left
    rocked = share * kinetic
    return larger(kinetic / _needed(b, rest, struck), rocked / _needed(b, rest, other))


@proof_kernel
def _write(out: Any, column: int, bounds: Interval) -> None:
    out[column, 0], out[column, 1] = bounds.lo, bounds.hi


@proof_kernel
def _throw(b: SideBox, rest: Rest, x: Interval, phi: Interval, slope: Interval, out: Any) -> Any:
    """Write what does not depend on the decision; return what the rest needs."""
    lever = b.h + b.d
    foot = (b.rho2 + b.d * lever) / x
    under = smaller(rest.right - foot, rest.a + foot)
    impact = turn_box(phi)
    at = pose_box(b.flight, b, x, impact)
    omega, _ = strike(b.flight, b, x, impact)
    press = omega * at.right - at.falling
    along = abs(lever - omega * at.above)
    # from the first friction can stop the vertex, from the second the impact does not set it sliding again
    stop = along / (press if press.lo > 0.0 else Interval(press.hi, press.hi))
    turned = abs(at.right * at.above) / (b.rho2 + at.above**2)
    speed = at.falling - at.right
    moved = abs(slope - 1.0) * (phi * b.kappa)
    energy = 0.5 * b.inertia * omega**2 + b.kappa * at.start
    _write(out, UNDER, under)
    _write(out, RELEASE_FRICTION, abs(lever) / x)
    _write(out, ANGLE, phi)
    _write(out, PRESS, press / x)
    sticks = Interval(
        max(stop.lo, turned.lo) if press.hi > 0.0 else math.inf,
        max(stop.hi, turned.hi) if press.lo > 0.0 else math.inf,
    )
    _write(out, STICK_FRICTION, sticks)
    _write(out, DROP, speed**2 / (2.0 * b.kappa))
    _write(out, STROKE, 0.5 * b.kappa * phi**2)
    _write(out, SPEED, moved)
    return at, omega, energy


@proof_kernel
def _wider(out: Any, column: int, bounds: Interval) -> None:
    out[column, 0], out[column, 1] = min(out[column, 0], bounds.lo), max(out[column, 1], bounds.hi)


@proof_kernel
def _branch(b: SideBox, rest: Rest, thrown: Any, jog: bool, image: Interval, arm: Interval, out: Any) -> None:
    """Widen by what one branch needs after the landing."""
    at, omega, energy = thrown
    per_weight = energy / b.kappa
    rests = (rest.a.lo > 0.0) & (rest.right.lo > 0.0)
    top = peak(b.ell, at.right, at.start, omega, per_weight, jog)
    # about the end over which the part tips back no top is passed: it is highest when the side is down
    before_top = rest.right.hi <= 0.0
    top = Interval(rest.d.lo if before_top else top.lo, rest.d.hi if before_top else top.hi)
    force, friction = hinge_force(b.ell, b.rho2, b.inertia, at.start, top, rest.d, per_weight)
    _wider(out, FORCE, force)
    _wider(out, HOLD_FRICTION, friction)
    rolls, room = _rolls(b, rest, energy, jog), smaller(arm - image, image - rest.a)
    # where it cannot rest it surely goes on, and nothing is known of the place to which it does
    _wider(out, ROLL, Interval(rolls.lo if rests else math.inf, rolls.hi if rests else math.inf))
    _wider(out, ON_ARM, Interval(room.lo if rests else -math.inf, room.hi if rests else math.inf))


@proof_kernel
def _cell(lo: Throw, hi: Throw, b: SideBox, x: Interval, out: Any) -> None:
    state, image, phi, slope, _ = throw_box(b, x)
    if state == NOTHING:
        state, image, phi, slope, _ = sure_throw_box(b, x)
    for column in range(COUNT):
        out[column, 0], out[column, 1] = -math.inf, math.inf
    if state == NOTHING:
        return
    thrown = _throw(b, rest_box(lo, hi, b.side), x, phi, slope, out)
    for column in (FORCE, HOLD_FRICTION, ROLL, ON_ARM):
        out[column, 0], out[column, 1] = math.inf, -math.inf
    arm = Interval(lo.arm_length, hi.arm_length)
    if state != codes.FLIP:
        _branch(b, rest_box(lo, hi, b.side), thrown, True, image, arm, out)
    if state != codes.JOG:
        _branch(b, rest_box(lo, hi, b.next), thrown, False, image - b.shift, arm, out)


@proof_kernel(entry=True)
def _cells(lo: Throw, hi: Throw, side: int, x_lo: Any, x_hi: Any, out: Any) -> None:
    b = gather_box(lo, hi, side)
    for k in range(x_lo.size):
        _cell(lo, hi, b, Interval(x_lo[k], x_hi[k]), out[k])


def assumed(lo: Throw, hi: Throw, side: int, x_lo: ArrayLike, x_hi: ArrayLike) -> NDArray[np.float64]:
    """Enclose what throws need.

    Parameters
    ----------
    lo, hi : Throw
        Corners of a box of parameters.
    side : int
        The side that the part rests on.
    x_lo, x_hi : array_like, shape (n,)
        Cells of starts [length].

    Returns
    -------
    ndarray, shape (n, 12, 2)
        Lower and upper bound per column of `Assumed`; -inf and inf where nothing is proved.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.feeder.thrower.assumed_box import Assumed, assumed
    >>> map = ls.load("paper-designed").map
    >>> assumed(map, map, 2, [8.0], [8.0])[0, Assumed.ANGLE].round(6)
    array([0.311437, 0.311437])
    """
    guard()
    first, last = (np.ascontiguousarray(ends, dtype=np.float64) for ends in (x_lo, x_hi))
    out = np.empty((first.size, COUNT, 2))
    _cells(lo, hi, side, first, last, out)
    return out


@proof_kernel(entry=True)
def _beyond(lo: Throw, hi: Throw, side: int, angle: float) -> tuple[float, float]:
    """Enclose ell^2 sin(corner - angle), positive where 0 < angle < corner < pi."""
    own = rest_box(lo, hi, side)
    after = rest_box(lo, hi, side + 1 if side + 1 < lo.a.size else 0)
    at = turn_point(angle)
    sine = own.d * after.right + own.a * after.d
    cosine = own.d * after.d - own.a * after.right
    bounds = sine * (1.0 - at.versin) - cosine * at.sin
    return bounds.lo, bounds.hi


def corner_bounds(lo: Throw, hi: Throw, side: int, guess: float) -> tuple[float, float]:
    """Enclose the exterior angle at the left vertex [rad]; (0, pi) where that cannot be proved near the guess.

    The lines from that vertex to the centre of mass and along the two sides make the angles atan(d/a) and
    atan(d'/(L' - a')); the interior angle is their sum.
    """
    guard()
    width = 2.0**-46
    while width < 0.25:
        below, beyond = guess * (1.0 - width), guess * (1.0 + width)
        good = _beyond(lo, hi, side, below)[0] > 0.0 > _beyond(lo, hi, side, beyond)[1]
        if good and below > 0.0 and beyond < 3.14:
            return below, beyond
        width *= 4.0
    return 0.0, math.pi
