"""One throw of a bound: what the cells of a noisy chain need, and the step from one function to the next.

docs/certificates.md, "Probabilities", numbers 20 to 22.  The mean of V after a throw is bounded at the nodes; on a cell
it lies above the chord by the least of the deficits that are proved there, and by what is not decided.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .averages import INFLATE, Mesh, Rows, Table, extremes
from .balls import Array

Ranges = tuple[Array, Array]


@dataclass
class Collected:
    """Columns of numbers, row after row: what each cell or node needs of a function."""

    columns: tuple[str, ...]
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def array(self, name: str, kind: Any = float) -> Array:
        """Return a column."""
        at = self.columns.index(name)
        return np.array([row[at] for row in self.rows], dtype=kind)


def collected(*columns: str) -> Collected:
    """Return a table that is empty."""
    return Collected(columns)


@dataclass
class Parts:
    """Everything that is proved of the throws, with places instead of functions.

    `at_cells`, `at_nodes`: where throws may land, on one or two sides, and by how much more or less the mean may be, as
    a share of what V varies by there; `ends`: coefficients of W' where the speeds end or the branch changes; `inner`:
    coefficients of |W'|; `turns`: coefficients whose products with W' may vary; `hard`: cells of which no more is
    known than where their throws may land.
    """

    at_cells: Collected = field(
        default_factory=lambda: collected("at", "much", "side", "lo", "hi", "side2", "lo2", "hi2")
    )
    at_nodes: Collected = field(
        default_factory=lambda: collected("at", "much", "side", "lo", "hi", "side2", "lo2", "hi2")
    )
    hard: Collected = field(
        default_factory=lambda: collected("at", "much", "side", "lo", "hi", "side2", "lo2", "hi2", "node")
    )
    ends: Collected = field(default_factory=lambda: collected("at", "least", "most", "side", "lo", "hi"))
    inner: Collected = field(default_factory=lambda: collected("at", "much", "side", "lo", "hi"))
    turns: Collected = field(default_factory=lambda: collected("at", "least", "most", "side", "lo", "hi"))


class Reach:
    """Where throws may land, as ranges of nodes."""

    def __init__(self, table: Table, some: Collected):
        self.at, self.much = some.array("at", np.int64), some.array("much")
        self.one, self.two = (
            table.ranges_of_values(
                some.array(f"side{k}", np.int64), some.array(f"lo{k}"), some.array(f"hi{k}")
            )
            for k in ("", "2")
        )

    def ends(self, values: Array) -> tuple[Array, Array]:
        """Return the least and the largest V there."""
        (a, b), (c, d) = extremes(values, *self.one), extremes(values, *self.two)
        return np.minimum(a, c), np.maximum(b, d)


class Bent:
    """Coefficients of W', with the ranges of the bends."""

    def __init__(self, table: Table, some: Collected):
        self.at = some.array("at", np.int64)
        names = ("least", "most") if "least" in some.columns else ("much", "much")
        self.least, self.most = (some.array(name) for name in names)
        self.ranges = table.ranges_of_rises(some.array("side", np.int64), some.array("lo"), some.array("hi"))

    def products(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Return the least and the largest of coefficient times rise."""
        lo, hi = self.ranges.extremes(low, high)
        some = (self.least * lo, self.least * hi, self.most * lo, self.most * hi)
        return np.minimum.reduce(some), np.maximum.reduce(some)


@dataclass
class Chain:
    """The chain on its mesh; `live` are the cells of which throws are made, by their left nodes.

    `absorbed`: by name the nodes of the cells that absorb; the exits are one of the names.
    """

    mesh: Mesh
    rows: Rows
    live: Array
    absorbed: dict[str, Array]
    table: Table
    cells: Reach
    nodes: Reach
    hard: Reach
    beside: Array  # by hard cell the node whose mean may serve for it
    ends: Bent
    inner: Bent
    turns: Bent
    curved: Array  # live cells with `ends`, by their left nodes
    turned: Array  # live cells with `turns`

    def fixed(self, value: dict[str, float]) -> Array:
        """Return the largest value on places that absorb, -inf where there is none."""
        found = np.full(len(self.mesh.place), -np.inf)
        for name, nodes in self.absorbed.items():
            found[nodes] = np.maximum(found[nodes], value[name])
        return found

    def first(self, fixed: Array) -> Array:
        """Return the function that is 0 where throws are made."""
        found = fixed.copy()
        for at in (self.live, self.hard.at):
            for nodes in (at, at + 1):
                found[nodes] = np.maximum(found[nodes], 0.0)
        return found

    def above(self, values: Array, fixed: Array, more: float = 0.0) -> Array:
        """Bound `more` and the mean of V after a throw from above; on places that absorb V is fixed."""
        size = float(np.abs(values).max())
        mean = self.rows.times(values) + (self.rows.off * size + more)
        low, high = self.nodes.ends(values)
        at = self.nodes.at
        mean[at] = np.minimum(mean[at] + INFLATE * self.nodes.much * (high - low), high + more)
        deficit = INFLATE * self.deficits(values)[self.live] + 2.0**-50 * size
        found = fixed.copy()
        for nodes in (self.live, self.live + 1):
            found[nodes] = np.maximum(found[nodes], mean[nodes] + deficit)
        least, most = self.hard.ends(values)
        near = np.isfinite(self.hard.much)  # hardly farther than what is thrown from that node
        beside = mean[self.beside] + INFLATE * np.where(near, self.hard.much, 0.0) * (most - least)
        bound = np.where(near, np.minimum(most + more, beside), most + more) + 2.0**-50 * size
        for nodes in (self.hard.at, self.hard.at + 1):
            np.maximum.at(found, nodes, bound)
        return found

    def deficits(self, values: Array) -> Array:
        """How far the mean may lie above the chord, by the left nodes of the cells."""
        n = len(values)
        low, high = self.table.rises(values)
        bent = np.bincount(self.ends.at, self.ends.products(low, high)[1], n)
        size = np.maximum(np.abs(low), np.abs(high))
        bent += np.bincount(self.inner.at, self.inner.products(size, size)[1], n)
        lo, hi = self.turns.products(low, high)
        turned = np.bincount(self.turns.at, hi - lo, n)
        least, most = self.cells.ends(values)
        span, gap = np.zeros(n), np.zeros(n)
        span[self.cells.at] = most - least
        gap[self.cells.at] = self.cells.much * (most - least)
        best = span.copy()
        best[self.curved] = np.minimum(best[self.curved], np.maximum(bent[self.curved], 0.0))
        best[self.turned] = np.minimum(best[self.turned], turned[self.turned])
        return np.minimum(best + gap, span)
