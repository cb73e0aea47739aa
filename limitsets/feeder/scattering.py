"""The random quantities of a throw: probability laws, their strata, and the map of a scene with them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import MapError, SceneError

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene


# ----------------------------------------------------------------
# Probability laws of a deviation, and their strata: parts of the law that preserve mean and variance.
#
# A stratum represents a part of the law by its probability, mean and standard deviation; the transfer operator
# spreads it over an interval of the same mean and variance.  Point masses would leave spikes in every density.  Half
# of the cuts follow the probability and half the length, because rare deviations decide rare escapes.


# Standard deviations at which a Gaussian is cut off; beyond lies a probability of 2e-9.
SIGMAS = 6.0
# Probability that is cut off at each end of a user's distribution without bounds.
TAIL = 1e-9
# Where the moments of a stratum are summed: panels, as densities may have kinks, each by Gauss and Legendre.
PANELS, ABSCISSAE = 12, 6
# Points on which the cuts between strata are looked up.
TABLE = 4097


class Strata(NamedTuple):
    """A law in pieces.

    Attributes
    ----------
    weight : ndarray, shape (m,)
        Probabilities; they add up to 1.
    mean, sd : ndarray, shape (m,)
        Mean and standard deviation within each piece.
    lo, hi : float
        Bounds of the whole.
    cut : float
        Probability that lay beyond the bounds and was shared out among the pieces.
    """

    weight: NDArray[np.float64]
    mean: NDArray[np.float64]
    sd: NDArray[np.float64]
    lo: float
    hi: float
    cut: float = 0.0

    def rows(self) -> Iterator[tuple[float, float, float]]:
        """Weight, mean and standard deviation of one piece after the other."""
        return zip(self.weight.tolist(), self.mean.tolist(), self.sd.tolist(), strict=True)


@runtime_checkable
class Law(Protocol):
    """What is asked of a distribution of deviations."""

    def strata(self, count: int) -> Strata:
        """Cut it into at most `count` pieces."""
        ...

    def scaled(self, factor: float) -> Law:
        """Return the law of `factor` times the deviation."""
        ...


def _require_scale(value: float, name: str) -> None:
    if not (math.isfinite(value) and value >= 0.0):
        raise MapError(f"{name} of the noise", value, "a finite number from 0", "correct it")


def certain(value: float) -> Strata:
    """Return the law of one value."""
    return Strata(np.ones(1), np.full(1, value), np.zeros(1), value, value)


def _cuts(law: Any, lo: float, hi: float, count: int) -> NDArray[np.float64]:
    """Borders of the strata, by the mean of the distribution function and that of an even law."""
    x = np.linspace(lo, hi, TABLE)
    both = 0.5 * (law.cdf(x) - law.cdf(lo)) / (law.cdf(hi) - law.cdf(lo)) + 0.5 * (x - lo) / (hi - lo)
    return np.unique(np.concatenate([[lo], np.interp(np.arange(1, count) / count, both, x), [hi]]))


def _strata(law: Any, lo: float, hi: float, count: int) -> Strata:
    """Cut a continuous law, given as scipy gives it, between two bounds."""
    borders = _cuts(law, lo, hi, count)
    a, b = borders[:-1], borders[1:]
    # From the nearer end: in the upper tail differences of the distribution function would lose all digits.
    upper = a > law.median()
    weight = np.where(upper, law.sf(a) - law.sf(b), law.cdf(b) - law.cdf(a))
    node, share = np.polynomial.legendre.leggauss(ABSCISSAE)
    place = (np.arange(PANELS)[:, None] + 0.5 + 0.5 * node).ravel() / PANELS
    x = a[:, None] + (b - a)[:, None] * place
    density = np.tile(share, PANELS) * law.pdf(x)
    total = density.sum(axis=1)
    some = (total > 0.0) & (weight > 0.0)
    x, density, total, weight = x[some], density[some], total[some], weight[some]
    mean = (density * x).sum(axis=1) / total
    sd = np.sqrt((density * (x - mean[:, None]) ** 2).sum(axis=1) / total)
    cut = float(law.cdf(lo) + law.sf(hi))
    return Strata(weight / weight.sum(), mean, sd, lo, hi, cut)


@dataclass(frozen=True)
class Gaussian:
    """Normal, cut off at six standard deviations.

    Parameters
    ----------
    sigma : float
        Standard deviation: a share of the speed, [rad] of the tilt, [length] of the landing place.

    Examples
    --------
    >>> from limitsets.feeder.scattering import Gaussian
    >>> found = Gaussian(0.5).strata(16)
    >>> round(float((found.weight * (found.mean**2 + found.sd**2)).sum()), 6)  # the variance
    0.25
    """

    sigma: float

    def __post_init__(self) -> None:
        _require_scale(self.sigma, "the standard deviation")

    def strata(self, count: int) -> Strata:
        """Cut it into at most `count` pieces."""
        from scipy import stats

        if self.sigma == 0.0:
            return certain(0.0)
        reach = SIGMAS * self.sigma
        return _strata(stats.norm(scale=self.sigma), -reach, reach, count)

    def scaled(self, factor: float) -> Gaussian:
        """Return the law of `factor` times the deviation."""
        return Gaussian(self.sigma * factor)


@dataclass(frozen=True)
class Uniform:
    """Anywhere from `-bound` to `bound`, equally likely.

    Parameters
    ----------
    bound : float
        Largest deviation, in the units of `Gaussian`.
    """

    bound: float

    def __post_init__(self) -> None:
        _require_scale(self.bound, "the bound")

    def strata(self, count: int) -> Strata:
        """Cut it into `count` pieces."""
        if self.bound == 0.0:
            return certain(0.0)
        borders = np.linspace(-self.bound, self.bound, count + 1)
        width = 2.0 * self.bound / count
        sd = np.full(count, width / math.sqrt(12.0))
        mean = 0.5 * (borders[1:] + borders[:-1])
        return Strata(np.full(count, 1.0 / count), mean, sd, -self.bound, self.bound)

    def scaled(self, factor: float) -> Uniform:
        """Return the law of `factor` times the deviation."""
        return Uniform(self.bound * factor)


@dataclass(frozen=True)
class Given:
    """Any continuous distribution of scipy.stats, frozen: ``Given(scipy.stats.t(5, scale=0.004))``.

    Parameters
    ----------
    distribution : scipy.stats frozen distribution
        With cdf, sf, pdf, ppf, isf, median and support; cut off where 1e-9 lies beyond, at ends without bound.
    factor : float
        Factor on the deviation.
    """

    distribution: Any
    factor: float = 1.0

    def __post_init__(self) -> None:
        _require_scale(self.factor, "the factor")
        needed = ("cdf", "sf", "pdf", "ppf", "isf", "support")
        if not all(hasattr(self.distribution, name) for name in needed):
            allowed = "a frozen continuous distribution of scipy.stats"
            raise MapError("the law", self.distribution, allowed, "pass Samples(values) for a discrete one")

    def strata(self, count: int) -> Strata:
        """Cut it into at most `count` pieces."""
        if self.factor == 0.0:
            return certain(0.0)
        law = self.distribution
        lo, hi = (float(end) for end in law.support())
        lo = lo if math.isfinite(lo) else float(law.ppf(TAIL))
        hi = hi if math.isfinite(hi) else float(law.isf(TAIL))
        pieces, by = _strata(law, lo, hi, count), self.factor
        return pieces._replace(mean=pieces.mean * by, sd=pieces.sd * by, lo=lo * by, hi=hi * by)

    def scaled(self, factor: float) -> Given:
        """Return the law of `factor` times the deviation."""
        return replace(self, factor=self.factor * factor)


@dataclass(frozen=True, eq=False)
class Samples:
    """Measured deviations, or a table of values and weights.

    Parameters
    ----------
    values : array_like, shape (n,)
        Deviations.
    weights : array_like, shape (n,), optional
        Their weights; equal ones otherwise.

    Examples
    --------
    >>> from limitsets.feeder.scattering import Samples
    >>> Samples([-0.01, 0.01], [1, 3]).strata(16).weight
    array([0.25, 0.75])
    """

    values: ArrayLike
    weights: ArrayLike | None = None

    def __post_init__(self) -> None:
        values, weights = self._arrays()
        good = values.ndim == 1 and values.size and values.shape == weights.shape
        if not (good and np.isfinite(values).all() and (weights >= 0).all() and 0 < weights.sum() < np.inf):
            allowed = "finite values, and a weight from 0 for each"
            raise MapError("the samples of the noise", self.values, allowed, "correct them")

    def _arrays(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        values = np.asarray(self.values, dtype=np.float64)
        given = np.ones(values.shape) if self.weights is None else np.asarray(self.weights, dtype=np.float64)
        return values, given

    def strata(self, count: int) -> Strata:
        """Take every distinct value for itself where they are few, or else group them."""
        values, weights = self._arrays()
        values, where = np.unique(values, return_inverse=True)
        total = _sums(where, weights / weights.sum())
        whole = Strata(total, values, np.zeros(values.size), float(values[0]), float(values[-1]))
        return regrouped(whole, count)

    def scaled(self, factor: float) -> Samples:
        """Return the law of `factor` times the deviation."""
        _require_scale(factor, "the factor")
        return Samples(np.asarray(self.values, dtype=np.float64) * factor, self.weights)


def _sums(group: NDArray[np.int64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Add up the values of each group."""
    return np.asarray(np.bincount(group, weights=values), dtype=np.float64)


def regrouped(strata: Strata, count: int) -> Strata:
    """Join neighbouring strata until at most `count` are left; probability, mean and variance are kept."""
    if strata.weight.size <= count:
        return strata
    order = np.argsort(strata.mean)
    weight, mean, sd = (column[order] for column in (strata.weight, strata.mean, strata.sd))
    middle = np.cumsum(weight) - 0.5 * weight
    extent = (mean - mean[0]) / (mean[-1] - mean[0])
    group = np.minimum((0.5 * (middle + extent) * count).astype(np.int64), count - 1)
    group = np.unique(group, return_inverse=True)[1]
    total = _sums(group, weight)
    centre = _sums(group, weight * mean) / total
    square = _sums(group, weight * (sd**2 + (mean - centre[group]) ** 2)) / total
    return Strata(total, centre, np.sqrt(square), strata.lo, strata.hi, strata.cut)


def transformed(strata: Strata, function: Any) -> Strata:
    """Strata of a monotone function of the deviation, its curvature taken into account to second order."""
    half = math.sqrt(3.0) * strata.sd
    below, at, above = (function(strata.mean + shift) for shift in (-half, 0.0, half))
    lo, hi = sorted((float(function(strata.lo)), float(function(strata.hi))))
    mean, sd = (below + 4.0 * at + above) / 6.0, np.abs(above - below) / math.sqrt(12.0)
    return strata._replace(mean=mean, sd=sd, lo=lo, hi=hi)


# ----------------------------------------------------------------
# The random quantities of a throw, their laws, and the map of a scene with them.


LAWS: dict[str, Any] = {"gaussian": Gaussian, "bounded": Uniform}
"""Words for laws: a deviation is the standard deviation of the one, the bound of the other."""

# Random starts begin this share of the arm beyond a_i: nearer to it the number of throws has no bound.
BEYOND_FOOT = 0.05


@dataclass(frozen=True)
class Scattering:
    """What differs at every throw, independently of all other throws.

    Parameters
    ----------
    speed : Law or None
        Relative deviation of the throw's angular speed.
    tilt : Law or None
        Deviation of the table's tilt [rad]; the scene has to give gravity.tilt.
    landing : Law or None
        Deviation of the landing place [length].

    Examples
    --------
    >>> from limitsets.robust import Gaussian, Scattering
    >>> Scattering(speed=Gaussian(0.005), landing=Gaussian(0.02)).given()
    ('speed', 'landing')
    """

    speed: Law | None = None
    tilt: Law | None = None
    landing: Law | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            law = getattr(self, field.name)
            if law is not None and not isinstance(law, Law):
                allowed = "a law: Gaussian, Uniform, Given or Samples"
                raise SceneError(f"the noise of {field.name}", law, allowed, "wrap it in one of them")

    def given(self) -> tuple[str, ...]:
        """Names of the quantities that scatter."""
        return tuple(field.name for field in fields(self) if getattr(self, field.name) is not None)

    def scaled(self, factor: float, of: str | None = None) -> Scattering:
        """Return the scattering with deviations `factor` times as large, of one quantity or of all."""
        names = self.given() if of is None else (of,)
        return replace(self, **{name: getattr(self, name).scaled(factor) for name in names})

    def words(self) -> dict[str, str]:
        """Say the laws in words, by quantity."""
        return {name: repr(getattr(self, name)) for name in self.given()}


def scattering_of(scene: Scene) -> Scattering:
    """Read the scattering that a scene gives by `[world] scatter`, its law by `[effects] spread`.

    Raises
    ------
    SceneError
        For a scene without the one or the other.
    """
    scatter, how = scene.world.scatter, scene.effects.spread
    if scatter is None or how is None:
        key, value = ("world.scatter", scatter) if scatter is None else ("effects.spread", how)
        raise SceneError(
            "the noise of the throws",
            value,
            'scatter in [world] with spread = "gaussian" or "bounded" in [effects]',
            "add both to the scene, or pass scatter=Scattering(...)",
            key=key,
            file=scene.file,
        )
    speed, landing, law = scatter.speed, scatter.landing, LAWS[how]
    whole = 1.0 if speed is None or speed.relative else scene.value("throw.speed")
    return Scattering(
        speed=None if speed is None else law(speed.value / whole),
        landing=None if landing is None else law(landing.value),
    )


def kappa_strata(scattering: Scattering, scene: Scene, count: int) -> Strata:
    """Strata of the factor on kappa = gravity / speed^2 that speed and tilt make up together."""
    parts: list[Strata] = []
    # Cut finely first: joined strata keep their mean and variance, not more.
    fine = count if None in (scattering.speed, scattering.tilt) else 4 * count
    if scattering.speed is not None:
        deviation = scattering.speed.strata(fine)
        if deviation.lo <= -1.0:
            remedy = "lower the noise: the arm would turn backwards"
            raise SceneError("the least deviation of the speed", deviation.lo, "above -1", remedy)
        parts.append(transformed(deviation, lambda delta: -2.0 * np.log1p(delta)))
    if scattering.tilt is not None:
        parts.append(_tilted(scattering.tilt.strata(fine), scene))
    if not parts:
        return certain(1.0)
    whole = parts[0] if len(parts) == 1 else regrouped(_sum(*parts), count)
    return transformed(whole, np.exp)


def _tilted(deviation: Strata, scene: Scene) -> Strata:
    tilt = scene.value("gravity.tilt")
    if not (tilt + deviation.lo > 0.0 and tilt + deviation.hi <= 0.5 * math.pi):
        allowed = "tilts above 0 and up to 90 deg"
        span = (tilt + deviation.lo, tilt + deviation.hi)
        raise SceneError("the range of the tilt [rad]", span, allowed, "lower its noise")
    return transformed(deviation, lambda tau: np.log(np.sin(tilt + tau) / math.sin(tilt)))


def _sum(one: Strata, two: Strata) -> Strata:
    """Strata of the sum of two independent deviations."""
    return Strata(
        np.outer(one.weight, two.weight).ravel(),
        np.add.outer(one.mean, two.mean).ravel(),
        np.sqrt(np.add.outer(one.sd**2, two.sd**2)).ravel(),
        one.lo + two.lo,
        one.hi + two.hi,
        one.cut + two.cut,
    )


def still_map(scene: Scene) -> Any:
    """Return the scene's map without its scatter: the minimal one where no other effect is on."""
    if scene.effects.spread is None:
        return scene.map
    from limitsets.feeder.thrower.effects.spread import Spread
    from limitsets.feeder.thrower.motion import without

    return without(scene.map, Spread)


def thrown(params: Any) -> Callable[[float], Any]:
    """Return the throw map as a function of the factor on kappa."""

    def at(factor: float) -> Any:
        bare = getattr(params, "bare", params)
        moved = bare._replace(kappa=bare.kappa * factor)
        return params._replace(bare=moved) if bare is not params else moved

    return at


def starts_from(scene: Scene, offset: float | None = None) -> NDArray[np.float64]:
    """Where random starts begin on each side: `offset` beyond a_i, a twentieth of the arm unless given [length]."""
    return scene.sides.a + (BEYOND_FOOT * scene.arm_length if offset is None else offset)


def uniform_starts(
    random: np.random.Generator,
    lo: NDArray[np.float64],
    hi: float | NDArray[np.float64],
    count: int,
    sides: NDArray[np.int64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Draw starts from ranges `lo` to `hi` on some sides, by default one on each, equally likely per length."""
    length = np.maximum(hi - lo, 0.0)
    drawn = random.choice(lo.size, size=count, p=length / length.sum())
    side = drawn if sides is None else sides[drawn]
    return random.uniform(lo[drawn], np.broadcast_to(hi, lo.shape)[drawn]), side.astype(np.int64)
