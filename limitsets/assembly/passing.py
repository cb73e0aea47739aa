"""A trial of two parts that pass through each other, as the paper assumes: the throw map alone, and common speeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.assembly.drawing import Draws
from limitsets.assembly.outlines import meet, way_of
from limitsets.assembly.pairing import Pair, Start, are_apart
from limitsets.feeding.falling import FATES, ArmEnd
from limitsets.maps import codes, images
from limitsets.robust.noise.scattering import thrown

MOST_THROWS = 20_000
"""As in `limitsets.feed`."""


@dataclass(frozen=True)
class Passed:
    """What became of both parts.

    Attributes
    ----------
    fates : tuple of str
        Of `limitsets.feeding.FATES`, by part.
    throws : tuple of int
        Throws made until then.
    overlap_at_start : bool
        Whether their outlines overlap before the first throw.
    overlap_at_rest, overlap_in_flight : int
        The first throw after which, and in which, they overlap while both are on the arm; 0 for none.
    """

    fates: tuple[str, str]
    throws: tuple[int, int]
    overlap_at_start: bool
    overlap_at_rest: int
    overlap_in_flight: int

    @property
    def overlaps(self) -> bool:
        """Whether the outlines overlap at any time."""
        return self.overlap_at_start or self.overlap_at_rest > 0 or self.overlap_in_flight > 0

    @property
    def outcome(self) -> str:
        """A word of `limitsets.assembly.assembly_run.OUTCOMES`."""
        if self.fates == ("right", "right"):
            return "assembled" if self.throws[0] < self.throws[1] else "order"
        for word in ("wrong", "wall", "edge", "left"):
            if word in self.fates:
                return word
        return "never"


def pass_through(
    pair: Pair, seed: int, number: int, *, apart: bool = False, starts: tuple[Start, Start] | None = None
) -> Passed:
    """Make one trial: throw both parts, the speed common to both, until each has met its fate.

    Parameters
    ----------
    pair : Pair
        The parts and the noise.
    seed, number : int
        Of the draws.
    apart : bool
        Whether the random starts are those of parts that do not overlap.
    starts : pair of (float, int), optional
        Instead of random ones.
    """
    draws = Draws(pair, seed, number)
    drawn = draws.starts(apart=apart)
    states = list(starts or drawn)
    fates, throws = ["never", "never"], [MOST_THROWS, MOST_THROWS]
    waiting = [0, 1]
    at_start = not are_apart(pair, states)
    at_rest = in_flight = 0
    for throw in range(1, MOST_THROWS + 1):
        deviation, landing = draws.throw()
        factor = (1.0 + deviation) ** -2
        ways = []
        both = len(waiting) == 2
        for k in tuple(waiting):
            end, start = pair.ends[k], states[k]
            params = thrown(end.scene.map)(factor)
            states[k], fate, side = _thrown(end, params, start, landing[k])
            if both and not in_flight:
                ways.append(way_of(end.scene, params, start, side))
            if fate is not None:
                fates[k], throws[k] = fate, throw
                waiting.remove(k)
        if len(ways) == 2 and meet(*ways):
            in_flight = throw
        if len(waiting) == 2 and not at_rest and not are_apart(pair, states):
            at_rest = throw
        if not waiting:
            break
    return Passed((fates[0], fates[1]), (throws[0], throws[1]), at_start, at_rest, in_flight)


def _thrown(end: ArmEnd, params: Any, start: Start, shift: float) -> tuple[Start, str | None, int]:
    """Throw one part: where it lies, its fate if it has met one, and the side it comes to lie on."""
    if end.at_edge(*start):
        return start, "edge", start[1]
    found = images(params, [start[0]], start[1])
    x, side, code = float(found.x[0]) + shift, int(found.side[0]), int(found.code[0])
    scene = end.scene
    if code == codes.OUTSIDE_MODEL or not float(scene.sides.a[side]) < x <= scene.arm_length:
        return (x, side), "left", side
    met = int(end.fate(np.array([x]), np.array([side]))[0])
    return (x, side), None if met < 0 else FATES[met], side
