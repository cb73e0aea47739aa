"""What a step of a noisy chain needs of the throws: collected cell by cell, and put together for all sides.

docs/certificates.md, "Probabilities", numbers 20 (means at nodes) and 21 (between nodes).
"""

import itertools
import math
from collections.abc import Callable

import numpy as np
from flint import arb

from .balls import Arb, Array
from .landings import Border, Landings, Noisy, both_ends, upper
from .laws import Column
from .means import INFLATE, Mesh, Scatter, Spread, mean_rows
from .model import over_angles
from .noisy_throw import Hit, Slopes, advance_over, guess_angles, kappa_at, slopes_over
from .steps import Chain, Parts

ABSORBED, LIVE, HARD = 0, 1, 2  # what a cell is: all of it absorbs, none of it does, or anything else
FAR_OUT = 4.0  # in the farthest landings that are followed
NODES = 200  # whose throws are shared out to cells at a time
NEVER = 1e200  # a coefficient for what is not bounded so


class Links(Landings):
    """What is collected of one side's throws; `parts` has it for all sides.

    In the mesh the side's first node has the number `start`; throws lead to the mesh `goal`.
    """

    def __init__(self, noisy: Noisy, number: int, mesh: Mesh, goal: Mesh, kinds: Array, parts: Parts):
        self.start, self.goal = int(mesh.first[number]), goal
        super().__init__(noisy, noisy.sides[number], mesh.place[self.start : int(mesh.first[number + 1])])
        self.number, self.parts = number, parts
        self.kinds = kinds[self.start : int(mesh.first[number + 1])]
        self.after = (number + 1) % len(noisy.sides)
        self.e = float(noisy.landing.reach)
        shift = float(self.side.shift.mid())
        self.shift = (shift, upper(abs(self.side.shift - shift)) + 2.0**-50 * noisy.far)
        # of T with delta, the largest near each node: how far from linear in a part of the law, and the slope
        self.bend, self.rate = np.zeros(len(self.x)), np.zeros(len(self.x))
        self.folds = np.zeros(len(self.x), dtype=bool)  # whether T may turn back there as the speed grows
        self.gap = float(np.diff(self.deltas).max(initial=0.0))
        weights = noisy.speed.weights.reshape(max(len(self.ends) - 1, 1), -1)
        self.weights = np.ones(1) if self.certain else weights.sum(axis=1)
        self.spread: list[Spread] = []

    def run(self, advance: Callable[[int], None]) -> None:
        """Prove everything of the side; cells of which something is missing become hard."""
        live = np.flatnonzero(self.kinds == LIVE)
        nodes = np.unique(np.concatenate([live, live + 1])).astype(int)
        for j, kappa in enumerate(self.kappas):
            guess = guess_angles(self.side, self.x[nodes], np.full(len(nodes), float(kappa.mid())))
            self.hit_all(nodes, guess, j, kappa)
            advance(len(nodes) // len(self.kappas))
        for cell in live.tolist():
            if not self.known(cell):
                self.kinds[cell] = HARD
        live = np.flatnonzero(self.kinds == LIVE)
        borders = {cell: self.branch_of(cell) for cell in live.tolist()}
        self.assign(borders)
        for cell in live.tolist():
            self.add_cell(cell, borders[cell])
        # a node between cells that have become hard just now has no bound of how far its throws may be off
        kept = np.flatnonzero(self.kinds == LIVE).tolist()
        self.at_cut = {node: self.at_cut[node] for cell in kept for node in (cell, cell + 1)}
        for node in sorted(self.at_cut):
            self.add_node(node)
        for cell in np.flatnonzero(self.kinds == HARD).tolist():
            self.add_hard(cell)

    def range_of(self, flips: int, lo: float, hi: float) -> tuple[int, float, float]:
        """Return where throws end whose jogs would end from lo to hi: the side, and a range a little wider."""
        if not flips:
            return self.number, lo, hi
        return self.after, lo - self.shift[0] - self.shift[1], hi - self.shift[0] + self.shift[1]

    def mismatch(self, node: int, border: Border, end: int) -> float:
        """Share of the law on which a node's throws are reckoned by another branch than the cell's."""
        if self.certain:
            return float(self.below[node] != border.below)
        first, last = float(self.deltas[0]), float(self.deltas[-1])
        cuts = sorted({first, last, float(self.cut[node]), border.cut[end]})
        share = 0.0
        for lo, hi in itertools.pairwise(cuts):
            own = self.below[node] if hi <= self.cut[node] else self.above[node]
            its = border.below if hi <= border.cut[end] else border.above
            share += (hi - lo) * self.law.most if own != its else 0.0
        return share * INFLATE

    def add_cell(self, cell: int, border: Border) -> None:
        """Collect the deficits of a cell."""
        over = [self.slopes(cell, column) for column in self.columns]
        h = float(self.x[cell + 1] - self.x[cell])
        error = float(self.error[cell : cell + 2].max())
        bends = [upper(abs(each.dd)) * self.gap**2 * 0.125 for each in over]
        # where T rises with x it lies between its values at the nodes, else near its chord
        bows = [0.0 if each.x > 0 else upper(abs(each.xx)) * h * h * 0.125 for each in over]
        slacks = [(bow + bend) * INFLATE + error for bow, bend in zip(bows, bends, strict=True)]
        at, slack = self.start + cell, max(slacks)
        if not slack < self.noisy.far:
            self.kinds[cell] = HARD
            return
        for node in (cell, cell + 1):
            self.bend[node] = max(self.bend[node], *bends)
            self.rate[node] = max(self.rate[node], *(upper(abs(each.d)) for each in over))
        two = self.place[cell : cell + 2]
        lo, hi = float(two.min()) - slack, float(two.max()) + slack
        gap, branches = self.undecided(cell, border)
        places = [self.range_of(branch, lo, hi) for branch in branches]
        self.parts.at_cells.rows.append((at, gap, *places[0], *places[1]))
        one_way = all(each.d > 0 for each in over) or all(each.d < 0 for each in over)
        self.folds[cell : cell + 2] |= not one_way
        curved = not self.certain and one_way and self.add_ends(cell, border, over, h, slacks)
        if border.below == border.above and (not curved or hi - lo < 8.0 * h):
            self.add_turns(cell, border.below, over, h, slack)

    def undecided(self, cell: int, border: Border) -> tuple[float, tuple[int, int]]:
        """Return the share of the law of which the branch is open or not a node's, and by which branches it lands."""
        other = max(self.mismatch(cell + k, border, k) for k in (0, 1))
        gap = border.gap + other
        if border.below != border.above:  # the density, where the branch changes, changes too
            steep = max(column.steep for column in self.columns)
            gap += (border.cut[1] - border.cut[0]) ** 2 * 0.125 * steep * INFLATE
        # throws that a node reckons by another branch land elsewhere than the cell's
        return min(gap, 1.0), (0, 1) if other > 0.0 else (border.below, border.above)

    def slopes(self, cell: int, column: Column) -> Slopes:
        """Enclose the derivatives over a cell and a column."""
        phi, deviations = self.box(cell, column)
        return slopes_over(self.side, phi, kappa_at(self.noisy.kappa, deviations), 1 + deviations)

    def add_ends(self, cell: int, border: Border, over: list[Slopes], h: float, slacks: list[float]) -> bool:
        """Bound the curvature by G' where the density and the branch change, and by the variation of G between."""
        at, eighth = self.start + cell, arb(h) ** 2 / 8
        ends: list[tuple[float, ...]] = []
        inner: list[tuple[float, ...]] = []
        for column, each, slack in zip(self.columns, over, slacks, strict=True):
            ratio = each.x / each.d
            change = each.xx - (2 * each.xd - ratio * each.dd) * ratio
            much = upper(abs(change / each.d) * eighth) * column.most * INFLATE
            cap = upper(ratio**2 * eighth) * column.steep * INFLATE
            share = column.change * eighth * ratio * each.x
            branches, within = self.branches(border, column)
            two = self.place[cell : cell + 2, column.first : column.last + 1]
            for branch in branches:
                place = self.around(branch, two, slack)
                inner.append((at, much, *place))
                if column.steep:
                    row = both_ends(share if not within else share.union(arb(0)))
                    ends.append((at, *row, *place, cap))
        for j, change in self.law.jumps:
            branch = border.above if j else border.below
            if border.below != border.above and self.nothing(border, j):
                continue
            phi = self.hits[cell][j].before.union(self.hits[cell + 1][j].after)
            own = slopes_over(self.side, phi, self.kappas[j], 1 + self.ends[j])
            wide = upper(abs(own.xx)) * h * h * 0.125 * INFLATE + float(self.error[cell : cell + 2].max())
            place = self.around(branch, self.place[cell : cell + 2, j], wide)
            ends.append((at, *self.bent(change, own.x, own.d, h), *place, self.cap(change, own.x, own.d, h)))
        if border.below != border.above:
            ends += [(at, *row) for row in self.moving(border, h)]
        if not all(math.isfinite(number) for row in ends + inner for number in row):
            return False
        self.parts.ends.rows += ends
        self.parts.inner.rows += inner
        return True

    def branches(self, border: Border, column: Column) -> tuple[tuple[int, ...], bool]:
        """Return by which branches throws of a column are made, and whether the border lies in the column."""
        first, last = self.deltas[column.first], self.deltas[column.last]
        if border.below == border.above or max(border.cut) <= first:
            return (border.above,), False
        if min(border.cut) >= last:
            return (border.below,), False
        return (border.below, border.above), True

    def bent(self, change: Arb, q: Arb, rate: Arb, h: float) -> tuple[float, float]:
        """Return the coefficient of G' where the density jumps, along places that move by q with x."""
        return both_ends(change * arb(h) ** 2 * q**2 / (8 * rate))

    def cap(self, change: Arb, q: Arb, rate: Arb, h: float) -> float:
        """Return the coefficient of the variation of G that bounds the same, where the places move one way."""
        if not (q > 0 or q < 0):
            return NEVER
        return min(upper(abs(change * q / rate) * arb(h) / 4) * INFLATE, NEVER)

    def nothing(self, border: Border, j: int) -> bool:
        """Whether on the whole cell nothing is left between the border and an end of the law."""
        return bool(border.cut[0] == border.cut[1] == self.deltas[j])

    def around(self, flips: int, ends: Array, wide: float) -> tuple[int, float, float]:
        """Return the range on which throws end between places."""
        return self.range_of(flips, float(ends.min()) - wide, float(ends.max()) + wide)

    def moving(self, border: Border, h: float) -> list[tuple[float, ...]]:
        """Return the coefficients at the border between the branches, which moves along its chord."""
        low, high = min(border.cut), max(border.cut)
        levels = arb(low).union(arb(high))
        slope = (arb(border.cut[1]) - arb(border.cut[0])) / arb(h)
        own = slopes_over(self.side, border.phi, kappa_at(self.noisy.kappa, levels), 1 + levels)
        q = own.x + slope * own.d
        bow = own.xx + 2 * slope * own.xd + slope**2 * own.dd
        wide = upper(abs(bow)) * h * h * 0.125 * INFLATE
        wide += max(upper(abs(place - float(place.mid()))) for place in border.places)
        ends = np.array([float(place.mid()) for place in border.places])
        density, rows = self.law.density(levels), list[tuple[float, ...]]()
        for j, change, branch in ((0, -density, border.below), (-1, density, border.above)):
            if not self.nothing(border, j):
                cap = self.cap(change, q, own.d, h)
                rows.append((*self.bent(change, q, own.d, h), *self.around(branch, ends, wide), cap))
        return rows

    def add_turns(self, cell: int, flips: int, over: list[Slopes], h: float, slack: float) -> None:
        """Bound how much the slope of the mean varies along a cell, part by part of the law of the speed."""
        rows = list[tuple[float, ...] | None]()
        for column, each in zip(self.columns, over, strict=True):
            for j in range(column.first, max(column.last, 1)):
                where = self.around(flips, self.place[cell : cell + 2, j : j + 2], slack)
                rows.append(turn_of(self.start + cell, h, each.x, each.xx, where, self.weights[j]))
        self.parts.turns.rows += [row for row in rows if row] if None not in rows else []

    def add_node(self, node: int) -> None:
        """Share the throws from a node out, and collect how far they may be off."""
        law, place, error = self.law, self.place[node], float(self.error[node].max())
        at, branches = self.start + node, (int(self.below[node]), int(self.above[node]))
        cut, error = self.at_cut[node][0], max(error, self.at_cut[node][1])
        slack = self.bend[node] * INFLATE + error + self.shift[1]
        lo, hi = float(place.min()) - slack, float(place.max()) + slack
        places = [self.range_of(branch, lo, hi) for branch in branches]
        if self.certain:
            self.spread.append(self.put(at, np.ones(1), branches[0], place, place))
            self.parts.at_nodes.rows.append((at, 0.0, *places[0], *places[1], 1.0, slack * INFLATE))
            return
        g, d = float(self.cut[node]), law.cuts
        between = np.interp(np.linspace(0.0, len(place) - 1.0, len(d)), np.arange(len(place)), place)
        begin, end = np.minimum(d, g), np.maximum(d, g)
        ways, spread = [], list[Spread]()
        for branch, border, at_border in (
            (branches[0], begin, np.where(d <= g, between, cut)),
            (branches[1], end, np.where(d >= g, between, cut)),
        ):
            some = np.flatnonzero(np.diff(border) > 0.0)
            weight = (law.weights * np.diff(border) / np.diff(d))[some]
            one, two = at_border[:-1][some], at_border[1:][some]
            spread.append(self.put(at, weight, branch, one, two))
            with np.errstate(divide="ignore", invalid="ignore"):
                share = 2.0 * slack / np.abs(two - one)
            near = (
                share < 0.5
            )  # a place lies within the slack of at most three ranges that are longer than that
            ways.append((3.0 * (weight * share)[near].max(initial=0.0), weight[~near].sum()))
        self.spread.append(Spread(*(np.concatenate(column) for column in zip(*spread, strict=True))))
        # by its variation where each place is met once
        varied = NEVER if self.folds[node] else max(way[0] for way in ways) + law.ripple
        split = float(branches[0] != branches[1] and d[0] < g < d[-1])
        much = sum(way[1] for way in ways) + split * law.ripple
        steep = slack + self.rate[node] * (law.tilt + split * law.ripple * float(np.diff(d).max()))
        self.parts.at_nodes.rows.append(
            (at, much * INFLATE, *places[0], *places[1], varied * INFLATE, steep * INFLATE)
        )

    def put(self, at: int, weight: Array, flips: int, one: Array, two: Array) -> Spread:
        """Spread weights, each between where two throws end."""
        shift, side = (self.shift[0], self.after) if flips else (0.0, self.number)
        lo, hi = np.minimum(one, two) - shift, np.maximum(one, two) - shift
        return Spread(np.full(len(weight), at), weight, np.full(len(weight), side), lo, hi)

    def add_hard(self, cell: int) -> None:
        """Collect where throws from a cell may land at all, on both branches; the next node's throws among them."""
        node = self.next_thrown(cell)
        x = (float(self.x[cell]), float(self.x[node]))
        known = node in self.hits and bool(np.isfinite(self.error[node]).all())
        last = self.hits[node][len(self.ends) - 1] if known else self.hit_of(x[1], self.kappas[-1])
        first = arb(0)
        if arb(x[0]) > self.side.a:
            before = self.hit_of(x[0], self.kappas[0])
            first = first if before is None else before.before
        low, high = -math.inf, math.inf
        if last is not None:
            low, high = both_ends(
                arb(x[0]).union(arb(x[1])) + advance_over(self.side, first.union(last.after))
            )
        # as far out as that all places are exits, also where landings scatter
        lo, hi = (min(max(end, -FAR_OUT * self.noisy.far), FAR_OUT * self.noisy.far) for end in (low, high))
        one, two = (self.range_of(branch, lo, hi) for branch in (0, 1))
        steep = self.off_next(cell, node, first, last)
        self.parts.hard.rows.append((self.start + cell, 0.0, *one, *two, self.start + node, steep))

    def next_thrown(self, cell: int) -> int:
        """Find the node next to a cell on the right, or the first one near it that is thrown from: at the joint.

        Cells there are hard and lead to themselves; their throws are hardly others than those from that node.
        """
        right = cell + 1
        near = (k for k in range(right, min(right + 4, len(self.x))) if k in self.at_cut)
        node = next(near, right)
        return node if self.x[node] - self.x[cell] < self.e else right

    def off_next(self, cell: int, node: int, first: Arb, last: Hit | None) -> float:
        """Bound how far the mean from a hard cell is from that at a node, as a share of the largest slope of G.

        Infinite where the node is not thrown from, or not surely by one branch as all that is between.
        """
        if last is None or node not in self.at_cut or self.below[node] != self.above[node]:
            return math.inf
        x_lo = self.side.a.lower() if self.side.a > arb(float(self.x[cell])) else arb(float(self.x[cell]))
        x = x_lo.union(arb(float(self.x[node])))
        deviations = (-self.most).union(self.most)
        kappa, phi = kappa_at(self.noisy.kappa, deviations), first.union(last.after)
        if int(over_angles(self.side, phi, x, kappa)[0]) != self.below[node]:
            return math.inf
        slope = slopes_over(self.side, phi, kappa, 1 + deviations).x
        return upper(abs(slope) * (arb(float(self.x[node])) - x_lo)) * INFLATE


def turn_of(
    at: int, h: float, slope: Arb, bend: Arb, where: tuple[int, float, float], weight: float = 1.0
) -> tuple[float, ...] | None:
    """Bound how much the slope of G(T(x)) varies along a cell that T takes to a range; None where T' has no bounds.

    Or how far G, affine on cells at most d wide, lies above its chord over a length l where its slope falls by at most
    L per length: L (l^2 + d^2)/8, for less a parabola's interpolant it is convex; `Bent` knows d.
    """
    least, most = both_ends(slope)
    bow = upper(abs(bend)) * h * h * 0.125 * INFLATE if bend.is_finite() else math.inf
    length, scale, eighth = max(-least, most) * h, h * 0.25 * weight * INFLATE, weight * 0.125 * INFLATE
    if not (math.isfinite(bow) and math.isfinite(length * length)):
        return None
    return at, least * scale, most * scale, *where, length * length * eighth, eighth, weight * bow


def chain_of(
    noisy: Noisy, mesh: Mesh, kinds: Array, absorbed: dict[str, Array], advance: Callable[[int], None]
) -> Chain:
    """Prove the throws of all sides, and put together what a step needs."""
    scatter = Scatter(mesh, noisy.landing) if not noisy.landing.certain else None
    goal = mesh if scatter is None else scatter.mesh
    parts, spread = Parts(), list[Spread]()
    for number in range(len(noisy.sides)):
        links = Links(noisy, number, mesh, goal, kinds, parts)
        links.run(advance)
        spread += links.spread
    # nodes in turn, with all that is thrown from each
    chunks = [spread[k : k + NODES] for k in range(0, len(spread), NODES)]
    together = (Spread(*(np.concatenate(column) for column in zip(*some, strict=True))) for some in chunks)
    rows = mean_rows(len(mesh.place), goal, together)
    return Chain(mesh, scatter, rows, absorbed, parts, noisy.speed.beyond)
