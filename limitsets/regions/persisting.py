"""A periodic orbit that all parameters of a box have: intervals each of which is thrown over the next.

Let I_0, ..., I_(p-1) be intervals, on each of which the decision of the throw is proved for all parameters of the box,
and let the image of I_k hold I_(k+1), and that of the last one I_0: the throw is continuous on them and rises, so it is
enough where the two ends go.  Then every map of the box has a periodic orbit that passes through the intervals in turn,
by the intermediate value theorem.  The intervals may be as wide as the orbit moves over the box; multiplied out over a
period, as a single interval of starts would have to be, they would not be decided any more.
Source: covering relations, Zgliczynski and Gidea, Journal of Differential Equations 202, 2004, in one dimension.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.goals import OrientedBeyond
from limitsets.maps import Orbit, orbit
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.goals.kind import above
from limitsets.proofs.goals.violating_orbits import MORE_THAN_ROUNDING, middle
from limitsets.proofs.orbits import follow
from limitsets.proofs.parameters import ParameterBox

# Throws until an orbit of the middle scene has settled, and throws of it that are searched.
SETTLING, SEARCHED = 2_000, 20_000

# Longest period; how near a return has to be, relative to x; returns that are tried, those with most room first.
LONGEST, NEAR, TRIED = 60, 1e-2, 64

# Widths beside the orbit, relative to x, on which the decision may be proved; times round the orbit.
WIDTHS, ROUNDS = tuple(0.1 * 2.0**-k for k in range(9)), 30

# An interval that has to shrink does so by this share of it more, so that the shrinking ends.
MORE = 2.0**-20

# Of the widths so much is used: the checker's balls decide less near a switch.  With half as much to spare it did not
# confirm one of 7306 cells of the plane in docs/regions.md.
SURE = 1.0 - 2.0**-4

# Images hold the next interval with this much to spare, so that other arithmetic can confirm it.
ROOM = 1e-9

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Chain(NamedTuple):
    """The intervals, with the side and the branch of each; the first one violates the goal as a whole."""

    lo: Array
    hi: Array
    side: Ints
    branches: Ints


class Return(NamedTuple):
    """A piece of an orbit that nearly comes back."""

    x: Array
    side: Ints
    branches: Ints


class Violation(NamedTuple):
    """Whether an orbit of the scene in the middle violates the goal, and the chain that proves it of all parameters."""

    seen: bool = False
    chain: Chain | None = None


def violating_chain(found: Attraction, middle_box: ParameterBox, goal: OrientedBeyond) -> Violation:
    """Look for a periodic orbit that violates the goal, and prove that every map of the box has one.

    Parameters
    ----------
    found : Attraction
        The cells, for the whole box.
    middle_box : ParameterBox
        The scene in the middle of the box.
    goal : OrientedBeyond
        The goal.
    """
    box = found.cover.box
    map_now = middle_box.at_kappa(middle_box.middle_kappa)
    start = orbit(map_now, *middle(found, found.cells.numbers()), SETTLING)
    path = orbit(map_now, float(start.x[-1]), int(start.side[-1]), SEARCHED)
    if not goal.wrong()(path.x * MORE_THAN_ROUNDING, path.side).any():
        return Violation()
    bare = box.bare[1]
    if not (box.bare[0].kappa > np.hypot(bare.a, bare.d) * (1.0 + 1e-12)).all():
        return Violation(True)  # the impact may not depend continuously on where the throw starts
    chains = (_widened(box, near, above(goal.x)) for near in _returns(path, goal))
    return Violation(True, next((chain for chain in chains if chain is not None), None))


def _returns(path: Orbit, goal: OrientedBeyond) -> Iterator[Return]:
    """Pieces from a place that violates the goal back to it, nearly; those farthest from all switches first."""
    size = path.code.size
    x, side = path.x[:size], path.side[:size]
    room = _from_switches(x, side, path.code)
    begin = np.flatnonzero(goal.wrong()(x, side) & (np.arange(size) < size - LONGEST))
    least = x[begin] - goal.x
    scores, starts, periods = [], [], []
    for period in range(1, LONGEST + 1):
        least = np.minimum(least, room[begin + period - 1])
        to = begin + period
        back = (side[to] == side[begin]) & (np.abs(x[to] - x[begin]) <= NEAR * x[begin])
        best = np.argsort(-least[back], kind="stable")[:TRIED]
        scores.append(least[back][best])
        starts.append(begin[back][best])
        periods.append(np.full(best.size, period))
    score, start, length = (np.concatenate(each) for each in (scores, starts, periods))
    for k in np.argsort(-score, kind="stable")[:TRIED].tolist():
        piece = slice(int(start[k]), int(start[k] + length[k]))
        yield Return(x[piece], side[piece].astype(np.int64), path.code[piece].astype(np.int64))


def _from_switches(x: Array, side: Ints, code: Ints) -> Array:
    """Distance of each state from the nearest place at which the decision is seen to change."""
    room = np.full(x.size, np.inf)
    for s in np.unique(side).tolist():
        mine = np.flatnonzero(side == s)
        order = mine[np.argsort(x[mine], kind="stable")]
        change = np.flatnonzero(np.diff(code[order]))
        if change.size:
            at = 0.5 * (x[order][change] + x[order][change + 1])
            right = np.clip(np.searchsorted(at, x[mine]), 0, at.size - 1)
            left = np.maximum(right - 1, 0)
            room[mine] = np.minimum(np.abs(x[mine] - at[left]), np.abs(x[mine] - at[right]))
    return room


def _widened(box: ParameterBox, near: Return, beyond: float) -> Chain | None:
    """Widen a piece of orbit, whose first place lies beyond x on a wrong side, to a chain."""
    ends = [_decided(box, near, k) for k in range(near.side.size)]
    lo, hi = np.array([low for low, _ in ends]), np.array([high for _, high in ends])
    lo[0] = max(lo[0], math.nextafter(beyond, math.inf))
    if not (lo < hi).all():
        return None
    size = near.side.size
    waiting = set(range(size))
    for _ in range(ROUNDS * size):
        k = min(waiting)
        waiting.discard(k)
        image = _held(box, near, k, float(lo[k]), float(hi[k]))
        after = (k + 1) % size
        if not (image[0] <= lo[after] and hi[after] <= image[1]):
            more = MORE * (hi[after] - lo[after])
            lo[after] = lo[after] if image[0] <= lo[after] else image[0] + more
            hi[after] = hi[after] if hi[after] <= image[1] else image[1] - more
            if not lo[after] < hi[after]:
                return None
            waiting.add(after)
        if not waiting:
            return Chain(lo, hi, near.side, near.branches)
    return None


def _decided(box: ParameterBox, near: Return, k: int) -> tuple[float, float]:
    """Widest interval around a place of the orbit on which the throw is proved to go its way, and to rise."""
    x = float(near.x[k])
    ends = []
    for sign in (-1.0, 1.0):
        tried = (x + sign * width * abs(x) for width in WIDTHS)
        ends.append(next((end for end in tried if _goes(box, near, k, min(x, end), max(x, end))), x))
    # a little nearer, so that other arithmetic can confirm it
    return x + SURE * (ends[0] - x), x + SURE * (ends[1] - x)


def _goes(box: ParameterBox, near: Return, k: int, lo: float, hi: float) -> bool:
    """Whether throws from [lo, hi] are proved to take the branch of the orbit, and to rise with x."""
    on_arm = lo > box.bare[1].a[near.side[k]] and hi <= box.bare[0].arm_length
    thrown = follow(box, lo, hi, int(near.side[k]), near.branches[k : k + 1])
    return bool(on_arm and thrown.decided.all() and thrown.lo.size > 1 and thrown.slope[0] > 0.0)


def _held(box: ParameterBox, near: Return, k: int, lo: float, hi: float) -> tuple[float, float]:
    """Return an interval that the image of [lo, hi], on which the throw is decided, holds for all parameters."""
    word, side = near.branches[k : k + 1], int(near.side[k])
    first, last = follow(box, lo, lo, side, word), follow(box, hi, hi, side, word)
    return float(first.hi[1]) + ROOM, float(last.lo[1]) - ROOM
