"""The box twin of `impact.py` and `landing.py`: the decision between jog and flip, and where a jog ends."""

from __future__ import annotations

from typing import Any

import limitsets.interval as iv
from limitsets.interval.arithmetic import Interval
from limitsets.interval.rounding import down, up
from limitsets.jit import generic, proof_kernel
from limitsets.thrower.params import Energy, Exact, Signed, SmallAngle, SmallAngle2
from limitsets.thrower.side_box import SideBox
from limitsets.thrower.turn_box import turn_box

__all__ = ["decide_box", "displacement_box", "strike_box"]


# ---------------------------------------------------------------- impact


@generic(proof=True)
def strike_box(flight: Any, b: SideBox, x: Interval, phi: Interval) -> tuple[Interval, Interval]:
    """Rate after the impact, barrier."""


@generic(proof=True)
def decide_box(flip: Any, b: SideBox, omega: Interval, barrier: Interval) -> Interval:
    """Enclosure of the number that is positive where the part flips."""


@proof_kernel
def _signed_square(x: Interval) -> Interval:
    """x |x|, which grows with x."""
    return down(x[0] * abs(x[0])), up(x[1] * abs(x[1]))


@proof_kernel
def _exact_strike(flight: Any, b: SideBox, x: Interval, phi: Interval) -> tuple[Interval, Interval]:
    s, v, _ = turn_box(phi[0], phi[1])
    c = iv.sub((1.0, 1.0), v)
    right = iv.sub(iv.mul(b.a, c), iv.mul(b.d, s))
    above = iv.add(iv.mul(b.a, s), iv.mul(b.d, c))
    falling = iv.sub(x, iv.mul(b.kappa, phi))
    turning = iv.add(iv.mul(right, falling), iv.mul(above, iv.add(b.h, b.d)))
    omega = iv.div(iv.add(b.rho2, turning), b.inertia)
    # X |X| / (ell + H) = sgn(X) (ell - H).  The first is tight where H > 0 is proved; below the vertex it cancels.
    near = iv.div(_signed_square(right), iv.add(b.ell, above))
    rest = iv.sub(b.ell, above)
    least, most = max(rest[0], 0.0), max(rest[1], 0.0)
    far = (-most if right[0] < 0.0 else least), (most if right[1] > 0.0 else -least)
    upright = above[0] > 0.0
    barrier = iv.mul(b.kappa, (near[0] if upright else far[0], near[1] if upright else far[1]))
    return omega, barrier


@proof_kernel
def _small_strike(flight: Any, b: SideBox, x: Interval, phi: Interval) -> tuple[Interval, Interval]:
    reach = iv.sub(x, b.a)
    own = iv.add(iv.add(iv.sqr(b.a), iv.sqr(b.d)), iv.mul(b.d, b.h))
    omega = iv.div(
        iv.add(iv.sub(b.rho2, iv.mul(b.a, reach)), own), b.inertia
    )  # 2 a^2 - a R = a^2 - a (R - a)
    top = iv.mul(b.kappa, iv.div(iv.sqr(b.a), iv.add(b.ell, b.d)))
    return omega, iv.sub(top, iv.mul((2.0, 2.0), iv.mul(b.a, reach)))


@proof_kernel
def _signed(flip: Any, b: SideBox, omega: Interval, barrier: Interval) -> Interval:
    return iv.sub(iv.mul(iv.mul((0.5, 0.5), b.inertia), _signed_square(omega)), barrier)


@proof_kernel
def _energy(flip: Any, b: SideBox, omega: Interval, barrier: Interval) -> Interval:
    return iv.sub(iv.mul(iv.mul((0.5, 0.5), b.inertia), iv.sqr(omega)), barrier)


strike_box.on(Exact, _exact_strike)
strike_box.on(SmallAngle, _small_strike)
strike_box.on(SmallAngle2, _small_strike)
decide_box.on(Signed, _signed)
decide_box.on(Energy, _energy)


# ---------------------------------------------------------------- landing


@generic(proof=True)
def displacement_box(flight: Any, b: SideBox, phi: Interval) -> tuple[Interval, Interval]:
    """Shift of the centre of mass by a jog, and its derivative with respect to phi."""


@proof_kernel
def _exact_displacement(flight: Any, b: SideBox, phi: Interval) -> tuple[Interval, Interval]:
    s, v, w = turn_box(phi[0], phi[1])
    shift = iv.sub(iv.sub(iv.mul(b.a, v), iv.mul(b.d, w)), iv.mul(b.h, phi))
    return shift, iv.sub(iv.sub(iv.mul(b.a, s), iv.mul(b.d, v)), b.h)


@proof_kernel
def _small_displacement(flight: Any, b: SideBox, phi: Interval) -> tuple[Interval, Interval]:
    return iv.neg(iv.mul(b.h, phi)), iv.neg(b.h)


displacement_box.on(Exact, _exact_displacement)
displacement_box.on(SmallAngle, _small_displacement)
displacement_box.on(SmallAngle2, _small_displacement)
