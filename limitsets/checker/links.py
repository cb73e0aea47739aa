"""The throws of a noisy chain, proved cell by cell in balls: from the laws and the nodes to what a step needs.

docs/certificates.md, "Probabilities", numbers 18 to 21.
"""

import itertools
import math
from collections.abc import Callable
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb

from .averages import INFLATE, Mesh, Spread, Table, mean_rows
from .balls import HALF, Arb, Array, exact, float_above
from .chain import Bent, Chain, Parts, Reach
from .model import over_angles
from .scene import Side
from .speeds import (
    Hit,
    Slopes,
    advance_over,
    decides,
    deciding,
    deciding_slopes,
    guess_angle,
    guess_angles,
    guess_border,
    kappa_at,
    land,
    slopes_over,
)

ABSORBED, LIVE, HARD = 0, 1, 2  # what a cell is: all of it absorbs, none of it does, or anything else
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


class Links:
    """What is proved of one side's throws; `parts` collects it for all sides.

    Nodes and cells have the numbers that they have in the mesh, `start` being that of the side's first node.
    """

    def __init__(self, noisy: Noisy, number: int, mesh: Mesh, kinds: Array, parts: Parts):
        self.noisy, self.number, self.side, self.parts = noisy, number, noisy.sides[number], parts
        self.start = int(mesh.first[number])
        self.x = mesh.place[self.start : int(mesh.first[number + 1])]
        self.kinds = kinds[self.start : int(mesh.first[number + 1])]
        self.after = (number + 1) % len(noisy.sides)
        self.most, self.e = exact(noisy.speed), float(noisy.landing)
        self.certain = noisy.speed == 0
        shift = float(self.side.shift.mid())
        self.shift = (shift, upper(abs(self.side.shift - shift)) + 2.0**-50 * MOST_PLACE)
        count = 1 if self.certain else noisy.strata + 1
        shares = [Fraction(2 * j, noisy.strata) - 1 for j in range(count)]
        deltas = [Fraction(0)] if self.certain else [noisy.speed * share for share in shares]
        self.deltas = np.array([float(delta) for delta in deltas])
        self.kappas = [kappa_at(noisy.kappa, exact(delta)) for delta in deltas]
        n = len(self.x)
        self.place, self.error = np.full((n, count), np.nan), np.full((n, count), np.inf)
        self.outer: dict[int, tuple[Hit, Hit]] = {}
        self.bend = np.zeros(n)  # of T with delta, the largest near each node
        self.cut, self.below, self.above = np.full(n, self.deltas[-1]), np.zeros(n, int), np.zeros(n, int)
        self.at_cut: dict[int, tuple[float, float]] = {}
        self.spread: list[tuple[int, float, int, float, float]] = []

    def run(self, told: Callable[[int], None]) -> None:
        """Prove everything of the side; cells of which something is missing become hard."""
        live = np.flatnonzero(self.kinds == LIVE)
        nodes = np.unique(np.concatenate([live, live + 1])).astype(int)
        for j, kappa in enumerate(self.kappas):
            guess = guess_angles(self.side, self.x[nodes], np.full(len(nodes), float(kappa.mid())))
            self.hit_all(nodes, guess, j, kappa)
            told(len(nodes) // len(self.kappas))
        for cell in live.tolist():
            if not self.known(cell):
                self.kinds[cell] = HARD
        live = np.flatnonzero(self.kinds == LIVE)
        found = {cell: self.branch_of(cell) for cell in live.tolist()}
        self.assign(found)
        for cell in live.tolist():
            self.add_cell(cell, found[cell])
        # a node between cells that have become hard just now has no bound of how far its throws may be off
        kept = np.flatnonzero(self.kinds == LIVE).tolist()
        self.at_cut = {node: self.at_cut[node] for cell in kept for node in (cell, cell + 1)}
        for node in sorted(self.at_cut):
            self.add_node(node)
        for cell in np.flatnonzero(self.kinds == HARD).tolist():
            self.add_hard(cell)

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
        found = decides(self.side, ends, self.noisy.kappa, self.most, hits)
        last = float(self.deltas[-1])
        none = (hits[0].place, hits[1].place)
        if found != 2:
            return Border((last, last), found, found, 0.0, phi, none)
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
        found = []
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
            found.append(deciding_slopes(self.side, angles, x, kappa_at(self.noisy.kappa, some), 1 + some)[1])
        together = found[0]
        for each in found[1:]:
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

    def assign(self, found: dict[int, Border]) -> None:
        """Choose how throws from each node are reckoned: as on a cell beside it, best on one with a border."""

        def known(item: tuple[int, Border]) -> int:
            _, border = item
            return 1 if border.below == border.above else 2 if border.gap < 1.0 else 0

        for cell, border in sorted(found.items(), key=known):
            for end, node in enumerate((cell, cell + 1)):
                self.cut[node], self.below[node], self.above[node] = (
                    border.cut[end],
                    border.below,
                    border.above,
                )
                middle = float(border.places[end].mid())
                self.at_cut[node] = (middle, upper(abs(border.places[end] - middle)))

    # ------------------------------------------------------------------------------------------------- collecting

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
        """Collect where throws from a cell may land at all, on both branches."""
        x = (float(self.x[cell]), float(self.x[cell + 1]))
        known = cell + 1 in self.outer and bool(np.isfinite(self.error[cell + 1]).all())
        last = self.outer[cell + 1][1] if known else self.hit_of(x[1], self.kappas[-1])
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
        self.parts.hard.rows.append((self.start + cell, self.off_next(cell, first, last), *one, *two))

    def off_next(self, cell: int, first: Arb, last: Hit | None) -> float:
        """Bound how far the mean from a hard cell is from that at its right node, as a share of what V varies by.

        Infinite where the node is not thrown from, or not surely by one branch as all of the cell.
        """
        node = cell + 1
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
    noisy: Noisy, mesh: Mesh, kinds: Array, absorbed: dict[str, Array], told: Callable[[int], None]
) -> Chain:
    """Prove the throws of all sides, and put together what a step needs."""
    parts, spread = Parts(), list[tuple[int, float, int, float, float]]()
    for number in range(len(noisy.sides)):
        links = Links(noisy, number, mesh, kinds, parts)
        links.run(told)
        spread += links.spread
    e = float(noisy.landing)
    table = Table(mesh, e)
    kinds_of_columns = (np.int64, float, np.int64, float, float)
    columns = [np.array([put[k] for put in spread], dtype=kind) for k, kind in enumerate(kinds_of_columns)]
    rows = mean_rows(len(mesh.place), mesh, Spread(*columns), e)
    live = np.sort(parts.at_cells.array("at", np.int64))
    cells, nodes, hard = (Reach(table, some) for some in (parts.at_cells, parts.at_nodes, parts.hard))
    ends, inner, turns = (Bent(table, some) for some in (parts.ends, parts.inner, parts.turns))
    curved, turned = np.unique(ends.at), np.unique(turns.at)
    return Chain(mesh, rows, live, absorbed, table, cells, nodes, hard, ends, inner, turns, curved, turned)
