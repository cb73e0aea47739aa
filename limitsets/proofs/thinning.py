"""Almost every orbit leaves some cells: what stays in them thins out.

Let the starts be spread evenly over the cells, with density 1, and look only at those that have not left.  After one
more throw their density at y is the sum of (density at x) / |slope at x| over all x that are thrown to y.  Along a run
of neighbouring cells where the slope is proved positive a jog is continuous and rises, and so does a flip: one x at
most for each run and branch.  So with a bound b(c) of the density on every cell c, after the next throw

    b'(j)  <=  sum over runs and branches of  max { b(c) / slope(c) : c of the run, its images meet j }.

Where the largest bound falls below 1 after n throws it is below its k-th power after k n: the starts that never leave
have length zero.  With noise the same holds of every sequence of throws, each of which is one map.

Cells of different groups are told apart: an orbit that goes from one group to another has left the first.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.proofs.cover import Cover, targets
from limitsets.proofs.expansion import slopes

__all__ = ["Thinning", "thinned"]

Mask = NDArray[np.bool_]

# Throws after which it is given up.
MOST = 4000

# After so many, and each time twice as many, a group is given up where at the pace since half of them it would not do.
PACE = 512

# It is given up, too, where a bound has grown so large.
HOPELESS = 1e100

# Slopes are lessened by this share of them, and bounds enlarged, against rounding and so that others can confirm them.
SLACK = 2.0**-20


class Thinning(NamedTuple):
    """What became of the cells.

    Attributes
    ----------
    throws : int
        After so many the bounds of every group that thins out have been below 1.
    thick : ndarray of bool, shape (n_cells,)
        Cells of the groups of which it is not proved.
    reason : str
        What is missing, empty if nothing.
    """

    throws: int
    thick: Mask
    reason: str


def thinned(found: Cover, cells: Mask, group: NDArray[np.int32] | None = None) -> Thinning:
    """Prove that almost every start leaves the cells.

    Parameters
    ----------
    found : Cover
        Cells and images.
    cells : ndarray of bool, shape (n_cells,)
        The cells to be left; an image that leads elsewhere has left.
    group : ndarray of int, shape (n_cells,), optional
        Groups of the cells; default, all are one.

    Returns
    -------
    Thinning
    """
    of = np.zeros(cells.size, np.int64) if group is None else np.unique(group, return_inverse=True)[1]
    thick = np.zeros(of.max(initial=0) + 1, dtype=bool)
    steep = slopes(found, CellSet(found.grid, cells))
    flat = np.flatnonzero(cells & ~(steep > 0.0))
    thick[of[flat]] = True
    if flat.size:
        reason = f"the slope is not proved positive on {found.place(int(flat[0]))}"
    elif any(branch not in (0, 1) for images in found.images for _, branch in images.hulls):
        thick[:] = True
        reason = "some throws roll on, and of these it is not proved in this version that they thin out"
    else:
        reason = ""
    throws = _rounds(found, cells & ~thick[of], steep, of, thick)
    if not reason and thick[of[cells]].any():
        reason = f"after {throws} throws the orbits that have not left are not proved to thin out"
    return Thinning(throws, cells & thick[of], reason)


def _rounds(found: Cover, left: Mask, steep: NDArray[np.float64], of: NDArray[np.int64], thick: Mask) -> int:
    """Bound the densities throw by throw; mark the groups that do not thin out, and count the throws of the others."""
    source, first, count = _groups(found, left, of)
    factor = (1.0 + SLACK) / steep[source]
    bound = np.where(left, 1.0, 0.0)
    goes = np.unique(first)
    waiting = np.zeros(thick.size, dtype=bool)
    waiting[of[left]] = True
    half, check = np.full(thick.size, math.inf), PACE
    last = 0
    for throws in range(1, MOST + 1):
        if source.size:
            bound = np.bincount(count, np.maximum.reduceat(bound[source] * factor, goes), minlength=left.size)
        else:
            bound = np.zeros(left.size)
        largest = np.zeros(thick.size)
        np.maximum.at(largest, of[left], bound[left])
        done = waiting & (largest < 1.0)
        if done.any():
            last, waiting = throws, waiting & ~done
        if not waiting.any():
            break
        if 2 * throws == check:
            half = largest
        hopeless = waiting & ~(largest < HOPELESS)
        if throws == check:
            with np.errstate(divide="ignore", invalid="ignore"):
                pace = np.log(half / largest) / (check / 2)
                hopeless |= waiting & ~(np.log(largest) <= pace * (MOST - throws))
            half, check = largest, 2 * check
        thick |= hopeless
        waiting &= ~hopeless
    thick |= waiting
    return last if last else throws


def _groups(
    found: Cover, left: Mask, of: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Edges among the cells left, within their groups, ordered by target, branch and run.

    Returns their sources, where the group of each one begins, and the target of each group.
    """
    number = np.flatnonzero(left)
    offset = found.grid.offset
    new = np.ones(number.size, dtype=bool)
    new[1:] = (np.diff(number) > 1) | np.isin(number[1:], offset)
    run = np.cumsum(new)
    edges = []
    for branch in (0, 1):
        ends = targets(found, branch)[number]
        some = np.flatnonzero(ends[:, 0] >= 0)
        width = ends[some, 1] - ends[some, 0] + 1
        source = np.repeat(some, width)
        step = np.arange(source.size) - np.repeat(np.cumsum(width) - width, width)
        to = ends[source, 0] + step
        kept = left[to] & (of[to] == of[number[source]])
        key = 2 * run[source[kept]] + branch
        edges.append((number[source[kept]], to[kept].astype(np.int64), key))
    source, to, key = (np.concatenate(part) for part in zip(*edges, strict=True))
    order = np.lexsort((key, to))
    source, to, key = source[order], to[order], key[order]
    begins = np.ones(to.size, dtype=bool)
    begins[1:] = (np.diff(to) != 0) | (np.diff(key) != 0)
    start = np.flatnonzero(begins)
    return source, np.repeat(start, np.diff([*start, to.size])), to[start]
