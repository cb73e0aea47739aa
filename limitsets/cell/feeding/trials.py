"""Trials as experimenters make them, until parts fall in or leave the arm, and the shares of all fates among them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from limitsets.base import Progress, as_table, silent
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.cell.feeding.falling import FATES, ArmEnd
from limitsets.feeder.scattering import Scattering, still_map
from limitsets.parameters.noise.sampling import ManyParts, binomial_interval, scattering_map

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

    fate: Ints
    throws: Ints
    beyond: Mask
    seed: int

    @cached_property
    def counts(self) -> dict[str, int]:
        """How many met each fate."""
        return dict(zip(FATES, np.bincount(self.fate, minlength=len(FATES)).tolist(), strict=True))

    @cached_property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """Intervals of the probabilities of each fate, 95 %."""
        return {name: binomial_interval(count, self.fate.size) for name, count in self.counts.items()}

    def series(self) -> Ints:
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


def creeping_below(end: ArmEnd, scatter: Scattering) -> Array:
    """By side the x below which a part creeps to the joint and never comes there; a_i where none does.

    With the arm's surface above the joint a start just beyond a_i keeps the share 1 - 2 h/kappa of its distance at
    every throw of the minimal model, whatever the speed (docs/model.md, "Conventions": near a_i).  Noise of the landing
    place takes it off the arm.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.cell.feeding.falling import arm_end_of
    >>> from limitsets.robust import Scattering
    >>> end = arm_end_of(ls.load("paper-triangle"))  # the surface lies below the joint
    >>> bool((creeping_below(end, Scattering()) == end.scene.sides.a).all())
    True
    """
    scene, a = end.scene, end.scene.sides.a
    creeps = scatter.landing is None and 0.0 < 2.0 * scene.surface_height < scene.kappa
    return a * (1.0 + AT_JOINT) if creeps and not hasattr(still_map(scene), "bare") else a


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
    progress: Progress | None = None,
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
    a, right = end.scene.sides.a, end.scene.sides.right
    for first in range(0, count, BLOCK):
        last = min(first + BLOCK, count)
        waiting = np.arange(first, last)
        many = ManyParts(params, *end.drawn(random, waiting.size), drawn)
        for number in range(1, MOST_THROWS + 1):
            (progress or silent)("trials", last - waiting.size, count)
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
        drawn = many.drawn
    return Trials(fate, throws, beyond, seed)


# ----------------------------------------------------------------
# Shares of all fates among parts that were thrown, throw by throw; the noise that is too much.


# Factors on the noise of the curve; the speed's deviation stays above this share of the speed, backwards.
FACTORS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)
BACKWARDS = -0.5
HALVINGS = 5
# Parts thrown between two levels of the noise, and throws, at most; the share of both at the levels themselves.
PARTS, THROWS, AT_LEVELS = 100_000, 1e7, 0.2
# Shares of the starts for which `FedShares.to_json` says after how many throws they have ended.
ENDED = (*(round(0.05 * k, 2) for k in range(1, 20)), 0.99, 0.999)


@dataclass(frozen=True, eq=False)
class FedShares:
    """Shares of random starts, as counted in trials; not proved.

    Attributes
    ----------
    trials : Trials
        The parts that were thrown.

    Examples
    --------
    >>> fate, none = np.array([0, 0, 1, 5]), np.zeros(4, dtype=bool)
    >>> found = FedShares(Trials(fate, np.array([1, 3, 2, 20_000]), none, 0))
    >>> found.shares["right"], found.mean_throws, found.quantile(0.75), found.ended.tolist()
    (0.5, 2.0, 3, [0.0, 0.25, 0.5, 0.75])
    """

    trials: Trials

    @property
    def shares(self) -> dict[str, float]:
        """Share of each fate."""
        return {name: count / self.trials.fate.size for name, count in self.trials.counts.items()}

    @property
    def errors(self) -> dict[str, float]:
        """By fate how far its probability may be from the share: the farther end of its 95 % interval."""
        return {
            name: max(share - low, high - share)
            for (name, share), (low, high) in zip(
                self.shares.items(), self.trials.intervals.values(), strict=True
            )
        }

    @cached_property
    def by_throw(self) -> Array:
        """Share that meets each fate of `FATES` but the last, at each throw from the first, shape (n, 5)."""
        fates = len(FATES) - 1
        ended = self.trials.fate < fates
        last = int(self.trials.throws[ended].max(initial=0))
        place = (self.trials.throws[ended] - 1) * fates + self.trials.fate[ended]
        return np.bincount(place, minlength=last * fates).reshape(-1, fates) / ended.size

    @property
    def never(self) -> float:
        """Share that is on the arm still after the last throw made."""
        return self.shares["never"]

    @cached_property
    def _ended(self) -> Ints:
        """How many have ended, by whatever fate, after each number of throws from 0 on."""
        return np.cumsum(np.bincount(self.trials.throws[self.trials.fate < len(FATES) - 1], minlength=1))

    @property
    def ended(self) -> Array:
        """Share that has ended, by whatever fate, after each number of throws from 0 on."""
        return self._ended / self.trials.fate.size

    @property
    def mean_throws(self) -> float:
        """Mean number of throws of those that end; nan where none do."""
        throws = self.trials.throws[self.trials.fate < len(FATES) - 1]
        return float(throws.mean()) if throws.size else math.nan

    def quantile(self, share: float) -> int | None:
        """Throws after which `share` of all starts have ended; None where so many never do."""
        needed = math.ceil(share * self.trials.fate.size - 1e-9)
        return int(np.searchsorted(self._ended, needed)) if 0 < needed <= self._ended[-1] else None

    def per_minute(self, throw_rate: float | None) -> float | None:
        """Parts fed rightly per minute where the next part starts as soon as one has ended; None if one never may."""
        if throw_rate is None or self.never > 0.0:
            return None
        return 60.0 * throw_rate * self.shares["right"] / self.mean_throws


@dataclass(frozen=True, eq=False)
class Curve:
    """Share of right feeds against the level of the noise, as counted in trials; not proved.

    Attributes
    ----------
    factors, right : ndarray, shape (n,)
        Factor on all deviations, and the share fed rightly of the parts that are not thrown at the edge, where no fate
        is simulated.
    wanted : float
        The share asked about.
    level : (float, float) or None
        The smallest factor at which the share falls to what is wanted, between these two: there the 95 % intervals of
        the trials lie above it, and below; None where it does not fall so far, ``(0, 0)`` where it is below without
        noise.
    """

    factors: Array
    right: Array
    wanted: float
    level: tuple[float, float] | None

    def line(self) -> str:
        """Put the level in words."""
        share = f"{100 * self.wanted:g} % of the parts not thrown at the edge"
        if self.level is None:
            least, at = float(self.right.min()), float(self.factors[-1])
            return (
                f"success stays above {share} up to {at:g} times the noise, {100 * least:.2f} % at the least"
            )
        lo, hi = self.level
        if hi == 0.0:
            return f"success is below {share} without noise: {100 * float(self.right[0]):.2f} %"
        return f"success falls to {share} at {lo:.4g} to {hi:.4g} times the noise"


def success_curve(
    end: ArmEnd,
    scatter: Scattering,
    *,
    wanted: float = 0.95,
    factors: Sequence[float] = FACTORS,
    parts: int = PARTS,
    seed: int = 0,
    progress: Progress | None = None,
) -> Curve:
    """Find the least noise, a multiple of the one given, at which only a share of the starts is fed rightly.

    Parameters
    ----------
    end : ArmEnd
        The end of the arm.
    scatter : Scattering
        The noise at a factor of 1.
    wanted : float
        The share.
    factors : sequence of float
        Ascending from 0; those at which the arm might turn half backwards are left out.
    parts : int
        Thrown between two levels; a fifth of them at each level.
    seed : int
        Of starts and noise, the same at every level.
    progress : callable, optional
        Told (stage, done, all).
    """
    reach = 0.0 if scatter.speed is None else scatter.speed.strata(2).lo
    possible = [factor for factor in factors if factor * reach > BACKWARDS]

    def right(factor: float, of: float = 1.0) -> float:
        (progress or silent)("noise levels", len(known), len(possible) + 2 * HALVINGS)
        noise = scatter.scaled(factor)
        count = trials_within(end, noise, max(int(of * parts), 1), of * THROWS, seed=seed)
        made = run_trials(end, noise, count, seed=seed).counts
        fed, decided = made["right"], count - made["edge"]  # of parts thrown at the edge no fate is simulated
        known[factor] = binomial_interval(fed, decided)
        return fed / max(decided, 1)

    known: dict[float, tuple[float, float]] = {}
    shares = [right(factor, AT_LEVELS) for factor in possible]
    first = next((k for k, share in enumerate(shares) if share <= wanted), None)
    if first is None:
        return Curve(np.array(possible), np.array(shares), wanted, None)
    sure = [factor for factor in possible[:first] if known[factor][0] > wanted]
    gone = [factor for factor in possible[first:] if known[factor][1] <= wanted]
    # where the lower end of the interval falls to the share, and where the upper end does
    between = [
        [sure[-1] if sure else 0.0, possible[first]],
        [possible[max(first - 1, 0)], gone[0] if gone else possible[-1]],
    ]
    for end_of, ends in enumerate(between):
        for _ in range(HALVINGS if ends[1] > ends[0] else 0):
            middle = 0.5 * (ends[0] + ends[1])
            right(middle)
            ends[int(known[middle][end_of] <= wanted)] = middle
    return Curve(np.array(possible), np.array(shares), wanted, ((between[0][0], between[1][1])))
