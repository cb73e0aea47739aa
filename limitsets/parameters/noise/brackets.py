"""Proved brackets beside the numbers of the transfer operator: the same noise, goal and starts, the same names."""

from __future__ import annotations

import math

import numpy as np

from limitsets.base import AnswerError, Progress
from limitsets.base.arrays import Array
from limitsets.feeder.scattering import Scattering, Uniform
from limitsets.feeder.scene import Scene
from limitsets.proofs.chances.absorption import absorption_brackets
from limitsets.proofs.chances.long_run import long_run_averages

RIGHT = "right"
# What sums of some hundreds of floats lose at most, as a share.
OF_SUMS = 1e-12


def brackets_beside(
    scene: Scene,
    scatter: Scattering,
    goal: tuple[float, int],
    starts: Array,
    cells: int,
    progress: Progress,
) -> dict[str, tuple[float, float]]:
    """Bound the numbers of `noise_statistics` of which proofs are known; parameters as there, `starts` by side.

    "fed", "lost", "95 % throws" and, with scatter of the landing place, "mean throws" are of the random starts.
    "time on side k", "share of jog" and "share of flip" are of every start in the attracting cells, almost surely:
    where laws are uniform, and where such cells are proved.

    Raises
    ------
    AnswerError
        A law or an effect of which nothing is proved.
    """
    x = goal[0]
    laid = [(side, lo, x) for side, lo in enumerate(starts.tolist()) if lo < x]
    # without scatter of the landing a start next to the joint needs throws without bound
    mean = scatter.landing is not None
    ends = absorption_brackets(
        scene, scatter, right=goal, starts=laid, cells=cells, mean=mean, progress=progress
    )
    first, last = ends.quantile(0.95, RIGHT)
    # the throws at which the share of the fed, drawn as a line between whole throws, crosses 95 %
    proved = {} if first is None or last is None else {"95 % throws": (max(first - 1.0, 0.0), float(last))}
    if ends.ever:
        least, most = ends.ever[RIGHT]
        ended = math.isfinite(ends.mean[1])
        proved |= {"fed": (least, most), "lost": (1.0 - most if ended else 0.0, 1.0 - least)}
        # the mean T of those fed is the sum of P(T > n | fed), and P(T > n, fed) = P(fed) - P(fed within n)
        few = np.maximum(least - ends.within[RIGHT][1], 0.0).sum() * (1.0 - OF_SUMS)
        proved["mean throws"] = float(few), ends.mean[1] / least if least > 0.0 else math.inf
    if all(isinstance(law, Uniform | None) for law in (scatter.speed, scatter.landing)):
        try:
            averages = long_run_averages(scene, scatter, cells=cells, progress=progress).numbers
        except AnswerError:  # no cells attract under this noise
            return proved
        few_flips, many_flips = averages["flips_per_throw"]
        proved |= {
            f"time on side {side}": averages[f"share_of_side_{side}"] for side in range(len(scene.sides))
        }
        proved |= {
            "share of flip": (few_flips, many_flips),
            "share of jog": (1.0 - many_flips, 1.0 - few_flips),
        }
    return proved
