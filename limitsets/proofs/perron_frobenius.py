"""A density bound by the Perron-Frobenius operator: almost every orbit leaves some cells (thinning).

Let the starts be spread evenly over the cells, with density 1, and consider only those that have not left.  After one
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

__all__ = ["DensityBound", "perron_frobenius_bound"]

Mask = NDArray[np.bool_]

# Throws after which it is given up.
MOST = 4000

# After so many, and each time twice as many, a group is given up where at the pace since half of them it would not do.
PACE = 512

# It is given up, too, where a bound has grown so large.
HOPELESS = 1e100

# Slopes are lessened by this share of them, and bounds enlarged, against rounding and so that others can confirm them.
SLACK = 2.0**-20


class DensityBound(NamedTuple):
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


def perron_frobenius_bound(found: Cover, cells: Mask, group: NDArray[np.int32] | None = None) -> DensityBound:
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
    DensityBound
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
    return DensityBound(throws, cells & thick[of], reason)


def _rounds(found: Cover, left: Mask, steep: NDArray[np.float64], of: NDArray[np.int64], thick: Mask) -> int:
    """Bound the densities throw by throw; mark the groups that do not thin out, and count the throws of the others."""
    number = np.flatnonzero(left)
    each = _stretches(found, left, number, of)
    largest_on = _Largest(each, number.size)
    factor = (1.0 + SLACK) / steep[number]
    bound = np.where(left, 1.0, 0.0)
    waiting = np.zeros(thick.size, dtype=bool)
    waiting[of[left]] = True
    half, check = np.full(thick.size, math.inf), PACE
    last = 0
    for throws in range(1, MOST + 1):
        if each.begins.size:
            most = np.maximum.reduceat(largest_on(bound[number] * factor), each.begins)
            bound = np.bincount(each.target, most, minlength=left.size)
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


class _Stretches(NamedTuple):
    """Neighbouring sources whose images by one branch all meet one target, ordered by target, run and branch.

    Attributes
    ----------
    first, last : ndarray of int, shape (n,)
        Their ends, among the cells left.
    begins : ndarray of int, shape (m,)
        Where the stretches of a target, run and branch begin.
    target : ndarray of int, shape (m,)
        The target of each of these groups.
    """

    first: NDArray[np.int64]
    last: NDArray[np.int64]
    begins: NDArray[np.int64]
    target: NDArray[np.int64]


def _stretches(found: Cover, left: Mask, number: NDArray[np.int64], of: NDArray[np.int64]) -> _Stretches:
    """Find the stretches among the cells left, `number`, within their groups.

    Images of neighbours overlap, so a stretch is told by its ends: where the image of a cell meets a target and that
    of the cell before it, or behind it, does not.  There are far fewer of these than of cells and targets that meet.
    """
    new = np.ones(number.size, dtype=bool)
    new[1:] = (np.diff(number) > 1) | np.isin(number[1:], found.grid.offset)
    run = np.cumsum(new)
    new[1:] |= np.diff(of[number]) != 0
    apart = np.append(new, True)
    parts = []
    for branch in (0, 1):
        ends = targets(found, branch)[number].astype(np.int64)
        pairs = [_only_here(ends, apart[:-1], 1), _only_here(ends, apart[1:], -1)]
        kept = [left[to] & (of[to] == of[number[source]]) for source, to in pairs]
        (first, to), (last, _) = (
            (source[which][order], to[which][order])
            for (source, to), which in zip(pairs, kept, strict=True)
            for order in [np.lexsort((source[which], to[which]))]
        )
        parts.append((first, last, to, 2 * run[first] + branch))
    first, last, to, key = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.lexsort((first, key, to))
    first, last, to, key = first[order], last[order], to[order], key[order]
    begins = np.ones(to.size, dtype=bool)
    begins[1:] = (np.diff(to) != 0) | (np.diff(key) != 0)
    return _Stretches(first, last, np.flatnonzero(begins), to[begins])


def _only_here(
    ends: NDArray[np.int64], apart: Mask, step: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of a cell and a target that its image meets and that of its neighbour, `step` before it, does not."""
    none = ends[:, 0] < 0
    beside = np.roll(ends, step, axis=0)
    beside[apart | np.roll(none, step)] = np.iinfo(np.int64).max // 2
    pieces = np.concatenate(
        [
            np.stack([ends[:, 0], np.minimum(ends[:, 1], beside[:, 0] - 1)], axis=1),
            np.stack([np.maximum(ends[:, 0], beside[:, 1] + 1), ends[:, 1]], axis=1),
        ]
    )
    source = np.tile(np.arange(len(ends)), 2)
    some = (pieces[:, 0] <= pieces[:, 1]) & ~none[source]
    width = pieces[some, 1] - pieces[some, 0] + 1
    within = np.arange(width.sum()) - np.repeat(np.cumsum(width) - width, width)
    return np.repeat(source[some], width), np.repeat(pieces[some, 0], width) + within


class _Largest:
    """The largest of some values on each of the stretches, by the largest of 1, 2, 4 ... neighbours."""

    def __init__(self, each: _Stretches, size: int) -> None:
        level = np.frexp(each.last - each.first + 1)[1].astype(np.int64) - 1
        self.table = np.zeros((int(level.max(initial=0)) + 1, size))
        self.one = level * size + each.first
        self.other = level * size + each.last + 1 - 2**level

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return it for values of the cells left."""
        table = self.table
        table[0] = values
        for level in range(1, len(table)):
            half, end = 2 ** (level - 1), values.size - 2**level + 1
            np.maximum(table[level - 1, :end], table[level - 1, half : half + end], out=table[level, :end])
        flat = table.reshape(-1)
        most: NDArray[np.float64] = np.maximum(flat[self.one], flat[self.other])
        return most
