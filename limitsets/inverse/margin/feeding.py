"""Throws to feed: the number of throws until a part from anywhere on the arm rests beyond X on the wanted side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from limitsets.maps import advance
from limitsets.maps.contract import kind_of
from limitsets.scene import Scene

# Starts, and throws after which one that is not fed is given up.
STARTS, MOST = 2000, 2000
# Starts keep this share of the way from a_i to X away from a_i, where the number of throws has no bound.
NEAR = 0.05


@dataclass(frozen=True)
class ThrowsToFeed:
    """Throws to feed, sampled from random starts.

    Attributes
    ----------
    mean, quantile_95 : float
        Over the starts that are fed, nan if none is.
    fed, lost : int
        How many starts are fed, and how many leave the arm before.
    starts : int
        Of how many.
    """

    mean: float
    quantile_95: float
    fed: int
    lost: int
    starts: int


def throws_to_feed(scene: Scene, x: float, side: int, *, starts: int = STARTS, seed: int = 0) -> ThrowsToFeed:
    """Count throws until a part rests at x or beyond on a side.

    Parameters
    ----------
    scene : Scene
        The scene, as simulated: with its effects, if any.
    x, side : float, int
        Where parts are fed [length].
    starts : int
        Random starts: sides with equal chance, and places evenly from a_i to x but for 5 % of the way.
    seed : int
        Of the counted random numbers (Philox): the same seed, the same starts.

    Returns
    -------
    ThrowsToFeed

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.inverse.margin.feeding import throws_to_feed
    >>> found = throws_to_feed(ls.load("paper-designed"), 20.0, 2)
    >>> found.fed, found.lost
    (2000, 0)
    """
    rng = np.random.Generator(np.random.Philox(seed))
    sides = rng.integers(len(scene.sides), size=starts)
    a = scene.sides.a[sides]
    places = a + (NEAR + (1.0 - NEAR) * rng.random(starts)) * (x - a)
    params, counts, lost = scene.map, np.zeros(starts), 0
    waiting = np.arange(starts)
    exits = list(kind_of(params).exits.values())
    for throw in range(1, MOST + 1):
        places, sides, code, _ = advance(params, places, sides, 1)
        gone = np.isin(code, exits)
        there = ~gone & (sides == side) & (places >= x)
        counts[waiting[there]] = throw
        lost += int(gone.sum())
        left = ~(gone | there)
        waiting, places, sides = waiting[left], places[left], sides[left]
        if not waiting.size:
            break
    done = counts[counts > 0]
    if not done.size:
        return ThrowsToFeed(np.nan, np.nan, 0, lost, starts)
    return ThrowsToFeed(float(done.mean()), float(np.quantile(done, 0.95)), int(done.size), lost, starts)
