"""Maxima of a smooth function of few numbers of order 1, and how far each may go: Newton's method and profiles.

The function takes many points in one call, so a whole Hessian by differences costs little more than one value.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Function = Callable[[Array], Array]

H = 0.03
MOST = 60
# Newton's method ends where a step promises less than this.
GAIN, ROUGHLY = 1e-6, 1e-3
LONGEST = 3.0
FLATTEST = 1e-3
SHARES = np.array([0.5, 0.25, 0.1, 0.03, 0.01, 0.001])
SHARES_BACK = np.array([1.0, 0.7, 0.4, 0.1, 0.0])
# The end of a profile is found to this share of its distance.
CLOSE = 0.01
# Below this a point is as bad as one where there is nothing.
WORST = -1e9


class Maximum(NamedTuple):
    """Where a function is largest.

    Attributes
    ----------
    at : ndarray, shape (p,)
        Where.
    value : float
        The function there.
    hessian : ndarray, shape (p, p)
        Its second derivatives; 0 in rows and columns of what was held.
    """

    at: Array
    value: float
    hessian: Array


def _expanded(f: Function, at: Array, free: NDArray[np.int64]) -> tuple[float, Array, Array]:
    """Value, gradient and Hessian with respect to the free numbers."""
    p = free.size
    one = np.zeros((p, at.size))
    one[np.arange(p), free] = H
    first, second = np.triu_indices(p, 1)
    values = np.maximum(
        f(at + np.concatenate([np.zeros((1, at.size)), one, -one, one[first] + one[second]])), WORST
    )
    here, up, down, both = values[0], values[1 : p + 1], values[p + 1 : 2 * p + 1], values[2 * p + 1 :]
    hessian = np.diag((up - 2.0 * here + down) / H**2)
    hessian[first, second] = hessian[second, first] = (both - up[first] - up[second] + here) / H**2
    return float(here), (up - down) / (2.0 * H), hessian


def maximised(f: Function, start: Array, held: int | None = None, gain: float = GAIN) -> Maximum:
    """Climb from a start, until a step promises less than `gain`; one number may be held."""
    at = np.array(start, dtype=np.float64)
    free = np.array([k for k in range(at.size) if k != held], dtype=np.int64)
    value, gradient, hessian = _expanded(f, at, free)
    for _ in range(MOST):
        bend, axes = np.linalg.eigh(-hessian)
        # downhill bends are turned over, flat ones bent a little: the step goes up
        step = axes @ ((axes.T @ gradient) / np.maximum(np.abs(bend), FLATTEST))
        step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300)) if step.size else 1.0
        if gradient @ step < gain:
            break
        there = at.copy()
        there[free] += step
        found = _expanded(f, there, free)
        if not found[0] > value:
            tries = np.repeat(at[None], SHARES.size, axis=0)
            tries[:, free] += SHARES[:, None] * step
            there = tries[int(np.argmax(f(tries)))]
            found = _expanded(f, there, free)
            if not found[0] > value:
                break
        at, (value, gradient, hessian) = there, found
    whole = np.zeros((at.size, at.size))
    whole[np.ix_(free, free)] = hessian
    return Maximum(at, value, whole)


class End(NamedTuple):
    """One end of a profile.

    Attributes
    ----------
    at : float
        Where the deviance reaches its threshold; infinite, with the way's sign, where it does not within the limit.
    better : Maximum or None
        A larger value of the function that was met on the way.
    wall : bool
        Whether the function ends there, before the deviance reaches its threshold.
    """

    at: float
    better: Maximum | None = None
    wall: bool = False


def end_of_profile(
    f: Function, best: Maximum, k: int, way: float, threshold: float, first: float, limit: float
) -> End:
    """Follow number k one way from a maximum, the others free, until twice the loss reaches a threshold.

    Parameters
    ----------
    f : callable
        The function.
    best : Maximum
        Where to begin.
    k : int
        Which number.
    way : float
        1 or -1.
    threshold : float
        Of twice the loss.
    first : float
        How far the end may be expected.
    limit : float
        The farthest that is looked at.
    """
    wanted = math.sqrt(threshold)
    # the others go along as in a parabola, then as they did before
    bend, axes = np.linalg.eigh(-best.hessian)
    along = (axes / np.maximum(bend, FLATTEST)) @ axes[k]
    along *= way / along[k]
    near, near_root, far, far_root = 0.0, 0.0, math.inf, math.inf
    last, distance, wall = best.at, min(first, limit), False
    for _ in range(40):
        # where the others went along so far that there is nothing they stay nearer to where they were
        starts = last + SHARES_BACK[:, None] * (best.at + distance * along - last)
        starts[:, k] = best.at[k] + way * distance
        start = starts[int(np.argmax(f(starts) > WORST))]
        found = maximised(f, start, held=k, gain=ROUGHLY)
        nothing = found.value <= WORST
        if not nothing:
            along = (found.at - best.at) / distance
        loss = 2.0 * (best.value - found.value)
        if loss < -0.01:
            return End(start[k], maximised(f, found.at))
        root = math.sqrt(max(loss, 0.0))
        if root < wanted:
            near, near_root, last = distance, root, found.at
            if distance >= limit:
                return End(way * math.inf)
        else:
            far, far_root, wall = distance, root, nothing
        if abs(root - wanted) < CLOSE * wanted or far - near < CLOSE * far:
            break
        if math.isinf(far):
            guess = distance * (wanted / root if root > 0.2 * wanted else 3.0) * 1.02
            distance = min(max(guess, 1.1 * distance), 4.0 * distance, limit)
        else:
            share = (wanted - near_root) / (far_root - near_root) if far_root < 10.0 * wanted else 0.5
            distance = near + min(max(share, 0.1), 0.9) * (far - near)
    if wall:
        return End(best.at[k] + way * near, wall=True)
    return End(best.at[k] + way * (distance if math.isinf(far) else min(distance, far)))
