"""The topology of attractors of many parameter points, one compiled loop; and how far they reach at points near by.

Cells find what may be an attractor; its bands, jogs and order come from intervals, and orbits check both.  A point at
which these do not agree is looked at again on finer cells.  What is in doubt then is undecided, with the reason.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.numbers.jit import kernel, row_of
from limitsets.systems.maps.contract import has_slope, kind_of
from limitsets.systems.maps.kernels import image_on, on_side
from limitsets.systems.maps.pieces import point_of, size_of
from limitsets.systems.sets.topology.bands import (
    ANY,
    GAP,
    IMAGE,
    MOVES,
    NOTHING,
    SET,
    begin_union,
    fills,
    images_of,
    is_still,
    merge,
    push_through,
    put,
    settle,
    stays_around,
)
from limitsets.systems.sets.topology.cells import fill_cells, find_components, shares
from limitsets.systems.sets.topology.orbits import (
    CLOSES,
    DOUBTFUL,
    INNER,
    NO_CYCLE,
    STRETCHES,
    averages,
    mean_of,
    one_cycle,
    remaining,
    visits_all,
)
from limitsets.systems.sets.topology.pieces import find_pieces
from limitsets.systems.sets.topology.work import (
    BANDS_JOIN,
    DECIDED,
    MOST_ATTRACTORS,
    MOST_INTERVALS,
    MOVING,
    NOT_ONE,
    STAYING,
    TOO_FINE,
    UNSURE_EXIT,
    Pieces,
    Region,
    Topologies,
    Unions,
    Work,
    empty,
    work_for,
)

# ----------------------------------------------------------------
# How far attractors reach at parameters near those at which they are known: images of their hulls, and no
# cells.
#
# The hull of an attractor on each side, a little shortened, has images that come to rest at the attractor of the near
# parameters.  Where a parameter may differ at every throw the images for both of its ends are joined: the part may then
# be anywhere between them.


Floats = NDArray[np.float64]

# Share of a hull that is left off at either end: its ends are images of the rest.
SHORTER = 0.05
# Half the length of the interval that stands for a state of a cycle, a share of the largest side.
ABOUT_A_STATE = 1e-9
# Samples of a side for its pieces; images that are taken, and ends that rest move by less, a share of a side.
SAMPLES, MOST_IMAGES, STILL = 48, 2000, 1e-10


@kernel(entry=True, counting=False)
def _begin(scale: float, r: Region, a: int, i: int, t: Topologies, u: Unions) -> None:
    """Make SET the hulls of an attractor, or of a cycle one of its states."""
    u.size[SET] = 0
    if t.period[i, a] > 0:
        x, side, half = t.start[i, a], t.start_side[i, a], ABOUT_A_STATE * scale
        put(u, SET, side, max(x - half, r.lo[side]), min(x + half, r.hi[side]))
        return
    for side in range(r.lo.size):
        if t.bands[i, a, side] > 0:
            lo, hi = t.lowest[i, a, side], t.reach[i, a, side]
            off = SHORTER * (hi - lo)
            put(u, SET, side, max(lo + off, r.lo[side]), min(hi - off, r.hi[side]))


@kernel(counting=False, inlined=False)
def _pieces(params: Any, decided: bool, r: Region, w: Work, p: Pieces) -> bool:
    p.begin[0], whole = 0, True
    for side in range(r.lo.size):
        whole = whole and find_pieces(on_side(params, side), side, decided, r, w.scan, w.samples, p)
    return whole


@kernel(counting=False, inlined=False)
def _joined(one: Any, other: Any, p: Pieces, q: Pieces, u: Unions) -> bool:
    """Fill IMAGE with the images of SET for all parameters between two; whether some part has none.

    Pieces of one number, branch and side belong together: the images of a part by both are joined.
    """
    for i in range(u.size[SET]):
        side, lo, hi = u.side[SET, i], u.lo[SET, i], u.hi[SET, i]
        count = max(p.begin[side + 1] - p.begin[side], q.begin[side + 1] - q.begin[side])
        for k in range(count):
            low, high, to = np.inf, -np.inf, -1
            for which in range(2):
                pieces = p if which == 0 else q
                at = pieces.begin[side] + k
                if at >= pieces.begin[side + 1]:
                    continue
                a, b = max(lo, pieces.lo[at]), min(hi, pieces.hi[at])
                if a > b or (a == b and lo < hi):
                    continue
                branch = pieces.branch[at]
                if branch < 0:
                    return True
                params = one if which == 0 else other
                y_a, _, _ = image_on(params, a, side, branch)
                y_b, _, _ = image_on(params, b, side, branch)
                if to >= 0 and pieces.to[at] != to:
                    put(u, IMAGE, to, low, high)
                    low, high = np.inf, -np.inf
                to, low, high = pieces.to[at], min(low, y_a, y_b), max(high, y_a, y_b)
            if to >= 0:
                put(u, IMAGE, to, low, high)
    return False


@kernel(counting=False, inlined=False)
def _rests(
    one: Any, other: Any, joined: bool, union: bool, scale: float, r: Region, p: Pieces, q: Pieces, u: Unions
) -> bool:
    """Take images of SET until they rest; False where one leaves the domain, or they go on.

    `joined`: for all parameters between two; `union`: SET stays in its images, as a state of a cycle has to.
    """
    rested = 0
    for _ in range(MOST_IMAGES):
        u.size[IMAGE] = 0
        lost = _joined(one, other, p, q, u) if joined else images_of(one, p, u, SET, IMAGE, ANY, ANY, 0.0)
        for i in range(0 if lost or u.size[IMAGE] > MOST_INTERVALS else u.size[IMAGE]):
            side = u.side[IMAGE, i]
            lost = lost or u.lo[IMAGE, i] < r.lo[side] or u.hi[IMAGE, i] > r.hi[side]
        for i in range(u.size[SET] if union else 0):
            put(u, IMAGE, u.side[SET, i], u.lo[SET, i], u.hi[SET, i])
        if lost or not merge(u, IMAGE, GAP * scale):
            return False
        rested = rested + 1 if is_still(u, STILL * scale) else 0
        if rested == 2:
            return True
    return False


@kernel
def _note_reach(u: Unions, out: Any) -> None:
    for k in range(u.size[SET]):
        side = u.side[SET, k]
        if not out[side] >= u.hi[SET, k]:
            out[side] = u.hi[SET, k]


@kernel(entry=True)
def _reaches(
    stack: Any,
    other: Any,
    joined: bool,
    decided: bool,
    region: Region,
    points: Any,
    t: Topologies,
    w: Work,
    v: Work,
    out: Any,
) -> None:
    """Fill the reach of all attractors on each side, nan where there is none; inf where one is lost."""
    for k in range(points.size):
        one, two, r, i, scale = row_of(stack, k), row_of(other, k), row_of(region, k), points[k], 0.0
        out[k] = np.nan
        for side in range(r.lo.size):
            scale = max(scale, r.hi[side] - r.lo[side])
        followed = _pieces(one, decided, r, w, w.pieces) and (
            not joined or _pieces(two, decided, r, v, v.pieces)
        )
        for a in range(t.attractors[i]):
            _begin(scale, r, a, i, t, w.unions)
            cycle = t.period[i, a] > 0
            followed = followed and _rests(one, two, joined, cycle, scale, r, w.pieces, v.pieces, w.unions)
            if followed:
                _note_reach(w.unions, out[k])
        if not followed:
            out[k] = np.inf


def reaches(
    stack: Any, region: Region, points: NDArray[np.int64], known: Topologies, other: Any = None
) -> Floats:
    """Follow the attractors of some points to other parameters.

    Parameters
    ----------
    stack : NamedTuple
        The other parameters, stacked, m of them.
    region : Region
        Their domains, arrays of shape (m, S).
    points : ndarray of int, shape (m,)
        Numbers of the points in `known` whose attractors are followed.
    known : Topologies
        The attractors.
    other : NamedTuple, optional
        Stacked too: the parameters may be any between `stack` and these, at every throw anew.

    Returns
    -------
    ndarray, shape (m, S)
        Largest x on each side that any attractor comes to, nan on a side without; inf where an attractor is lost.
    """
    kind = kind_of(point_of(stack, 0))
    out = np.empty((size_of(stack), region.lo.shape[1]))
    one, two = (work_for(region, 1, SAMPLES) for _ in range(2))
    decided = kind.has_margin or len(kind.branches) == 1
    beside = stack if other is None else other
    _reaches(stack, beside, other is not None, decided, region, points, known, one, two, out)
    return out


# ----------------------------------------------------------------
# The topology of the attractors of many parameter points: one compiled loop, finer cells where doubt remains.


# Cells and samples a side: from coarse to fine; no edge of some is one of others, for cycles may lie on them.
LEVELS = ((240, 40), (701, 112), (2803, 448), (16_381, 1536))
# Bands whose gap is below this are one or two: not decided [of the largest side].
UNSURE_GAP = 1e-7
# A set all of whose intervals are shorter is a cycle [of the largest side].
POINT = 1e-8


@kernel(entry=True, counting=False)
def _meets_both_ends(r: Region, scale: float, u: Unions) -> bool:
    """Whether SET has points at both ends of the sides: on a circle these are one place, named by rounding."""
    low = high = False
    for k in range(u.size[SET]):
        side, x = u.side[SET, k], u.lo[SET, k]
        low = low or x <= r.lo[side] + CLOSES * scale
        high = high or x >= r.hi[side] - CLOSES * scale
    return low and high


@kernel
def _bands_join(gap: float, u: Unions) -> bool:
    """Whether two bands of SET on one side are nearer than `gap`."""
    for k in range(1, u.size[SET]):
        if u.side[SET, k] == u.side[SET, k - 1] and u.lo[SET, k] - u.hi[SET, k - 1] < gap:
            return True
    return False


@kernel
def _fill_extent(u: Unions, t: Topologies, i: int, a: int) -> None:
    """Write on each side how many bands SET has, and where the lowest begins and the highest ends."""
    t.bands[i, a, :], t.reach[i, a, :], t.lowest[i, a, :] = 0, np.nan, np.nan
    for k in range(u.size[SET]):
        side = u.side[SET, k]
        if t.bands[i, a, side] == 0:
            t.lowest[i, a, side] = u.lo[SET, k]
        t.bands[i, a, side] += 1
        t.reach[i, a, side] = u.hi[SET, k]


@kernel(counting=False, inlined=False)
def _attractor(params: Any, a: int, r: Region, scale: float, w: Work, t: Topologies, i: int) -> int:
    """Fill the fields of one attractor of point i; DECIDED, or a doubt."""
    sides, u = r.lo.size, w.unions
    expands = begin_union(sides, a, w.cells, w.components, u)
    settled, widest, cycle = settle(params, scale, r, w.pieces, u), 0.0, NO_CYCLE
    if settled not in (NOTHING, MOVES):
        return MOVING
    for k in range(u.size[SET]):
        widest = max(widest, u.hi[SET, k] - u.lo[SET, k])
    x, side = u.lo[SET, 0] + INNER * (u.hi[SET, 0] - u.lo[SET, 0]), u.side[SET, 0]
    if settled == MOVES or (widest > POINT * scale and not expands):
        cycle = one_cycle(params, x, side, scale, w.pieces, u)
    if cycle == DOUBTFUL:
        return NOT_ONE
    if cycle == NO_CYCLE and settled == MOVES:
        return MOVING
    if cycle == NO_CYCLE and _bands_join(UNSURE_GAP * scale, u):
        return BANDS_JOIN
    t.period[i, a] = u.size[SET] if cycle > 0 or widest <= POINT * scale else 0
    if cycle > 0:
        x, side = u.lo[SET, 0], u.side[SET, 0]
    named_twice = t.period[i, a] > 0 and _meets_both_ends(r, scale, u)
    if named_twice or not visits_all(params, CLOSES * scale, u):
        return NOT_ONE
    if t.period[i, a] == 0 and not fills(params, x, side, scale, w.pieces, u):
        return NOT_ONE
    t.start[i, a], t.start_side[i, a] = x, side
    _fill_extent(u, t, i, a)
    jogs_min, jogs_max, order = t.jogs_min[i, a], t.jogs_max[i, a], t.flip_order[i, a]
    obstacle = push_through(params, sides, scale, w.pieces, u, jogs_min, jogs_max, order)
    return DECIDED if obstacle == NOTHING else MOVING


@kernel
def _met_twice(count: int, scale: float, t: Topologies, i: int) -> bool:
    """Whether two attractors share a state: the cells on either side of it are closed each by itself."""
    for a in range(count):
        for b in range(a):
            for side in range(t.reach.shape[2]):
                if min(t.reach[i, a, side], t.reach[i, b, side]) + POINT * scale >= max(
                    t.lowest[i, a, side], t.lowest[i, b, side]
                ) and (t.period[i, a] > 0 and t.period[i, a] == t.period[i, b]):
                    return True
    return False


@kernel(counting=False, inlined=False)
def _point(params: Any, decided: bool, r: Region, w: Work, t: Topologies, i: int) -> int:
    """Fill the fields of point i; DECIDED, or the first doubt."""
    sides, scale, doubt = r.lo.size, 0.0, DECIDED
    w.pieces.begin[0] = 0
    for side in range(sides):
        scale = max(scale, r.hi[side] - r.lo[side])
        if not find_pieces(on_side(params, side), side, decided, r, w.scan, w.samples, w.pieces):
            return TOO_FINE
    if not fill_cells(params, r, w.shape, w.pieces, w.cells):
        doubt = TOO_FINE
    count, whole = find_components(sides, w.cells, w.components)
    t.attractors[i] = count
    if not whole:
        return TOO_FINE
    for a in range(count):
        obstacle = _attractor(params, a, r, scale, w, t, i)
        doubt = obstacle if doubt == DECIDED else doubt
    if doubt == DECIDED and _met_twice(count, scale, t, i):
        doubt = NOT_ONE
    if doubt == DECIDED and remaining(params, sides, w.cells, w.components, w.starts) > 0:
        x, side = w.starts.x[0], w.starts.side[0]
        if stays_around(params, x, side, scale, r, w.pieces, w.cells, w.components, w.unions):
            doubt = STAYING
    sure = shares(r, count, w.pieces.to, w.cells, w.components, w.split)
    t.leaves[i], t.collapses[i] = w.split[0], w.split[1]
    for a in range(MOST_ATTRACTORS):
        t.share[i, a] = w.split[2 + a] if a < count else np.nan
    return UNSURE_EXIT if doubt == DECIDED and not sure else doubt


@kernel(entry=True)
def _points(stack: Any, points: Any, decided: bool, region: Region, w: Work, t: Topologies) -> None:
    """Fill the points of a stack that are listed."""
    for i in points:
        t.undecided[i] = _point(row_of(stack, i), decided, row_of(region, i), w, t, i)


@kernel(entry=True)
def _means(stack: Any, throws: int, t: Topologies, out: Any) -> None:
    """Fill the averages along an orbit of every attractor of every point that is decided."""
    for i in range(t.attractors.size):
        params = row_of(stack, i)
        for a in range(t.attractors[i] if t.undecided[i] == DECIDED else 0):
            averages(params, t.start[i, a], t.start_side[i, a], throws, out)
            t.flips_per_throw[i, a], t.flips_per_throw_error[i, a] = mean_of(out[0])
            t.lyapunov[i, a], t.lyapunov_error[i, a] = mean_of(out[1])


def topologies(
    stack: Any,
    lo: Any,
    hi: Any,
    anchor: Any = None,
    *,
    levels: Any = LEVELS,
    throws: int = 0,
) -> Topologies:
    """Find the topology of the attractors at many parameter points.

    Parameters
    ----------
    stack : NamedTuple
        Stacked parameters of a one-dimensional map with slopes (`limitsets.systems.maps.pieces`), n points.
    lo, hi : array_like, shape (n, S)
        The domain of each side at each point [length].
    anchor : array_like, shape (n, S), optional
        Points below `lo` towards which cells shrink (the throw: a_i).
    levels : sequence of (int, int)
        Cells and samples a side; each further pair serves the points that are still in doubt.
    throws : int
        Of an orbit along which flips per throw and the Lyapunov exponent are averaged; 0 for neither.

    Returns
    -------
    Topologies

    Raises
    ------
    AnswerError
        For a map of more dimensions, or without the slopes that intervals and cycles need.

    Examples
    --------
    >>> import numpy as np
    >>> from limitsets import maps
    >>> from limitsets.systems.maps.pieces import stacked
    >>> from limitsets.topology import topologies
    >>> stack = stacked([maps.Logistic(r) for r in (3.2, 3.5, 3.83, 4.0)])
    >>> found = topologies(stack, np.zeros((4, 1)), np.ones((4, 1)))
    >>> found.period[:, 0], found.bands[:, 0, 0]
    (array([2, 4, 3, 0]), array([2, 4, 3, 1]))
    """
    n, first = size_of(stack), point_of(stack, 0)
    kind = kind_of(first)
    if kind.dimension != 1 or not has_slope(first):
        raise AnswerError(
            "the map",
            kind.name,
            "a map of one dimension with image_on",
            "register image_on: one step on a forced branch; for more dimensions ask transitions and attractors, "
            "or give an atlas a task of your own, task=",
        )
    region = region_of(lo, hi, anchor)
    if len(region.lo) != n:
        raise AnswerError("the rows of the domains", len(region.lo), str(n), "give a row for each point")
    decided = kind.has_margin or len(kind.branches) == 1
    answer = empty(n, region.lo.shape[1])
    points = np.arange(n)
    for cells, samples in levels:
        _points(stack, points, decided, region, work_for(region, cells, samples), answer)
        points = np.flatnonzero(answer.undecided != DECIDED)
        if points.size == 0:
            break
    _tidy(answer)
    if throws:
        _means(stack, throws, answer, np.zeros((2, STRETCHES)))
    return answer


def region_of(lo: Any, hi: Any, anchor: Any = None) -> Region:
    """Read the domains of n points, arrays of shape (n, S)."""
    ends = [lo, hi, lo if anchor is None else anchor]
    region = Region(*(np.ascontiguousarray(values, dtype=np.float64) for values in ends))
    shapes = [values.shape for values in region]
    if len(set(shapes)) != 1 or region.lo.ndim != 2:
        raise AnswerError(
            "the shapes of the domains", shapes, "(points, sides) each", "give a row for each point"
        )
    return region


def _tidy(t: Topologies) -> None:
    """Order the attractors of each point by side and place, and clear what coarser cells left of others."""
    for i in np.flatnonzero(t.attractors > 1):
        count = t.attractors[i]
        lowest = np.fmin.reduce(t.lowest[i, :count], axis=1)  # nan where none was found
        order = np.lexsort((lowest, t.start_side[i, :count]))
        for array in t[2:]:
            if array.ndim > 1:
                array[i, :count] = array[i, order]
    beyond = np.arange(MOST_ATTRACTORS) >= t.attractors[:, None]
    for array in t[2:]:
        if array.ndim > 1:
            array[beyond] = -1 if array.dtype == np.int64 else np.nan
    t.bands[beyond] = 0
