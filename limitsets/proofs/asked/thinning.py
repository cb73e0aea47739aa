"""Almost every orbit comes to the cells wanted: what has not arrived yet thins out.

Let the starts be spread evenly over the cells, with density 1, and look only at those that have not come to a wanted
cell.  After one more throw their density at y is the sum of (density at x) / |slope at x| over all x that are thrown
to y.  Along a run of neighbouring cells where the slope is proved positive a jog is continuous and rises, and so does a
flip: one x at most for each run and branch.  So with a bound b(c) of the density on every cell c, after the next throw

    b'(j)  <=  sum over runs and branches of  max { b(c) / slope(c) : c of the run, its images meet j }.

Where the largest bound falls below 1 after n throws it is below its k-th power after k n: the starts that never arrive
have length zero.  With noise the same holds of every sequence of throws, each of which is one map.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.certificate import targets
from limitsets.proofs.expansion import slopes

__all__ = ["thinned"]

Mask = NDArray[np.bool_]

# Throws after which it is given up.
MOST = 4000

# After so many, and each time twice as many, it is given up where at the pace since half of them it would not do.
PACE = 512

# It is given up, too, where a bound has grown so large.
HOPELESS = 1e100

# Slopes are lessened by this share of them, and bounds enlarged, against rounding and so that others can confirm them.
SLACK = 2.0**-20


def thinned(found: Attraction, cells: Mask, wanted: Mask) -> tuple[int, str]:
    """Count the throws after which the density of what has not arrived is proved to have fallen.

    Parameters
    ----------
    found : Attraction
        Cells and images.
    cells : ndarray of bool, shape (n_cells,)
        Cells that no image leaves.
    wanted : ndarray of bool, shape (n_cells,)
        Where starts have to come.

    Returns
    -------
    int
        Throws.
    str
        What is missing, empty if it is proved.
    """
    left = cells & ~wanted
    steep = slopes(found.cover, CellSet(found.cover.grid, left))
    flat = np.flatnonzero(left & ~(steep > 0.0))
    if flat.size:
        side = int(found.cover.grid.side_of(flat[0]))
        lo, hi = found.cover.grid.boxes([flat[0]], side)
        return 0, f"the slope is not proved positive on side {side}, x in [{lo[0, 0]:.6g}, {hi[0, 0]:.6g}]"
    if any(of not in (0, 1) for images in found.cover.images for _, of in images.hulls):
        return 0, "some throws roll on, and of these it is not proved in this version that they thin out"
    source, first, count = _groups(found, left)
    factor = (1.0 + SLACK) / steep[source]
    bound = np.where(left, 1.0, 0.0)
    goes = np.unique(first)
    check, half = PACE, math.inf
    for throws in range(1, MOST + 1):
        if not source.size:
            return throws, ""
        most = np.maximum.reduceat(bound[source] * factor, goes)
        bound = np.bincount(count, most, minlength=left.size)
        if bound.max() < 1.0:
            return throws, ""
        largest = float(bound.max())
        if largest > HOPELESS:
            break
        if 2 * throws == check:
            half = largest
        if throws == check:
            pace = math.log(half / largest) / (check / 2)
            if math.log(largest) > pace * (MOST - throws):
                break
            check *= 2
            half = largest
    return 0, f"after {throws} throws the orbits that have not arrived are not proved to thin out"


def _groups(found: Attraction, left: Mask) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Edges among the cells left, ordered by target, branch and run.

    Returns their sources, where the group of each one begins, and the target of each group.
    """
    number = np.flatnonzero(left)
    offset = found.cover.grid.offset
    new = np.ones(number.size, dtype=bool)
    new[1:] = (np.diff(number) > 1) | np.isin(number[1:], offset)
    run = np.cumsum(new)
    edges = []
    for branch in (0, 1):
        ends = targets(found.cover, branch)[number]
        some = np.flatnonzero(ends[:, 0] >= 0)
        width = ends[some, 1] - ends[some, 0] + 1
        source = np.repeat(some, width)
        step = np.arange(source.size) - np.repeat(np.cumsum(width) - width, width)
        to = ends[source, 0] + step
        kept = left[to]
        key = 2 * run[source[kept]] + branch
        edges.append((number[source[kept]], to[kept].astype(np.int64), key))
    source, to, key = (np.concatenate(part) for part in zip(*edges, strict=True))
    order = np.lexsort((key, to))
    source, to, key = source[order], to[order], key[order]
    begins = np.ones(to.size, dtype=bool)
    begins[1:] = (np.diff(to) != 0) | (np.diff(key) != 0)
    start = np.flatnonzero(begins)
    return source, np.repeat(start, np.diff([*start, to.size])), to[start]
