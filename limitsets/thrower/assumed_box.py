"""What a throw would need beyond the minimal model, enclosed: for cells of starts and boxes of parameters.

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

import limitsets.interval as iv
from limitsets.interval import guard
from limitsets.interval.arithmetic import Interval
from limitsets.jit import generic, proof_kernel
from limitsets.maps import codes
from limitsets.thrower.hinge_box import hinge_force, peak
from limitsets.thrower.impact_box import strike_box
from limitsets.thrower.params import Exact, SmallAngle, SmallAngle2, Throw
from limitsets.thrower.side_box import SideBox, gather_box
from limitsets.thrower.throw_box import NOTHING, sure_throw_box, throw_box
from limitsets.thrower.turn_box import turn_box, turn_point

__all__ = ["Assumed", "assumed", "corner_bounds"]


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
def pose_box(flight: Any, b: SideBox, x: Interval, phi: Interval) -> Pose:
    """Return the part at its landing."""


@proof_kernel
def _exact(flight: Any, b: SideBox, x: Interval, phi: Interval) -> Pose:
    s, v, _ = turn_box(phi[0], phi[1])
    c = iv.sub((1.0, 1.0), v)
    above = iv.add(iv.mul(b.a, s), iv.mul(b.d, c))
    right = iv.sub(iv.mul(b.a, c), iv.mul(b.d, s))
    return Pose(right, above, iv.sub(x, iv.mul(b.kappa, phi)), above)


@proof_kernel
def _small(flight: Any, b: SideBox, x: Interval, phi: Interval) -> Pose:
    # the paper's impact: the vertex as it was at phi = 0, and the velocity after phi = 2 (R - a) / kappa
    reach = iv.sub(x, b.a)
    lost = iv.div(iv.mul((2.0, 2.0), iv.mul(b.a, reach)), b.kappa)
    return Pose(b.a, b.d, iv.sub(b.a, reach), iv.add(b.d, lost))


pose_box.on(Exact, _exact)
pose_box.on(SmallAngle, _small)
pose_box.on(SmallAngle2, _small)


@proof_kernel
def rest_box(lo: Throw, hi: Throw, side: int) -> Rest:
    """Intervals of a side on which the part rests."""
    a = (lo.a[side], hi.a[side])
    return Rest(a, (lo.d[side], hi.d[side]), iv.sub((lo.length[side], hi.length[side]), a))


@proof_kernel
def _needed(b: SideBox, rest: Rest, foot: Interval) -> Interval:
    """Energy needed to lift the part over an end of the side it lies on."""
    square = iv.sqr(foot)
    rise = iv.div(square, iv.add(iv.sqrt(iv.add(square, iv.sqr(rest.d))), rest.d))
    return iv.mul(b.kappa, rise)


@proof_kernel
def _rolls(b: SideBox, rest: Rest, energy: Interval, jog: bool) -> Interval:
    """Energy left after a side has come down, in that needed (`effects/roll.py`).

    The part strikes with the end it did not turn about, and is lifted over it, or rocks back, strikes with the first
    one again, and is lifted over that; every strike leaves less, so no third one does more.
    """
    struck, other = (rest.right, rest.a) if jog else (rest.a, rest.right)
    left = iv.sub(energy, iv.mul(b.kappa, rest.d))
    own = iv.add(b.rho2, iv.sqr(rest.d))
    keeps = iv.sub(own, iv.mul(rest.a, rest.right))
    keeps = iv.sqr((max(keeps[0], 0.0), max(keeps[1], 0.0)))
    share = iv.div(keeps, iv.mul(iv.add(own, iv.sqr(struck)), iv.add(own, iv.sqr(other))))
    kinetic = iv.mul(share, left)
    rocked = iv.mul(share, kinetic)
    return iv.maximum(iv.div(kinetic, _needed(b, rest, struck)), iv.div(rocked, _needed(b, rest, other)))


@proof_kernel
def _throw(b: SideBox, rest: Rest, x: Interval, phi: Interval, slope: Interval, out: Any) -> Any:
    """Write what does not depend on the decision; return what the rest needs."""
    lever = iv.add(b.h, b.d)
    foot = iv.div(iv.add(b.rho2, iv.mul(b.d, lever)), x)
    under = iv.minimum(iv.sub(rest.right, foot), iv.add(rest.a, foot))
    at = pose_box(b.flight, b, x, phi)
    omega, _ = strike_box(b.flight, b, x, phi)
    press = iv.sub(iv.mul(omega, at.right), at.falling)
    along = iv.absolute(iv.sub(lever, iv.mul(omega, at.above)))
    # from the first friction can stop the vertex, from the second the impact does not set it sliding again
    stop = iv.div(along, press if press[0] > 0.0 else (press[1], press[1]))
    turned = iv.div(iv.absolute(iv.mul(at.right, at.above)), iv.add(b.rho2, iv.sqr(at.above)))
    speed = iv.sub(at.falling, at.right)
    moved = iv.mul(iv.absolute(iv.sub(slope, (1.0, 1.0))), iv.mul(phi, b.kappa))
    half = iv.mul((0.5, 0.5), b.inertia)
    energy = iv.add(iv.mul(half, iv.sqr(omega)), iv.mul(b.kappa, at.start))
    out[UNDER] = under
    out[RELEASE_FRICTION] = iv.div(iv.absolute(lever), x)
    out[ANGLE] = phi
    out[PRESS] = iv.div(press, x)
    out[STICK_FRICTION] = (
        max(stop[0], turned[0]) if press[1] > 0.0 else math.inf,
        max(stop[1], turned[1]) if press[0] > 0.0 else math.inf,
    )
    out[DROP] = iv.div(iv.sqr(speed), iv.mul((2.0, 2.0), b.kappa))
    out[STROKE] = iv.mul(iv.mul((0.5, 0.5), b.kappa), iv.sqr(phi))
    out[SPEED] = moved
    return at, omega, energy


@proof_kernel
def _wider(out: Any, column: int, found: Interval) -> None:
    out[column, 0], out[column, 1] = min(out[column, 0], found[0]), max(out[column, 1], found[1])


@proof_kernel
def _branch(b: SideBox, rest: Rest, thrown: Any, jog: bool, image: Interval, arm: Interval, out: Any) -> None:
    """Widen by what one branch needs after the landing."""
    at, omega, energy = thrown
    per_weight = iv.div(energy, b.kappa)
    top = peak(b.ell, at.right, at.start, omega, per_weight, jog)
    force, friction = hinge_force(b.ell, b.rho2, b.inertia, at.start, top, rest.d, per_weight)
    _wider(out, FORCE, force)
    _wider(out, HOLD_FRICTION, friction)
    _wider(out, ROLL, _rolls(b, rest, energy, jog))
    _wider(out, ON_ARM, iv.minimum(iv.sub(arm, image), iv.sub(image, rest.a)))


@proof_kernel
def _cell(lo: Throw, hi: Throw, b: SideBox, x: Interval, out: Any) -> None:
    state, image, phi, slope, _ = throw_box(b, x[0], x[1])
    if state == NOTHING:
        state, image, phi, slope, _ = sure_throw_box(b, x[0], x[1])
    for column in range(COUNT):
        out[column, 0], out[column, 1] = -math.inf, math.inf
    if state == NOTHING:
        return
    thrown = _throw(b, rest_box(lo, hi, b.side), x, phi, slope, out)
    for column in (FORCE, HOLD_FRICTION, ROLL, ON_ARM):
        out[column, 0], out[column, 1] = math.inf, -math.inf
    arm = (lo.arm_length, hi.arm_length)
    if state != codes.FLIP:
        _branch(b, rest_box(lo, hi, b.side), thrown, True, image, arm, out)
    if state != codes.JOG:
        _branch(b, rest_box(lo, hi, b.next), thrown, False, iv.sub(image, b.shift), arm, out)


@proof_kernel(entry=True)
def _cells(lo: Throw, hi: Throw, side: int, x_lo: Any, x_hi: Any, out: Any) -> None:
    b = gather_box(lo, hi, side)
    for k in range(x_lo.size):
        _cell(lo, hi, b, (x_lo[k], x_hi[k]), out[k])


def assumed(lo: Throw, hi: Throw, side: int, x_lo: ArrayLike, x_hi: ArrayLike) -> NDArray[np.float64]:
    """Enclose what throws need.

    Parameters
    ----------
    lo, hi : Throw
        Corners of a box of parameters.
    side : int
        The side that the part rests on.
    x_lo, x_hi : array_like, shape (n,)
        Cells of starts [scene's unit].

    Returns
    -------
    ndarray, shape (n, 12, 2)
        Lower and upper bound per column of `Assumed`; -inf and inf where nothing is proved.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.thrower.assumed_box import Assumed, assumed
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
def _beyond(lo: Throw, hi: Throw, side: int, angle: float) -> Interval:
    """Enclose ell^2 sin(corner - angle), positive where 0 < angle < corner < pi."""
    own = rest_box(lo, hi, side)
    after = rest_box(lo, hi, side + 1 if side + 1 < lo.a.size else 0)
    s, v, _ = turn_point(angle)
    sine = iv.add(iv.mul(own.d, after.right), iv.mul(own.a, after.d))
    cosine = iv.sub(iv.mul(own.d, after.d), iv.mul(own.a, after.right))
    return iv.sub(iv.mul(sine, iv.sub((1.0, 1.0), v)), iv.mul(cosine, s))


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
