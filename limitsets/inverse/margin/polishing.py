"""The last steps of a robust design: designs near the best one, rated on every corner of the tolerance.

The search knows some corners only and therefore overrates its best design.  Here a design counts as better only if it
is better on all corners.  The margin is the minimum of many smooth numbers, one per corner, so its maximum is a ridge:
scipy's simplex method climbs it, restarted each time with a smaller simplex.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from limitsets.inverse.margin.search import DesignSearch, Tell
from limitsets.robust.margins.estimate import FINE, FINELY, Estimate, estimated, failing, on_all_corners
from limitsets.robust.margins.vector import Signs
from limitsets.scene import Scene

# Edges of the simplex at its starts, in shares of the bounds.
EDGES = (0.02, 0.007, 0.0025)


class _Best:
    """The best design so far, and the corners at which others failed."""

    def __init__(self, search: DesignSearch, made: Callable[[Scene], Scene], tell: Tell, of: int) -> None:
        self.search, self.made, self.tell, self.of = search, made, tell, of
        self.hard: list[Signs] = list(search.hard)
        self.unknowns: list[float] = []
        self.scene: Scene | None = None
        self.found: Estimate | None = None
        self.tried = 0

    def rate(self, unknowns: Sequence[float]) -> float:
        """Rate a design as it would be made: exactly where it is the best, from above where it is not."""
        self.tried += 1
        self.tell("designs near the best", min(self.tried, self.of), self.of)
        scene = self.search.scene_of(unknowns)
        scene = None if scene is None else self.made(scene)
        rating, found = self.search.rated(scene, self._estimate)
        if found is not None and (self.found is None or found.margin > self.found.margin):
            self.unknowns, self.scene, self.found = [float(u) for u in unknowns], scene, found
        return rating

    def _estimate(self, scene: Scene) -> Estimate | None:
        """Estimate a margin; where it may be the best, on all corners."""
        about = scene, self.search.tolerance, self.search.side
        found = estimated(*about, hard=self.hard, steps=FINE, close=FINELY)
        if found is None or not found.margin > (0.0 if self.found is None else self.found.margin):
            return found
        new = [signs for signs in failing(*about, found, found.margin) if signs not in self.hard]
        self.hard[:0] = new
        return on_all_corners(*about, self.hard) if new else found


def polished(
    search: DesignSearch,
    unknowns: Sequence[Sequence[float]],
    made: Callable[[Scene], Scene],
    evaluations: int,
    tell: Tell,
) -> tuple[Scene, Estimate] | None:
    """Improve the best of a few designs, rated as they would be made and on all corners.

    Parameters
    ----------
    search : DesignSearch
        Whose quantities, tolerance and conditions.
    unknowns : sequence of sequence of float
        Where to begin: scaled unknowns, at least one.
    made : callable
        Gives a scene as it would be made: rounded.
    evaluations : int
        Designs to look at.
    tell : callable
        Progress.

    Returns
    -------
    (Scene, Estimate) or None
        The design and its margin, which holds on all corners; None if none of the first ones feeds.
    """
    from scipy.optimize import minimize

    best = _Best(search, made, tell, evaluations)
    for row in unknowns:
        best.rate(row)
    for number, edge in enumerate(EDGES):
        share = (evaluations - best.tried) // (len(EDGES) - number)
        if best.found is None or share < 1:
            break
        minimize(
            lambda row: -best.rate(row),
            best.unknowns,
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * len(best.unknowns),
            options={"initial_simplex": _simplex(best.unknowns, edge), "maxfev": share, "adaptive": True},
        )
    search.evaluations += best.tried
    if best.scene is None or best.found is None:
        return None
    return best.scene, best.found


def _simplex(corner: Sequence[float], edge: float) -> NDArray[np.float64]:
    """Give a simplex at a place: a step along each axis, towards the middle of its bounds."""
    place = np.array(corner)
    return np.vstack([place, place + edge * np.diag(np.where(place < 0.5, 1.0, -1.0))])
