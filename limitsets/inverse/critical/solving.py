"""Root finding for critical points: scipy's trust region with our Jacobian, then continuation, then other starts.

An impossible scene (a part that tips over on one of its sides) and a scene without a wanted critical point have no
residual; the trust region treats nan as a step too far and shrinks.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.inverse.critical.trials import Trial, TrialLog

Array = npt.NDArray[np.float64]

REACHED = 1e-9
"""A critical point this near to its target is there [length]."""
# A stage of a continuation only has to lead on.
STAGE = 1e-6
MOST, MOST_OF_STAGE = 60, 12
SHORTEST = 1.0 / 64.0
# Draws of one start until one has all the critical points that are wanted.
DRAWS = 25


class Solution(NamedTuple):
    """Where a search came to.

    Parameters
    ----------
    trial : Trial or None
        The last scene.
    path : list of Trial
        Scenes on the way, the first included.
    reached : bool
        Whether its critical points are the goal.
    """

    trial: Trial | None
    path: list[Trial]
    reached: bool


def solved(
    search: TrialLog, start: Array, goal: Array, most: int = MOST, within: float = REACHED
) -> Solution:
    """Bring the critical points to a goal from a start, by least squares within bounds.

    Parameters
    ----------
    search : TrialLog
        What is varied.
    start : ndarray, shape (k,)
        Where to begin, as the solver sees it; inside the bounds.
    goal : ndarray, shape (m,)
        The critical points wanted.
    most : int
        Most steps.
    within : float
        What counts as reached.
    """
    from scipy.optimize import least_squares  # lazily: an import of ours loads numpy only

    first = search.at(start)
    if first is None:
        return Solution(None, [], False)
    before = search.evaluations
    none = np.full(goal.size, np.nan)

    def residual(seen: Array) -> Array:
        trial = search.at(seen)
        return none if trial is None else trial.x - goal

    def slope(seen: Array) -> Array:
        trial = search.at(seen)
        assert trial is not None
        return trial.slope

    if not np.abs(first.x - goal).max() <= within:
        # gtol bounds slope^T residual: with slopes of 1 to 100 the residual is far below `within` then
        least_squares(
            residual,
            start,
            slope,
            bounds=(search.unknowns.lo, search.unknowns.hi),
            ftol=None,
            xtol=1e-13,
            gtol=1e-2 * within,
            max_nfev=most,
        )
    path = [first]
    for trial in search.trials[before:]:
        nearer = ((trial.x - goal) ** 2).sum() < ((path[-1].x - goal) ** 2).sum()
        if nearer and search.is_whole(trial):
            path.append(trial)
    return Solution(path[-1], path, bool(np.abs(path[-1].x - goal).max() <= within))


def continued(search: TrialLog, first: Trial, step: float) -> Solution:
    """Move the goal from where the critical points are to where they shall be, and follow it (homotopy).

    Parameters
    ----------
    search : TrialLog
        What is varied and wanted.
    first : Trial
        Where to begin.
    step : float
        First step, as a share of the way; halved where a stage is not reached.
    """
    path, share = [first], 0.0
    while share < 1.0 and step >= SHORTEST:
        search.step, search.of = "continuation", (int(64.0 * share), 64)
        to = 1.0 if share + step > 1.0 - 1e-9 else share + step
        last, goal = path[-1], first.x + to * (search.wanted - first.x)
        within = REACHED if to == 1.0 else STAGE
        ahead = last.at + np.linalg.pinv(last.slope) @ (goal - last.x)
        start = search.unknowns.inside(ahead)
        if search.at(start) is None:
            start = last.at
        found = solved(search, start, goal, MOST_OF_STAGE, within)
        if found.reached and found.trial is not None:
            path, share = [*path, found.trial], to
        else:
            step *= 0.5
    return Solution(path[-1], path, share == 1.0)


def staged(search: TrialLog, first: Trial, count: int) -> Solution:
    """Continue in a number of equal stages, each of which is in the path."""
    path, begin, wanted = [first], first.x, search.wanted
    try:
        for stage in range(1, count + 1):
            search.wanted = wanted if stage == count else begin + stage / count * (wanted - begin)
            found = continued(search, path[-1], 1.0)
            if not found.reached or found.trial is None:
                return Solution(path[-1], path, False)
            path.append(found.trial)
    finally:
        search.wanted = wanted
    return Solution(path[-1], path, True)


def restarted(search: TrialLog, center: Array, spread: float, random: np.random.Generator) -> Solution:
    """Solve from a start drawn around a place."""
    for _ in range(DRAWS):
        start = search.unknowns.inside(center + spread * random.standard_normal(center.size))
        if search.at(start) is not None:
            return solved(search, start, search.wanted)
    return Solution(None, [], False)
