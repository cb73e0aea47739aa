"""Trials of the machines that a film leaves possible: each of those drawn throws its own parts."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.base import Progress, as_table, silent
from limitsets.base.arrays import Array
from limitsets.cell.feeding.falling import ArmEnd, arm_end_of
from limitsets.cell.feeding.trials import Trials, run_trials
from limitsets.feeder.scattering import Scattering
from limitsets.feeder.scene import LaidLike
from limitsets.parameters.margins.machines import Machines

MACHINES = 200
"""Machines drawn: the 5 % quantile of their shares then has ten below it."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """What machines drawn from a fit feed; sampled.

    Attributes
    ----------
    right : ndarray, shape (n,)
        Share that each machine feeds rightly, of its parts that are not thrown at the edge; nan where all are.
    parts : int
        Thrown by each.
    """

    right: Array
    parts: int

    def sentence(self) -> str:
        """Put the machines in words."""
        low, least = float(np.nanquantile(self.right, 0.05)), float(np.nanmin(self.right))
        return (
            f"{self.right.size} machines drawn from the fit, {self.parts} parts each: of those not thrown at the edge"
            f" 95 % of the machines feed {100 * low:.2f} % or more rightly, the worst {100 * least:.2f} % (sampled)"
        )

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        return as_table(parts=self.parts, right=self.right)


def drawn_trials(
    machines: Machines,
    end: ArmEnd,
    scatter: Scattering,
    count: int,
    *,
    laid: LaidLike | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> tuple[Trials, Drawn]:
    """Throw parts with machines drawn from a fit, as many with each.

    Parameters
    ----------
    machines : Machines
        The fit's.
    end : ArmEnd
        Of the most likely machine (`Machines.on`).
    scatter : Scattering
        The noise of every throw.
    count : int
        Parts of all machines together, rounded up to as many for each.
    laid : mapping, optional
        Where parts are laid down, as in `limitsets.feed`.
    seed : int
        Of machines, starts and noise.
    progress : callable, optional
        Told (stage, done, all).
    """
    number = min(MACHINES, count)
    parts = -(-count // number)
    seeds = np.random.SeedSequence(seed).generate_state(number).tolist()
    trials: list[Trials] = []
    for own, scene in zip(seeds, machines.drawn(end.scene, number, seed), strict=True):
        (progress or silent)("machines of the fit", len(trials), number)
        trials.append(run_trials(arm_end_of(scene, end.side, laid), scatter, parts, seed=own))
    counts = [each.counts for each in trials]
    right = np.array([each["right"] / ((parts - each["edge"]) or math.nan) for each in counts])
    fate, throws, beyond = (
        np.concatenate([getattr(each, n) for each in trials]) for n in ("fate", "throws", "beyond")
    )
    return Trials(fate, throws, beyond, seed), Drawn(right, parts)
