"""The mean of a function after a random move, bounded for every start: one step of the proof.

A function V is continuous and affine on the cells of `target`.  Its mean M(x) after the move is computed at the nodes
of `source` (a sparse matrix: hat functions are integrated against densities that are constant between places), and lies
above the chord between two nodes by at most

    h^2/8 max(0, -M''),     or    h/4 (oscillation of M'),

of which parts may be bounded by the one and parts by the other.  M'' is a sum of slopes of V at the places where
densities jump ("bends"), and of terms bounded by the total variation of V where moves land ("swings").  What is not
decided costs the difference of what it may be ("gaps").

Rounding: a row has fewer than 2^12 entries, all weights >= 0 with a sum of 1, each computed to a few units in the last
place from places that are doubles; so a mean is short of the exact one by less than `ROUNDING` times the largest |V|,
and so is a difference of two values of V that stands for its slope or variation, which are inflated by `MORE`.  Sums
of scipy and numpy in any order, contracted or not, keep these bounds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.robust.brackets.nodes import Nodes

__all__ = ["Average", "Bends", "Curvature", "Gaps", "Kinks", "Span", "Swings", "Windows", "mean_matrix"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ROUNDING = 2.0**-40
MORE = 1.0 + 2.0**-30
# Nodes at a jump, at most so many together, lie closer than this share of a common cell.
CLOSE_BY, CLUSTER = 1e-4, 4
# Where a function is constant for ever its slope does not fall; any length will do.
FAR_APART = 1e200


class Span(NamedTuple):
    """Cells of the target from `first` to `last`, both of them included; one pair for each entry."""

    first: Index
    last: Index


class Swings(NamedTuple):
    """To `row` is added `much` times the total variation of V on a span."""

    row: Index
    much: Array
    span: Span


class Bends(NamedTuple):
    """To 8/h^2 of `cell`'s deficit comes a coefficient in [lo, hi] times the slope of V on a span.

    Where that says less, the deficit grows by `cap` times the total variation of V there instead.
    """

    cell: Index
    lo: Array
    hi: Array
    cap: Array
    span: Span


class Gaps(NamedTuple):
    """To `row` is added `much` times the difference of the largest and the smallest V on two spans together."""

    row: Index
    much: Array
    one: Span
    two: Span


class Kinks(NamedTuple):
    """To `cell`'s deficit comes `much` times the sum of what the slope of V falls by at the nodes within a span.

    Or `even` times the most that it falls by per length, where that is less; and `bow` times the largest slope there.
    """

    cell: Index
    much: Array
    even: Array
    bow: Array
    span: Span


class Curvature(NamedTuple):
    """One way to bound the deficit by curvature, for the cells that it knows."""

    cells: Index
    bends: tuple[Bends, ...] = ()
    swings: tuple[Swings, ...] = ()
    kinks: tuple[Kinks, ...] = ()
    gaps: tuple[Gaps, ...] = ()


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
    # Both from the nearer node: a share near 0 has to be as exact as one near 1.
    middle = 0.5 * ((begin - left) + (end - left)) / (right - left)
    entries = np.concatenate([mass * (1.0 - middle), mass * middle])
    places = (np.concatenate([row[of], row[of]]), np.concatenate([cell, cell + 1]))
    return csr_array((entries, places), shape=(rows, target.place.size))


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
        return self.windows[id(key)]  # type: ignore[no-any-return]

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
        slopes, total = rise / width, np.concatenate([[0.0], np.cumsum(np.abs(rise))])
        most, least = float(values.max()), float(values.min())
        size = ROUNDING * max(most, -least)
        mean = self.matrix @ values
        n = mean.size
        for each in self.at_nodes:
            mean += np.bincount(each.row, _variation(total, each), n)
        if self.beyond:
            mean += self.beyond * most
        deficit = self._deficit(values, slopes, total, width, n)
        worst = np.maximum(deficit, np.concatenate([[0.0], deficit[:-1]]))
        return mean + MORE * worst + size  # type: ignore[no-any-return]

    def _deficit(self, values: Array, slopes: Array, total: Array, width: Array, n: int) -> Array:
        """How far the mean may lie above the chord, for each cell, named by its left node."""
        found, best = np.zeros(n), np.full(n, np.inf)
        for each in self.swings:
            found += np.bincount(each.row, _variation(total, each), n)
        for gap in self.gaps:
            found += np.bincount(gap.row, self._difference(gap, values), n)
        fall = np.maximum(slopes - np.append(slopes[1:], 0.0), 0.0)  # at the node after each cell
        falls = np.cumsum(fall)
        after = np.append(width[1:], np.inf)
        bent_by = fall / (0.5 * np.minimum(width + after, FAR_APART))
        known = np.zeros(n, dtype=bool)
        for way in self.ways:
            bent, more = np.zeros(n), np.zeros(n)
            for bend in way.bends:
                low, high = _products(bend.lo, bend.hi, *self._window(bend, bend.span).ends(slopes))
                cap = bend.cap * (total[bend.span.last + 1] - total[bend.span.first])
                wild = high - low > cap
                bent += np.bincount(bend.cell, np.where(wild, 0.0, low), n)
                more += np.bincount(bend.cell, np.where(wild, cap, 0.0), n)
            for each in way.swings:
                more += np.bincount(each.row, _variation(total, each), n)
            for kink in way.kinks:
                low, high = self._window(kink, kink.span).ends(slopes)
                down = kink.much * (falls[kink.span.last - 1] - falls[kink.span.first - 1])
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
        return found + best  # type: ignore[no-any-return]

    def _difference(self, gap: Gaps, values: Array) -> Array:
        low, high = self._both(gap, values)
        much: Array = gap.much * (high - low)
        return much

    def _inner(self, kink: Kinks) -> Windows:
        """Windows of the nodes within a span, named by the cells before them."""
        if -id(kink) not in self.windows:
            last = np.maximum(kink.span.last - 1, kink.span.first)
            self.windows[-id(kink)] = Windows(Span(kink.span.first, last))
        return self.windows[-id(kink)]  # type: ignore[no-any-return]

    def _both(self, gap: Gaps, values: Array) -> tuple[Array, Array]:
        if id(gap) not in self.windows:
            spans = (Span(span.first, span.last + 1) for span in (gap.one, gap.two))
            self.windows[id(gap)] = tuple(Windows(span) for span in spans)
        (a, b), (c, d) = (window.ends(values) for window in self.windows[id(gap)])
        return np.minimum(a, c), np.maximum(b, d)


def _variation(total: Array, each: Swings) -> Array:
    much: Array = each.much * (total[each.span.last + 1] - total[each.span.first])
    return much


def _products(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array]:
    """Return the ends of the products of two intervals."""
    some = (a * c, a * d, b * c, b * d)
    return np.minimum.reduce(some), np.maximum.reduce(some)
