"""Starts told by how far from the foot a_i they are, where a_i is known to a tolerance and landings scatter.

A jog near the foot depends on x - a_i, and hardly on the parameters: where each scene loses hardly more than the starts
nearer than some distance, cells in x lose as many more as a_i is wide.  Found by floats, and confirmed by the checker's
own functions.  docs/certificates.md, "For which starts".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from limitsets.feeder.scene.units import spelled_plainly
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.basin import MOST_UNEXPLAINED, ROUNDING
from limitsets.proofs.prover.certificate import in_certificate

# Halvings of a range of angles, and by which share an angle is moved, so that the checker can confirm it.
HALVINGS, ROOM = 60, 2.0**-20


@dataclass(frozen=True)
class FromFoot:
    """On each side: starts with x - a_i beyond `away` come to the attracting cells, those up to `lost` are lost."""

    away: list[float]
    lost: list[float]

    @classmethod
    def of_all(cls, some: Sequence[FromFoot]) -> FromFoot:
        """Return what holds of the starts of several boxes of parameters."""
        away, lost = zip(*((one.away, one.lost) for one in some), strict=True)
        return cls(
            [max(each) for each in zip(*away, strict=True)], [min(each) for each in zip(*lost, strict=True)]
        )

    @property
    def starts(self) -> dict[str, dict[str, float]]:
        """For which starts a goal holds."""
        return {"from_foot": {str(side): x for side, x in enumerate(self.away)}}

    @property
    def section(self) -> dict[str, Any]:
        """The entries in the section of a goal."""
        away, lost = ({str(side): x.hex() for side, x in enumerate(each)} for each in (self.away, self.lost))
        return {"starts": {"from_foot": away}, "lost": lost}

    def shares_of(self, attraction: Attraction) -> dict[str, float]:
        """Shares of the starts in a box of parameters, whatever the parameters are."""
        lo, hi = attraction.cover.box.bare
        least, most = float((lo.arm_length - hi.a).sum()), float((hi.arm_length - lo.a).sum())
        share = max(0.0, 1.0 - sum(self.away) / least - ROUNDING)
        leaves = max(0.0, sum(self.lost) / most - ROUNDING)
        return {"share": share, "leaves": leaves, "creeps": 0.0, "open": 1.0 - share - leaves + ROUNDING}


def starts_from_foot(attraction: Attraction) -> FromFoot | None:
    """Prove from which distance to the foot on every start comes to the attracting cells; None if that fails.

    Parameters
    ----------
    attraction : Attraction
        Cells and images of a box of parameters, with noise of the landing place.
    """
    box = attraction.cover.box
    if box.effects or not box.landing > 0.0 or not all(box.rests) or find_spec("flint") is None:
        return None
    import flint

    from limitsets.checker.balls import PRECISION, UnprovedError
    from limitsets.checker.file import BadFileError
    from limitsets.checker.scene import read_scene

    with flint.ctx.workprec(PRECISION):
        try:
            scene = read_scene(in_certificate(box.scene), spelled_plainly(dict(box.noise)))
            ends = [_side(scene, side, until) for side, until in enumerate(_first_ranked(attraction))]
        except (BadFileError, UnprovedError):
            return None
    away, lost = map(list, zip(*ends, strict=True))
    return FromFoot(away, lost)


def is_nearly_all(shares: dict[str, float]) -> bool:
    """Whether a goal counts as proved for such starts."""
    return shares["open"] <= MOST_UNEXPLAINED


def _first_ranked(attraction: Attraction) -> list[float]:
    """Find by side where the cells begin of all of which orbits come to the attracting cells."""
    grid, rank = attraction.cover.grid, attraction.basin.rank
    shut = (np.flatnonzero(rank[grid.of_side(side)] < 0) for side in range(grid.sides))
    return [
        float(edges[int(own.max(initial=-1)) + 1]) for (edges,), own in zip(grid.edges, shut, strict=True)
    ]


def _side(scene: Any, side: int, until: float) -> tuple[float, float]:
    """Find and prove on one side from which distance on starts come out, and up to which they are lost."""
    from flint import arb

    from limitsets.checker.balls import UnprovedError, float_above, float_below, reason_of
    from limitsets.checker.model import at_angle
    from limitsets.checker.near_foot import angle_from_foot, check_lost, check_outward, from_foot

    s = scene.sides[side]
    top = angle_from_foot(s, float_above(arb(until) - s.a), scene.k_lo, 1)
    if not s.landing < at_angle(s, top).D:
        raise UnprovedError
    out = _last(lambda p: not s.landing < at_angle(s, arb(p)).D, float(top)) * (1.0 + ROOM)
    away = float_above(from_foot(s, arb(out), scene.k_hi)) * (1.0 + ROOM)
    check_outward(scene, side, until, away)
    kept = _last(lambda p: bool(s.landing > at_angle(s, arb(p)).D), float(top)) * (1.0 - ROOM)
    lost = max(float_below(from_foot(s, arb(kept), scene.k_lo)) * (1.0 - ROOM), 0.0)
    return away, 0.0 if reason_of(check_lost, scene, side, lost, True) else lost


def _last(holds: Callable[[float], bool], top: float) -> float:
    """Return nearly the last angle up to which something holds, which fails at the top."""
    low = 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + top)
        low, top = (middle, top) if holds(middle) else (low, middle)
    return top
