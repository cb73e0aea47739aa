"""One throw, its steps in the order in which nature applies them.

The kernels of the map contract: `image` (fast, marks starts that it cannot settle), `fallback` (sure), `image_on` (a
forced branch, with the slope), `margin` (its sign decides the flip) and `displacement`.
"""

from __future__ import annotations

import math
from typing import Any

from limitsets.feeder.thrower.flight import Turned, impact_angle, sure_impact_angle
from limitsets.feeder.thrower.impact import jog_displacement, margin, strike
from limitsets.feeder.thrower.params import Side, SideBox, Throw, gather
from limitsets.feeder.thrower.throw_box import (
    gather_pair,
    side_fallback_box,
    side_image_box,
    throw_fallback_box,
    throw_image_box,
)
from limitsets.numbers.jit import kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.kernels import decision, fallback_box, image_box

EXITS = {"inward": codes.INWARD, "outward": codes.OUTWARD, "outside-model": codes.OUTSIDE_MODEL}

gather_side = kernel(gather)


@kernel
def flip_margin(part: Side, x: float, at: Turned) -> float:
    """Positive where the part flips after an impact at phi."""
    omega, barrier = strike(part.flight, part, x, at)
    excess: float = margin(part.flip, part.inertia, omega, barrier)
    return excess


@kernel
def outcome(part: Side, x: float, at: Turned) -> tuple[float, int, int, float]:
    """Where a throw ends that meets the arm at phi: ``(x', side', code, displacement)``."""
    flips = flip_margin(part, x, at) > 0.0
    shift, _ = jog_displacement(part.flight, part, at)
    shift = shift - part.shift if flips else shift
    after = x + shift
    code = codes.FLIP if flips else codes.JOG
    code = codes.INWARD if after <= (part.a_next if flips else part.a) else code
    code = codes.OUTWARD if after > part.arm_length else code
    return after, part.next if flips else part.side, code, shift


@kernel
def side_image(part: Side, x: float, side: int) -> tuple[float, int, int]:
    """`image` of the throw on one side."""
    at, _, settled = impact_angle(part.flight, part, x)
    after, side_after, code, _ = outcome(part, x, at)
    code = code if settled else codes.UNSETTLED
    # Only a start beyond the vertex flies, and the model ends at a full turn.  For the exact flight with one root
    # the second test is f(2 pi) > 0, that is x > pi kappa, and agrees with phi > 2 pi to rounding.
    model = (x > part.a) & (at.phi > 0.0) & (at.phi <= part.flight.full_turn)
    code = code if model or (x > part.a and not settled) else codes.OUTSIDE_MODEL
    inside = code != codes.OUTSIDE_MODEL
    return after if inside else x, side_after if inside else side, code


@kernel
def side_fallback(part: Side, x: float, side: int) -> tuple[float, int, int]:
    """`fallback` of the throw on one side: the smallest root by a march."""
    at, _ = sure_impact_angle(part.flight, part, x)
    if not (x > part.a and 0.0 < at.phi <= part.flight.full_turn):
        return x, side, codes.OUTSIDE_MODEL
    after, side_after, code, _ = outcome(part, x, at)
    return after, side_after, code


@kernel
def settle(part: Side, x: float) -> tuple[Turned, float]:
    """Angle of the impact and its derivative, by the fast way where that can be vouched for."""
    at, slope, settled = impact_angle(part.flight, part, x)
    if not settled:
        at, slope = sure_impact_angle(part.flight, part, x)
    return at, slope


@kernel
def side_image_on(part: Side, x: float, side: int, branch: int) -> tuple[float, int, float]:
    """`image_on` of the throw on one side: branch 0 jogs, branch 1 flips, whatever the energy says."""
    at, phi_slope = settle(part, x)
    shift, shift_slope = jog_displacement(part.flight, part, at)
    slope = 1.0 + shift_slope * phi_slope
    if branch == codes.FLIP:
        return x + (shift - part.shift), part.next, slope
    return x + shift, side, slope


@kernel
def side_margin(part: Side, x: float, side: int) -> float:
    """`margin` of the throw on one side: nan where there is no impact within a full turn."""
    at, _ = settle(part, x)
    if not (x > part.a and 0.0 < at.phi <= part.flight.full_turn):
        return math.nan
    return flip_margin(part, x, at)


@kernel
def side_decision(part: Side, x: float, side: int) -> tuple[float, float, bool]:
    """`decision` of the throw on one side: the angle of the impact is found once, the fast way."""
    at, phi_slope, settled = impact_angle(part.flight, part, x)
    falls = (x > part.a) & (at.phi > 0.0) & (at.phi <= part.flight.full_turn)
    _, shift_slope = jog_displacement(part.flight, part, at)
    value = flip_margin(part, x, at)
    return value if falls else math.nan, 1.0 + shift_slope * phi_slope, settled


@kernel
def side_displacement(part: Side, x: float, side: int) -> float:
    """`displacement` of the throw on one side."""
    at, _ = settle(part, x)
    _, _, _, shift = outcome(part, x, at)
    return shift


def _image(params: Throw, x: float, side: int) -> Any:
    return side_image(gather_side(params, side), x, side)


def _fallback(params: Throw, x: float, side: int) -> Any:
    return side_fallback(gather_side(params, side), x, side)


def _image_on(params: Throw, x: float, side: int, branch: int) -> Any:
    return side_image_on(gather_side(params, side), x, side, branch)


def _margin(params: Throw, x: float, side: int) -> Any:
    return side_margin(gather_side(params, side), x, side)


def _displacement(params: Throw, x: float, side: int) -> Any:
    return side_displacement(gather_side(params, side), x, side)


register(
    Throw,
    image=_image,
    image_on=_image_on,
    image_box=throw_image_box,
    fallback_box=throw_fallback_box,
    on_side=gather,
    on_side_box=gather_pair,
    fallback=_fallback,
    margin=_margin,
    displacement=_displacement,
    branches=("jog", "flip"),
    exits=EXITS,
)
fallback_box.on(SideBox, side_fallback_box)
image_box.on(SideBox, side_image_box)
register(
    Side,
    image=side_image,
    image_on=side_image_on,
    fallback=side_fallback,
    margin=side_margin,
    displacement=side_displacement,
    branches=("jog", "flip"),
    exits=EXITS,
)
decision.on(Side, side_decision)
