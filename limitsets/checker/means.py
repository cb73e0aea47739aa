"""The mean of a function over a random move, bounded for every place: meshes, sums, and the scatter of landings.

docs/certificates.md, "Probabilities", number 20.  A function V is continuous and affine between nodes.  W(y), the mean
of V(y + e) over the deviations e of the landing, is bounded in the same form, at finer nodes.
"""

import functools
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from .balls import Array, prove
from .laws import Law

PAD = 2.0**-40  # more than the roundings of a place, as a share of the largest place
# Cells below this share of the largest place are those where a function of a scene may jump.
NARROW = 2.0**-20
INFLATE = 1.0 + 2.0**-30  # against the roundings of the few operations that make a coefficient or add it up
FINER = 4  # cells of W for each cell of V
FINEST = 500.0  # so many of them at most for each reach of the scatter
# Of memory: cells of W on all sides, and cells of V that all its nodes meet.
MOST_FINER, MOST_OVERLAPS = 1e7, 5e7
AT_ONCE = 50_000  # ranges shared out to cells at a time


class Mesh(NamedTuple):
    """Nodes of all sides one after another; the first and the last of each side lie far out."""

    place: Array
    first: Array  # number of the first node of each side; at the end the number of all

    def cells(self, side: Array, y: Array) -> Array:
        """Find the cells, by their left nodes, in which places lie."""
        left_nodes = np.empty(len(y), dtype=np.int64)
        for k in range(len(self.first) - 1):
            here = side == k
            row = self.place[self.first[k] : self.first[k + 1]]
            at = np.searchsorted(row, y[here], side="right") - 1
            left_nodes[here] = self.first[k] + np.clip(at, 0, len(row) - 2)
        return left_nodes

    def size(self) -> float:
        """Return the largest place but the far ones."""
        inner = np.ones(len(self.place), dtype=bool)
        inner[self.first[:-1]] = inner[self.first[1:] - 1] = False
        return float(np.abs(self.place[inner]).max()) + 1.0

    def within(self, side: Array, lo: Array, hi: Array) -> "Ranges":
        """Find the cells that ranges of places meet, or may meet by roundings."""
        pad = PAD * self.size()
        return Ranges(self.cells(side, lo - pad), self.cells(side, hi + pad))


class TwoRuns(NamedTuple):
    """Ranges of numbers, each as two runs of 2^level numbers that cover it: where these begin."""

    level: Array
    one: Array
    two: Array


def runs_of(first: Array, last: Array) -> TwoRuns:
    """Cover ranges by runs."""
    level = np.frexp((last - first + 1).astype(np.float64))[1].astype(np.int64) - 1
    return TwoRuns(level, first, last - (1 << level) + 1)


class Ranges:
    """Ranges of cells, by the left nodes of the first and the last; their runs are found once, for all functions."""

    def __init__(self, first: Array, last: Array):
        self.first, self.last = first, last

    @functools.cached_property
    def cells(self) -> TwoRuns:
        """The runs of their cells."""
        return runs_of(self.first, self.last)

    @functools.cached_property
    def nodes(self) -> TwoRuns:
        """The runs of their nodes."""
        return runs_of(self.first, self.last + 1)

    @functools.cached_property
    def inner(self) -> TwoRuns:
        """The runs of the cells to the left of their inner nodes, or of the one cell."""
        return runs_of(self.first, np.maximum(self.last - 1, self.first))


def lengthened(values: Array, rows: int, better: np.ufunc) -> Array:
    """Return by row k the best of 2^k values from each on; of runs that would end beyond the last nothing is asked."""
    table = np.empty((rows, len(values)))
    table[0] = values
    for k in range(1, rows):
        half = 1 << (k - 1)
        table[k] = table[k - 1]
        better(table[k - 1, :-half], table[k - 1, half:], out=table[k, :-half])
    return table


class Extremes:
    """The least and the largest of some values over runs: row k of the tables is of runs of 2^k values."""

    def __init__(self, values: Array):
        self.least = self.most = values[None, :]

    def on(self, runs: TwoRuns) -> tuple[Array, Array]:
        """Return the least and the largest value of each range."""
        rows, n = int(runs.level.max(initial=0)) + 1, self.least.shape[1]
        if len(self.least) < rows:
            self.least, self.most = (
                lengthened(self.least[0], rows, np.minimum),
                lengthened(self.most[0], rows, np.maximum),
            )
        begin = runs.level * n
        one, two = begin + runs.one, begin + runs.two
        return (
            np.minimum(self.least.take(one), self.least.take(two)),
            np.maximum(self.most.take(one), self.most.take(two)),
        )


class Graph:
    """A function on its mesh: values at nodes, the slope on each cell, and how much it varies from cell to cell."""

    def __init__(self, mesh: Mesh, values: Array):
        self.values, self.size = values, float(np.abs(values).max())
        self.range = float(values.max()) - float(values.min())
        rise = np.diff(values, append=values[-1])
        rise[mesh.first[1:] - 1] = 0.0  # between the last node of a side and the first of the next
        with np.errstate(invalid="ignore"):
            self.slopes = rise / np.diff(mesh.place, append=np.inf)
        self.slopes[mesh.first[1:] - 1] = 0.0
        width = np.diff(mesh.place, append=np.inf)
        width[mesh.first[1:] - 1] = np.inf
        fall = np.maximum(self.slopes[:-1] - self.slopes[1:], 0.0)
        fall += 2.0**-50 * (np.abs(self.slopes[:-1]) + np.abs(self.slopes[1:]))  # both are rounded
        self.falls = np.append(
            fall * 2.0 / (width[:-1] + width[1:]), 0.0
        )  # per length, at the node after each cell
        self.of_values, self.of_slopes, self.of_falls = map(Extremes, (values, self.slopes, self.falls))
        self.climbed = np.concatenate([[0.0], np.cumsum(np.abs(rise))])
        self.rounding = len(rise) * 2.0**-52 * float(self.climbed[-1])

    def values_on(self, span: Ranges) -> tuple[Array, Array]:
        """Return the least and the largest value on each range of cells."""
        return self.of_values.on(span.nodes)

    def slopes_on(self, span: Ranges) -> tuple[Array, Array]:
        """Return the least and the largest slope."""
        return self.of_slopes.on(span.cells)

    def steepest_on(self, span: Ranges) -> Array:
        """Return the largest size of a slope."""
        lo, hi = self.slopes_on(span)
        return np.maximum(np.abs(lo), np.abs(hi))

    def falls_on(self, span: Ranges) -> Array:
        """Return the largest fall of the slope per length, at the nodes inside."""
        return self.of_falls.on(span.inner)[1]

    def variation_on(self, span: Ranges) -> Array:
        """Bound the total variation from above."""
        total: Array = self.climbed[span.last + 1] - self.climbed[span.first] + self.rounding
        return total


def lifts(mesh: Mesh, deficit: Array, narrow: float) -> tuple[Array, Array]:
    """Return by how much each cell's bound is raised at its left and at its right node, for the cell's own deficit.

    Nodes close together (`narrow`) are raised by the same amount, for the difference would be a very steep slope.
    """
    at_nodes = np.maximum(deficit, np.concatenate([[0.0], deficit[:-1]]))
    close = np.diff(mesh.place, append=np.inf) < narrow * mesh.size()
    close[mesh.first[1:] - 1] = False
    begins = np.flatnonzero(np.concatenate([[True], ~close[:-1]]))
    many = np.diff(begins, append=len(deficit))
    together = np.repeat(np.maximum.reduceat(at_nodes, begins), many)
    alone = np.repeat(many == 1, many)
    right = np.append(alone[1:], True), np.append(together[1:], 0.0)
    return np.where(alone, deficit, together), np.where(right[0], deficit, right[1])


class Rows(NamedTuple):
    """A sparse matrix with entries >= 0, and how far from exact it may be: times the largest |V|."""

    height: int
    row: Array
    column: Array
    entry: Array
    off: float

    def times(self, values: Array) -> Array:
        """Multiply."""
        product = values.take(self.column)
        product *= self.entry  # in place: arrays of this size are paid for by their pages
        return np.bincount(self.row, product, self.height)


class Spread(NamedTuple):
    """Weights spread evenly over a range on a side: of the mean number `row`."""

    row: Array
    weight: Array
    side: Array
    lo: Array
    hi: Array


def mean_rows(count: int, mesh: Mesh, spreads: Iterable[Spread]) -> Rows:
    """Build the matrix from V at nodes to the means over places.

    All that belongs to one row has to stand in one spread.  Every share of a node is made of differences of places,
    which are floats, by fewer than 16 operations, none of which cancels; the sum of `k` of them is off by less than
    k + 16 roundings of the largest |V|.
    """
    n, longest = len(mesh.place), 0
    keys, sums = list[Array]([np.zeros(0, dtype=np.int64)]), list[Array]([np.zeros(0)])
    for spread in spreads:
        row, column, entry = spread_over_cells(mesh, spread)
        key, inverse = np.unique(row * n + column, return_inverse=True)
        keys.append(key)
        sums.append(np.bincount(inverse, entry))
        longest = max(longest, int(np.bincount(row - row.min(initial=n), minlength=1).max()))
    places = np.concatenate(keys)
    return Rows(count, places // n, places % n, np.concatenate(sums), (2 * longest + 64) * 2.0**-52)


def spread_over_cells(mesh: Mesh, s: Spread) -> tuple[Array, Array, Array]:
    """Share weights out to the nodes: row, node and share."""
    first, last = mesh.cells(s.side, s.lo), mesh.cells(s.side, s.hi)
    many = last - first + 1
    of = np.repeat(np.arange(len(many)), many)
    cell = np.arange(len(of)) - np.repeat(np.cumsum(many) - many, many) + first[of]
    left, right = mesh.place[cell], mesh.place[cell + 1]
    begin, end = np.maximum(s.lo[of], left), np.minimum(s.hi[of], right)
    length = (s.hi - s.lo)[of]
    with np.errstate(divide="ignore", invalid="ignore"):
        mass = s.weight[of] * np.where(length > 0.0, np.maximum(end - begin, 0.0) / length, 1.0)
    share = np.clip(0.5 * ((begin - left) + (end - left)) / (right - left), 0.0, 1.0)
    row = s.row[of]
    entries = np.concatenate([mass * (1.0 - share), mass * share])
    return np.concatenate([row, row]), np.concatenate([cell, cell + 1]), entries


# ----------------------------------------------------------------
# The scatter of landings.


class Scatter:
    """W, from V: the mean over where a part that lands at y comes to rest, bounded from above for every y.

    Between two nodes W exceeds its chord by at most h^2/8 max(0, -W''), and -W'' is the integral of V'(y + e) over the
    changes of the density: a change times the slopes of V, or its steepness times the variation of V, where a jump of
    the density counts by h/4 times the variation.
    """

    def __init__(self, coarse: Mesh, law: Law, narrow: float = NARROW):
        self.law, self.mesh, self.narrow = law, finer_mesh(coarse, law, narrow), narrow
        side = np.repeat(np.arange(len(coarse.first) - 1), np.diff(self.mesh.first))
        y, strata = self.mesh.place, len(law.weights)

        def spread(some: Array) -> Spread:
            ends = y[some, None] + law.cuts
            lo, hi = ends[:, :-1].ravel(), ends[:, 1:].ravel()
            weights = np.tile(law.weights, len(some))
            return Spread(np.repeat(some, strata), weights, np.repeat(side[some], strata), lo, hi)

        reach = float(law.reach)
        outer = coarse.place[coarse.first[side]], coarse.place[coarse.first[side + 1] - 1]
        followed = bool(((outer[0] < y - reach) & (y + reach < outer[1])).all())
        prove(followed, "landings scatter beyond the outermost nodes")
        self.whole = coarse.within(side, y - reach, y + reach)
        met = int((self.whole.last - self.whole.first + 1).sum()) + len(y) * strata
        prove(met < MOST_OVERLAPS, "landings scatter over too many cells")
        chunks = np.array_split(np.arange(len(y)), len(y) * strata // AT_ONCE + 1)
        self.rows = mean_rows(len(y), coarse, map(spread, chunks))
        # the places y + e are rounded: the ends of a stratum move the mean by its density times that
        densities = float((law.weights / np.diff(law.cuts)).sum())
        self.off = self.rows.off + 4.0 * densities * 2.0**-52 * (coarse.size() + reach)
        self.cell = np.flatnonzero(np.diff(side, append=-1) == 0)
        lo, hi, on = y[self.cell], y[self.cell + 1], side[self.cell]
        h = hi - lo
        self.bends = []
        for first, last, change, much in changes_of(law):
            span = coarse.within(on, lo + float(law.ends[first]), hi + float(law.ends[last]))
            bound = h * h * 0.125 * much if last > first else h * 0.25 * much
            self.bends.append((h * h * 0.125 * change, INFLATE * bound, span))

    def above(self, v: Graph) -> Array:
        """Bound W at the finer nodes, so that it is affine between them."""
        mean = self.rows.times(v.values) + (self.off * v.size + self.law.beyond * v.range)
        if self.law.ripple:
            by_slope = self.law.tilt * v.steepest_on(self.whole)
            mean += INFLATE * np.minimum(self.law.ripple * v.variation_on(self.whole), by_slope)
        tame, wild, size = (np.zeros(len(self.cell)) for _ in range(3))
        for much, bound, span in self.bends:
            product = np.maximum(*(much * slope for slope in v.slopes_on(span)))
            at_most = bound * v.variation_on(span)
            tame += np.where(product > at_most, 0.0, product)
            size += np.where(product > at_most, 0.0, np.abs(product))
            wild += np.where(product > at_most, at_most, 0.0)
        deficit = np.zeros(len(mean))
        deficit[self.cell] = INFLATE * (np.maximum(tame + 2.0**-40 * size, 0.0) + wild)
        left, right = lifts(self.mesh, deficit, self.narrow)
        lifted: Array = mean + np.maximum(left, np.concatenate([[0.0], right[:-1]]))
        return lifted


def changes_of(law: Law) -> list[tuple[int, int, float, float]]:
    """List where the density changes: between which ends, by how much it rises, and its steepness, or its jump."""
    some = [(j, j, float(change.mid()), abs(float(change.mid()))) for j, change in law.jumps]
    return some + [
        (each.first, each.last, float(each.change.mid()), each.steep) for each in law.columns if each.steep
    ]


def finer_mesh(coarse: Mesh, law: Law, narrow: float) -> Mesh:
    """Place nodes for W: at even distances, and where a jump of V leads to a bend."""
    pad, reach = 4.0 * PAD * coarse.size(), float(law.reach)
    bends = np.array([0.0] if law.ripple else [float(law.ends[j]) for j, _ in law.jumps])
    rows, room = [], MOST_FINER
    for begin, end in zip(coarse.first[:-1], coarse.first[1:], strict=True):
        inner = coarse.place[begin + 1 : end - 1]
        width = np.diff(inner)
        close = np.flatnonzero(width < narrow * coarse.size())
        step = max(float(np.median(width)), (inner[-1] - inner[0]) / (4 * len(inner))) / FINER
        step = max(step, reach / FINEST)  # the mean varies at the scale of the scatter
        jumps = np.concatenate([inner[close], inner[close + 1]])
        around = np.concatenate([jumps, jumps - pad, jumps + pad])
        special = np.unique(around[:, None] + bends)
        special = special[np.diff(special, prepend=-np.inf) > 0.25 * pad]  # the same but for roundings
        lo, hi = inner[0] - reach - 4.0 * pad, inner[-1] + reach + 4.0 * pad
        room -= float(hi - lo) / float(step)
        prove(room > 0.0, "landings scatter over too many cells")
        even = np.linspace(lo, hi, int(np.ceil((hi - lo) / step)) + 1)
        at = np.searchsorted(special, np.stack([even - 0.1 * step, even + 0.1 * step]))
        even = even[(at[0] == at[1]) | (even == lo) | (even == hi)]  # none close to a special place
        far = 0.5 * coarse.place[end - 1]
        rows.append(np.unique(np.concatenate([[-far], even, special, [far]])))
    return Mesh(np.concatenate(rows), np.concatenate([[0], np.cumsum([len(row) for row in rows])]))
