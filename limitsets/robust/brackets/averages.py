"""The mean of a function after a random move, bounded for every start: one step of the proof.

A function V is continuous and affine on the cells of `target`.  Its mean M(x) after the move is computed at the nodes
of `source` (a sparse matrix: hat functions are integrated against densities that are constant between places), and lies
above the chord between two nodes by at most

    h^2/8 max(0, -M''),     or    h/4 (oscillation of M'),

of which parts may be bounded by the one and parts by the other.  M'' is a sum of slopes of V at the places where
densities jump ("bends"), and of terms bounded by the total variation of V where moves land ("swings").  What is not
decided costs the difference of what it may be ("gaps").

Rounding, with u = 2^-53.  The entries of a row are >= 0 with a sum of 1, each computed by fewer than 12 operations from
places that are doubles, a share 1 - s of a node to u rather than to u (1 - s); entries of one node are merged, at most
four from each of two runs of 192 strata; so in whatever order scipy adds them up, a mean of k entries is off by less
than (k + 768 + 12) u times the largest |V|: `rounding_of`, never below `ROUNDING`, which covers the few additions after
it.  Slopes and extremes have one rounding of their own size, which `MORE` inflates; running sums of n terms, whose
differences stand for sums over spans, are off by less than n u times the whole sum, which is added (`spans.running`).
Slopes across the nodes of a jump are so large that running sums would lose the others: they are counted, not added.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.robust.brackets.nodes import Nodes
from limitsets.robust.brackets.spans import Curvature, Gaps, Kinks, Running, Span, Swings, Windows, running

Array = NDArray[np.float64]
Index = NDArray[np.int64]

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
    rows: int, target: Nodes, row: Index, weight: Array, side: Index, one: Array, two: Array
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
        Weight of which nothing is known.
    at_nodes : tuple of Swings
        How far the means at nodes may be off.
    swings, gaps : tuple of Swings, tuple of Gaps
        The same of means anywhere in a cell.
    ways : tuple of Curvature
        Deficits of the chord, h included; of several ways the best counts, for each cell.
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
        """How far the mean may lie above the chord, for each cell, named by its left node."""
        found, best, width = np.zeros(n), np.full(n, np.inf), self.target.width
        for each in self.swings:
            found += np.bincount(each.row, _variation(total, each), n)
        for gap in self.gaps:
            found += np.bincount(gap.row, self._difference(gap, values), n)
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
        # Nodes close together are lifted alike: a difference would be a slope without end.
        close = np.flatnonzero(self.source.width < CLOSE_BY * np.median(self.source.width))
        for _ in range(CLUSTER):
            best[close] = np.maximum(best[close], np.maximum(best[close - 1], best[close + 1]))
        deficits: Array = found + best
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
