"""The log of a search: each scene is computed once, counted, and stored in order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from limitsets.errors import AnswerError, LimitsetsError
from limitsets.inverse.critical.derivatives import CriticalJacobian, critical_jacobian
from limitsets.inverse.critical.seeded import with_present
from limitsets.inverse.critical.unknowns import Unknowns
from limitsets.scene import Scene

Array = npt.NDArray[np.float64]
Progress = Callable[[str, int, int], None]


class Trial(NamedTuple):
    """One scene on the way.

    Parameters
    ----------
    at : ndarray, shape (k,)
        Where, as the solver sees it.
    found : CriticalJacobian
        Its critical points and their derivatives by the quantities.
    x : ndarray, shape (m,)
        Critical points that have a target.
    slope : ndarray, shape (m, k)
        Their derivatives as the solver sees them.
    """

    at: Array
    found: CriticalJacobian
    x: Array
    slope: Array


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
        self.progress, self.step, self.of = progress, "critical points", (0, 1)
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
        if self.progress is not None:
            self.progress(self.step, *self.of)
        values = self.unknowns.values(seen).tolist()
        try:
            scene = with_present(self.scene, dict(zip(self.unknowns.names, values, strict=True)))
        except (LimitsetsError, OverflowError):  # a part that tips over on one of its sides, or cannot be
            return None
        found = critical_jacobian(scene, *self.unknowns.names)
        slope = found.matrix[self.sides] * self._rates(found)
        self.trials.append(Trial(seen, found, found.x[self.sides], slope))
        return self.trials[-1] if self.is_whole(self.trials[-1]) else None

    def require_effect(self, first: Trial | None) -> None:
        """Refuse to vary what no critical point depends on."""
        for k, name in enumerate(self.unknowns.names):
            if first is not None and not np.nan_to_num(first.found.matrix[:, k], nan=1.0).any():
                raise AnswerError(
                    "a quantity to vary",
                    name,
                    "quantities that the critical points depend on",
                    "leave it out (where a throw is given by kappa, gravity is part of that)",
                )

    def _rates(self, found: CriticalJacobian) -> Array:
        """Return what one step of each of the solver's numbers changes its quantity by."""
        return np.where(self.unknowns.logs, found.values, self.unknowns.scale)

    def rates(self, trial: Trial) -> Array:
        """Return the derivatives of the quantities by the solver's numbers."""
        return self._rates(trial.found)

    def is_whole(self, trial: Trial) -> bool:
        """Whether all that is wanted is there, with derivatives."""
        return bool(np.isfinite(trial.slope).all() and np.isfinite(trial.x).all())

    def cost(self, trial: Trial) -> float:
        """Largest distance of a critical point from its target [length]."""
        return float(np.abs(trial.x - self.wanted).max())

    def best(self) -> Trial | None:
        """Return the trial nearest to the targets by least squares, None where no trial has them all."""
        whole = [trial for trial in self.trials if self.is_whole(trial)]
        return min(whole, key=lambda trial: float(((trial.x - self.wanted) ** 2).sum()), default=None)
