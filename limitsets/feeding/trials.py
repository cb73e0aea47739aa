"""Trials as experimenters make them: parts from random starts, thrown until they fall in or leave the arm."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.feeding.falling import FATES, ArmEnd
from limitsets.files import as_table
from limitsets.robust.noise.proportions import binomial_interval
from limitsets.robust.noise.sampling import ManyParts, scattering_map
from limitsets.robust.noise.scattering import Scattering, still_map

SERIES = 20
"""Trials of a series, each from a random start."""

MOST_THROWS = 20_000
NEVER = FATES.index("never")

# Parts thrown at once: Ctrl-C waits for one throw of all of them.
BLOCK = 1 << 20
# Parts thrown to find how many throws a part takes.
PILOT = 200
# Share of a_i within which a part that creeps to the joint is followed no farther.
AT_JOINT = 1e-9


@dataclass(frozen=True, eq=False)
class Trials:
    """What parts did from random starts; sampled.

    Attributes
    ----------
    fate : ndarray of int64, shape (n,)
        Number in `FATES` of what became of each.
    throws : ndarray of int64, shape (n,)
        Throws made until then, that which acts beyond the end of the arm included.
    beyond : ndarray of bool, shape (n,)
        Whether the struck corner lay beyond the end of the arm at any throw: the model has an arm below it there.
    seed : int
        Of starts and noise.
    """

    fate: NDArray[np.int64]
    throws: NDArray[np.int64]
    beyond: NDArray[np.bool_]
    seed: int

    @cached_property
    def counts(self) -> dict[str, int]:
        """How many met each fate."""
        return dict(zip(FATES, np.bincount(self.fate, minlength=len(FATES)).tolist(), strict=True))

    @cached_property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """Intervals of the probabilities of each fate, 95 %."""
        return {name: binomial_interval(found, self.fate.size) for name, found in self.counts.items()}

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
            intervals=self.intervals,
            mean_throws=float(self.throws.mean()),
            series={
                "of": SERIES,
                "first": int(series[0]) if series.size else None,
                "mean": float(series.mean()) if series.size else math.nan,
                "right": np.bincount(series, minlength=SERIES + 1),
            },
            corner_beyond_end=float(self.beyond.mean()),
        )


def creeping_below(end: ArmEnd, scatter: Scattering) -> NDArray[np.float64]:
    """By side the x below which a part creeps to the joint and never comes there; a_i where none does.

    With the arm's surface above the joint a start just beyond a_i keeps the share 1 - 2 h/kappa of its distance at
    every throw of the minimal model, whatever the speed (docs/model.md, "Conventions": near a_i).  Noise of the landing
    place takes it off the arm.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.feeding.falling import arm_end_of
    >>> from limitsets.robust import Scattering
    >>> end = arm_end_of(ls.load("paper-triangle"))  # the surface lies below the joint
    >>> bool((creeping_below(end, Scattering()) == end.scene.sides.a).all())
    True
    """
    scene, a = end.scene, end.scene.sides.a
    minimal = not hasattr(still_map(scene), "bare")
    creeps = minimal and scatter.landing is None and 0.0 < 2.0 * scene.surface_height < scene.kappa
    return a * (1.0 + AT_JOINT) if creeps else a


def trials_within(end: ArmEnd, scatter: Scattering, most: int, throws: float, *, seed: int = 0) -> int:
    """Say how many parts can be thrown with about so many throws, found with 200 parts; `most` at most."""
    if most <= PILOT:
        return most
    pilot = run_trials(end, scatter, PILOT, seed=seed)
    return int(min(most, max(PILOT, throws / float(pilot.throws.mean()))))


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
    random = np.random.Generator(np.random.Philox(seed))
    params, creeping = scattering_map(end.scene, scatter, seed), creeping_below(end, scatter)
    fate = np.full(count, NEVER, dtype=np.int64)
    throws = np.full(count, MOST_THROWS, dtype=np.int64)
    beyond = np.zeros(count, dtype=bool)
    drawn = 0
    for first in range(0, count, BLOCK):
        here = slice(first, min(first + BLOCK, count))
        many = ManyParts(params, *end.drawn(random, here.stop - first), drawn)
        for waiting in _to_their_fates(end, many, creeping, fate[here], throws[here], beyond[here]):
            if progress is not None:
                progress("trials", here.stop - waiting, count)
        drawn = many.drawn
    return Trials(fate, throws, beyond, seed)


def _to_their_fates(
    end: ArmEnd,
    many: ManyParts,
    creeping: NDArray[np.float64],
    fate: NDArray[np.int64],
    throws: NDArray[np.int64],
    beyond: NDArray[np.bool_],
) -> Iterator[int]:
    """Throw parts until each has met its fate, and fill in what is asked of each; before every throw, how many wait."""
    waiting = np.arange(fate.size)
    a, right = end.scene.sides.a, end.scene.sides.right
    for number in range(1, MOST_THROWS + 1):
        yield waiting.size
        edge = end.at_edge(many.x, many.side)
        code = many.throw()
        # a jog lands on the left corner of its side, a flip on the right corner of the next one
        corner = many.x + np.where(code == 0, -a[many.side], right[many.side])
        beyond[waiting] |= ((code == 0) | (code == 1)) & (corner > end.x) & ~edge
        met = np.where(code < 0, FATES.index("left"), end.fate(many.x, many.side))
        met = np.where((met < 0) & (many.x < creeping[many.side]), NEVER, met)
        met[edge] = FATES.index("edge")
        done = met >= 0
        fate[waiting[done]], throws[waiting[done]] = met[done], number
        many.keep(~done)
        waiting = waiting[~done]
        if not waiting.size:
            break
