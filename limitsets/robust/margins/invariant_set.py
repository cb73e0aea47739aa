"""The least robustly positively invariant set around an orbit, by floats: one interval of x on each side.

The intervals contain the limit set with its gaps filled, and every place that landings off by up to e can lead to.  A
search tries thousands of scenes; one set costs about as much as one orbit.  Nothing is proved here: `limitsets.robust`
proves the result of a search.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.maps import orbit
from limitsets.maps.critical import margins
from limitsets.maps.forced import along
from limitsets.thrower import Throw

Array = NDArray[np.float64]

# Throws of an orbit before it counts, and of those that count.
BEFORE, COUNTED = 300, 300
# The stretches begin with this share of the orbit's extent, about its middle, so that they end where images end.
INNER = 0.9
# Samples of a side for its changes of branch; samples of a bracket, narrowed so often before a straight line is drawn
# through it: what is left of the arm is its 25 000th part, and a line through that is off by its square.
SAMPLES, FINER, NARROWINGS = 97, 17, 2
# Images after which stretches that still grow are taken to leave, and growth that counts [length].
MOST, STILL = 400, 1e-9


class InvariantIntervals(NamedTuple):
    """Stretches that no throw leaves.

    Attributes
    ----------
    lo, hi : ndarray, shape (n,)
        Ends per side, nan on a side that is never reached [length].
    creep : ndarray, shape (n,)
        Least advance of a jog at the lower end, the noise of the landing taken off; inf where the part flips there:
        what is to spare before noise carries a part back to the joint [length].
    """

    lo: Array
    hi: Array
    creep: Array

    def threshold(self, side: int) -> float:
        """Highest place on another side, -inf if there is none."""
        others = np.delete(self.hi, side)
        return float(np.max(others[np.isfinite(others)], initial=-np.inf))


class _Cuts(NamedTuple):
    """Borders between the branches of one side, ascending from a_i to the arm's end, and the branches between."""

    borders: Array
    branches: NDArray[np.int64]


def _cuts(params: Throw, side: int) -> _Cuts:
    a, end = float(params.a[side]), params.arm_length
    x = a + (end - a) * np.linspace(1e-4, 1.0, SAMPLES)
    values = margins(params, x, side)
    flips = values > 0.0
    borders = []
    for k in np.flatnonzero(flips[1:] != flips[:-1]):
        fine, value, j = x, values, int(k)
        for _ in range(NARROWINGS):
            fine = fine[j] + (fine[j + 1] - fine[j]) * np.linspace(0.0, 1.0, FINER)
            value = margins(params, fine, side)
            j = int(np.argmax((value > 0.0) == flips[k + 1])) - 1
        share = value[j] / (value[j] - value[j + 1])
        borders.append(float(fine[j] + share * (fine[j + 1] - fine[j])))
    branches = np.concatenate([flips[:1], flips[1:][flips[1:] != flips[:-1]]])
    return _Cuts(np.array([a, *borders, end]), branches.astype(np.int64))


def _parts(cuts: list[_Cuts], lo: Array, hi: Array) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Cut the stretches at the borders: pairs of ends, their sides and branches."""
    ends: list[float] = []
    sides: list[int] = []
    branches: list[int] = []
    for side, (borders, on) in enumerate(cuts):
        if not lo[side] <= hi[side]:
            continue
        for k, branch in enumerate(on.tolist()):
            below, above = max(lo[side], borders[k]), min(hi[side], borders[k + 1])
            if below < above or (below == above and lo[side] == hi[side]):
                ends += [below, above]
                sides += [side, side]
                branches += [branch, branch]
    return np.array(ends), np.array(sides, dtype=np.int64), np.array(branches, dtype=np.int64)


def least_slack(params: Throw) -> float:
    """Return the least distance between a landing from anywhere on the arm and a place where parts are lost.

    A part is lost off the arm's end, or where its left vertex comes down behind the joint.

    Examples
    --------
    >>> import limitsets as ls
    >>> least_slack(ls.load("paper-designed").map) > 0
    True
    """
    room = np.inf
    for side in range(params.a.size):
        cuts = _cuts(params, side)
        for k, branch in enumerate(cuts.branches.tolist()):
            after, on, _ = along(params, cuts.borders[k : k + 2], side, [branch])
            # the jog from a_i itself moves nothing
            lower = after[0] - params.a[on[0]] if k or branch else np.inf
            room = min(room, lower, params.arm_length - after[1])
    return float(room)


def invariant_intervals(
    params: Throw, x: float, side: int, *, landing: float = 0.0
) -> InvariantIntervals | None:
    """Find the least stretches, one per side, that hold an orbit and that no throw leaves.

    Parameters
    ----------
    params : Throw
        The throw map, without effects.
    x, side : float, int
        Where the orbit starts; it has to come to the limit set in some hundred throws.
    landing : float
        Every landing may be off by up to this [length].

    Returns
    -------
    InvariantIntervals or None
        None where a part may leave the arm, or comes back to the joint.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust.margins.invariant_set import invariant_intervals
    >>> found = invariant_intervals(ls.load("paper-designed").map, 12.0, 2)
    >>> found.hi.round(4).tolist(), round(found.threshold(2), 4)
    ([19.7527, 17.4398, 23.3832], 19.7527)
    """
    path = orbit(params, x, side, BEFORE + COUNTED)
    if path.stopped is not None:
        return None
    count = params.a.size
    lo, hi = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(lo, path.side[BEFORE:], path.x[BEFORE:])
    np.maximum.at(hi, path.side[BEFORE:], path.x[BEFORE:])
    seen = lo <= hi
    middle, half = 0.5 * (lo[seen] + hi[seen]), 0.5 * INNER * (hi[seen] - lo[seen])
    lo[seen], hi[seen] = middle - half, middle + half
    cuts = [_cuts(params, side) for side in range(count)]
    for _ in range(MOST):
        ends, sides, branches = _parts(cuts, lo, hi)
        after, on, _ = along(params, ends, sides, branches[:, None])
        wider_lo, wider_hi = lo.copy(), hi.copy()
        np.minimum.at(wider_lo, on, after - landing)
        np.maximum.at(wider_hi, on, after + landing)
        if not ((wider_lo > params.a).all() and wider_hi.max() <= params.arm_length):
            return None
        still = (wider_lo >= lo - STILL) & (wider_hi <= hi + STILL)
        lo, hi = wider_lo, wider_hi
        if still.all():
            return _closed(params, cuts, lo, hi, landing)
    return None


def _closed(params: Throw, cuts: list[_Cuts], lo: Array, hi: Array, landing: float) -> InvariantIntervals:
    creep = np.full(lo.size, np.inf)
    for side, (borders, branches) in enumerate(cuts):
        if lo[side] <= hi[side] and branches[np.searchsorted(borders, lo[side]) - 1] == 0:
            after, _, _ = along(params, [lo[side]], side, [0])
            creep[side] = float(after[0] - lo[side]) - landing
    never = ~(lo <= hi)
    lo[never] = hi[never] = np.nan
    return InvariantIntervals(lo, hi, creep)
