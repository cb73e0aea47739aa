"""The mean of a function after a throw with even noise, bounded for every start: the arithmetic of one step in floats.

docs/certificates.md, "Probabilities", numbers 20 (means at nodes) and 21 (between nodes).  A function V is continuous
and affine between nodes.  With e the scatter of the landing, W(y) is the mean of V on [y - e, y + e] and
W'(y) = (V(y + e) - V(y - e))/(2 e), affine between the places node + e and node - e.
"""

from typing import NamedTuple

import numpy as np

from .balls import Array

OUTERMOST = 1e4  # beyond its nodes a function is constant up to here
PAD = 2.0**-40  # more than the roundings of a place, as a share of the largest place
NARROW = 2.0**-20  # cells below this share of the largest place are not interpolated in,
TOLERANCE = 2.0**-26  # and an interpolated value is off by less than this share of the largest value
INFLATE = 1.0 + 2.0**-30  # against the roundings of the few operations that make a coefficient or add it up
GAUSS = 0.5 * (1.0 - 1.0 / np.sqrt(3.0))


class Mesh(NamedTuple):
    """Nodes of all sides one after another; the first and the last of each side lie far out."""

    place: Array
    first: Array  # number of the first node of each side; at the end the number of all

    def cells(self, side: Array, y: Array) -> Array:
        """Find the cells, by their left nodes, in which places lie."""
        found = np.empty(len(y), dtype=np.int64)
        for k in range(len(self.first) - 1):
            here = side == k
            row = self.place[self.first[k] : self.first[k + 1]]
            at = np.searchsorted(row, y[here], side="right") - 1
            found[here] = self.first[k] + np.clip(at, 0, len(row) - 2)
        return found

    def size(self) -> float:
        """Return the largest place but the far ones."""
        inner = np.ones(len(self.place), dtype=bool)
        inner[self.first[:-1]] = inner[self.first[1:] - 1] = False
        return float(np.abs(self.place[inner]).max()) + 1.0


def extremes(values: Array, first: Array, last: Array) -> tuple[Array, Array]:
    """Return the least and the largest of values[first..last] of each range."""
    level = np.frexp((last - first + 1).astype(np.float64))[1] - 1
    lo, hi = np.empty(len(first)), np.empty(len(first))
    least = most = values
    for k in range(int(level.max(initial=0)) + 1):
        q = np.flatnonzero(level == k)
        end = last[q] - (1 << k) + 1
        lo[q], hi[q] = np.minimum(least[first[q]], least[end]), np.maximum(most[first[q]], most[end])
        least = np.minimum(least[: -(1 << k)], least[1 << k :])
        most = np.maximum(most[: -(1 << k)], most[1 << k :])
    return lo, hi


class Rows(NamedTuple):
    """A sparse matrix with entries >= 0, and how far from exact it may be: times the largest |V|."""

    height: int
    row: Array
    column: Array
    entry: Array
    off: float

    def times(self, values: Array) -> Array:
        """Multiply."""
        return np.bincount(self.row, self.entry * values[self.column], self.height)


class Spread(NamedTuple):
    """Weights spread evenly over a range on a side: of the mean number `row`."""

    row: Array
    weight: Array
    side: Array
    lo: Array
    hi: Array


def mean_rows(count: int, mesh: Mesh, spread: Spread, e: float) -> Rows:
    """Build the matrix from V at nodes to the means over places, each of them scattered evenly within e.

    The density of an even place plus an even scatter rises, is level and falls.  On each of these pieces and each cell
    density times V is quadratic, for which two points of Gauss are exact, with weights >= 0 throughout.
    """
    size, n = mesh.size(), len(mesh.place)
    keys, sums = [], []
    off, longest = np.zeros(count), 0
    order = np.argsort(spread.row, kind="stable")
    for chunk in np.array_split(order, max(1, len(order) // 50_000)):
        part = Spread(*(each[chunk] for each in spread))
        row, column, entry, wrong = spread_over_cells(mesh, part, e, size)
        key, inverse = np.unique(row * n + column, return_inverse=True)
        keys.append(key)
        sums.append(np.bincount(inverse, entry))
        off += np.bincount(part.row, wrong, count)
        longest = max(longest, int(np.bincount(row, minlength=1).max()))
    key, inverse = np.unique(np.concatenate(keys), return_inverse=True)
    entry = np.bincount(inverse, np.concatenate(sums))
    rounding = float(off.max()) + (2 * longest + 64) * 2.0**-52
    return Rows(count, key // n, key % n, entry, rounding)


def spread_over_cells(mesh: Mesh, s: Spread, e: float, size: float) -> tuple[Array, Array, Array, Array]:
    """Share weights out to the nodes: row, node and share, and how far each weight's shares may be off together."""
    length = s.hi - s.lo
    inner = np.minimum(s.hi - e, s.lo + e), np.maximum(s.hi - e, s.lo + e)
    ends = np.stack([s.lo - e, *inner, s.hi + e])
    height = 1.0 / np.maximum(length, 2.0 * e)
    first, last = mesh.cells(s.side, ends[0]), mesh.cells(s.side, ends[3])
    many = last - first + 1
    of = np.repeat(np.arange(len(many)), many)
    cell = np.arange(len(of)) - np.repeat(np.cumsum(many) - many, many) + first[of]
    left, right = mesh.place[cell], mesh.place[cell + 1]
    low, high = np.zeros(len(of)), np.zeros(len(of))  # the shares of the left and the right node
    for piece in range(3):
        begin, end = np.maximum(left, ends[piece][of]), np.minimum(right, ends[piece + 1][of])
        step = np.maximum(end - begin, 0.0)
        for gauss in (GAUSS, 1.0 - GAUSS):
            y = begin + gauss * step
            share = 0.5 * step * height[of] * density_at(piece, y, ends[:, of])
            at = np.clip((y - left) / (right - left), 0.0, 1.0)
            low += share * (1.0 - at)
            high += share * at
    # Each end of a piece, each height of a ramp and each place in a cell is off by a few roundings of a place; a shift
    # by that changes the mass of a piece by the height times it.
    wrong = s.weight * height * many * (128 * 2.0**-52 * size)
    row, weight = s.row[of], s.weight[of]
    both = np.concatenate([low * weight, high * weight])
    return np.concatenate([row, row]), np.concatenate([cell, cell + 1]), both, wrong


def density_at(piece: int, y: Array, ends: Array) -> Array:
    """Return the density of place and scatter as a share of its height: on the rise, on the level, on the fall."""
    if piece == 1:
        return np.ones(len(y))
    a, b = (y - ends[0], ends[1] - ends[0]) if piece == 0 else (ends[3] - y, ends[3] - ends[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(np.clip(a / b, 0.0, 1.0), nan=1.0))


class Stretches(NamedTuple):
    """Ranges of places among bends: the bends outside, and where in the first and the last gap each range ends."""

    first: Array
    last: Array
    begin: Array
    end: Array

    def extremes(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bound a function from below and above that lies between `low` and `high` at bends, and is affine between."""
        i, j = self.first, self.last - 1
        ends_low = low[i] + self.begin * (low[i + 1] - low[i]), low[j] + self.end * (low[j + 1] - low[j])
        ends_high = (
            high[i] + self.begin * (high[i + 1] - high[i]),
            high[j] + self.end * (high[j + 1] - high[j]),
        )
        lo, hi = np.minimum(*ends_low), np.maximum(*ends_high)
        some = np.flatnonzero(i < j)  # with bends inside
        lo[some] = np.minimum(lo[some], extremes(low, i[some] + 1, j[some])[0])
        hi[some] = np.maximum(hi[some], extremes(high, i[some] + 1, j[some])[1])
        return lo, hi


class Table:
    """Extremes of V, and of V(y + e) - V(y - e), on ranges of places; which places is known once for all V.

    The difference is looked up at all nodes + e and nodes - e, between which it is affine.  One of its two places is a
    node.  The other is interpolated in an ordinary cell, where a few roundings of a place (2^-50) change V by less than
    2 * 2^-50 / NARROW of the largest |V|; near narrow cells the extremes of all nodes nearby count.
    """

    def __init__(self, mesh: Mesh, e: float):
        self.mesh, self.e, self.pad = mesh, e, PAD * mesh.size()
        n, sides = len(mesh.place), len(mesh.first) - 1
        side = np.repeat(np.arange(sides), np.diff(mesh.first))
        at = np.concatenate([mesh.place + e, mesh.place - e])
        order = np.lexsort((at, np.concatenate([side, side])))
        self.where, self.side = at[order], np.concatenate([side, side])[order]
        self.first = 2 * mesh.first
        self.node, self.sign = order % n, np.where(order < n, 1.0, -1.0)
        # at node + e the node is the lower of the two places, at node - e the upper one
        other = mesh.place[self.node] + 2.0 * e * self.sign
        self.begin = mesh.cells(self.side, other - self.pad)
        self.end = mesh.cells(self.side, other + self.pad)
        left, right = mesh.place[self.begin], mesh.place[self.begin + 1]
        self.rough = np.flatnonzero((self.begin != self.end) | (right - left < NARROW * mesh.size()))
        self.share = np.clip((other - left) / (right - left), 0.0, 1.0)

    def rises(self, values: Array) -> tuple[Array, Array]:
        """Bound V(y + e) - V(y - e) at the places where it bends."""
        low = values[self.begin] + self.share * (values[self.begin + 1] - values[self.begin])
        high = low.copy()
        low[self.rough], high[self.rough] = extremes(values, self.begin[self.rough], self.end[self.rough] + 1)
        some = TOLERANCE * float(np.abs(values).max())
        here = values[self.node]
        up = self.sign > 0.0
        return np.where(up, low - here, here - high) - some, np.where(up, high - here, here - low) + some

    def ranges_of_rises(self, side: Array, lo: Array, hi: Array) -> "Stretches":
        """Find the bends between places from lo to hi, and how far these lie between bends."""
        begin, end = np.empty(len(lo), dtype=np.int64), np.empty(len(lo), dtype=np.int64)
        for k in range(len(self.first) - 1):
            here, last = side == k, int(self.first[k + 1] - self.first[k]) - 2
            row = self.where[self.first[k] : self.first[k + 1]]
            for found, y in ((begin, lo - self.pad), (end, hi + self.pad)):
                at = np.searchsorted(row, y[here], side="right") - 1
                found[here] = self.first[k] + np.clip(at, 0, last)
        shares = []
        for at, y in ((begin, lo), (end, hi)):
            gap = self.where[at + 1] - self.where[at]
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.clip((y - self.where[at]) / gap, 0.0, 1.0)
            # between bends close together the one that lies outward
            outer = np.zeros(len(y)) if at is begin else np.ones(len(y))
            shares.append(np.where(gap < NARROW * self.mesh.size(), outer, share))
        return Stretches(begin, end + 1, shares[0], shares[1])

    def ranges_of_values(self, side: Array, lo: Array, hi: Array) -> tuple[Array, Array]:
        """Find the nodes that surround places that are scattered, from lo to hi before that."""
        reach = self.e + self.pad
        return self.mesh.cells(side, lo - reach), self.mesh.cells(side, hi + reach) + 1
