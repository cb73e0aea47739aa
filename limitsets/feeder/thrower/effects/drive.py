"""Effect `drive`: the arm is not struck but turned, with constant angular acceleration over a stroke s, then stopped.

The part leaves the arm with w = sqrt(2 alpha s), turned by s.  In the frame of the stopped arm gravity then is
(-kappa sin s, -kappa cos s): along the arm the flight loses (kappa/2) sin s phi^2, the impact equation has kappa cos s,
and height is H cos s + X sin s, so that the part is past the vertex where X cos s - H sin s < 0.  It rests on a side
where tan s < a/d and tan s <= mu; the arm then goes back slowly.

While the arm turns by theta, at rate^2 theta/s and acceleration alpha = 1/(2 s) (in w^2), the part at R, Y = h + d
presses on it with

    N = alpha R - (theta/s) Y + kappa cos theta,        T = kappa sin theta - alpha Y - (theta/s) R

at c = (alpha rho^2 - d T)/N right of the centre's foot.  N > 0, -a <= c <= L - a and |T| <= mu N have to hold all the
way, or the throw is outside the model.  Each says that some A + B theta + C sin theta + D cos theta is not negative, so
its ends and the zeros of its derivative decide.  s -> 0 is the impulse of the minimal model.
Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.feeder.thrower.motion import Effect, FullSide, at_kappa, declare, possible, stays, thrown
from limitsets.feeder.thrower.params import Throw
from limitsets.numbers.jit import kernel


class Drive(NamedTuple):
    """A stroke.

    Attributes
    ----------
    stroke : float
        Angle over which the arm accelerates [rad].
    sine, cosine : float
        Of the stroke.
    friction : float
        Coefficient of friction; inf where it is not known and not asked for.
    """

    stroke: float
    sine: float
    cosine: float
    friction: float


@kernel
def _driven(drive: Drive, bare: Throw) -> Throw:
    """Return the minimal model with gravity's share across the arm."""
    return at_kappa(bare, bare.kappa * drive.cosine)


@kernel
def pulled(drive: Any, across: float, phi: float) -> tuple[float, float]:
    """Shift of a flight by gravity along the arm, and the velocity it gives; `across` is gravity across the arm."""
    if drive is None:
        return 0.0, 0.0
    along = across * (drive.sine / drive.cosine)
    return -0.5 * along * phi * phi, -along * phi


@kernel
def leant(drive: Any, across: float, right: float, high: float) -> tuple[float, float, float]:
    """Gravity, and X and H as gravity sees them."""
    if drive is None:
        return across, right, high
    return (
        across / drive.cosine,
        right * drive.cosine - high * drive.sine,
        high * drive.cosine + right * drive.sine,
    )


@kernel
def _rests_leant(drive: Drive, so_far: bool, part: FullSide, k: int) -> bool:
    """Whether the part stays on a side of the stopped arm."""
    a, d = part.a[k], part.d[k]
    over, slides = a * drive.cosine <= d * drive.sine, drive.sine > drive.friction * drive.cosine
    return so_far and not (over or slides)


@kernel
def all_the_way(stroke: float, a: float, b: float, c: float, d: float) -> bool:
    """Whether a + b theta + c sin theta + d cos theta >= 0 for 0 <= theta <= stroke < pi/2."""
    least = min(a + d, a + b * stroke + c * math.sin(stroke) + d * math.cos(stroke))
    size = math.hypot(c, d)
    if abs(b) <= size and size > 0.0:
        # the derivative b + size cos(theta + delta), with size cos delta = c and size sin delta = d
        delta, turn = math.atan2(d, c), math.acos(-b / size)
        for sign in (-1.0, 1.0):
            theta = (sign * turn - delta) % (2.0 * math.pi)
            if theta < stroke:
                least = min(least, a + b * theta + c * math.sin(theta) + d * math.cos(theta))
    return least >= 0.0


@kernel
def _holds_in_stroke(drive: Drive, so_far: bool, part: FullSide, x: float) -> bool:
    """Whether the part stays on the arm, and still, while that accelerates."""
    own, length = part.own, part.length[part.own.side]
    s, mu = drive.stroke, drive.friction
    kappa, high, alpha = own.kappa / drive.cosine, own.h + own.d, 0.5 / drive.stroke
    # N and T as (constant, theta, sin, cos), and the moment N c
    n0, n1, n3 = alpha * x, -high / s, kappa
    t0, t1, t2 = -alpha * high, -x / s, kappa
    m0, m1, m2 = alpha * own.rho2 - own.d * t0, -own.d * t1, -own.d * t2
    right = length - own.a
    good = so_far & all_the_way(s, n0, n1, 0.0, n3)
    good &= all_the_way(s, right * n0 - m0, right * n1 - m1, -m2, right * n3)
    good &= all_the_way(s, own.a * n0 + m0, own.a * n1 + m1, m2, own.a * n3)
    if mu < math.inf:
        good &= all_the_way(s, mu * n0 - t0, mu * n1 - t1, -t2, mu * n3)
        good &= all_the_way(s, mu * n0 + t0, mu * n1 + t1, t2, mu * n3)
    return good


def _of(world: Any, how: Any) -> Drive:
    friction = math.inf if world.friction is None else world.friction
    return Drive(world.stroke, math.sin(world.stroke), math.cos(world.stroke), friction)


thrown.on(Drive, _driven)
possible.on(Drive, _holds_in_stroke)
stays.on(Drive, _rests_leant)
declare(
    Effect(
        "drive",
        Drive,
        _of,
        "the throw is impulsive",
        ("stroke",),
        ("slip", "pivot", "bounce"),
        reads=("friction",),
    )
)
