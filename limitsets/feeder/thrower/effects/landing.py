"""Effect `landing`: whichever vertex comes down first lands, not always the left one.

Turning counterclockwise, the lowest vertex is the left one of the side the part lay on until it has turned by the
exterior angle there, then the left one of the next side, and so on: so the height of the lowest vertex is followed from
each such angle to the next, and its first root is the landing.  With the left vertex lowest at its own landing, which
is all that the minimal model knows, nothing changes, to the last digit.
Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.feeder.thrower.effects.drive import Drive, pulled
from limitsets.feeder.thrower.flight import STILL, Turned, sure_step, turn
from limitsets.feeder.thrower.impact import jog_displacement
from limitsets.feeder.thrower.motion import (
    Arrival,
    Effect,
    FullSide,
    declare,
    enclosed,
    encloses,
    side_number,
)
from limitsets.feeder.thrower.throw import settle
from limitsets.numbers.jit import entry_of, kernel


class Landing(NamedTuple):
    """Any vertex may land first."""

    full_turn: float = 2.0 * math.pi


@kernel
def _height(part: FullSide, x: float, k: int, at: Turned) -> tuple[float, float]:
    """Height of vertex k over the arm, and its derivative, when the part has turned by phi in its first flight."""
    p, q, own = part.p[k], part.q[k], part.own
    rise = x + p
    height = (own.d + q) + at.phi * (rise - 0.5 * own.kappa * at.phi) - p * at.phi_minus_sin - q * at.versin
    return height, rise - own.kappa * at.phi - p * at.versin - q * at.sin


@kernel
def _lowest_root(part: FullSide, x: float, corner: float) -> tuple[float, int]:
    """Angle at which the lowest vertex lands, beyond the first `corner`, and its number; nan where none does.

    The march of `flight.first_root`, on one vertex after the other.
    """
    own = part.own
    vertex = own.side
    border, phi = corner, corner
    while phi < own.flight.full_turn:
        vertex += 1
        k = side_number(part, vertex)
        bound = own.kappa + math.hypot(part.p[k], part.q[k])
        border += part.corner[k]
        while phi < border:
            f, slope = _height(part, x, k, turn(phi))
            if f <= 0.0:
                return phi, vertex
            step = sure_step(f, slope, bound)
            if step <= STILL * phi:
                return phi, vertex
            phi += step
        phi = border
    return math.nan, vertex


@kernel
def first_arrival(landing: Any, part: FullSide, x: float) -> tuple[Arrival, bool]:
    """Return the first vertex to strike, and whether there is one within a full turn."""
    own = part.own
    at, _ = settle(own, x)
    shift, _ = jog_displacement(own.flight, own, at)
    drive = entry_of(part.effects, Drive)
    pull, speed = pulled(drive, own.kappa, at.phi)
    left = Arrival(own.side, at, shift + pull, speed - (own.h + own.d), x - own.kappa * at.phi, 1.0)
    flies = (x > own.a) & (at.phi > 0.0) & (at.phi <= own.flight.full_turn)
    if landing is None:
        return left, flies
    if flies and at.phi <= own.corner:
        return left, True
    if not x > own.a:
        return left, False
    phi, vertex = _lowest_root(part, x, own.corner)
    if not phi <= own.flight.full_turn:
        return left, False
    k = side_number(part, vertex)
    now = turn(phi)
    # X, how far the centre is right of the vertex that lands, and its shift if the part fell back on side `vertex`
    right = part.q[k] * now.sin - part.p[k] * (1.0 - now.versin)
    pull, speed = pulled(drive, own.kappa, phi)
    moved = pull - (own.h + own.d) * phi + (part.a[k] - right)
    offset = own.corner
    for number in range(own.side + 1, vertex):
        offset += part.corner[side_number(part, number)]
    psi = turn(max(phi - offset, 0.0))
    return Arrival(vertex, psi, moved, speed - (own.h + own.d), x - own.kappa * phi, 1.0), True


encloses.on(Landing, enclosed)
declare(Effect("landing", Landing, lambda world, how: Landing(), "the left bottom vertex lands first"))
