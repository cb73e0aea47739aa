"""Effect `spread`: speed and landing place differ at every throw.

    w' = w (1 + delta),  so kappa' = kappa / (1 + delta)^2;        R' = R' of that throw + e

`bounded`: delta and e anywhere in their intervals, drawn evenly when an orbit is followed; a proof takes the whole
interval (`certify` does for a scene with this effect).  `gaussian`: normal, with these standard deviations.  What throw
number t of start number s draws depends on the seed, on s and on t alone.  The image of a point asked for by itself is
that of the throw without scatter; the enclosed image of a cell holds all of them.  Source: docs/model.md, effects.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.base import MapError
from limitsets.feeder.thrower.motion import (
    Effect,
    Face,
    FullSide,
    FullThrow,
    at_kappa,
    declare,
    encloses,
    moved,
    moved_box,
    thrown_box,
    varied,
)
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import generic, kernel, proof_kernel, with_entry
from limitsets.systems.maps.drivers import normal_pair, uniform_pair


class Even(NamedTuple):
    """Anywhere between the bounds, equally likely."""

    bound: float = 1.0


class Normal(NamedTuple):
    """Normal, with the given numbers as standard deviations."""

    bound: float = math.inf


class Spread(NamedTuple):
    """How speed and landing place scatter.

    Attributes
    ----------
    law : Even or Normal
        How they are distributed.
    speed : float
        Largest, or standard, relative deviation of the angular speed.
    landing : float
        Largest, or standard, deviation of the landing place [length].
    seed : float
        A whole number; the same seed gives the same throws.
    shift : float
        By how much this throw's landing place deviates [length].
    """

    law: Any
    speed: float
    landing: float
    seed: float = 0.0
    shift: float = 0.0


@generic
def drawn(law: Any, seed: int, start: int, step: int) -> tuple[float, float]:
    """Return two independent deviations, in units of the largest or the standard one."""


@kernel
def _even(law: Any, seed: int, start: int, step: int) -> tuple[float, float]:
    u, v = uniform_pair(seed, start, step)
    return 2.0 * u - 1.0, 2.0 * v - 1.0


@kernel
def _normal(law: Any, seed: int, start: int, step: int) -> tuple[float, float]:
    return normal_pair(seed, start, step)


drawn.on(Even, _even)
drawn.on(Normal, _normal)


@kernel
def _moved(spread: Spread, shift: float, part: FullSide, face: Face) -> float:
    """Return the displacement of a throw with what its landing place deviates by."""
    return shift + spread.shift


@kernel
def _varied(spread: Spread, params: FullThrow, start: int, step: int) -> FullThrow:
    """Return the map of throw number `step` of start number `start`."""
    speed, landing = drawn(spread.law, int(spread.seed), start, step)
    factor = 1.0 + spread.speed * speed
    thrown = Spread(spread.law, spread.speed, spread.landing, spread.seed, spread.landing * landing)
    return FullThrow(
        at_kappa(params.bare, params.bare.kappa / (factor * factor)),
        params.outline,
        with_entry(params.effects, thrown),
    )


@proof_kernel
def _thrown_box(spread: Spread, kappa: Interval) -> Interval:
    """kappa / (1 + delta)^2 for all the deviations of the speed."""
    factor = Interval(1.0, 1.0) + Interval(-spread.speed, spread.speed)
    return kappa / factor**2


@proof_kernel
def _moved_box(spread: Spread, x: Interval) -> Interval:
    """Widen a place of rest by what a landing deviates by."""
    return x + Interval(-spread.landing, spread.landing)


def _of(world: Any, how: str) -> Spread:
    speed, landing = world.scatter.speed, world.scatter.landing
    if speed is not None and not speed.relative:
        raise MapError(
            "the scatter of the speed", f"{speed.value} rad/s", "a share", "give it in percent of the speed"
        )
    law = Even() if how == "bounded" else Normal()
    return Spread(law, 0.0 if speed is None else speed.value, 0.0 if landing is None else landing.value)


def _bounded(spread: Spread) -> bool:
    return spread.law.bound < math.inf  # type: ignore[no-any-return]  # laws are Any


varied.on(Spread, _varied)
moved.on(Spread, _moved)
encloses.on(Spread, _bounded)
thrown_box.on(Spread, _thrown_box)
moved_box.on(Spread, _moved_box)
declare(
    Effect(
        "spread", Spread, _of, "every throw is like the other", ("scatter",), words=("bounded", "gaussian")
    )
)
