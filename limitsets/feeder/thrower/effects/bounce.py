"""Effect `bounce`: a struck vertex leaves the arm again.

Poisson's restitution: after compression has taken the normal impulse J_n, e J_n more is given back, with friction as
during compression (without `slip` the vertex sticks along the arm).  Where compression would have to pull there is
nothing to give back.  A vertex thrown off so slowly that it would rise by less than the threshold is not thrown off:
that impact is plastic.  Energy never grows, and e = 0 is the plastic impact to the last digit.
Oracles: a part that does not spin rises to e^2 of its last height, and comes to rest 2 v e/(g (1 - e)) after its first
impact.  Source: docs/model.md, effects; Wang and Mason, J. Applied Mechanics 59, 1992.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from limitsets.feeder.thrower.effects.slip import compressed, dragged
from limitsets.feeder.thrower.motion import (
    Arrival,
    Contact,
    Effect,
    FullSide,
    above,
    declare,
    impacted,
    right_of,
)
from limitsets.numbers.jit import kernel


class Bounce(NamedTuple):
    """Restitution of the normal impulse, and the height of the bounce below which it is none [length]."""

    restitution: float
    threshold: float


@kernel
def _rebound(bounce: Any, slip: Any, part: FullSide, hit: Contact, push: float) -> Contact:
    """Return the part as the arm throws it off after compression; without the effect it stays."""
    if bounce is None:
        return hit
    right, high, rho2 = right_of(part, hit.vertex, hit.psi), above(part, hit.vertex, hit.psi), part.own.rho2
    back = bounce.restitution * max(push, 0.0)
    drag, slide = dragged(slip, part, hit, back)
    turned = (high * drag - right * back) / rho2
    lift = back - right * turned
    if not (lift > 0.0 and lift * lift > 2.0 * part.own.kappa * bounce.threshold):
        return hit
    return Contact(hit.vertex, hit.psi, hit.shift, hit.omega + turned, slide, lift)


@kernel
def struck(bounce: Any, slip: Any, part: FullSide, hit: Arrival) -> Contact:
    """Return the part just after its vertex struck."""
    after, push = compressed(slip, part, hit)
    return impacted(part.effects, _rebound(bounce, slip, part, after, push), part)


def _of(world: Any, how: Any) -> Bounce:
    return Bounce(float(world.restitution), float(world.bounce_threshold))


declare(Effect("bounce", Bounce, _of, "it does not bounce", ("restitution", "bounce_threshold")))
