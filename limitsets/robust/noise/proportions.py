"""The interval of a probability that was counted: successes of independent trials."""

from __future__ import annotations


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

    found = binomtest(successes, trials).proportion_ci(confidence, method="exact")
    return float(found.low), float(found.high)
