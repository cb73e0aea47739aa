"""What proved bounds have to hold: means after one throw with noise, by midpoints, and the places of long orbits."""

import numpy as np
from scipy import stats

import limitsets as ls
from limitsets.feeder.scattering import Uniform, thrown
from limitsets.systems.maps import advance


def deviations(law, count):
    """Quantiles of a law, in the middle of as many parts that are equally likely."""
    share = (np.arange(count) + 0.5) / count
    if law is None:
        return [0.0]
    return law.bound * (2.0 * share - 1.0) if isinstance(law, Uniform) else law.sigma * stats.norm.ppf(share)


def mean_after(scene, scatter, rows, x, side, count):
    """Mean of a function after one throw from x; `rows`: by side its nodes and values, it is affine between them.

    Each law is uniform or normal, or there is none; `count` deviations of each, equally likely.
    """
    total = np.zeros(x.size)
    speed, landing = (deviations(law, count) for law in (scatter.speed, scatter.landing))
    at = thrown(scene.map)
    for delta in speed:
        after, turned, code, _ = advance(at(1.0 / (1.0 + delta) ** 2), x, side, 1)
        assert (code >= 0).all()
        for k, (place, value) in enumerate(rows):
            here = turned == k
            for off in landing:
                total[here] += np.interp(after[here] + off, place, value)
    return total / (len(speed) * len(landing))


def highest_off(throw, throws=200_000, side=2):
    """Highest place off a side that a long orbit reaches; its first throws lead to the limit set."""
    path = ls.orbit(throw, 0.5 * throw.arm_length, 2, throws)
    x, on = np.asarray(path.x)[1000:], np.asarray(path.side)[1000:]
    assert x.size > throws - 1000  # it does not leave
    return float(x[on != side].max())


def highest_scattered(throw, landing, random, throws=1500, side=2):
    """The same of many orbits, each landing moved to either end of the noise as a random number has it."""
    x, on, highest = np.full(4000, 0.5 * throw.arm_length), np.full(4000, 2), -np.inf
    for count in range(throws):
        x, on, code, _ = advance(throw, x, on, 1)
        assert (code >= 0).all()
        x = x + landing * random.choice((-1.0, 1.0), x.size)
        if count > 300:
            highest = max(highest, x[on != side].max(initial=-np.inf))
    return float(highest)
