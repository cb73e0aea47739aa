"""The throws of one side of a noisy chain: where they land from every node, and by which branch from every cell.

docs/certificates.md, "Probabilities", numbers 18 (landings) and 19 (the border).
"""

import math
from typing import NamedTuple

import numpy as np
from flint import arb

from .balls import HALF, Arb, Array, exact, float_above
from .laws import Column, Law
from .means import INFLATE
from .model import deciding
from .noisy_throw import (
    Hit,
    decides,
    deciding_slopes,
    guess_angle,
    guess_border,
    kappa_at,
    land,
)
from .scene import Side


class Noisy(NamedTuple):
    """The scene's sides, kappa of a throw without deviation, the laws of what deviates; the farthest landing known."""

    sides: list[Side]
    kappa: Arb
    speed: Law
    landing: Law
    far: float


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
        self.noisy, self.side, self.x, self.law = noisy, side, x, noisy.speed
        self.most, self.certain = exact(self.law.reach), self.law.certain
        self.columns = self.law.columns or (Column(0, 0, arb(0), 0.0, math.inf),)
        self.marks = {mark for column in self.columns for mark in (column.first, column.last)}
        self.ends = [exact(end) for end in self.law.ends]
        self.deltas = np.array([float(end) for end in self.law.ends])
        self.kappas = [kappa_at(noisy.kappa, end) for end in self.ends]
        n, count = len(self.x), len(self.ends)
        self.place, self.error = np.full((n, count), np.nan), np.full((n, count), np.inf)
        self.hits: dict[
            int, dict[int, Hit]
        ] = {}  # by node and number of the deviation, those at ends of columns
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
            if j in self.marks:
                self.hits.setdefault(node, {})[j] = hit

    def known(self, cell: int) -> bool:
        """Whether all throws from both nodes are enclosed, and none is far out."""
        two = slice(cell, cell + 2)
        close = np.abs(self.place[two]).max() < self.noisy.far
        return bool(np.isfinite(self.error[two]).all() and close and self.x[cell + 1] > self.x[cell])

    def box(self, cell: int, column: Column | None = None) -> tuple[Arb, Arb]:
        """Return the angles of all throws from a cell, or of those of a column, and their deviations."""
        first, last = (0, len(self.ends) - 1) if column is None else column[:2]
        phi = self.hits[cell][first].before.union(self.hits[cell + 1][last].after)
        return phi, self.ends[first].union(self.ends[last])

    # ------------------------------------------------------------------------------------------------- decisions

    def branch_of(self, cell: int) -> Border:
        """Prove the branch of a cell, or where it changes; with no more than the gap 1 where neither is proved."""
        ends = (float(self.x[cell]), float(self.x[cell + 1]))
        phi, _ = self.box(cell)
        last = float(self.deltas[-1])
        none = (self.hits[cell][0].place, self.hits[cell + 1][len(self.ends) - 1].place)
        branch = self.decided(cell, ends, Column(0, len(self.ends) - 1, arb(0), 0.0, 0.0))
        if branch == 2 and len(self.columns) > 1:
            every = {self.decided(cell, ends, column) for column in self.columns}
            branch = every.pop() if len(every) == 1 else 2
        if branch != 2:
            return Border((last, last), branch, branch, 0.0, phi, none)
        border = None if self.certain else self.border_of(cell, ends)
        return border or Border((last, last), 0, 1, 1.0, phi, none)

    def decided(self, cell: int, ends: tuple[float, float], column: Column) -> int:
        """Decide for all throws of a column: 0 jog, 1 flip, 2 not settled."""
        hits = (self.hits[cell][column.first], self.hits[cell + 1][column.last])
        deviations = (self.ends[column.first], self.ends[column.last])
        return decides(self.side, ends, self.noisy.kappa, deviations, hits)

    def border_of(self, cell: int, ends: tuple[float, float]) -> Border | None:
        """Prove how far from a chord the branch changes, where what decides rises or falls with the speed."""
        s, kappa = self.side, self.noisy.kappa
        x = arb(ends[0]).union(arb(ends[1]))
        by_d = self.by_speed(cell, x)
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
        gap = min(INFLATE * far * self.law.most, 1.0)
        places = (hits[0].place, hits[1].place)
        return Border((float(cut[0]), float(cut[1])), int(not rises), int(rises), gap, near, places)

    def by_speed(self, cell: int, x: Arb) -> Arb:
        """Enclose how what decides changes with the speed, over all speeds, in pieces where need be."""
        phi, deviations = self.box(cell)
        _, whole = deciding_slopes(self.side, phi, x, kappa_at(self.noisy.kappa, deviations), 1 + deviations)
        if whole > 0 or whole < 0:
            return whole
        slopes = []
        for column in self.columns:
            angles, some = self.box(cell, column)
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
