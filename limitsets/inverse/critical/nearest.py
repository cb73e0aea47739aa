"""The nearest scene: to the targets if they are out of reach, to the start if many scenes reach them.

Both are least squares under constraints (every side rests, bounds, and in the second case the targets), which scipy's
SLSQP solves; if a scene cannot be computed, constraints are extrapolated linearly from the last one that could.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.inverse.critical.solving import REACHED
from limitsets.inverse.critical.trials import Trial, TrialLog

Array = npt.NDArray[np.float64]

MOST = 60
# A centre of mass this near to standing over an edge, as a share of the part's size, is taken to be as near as it may.
KEPT = 1e-3
NEWTONS = 6


class _Model:
    """Critical points and slacks around a place; in a straight line from the last scene where there is none."""

    def __init__(self, search: TrialLog, base: Trial) -> None:
        self.search, self.base = search, base
        self.kept = KEPT * float(np.ptp(search.scene.vertices, axis=0).max())

    def look(self, seen: Array) -> tuple[Trial, bool]:
        trial = self.search.at(seen)
        if trial is not None:
            self.base = trial
        return self.base, trial is not None

    def x(self, seen: Array) -> Array:
        base, _ = self.look(seen)
        return np.asarray(base.x + base.slope @ (seen - base.at) - self.search.wanted)

    def x_slope(self, seen: Array) -> Array:
        return self.look(seen)[0].slope

    def slack(self, seen: Array) -> Array:
        base, _ = self.look(seen)
        return np.asarray(base.found.slack + self.slack_slope(seen) @ (seen - base.at) - self.kept)

    def slack_slope(self, seen: Array) -> Array:
        base, _ = self.look(seen)
        return np.asarray(base.found.slack_matrix * self.search.rates(base))


def _minimised(model: _Model, start: Trial, cost: Any, slope: Any, more: list[dict[str, Any]]) -> None:
    from scipy.optimize import minimize

    unknowns = model.search.unknowns
    rests = {"type": "ineq", "fun": model.slack, "jac": model.slack_slope}
    minimize(
        cost,
        start.at,
        jac=slope,
        method="SLSQP",
        bounds=list(zip(unknowns.lo, unknowns.hi, strict=True)),
        constraints=[rests, *more],
        options={"maxiter": MOST, "ftol": 1e-14},
    )


def nearest_to_targets(search: TrialLog, start: Trial) -> Trial:
    """Come as near to targets that are not reached as the constraints let."""
    model = _Model(search, start)
    worst = 10.0 * float(((start.x - search.wanted) ** 2).sum())

    def cost(seen: Array) -> float:
        _, there = model.look(seen)
        return float((model.x(seen) ** 2).sum()) if there else worst

    def slope(seen: Array) -> Array:
        return np.asarray(2.0 * model.x(seen) @ model.x_slope(seen))

    search.step, search.of = "the nearest", (0, 1)
    _minimised(model, start, cost, slope, [])
    return search.best() or start


def nearest_to_start(search: TrialLog, reached: Trial, center: Array) -> Trial:
    """Of all scenes that reach the targets, find the one nearest to where the search began."""
    model = _Model(search, reached)
    equal = {"type": "eq", "fun": model.x, "jac": model.x_slope}

    def cost(seen: Array) -> float:
        return float(((seen - center) ** 2).sum())

    def slope(seen: Array) -> Array:
        return np.asarray(2.0 * (seen - center))

    search.step, search.of = "the nearest to the start", (0, 1)
    before = search.evaluations
    _minimised(model, reached, cost, slope, [equal])
    near = [trial for trial in search.trials[before:] if search.is_whole(trial) and search.cost(trial) < 1e-2]
    for trial in sorted(near, key=lambda each: cost(each.at) + search.cost(each))[:3]:
        found = _tightened(search, trial)
        if found is not None and cost(found.at) < cost(reached.at):
            return found
    return reached


def _tightened(search: TrialLog, trial: Trial) -> Trial | None:
    """Newton's steps of least length to the targets."""
    for _ in range(NEWTONS):
        if search.cost(trial) <= 0.01 * REACHED:
            break
        step = np.linalg.pinv(trial.slope) @ (search.wanted - trial.x)
        after = search.at(search.unknowns.inside(trial.at + step))
        if after is None or search.cost(after) >= search.cost(trial):
            break
        trial = after
    return trial if search.cost(trial) <= REACHED else None
