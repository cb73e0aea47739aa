"""One side of a noisy chain: where throws land from every node and by which branch, and one throw of a bound.

docs/certificates.md, "Probabilities", numbers 18 (landings) and 19 (the border).
"""

import itertools
import math
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .averages import (
    INFLATE,
    Hit,
    Mesh,
    Rows,
    Table,
    decides,
    deciding,
    deciding_slopes,
    extremes,
    guess_angle,
    guess_border,
    kappa_at,
    land,
)
from .balls import HALF, Arb, Array, exact, float_above
from .scene import Side

# ----------------------------------------------------------------
# One throw of a bound: what the cells of a noisy chain need, and the step from one function to the next.
#
# docs/certificates.md, "Probabilities", numbers 20 to 22.  The mean of V after a throw is bounded at the nodes; on a
# cell it lies above the chord by the least of the deficits that are proved there, and by what is not decided.


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


LANDING = ("at", "much", "side", "lo", "hi", "side2", "lo2", "hi2")
BEND = ("at", "least", "most", "side", "lo", "hi")


@dataclass
class Parts:
    """Everything that is proved of the throws, with places instead of functions.

    `at_cells`, `at_nodes`: where throws may land, on one or two sides, and by how much more or less the mean may be, as
    a share of what V varies by there; `ends`: coefficients of W' where the speeds end or the branch changes; `inner`:
    coefficients of |W'|; `turns`: coefficients whose products with W' may vary; `hard`: cells of which no more is
    known than where their throws may land.
    """

    at_cells: Collected = field(default_factory=lambda: Collected(LANDING))
    at_nodes: Collected = field(default_factory=lambda: Collected(LANDING))
    hard: Collected = field(default_factory=lambda: Collected((*LANDING, "node")))
    ends: Collected = field(default_factory=lambda: Collected(BEND))
    inner: Collected = field(default_factory=lambda: Collected(("at", "much", "side", "lo", "hi")))
    turns: Collected = field(default_factory=lambda: Collected(BEND))


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


class Chain:
    """The chain on its mesh: `live` are the cells of which throws are made, by their left nodes.

    `absorbed`: by name the nodes of the cells that absorb; the exits are one of the names.  `beside`: by hard cell the
    node whose mean may serve for it.  `curved`, `turned`: the live cells with `ends`, and with `turns`.
    """

    def __init__(self, mesh: Mesh, rows: Rows, absorbed: dict[str, Array], parts: Parts, e: float):
        self.mesh, self.rows, self.absorbed, self.table = mesh, rows, absorbed, Table(mesh, e)
        self.live = np.sort(parts.at_cells.array("at", np.int64))
        self.cells, self.nodes = Reach(self.table, parts.at_cells), Reach(self.table, parts.at_nodes)
        self.hard, self.beside = Reach(self.table, parts.hard), parts.hard.array("node", np.int64)
        self.ends, self.inner, self.turns = (
            Bent(self.table, some) for some in (parts.ends, parts.inner, parts.turns)
        )
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
        """Bound `more` and the mean of V after a throw from above; on places that absorb V is fixed."""
        size = float(np.abs(values).max())
        mean = self.rows.times(values) + (self.rows.off * size + more)
        low, high = self.nodes.ends(values)
        at = self.nodes.at
        mean[at] = np.minimum(mean[at] + INFLATE * self.nodes.much * (high - low), high + more)
        deficit = INFLATE * self.deficits(values)[self.live] + 2.0**-50 * size
        bounds = fixed.copy()
        for nodes in (self.live, self.live + 1):
            bounds[nodes] = np.maximum(bounds[nodes], mean[nodes] + deficit)
        least, most = self.hard.ends(values)
        near = np.isfinite(self.hard.much)  # hardly farther than what is thrown from that node
        beside = mean[self.beside] + INFLATE * np.where(near, self.hard.much, 0.0) * (most - least)
        bound = np.where(near, np.minimum(most + more, beside), most + more) + 2.0**-50 * size
        for nodes in (self.hard.at, self.hard.at + 1):
            np.maximum.at(bounds, nodes, bound)
        return bounds

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


# ----------------------------------------------------------------
# The throws of one side of a noisy chain: where they land from every node, and by which branch from every cell.


PIECES = 8  # of the speeds, where what decides is not seen to rise or fall with them at once
MOST_PLACE = 200.0  # no landing is followed farther out


class Noisy(NamedTuple):
    """The scene's sides, kappa of a throw without deviation, and the bounds of the laws, which are uniform."""

    sides: list[Side]
    kappa: Arb
    speed: Fraction
    landing: Fraction
    strata: int


class Border(NamedTuple):
    """Along a cell: deviations at its two nodes between which, on the chord, the branch changes, and how surely."""

    cut: tuple[float, float]
    below: int
    above: int
    gap: float  # share of the law on which the branch may be the other one
    phi: Arb
    places: tuple[Arb, Arb]


def upper(ball: Arb) -> float:
    """Round up; infinite where nothing is known."""
    return float_above(ball) if ball.is_finite() else math.inf


def both_ends(ball: Arb) -> tuple[float, float]:
    """Round outward; infinite where nothing is known."""
    return -upper(-ball), upper(ball)


class Landings:
    """What is proved of one side's throws: where they land, at the speeds between strata, and by which branch.

    Nodes and cells are numbered along the side, whose nodes lie at `x`.
    """

    def __init__(self, noisy: Noisy, side: Side, x: Array):
        self.noisy, self.side, self.x = noisy, side, x
        self.most = exact(noisy.speed)
        self.certain = noisy.speed == 0
        count = 1 if self.certain else noisy.strata + 1
        shares = [Fraction(2 * j, noisy.strata) - 1 for j in range(count)]
        deltas = [Fraction(0)] if self.certain else [noisy.speed * share for share in shares]
        self.deltas = np.array([float(delta) for delta in deltas])
        self.kappas = [kappa_at(noisy.kappa, exact(delta)) for delta in deltas]
        n = len(self.x)
        self.place, self.error = np.full((n, count), np.nan), np.full((n, count), np.inf)
        self.outer: dict[int, tuple[Hit, Hit]] = {}
        self.cut, self.below, self.above = np.full(n, self.deltas[-1]), np.zeros(n, int), np.zeros(n, int)
        self.at_cut: dict[int, tuple[float, float]] = {}

    # ------------------------------------------------------------------------------------------------- landings

    def hit_all(self, nodes: Array, guess: Array, j: int, kappa: Arb) -> None:
        """Enclose where throws at one speed land from all nodes."""
        for node, angle in zip(nodes.tolist(), guess.tolist(), strict=True):
            x = arb(float(self.x[node]))
            hit = land(self.side, x, kappa, angle) if x > self.side.a else None
            if hit is None:
                continue
            self.place[node, j] = middle = float(hit.place.mid())
            self.error[node, j] = upper(abs(hit.place - middle)) + 2.0**-48 * abs(middle)
            if j in (0, len(self.kappas) - 1):
                first = self.outer.get(node, (hit, hit))[0]
                self.outer[node] = (first, hit)

    def known(self, cell: int) -> bool:
        """Whether all throws from both nodes are enclosed, and none is far out."""
        two = slice(cell, cell + 2)
        close = np.abs(self.place[two]).max() < MOST_PLACE
        return bool(np.isfinite(self.error[two]).all() and close and self.x[cell + 1] > self.x[cell])

    def box(self, cell: int) -> tuple[Arb, Arb]:
        """Return the angles of all throws from a cell, and their deviations."""
        phi = self.outer[cell][0].before.union(self.outer[cell + 1][1].after)
        return phi, (-self.most).union(self.most)

    # ------------------------------------------------------------------------------------------------- decisions

    def branch_of(self, cell: int) -> Border:
        """Prove the branch of a cell, or where it changes; with no more than the gap 1 where neither is proved."""
        ends = (float(self.x[cell]), float(self.x[cell + 1]))
        phi, _ = self.box(cell)
        hits = (self.outer[cell][0], self.outer[cell + 1][1])
        branch = decides(self.side, ends, self.noisy.kappa, self.most, hits)
        last = float(self.deltas[-1])
        none = (hits[0].place, hits[1].place)
        if branch != 2:
            return Border((last, last), branch, branch, 0.0, phi, none)
        border = None if self.certain else self.border_of(cell, ends)
        return border or Border((last, last), 0, 1, 1.0, phi, none)

    def border_of(self, cell: int, ends: tuple[float, float]) -> Border | None:
        """Prove how far from a chord the branch changes, where what decides rises or falls with the speed."""
        s, kappa = self.side, self.noisy.kappa
        x = arb(ends[0]).union(arb(ends[1]))
        by_d = self.by_speed(cell, ends, x)
        rises = bool(by_d > 0)
        if not (rises or by_d < 0):
            return None
        sign, most = (1 if rises else -1), float(self.deltas[-1])
        cut = guess_border(s, np.array(ends), float(kappa.mid()), most, np.full(2, rises))
        tried = [self.hit_at(end, g) for end, g in zip(ends, cut.tolist(), strict=True)]
        tried += [self.hit_at(ends[0], float(cut.min())), self.hit_at(ends[1], float(cut.max()))]
        known = [hit for hit in tried if hit is not None]
        if len(known) < len(tried):
            return None
        hits, corners = known[:2], known[2:]
        values = [
            sign * deciding(s, hit.before.union(hit.after), arb(end), kappa_at(kappa, arb(g)))
            for hit, end, g in zip(hits, ends, cut.tolist(), strict=True)
        ]
        near = corners[0].before.union(corners[1].after)
        low, high = float(cut.min()), float(cut.max())
        far = self.distance(near, x, (low, high), (by_d, values), ends, cut)
        if 0.0 < far < most:  # once more, with the derivative near the chord alone
            levels = max(low - far, -most), min(high + far, most)
            first, last = self.hit_at(ends[0], levels[0]), self.hit_at(ends[1], levels[1])
            if first is not None and last is not None:
                angles, deviations = first.before.union(last.after), arb(levels[0]).union(arb(levels[1]))
                _, steep = deciding_slopes(s, angles, x, kappa_at(kappa, deviations), 1 + deviations)
                far = min(far, self.distance(near, x, (low, high), (steep, values), ends, cut))
        gap = min(INFLATE * far / (2.0 * most), 1.0)
        places = (hits[0].place, hits[1].place)
        return Border((float(cut[0]), float(cut[1])), int(not rises), int(rises), gap, near, places)

    def by_speed(self, cell: int, ends: tuple[float, float], x: Arb) -> Arb:
        """Enclose how what decides changes with the speed, over all speeds, in pieces where need be."""
        phi, deviations = self.box(cell)
        _, whole = deciding_slopes(self.side, phi, x, kappa_at(self.noisy.kappa, deviations), 1 + deviations)
        if whole > 0 or whole < 0:
            return whole
        cuts = np.linspace(-float(self.deltas[-1]), float(self.deltas[-1]), PIECES + 1).tolist()
        slopes = []
        for k, (low, high) in enumerate(itertools.pairwise(cuts)):
            first, last = self.hit_at(ends[0], low), self.hit_at(ends[1], high)
            if first is None or last is None:
                return whole
            # the ends of the law themselves, which are no floats
            low_end = -self.most if k == 0 else arb(low)
            high_end = self.most if k == PIECES - 1 else arb(high)
            before = self.outer[cell][0].before if k == 0 else first.before
            after = self.outer[cell + 1][1].after if k == PIECES - 1 else last.after
            some = low_end.union(high_end)
            angles = before.union(after)
            slopes.append(
                deciding_slopes(self.side, angles, x, kappa_at(self.noisy.kappa, some), 1 + some)[1]
            )
        together = slopes[0]
        for each in slopes[1:]:
            together = together.union(each)
        return together

    def distance(
        self,
        phi: Arb,
        x: Arb,
        levels: tuple[float, float],
        known: tuple[Arb, list[Arb]],
        ends: tuple[float, float],
        cut: Array,
    ) -> float:
        """Bound how far the branch changes from the chord, on both sides together.

        What decides, turned so that it rises with the speed, has the values known at the two nodes.  Along the chord it
        rises or falls, or it varies by at most half the cell times its slope.
        """
        by_d, values = known
        between = arb(levels[0]).union(arb(levels[1]))
        h = arb(ends[1]) - arb(ends[0])
        slope = (arb(float(cut[1])) - arb(float(cut[0]))) / h
        along_x, along_d = deciding_slopes(
            self.side, phi, x, kappa_at(self.noisy.kappa, between), 1 + between
        )
        along = along_x + slope * along_d
        extra = 0.0 if along > 0 or along < 0 else upper(HALF * h * abs(along))
        over = max(max(upper(v) for v in values) + extra, 0.0)
        under = max(max(upper(-v) for v in values) + extra, 0.0)
        steep, most = -upper(-abs(by_d)), float(self.deltas[-1])
        if not steep > 0.0:
            return 2.0 * most
        return min(over / steep, levels[1] + most) + min(under / steep, most - levels[0])

    def hit_at(self, x: float, delta: float) -> Hit | None:
        """Enclose a throw with a deviation that is a float."""
        return self.hit_of(x, kappa_at(self.noisy.kappa, arb(delta)))

    def hit_of(self, x: float, kappa: Arb) -> Hit | None:
        """Enclose a throw with some kappa."""
        return land(self.side, arb(x), kappa, guess_angle(self.side, x, float(kappa.mid())))

    def assign(self, borders: dict[int, Border]) -> None:
        """Choose how throws from each node are reckoned: as on a cell beside it, best on one with a border."""

        def known(item: tuple[int, Border]) -> int:
            _, border = item
            return 1 if border.below == border.above else 2 if border.gap < 1.0 else 0

        for cell, border in sorted(borders.items(), key=known):
            for end, node in enumerate((cell, cell + 1)):
                self.cut[node], self.below[node], self.above[node] = (
                    border.cut[end],
                    border.below,
                    border.above,
                )
                middle = float(border.places[end].mid())
                self.at_cut[node] = (middle, upper(abs(border.places[end] - middle)))
