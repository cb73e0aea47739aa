"""Shares of all fates among parts that were thrown, throw by throw; the noise that is too much."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from limitsets.feeding.falling import FATES, ArmEnd
from limitsets.feeding.trials import Trials, run_trials, trials_within
from limitsets.robust.noise.proportions import binomial_interval
from limitsets.robust.noise.scattering import Scattering

Progress = Callable[[str, int, int], None]

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
    def by_throw(self) -> NDArray[np.float64]:
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
    def _ended(self) -> NDArray[np.int64]:
        """How many have ended, by whatever fate, after each number of throws from 0 on."""
        return np.cumsum(np.bincount(self.trials.throws[self.trials.fate < len(FATES) - 1], minlength=1))

    @property
    def ended(self) -> NDArray[np.float64]:
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

    factors: NDArray[np.float64]
    right: NDArray[np.float64]
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
    tell = progress or (lambda stage, done, of: None)

    def right(factor: float, of: float = 1.0) -> float:
        tell("noise levels", len(known), len(possible) + 2 * HALVINGS)
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
    level = (between[0][0], between[1][1])
    return Curve(np.array(possible), np.array(shares), wanted, level)
