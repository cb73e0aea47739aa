"""What a step of a noisy chain needs of the throws: collected cell by cell, and put together for all sides.

docs/certificates.md, "Probabilities", numbers 20 (means at nodes) and 21 (between nodes).
"""

import itertools
import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
from flint import arb

from .averages import (
    INFLATE,
    Hit,
    Mesh,
    Slopes,
    Spread,
    advance_over,
    guess_angles,
    kappa_at,
    mean_rows,
    slopes_over,
)
from .balls import Arb, Array, exact
from .landings import MOST_PLACE, Border, Chain, Landings, Noisy, Parts, both_ends, upper
from .model import over_angles

ABSORBED, LIVE, HARD = 0, 1, 2  # what a cell is: all of it absorbs, none of it does, or anything else


class Links(Landings):
    """What is collected of one side's throws; `parts` has it for all sides.

    In the mesh the side's first node has the number `start`.
    """

    def __init__(self, noisy: Noisy, number: int, mesh: Mesh, kinds: Array, parts: Parts):
        self.start = int(mesh.first[number])
        super().__init__(noisy, noisy.sides[number], mesh.place[self.start : int(mesh.first[number + 1])])
        self.number, self.parts = number, parts
        self.kinds = kinds[self.start : int(mesh.first[number + 1])]
        self.after = (number + 1) % len(noisy.sides)
        self.e = float(noisy.landing)
        shift = float(self.side.shift.mid())
        self.shift = (shift, upper(abs(self.side.shift - shift)) + 2.0**-50 * MOST_PLACE)
        self.bend = np.zeros(len(self.x))  # of T with delta, the largest near each node
        self.spread: list[tuple[int, float, int, float, float]] = []

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
            share += (hi - lo) / (last - first) if own != its else 0.0
        return share * INFLATE

    def add_cell(self, cell: int, border: Border) -> None:
        """Collect the deficits of a cell."""
        s = self.side
        phi, deviations = self.box(cell)
        over = slopes_over(s, phi, kappa_at(self.noisy.kappa, deviations), 1 + deviations)
        h = float(self.x[cell + 1] - self.x[cell])
        step = 0.0 if self.certain else 2.0 * float(self.deltas[-1]) / self.noisy.strata
        wide = (upper(abs(over.xx)) * h * h + upper(abs(over.dd)) * step * step) * 0.125 * INFLATE
        slack = wide + float(self.error[cell : cell + 2].max())
        at = self.start + cell
        if not slack < MOST_PLACE:
            self.kinds[cell] = HARD
            return
        for node in (cell, cell + 1):
            self.bend[node] = max(self.bend[node], upper(abs(over.dd)) * step * step * 0.125)
        two = self.place[cell : cell + 2]
        lo, hi = float(two.min()) - slack, float(two.max()) + slack
        other = max(self.mismatch(cell + k, border, k) for k in (0, 1))
        gap = min(border.gap + other, 1.0)
        # throws that a node reckons by another branch land elsewhere than the cell's
        branches = (0, 1) if other > 0.0 else (border.below, border.above)
        places = [self.range_of(branch, lo, hi) for branch in branches]
        self.parts.at_cells.rows.append((at, gap, *places[0], *places[1]))
        if not self.certain and (over.d > 0 or over.d < 0):
            self.add_ends(cell, border, over, h, places)
        if border.below == border.above and (self.certain or hi - lo < 8.0 * h or not self.curves(at)):
            self.add_turns(cell, border.below, over, h, slack)

    def curves(self, at: int) -> bool:
        """Whether a cell has just been given its ends."""
        return bool(self.parts.ends.rows) and self.parts.ends.rows[-1][0] == at

    def add_ends(
        self, cell: int, border: Border, over: Slopes, h: float, places: list[tuple[int, float, float]]
    ) -> None:
        """Bound the curvature by W' where the speeds end and where the branch changes, and by |W'| between."""
        at, last = self.start + cell, len(self.kappas) - 1
        scale = exact(Fraction(h) ** 2 / (32 * self.noisy.speed * self.noisy.landing))
        change = over.xx - (2 * over.xd - over.x * over.dd / over.d) * over.x / over.d
        much = upper(abs(change)) * h * h / (16.0 * self.e) * INFLATE
        rows: list[tuple[float, ...]] = []
        split = border.below != border.above
        for j, sign, branch in ((0, 1, border.below), (last, -1, border.above)):
            if split and self.nothing(border, j):
                continue
            phi = self.outer[cell][min(j, 1)].before.union(self.outer[cell + 1][min(j, 1)].after)
            delta = exact(self.noisy.speed) * (1 if j else -1)
            own = slopes_over(self.side, phi, self.kappas[j], 1 + delta)
            wide = upper(abs(over.xx)) * h * h * 0.125 * INFLATE + float(self.error[cell : cell + 2].max())
            ends = self.place[cell : cell + 2, j]
            rows.append((*both_ends(sign * scale * own.x**2 / own.d), *self.around(branch, ends, wide)))
        if split:
            rows += self.moving(border, over, h, scale)
        if math.isfinite(much) and all(math.isfinite(c) for row in rows for c in row[:2]):
            self.parts.ends.rows += [(at, *row) for row in rows]
            self.parts.inner.rows += [(at, much, *place) for place in {*places}]

    def nothing(self, border: Border, j: int) -> bool:
        """Whether on the whole cell nothing is left between the border and an end of the law."""
        return bool(border.cut[0] == border.cut[1] == self.deltas[j])

    def around(self, flips: int, ends: Array, wide: float) -> tuple[int, float, float]:
        """Return the range on which throws end between two places."""
        return self.range_of(flips, float(ends.min()) - wide, float(ends.max()) + wide)

    def moving(self, border: Border, over: Slopes, h: float, scale: Arb) -> list[tuple[float, ...]]:
        """Return the coefficients at the border between the branches, which moves along its chord."""
        low, high = min(border.cut), max(border.cut)
        levels = arb(low).union(arb(high))
        slope = (arb(border.cut[1]) - arb(border.cut[0])) / arb(h)
        own = slopes_over(self.side, border.phi, kappa_at(self.noisy.kappa, levels), 1 + levels)
        shape = (own.x + slope * own.d) ** 2 / own.d
        bow = over.xx + 2 * slope * over.xd + slope**2 * over.dd
        wide = upper(abs(bow)) * h * h * 0.125 * INFLATE
        wide += max(upper(abs(place - float(place.mid()))) for place in border.places)
        if not wide < MOST_PLACE:
            return [(math.inf, math.inf, self.number, 0.0, 0.0)]
        ends = np.array([float(place.mid()) for place in border.places])
        return [
            (*both_ends(sign * scale * shape), *self.around(branch, ends, wide))
            for j, sign, branch in ((0, -1, border.below), (-1, 1, border.above))
            if not self.nothing(border, j)
        ]

    def add_turns(self, cell: int, flips: int, over: Slopes, h: float, slack: float) -> None:
        """Bound how much the slope of the mean varies along a cell, stratum by stratum of the speed."""
        at, strata = self.start + cell, max(len(self.kappas) - 1, 1)
        least, most = both_ends(over.x)
        scale = h / (8.0 * self.e * strata) * INFLATE
        if not (math.isfinite(least) and math.isfinite(most)):
            return
        for j in range(strata):
            two = self.place[cell : cell + 2, j : j + 2]
            where = self.range_of(flips, float(two.min()) - slack, float(two.max()) + slack)
            self.parts.turns.rows.append((at, least * scale, most * scale, *where))

    def add_node(self, node: int) -> None:
        """Share the throws from a node out, and collect how far they may be off."""
        place, error = self.place[node], float(self.error[node].max())
        at, branches = self.start + node, (int(self.below[node]), int(self.above[node]))
        cut, error = self.at_cut[node][0], max(error, self.at_cut[node][1])
        slack = self.bend[node] * INFLATE + error
        places = [self.range_of(b, float(place.min()) - slack, float(place.max()) + slack) for b in branches]
        much = (slack + self.shift[1]) / (2.0 * self.e) * INFLATE
        self.parts.at_nodes.rows.append((at, much, *places[0], *places[1]))
        if self.certain:
            self.put(at, 1.0, branches[0], place[0], place[0])
            return
        d, g = self.deltas, float(self.cut[node])
        whole = float(d[-1] - d[0])
        for j in range(len(d) - 1):
            if g > d[j]:
                end = float(place[j + 1]) if g >= d[j + 1] else cut
                self.put(at, (min(g, d[j + 1]) - d[j]) / whole, branches[0], place[j], end)
            if g < d[j + 1]:
                begin = float(place[j]) if g <= d[j] else cut
                self.put(at, (d[j + 1] - max(g, d[j])) / whole, branches[1], begin, place[j + 1])

    def put(self, at: int, weight: float, flips: int, one: float, two: float) -> None:
        """Add a weight that is spread between where two throws end."""
        ends = [float(place) - self.shift[0] if flips else float(place) for place in (one, two)]
        side = self.after if flips else self.number
        self.spread.append((at, float(weight), side, min(ends), max(ends)))

    def add_hard(self, cell: int) -> None:
        """Collect where throws from a cell may land at all, on both branches; the next node's throws among them."""
        node = self.next_thrown(cell)
        x = (float(self.x[cell]), float(self.x[node]))
        known = node in self.outer and bool(np.isfinite(self.error[node]).all())
        last = self.outer[node][1] if known else self.hit_of(x[1], self.kappas[-1])
        first = arb(0)
        if arb(x[0]) > self.side.a:
            before = self.hit_of(x[0], self.kappas[0])
            first = first if before is None else before.before
        lo, hi = -MOST_PLACE, MOST_PLACE  # beyond, all places are exits
        if last is not None:
            low, high = both_ends(
                arb(x[0]).union(arb(x[1])) + advance_over(self.side, first.union(last.after))
            )
            lo, hi = max(lo, low), min(hi, high)
        one, two = (self.range_of(branch, lo, hi) for branch in (0, 1))
        much = self.off_next(cell, node, first, last)
        self.parts.hard.rows.append((self.start + cell, much, *one, *two, self.start + node))

    def next_thrown(self, cell: int) -> int:
        """Find the node next to a cell on the right, or the first one near it that is thrown from: at the joint.

        Cells there are hard and lead to themselves; their throws are hardly others than those from that node.
        """
        right = cell + 1
        near = (k for k in range(right, min(right + 4, len(self.x))) if k in self.at_cut)
        node = next(near, right)
        return node if self.x[node] - self.x[cell] < self.e else right

    def off_next(self, cell: int, node: int, first: Arb, last: Hit | None) -> float:
        """Bound how far the mean from a hard cell is from that at a node, as a share of what V varies by.

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
        return upper(abs(slope) * (arb(float(self.x[node])) - x_lo)) / (2.0 * self.e) * INFLATE


def chain_of(
    noisy: Noisy, mesh: Mesh, kinds: Array, absorbed: dict[str, Array], advance: Callable[[int], None]
) -> Chain:
    """Prove the throws of all sides, and put together what a step needs."""
    parts, spread = Parts(), list[tuple[int, float, int, float, float]]()
    for number in range(len(noisy.sides)):
        links = Links(noisy, number, mesh, kinds, parts)
        links.run(advance)
        spread += links.spread
    e = float(noisy.landing)
    kinds_of_columns = (np.int64, float, np.int64, float, float)
    columns = [np.array([put[k] for put in spread], dtype=kind) for k, kind in enumerate(kinds_of_columns)]
    rows = mean_rows(len(mesh.place), mesh, Spread(*columns), e)
    return Chain(mesh, rows, absorbed, parts, e)
