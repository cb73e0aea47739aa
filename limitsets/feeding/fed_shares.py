"""Feeding under noise by the transfer operator: the shares of all fates, throw by throw; the noise that is too much."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.feeding.falling import FATES, ArmEnd
from limitsets.robust.noise.arrivals import cells_for_noise, random_starts, with_border
from limitsets.robust.noise.chain_solution import ChainProblem
from limitsets.robust.noise.scattering import Scattering

__all__ = ["Curve", "FedShares", "FeedingProblem", "success_curve"]

Progress = Callable[[str, int, int], None]

# Share of the starts that is still under way when counting ends, and throws after which it does in any case.
UNDER_WAY, MOST_THROWS = 1e-9, 20_000
# Factors on the noise of the curve; the speed's deviation stays above this share of the speed, backwards.
FACTORS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)
BACKWARDS = -0.5
HALVINGS = 8


@dataclass(frozen=True, eq=False)
class FedShares:
    """Shares of random starts; an approximation between cells, not proved.

    Attributes
    ----------
    by_throw : ndarray, shape (n, 4)
        Share that meets each fate of `FATES` but the last, at each throw from the first.
    never : float
        Share that is on the arm still after the last throw counted.
    cut : float
        Probability of noise beyond where laws without bounds were cut off, per throw.
    """

    by_throw: NDArray[np.float64]
    never: float
    cut: float

    @property
    def shares(self) -> dict[str, float]:
        """Share of each fate."""
        return dict(zip(FATES, [*self.by_throw.sum(axis=0).tolist(), self.never], strict=True))

    @property
    def ended(self) -> NDArray[np.float64]:
        """Share that has ended, by whatever fate, after each number of throws from 0 on."""
        return np.concatenate([[0.0], np.cumsum(self.by_throw.sum(axis=1))])

    @property
    def mean_throws(self) -> float:
        """Mean number of throws of those that end; nan where none do."""
        total = self.by_throw.sum(axis=1)
        ended = float(total.sum())
        return float(total @ np.arange(1, total.size + 1)) / ended if ended > 0.0 else math.nan

    def quantile(self, share: float) -> int | None:
        """Throws after which `share` of all starts have ended; None where so many never do."""
        reached = np.flatnonzero(self.ended >= share)
        return int(reached[0]) if reached.size else None

    def per_minute(self, throw_rate: float | None) -> float | None:
        """Parts fed rightly per minute where the next part starts as soon as one has ended; None if one never may."""
        if throw_rate is None or self.never > 1e-6:
            return None
        return 60.0 * throw_rate * self.shares["right"] / self.mean_throws


@dataclass(frozen=True, eq=False)
class FeedingProblem:
    """The end of an arm, cells, and the places where they were cut for earlier solutions."""

    end: ArmEnd
    chain: ChainProblem

    @classmethod
    def of(cls, end: ArmEnd, cells: int, strata: int) -> FeedingProblem:
        """Ask on so many cells a side, each law cut into so many strata."""
        return cls(end, ChainProblem(end.scene, (end.x, end.side), end.starts, cells, strata))

    def coarser(self) -> tuple[FeedingProblem, FeedingProblem]:
        """Ask on half as many cells, and with half as many strata."""
        half = {name: max(getattr(self.chain, name) // 2, 1) for name in ("cells", "strata")}
        one, two = (replace(self.chain, **{name: count}) for name, count in half.items())
        return replace(self, chain=one), replace(self, chain=two)

    def cover(self) -> Grid:
        """Cells with borders at the end of the arm and where parts begin and cease to clear the wall."""
        found = cells_for_noise(self.end.scene.domain, self.chain.cells)
        for beyond in {0.0, *(edge for pair in self.end.clear for edge in pair)}:
            found = with_border(found, self.end.x + beyond)
        return found

    def solve(self, scatter: Scattering) -> FedShares:
        """Move random starts on until nearly all have ended."""
        cover = self.cover()
        chain = self.chain.chain(cover, scatter)
        x = np.concatenate([cover.centres(side) for side in range(cover.sides)])
        fate = self.end.fate(x, cover.side_of(np.arange(cover.n_cells)))
        masses = random_starts(cover, *self.end.ranges)
        rows: list[list[float]] = []
        while masses.sum() > UNDER_WAY and len(rows) < MOST_THROWS:
            left = float((masses @ chain.sinks).sum())
            masses = chain.adjoint(masses)
            rows.append([*(float(masses[fate == number].sum()) for number in range(3)), left])
            masses[fate >= 0] = 0.0
        return FedShares(np.array(rows), float(masses.sum()), chain.cut)

    def errors(self, scatter: Scattering, found: FedShares) -> dict[str, float]:
        """How much the shares change from half as many cells, and from half as many strata, added up."""
        others = [each.solve(scatter).shares for each in self.coarser()]
        return {
            name: sum(abs(share - other[name]) for other in others) for name, share in found.shares.items()
        }


@dataclass(frozen=True, eq=False)
class Curve:
    """Share of right feeds against the level of the noise; an approximation between cells, not proved.

    Attributes
    ----------
    factors, right : ndarray, shape (n,)
        Factor on all deviations, and the share fed rightly.
    wanted : float
        The share asked about.
    level : (float, float) or None
        The smallest factor at which the share falls to what is wanted, between these two; None where it does not,
        ``(0, 0)`` where it is below without noise.
    """

    factors: NDArray[np.float64]
    right: NDArray[np.float64]
    wanted: float
    level: tuple[float, float] | None

    def line(self) -> str:
        """Put the level in words."""
        share = f"{100 * self.wanted:g} %"
        if self.level is None:
            least, at = float(self.right.min()), float(self.factors[-1])
            return (
                f"success stays above {share} up to {at:g} times the noise, {100 * least:.2f} % at the least"
            )
        if self.level[1] == 0.0:
            return f"success is below {share} without noise: {100 * float(self.right[0]):.2f} %"
        return f"success falls to {share} at {sum(self.level) / 2:.3g} times the noise"


def success_curve(
    problem: FeedingProblem,
    scatter: Scattering,
    *,
    wanted: float = 0.95,
    factors: Sequence[float] = FACTORS,
    progress: Progress | None = None,
) -> Curve:
    """Find the least noise, a multiple of the one given, at which only a share of the starts is fed rightly.

    Parameters
    ----------
    problem : FeedingProblem
        What is asked, on which cells.
    scatter : Scattering
        The noise at a factor of 1.
    wanted : float
        The share.
    factors : sequence of float
        Ascending from 0; those at which the arm might turn half backwards are left out.
    progress : callable, optional
        Told (stage, done, all).
    """
    reach = 0.0 if scatter.speed is None else scatter.speed.strata(problem.chain.strata).lo
    possible = [factor for factor in factors if factor * reach > BACKWARDS]
    tell = progress or (lambda stage, done, of: None)

    def right(factor: float) -> float:
        tell("noise levels", len(shares), len(possible) + HALVINGS)
        shares.append(problem.solve(scatter.scaled(factor)).shares["right"])
        return shares[-1]

    shares: list[float] = []
    known = [right(factor) for factor in possible]
    below = next((k for k, share in enumerate(known) if share <= wanted), None)
    level = None
    if below == 0:
        level = (0.0, 0.0)
    elif below is not None:
        lo, hi = possible[below - 1], possible[below]
        for _ in range(HALVINGS):
            middle = 0.5 * (lo + hi)
            lo, hi = (lo, middle) if right(middle) <= wanted else (middle, hi)
        level = (lo, hi)
    return Curve(np.array(possible), np.array(known), wanted, level)
