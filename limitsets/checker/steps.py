"""One step of a noisy chain: from a function a bound of its mean after a throw, by what is proved of the throws.

docs/certificates.md, "Probabilities", numbers 20 to 22.  The mean of V after a throw is bounded at the nodes; on a
cell it lies above the chord by the least of the deficits that are proved there, and by what is not decided.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .balls import Array
from .means import INFLATE, NARROW, Extremes, Graph, Mesh, Rows, Scatter, lifts


@dataclass
class Collected:
    """Columns of numbers, row after row: what each cell or node needs of a function."""

    columns: tuple[str, ...]
    rows: list[tuple[float, ...]] = field(default_factory=list)

    def array(self, name: str, kind: Any = float) -> Array:
        """Return a column."""
        at = self.columns.index(name)
        return np.array([row[at] for row in self.rows], dtype=kind)


MOST_VALUE = 2.0**500
LANDING = ("at", "much", "side", "lo", "hi", "side2", "lo2", "hi2")
BEND = ("at", "least", "most", "side", "lo", "hi")


@dataclass
class Parts:
    """Everything that is proved of the throws, with places instead of functions.

    G is the function of where throws land.  `at_cells`, `at_nodes`, `hard`: where throws may land, on one or two sides,
    and by how much the mean may be off: as a share of the range of G there (`much`), of its variation (`varied`) or of
    its largest slope (`steep`, instead of `varied` where that is less).  `ends`: coefficients of G' where the law or
    the branch changes, and `cap`, a coefficient of the variation of G that bounds the same; `inner`: coefficients of
    the variation; `turns`: coefficients whose products with G' may vary, part by part of the law, with `even`, that of
    the largest fall of G' per length, `eighth` of the part's share of the law, to be multiplied by the square of the
    widest cell and added to it, and `bow`, that of the largest size of G', which together bound the same.
    """

    at_cells: Collected = field(default_factory=lambda: Collected(LANDING))
    at_nodes: Collected = field(default_factory=lambda: Collected((*LANDING, "varied", "steep")))
    hard: Collected = field(default_factory=lambda: Collected((*LANDING, "node", "steep")))
    ends: Collected = field(default_factory=lambda: Collected((*BEND, "cap")))
    inner: Collected = field(default_factory=lambda: Collected(("at", "much", "side", "lo", "hi")))
    turns: Collected = field(default_factory=lambda: Collected((*BEND, "even", "eighth", "bow")))


class Reach:
    """Where throws may land, as ranges of cells on one or two sides."""

    def __init__(self, mesh: Mesh, some: Collected):
        self.at, self.much = some.array("at", np.int64), some.array("much")
        self.one, self.two = (
            mesh.within(some.array(f"side{k}", np.int64), some.array(f"lo{k}"), some.array(f"hi{k}"))
            for k in ("", "2")
        )
        self.steep = some.array("steep") if "steep" in some.columns else np.zeros(0)
        self.varied = some.array("varied") if "varied" in some.columns else np.zeros(0)

    def ends(self, g: Graph) -> tuple[Array, Array]:
        """Return the least and the largest G there."""
        (a, b), (c, d) = g.values_on(self.one), g.values_on(self.two)
        return np.minimum(a, c), np.maximum(b, d)

    def steepest(self, g: Graph) -> Array:
        """Return the largest size of a slope there."""
        return np.maximum(g.steepest_on(self.one), g.steepest_on(self.two))

    def variation(self, g: Graph) -> Array:
        """Bound the variation there."""
        one = g.variation_on(self.one)
        same = (self.one.first == self.two.first) & (self.one.last == self.two.last)
        return np.where(same, one, one + g.variation_on(self.two))


class Bent:
    """Coefficients of slopes, with the ranges on which they are."""

    def __init__(self, mesh: Mesh, some: Collected):
        self.at = some.array("at", np.int64)
        self.least, self.most = some.array("least"), some.array("most")
        self.span = mesh.within(some.array("side", np.int64), some.array("lo"), some.array("hi"))
        self.cap, self.even, self.bow = (
            some.array(name) if name in some.columns else np.zeros(0) for name in ("cap", "even", "bow")
        )
        if "eighth" in some.columns:
            width = np.diff(mesh.place, append=np.inf)
            self.share = 8.0 * some.array("eighth")
            self.even += some.array("eighth") * Extremes(width).on(self.span.cells)[1] ** 2

    def products(self, g: Graph) -> tuple[Array, Array]:
        """Return the least and the largest of coefficient times slope."""
        lo, hi = g.slopes_on(self.span)
        some = (self.least * lo, self.least * hi, self.most * lo, self.most * hi)
        return np.minimum.reduce(some), np.maximum.reduce(some)


class Chain:
    """The chain on its mesh: `live` are the cells of which throws are made, by their left nodes.

    `absorbed`: by name the nodes of the cells that absorb; the exits are one of the names.  `beside`: by hard cell the
    node whose mean may serve for it.  `curved`, `turned`: the live cells with `ends`, and with `turns`.  `scatter`
    makes G of V, where landings scatter; else G is V.  `beyond`: the probability of deviations of the speed of which
    nothing is proved.  Nodes of cells below the share `narrow` of the largest place are raised together.
    """

    def __init__(
        self,
        mesh: Mesh,
        scatter: Scatter | None,
        rows: Rows,
        absorbed: dict[str, Array],
        parts: Parts,
        beyond: float,
        narrow: float = NARROW,
    ):
        self.mesh, self.scatter, self.rows, self.absorbed, self.beyond = mesh, scatter, rows, absorbed, beyond
        self.goal = goal = mesh if scatter is None else scatter.mesh
        self.narrow = narrow
        self.live = np.sort(parts.at_cells.array("at", np.int64))
        self.cells, self.nodes, self.hard = (
            Reach(goal, some) for some in (parts.at_cells, parts.at_nodes, parts.hard)
        )
        self.beside = parts.hard.array("node", np.int64)
        self.ends, self.turns = Bent(goal, parts.ends), Bent(goal, parts.turns)
        inner = parts.inner
        self.inner_at, self.inner_much = inner.array("at", np.int64), inner.array("much")
        self.inner = goal.within(inner.array("side", np.int64), inner.array("lo"), inner.array("hi"))
        self.curved, self.turned = np.unique(self.ends.at), np.unique(self.turns.at)

    def fixed(self, value: dict[str, float]) -> Array:
        """Return the largest value on places that absorb, -inf where there is none."""
        largest = np.full(len(self.mesh.place), -np.inf)
        for name, nodes in self.absorbed.items():
            largest[nodes] = np.maximum(largest[nodes], value[name])
        return largest

    def first(self, fixed: Array) -> Array:
        """Return the function that is 0 where throws are made."""
        bounds = fixed.copy()
        for at in (self.live, self.hard.at):
            for nodes in (at, at + 1):
                bounds[nodes] = np.maximum(bounds[nodes], 0.0)
        return bounds

    def above(self, values: Array, fixed: Array, more: float = 0.0) -> Array:
        """Bound `more` and the mean of V after a throw from above; on places that absorb V is fixed.

        Where sums of V could overflow, nothing is bounded: all are nan.
        """
        if not float(np.abs(values).max()) <= MOST_VALUE:
            return np.full(len(values), np.nan)
        g = Graph(self.mesh, values)
        if self.scatter is not None:
            g = Graph(self.goal, self.scatter.above(g))
        more += self.beyond * g.range
        mean = self.rows.times(g.values) + (self.rows.off * g.size + more)
        low, high = self.nodes.ends(g)
        at = self.nodes.at
        with np.errstate(over="ignore"):  # the product of two large bounds is none
            off = np.minimum(
                self.nodes.varied * self.nodes.variation(g), self.nodes.steep * self.nodes.steepest(g)
            )
        mean[at] = np.minimum(mean[at] + INFLATE * (self.nodes.much * (high - low) + off), high + more)
        live, bounds = self.live, fixed.copy()
        top = np.zeros(len(mean))
        top[self.cells.at] = self.cells.ends(g)[1] + (more + 2.0**-50 * g.size)
        # a cell has the chord of what its nodes are raised to, or the largest G where its throws land
        left, right = (
            mean[at] + (INFLATE * lift[live] + 2.0**-50 * g.size)
            for at, lift in zip(
                (live, live + 1), lifts(self.mesh, self.deficits(g), self.narrow), strict=True
            )
        )
        capped = (left >= top[live]) & (right >= top[live])
        for at, raised in ((live, left), (live + 1, right)):
            np.maximum.at(bounds, at, np.where(capped, top[live], raised))
        _, most = self.hard.ends(g)
        near = np.isfinite(self.hard.steep)  # hardly farther than what is thrown from that node
        beside = mean[self.beside] + INFLATE * np.where(near, self.hard.steep, 0.0) * self.hard.steepest(g)
        bound = np.where(near, np.minimum(most + more, beside), most + more) + 2.0**-50 * g.size
        for nodes in (self.hard.at, self.hard.at + 1):
            np.maximum.at(bounds, nodes, bound)
        return bounds

    def deficits(self, g: Graph) -> Array:
        """How far the mean may lie above the chord, by the left nodes of the cells."""
        n = len(self.mesh.place)
        product, cap = self.ends.products(g)[1], self.ends.cap * g.variation_on(self.ends.span)
        tame = np.where(product > cap, 0.0, product)
        bent = np.bincount(self.ends.at, tame, n) + 2.0**-40 * np.bincount(self.ends.at, np.abs(tame), n)
        wild = np.bincount(self.ends.at, np.where(product > cap, cap, 0.0), n)
        bent += np.bincount(self.inner_at, self.inner_much * g.variation_on(self.inner), n)
        lo, hi = self.turns.products(g)
        falls = self.turns.even * g.falls_on(self.turns.span) + self.turns.bow * g.steepest_on(
            self.turns.span
        )
        rises = np.minimum(hi - lo, falls)
        if self.scatter is None:  # G may jump, and no part lies farther from its chord than G varies
            first, last = g.values_on(self.turns.span)
            rises = np.minimum(rises, self.turns.share * (last - first))
        turned = np.bincount(self.turns.at, rises, n)
        least, most = self.cells.ends(g)
        span, gap = np.zeros(n), np.zeros(n)
        span[self.cells.at] = most - least
        gap[self.cells.at] = self.cells.much * (most - least)
        best, curved = span.copy(), self.curved
        best[curved] = np.minimum(best[curved], np.maximum(bent[curved], 0.0) + wild[curved])
        best[self.turned] = np.minimum(best[self.turned], turned[self.turned])
        return np.minimum(best + gap, span)
