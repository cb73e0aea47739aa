"""The mean of a function after a random move, bounded for every start: one step of the proof.

A function V is continuous and affine on the cells of `target`.  Its mean M(x) after the move is computed at the nodes
of `source` (a sparse matrix: hat functions are integrated against densities that are constant between places), and lies
above the chord between two nodes by at most

    h^2/8 max(0, -M''),     or    h/4 (oscillation of M'),

and parts of M may be bounded by the one, parts by the other.  M'' is a sum of slopes of V at the places where
densities jump ("bends"), and of terms bounded by the total variation of V where moves land ("swings").  Where
the branch is not decided, the bound is the difference of the values that V may have ("gaps").

Rounding, with u = 2^-53.  The entries of a row are >= 0 with a sum of 1, each computed by fewer than 12 operations from
places that are doubles, a share 1 - s of a node to u rather than to u (1 - s); entries of one node are merged, at most
four from each of two runs of 192 strata; so in whatever order scipy adds them up, a mean of k entries is off by less
than (k + 768 + 12) u times the largest |V|: `rounding_of`, never below `ROUNDING`, which covers the few additions after
it.  Slopes and extremes have one rounding of their own size, which `MORE` inflates; running sums of n terms, whose
differences stand for sums over spans, are off by less than n u times the whole sum, which is added (`running`).
Slopes across the nodes of a jump are so large that running sums would lose the others: they are counted, not added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Ints

# ----------------------------------------------------------------
# Cells of a function that is continuous and affine on each: nodes per side, and those where it may jump.
#
# Where a function jumps (the border of an absorbing set, the joint, the arm's end) there are nodes so close together
# that a continuous bound from either side costs nothing.  Beyond the last places a function is constant: one long
# cell.


# How near to a jump the next nodes lie, relative to the arm.
CLOSE = 2.0**-33
# Beyond the arm functions are constant up to so many arms' lengths; nothing lands farther.
FAR = 100.0
# The narrowest cells near the joint, and places at which the graded ones are counted.
NARROWEST, TABLE = 0.11, 4097


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of all sides in one row.

    Attributes
    ----------
    place : ndarray, shape (n,)
        Places x, growing on each side [length].
    first : ndarray of int, shape (n_sides + 1,)
        Number of the first node of each side.
    """

    place: Array
    first: Ints

    @property
    def width(self) -> Array:
        """Width of the cell to the right of each node; infinite to the right of the last one of a side."""
        width = np.diff(self.place, append=np.inf)
        width[self.first[1:] - 1] = np.inf
        return width

    def of_side(self, side: int) -> slice:
        """Return the nodes of a side."""
        return slice(int(self.first[side]), int(self.first[side + 1]))

    def side(self) -> Ints:
        """Return the side of each node."""
        return np.repeat(np.arange(self.first.size - 1), np.diff(self.first))

    def cell(self, side: Ints, x: Array) -> Ints:
        """Return the cells, named by their left nodes, in which places lie."""
        cells = np.empty(x.shape, dtype=np.int64)
        for k in range(self.first.size - 1):
            here = side == k
            row = self.place[self.of_side(k)]
            inside = np.searchsorted(row, x[here], side="right") - 1
            cells[here] = self.first[k] + np.clip(inside, 0, row.size - 2)
        return cells


def extra(graded: float) -> float:
    """Return by how much longer a side is, counted in cells, where those near the joint are narrower."""
    return graded * float(np.log(1.0 / NARROWEST))


def _even(lo: float, hi: float, width: float, graded: float) -> tuple[Array, Array]:
    """Places whose distances grow in proportion to that from the joint up to `graded`, and the distances."""
    if not 0.0 < graded < hi - lo:
        count = int(np.ceil((hi - lo) / width))
        return np.linspace(lo, hi, count + 1), np.full(count + 1, width)
    x = np.unique(np.concatenate([np.linspace(0.0, graded, TABLE), [NARROWEST * graded, hi - lo]]))
    share = np.clip(x / graded, NARROWEST, 1.0)
    steps = np.diff(x) / share[:-1]
    inner = (x[:-1] >= NARROWEST * graded) & (x[1:] <= graded)
    steps[inner] = graded * np.diff(np.log(np.maximum(x, 1e-300)))[inner]
    total = np.concatenate([[0.0], np.cumsum(steps)])
    count = int(np.ceil(total[-1] / width))
    at = np.interp(np.linspace(0.0, total[-1], count + 1), total, x)
    places = np.clip(lo + at, lo, hi)
    places[0], places[-1] = lo, hi
    return places, width * np.clip(at / graded, NARROWEST, 1.0)


def nodes_of(
    ends: Sequence[tuple[float, float]],
    width: float,
    special: Sequence[Sequence[float]],
    far: float,
    without: Sequence[Sequence[tuple[float, float]]] | None = None,
    graded: float = 0.0,
) -> Nodes:
    """Place nodes at distances of about `width`, closer near the joint, and at the special places.

    Parameters
    ----------
    ends : sequence of (float, float)
        Per side where functions begin and cease to vary.
    width : float
        Widest cell between them.
    special : sequence of sequence of float
        Per side further nodes.
    far : float
        The outermost nodes lie at - and + this.
    without : sequence of sequence of (float, float), optional
        Per side where no nodes are wanted but the special ones.
    graded : float
        So far beyond the joint cells are narrower, by at most `NARROWEST`: a function of the start varies the more
        quickly the more throws are to come.
    """
    rows = []
    for (lo, hi), more, gone in zip(ends, special, without or [()] * len(ends), strict=True):
        even, own = _even(lo, hi, width, graded)
        places = np.array([x for x in more if lo <= x <= hi])
        # No even node so near to a special one that cells of no use arise.
        near = np.searchsorted(np.sort(places), even[:, None] + np.array([-0.02, 0.02]) * own[:, None])
        keep = (near[:, 0] == near[:, 1]) | (even == lo) | (even == hi)
        for begin, end in gone:
            keep &= (even <= begin) | (even >= end)
        rows.append(np.unique(np.concatenate([[-far, far], even[keep], places])))
    return Nodes(np.concatenate(rows), np.cumsum([0, *(row.size for row in rows)]))


# ----------------------------------------------------------------
# Spans of cells of the averaged function, and the quantities of the function on them that bound a mean.


class Span(NamedTuple):
    """Cells of the target from `first` to `last`, both of them included; one pair for each entry."""

    first: Ints
    last: Ints


class Swings(NamedTuple):
    """To `row` is added `much` times the total variation of V on a span."""

    row: Ints
    much: Array
    span: Span


class Bends(NamedTuple):
    """To 8/h^2 of `cell`'s deficit comes a coefficient in [lo, hi] times the slope of V on a span.

    Where that says less, the deficit grows by `cap` times the total variation of V there instead.
    """

    cell: Ints
    lo: Array
    hi: Array
    cap: Array
    span: Span


class Gaps(NamedTuple):
    """To `row` is added `much` times the difference of the largest and the smallest V on two spans together."""

    row: Ints
    much: Array
    one: Span
    two: Span


class Kinks(NamedTuple):
    """To `cell`'s deficit comes `much` times the sum of what the slope of V falls by at the nodes within a span.

    Or `even` times the largest fall of the slope per length, where that is less; and `bow` times the largest slope.
    """

    cell: Ints
    much: Array
    even: Array
    bow: Array
    span: Span


class Curvature(NamedTuple):
    """One way to bound the deficits of some cells by curvature."""

    cells: Ints
    bends: tuple[Bends, ...] = ()
    swings: tuple[Swings, ...] = ()
    kinks: tuple[Kinks, ...] = ()
    gaps: tuple[Gaps, ...] = ()


class Running(NamedTuple):
    """Running sums of numbers >= 0, from 0 on, and a bound of the rounding of a difference of two."""

    total: Array
    off: float

    def between(self, first: Ints, last: Ints) -> Array:
        """Bound the sum of the numbers from `first` up to the one before `last` from above."""
        bound: Array = self.total[last] - self.total[first] + self.off
        return bound


def running(numbers: Array) -> Running:
    """Add numbers up, one after the other."""
    total = np.concatenate([[0.0], np.cumsum(numbers)])
    return Running(total, numbers.size * 2.0**-52 * float(total[-1]))


class Windows:
    """Largest and smallest values on spans of an array: by windows of 2, 4, 8 ... that overlap."""

    def __init__(self, span: Span) -> None:
        level = np.frexp(span.last - span.first + 1)[1] - 1
        last = span.last - (1 << level) + 1
        self.count, self.groups = level.size, []
        for each in range(int(level.max(initial=0)) + 1):
            here = np.flatnonzero(level == each)
            self.groups.append((here, span.first[here], last[here]))

    def ends(self, values: Array) -> tuple[Array, Array]:
        """Return the smallest and the largest."""
        lo, hi = np.empty(self.count), np.empty(self.count)
        least = most = values
        for level, (here, first, last) in enumerate(self.groups):
            if level:
                half = 1 << (level - 1)
                least = np.minimum(least[:-half], least[half:])
                most = np.maximum(most[:-half], most[half:])
            if here.size:
                lo[here] = np.minimum(least[first], least[last])
                hi[here] = np.maximum(most[first], most[last])
        return lo, hi


ROUNDING = 2.0**-40
# Entries merged into one at most, and operations that make one, rounded up.
MERGED = 1024
MORE = 1.0 + 2.0**-30
# Nodes at a jump, at most so many together, lie closer than this share of a common cell.
CLOSE_BY, CLUSTER = 1e-4, 4
# What the slope of V falls by at a node is more than this share of the largest |V| per median cell at jumps only.
JUMP = 1024.0
# Where a function is constant for ever its slope does not fall; any length will do.
FAR_APART = 1e200


def mean_matrix(
    rows: int, target: Nodes, row: Ints, weight: Array, side: Ints, one: Array, two: Array
) -> Any:
    """Return the matrix from values at nodes to means.

    Each segment has a weight, spread evenly between two places on a side; or at one place, where both are the same.
    """
    from scipy.sparse import csr_array

    lo, hi = np.minimum(one, two), np.maximum(one, two)
    first, last = target.cell(side, lo), target.cell(side, hi)
    count = last - first + 1
    of = np.repeat(np.arange(row.size), count)
    cell = np.arange(of.size) - np.repeat(np.cumsum(count) - count, count) + first[of]
    left, right = target.place[cell], target.place[cell + 1]
    begin, end = np.maximum(lo[of], left), np.minimum(hi[of], right)
    length = (hi - lo)[of]
    with np.errstate(invalid="ignore", divide="ignore"):
        mass = weight[of] * np.where(length > 0.0, np.maximum(end - begin, 0.0) / length, 1.0)
    middle = 0.5 * ((begin - left) + (end - left)) / (right - left)
    entries = np.concatenate([mass * (1.0 - middle), mass * middle])
    places = (np.concatenate([row[of], row[of]]), np.concatenate([cell, cell + 1]))
    return csr_array((entries, places), shape=(rows, target.place.size))


def rounding_of(matrix: Any) -> float:
    """Bound how far a mean is off by rounding, as a share of the largest |V|: see above."""
    longest = int(np.diff(matrix.indptr).max(initial=0))
    return max(ROUNDING, (longest + MERGED) * 2.0**-52)


@dataclass(frozen=True, eq=False)
class Average:
    """A mean after a move, as a function of where it starts.

    Attributes
    ----------
    source, target : Nodes
        Where it is computed, and what is averaged.
    matrix : csr_array, shape (n, m)
        From values at the nodes of the target to means at those of the source.
    beyond : float
        Weight of the deviations outside the strata.
    at_nodes : tuple of Swings
        How far the means at nodes may be off.
    swings, gaps : tuple of Swings, tuple of Gaps
        How far the means anywhere in a cell may be off.
    ways : tuple of Curvature
        Bounds of the deficits of the chord, h included; the least bound counts for each cell.
    """

    source: Nodes
    target: Nodes
    matrix: Any
    beyond: float = 0.0
    at_nodes: tuple[Swings, ...] = ()
    swings: tuple[Swings, ...] = ()
    gaps: tuple[Gaps, ...] = ()
    ways: tuple[Curvature, ...] = ()
    windows: dict[int, Any] = field(default_factory=dict)

    def _window(self, key: Any, span: Span) -> Windows:
        if id(key) not in self.windows:
            self.windows[id(key)] = Windows(span)
        window: Windows = self.windows[id(key)]
        return window

    def above(self, values: Array) -> Array:
        """Bound the mean of V from above, for all starts.

        Parameters
        ----------
        values : ndarray, shape (m,)
            V at the nodes of the target.

        Returns
        -------
        ndarray, shape (n,)
            The bound at the nodes of the source, affine between them.
        """
        width = self.target.width
        rise = np.diff(values, append=values[-1:])
        rise[np.isinf(width)] = 0.0
        slopes, total = rise / width, running(np.abs(rise))
        most, least = float(values.max()), float(values.min())
        size = rounding_of(self.matrix) * max(most, -least)
        mean = self.matrix @ values
        n = mean.size
        for each in self.at_nodes:
            mean += np.bincount(each.row, _variation(total, each), n)
        if self.beyond:
            mean += self.beyond * most
        deficit = self._deficit(values, slopes, total, n)
        worst = np.maximum(deficit, np.concatenate([[0.0], deficit[:-1]]))
        bound: Array = mean + MORE * worst + size
        return bound

    def _deficit(self, values: Array, slopes: Array, total: Running, n: int) -> Array:
        """Bound how far the mean may lie above the chord, for each cell, named by its left node."""
        excess, best, width = np.zeros(n), np.full(n, np.inf), self.target.width
        for each in self.swings:
            excess += np.bincount(each.row, _variation(total, each), n)
        for gap in self.gaps:
            excess += np.bincount(gap.row, self._difference(gap, values), n)
        fall = np.maximum(slopes - np.append(slopes[1:], 0.0), 0.0)  # at the node after each cell
        ordinary = fall <= JUMP * float(np.abs(values).max()) / float(np.median(width))
        falls = running(np.where(ordinary, fall, 0.0))
        jumps = np.concatenate([[0], np.cumsum(~ordinary)])
        after = np.append(width[1:], np.inf)
        bent_by = fall / (0.5 * np.minimum(width + after, FAR_APART))
        known = np.zeros(n, dtype=bool)
        for way in self.ways:
            bent, more = np.zeros(n), np.zeros(n)
            for bend in way.bends:
                low, high = _products(bend.lo, bend.hi, *self._window(bend, bend.span).ends(slopes))
                cap = bend.cap * total.between(bend.span.first, bend.span.last + 1)
                wild = high - low > cap
                bent += np.bincount(bend.cell, np.where(wild, 0.0, low), n)
                more += np.bincount(bend.cell, np.where(wild, cap, 0.0), n)
            for each in way.swings:
                more += np.bincount(each.row, _variation(total, each), n)
            for kink in way.kinks:
                low, high = self._window(kink, kink.span).ends(slopes)
                inner = kink.span.first, kink.span.last
                down = kink.much * np.where(
                    jumps[inner[1]] > jumps[inner[0]], FAR_APART, falls.between(*inner)
                )
                even = kink.even * self._inner(kink).ends(bent_by)[1]
                more += np.bincount(kink.cell, np.minimum(down, even) + kink.bow * np.maximum(high, -low), n)
            for gap in way.gaps:
                more += np.bincount(gap.row, self._difference(gap, values), n)
            deficit = more + np.maximum(-bent, 0.0)
            known[way.cells] = True
            best[way.cells] = np.minimum(best[way.cells], deficit[way.cells])
        best[~known] = 0.0
        # Nodes close together are lifted by the same amount: a difference would be a very large slope.
        close = np.flatnonzero(self.source.width < CLOSE_BY * np.median(self.source.width))
        for _ in range(CLUSTER):
            best[close] = np.maximum(best[close], np.maximum(best[close - 1], best[close + 1]))
        deficits: Array = excess + best
        return deficits

    def _difference(self, gap: Gaps, values: Array) -> Array:
        low, high = self._both(gap, values)
        much: Array = gap.much * (high - low)
        return much

    def _inner(self, kink: Kinks) -> Windows:
        """Windows of the nodes within a span, named by the cells before them."""
        if -id(kink) not in self.windows:
            last = np.maximum(kink.span.last - 1, kink.span.first)
            self.windows[-id(kink)] = Windows(Span(kink.span.first, last))
        window: Windows = self.windows[-id(kink)]
        return window

    def _both(self, gap: Gaps, values: Array) -> tuple[Array, Array]:
        if id(gap) not in self.windows:
            spans = (Span(span.first, span.last + 1) for span in (gap.one, gap.two))
            self.windows[id(gap)] = tuple(Windows(span) for span in spans)
        (a, b), (c, d) = (window.ends(values) for window in self.windows[id(gap)])
        return np.minimum(a, c), np.maximum(b, d)


def _variation(total: Running, each: Swings) -> Array:
    much: Array = each.much * total.between(each.span.first, each.span.last + 1)
    return much


def _products(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array]:
    """Return the ends of the products of two intervals."""
    some = (a * c, a * d, b * c, b * d)
    return np.minimum.reduce(some), np.maximum.reduce(some)
