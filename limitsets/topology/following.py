"""How far attractors reach at parameters near those at which they are known: images of their hulls, and no cells.

The hull of an attractor on each side, a little shortened, has images that come to rest at the attractor of the near
parameters.  Where a parameter may differ at every throw the images for both of its ends are joined: the part may then
be anywhere between them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.jit import kernel, row_of
from limitsets.maps.contract import kind_of
from limitsets.maps.kernels import image_on, on_side
from limitsets.maps.stacks import point_of, size_of
from limitsets.topology.bands import ANY, GAP, IMAGE, SET, images_of, is_still, merge, put
from limitsets.topology.pieces import find_pieces
from limitsets.topology.records import Topologies
from limitsets.topology.work import MOST_INTERVALS, Pieces, Region, Unions, Work, work_for

Floats = NDArray[np.float64]

# Share of a hull that is left off at either end: its ends are images of the rest.
SHORTER = 0.05
# Half the length of the interval that stands for a state of a cycle, a share of the largest side.
POINT = 1e-9
# Samples of a side for its pieces; images that are taken, and ends that rest move by less, a share of a side.
SAMPLES, MOST_IMAGES, STILL = 48, 2000, 1e-10


@kernel(entry=True, counting=False)
def _begin(scale: float, r: Region, a: int, i: int, t: Topologies, u: Unions) -> None:
    """Make SET the hulls of an attractor, or of a cycle one of its states."""
    u.size[SET] = 0
    if t.period[i, a] > 0:
        x, side, half = t.start[i, a], t.start_side[i, a], POINT * scale
        put(u, SET, side, max(x - half, r.lo[side]), min(x + half, r.hi[side]))
        return
    for side in range(r.lo.size):
        if t.bands[i, a, side] > 0:
            lo, hi = t.lowest[i, a, side], t.reach[i, a, side]
            off = SHORTER * (hi - lo)
            put(u, SET, side, max(lo + off, r.lo[side]), min(hi - off, r.hi[side]))


@kernel(entry=True, counting=False)
def _pieces(params: Any, decided: bool, r: Region, w: Work, p: Pieces) -> bool:
    p.begin[0], whole = 0, True
    for side in range(r.lo.size):
        whole = whole and find_pieces(on_side(params, side), side, decided, r, w.scan, w.samples, p)
    return whole


@kernel(entry=True, counting=False)
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


@kernel(entry=True, counting=False)
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
def _told(u: Unions, out: Any) -> None:
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
        found = _pieces(one, decided, r, w, w.pieces) and (
            not joined or _pieces(two, decided, r, v, v.pieces)
        )
        for a in range(t.attractors[i]):
            _begin(scale, r, a, i, t, w.unions)
            cycle = t.period[i, a] > 0
            found = found and _rests(one, two, joined, cycle, scale, r, w.pieces, v.pieces, w.unions)
            if found:
                _told(w.unions, out[k])
        if not found:
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
