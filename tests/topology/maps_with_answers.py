"""Maps whose attractors and basins are known on paper, as a user registers them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

import limitsets as ls


class Two(NamedTuple):
    """Below 0 the full tent of slope `slope` on [-1, 0], from 0 on a contraction by `factor` to `rest`.

    Known answers: the tent keeps [-1, 0] where its slope is at most 2, and its core is chaotic; `rest` attracts [0, 1].
    """

    slope: float = 1.9
    factor: float = 0.5
    rest: float = 0.6


def _two(params: Two, x: float, side: int) -> tuple[float, int, int]:
    if x >= 0.0:
        return params.rest + params.factor * (x - params.rest), side, 2
    if x > -0.5:
        return -1.0 - params.slope * x, side, 1
    return -1.0 + params.slope * (x + 1.0), side, 0


def _two_on(params: Two, x: float, side: int, branch: int) -> tuple[float, int]:
    if branch == 2:
        return params.rest + params.factor * (x - params.rest), side
    if branch == 1:
        return -1.0 - params.slope * x, side
    return -1.0 + params.slope * (x + 1.0), side


ls.register(Two, image=_two, image_on=_two_on, branches=("left", "right", "rest"))


class Grazing(NamedTuple):
    """x' = slope x + offset, and from `jump` on 1/2 more, on one branch: a jump that no code tells.

    Known answers: with slope 1/2, offset 0 and jump in (0, 1) the fixed points 0 and 1 attract what lies below and
    above `jump`; without a jump the fixed point is offset / (1 - slope).
    """

    jump: float = 0.3
    slope: float = 0.5
    offset: float = 0.0


def _grazing(params: Grazing, x: float, side: int) -> tuple[float, int, int]:
    return params.slope * x + params.offset + (0.5 if x >= params.jump else 0.0), side, 0


def _grazing_on(params: Grazing, x: float, side: int, branch: int) -> tuple[float, int, float]:
    return params.slope * x + params.offset + (0.5 if x >= params.jump else 0.0), side, params.slope


ls.register(Grazing, image=_grazing, image_on=_grazing_on)


def tongue_of(omega: float, coupling: float, rotation: float, longest: int = 16) -> tuple[int, int] | None:
    """Rotation number p/q of the circle map where it is locked with q of at most `longest`, else None.

    Locked where F^q(x) - x - p takes both signs, F the lift; p = -1 where that is too near to tell.
    """
    for q in range(1, longest + 1):
        p = round(q * rotation)
        if abs(q * rotation - p) > 1e-3 * q:
            continue
        x = np.arange(400 * q) / (400 * q)
        y = x.copy()
        for _ in range(q):
            y += omega - coupling / math.tau * np.sin(math.tau * y)
        least, most = float((y - x - p).min()), float((y - x - p).max())
        if least < -1e-9 and most > 1e-9:
            return p, q
        if least < 1e-6 and most > -1e-6:
            return -1, q
    return None


def rotations(omegas: Any, coupling: float, steps: int = 20_000) -> Any:
    """Rotation numbers of circle maps, by their lifts: within 1/steps."""
    x = np.zeros_like(omegas)
    for _ in range(steps):
        x += omegas - coupling / math.tau * np.sin(math.tau * x)
    return x / steps
