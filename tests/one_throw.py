"""The mean of any function after one throw with noise, by midpoints: what proved bounds of it have to hold."""

import numpy as np

from limitsets.feeder.scattering import thrown
from limitsets.systems.maps import advance


def mean_after(scene, scatter, rows, x, side, count):
    """Mean of a function after one throw from x; `rows`: by side its nodes and values, it is affine between them.

    Each law is uniform, or there is none; `count` midpoints of each.
    """
    total = np.zeros(x.size)
    share = (np.arange(count) + 0.5) / count
    speed = [0.0] if scatter.speed is None else scatter.speed.bound * (2.0 * share - 1.0)
    landing = [0.0] if scatter.landing is None else scatter.landing.bound * (2.0 * share - 1.0)
    at = thrown(scene.map)
    for delta in speed:
        after, turned, code, _ = advance(at(1.0 / (1.0 + delta) ** 2), x, side, 1)
        assert (code >= 0).all()
        for k, (place, value) in enumerate(rows):
            here = turned == k
            for off in landing:
                total[here] += np.interp(after[here] + off, place, value)
    return total / (len(speed) * len(landing))
