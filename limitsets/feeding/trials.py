"""Trials as experimenters make them: parts from random starts, thrown until they fall in or leave the arm."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.feeding.falling import FATES, ArmEnd
from limitsets.files import as_table
from limitsets.robust.noise.proportions import binomial_interval
from limitsets.robust.noise.sampling import ManyParts, scattering_map
from limitsets.robust.noise.scattering import Scattering

__all__ = ["PAPER", "SERIES", "Trials", "run_trials"]

SERIES = 20
"""Trials of the paper, each from a random start."""

PAPER = 19
"""So many of them succeeded."""

MOST_THROWS = 20_000


@dataclass(frozen=True, eq=False)
class Trials:
    """What parts did from random starts; sampled.

    Attributes
    ----------
    fate : ndarray of int64, shape (n,)
        Number in `FATES` of what became of each.
    throws : ndarray of int64, shape (n,)
        Throws made until then.
    beyond : ndarray of bool, shape (n,)
        Whether the struck corner lay beyond the end of the arm at any throw: the model has an arm below it there.
    tips : ndarray of bool, shape (n,)
        Whether the impulse of any throw acted beyond the end of the arm, so that the throw itself tips the part over.
    seed : int
        Of starts and noise.
    """

    fate: NDArray[np.int64]
    throws: NDArray[np.int64]
    beyond: NDArray[np.bool_]
    tips: NDArray[np.bool_]
    seed: int

    @property
    def counts(self) -> dict[str, int]:
        """How many met each fate."""
        return dict(zip(FATES, np.bincount(self.fate, minlength=len(FATES)).tolist(), strict=True))

    def series(self) -> NDArray[np.int64]:
        """Right feeds in each series of 20 trials, in the order of the trials; what is left over is left out."""
        whole = self.fate[: self.fate.size // SERIES * SERIES].reshape(-1, SERIES)
        return np.asarray((whole == 0).sum(axis=1), dtype=np.int64)

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        count, series = self.fate.size, self.series()
        return as_table(
            trials=count,
            seed=self.seed,
            counts=self.counts,
            intervals={name: binomial_interval(found, count) for name, found in self.counts.items()},
            mean_throws=float(self.throws.mean()),
            series={
                "of": SERIES,
                "first": int(series[0]) if series.size else None,
                "mean": float(series.mean()) if series.size else math.nan,
                "right": np.bincount(series, minlength=SERIES + 1),
            },
            paper={"right": PAPER, "of": SERIES, "interval": binomial_interval(PAPER, SERIES)},
            corner_beyond_end=float(self.beyond.mean()),
            throw_tips_over_end=float(self.tips.mean()),
        )


def run_trials(
    end: ArmEnd,
    scatter: Scattering,
    count: int,
    *,
    seed: int = 0,
    progress: Callable[[str, int, int], None] | None = None,
) -> Trials:
    """Throw parts from random starts until each has met its fate.

    Parameters
    ----------
    end : ArmEnd
        The end of the arm.
    scatter : Scattering
        The noise of every throw, of laws that counted throws know (`scattering_map`).
    count : int
        Parts.
    seed : int
        Of starts and noise, both counted: the same seed, the same trials.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    Trials
    """
    scene = end.scene
    random = np.random.Generator(np.random.Philox(seed))
    many = ManyParts(scattering_map(scene, scatter, seed), *end.drawn(random, count))
    fate = np.full(count, len(FATES) - 1, dtype=np.int64)
    throws = np.full(count, MOST_THROWS, dtype=np.int64)
    beyond, tips = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    waiting = np.arange(count)
    a, d, right = scene.sides.a, scene.sides.d, scene.sides.right
    for number in range(1, MOST_THROWS + 1):
        if progress is not None:
            progress("trials", count - waiting.size, count)
        # the impulse of the throw acts so far right of the foot of the centre of mass (docs/model.md)
        height = d[many.side]
        shift = (scene.radius_of_gyration**2 + height * (scene.surface_height + height)) / many.x
        tips[waiting] |= many.x + shift > end.x
        code = many.throw()
        # a jog lands on the left corner of its side, a flip on the right corner of the next one
        corner = many.x + np.where(code == 0, -a[many.side], right[many.side])
        beyond[waiting] |= ((code == 0) | (code == 1)) & (corner > end.x)
        met = np.where(code < 0, 3, end.fate(many.x, many.side))
        done = met >= 0
        fate[waiting[done]], throws[waiting[done]] = met[done], number
        many.keep(~done)
        waiting = waiting[~done]
        if not waiting.size:
            break
    return Trials(fate, throws, beyond, tips, seed)
