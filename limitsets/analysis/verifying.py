"""The error of the ends reached, determined independently of the method.

End points are compared with proved brackets (`limitsets.proofs.end_points`); borders of cells, which contain the limit
set as far as sampled images show, with an orbit, which lies inside.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from limitsets.analysis.accuracy import CELLS, FEWEST, Accuracy, Plan
from limitsets.errors import LimitsetsError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from limitsets.scene import Scene
    from limitsets.sets import Attractor, LimitSet

# The orbit that brackets the ends from inside: throws at a time, how often, and bins per interval to tell holes.
THROWS, ROUNDS, MOST_BINS = 1_000_000, 20, 2_000_000


def _proved(scene: Scene, limits: Sequence[LimitSet]) -> float:
    """Largest distance of an end from either of the two proved numbers around it; infinite without such."""
    from limitsets.proofs.attraction import attraction
    from limitsets.proofs.cover import cover
    from limitsets.proofs.end_points import proved_ends
    from limitsets.proofs.parameters import parameter_box

    if scene.effects.on():  # end points are proved of the minimal map alone
        return math.inf
    try:
        known = proved_ends(attraction(cover(parameter_box(scene), FEWEST))).ends
    except LimitsetsError:  # of this scene nothing can be proved
        return math.inf
    worst = 0.0
    for end in (end for limit in limits for end in limit.ends):
        around = [
            max(abs(end.x - one.outer), abs(end.x - one.inner))
            for one in known
            if one.side == end.side and one.which == end.which and one.inner is not None
        ]
        worst = max(worst, min(around, default=math.inf))
    return worst


class _Visited:
    """What of an interval an orbit has seen, to within a bin."""

    def __init__(self, side: int, lo: float, hi: float, width: float) -> None:
        self.side, self.lo, self.hi = side, lo, hi
        self.bins = np.zeros(int(min(max((hi - lo) / width, 4.0), MOST_BINS)), dtype=bool)
        self.least, self.most = math.inf, -math.inf

    def add(self, x: NDArray[np.float64]) -> None:
        """Mark where the states lie."""
        inside = x[(x >= self.lo) & (x <= self.hi)]
        if inside.size:
            place = (inside - self.lo) / (self.hi - self.lo) * self.bins.size
            self.bins[np.minimum(place.astype(np.int64), self.bins.size - 1)] = True
            self.least, self.most = min(self.least, inside.min()), max(self.most, inside.max())

    def gap(self) -> float:
        """Largest distance of a point of the interval from the orbit, or a bin more."""
        seen = np.flatnonzero(self.bins)
        if not seen.size:
            return math.inf
        width = (self.hi - self.lo) / self.bins.size
        hole = float((np.diff(seen).max(initial=1) - 1) * 0.5 + 1.0) * width
        return float(max(self.least - self.lo, self.hi - self.most, hole))


def _from_inside(scene: Scene, attractor: Attractor, asked: float) -> float:
    """Distance of the cells from an orbit inside, which is followed until it is small enough."""
    from limitsets.maps import orbit

    parts = [
        _Visited(side, lo, hi, asked / 4.0)
        for side, pairs in sorted(attractor.extents.items())
        for lo, hi in pairs
    ]
    start = max(parts, key=lambda part: part.hi - part.lo)
    x, side, gap = 0.5 * (start.lo + start.hi), start.side, math.inf
    for _ in range(ROUNDS):
        path = orbit(scene.map, x, side, THROWS)
        settled = slice(min(1000, path.x.size - 1), None)
        for part in parts:
            part.add(path.x[settled][path.side[settled] == part.side])
        gap = max(part.gap() for part in parts)
        if gap <= asked or path.stopped:
            break
        x, side = float(path.x[-1]), int(path.side[-1])
    return gap


def verified(
    scene: Scene, plan: Plan, attractors: Sequence[Attractor], limits: Sequence[LimitSet], seconds: float
) -> Accuracy:
    """Find what error was reached, by means that the method itself did not use.

    Parameters
    ----------
    scene : Scene
        The scene.
    plan : Plan
        What was picked.
    attractors, limits : sequence of Attractor, of LimitSet
        What was found.
    seconds : float
        What finding it took.

    Returns
    -------
    Accuracy
    """
    if not attractors:
        return Accuracy(plan, seconds, None, "nothing stays", "there are no ends: no limit set was found")
    if plan.chosen.method == CELLS or not all(limit.converged for limit in limits):
        reached = max(_from_inside(scene, each, plan.error_wanted) for each in attractors)
        enough = reached <= plan.error_wanted
        advice = (
            None if enough else f"more cells, or an error from {reached:.1g} {plan.unit}, can be asked for"
        )
        return Accuracy(plan, seconds, reached, "orbit", advice)
    proved = _proved(scene, limits)
    rounding = max(end.error for limit in limits for end in limit.ends)
    reached, how = (proved, "proved") if proved <= plan.error_wanted else (rounding, "rounding")
    advice = None if reached <= plan.error_wanted else f"rounding leaves about {reached:.1g} {plan.unit}"
    return Accuracy(plan, seconds, reached, how, advice, proved if math.isfinite(proved) else None)
