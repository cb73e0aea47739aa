"""Landing: how far the centre of mass has moved when the part lies still.

A jog moves it by -h phi + a (1 - cos phi) - d (phi - sin phi); a flip about the struck vertex by `Side.shift` less.
Both come from the angle alone, so that a short throw loses no digit to x.
"""

from __future__ import annotations

from typing import Any

from limitsets.jit import generic, kernel
from limitsets.thrower.params import Exact, Side, SmallAngle, SmallAngle2
from limitsets.thrower.turn import Turned

__all__ = ["jog_displacement"]


@generic
def jog_displacement(flight: Any, part: Side, at: Turned) -> tuple[float, float]:
    """Shift of the centre of mass by a jog, and its derivative with respect to phi."""


@kernel
def _exact(flight: Any, part: Side, at: Turned) -> tuple[float, float]:
    return part.a * at.v - part.d * at.w - part.h * at.phi, part.a * at.s - part.d * at.v - part.h


@kernel
def _small(flight: Any, part: Side, at: Turned) -> tuple[float, float]:
    return -part.h * at.phi, -part.h


jog_displacement.on(Exact, _exact)
jog_displacement.on(SmallAngle, _small)
jog_displacement.on(SmallAngle2, _small)
