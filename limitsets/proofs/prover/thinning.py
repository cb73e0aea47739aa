"""Expansion on attracting cells, and a density bound (Perron-Frobenius): almost every orbit leaves some cells.

Let the starts be spread evenly over the cells, with density 1, and consider only those that have not left.  After one
more throw their density at y is the sum of (density at x) / |slope at x| over all x that are thrown to y.  Along a run
of neighbouring cells where the slope is proved positive a jog is continuous and rises, and so does a flip: one x at
most for each run and branch.  So with a bound b(c) of the density on every cell c, after the next throw

    b'(j)  <=  sum over runs and branches of  max { b(c) / slope(c) : c of the run, its images meet j }.

Where the largest bound falls below 1 after n throws it is below its k-th power after k n: the starts that never leave
have length zero.  With noise the same holds of every sequence of throws, each of which is one map.

These bounds are monotone and proportional to those before (Collatz and Wielandt's inequalities): where each bound is at
most a share below 1 of what it was m throws ago, it is at most that share again after m more, and so on; where some
bounds, all others left out, keep a share of themselves after one throw, they keep it after each.  So it is known long
before whether bounds fall below 1.

Cells of different groups are kept apart: an orbit that goes from one group to another has left the first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.thrower.effects.landing import Landing
from limitsets.feeder.thrower.flight_box import bracket
from limitsets.feeder.thrower.motion import FullThrow
from limitsets.feeder.thrower.params import gather_box
from limitsets.feeder.thrower.throw_box import slope_between, sure_slope_box
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import entry_of, proof_kernel
from limitsets.proofs.prover.cover import Cover, targets
from limitsets.systems.cells import CellSet

# ----------------------------------------------------------------
# Expansion: |dx'/dx| > 1 on every attracting cell.
#
# Then no periodic orbit in the limit set attracts, so the limit set is no attracting cycle; and every interval in it
# grows until it meets a critical point, so the topological entropy is at least the logarithm of the least slope.


# Cells are cut into this many pieces, so that the slope is not lost in the width of a cell; where a slope of each cell
# is asked for, and there are more cells than this on a side, into fewer.
PIECES, MANY = 8, 512


@proof_kernel(entry=True)
def _slopes(lo_map: Any, hi_map: Any, side: int, cuts: Any, out: Any) -> None:
    b = gather_box(lo_map, hi_map, side)
    for k in range(out.shape[0]):
        last, fine = bracket(b.flight, b, cuts[k, 0])
        for j in range(out.shape[1]):
            first, good = last, fine
            last, fine = bracket(b.flight, b, cuts[k, j + 1])
            x = Interval(cuts[k, j], cuts[k, j + 1])
            slope, proved = slope_between(b, x, first, last, good & fine)
            if not proved:  # parameters so wide that the fast bracket of the impact angle is not confirmed
                slope, proved = sure_slope_box(b, x)
            out[k, j] = slope.lo if proved else -1.0


def least_slope(cover: Cover, cells: CellSet) -> tuple[float, str]:
    """Lower bound of the slope on the given cells (the same for a jog, a flip and a roll), and where it is met.

    Returns
    -------
    float
        The bound; at most 1 if expansion is not proved.
    str
        The side and cell of the least slope.
    """
    least, place = np.inf, ""
    for side, _, cuts, out in _pieces(cover, cells):
        k, j = divmod(int(out.argmin()), PIECES)
        if out[k, j] < least:
            least, place = float(out[k, j]), f"side {side}, x in [{cuts[k, j]:.6g}, {cuts[k, j + 1]:.6g}]"
    return least, place


def slopes(cover: Cover, cells: CellSet) -> Array:
    """Lower bounds of the slope on each of the given cells; nan on the others, -1 where nothing is proved."""
    least = np.full(cover.grid.n_cells, np.nan)
    for side, k, _, out in _pieces(cover, cells, MANY):
        least[cover.grid.offset[side] + k] = out.min(axis=1)
    return least


def _pieces(cover: Cover, cells: CellSet, many: float = np.inf) -> Iterator[tuple[int, Any, Any, Any]]:
    """Per side: the cells, the cuts between their pieces, and a lower bound of the slope on each piece."""
    for side, (edges,) in enumerate(cover.grid.edges):
        k = np.flatnonzero(cells.mask[cover.grid.of_side(side)])
        if not k.size:
            continue
        pieces = int(np.ceil(PIECES * min(1.0, many / k.size)))
        weights = np.arange(pieces + 1) / pieces
        cuts = edges[k][:, None] + weights * (edges[k + 1] - edges[k])[:, None]
        cuts[:, -1] = edges[k + 1]
        out = np.empty((k.size, pieces))
        _slopes(*cover.box.bare, side, cuts, out)
        lowest = cover.box.lo
        if isinstance(lowest, FullThrow) and entry_of(lowest.effects, Landing) is not None:
            # where another vertex may land the displacement is another function
            late = ~(cover.images[side].witness[1, k] <= lowest.bare.corner[side])
            out[late] = -1.0
        yield side, k, cuts, out


# ----------------------------------------------------------------
# A density bound by the Perron-Frobenius operator: almost every orbit leaves some cells (thinning).


# Throws after which bounds have to be below 1.
MOST = 4000

# After so many, and each time twice as many, bounds are kept to be compared with later ones.
FIRST = 32

# Tries to find bounds that keep a share of themselves.
TRIES = 8

# The proof is given up, too, where a bound has grown so large.
HOPELESS = 1e100

# Slopes are lessened by this share of them, and bounds enlarged, against rounding and so that others can confirm them.
SLACK = 2.0**-20


class DensityBound(NamedTuple):
    """The groups of cells that almost every start leaves, and those of which this is not proved.

    Attributes
    ----------
    throws : int
        After so many, or fewer, the bounds of every group that thins out are below 1.
    thick : ndarray of bool, shape (n_cells,)
        Cells of the groups that are not proved to thin out.
    reason : str
        What is missing, empty if nothing.
    """

    throws: int
    thick: Mask
    reason: str


def perron_frobenius_bound(cover: Cover, cells: Mask, group: NDArray[np.int32] | None = None) -> DensityBound:
    """Prove that almost every start leaves the cells.

    Parameters
    ----------
    cover : Cover
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
    steep = slopes(cover, CellSet(cover.grid, cells))
    flat = np.flatnonzero(cells & ~(steep > 0.0))
    thick[of[flat]] = True
    if flat.size:
        reason = f"the slope is not proved positive on {cover.place(int(flat[0]))}"
    elif any(branch not in (0, 1) for images in cover.images for _, branch in images.hulls):
        thick[:] = True
        reason = "some throws roll on, and of these it is not proved in this version that they thin out"
    else:
        reason = ""
    throws = _rounds(cover, cells & ~thick[of], steep, of, thick)
    if not reason and thick[of[cells]].any():
        reason = f"after {throws} throws the orbits that have not left are not proved to thin out"
    return DensityBound(throws, cells & thick[of], reason)


def _rounds(cover: Cover, left: Mask, steep: Array, of: Ints, thick: Mask) -> int:
    """Bound the densities throw by throw; mark the groups that do not thin out, and count the throws of the others."""
    number = np.flatnonzero(left)
    thrown = _Thrown(_stretches(cover, left, number, of), (1.0 + SLACK) / steep[number])
    names, group = np.unique(of[number], return_inverse=True)
    waiting, largest_of = np.ones(names.size, dtype=bool), _largest_of(group)
    bound, earlier, since = np.ones(number.size), np.zeros(number.size), 0
    last = throws = 0
    while waiting.any() and throws < MOST:
        throws += 1
        bound = np.where(waiting[group], thrown(bound), 0.0)
        largest = largest_of(bound)
        ends = np.where(
            largest < 1.0, throws, _ends(largest, largest_of(_share(bound, earlier)), throws, since)
        )
        done = waiting & (ends <= MOST)
        last = max(last, int(ends[done].max(initial=0.0)))
        hopeless = waiting & ~done & ~(largest < HOPELESS)
        if throws >= FIRST and throws & (throws - 1) == 0:
            # what keeps this share at every throw is not below 1 after the last
            share = np.maximum(largest, 1.0) ** (-1.0 / max(MOST - throws, 1))
            hopeless |= waiting & ~done & (largest_of(_keeping(thrown, bound, share[group])) >= largest)
            earlier, since = bound, throws
        thick[names[hopeless]] = True
        waiting &= ~(done | hopeless)
    thick[names[waiting]] = True
    return last if last else throws


def _share(bound: Array, earlier: Array) -> Array:
    """Divide bounds by earlier ones: what was 0 and is not has grown without limit."""
    return np.divide(bound, earlier, out=np.where(bound > 0.0, np.inf, 0.0), where=earlier > 0.0)


def _ends(largest: Array, share: Array, throws: int, since: int) -> Array:
    """Count the throws after which bounds are below 1 that are at most a share of those after throw `since`."""
    with np.errstate(divide="ignore", invalid="ignore"):
        again = np.floor(np.log(largest) / -np.log(share)) + 1.0
    return np.where(share < 1.0, throws + again * (throws - since), np.inf)


def _keeping(thrown: _Thrown, bound: Array, share: Array) -> Array:
    """Find bounds that, with 0 for all others, keep a share of themselves after a throw; 0 where none are found."""
    for _ in range(TRIES):
        kept = np.where(thrown(bound) >= share * bound, bound, 0.0)
        if (kept == bound).all():
            return kept
        bound = kept
    return np.zeros(bound.size)


class _Stretches(NamedTuple):
    """Neighbouring sources whose images by one branch all meet one target, ordered by target, run and branch.

    Attributes
    ----------
    first, last : ndarray of int, shape (n,)
        Their ends, among the cells left.
    begins : ndarray of int, shape (m,)
        Where the stretches of a target, run and branch begin.
    target : ndarray of int, shape (m,)
        The target of each of these groups, among the cells left.
    """

    first: Ints
    last: Ints
    begins: Ints
    target: Ints


def _stretches(cover: Cover, left: Mask, number: Ints, of: Ints) -> _Stretches:
    """Find the stretches among the cells left, `number`, within their groups.

    Images of neighbours overlap, so a stretch is told by its ends: where the image of a cell meets a target and that
    of the cell before it, or behind it, does not.  There are far fewer of these than of cells and targets that meet.
    """
    new = np.ones(number.size, dtype=bool)
    new[1:] = (np.diff(number) > 1) | np.isin(number[1:], cover.grid.offset)
    run = np.cumsum(new)
    new[1:] |= np.diff(of[number]) != 0
    apart = np.append(new, True)
    parts = []
    for branch in (0, 1):
        ends = targets(cover, branch)[number].astype(np.int64)
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
    return _Stretches(first, last, np.flatnonzero(begins), np.searchsorted(number, to[begins]))


def _only_here(ends: Ints, apart: Mask, step: int) -> tuple[Ints, Ints]:
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

    def __call__(self, values: Array) -> Array:
        """Return it for values of the cells left."""
        table = self.table
        table[0] = values
        for level in range(1, len(table)):
            half, end = 2 ** (level - 1), values.size - 2**level + 1
            np.maximum(table[level - 1, :end], table[level - 1, half : half + end], out=table[level, :end])
        flat = table.reshape(-1)
        most: Array = np.maximum(flat[self.one], flat[self.other])
        return most


class _Thrown:
    """Bounds of the densities on the cells left, after one more throw."""

    def __init__(self, each: _Stretches, factor: Array) -> None:
        self.each, self.factor, self.largest = each, factor, _Largest(each, factor.size)

    def __call__(self, bound: Array) -> Array:
        """Return them for bounds before it."""
        if not self.each.begins.size:
            return np.zeros(bound.size)
        most = np.maximum.reduceat(self.largest(bound * self.factor), self.each.begins)
        return np.asarray(np.bincount(self.each.target, most, minlength=bound.size), dtype=np.float64)


def _largest_of(group: Ints) -> Callable[[Array], Array]:
    """Return the function that gives the largest of some values in each group."""
    order = np.argsort(group, kind="stable")
    begins = np.flatnonzero(np.diff(group[order], prepend=-1))
    return lambda values: np.asarray(np.maximum.reduceat(values[order], begins))
