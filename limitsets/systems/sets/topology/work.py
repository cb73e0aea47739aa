"""Arrays of the topology of one parameter point: scratch, made once for a block of points, and what is told of each."""

from __future__ import annotations

import math
from typing import Any, NamedTuple, get_type_hints

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Small = NDArray[np.int32]
Bits = NDArray[np.uint8]
Flags = NDArray[np.bool_]
# The numbers in the arrays that the classes below name.
KINDS = {Floats: np.float64, Ints: np.int64, Small: np.int32, Bits: np.uint8, Flags: np.bool_}

# Orbits from cells that recur though they are left.
STARTS = 20
# More than these are not followed: the point is undecided, and says which of them ran over.
MOST_PIECES, MOST_INTERVALS, MOST_ATTRACTORS = 24, 512, 4


class Region(NamedTuple):
    """The domain: ends of each side, and the point towards which its cells shrink, which is `lo` where they do not."""

    lo: Floats
    hi: Floats
    bottom: Floats


class Samples(NamedTuple):
    """Samples of one side from which its pieces are found: place, deciding number, branch, slope on the branch."""

    x: Floats
    margin: Floats
    branch: Ints
    slope: Floats
    cuts: Floats


class Pieces(NamedTuple):
    """Monotone pieces of all sides, side by side and ascending; a stretch without an image has branch -1.

    `begin` counts those of the sides before; `to` is the side of the images, for branch -1 the code of the exit;
    `cells` counts the cells within.
    """

    begin: Ints
    lo: Floats
    hi: Floats
    y_lo: Floats
    y_hi: Floats
    branch: Ints
    to: Ints
    cells: Ints


class Cells(NamedTuple):
    """Cells of all sides, side by side and ascending, each within one piece.

    `begin` counts those of the sides before; `x`, `y`, `to`, `code` (sides, edges) are edges and their images;
    `first` and `last` the cells that an image meets (none where last < first); `out` bits of the ways out.
    """

    begin: Ints
    x: Floats
    y: Floats
    to: Ints
    code: Ints
    edge: Ints
    lo: Floats
    hi: Floats
    piece: Ints
    image_lo: Floats
    image_hi: Floats
    first: Ints
    last: Ints
    out: Bits
    expands: Flags


class Components(NamedTuple):
    """Scratch of the search for components; of each cell where its starts may end; the label of each closed one."""

    rank: Small
    label: Small
    order: Small
    path: Small
    boxes: Small
    rows: Small
    waiting: Small
    loops: Flags
    ends: Bits
    held: Flags
    closed: Ints
    share: Floats


class Unions(NamedTuple):
    """Unions of intervals, ascending by side and place: a set, an image, what is pushed on, what was covered."""

    side: Ints
    lo: Floats
    hi: Floats
    size: Ints
    seen: Ints


class Starts(NamedTuple):
    """States of several orbits, and their last codes; those of one side together: which, before and after a step."""

    x: Floats
    side: Ints
    code: Ints
    which: Ints
    before: Floats
    after: Floats
    to: Ints
    codes: Ints


class Work(NamedTuple):
    """All of it, and how the cells of a side are placed."""

    shape: Floats
    scan: Floats
    samples: Samples
    pieces: Pieces
    cells: Cells
    components: Components
    unions: Unions
    starts: Starts
    split: Floats


def _made(cls: Any, common: Any, /, **others: Any) -> Any:
    """Make the arrays of a class, each of the kind that it names, all of one shape but for those of `others`."""
    kinds = get_type_hints(cls).items()
    return cls(*(np.zeros(others.get(name, common), KINDS[kind]) for name, kind in kinds))


def _places(cells: int, nearest: float) -> Floats:
    """Edges of cells between 0 and 1: equal ones, and towards an anchor at 0 cells that double from `nearest` on."""
    equal = np.arange(cells + 1) / cells
    if nearest == 0.0:
        return equal
    near = nearest * 2.0 ** np.arange(int(np.log2(1.0 / (nearest * cells))) + 1)
    return np.concatenate([near[near < 0.75 / cells], equal[1:]])


def work_for(region: Region, cells: int, samples: int) -> Work:
    """Make the arrays for `cells` cells and `samples` samples a side of the domains of several points.

    Where these have an anchor, cells shrink towards it down to the least distance that any point has from it, rounded
    to a power of two: what is found of a point must not depend on the last digits of those beside it.
    """
    sides = region.lo.shape[1]
    least = float(((region.lo - region.bottom) / (region.hi - region.bottom)).min())
    nearest = 2.0 ** round(math.log2(least)) if least > 0.0 else 0.0
    shape, scan = _places(cells, nearest), _places(samples, nearest)
    edges, pieces = shape.size + 2 * MOST_PIECES, sides * MOST_PIECES
    n = sides * edges
    of_edges = dict.fromkeys(("x", "y", "to", "code"), (sides, edges))
    return Work(
        shape,
        scan,
        samples=_made(Samples, scan.size, cuts=4 * MOST_PIECES),
        pieces=_made(Pieces, pieces, begin=sides + 1),
        cells=_made(Cells, n, begin=sides + 1, edge=sides, lo=n + 1, hi=n + 1, **of_edges),
        components=_made(Components, n, closed=MOST_ATTRACTORS, share=(n, MOST_ATTRACTORS + 2)),
        unions=_made(Unions, (4, MOST_INTERVALS), size=4, seen=MOST_INTERVALS),
        starts=_made(Starts, STARTS),
        split=np.zeros(MOST_ATTRACTORS + 2),
    )


# ----------------------------------------------------------------
# What is told of each parameter point: arrays whose first axis numbers the points.


DECIDED, TOO_FINE, MOVING, BANDS_JOIN, NOT_ONE, STAYING, UNSURE_EXIT = range(7)
DOUBTS = {
    DECIDED: "decided",
    TOO_FINE: "more pieces, bands or attractors than are followed, or a branch narrower than a sample",
    MOVING: "the ends of a band do not come to rest",
    BANDS_JOIN: "bands that are one or two: a gap below the resolution",
    NOT_ONE: "a closed set of cells may hold several attractors",
    STAYING: "orbits stay where no attractor was found",
    UNSURE_EXIT: "cells may lead out of the domain, none surely does",
}


class Topologies(NamedTuple):
    """Topology of the attractors at n parameter points; K attractors at most, S sides.

    Attributes
    ----------
    attractors : ndarray of int, shape (n,)
        How many.
    undecided : ndarray of int, shape (n,)
        0, or the number of the doubt in `DOUBTS`: nothing else that is told of the point counts then.
    bands : ndarray of int, shape (n, K, S)
        Intervals per side.
    lowest, reach : ndarray, shape (n, K, S)
        Ends of the attractor on each side, nan on one that it does not visit [length].
    jogs_min, jogs_max : ndarray of int, shape (n, K, S)
        Steps that stay on a side between arriving and leaving; -1 where no step arrives.
    flip_order : ndarray of int, shape (n, K, S)
        Sides in the cyclic order in which they are visited, from the smallest, then -1; all -2 where it changes.
    period : ndarray of int, shape (n, K)
        Length of the cycle that the attractor is; 0 where it is none.
    share : ndarray, shape (n, K)
        Of the starts, those that come to the attractor.
    leaves, collapses : ndarray, shape (n,)
        Of the starts, those that leave the domain, and those that come back to the joint.
    flips_per_throw, lyapunov : ndarray, shape (n, K)
        Means along one orbit; nan where they were not asked for.
    flips_per_throw_error, lyapunov_error : ndarray, shape (n, K)
        Their standard errors.
    start, start_side : ndarray, shape (n, K)
        A state of the attractor.
    """

    attractors: Ints
    undecided: Ints
    bands: Ints
    lowest: Floats
    reach: Floats
    jogs_min: Ints
    jogs_max: Ints
    flip_order: Ints
    period: Ints
    share: Floats
    leaves: Floats
    collapses: Floats
    flips_per_throw: Floats
    flips_per_throw_error: Floats
    lyapunov: Floats
    lyapunov_error: Floats
    start: Floats
    start_side: Ints


def empty(points: int, sides: int) -> Topologies:
    """Return arrays for points of which nothing is known."""
    n, k, s = points, MOST_ATTRACTORS, sides

    def ints(*shape: int) -> Ints:
        return np.full(shape, -1, np.int64)

    def floats(*shape: int) -> Floats:
        return np.full(shape, np.nan)

    return Topologies(
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros((n, k, s), np.int64),
        lowest=floats(n, k, s),
        reach=floats(n, k, s),
        jogs_min=ints(n, k, s),
        jogs_max=ints(n, k, s),
        flip_order=ints(n, k, s),
        period=ints(n, k),
        share=floats(n, k),
        leaves=floats(n),
        collapses=floats(n),
        flips_per_throw=floats(n, k),
        flips_per_throw_error=floats(n, k),
        lyapunov=floats(n, k),
        lyapunov_error=floats(n, k),
        start=floats(n, k),
        start_side=ints(n, k),
    )
