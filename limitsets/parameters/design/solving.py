"""Root finding for critical points by our Jacobian, continuation and other starts; or the nearest scene.

An impossible scene (a part that tips over on one of its sides) and a scene without a wanted critical point have no
residual; the trust region treats nan as a step too far and shrinks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError, LimitsetsError, Progress, silent
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.scene import Scene
from limitsets.feeder.scene.quantities import find, in_units
from limitsets.parameters.design.derivatives import (
    CriticalJacobian,
    critical_jacobian,
    is_share,
    present,
    with_present,
)

# ----------------------------------------------------------------
# The varied quantities of a design, scaled for the solver.
#
# Positive quantities (speed, kappa, gravity, masses, sides, radius of gyration) are scaled by their logarithm, places
# and heights by the size of the part, the tilt in radians: a step of 0.1 is then comparable for all, and "nearest" is
# well defined.


# No search goes farther than by this factor's logarithm.
FARTHEST = 20.0

Bounds = Mapping[str, Sequence[Any]]


@dataclass(frozen=True, eq=False)
class Unknowns:
    """Names, bounds and scales of what is varied.

    Attributes
    ----------
    names : tuple of str
        The quantities.
    start : ndarray, shape (k,)
        Their values in the scene that the search starts from, in its units.
    logs : ndarray of bool, shape (k,)
        Whether a quantity is seen by its logarithm.
    scale : ndarray, shape (k,)
        What a step of 1 is for the others [their units].
    lo, hi : ndarray, shape (k,)
        Bounds, as the solver sees them.
    """

    names: tuple[str, ...]
    start: Array
    logs: Mask
    scale: Array
    lo: Array
    hi: Array

    def seen(self, values: Array) -> Array:
        """Return the solver's numbers for values in the scene's units."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.logs, np.log(values / np.abs(self.start)), values / self.scale)

    def values(self, seen: Array) -> Array:
        """Return values in the scene's units."""
        shares = np.exp(np.clip(np.where(self.logs, seen, 0.0), -FARTHEST, FARTHEST))
        return np.where(self.logs, np.abs(self.start) * shares, seen * self.scale)

    def inside(self, seen: Array) -> Array:
        """Move numbers to the nearest within bounds."""
        return np.clip(seen, self.lo, self.hi)


def unknowns_of(scene: Scene, names: Sequence[str], bounds: Bounds | None) -> Unknowns:
    """Read what may be varied, and between which bounds.

    Parameters
    ----------
    scene : Scene
        Where the search starts.
    names : sequence of str
        Quantities.
    bounds : mapping of str to (lo, hi), optional
        Numbers in the scene's units, text with a unit, or None for no bound.

    Returns
    -------
    Unknowns

    Raises
    ------
    SceneError, AnswerError
        An unknown quantity or one that is not varied, or bounds that are not in order.
    """
    given = dict(bounds or {})
    for name in given:
        find(name)
        if name not in names:
            raise AnswerError("the bounds", name, ", ".join(names), "bound a quantity that is varied")
    size = float(np.ptp(scene.vertices, axis=0).max())
    start = np.array([present(scene, name) for name in names])
    logs = np.array([_is_positive(name) for name in names])
    scale = np.array([1.0 if find(name).dimension == "angle" else size for name in names])
    unbounded = Unknowns(tuple(names), start, logs, scale, start, start)
    pairs = [_pair(scene, name, given.get(name)) for name in names]
    ends = [unbounded.seen(np.array([pair[end] for pair in pairs])) for end in (0, 1)]
    return Unknowns(tuple(names), start, logs, scale, *ends)


def _is_positive(name: str) -> bool:
    return is_share(name) or name == "part.mass.radius_of_gyration" or name.startswith("part.sides")


def _pair(scene: Scene, name: str, given: Sequence[Any] | None) -> tuple[float, float]:
    """Read the bounds of one quantity; those that are always there keep it a quantity of its kind."""
    always = {"gravity.tilt": (0.0, 0.5 * math.pi)}
    least, most = always.get(name, (0.0 if _is_positive(name) else -math.inf, math.inf))
    if given is None:
        return least, most
    if isinstance(given, str) or len(given) != 2:
        raise AnswerError(
            f"the bounds of {name}", given, "(lowest, highest), None for no bound", "give a pair"
        )
    ends = [None if end is None else in_units(scene.unit, name, end, key=name) for end in given]
    lo, hi = (other if end is None else end for end, other in zip(ends, (least, most), strict=True))
    lo, hi = max(lo, least), min(hi, most)
    if not lo < hi:
        raise AnswerError(f"the bounds of {name}", given, "the lowest below the highest", "correct them")
    return lo, hi


# ----------------------------------------------------------------
# The log of a search: each scene is computed once, counted, and stored in order.


class Trial(NamedTuple):
    """One scene on the way.

    Parameters
    ----------
    at : ndarray, shape (k,)
        Where, as the solver sees it.
    jacobian : CriticalJacobian
        Its critical points and their derivatives by the quantities.
    x : ndarray, shape (m,)
        Critical points that have a target.
    slope : ndarray, shape (m, k)
        Their derivatives as the solver sees them.
    """

    at: Array
    jacobian: CriticalJacobian
    x: Array
    slope: Array

    @property
    def whole(self) -> bool:
        """Whether all that is wanted is there, with derivatives."""
        return bool(np.isfinite(self.slope).all() and np.isfinite(self.x).all())

    def square_from(self, goal: Array) -> float:
        """Squared distance of the critical points from where they are wanted."""
        return float(((self.x - goal) ** 2).sum())


class TrialLog:
    """What is varied and wanted, and all that has been computed.

    Parameters
    ----------
    scene : Scene
        Where the search starts.
    unknowns : Unknowns
        What is varied.
    targets : sequence of float or None
        Per side; None is free.
    progress : callable, optional
        Told ``(step, done, of)`` at every evaluation.
    """

    def __init__(
        self,
        scene: Scene,
        unknowns: Unknowns,
        targets: Sequence[float | None],
        progress: Progress | None = None,
    ) -> None:
        self.scene, self.unknowns = scene, unknowns
        self.sides = [side for side, target in enumerate(targets) if target is not None]
        self.wanted = np.array([target for target in targets if target is not None], dtype=np.float64)
        self.progress, self.step, self.of = progress or silent, "critical points", (0, 1)
        self.trials: list[Trial] = []
        self._known: dict[bytes, Trial | None] = {}

    @property
    def evaluations(self) -> int:
        """How often critical points were computed, with their derivatives."""
        return len(self.trials)

    def at(self, seen: Array) -> Trial | None:
        """Compute a scene; None where there can be none, or where a wanted critical point is not there."""
        key = seen.tobytes()
        if key not in self._known:
            self._known[key] = self._computed(np.array(seen))
        return self._known[key]

    def _computed(self, seen: Array) -> Trial | None:
        self.progress(self.step, *self.of)
        values = self.unknowns.values(seen).tolist()
        try:
            scene = with_present(self.scene, dict(zip(self.unknowns.names, values, strict=True)))
        except (LimitsetsError, OverflowError):  # a part that tips over on one of its sides, or cannot be
            return None
        jacobian = critical_jacobian(scene, *self.unknowns.names)
        slope = jacobian.matrix[self.sides] * self.rates(jacobian)
        self.trials.append(Trial(seen, jacobian, jacobian.x[self.sides], slope))
        return self.trials[-1] if self.trials[-1].whole else None

    def require_effect(self, first: Trial | None) -> None:
        """Refuse to vary what no critical point depends on."""
        for k, name in enumerate(self.unknowns.names):
            if first is not None and not np.nan_to_num(first.jacobian.matrix[:, k], nan=1.0).any():
                raise AnswerError(
                    "a quantity to vary",
                    name,
                    "quantities that the critical points depend on",
                    "leave it out (where a throw is given by kappa, gravity is part of that)",
                )

    def rates(self, jacobian: CriticalJacobian) -> Array:
        """Return the derivatives of the quantities by the solver's numbers."""
        return np.where(self.unknowns.logs, jacobian.values, self.unknowns.scale)

    def cost(self, trial: Trial) -> float:
        """Largest distance of a critical point from its target [length]."""
        return float(np.abs(trial.x - self.wanted).max())

    def best(self) -> Trial | None:
        """Return the trial nearest to the targets by least squares, None where no trial has them all."""
        whole = (trial for trial in self.trials if trial.whole)
        return min(whole, key=lambda trial: trial.square_from(self.wanted), default=None)


# ----------------------------------------------------------------
# Root finding for critical points: scipy's trust region with our Jacobian, then continuation, then other starts.


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

    def residual(seen: Array) -> Array:
        trial = search.at(seen)
        return np.full(goal.size, np.nan) if trial is None else trial.x - goal

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
        if trial.whole and trial.square_from(goal) < path[-1].square_from(goal):
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
        start = search.unknowns.inside(last.at + np.linalg.pinv(last.slope) @ (goal - last.x))
        if search.at(start) is None:
            start = last.at
        solution = solved(search, start, goal, MOST_OF_STAGE, within)
        if solution.reached and solution.trial is not None:
            path, share = [*path, solution.trial], to
        else:
            step *= 0.5
    return Solution(path[-1], path, share == 1.0)


def staged(search: TrialLog, first: Trial, count: int) -> Solution:
    """Continue in a number of equal stages, each of which is in the path."""
    path, begin, wanted = [first], first.x, search.wanted
    try:
        for stage in range(1, count + 1):
            search.wanted = wanted if stage == count else begin + stage / count * (wanted - begin)
            solution = continued(search, path[-1], 1.0)
            if not solution.reached or solution.trial is None:
                return Solution(path[-1], path, False)
            path.append(solution.trial)
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


# ----------------------------------------------------------------
# The nearest scene: to the targets if they are out of reach, to the start if many scenes reach them.
#
# Both are least squares under constraints (every side rests, bounds, and in the second case the targets), which scipy's
# SLSQP solves; if a scene cannot be computed, constraints are extrapolated linearly from the last one that could.


MOST_NEAREST = 60
# A centre of mass this near to standing over an edge, as a share of the part's size, is taken to be as near as it may.
KEPT = 1e-3
NEWTONS = 6


class _Model:
    """Critical points and slacks around a place; in a straight line from the last scene where there is none."""

    def __init__(self, search: TrialLog, base: Trial) -> None:
        self.search, self.base = search, base
        self.kept = KEPT * float(np.ptp(search.scene.vertices, axis=0).max())

    def look(self, seen: Array) -> Trial:
        self.base = self.search.at(seen) or self.base
        return self.base

    def x(self, seen: Array) -> Array:
        base = self.look(seen)
        return np.asarray(base.x + base.slope @ (seen - base.at) - self.search.wanted)

    def x_slope(self, seen: Array) -> Array:
        return self.look(seen).slope

    def slack(self, seen: Array) -> Array:
        base = self.look(seen)
        return np.asarray(base.jacobian.slack + self.slack_slope(seen) @ (seen - base.at) - self.kept)

    def slack_slope(self, seen: Array) -> Array:
        base = self.look(seen)
        return np.asarray(base.jacobian.slack_matrix * self.search.rates(base.jacobian))


def _minimised(model: _Model, start: Trial, cost: Any, slope: Any, more: list[dict[str, Any]]) -> None:
    from scipy.optimize import minimize

    unknowns = model.search.unknowns
    minimize(
        cost,
        start.at,
        jac=slope,
        method="SLSQP",
        bounds=list(zip(unknowns.lo, unknowns.hi, strict=True)),
        constraints=[{"type": "ineq", "fun": model.slack, "jac": model.slack_slope}, *more],
        options={"maxiter": MOST_NEAREST, "ftol": 1e-14},
    )


def nearest_to_targets(search: TrialLog, start: Trial) -> Trial:
    """Come as near to targets that are not reached as the constraints let."""
    model = _Model(search, start)
    worst = 10.0 * start.square_from(search.wanted)

    def cost(seen: Array) -> float:
        return worst if search.at(seen) is None else float((model.x(seen) ** 2).sum())

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
    near = [trial for trial in search.trials[before:] if trial.whole and search.cost(trial) < 1e-2]
    for trial in sorted(near, key=lambda each: cost(each.at) + search.cost(each))[:3]:
        nearer = _tightened(search, trial)
        if nearer is not None and cost(nearer.at) < cost(reached.at):
            return nearer
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
