"""The same statistics by Monte Carlo: many parts, random numbers by counters, standard errors, binomial intervals.

Parts are independent of each other, so the spread between them gives the standard error of every mean.  It is an
independent check of the transfer operator: the throws are those of `limitsets.orbit`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scattering import Gaussian, Scattering, Uniform, still_map, uniform_starts
from limitsets.feeder.scene import Scene
from limitsets.systems.maps import advance, kind_of

# ----------------------------------------------------------------
# The interval of a probability that was counted: successes of independent trials.


def binomial_interval(successes: int, trials: int, confidence: float = 0.95) -> tuple[float, float]:
    """Give the interval of Clopper and Pearson for the probability of success.

    Source: Clopper and Pearson, Biometrika 26, 1934.

    Examples
    --------
    >>> low, high = binomial_interval(19, 20)
    >>> round(low, 3), round(high, 4)
    (0.751, 0.9987)
    """
    from scipy.stats import binomtest

    interval = binomtest(successes, trials).proportion_ci(confidence, method="exact")
    return float(interval.low), float(interval.high)


# ----------------------------------------------------------------
# The same statistics by Monte Carlo: many parts, counter-based random numbers, standard errors.


# Throws that are not counted: the part comes onto the limit set first.
BEFORE = 400
MOST_THROWS = 20_000

Answers: TypeAlias = dict[str, tuple[float, float]]
"""By name a number and its standard error."""


@dataclass(frozen=True, eq=False)
class SampledStatistics:
    """What many parts did; sampled.

    Attributes
    ----------
    throws : int
        Throws counted for the time fractions.
    numbers, errors : dict of str to float
        Means by name, as in `NoiseStatistics.numbers`, and their standard errors.
    density : tuple of ndarray
        Per side the share of the time per length, in bins.
    bins : tuple of ndarray
        Borders of the bins.
    arrived : ndarray of int, shape (n,)
        Throws to the goal of each part that came to it.
    parts : int
        Parts that were sent to the goal.
    """

    throws: int
    numbers: dict[str, float]
    errors: dict[str, float]
    density: tuple[Array, ...]
    bins: tuple[Array, ...]
    arrived: Ints
    parts: int


def require_seed(seed: int) -> None:
    """Refuse a seed that the generators do not take, before anything is thrown."""
    if not (isinstance(seed, int | np.integer) and 0 <= seed < 2**63):
        raise AnswerError("the seed", seed, "a whole number from 0", "choose one")


def scattering_map(scene: Scene, scatter: Scattering, seed: int = 0) -> Any:
    """Return the map whose throws scatter by these laws when an orbit is followed.

    Raises
    ------
    AnswerError
        For laws that counted throws do not know: they are Gaussian or Uniform, both alike, of speed and landing place.
    """
    from limitsets.feeder.thrower.effects.spread import Even, Normal, Spread
    from limitsets.feeder.thrower.full import with_effects

    alike = {type(getattr(scatter, name)) for name in scatter.given()}
    if not alike:
        return still_map(scene)
    if alike not in ({Gaussian}, {Uniform}) or scatter.tilt is not None:
        allowed = "Gaussian or Uniform of speed and landing, both of one kind"
        raise AnswerError("the noise to throw with", scatter.words(), allowed, "use the operator for others")
    law, size = (Even(), "bound") if alike == {Uniform} else (Normal(), "sigma")
    speed, landing = (float(getattr(each, size, 0.0)) for each in (scatter.speed, scatter.landing))
    plain = still_map(scene)
    full = plain if hasattr(plain, "bare") else with_effects(plain, {}, None)
    return full._replace(effects=(*full.effects, Spread(law, speed, landing, float(seed))))


class ManyParts:
    """Parts under way; every throw of every part draws numbers of its own, the first the one after `drawn` others."""

    def __init__(self, params: Any, x: Array, side: Ints, drawn: int = 0) -> None:
        self.params, self.x, self.side, self.drawn = params, x, side, drawn

    def throw(self) -> Ints:
        """Throw each once; what happened to them."""
        self.x, self.side, code, _ = advance(self.params, self.x, self.side, 1, first=self.drawn)
        self.drawn += self.x.size
        return code

    def keep(self, some: Mask) -> None:
        """Go on with some of them."""
        self.x, self.side = self.x[some], self.side[some]


def throw_many(
    scene: Scene,
    scatter: Scattering,
    goal: tuple[float, int],
    starts_from: Array,
    *,
    throws: int = 10_000_000,
    parts: int = 20_000,
    seed: int = 0,
    bins: int = 200,
    progress: Callable[[int, int], None] | None = None,
) -> SampledStatistics:
    """Throw many parts: for the time fractions on the limit set, and from random starts to the goal.

    Parameters
    ----------
    scene : Scene
        The scene.
    scatter : Scattering
        The noise.
    goal : (float, int)
        x and side.
    starts_from : ndarray, shape (n_sides,)
        Where starts begin on each side; they end below x of the goal.
    throws : int
        Throws to be counted for the time fractions, about.
    parts : int
        Parts that share them, and that are then sent to the goal.
    seed : int
        Of the starts and of the noise.
    bins : int
        Bins per side of the density.
    progress : callable, optional
        Told (done, all) now and then.
    """
    random = np.random.default_rng(seed)
    x, side = uniform_starts(random, starts_from, goal[0], parts)
    rounds = max(throws // parts, 1)
    many = ManyParts(scattering_map(scene, scatter, seed), x, side)
    long_run, density, borders = _long_run(many, scene, goal, rounds, bins, progress)
    x, side = uniform_starts(random, starts_from, goal[0], parts)
    fed, arrived = _to_goal(ManyParts(scattering_map(scene, scatter, seed + 1), x, side), goal)
    answers = {**long_run, **fed}
    numbers, errors = ({name: pair[k] for name, pair in answers.items()} for k in (0, 1))
    return SampledStatistics(
        throws=rounds * parts,
        numbers=numbers,
        errors=errors,
        density=density,
        bins=borders,
        arrived=arrived,
        parts=parts,
    )


def _mean(per_part: Array) -> tuple[float, float]:
    """Mean over parts and its standard error."""
    return float(per_part.mean()), float(per_part.std(ddof=1)) / math.sqrt(per_part.size)


def _ratio(over: Array, under: Array) -> tuple[float, float]:
    """Ratio of two means over parts and its standard error, to first order."""
    if not under.sum() > 0.0:
        return float("nan"), float("nan")
    value = float(over.sum() / under.sum())
    return value, _mean(over - value * under)[1] / float(under.mean())


def _long_run(
    many: ManyParts, scene: Scene, goal: tuple[float, int], rounds: int, bins: int, progress: Any
) -> tuple[Answers, tuple[Any, ...], tuple[Any, ...]]:
    """Divide the time: on sides, branches, beyond the goal's x; densities per side and the borders of their bins."""
    names = kind_of(many.params).branches
    for _ in range(BEFORE):
        code = many.throw()
        many.keep(code >= 0)
    count, sides = many.x.size, len(scene.sides)
    on_side, by_branch = np.zeros((sides, count)), np.zeros((len(names), count))
    beyond, wrong, alive = np.zeros(count), np.zeros(count), np.ones(count, dtype=bool)
    borders = tuple(np.linspace(float(a), scene.arm_length, bins + 1) for a in scene.sides.a)
    histograms = [np.zeros(bins) for _ in borders]
    for done in range(rounds):
        code = many.throw()
        alive &= code >= 0
        far = (many.x >= goal[0]) & alive
        beyond += far
        wrong += far & (many.side != goal[1])
        here = (many.side == np.arange(sides)[:, None]) & alive
        on_side += here
        by_branch += (code == np.arange(len(names))[:, None]) & alive
        for histogram, on_it, edges in zip(histograms, here, borders, strict=True):
            histogram += np.histogram(many.x[on_it], edges)[0]
        if progress is not None:
            progress(done + 1, rounds)
    total = on_side.sum(axis=0)
    answers = {f"time on side {k}": _ratio(on_side[k], total) for k in range(sides)}
    answers |= {f"share of {name}": _ratio(by_branch[k], total) for k, name in enumerate(names)}
    answers["wrong beyond"] = _ratio(wrong, beyond)
    answers["time beyond"] = _ratio(beyond, total)
    seen = float(total.sum())
    density = (counts / seen / np.diff(edges) for counts, edges in zip(histograms, borders, strict=True))
    return answers, tuple(density), borders


def _share(count: int, parts: int) -> tuple[float, float]:
    share = count / parts
    return share, math.sqrt(max(share * (1.0 - share), 1.0 / parts) / parts)


def _to_goal(many: ManyParts, goal: tuple[float, int]) -> tuple[Answers, Ints]:
    """Throw until all are at the goal or gone: shares, throws that it takes, and those of each part."""
    parts = many.x.size
    arrived, first_wrong, first_far = [], 0, 0
    waits = np.ones(parts, dtype=bool)  # has not yet been beyond the goal's x, on any side
    for number in range(1, MOST_THROWS + 1):
        code = many.throw()
        stays = code >= 0
        far = (many.x >= goal[0]) & stays
        there = far & (many.side == goal[1])
        first_far += int((far & waits).sum())
        first_wrong += int((far & waits & ~there).sum())
        waits &= ~far
        arrived.append(np.full(int(there.sum()), number))
        going = stays & ~there
        many.keep(going)
        waits = waits[going]
        if not many.x.size:
            break
    counts = np.concatenate(arrived)
    answers = {"fed": _share(counts.size, parts), "first beyond is wrong": _share(first_wrong, parts)}
    if counts.size > 1:
        answers["mean throws"] = _mean(counts.astype(np.float64))
        # 95 % quantile of all starts, and half the range of order statistics one standard error away.
        off = math.sqrt(parts * 0.95 * 0.05)
        places = [math.ceil(0.95 * parts + k * off) - 1 for k in (-1, 0, 1)]
        if places[2] < counts.size:
            low, at, high = np.sort(counts)[places].tolist()
            answers["95 % throws"] = float(at), max(0.5 * (high - low), 0.5)
    return answers, counts
