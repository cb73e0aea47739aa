"""One throw with effects beyond the minimal model, its steps in the order in which nature applies them.

Each step is a kernel of the effect's own file, which begins by asking whether its effect is there: what a scene does
not ask for is dropped before it is typed and is not in the machine code.  The bare map does not come through here.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.jit import kernel
from limitsets.maps import codes
from limitsets.maps.contract import register
from limitsets.thrower.effects.bounce import struck
from limitsets.thrower.effects.drive import driven, holds_in_stroke, rests_leant
from limitsets.thrower.effects.landing import first_arrival
from limitsets.thrower.effects.pivot import turned_down
from limitsets.thrower.effects.roll import next_arrival
from limitsets.thrower.effects.slip import slid_on
from limitsets.thrower.effects.spread import moved_by, spread_over
from limitsets.thrower.free_flight import fly_on
from limitsets.thrower.full_box import full_fallback_box, full_image_box, gather_full_pair
from limitsets.thrower.motion import LOST, OFF, FullSide, FullThrow, side_number
from limitsets.thrower.params import gather
from limitsets.thrower.throw import EXITS
from limitsets.thrower.trace import details

__all__ = ["MOST_EVENTS"]

# Impacts of one throw at which it is given up, as outside the model: far more than the energy of any allows.
MOST_EVENTS = 10_000


_gather = kernel(gather)


@kernel
def gather_full(params: FullThrow, side: int) -> FullSide:
    """Return what the kernels need to know of one side (`on_side` of the throw map with effects)."""
    bare = params.bare
    return FullSide(
        _gather(driven(params.effects.drive, bare), side),
        bare.a,
        bare.d,
        bare.length,
        bare.corner,
        params.outline.p[side],
        params.outline.q[side],
        params.effects,
    )


@kernel
def full_outcome(part: FullSide, x: float, side: int) -> tuple[float, int, int]:
    """Where a throw ends: shift of the centre of mass, sides turned, code."""
    on = part.effects
    hit, moving = first_arrival(on.landing, part, x)
    if not (moving and holds_in_stroke(on.drive, part.own, part.length[side], x)):
        return 0.0, 0, codes.OUTSIDE_MODEL
    impacts, rolls, before = 0, -1, side
    while moving and impacts < MOST_EVENTS:
        impacts += 1
        contact, face, ends = turned_down(on.pivot, on.slip, part, struck(on.bounce, on.slip, part, hit))
        if ends == LOST:
            return 0.0, 0, codes.OUTSIDE_MODEL
        if ends == OFF:
            hit, moving = fly_on(on.pivot, on.slip, on.bounce, part, contact, hit)
            if not moving:
                return 0.0, 0, codes.OUTSIDE_MODEL
        else:
            hit, moving = next_arrival(on.roll, on.bounce, on.slip, part, face)
            rolls += rolls < 0 or face.side != before
            before = face.side
    k = side_number(part, face.side)
    shift = moved_by(on.spread, face.shift + slid_on(on.slip, part, face))
    if moving or not math.isfinite(shift) or not rests_leant(on.drive, part.a[k], part.d[k]):
        return 0.0, 0, codes.OUTSIDE_MODEL
    turned = face.side - side
    code = codes.JOG if turned == 0 else codes.FLIP
    code = codes.ROLL if rolls > 0 or turned < 0 or turned > 1 else code
    after = x + shift
    code = codes.INWARD if after <= part.a[k] else code
    code = codes.OUTWARD if after > part.own.arm_length else code
    return shift, turned, code


@kernel
def full_side_image(part: FullSide, x: float, side: int) -> tuple[float, int, int]:
    """`image` of the throw with effects on one side."""
    shift, turned, code = full_outcome(part, x, side)
    return x + shift, side_number(part, side + turned), code


@kernel
def full_side_displacement(part: FullSide, x: float, side: int) -> float:
    """`displacement` of the throw with effects on one side."""
    shift, _, _ = full_outcome(part, x, side)
    return shift


@kernel
def full_details(params: FullThrow, x: float, side: int) -> tuple[float, float, int, bool]:
    """`details` of the throw with effects."""
    part = gather_full(params, side)
    hit, _ = first_arrival(part.effects.landing, part, x)
    shift, turned, _ = full_outcome(part, x, side)
    phi = hit.psi.phi
    for number in range(side, hit.vertex):
        phi += part.corner[side_number(part, number)]
    return phi, shift, turned, False if part.effects.landing is not None else phi > part.own.corner


details.on(FullThrow, full_details)


def _image(params: FullThrow, x: float, side: int) -> Any:
    return full_side_image(gather_full(params, side), x, side)


def _scattered(params: FullThrow, start: int, step: int) -> Any:
    return spread_over(params.effects.spread, params, start, step)


def _displacement(params: FullThrow, x: float, side: int) -> Any:
    return full_side_displacement(gather_full(params, side), x, side)


BRANCHES = ("jog", "flip", "roll")

register(
    FullThrow,
    image=_image,
    image_box=full_image_box,
    fallback_box=full_fallback_box,
    on_side=gather_full,
    on_side_box=gather_full_pair,
    displacement=_displacement,
    scattered=_scattered,
    branches=BRANCHES,
    exits=EXITS,
)
register(
    FullSide,
    image=full_side_image,
    displacement=full_side_displacement,
    branches=BRANCHES,
    exits=EXITS,
)
