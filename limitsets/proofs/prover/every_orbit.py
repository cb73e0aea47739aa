"""Every periodic orbit of a map in its domain, up to a period: whole orbits are enclosed, narrowed and cut.

A tube is a box for each of the points x_0 .. x_p-1.  The tubes hold all orbits of the period at every moment:

* x_k+1 = f(x_k) lies in the image of box k; and in f_i(m) + sum_j df_i/dx_j (x_j - m_j) = x_k+1,i each x_j whose slope
  is not 0 lies where the others leave it (a step of the interval Newton method, one equation at a time).
* Of the p rotations of an orbit that one is followed whose x_0 has the least first coordinate.
* For a wider tube W, every orbit in W lies in K(W) (`orbits_of_map`); where K(W) lies in its interior there is exactly
  one along these branches, and the tube is done if a proved orbit lies in W: that is the one.
* What is left is cut where it is widest; a branch that is open is first decided, or taken both ways.

An orbit of period q is an orbit of each multiple of q, so that the periods above n/2 are enough for all up to n.

Source: Galias, "Interval methods for rigorous investigations of periodic orbits", Int. J. Bifurcation and Chaos 11
(2001), for K on whole orbits; Neumaier, "Interval Methods for Systems of Equations", 1990, section 5.2.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from limitsets.base import Progress
from limitsets.base.arrays import Array, Ints
from limitsets.proofs.prover.numbers import Intervals
from limitsets.proofs.prover.orbits_of_map import (
    OPEN,
    Corners,
    CycleOfMap,
    exactly,
    inverse,
    krawczyk,
    prove_orbit,
    stepped,
)
from limitsets.proofs.prover.programs import names_alone
from limitsets.systems.cells import Domain
from limitsets.systems.maps import kind_of
from limitsets.systems.maps.derived import NEVER
from limitsets.systems.sets import Cycle

# Tubes that are narrowed at a time, and in all for one period.
AT_A_TIME, MOST_TUBES = 256, 500_000

# W is wider than the tube by this share of its width on both sides, and by this share of the size of its points.
WIDER, BY_SIZE = 2.0**-4, 2.0**-44

# Shares of the domain: a box in which both branches are possible is cut before it is this small; a tube that is not
# done when it is that small is given up.
SMALL, LEAST = 2.0**-6, 2.0**-36

ROUNDS = 2  # of narrowing, before a tube is cut
NEWTON = 4  # steps in floats from K(W) to its orbit


class Tubes(NamedTuple):
    """Boxes for all points of orbits: `lo` and `hi` of shape (n, p, d), `side` and `branch` (n, p), `OPEN` or known."""

    lo: Array
    hi: Array
    side: Ints
    branch: Ints

    def of(self, which: Any) -> Tubes:
        """Return some of them, or one, without the first axis."""
        return Tubes(self.lo[which], self.hi[which], self.side[which], self.branch[which])


class Search(NamedTuple):
    """What is searched: a map between two corners of parameters, in a domain."""

    corners: Corners
    domain: Domain
    branches: int

    def width(self) -> Array:
        """Widths of the domain, shape (d,)."""
        return np.asarray((self.domain.hi - self.domain.lo).max(axis=0))

    def lies(self, lo: Array, hi: Array, side: Ints) -> bool:
        """Whether the points of an orbit lie in the domain."""
        return bool(((self.domain.lo[side] <= lo) & (hi <= self.domain.hi[side])).all())

    def whole(self, period: int) -> Tubes:
        """Return the tubes of all orbits of a period: for each side of x_0 one."""
        sides = len(self.domain.lo)
        ends = (self.domain.lo.min(axis=0), self.domain.hi.max(axis=0))
        lo, hi = (np.tile(end, (sides, period, 1)).astype(np.float64) for end in ends)
        lo[:, 0], hi[:, 0] = self.domain.lo, self.domain.hi
        side = np.full((sides, period), OPEN)
        side[:, 0] = np.arange(sides)
        return Tubes(lo, hi, side, np.full_like(side, OPEN))


def every_orbit(
    corners: Corners, domain: Domain, up_to: int, progress: Progress | None = None
) -> tuple[list[CycleOfMap], str]:
    """Find and prove all orbits of periods up to `up_to` that lie in a domain.

    Returns
    -------
    list of CycleOfMap
        In order of their periods.
    str
        Empty if these are all; else what is missing.
    """
    branches = 1 if names_alone(corners[0]) else len(kind_of(corners[0]).branches)
    search = Search(corners, domain, branches)
    known: list[CycleOfMap] = []
    for period in range(up_to // 2 + 1, up_to + 1):
        stack, tried = [search.whole(period)], 0
        while stack:
            tubes = stack.pop()
            if len(tubes.lo) > AT_A_TIME:
                stack.append(tubes.of(np.arange(AT_A_TIME, len(tubes.lo))))
                tubes = tubes.of(np.arange(AT_A_TIME))
            tried += len(tubes.lo)
            if progress is not None:
                progress(f"orbits of period {period}", tried, tried + sum(len(each.lo) for each in stack))
            if tried > MOST_TUBES:
                return known, f"period {period}: more than {MOST_TUBES} boxes of orbits would be needed"
            rest, missing = _advanced(search, tubes, known)
            if missing:
                return known, f"period {period}: {missing}"
            stack += [each for each in rest if len(each.lo)]
    known.sort(key=lambda cycle: (cycle.period, tuple(cycle.lo[0])))
    return known, ""


@np.errstate(
    all="ignore"
)  # what overflows, or is divided by a slope that may be 0, gives inf and nan: no narrowing
def _advanced(search: Search, tubes: Tubes, known: list[CycleOfMap]) -> tuple[list[Tubes], str]:
    """Narrow tubes, take out those that are done, and cut the others; or say what is missing."""
    for _ in range(ROUNDS):
        tubes = _narrowed(search.corners, tubes)
    undecided = (tubes.branch == OPEN).any(axis=1)
    rest = _opened(search, tubes.of(undecided))
    tubes = tubes.of(~undecided)
    if not len(tubes.lo):
        return rest, ""
    wider, held = _newton(search.corners, tubes)
    inside = ((held.lo > wider.lo) & (held.hi < wider.hi)).all(axis=(1, 2))
    done = np.zeros(len(tubes.lo), dtype=bool)
    for k in np.flatnonzero(inside).tolist():
        done[k] = _is_known(search, wider.of(k), known)
    tubes = tubes._replace(lo=np.fmax(tubes.lo, held.lo), hi=np.fmin(tubes.hi, held.hi))
    tubes = tubes.of(~done & (tubes.lo <= tubes.hi).all(axis=(1, 2)))
    if not len(tubes.lo):
        return rest, ""
    share = ((tubes.hi - tubes.lo) / search.width()).reshape(len(tubes.lo), -1)
    if (share.max(axis=1) < LEAST).any():
        place = tubes.lo[int(share.max(axis=1).argmin()), 0].tolist()
        near = ", ".join(f"{x:.6g}" for x in place)
        return [], f"near {near} orbits are not told apart: a multiplier may be 1, or one lies on a border"
    return [*rest, _cut(tubes, share.argmax(axis=1))], ""


def _narrowed(corners: Corners, tubes: Tubes) -> Tubes:
    """Narrow tubes by one step forward and one back; those that hold no orbit are left out."""
    low, high, side, branch = tubes
    boxes, middle = Intervals(low, high), low + 0.5 * (high - low)
    steps, at = stepped(corners, boxes, side, branch), stepped(corners, exactly(middle), side, branch)
    low, high = (
        np.maximum(low, np.roll(steps.image.lo, 1, axis=1)),
        np.minimum(high, np.roll(steps.image.hi, 1, axis=1)),
    )
    after = Intervals(np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)) - at.image
    off = boxes - exactly(middle)
    d = low.shape[-1]
    for i, j in np.ndindex(d, d):
        left = Intervals(after.lo[..., i], after.hi[..., i])
        for other in range(d):
            slope = Intervals(steps.slope.lo[..., i, other], steps.slope.hi[..., i, other])
            if other == j:
                own = slope
            else:
                left = left - slope * Intervals(off.lo[..., other], off.hi[..., other])
        near = exactly(middle[..., j]) + left / own
        low[..., j], high[..., j] = np.fmax(low[..., j], near.lo), np.fmin(high[..., j], near.hi)
    low[..., 0] = np.maximum(low[..., 0], low[:, :1, 0])
    high[:, 0, 0] = np.minimum(high[:, 0, 0], high[..., 0].min(axis=1))
    alive = (low <= high).all(axis=(1, 2)) & (steps.state != NEVER).all(axis=1)
    return Tubes(low, high, side, branch).of(alive)


def _opened(search: Search, tubes: Tubes) -> list[Tubes]:
    """Take the first open branch of tubes, each way that is possible; boxes with two ways are cut while not small."""
    n, period = tubes.branch.shape
    if not n:
        return []
    rows, k = np.arange(n), (tubes.branch == OPEN).argmax(axis=1)
    box, side = Intervals(tubes.lo[rows, k], tubes.hi[rows, k]), tubes.side[rows, k]
    ways = [stepped(search.corners, box, side, np.full(n, branch)) for branch in range(search.branches)]
    possible = np.array([way.state != NEVER for way in ways])
    share = (box.hi - box.lo) / search.width()
    cut = (possible.sum(axis=0) > 1) & (share.max(axis=1) > SMALL)
    rest = [_cut(tubes.of(cut), (k * share.shape[1] + share.argmax(axis=1))[cut])]
    for branch, way in enumerate(ways):
        mine = np.flatnonzero(possible[branch] & ~cut)
        taken = tubes.of(mine)
        each, here, to = np.arange(mine.size), k[mine], way.to[mine]
        after = (here + 1) % period
        taken.branch[each, here] = branch
        fits = (taken.side[each, after] == OPEN) | (taken.side[each, after] == to)
        taken.side[each, after] = to
        taken.lo[each, after] = np.maximum(taken.lo[each, after], search.domain.lo[to])
        taken.hi[each, after] = np.minimum(taken.hi[each, after], search.domain.hi[to])
        rest.append(taken.of(fits & (taken.lo <= taken.hi).all(axis=(1, 2))))
    return rest


def _cut(tubes: Tubes, where: Ints) -> Tubes:
    """Halve each tube along one of its p d coordinates."""
    rows, (n, period, d) = np.arange(len(where)), tubes.lo.shape
    lo, hi = (np.concatenate([end, end]).reshape(2 * n, period * d) for end in (tubes.lo, tubes.hi))
    middle = 0.5 * (lo[rows, where] + hi[rows, where])
    hi[rows, where], lo[n + rows, where] = middle, middle
    side, branch = np.concatenate([tubes.side] * 2), np.concatenate([tubes.branch] * 2)
    return Tubes(lo.reshape(-1, period, d), hi.reshape(-1, period, d), side, branch)


def _newton(corners: Corners, tubes: Tubes) -> tuple[Tubes, Intervals]:
    """Return wider tubes W, and K(W)."""
    more = WIDER * (tubes.hi - tubes.lo) + BY_SIZE * np.maximum(np.abs(tubes.lo), np.abs(tubes.hi)).max()
    wider = tubes._replace(lo=tubes.lo - more, hi=tubes.hi + more)
    middle, boxes = tubes.lo + 0.5 * (tubes.hi - tubes.lo), Intervals(wider.lo, wider.hi)
    slope = stepped(corners, boxes, tubes.side, tubes.branch).slope
    at = stepped(corners, exactly(middle), tubes.side, tubes.branch).image
    off = at - exactly(np.roll(middle, -1, axis=1))
    return wider, krawczyk(middle, inverse(slope), off, slope, boxes - exactly(middle))


def _is_known(search: Search, wider: Tubes, known: list[CycleOfMap]) -> bool:
    """Whether the one orbit in W, shape (p, d), is proved: as one that is known, or now."""
    if any(_holds(wider, cycle) for cycle in known):
        return True
    x = 0.5 * (wider.lo + wider.hi)[None]
    for _ in range(NEWTON):
        steps = stepped(search.corners, exactly(x), wider.side[None], wider.branch[None])
        off = steps.image - exactly(np.roll(x, -1, axis=1))
        at = krawczyk(x, inverse(steps.slope), off, steps.slope, exactly(np.zeros_like(x)))
        x = 0.5 * (at.lo + at.hi)
    period = _least_period(x[0], wider, 2.0**-30 * search.width())
    near = Cycle(x[0, :period], wider.side[:period], wider.branch[:period], np.nan, np.nan, np.nan)
    cycle = prove_orbit(search.corners, near, search.lies)
    if isinstance(cycle, str) or not _holds(wider, cycle):
        return False  # it takes other branches, or lies beyond the tube: cutting it on shows that
    known.append(cycle)
    return True


def _least_period(x: Array, wider: Tubes, near: Array) -> int:
    """Guess the smallest period of points of shape (p, d)."""
    period = len(x)
    for q in range(1, period):
        alike = (wider.side == np.roll(wider.side, q)) & (wider.branch == np.roll(wider.branch, q))
        if period % q == 0 and alike.all() and (np.abs(x - np.roll(x, q, axis=0)) < near).all():
            return q
    return period


def _holds(wider: Tubes, cycle: CycleOfMap) -> bool:
    """Whether W, shape (p, d), holds a proved orbit, from one of its points on."""
    period = len(wider.lo)
    orders = ((np.arange(period) + first) % cycle.period for first in range(cycle.period))
    return period % cycle.period == 0 and any(
        (wider.lo <= cycle.lo[order]).all()
        and (cycle.hi[order] <= wider.hi).all()
        and (cycle.side[order] == wider.side).all()
        and (cycle.branches[order] == wider.branch).all()
        for order in orders
    )
