"""Impact and landing: the rotation after the plastic, sticking landing on the left vertex, and the place of rest.

The formulas stand once, for every kind of number: floats, and intervals over a cell of starts and a box of parameters.
`strike` gives the rate after the impact and the barrier B = sgn(X) V: the potential energy still to be climbed,
negative once the centre of mass is past the vertex (X < 0).  With the kinetic energy K about the vertex, `margin` is
positive where the part flips:

    signed:  sgn(omega) K - B        energy:  K - B

In the small-angle models X has no meaning and V keeps its own sign.  A jog moves the centre of mass by
-h phi + a (1 - cos phi) - d (phi - sin phi); a flip about the struck vertex by `Side.shift` less.  Both come from the
angle alone, so that a short throw loses no digit to x.  Source: docs/model.md, impact and landing.
"""

from __future__ import annotations

from typing import Any

from limitsets.feeder.thrower.params import Energy, Exact, Signed, SmallAngle, SmallAngle2, per_inertia
from limitsets.numbers.interval.number import signed_square, where_positive, with_sign_of
from limitsets.numbers.jit import formula, generic

# ---------------------------------------------------------------- impact


@generic
def strike(flight: Any, part: Any, x: Any, at: Any) -> tuple[Any, Any]:
    """Rate after the impact, barrier."""


@generic
def margin(flip: Any, inertia: Any, omega: Any, barrier: Any) -> Any:
    """Return the number that is positive where the part flips."""


@formula
def pose(part: Any, at: Any) -> tuple[Any, Any]:
    """Return X and H: where the centre of mass is from the left vertex, along the arm and above it, turned by phi."""
    c = 1.0 - at.versin
    return part.a * c - part.d * at.sin, part.a * at.sin + part.d * c


@formula
def swing(part: Any, right: Any, above: Any, falling: Any, lever: Any) -> tuple[Any, Any]:
    """Return the rate about a struck vertex, and the barrier.

    The centre of mass is X = `right` of the vertex and H = `above` it; w x `falling` is its velocity down before the
    impact, w x `lever` that along the arm.
    """
    omega = per_inertia(part, part.rho2 + (right * falling + above * lever))
    # ell - H = X^2 / (ell + H) keeps its digits near the top; for H < 0 the difference itself does.
    near = signed_square(right) / (part.ell + where_positive(above, above, -above))
    far = with_sign_of(right, part.ell - above)
    return omega, part.kappa * where_positive(above, near, far)


def _exact(flight: Any, part: Any, x: Any, at: Any) -> tuple[Any, Any]:
    right, above = pose(part, at)
    return swing(part, right, above, x - part.kappa * at.phi, part.h + part.d)


def _small(flight: Any, part: Any, x: Any, at: Any) -> tuple[Any, Any]:
    a, d, reach = part.a, part.d, x - part.a
    own = a**2 + d**2 + d * part.h
    omega = per_inertia(part, part.rho2 - a * reach + own)  # 2 a^2 - a R = a^2 - a (R - a)
    return omega, part.kappa * (a**2 / (part.ell + d)) - 2.0 * (a * reach)


def _signed(flip: Any, inertia: Any, omega: Any, barrier: Any) -> Any:
    return 0.5 * inertia * signed_square(omega) - barrier


def _energy(flip: Any, inertia: Any, omega: Any, barrier: Any) -> Any:
    return 0.5 * inertia * omega**2 - barrier


strike.on(Exact, _exact)
strike.on(SmallAngle, _small)
strike.on(SmallAngle2, _small)
margin.on(Signed, _signed)
margin.on(Energy, _energy)


# ---------------------------------------------------------------- landing


@generic
def jog_displacement(flight: Any, part: Any, at: Any) -> tuple[Any, Any]:
    """Shift of the centre of mass by a jog, and its derivative with respect to phi."""


def _exact_jog(flight: Any, part: Any, at: Any) -> tuple[Any, Any]:
    return (
        part.a * at.versin - part.d * at.phi_minus_sin - part.h * at.phi,
        part.a * at.sin - part.d * at.versin - part.h,
    )


def _small_jog(flight: Any, part: Any, at: Any) -> tuple[Any, Any]:
    return -(part.h * at.phi), -part.h


jog_displacement.on(Exact, _exact_jog)
jog_displacement.on(SmallAngle, _small_jog)
jog_displacement.on(SmallAngle2, _small_jog)
