"""Worst-case orbits: a goal is violated by choosing the disturbance at every throw.

Random throws miss them, and a forward search with one state per cell misses small violations.  The search is therefore
backward reachability on a fine raster: places from which one throw can violate the goal, from which two can, and so on;
then forward from a long orbit without noise that meets such a place, with every throw computed anew.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from limitsets.maps import Orbit, orbit
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.goals.recurrent_orbits import Refutation, closed
from limitsets.proofs.goals.violating_orbits import (
    Path,
    ReachedStates,
    ThrowChoice,
    Wrong,
    on_limit_set,
    throw_choices,
    throws,
    violation,
)

# Places of the raster, values of kappa at a throw, throws back from the violation, throws of the orbit, states kept.
PLACES, KAPPAS, BACK, LENGTH, KEPT = 120_000, 9, 4, 200_000, 4000

# Throws of the long orbit before the noise begins: the closed orbit may begin at each of them.
BEFORE = 12

Array = NDArray[np.float64]
Sides = NDArray[np.int64]


class _Raster:
    """Places evenly over the attracting cells, and the nearest of them to any place."""

    def __init__(self, found: Attraction) -> None:
        extents = found.cells.extents()
        total = sum(hi - lo for parts in extents.values() for lo, hi in parts)
        self.step = total / PLACES
        self.low, self.first = {}, {}
        x, side, count = [], [], 0
        for s, parts in extents.items():
            if not parts:
                continue
            lo, hi = parts[0][0], parts[-1][1]
            some = np.arange(lo, hi + self.step, self.step)
            self.low[s], self.first[s] = lo, count
            x.append(some)
            side.append(np.full(some.size, s))
            count += some.size
        self.x, self.side = np.concatenate(x), np.concatenate(side)

    def nearest(self, x: Array, side: Sides) -> Sides:
        """Return the number of the nearest place; -1 where there is none."""
        found = np.full(x.size, -1)
        for s, first in self.first.items():
            mine = np.flatnonzero(side == s)
            number = first + np.rint((x[mine] - self.low[s]) / self.step).astype(np.int64)
            last = first + int((self.side == s).sum())
            found[mine] = np.where((number >= first) & (number < last), number, -1)
        return found


def _beside(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Add the neighbours."""
    wide = mask.copy()
    wide[1:] |= mask[:-1]
    wide[:-1] |= mask[1:]
    return wide


def worst_orbit(found: Attraction, wrong: Wrong) -> Refutation:
    """Find a closed orbit that violates a goal, with the noise chosen at every throw, and prove it.

    Parameters
    ----------
    found : Attraction
        Cells and images, of a box of parameters with noise.
    wrong : callable
        From places and sides to whether each violates the goal.

    Returns
    -------
    Refutation
        Empty if none is found.
    """
    box, options = found.cover.box, throw_choices(found.cover.box, KAPPAS)
    raster = _Raster(found)
    start, on = on_limit_set(found)
    path = orbit(box.at_kappa(box.middle_kappa), start, on, LENGTH)
    here = raster.nearest(path.x, path.side)
    levels = [_beside(wrong(raster.x, raster.side))]
    known = np.zeros(raster.x.size, dtype=bool)
    for back in range(1, BACK + 1):
        left = np.flatnonzero(~known)
        thrown = throws(box, raster.x[left], raster.side[left], options)
        to = raster.nearest(thrown.x, thrown.side)
        hit = (to >= 0) & thrown.stays & levels[-1][to]
        good = np.zeros(raster.x.size, dtype=bool)
        good[left[thrown.state[hit]]] = True
        levels.append(_beside(good))
        known |= good
        begin = np.flatnonzero((here >= 0) & levels[back][here])
        begin = begin[begin >= BEFORE][:KEPT]
        refutation = _followed(found, wrong, raster, levels, path, begin, options)
        if refutation.states:
            return refutation
    return Refutation()


def _followed(
    found: Attraction,
    wrong: Wrong,
    raster: _Raster,
    levels: list[NDArray[np.bool_]],
    path: Orbit,
    begin: Sides,
    options: list[ThrowChoice],
) -> Refutation:
    """Throw on from states of the long orbit along the levels, and close and prove what then violates the goal."""
    if not begin.size:
        return Refutation()
    reached = ReachedStates.of(path.x[begin], path.side[begin].astype(np.int64))
    for back, level in reversed(list(enumerate(levels[:-1]))):
        thrown = throws(found.cover.box, reached.x[-1], reached.side[-1], options)
        if back == 0:
            keep = violation(thrown, wrong)
        else:
            to = raster.nearest(thrown.x, thrown.side)
            keep = np.flatnonzero((to >= 0) & level[to] & thrown.stays)
            keep = keep[:: max(1, keep.size // KEPT)]
        if not keep.size:
            return Refutation()
        reached.add(thrown, keep)
    tail = reached.path(0, options)
    same = (path.x[begin] == tail.x[0]) & (path.side[begin] == tail.side[0])
    first = int(begin[np.flatnonzero(same)[0]])
    before = slice(first - BEFORE, first)
    usual = ThrowChoice(found.cover.box.middle_kappa, 0.0)
    whole = Path(
        [*path.x[before].tolist(), *tail.x],
        [*path.side[before].tolist(), *tail.side],
        [*([usual] * BEFORE), *tail.thrown],
    )
    return closed(found.cover.box, whole, wrong)
