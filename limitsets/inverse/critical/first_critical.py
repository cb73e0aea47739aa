"""The first critical point of each side, also beyond the arm's end.

A design search passes through scenes whose critical points lie beyond the arm; a value clipped at the arm's end would
have no gradient.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from limitsets.cells import Domain
from limitsets.maps import critical_points
from limitsets.maps.critical import CriticalPoint, margins
from limitsets.scene import Scene

SAMPLES = 2048
# Samples below a critical point where the decision is nearly drawn.
BELOW = 512
NARROWINGS = 60
GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def first_points(scene: Scene) -> tuple[CriticalPoint | None, ...]:
    """Find the first critical point of each side of the minimal model, up to where a throw makes a full turn.

    Returns
    -------
    tuple of CriticalPoint or None
        One per side; None where every throw is decided alike.

    Notes
    -----
    No flight that turns less than 2 pi starts beyond a + pi kappa at small angles, or, times 1 + (a + d)/(pi kappa) at
    most, in the exact model.

    Examples
    --------
    >>> import limitsets as ls
    >>> [round(point.x, 5) for point in first_points(ls.load("paper-designed"))]
    [10.0, 10.0, 20.0]
    """
    own, sides = scene.domain, scene.sides
    turn = sides.a + sides.d + math.pi * scene.kappa
    domain = Domain(own.lo, np.maximum(own.hi, turn[:, None]), own.anchor)
    found = critical_points(scene.bare_map, domain, samples=SAMPLES)
    return tuple(found[side][0] if found[side] else None for side in range(len(sides)))


def nearest_miss(scene: Scene, side: int, until: float) -> tuple[float, float] | None:
    """Find where below a critical point the decision is nearly drawn: an earlier pair of critical points is near.

    Returns
    -------
    (float, float) or None
        x, and the deciding number there; None where it comes nowhere near 0.
    """
    a, lo = float(scene.sides.a[side]), float(scene.domain.lo[side, 0])
    share = np.linspace(0.0, 1.0, BELOW)
    even, graded = lo + (until - lo) * share, a + (lo - a) * ((until - a) / (lo - a)) ** share
    x = np.unique(np.clip(np.concatenate([even, graded]), lo, until))
    values = _abs(scene, x, side)
    here, higher = values[1:-1], np.maximum(values[:-2], values[2:])
    # a parabola through the three falls below the lowest by less than the highest stands above it
    dips = 1 + np.flatnonzero((here < values[:-2]) & (here <= values[2:]) & (here <= higher - here))
    if dips.size == 0:
        return None
    left, right = x[dips - 1], x[dips + 1]
    for _ in range(NARROWINGS):
        c, d = right - GOLDEN * (right - left), left + GOLDEN * (right - left)
        lower = _abs(scene, c, side) < _abs(scene, d, side)
        left, right = np.where(lower, left, c), np.where(lower, d, right)
    at = 0.5 * (left + right)
    least = _abs(scene, at, side)
    k = int(least.argmin())
    return float(at[k]), float(least[k])


def _abs(scene: Scene, x: npt.NDArray[np.float64], side: int) -> npt.NDArray[np.float64]:
    return np.abs(margins(scene.bare_map, x, side))
