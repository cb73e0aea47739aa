"""One throw with effects beyond the minimal model, its steps in the order in which nature applies them.

Each step is a kernel of an effect's own file, which begins by asking whether its effect is there, or one that effects
may add to (`motion.py`): what a scene does not ask for is dropped before it is typed and is not in the machine code.
The bare map does not come through here.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from limitsets.base import MapError
from limitsets.feeder.thrower.contact import fly_on
from limitsets.feeder.thrower.effects import EFFECTS
from limitsets.feeder.thrower.effects.bounce import Bounce, struck
from limitsets.feeder.thrower.effects.landing import Landing, first_arrival
from limitsets.feeder.thrower.effects.pivot import Pivot, turned_down
from limitsets.feeder.thrower.effects.roll import Roll, next_arrival
from limitsets.feeder.thrower.effects.slip import Slip
from limitsets.feeder.thrower.full_box import full_fallback_box, full_image_box, gather_full_pair
from limitsets.feeder.thrower.motion import (
    LOST,
    OFF,
    FullSide,
    FullThrow,
    moved,
    outline_of,
    possible,
    side_number,
    stays,
    thrown,
    varied,
)
from limitsets.feeder.thrower.params import Exact, Throw, gather
from limitsets.feeder.thrower.throw import EXITS
from limitsets.feeder.thrower.traced import details
from limitsets.numbers.jit import entry_of, kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register

# Impacts of one throw at which it is given up, as outside the model: far more than the energy of any allows.
MOST_EVENTS = 10_000


_gather = kernel(gather)


@kernel
def gather_full(params: FullThrow, side: int) -> FullSide:
    """Return what the kernels need to know of one side (`on_side` of the throw map with effects)."""
    bare = params.bare
    return FullSide(
        _gather(thrown(params.effects, bare), side),
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
    roll, bounce = entry_of(part.effects, Roll), entry_of(part.effects, Bounce)
    pivot, slip = entry_of(part.effects, Pivot), entry_of(part.effects, Slip)
    hit, moving = first_arrival(entry_of(part.effects, Landing), part, x)
    if not (moving and possible(part.effects, True, part, x)):
        return 0.0, 0, codes.OUTSIDE_MODEL
    impacts, rolls, before = 0, -1, side
    while moving and impacts < MOST_EVENTS:
        impacts += 1
        contact, face, ends = turned_down(pivot, slip, roll, part, struck(bounce, slip, part, hit))
        if ends == LOST:
            return 0.0, 0, codes.OUTSIDE_MODEL
        if ends == OFF:
            hit, moving = fly_on(pivot, slip, bounce, part, contact, hit)
            if not moving:
                return 0.0, 0, codes.OUTSIDE_MODEL
        else:
            hit, moving = next_arrival(roll, bounce, slip, part, face)
            rolls += rolls < 0 or face.side != before
            before = face.side
    k = side_number(part, face.side)
    shift = moved(part.effects, face.shift, part, face)
    if moving or not math.isfinite(shift) or not stays(part.effects, True, part, k):
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
    landing = entry_of(part.effects, Landing)
    hit, _ = first_arrival(landing, part, x)
    shift, turned, _ = full_outcome(part, x, side)
    phi = hit.psi.phi
    for number in range(side, hit.vertex):
        phi += part.corner[side_number(part, number)]
    return phi, shift, turned, False if landing is not None else phi > part.own.corner


details.on(FullThrow, full_details)


def _image(params: FullThrow, x: float, side: int) -> Any:
    return full_side_image(gather_full(params, side), x, side)


def _scattered(params: FullThrow, start: int, step: int) -> Any:
    return varied(params.effects, params, start, step)


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


def with_effects(bare: Throw, effects: Mapping[str, Any], world: Any) -> FullThrow:
    """Add effects to the minimal model.

    Parameters
    ----------
    bare : Throw
        Part, arm and throw; its flight is the exact one.
    effects : mapping
        By name, of `EFFECTS`, what the scene writes after it: true, or a word.
    world : object
        The facts, as attributes.

    Returns
    -------
    FullThrow
        A map, of a class of its own: what is not named is not in its machine code.

    Raises
    ------
    MapError
        For a small-angle flight, in which angles and heights of the part's corners have no meaning.
    """
    if not isinstance(bare.flight, Exact):
        raise MapError(
            "the flight", type(bare.flight).__name__, "the exact one", 'effects need flight = "exact"'
        )
    chosen = [effect.build(world, effects[name]) for name, effect in EFFECTS.items() if name in effects]
    return FullThrow(bare, outline_of(bare), tuple(chosen))
