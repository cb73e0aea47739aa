"""The mean of a function after a throw without deviation of the landing place, as a function of the start.

M(x) is the integral of p(delta) G(T(x, delta)) over the deviation of the speed, in one or two runs of strata between
which the branch changes at a border g(x), affine on each cell.  With q = T_x + g' T_delta along a border (g' = 0 at the
ends of strata) its second derivative is

    sum over borders of (jump of p) (q^2 / T_delta) G'(T)  +  int p G'(T) E,   E = T_xx - d/d delta (T_x^2 / T_delta),

where T_delta has a sign; the integral is at most max |E / T_delta| times the total variation of G.  Where it has none,
M' = int p G'(T) T_x + (p g') G at the border, whose oscillation is bounded.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.proofs.intervals import Intervals
from limitsets.robust.brackets.averages import (
    Average,
    Bends,
    Curvature,
    Gaps,
    Kinks,
    Span,
    Swings,
    Windows,
    mean_matrix,
)
from limitsets.robust.brackets.decisions import Decided, decided
from limitsets.robust.brackets.densities import Staircase
from limitsets.robust.brackets.landings import Derivatives, OneSide, landed, slopes
from limitsets.robust.brackets.nodes import Nodes

__all__ = ["throw_average"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

# Inflates coefficients against the rounding of the few operations that make them.
MORE = 1.0 + 2.0**-40
# A cap that is none.
NEVER = 1e200


class _Rows(NamedTuple):
    """Throws from consecutive nodes of a side."""

    side: OneSide
    number: Index  # of the nodes
    x: Array
    place: Array  # where jogs land, (n, borders)
    phi: Array
    error: Array  # of angles and places, the largest of each node
    good: NDArray[np.bool_]


def throw_average(
    sides: list[OneSide],
    source: Nodes,
    target: Nodes,
    law: Staircase,
    runs: list[Index],
) -> Average:
    """Build the average over the speed's deviations.

    Parameters
    ----------
    sides : list of OneSide
        The sides.
    source : Nodes
        Of the starts.
    target : Nodes
        Of the function that is averaged.
    law : Staircase
        Of the relative deviation of the speed.
    runs : list of ndarray of int
        Numbers of consecutive nodes of one side between which all is wanted; the first may lie at the joint.
    """
    parts = _Parts(source, target, law)
    for numbers in runs:
        side = sides[int(np.searchsorted(source.first, numbers[0], side="right")) - 1]
        parts.add(side, numbers)
    return parts.average()


class _Border(NamedTuple):
    """A border between strata, or between branches, over cells."""

    least: Array  # deviations there
    most: Array
    first: Array  # angles there
    last: Array
    ends: tuple[Array, Array]  # where jogs land at the nodes
    drift: Array  # change of the deviation with x
    low: Array  # by how much the density falls there
    high: Array


class _Parts:
    """What is collected, side by side."""

    def __init__(self, source: Nodes, target: Nodes, law: Staircase) -> None:
        self.source, self.target, self.law = source, target, law
        self.segments: list[tuple[Any, ...]] = []
        self.at_nodes: list[Swings] = []
        self.swings: list[Swings] = []
        self.gaps: list[Gaps] = []
        self.ways: list[Curvature] = []

    def average(self) -> Average:
        """Put them together."""
        columns = [np.concatenate(column) for column in zip(*self.segments, strict=True)]
        matrix = mean_matrix(self.source.place.size, self.target, *columns)
        return Average(
            self.source,
            self.target,
            matrix,
            self.law.beyond,
            tuple(self.at_nodes),
            tuple(self.swings),
            tuple(self.gaps),
            tuple(self.ways),
        )

    def add(self, side: OneSide, numbers: Index) -> None:
        """Add the starts of consecutive nodes."""
        law, n = self.law, numbers.size
        x = self.source.place[numbers]
        joint = x <= side.spans["a"][1]
        begin = int(joint.sum())
        x = np.maximum(x, x[begin])  # at the joint: as from the first place beyond it
        every = landed(side, np.repeat(x, law.borders.size), np.tile(law.borders, n))
        table: list[Any] = [column.reshape(n, -1) for column in every]
        rows = _Rows(
            side,
            numbers,
            x,
            table[2],
            table[0],
            np.maximum(table[1], table[3]).max(axis=1),
            table[4].all(axis=1),
        )
        slack = np.maximum(rows.error[:-1], rows.error[1:])
        phi_lo = np.minimum(rows.phi[:-1, 0], rows.phi[1:, 0]) - slack
        phi_hi = np.maximum(rows.phi[:-1, -1], rows.phi[1:, -1]) + slack
        phi_lo[:begin] = 0.0
        phi_lo = np.maximum(phi_lo, 0.0)
        places = x.copy()
        places[:begin] = self.source.place[numbers[:begin]]
        found = decided(side, places, phi_lo, phi_hi, (float(law.borders[0]), float(law.borders[-1])))
        all_of = slopes(
            side,
            Intervals(phi_lo, phi_hi),
            Intervals(np.full(n - 1, law.borders[0]), np.full(n - 1, law.borders[-1])),
        )
        self._nodes(rows, found, all_of)
        self._cells(rows, found, all_of, begin)

    # ------------------------------------------------------------ nodes

    def _landing(self, side: OneSide, flips: NDArray[np.bool_], place: Array) -> tuple[Index, Array]:
        return np.where(flips, side.after, side.number), np.where(flips, place - side.shift, place)

    def _span(self, side: OneSide, flips: NDArray[np.bool_], lo: Array, hi: Array) -> Span:
        number, low = self._landing(side, flips, lo)
        _, high = self._landing(side, flips, hi)
        return Span(self.target.cell(number, low), self.target.cell(number, high))

    def _nodes(self, rows: _Rows, found: Decided, all_of: Derivatives) -> None:
        """Segments between the places of borders, and how far the places between them may be off a line."""
        law, side, n = self.law, rows.side, rows.x.size
        if law.certain:
            number, place = self._landing(side, found.below, rows.place[:, 0])
            self.segments.append((rows.number, np.ones(n), number, place, place))
            span = self._span(side, found.below, rows.place[:, 0] - rows.error, rows.place[:, 0] + rows.error)
            # Of the variation on a cell no more is met than the share of it that the error makes.
            narrowest = Windows(span).ends(self.target.width)[0]
            much = np.minimum(2.0 * MORE * rows.error / narrowest, 1.0)
            self.at_nodes.append(Swings(rows.number, much, span))
            return
        at_cut = landed(side, rows.x, found.cut).place
        step = np.diff(law.borders)
        bend = all_of.delta_delta.absolute().hi
        bend = np.nan_to_num(np.maximum(np.append(bend, bend[-1]), np.insert(bend, 0, bend[0])), nan=np.inf)
        for flips, is_below in ((found.below, True), (found.above, False)):
            lo = np.broadcast_to(law.borders[:-1], (n, step.size))
            hi = np.broadcast_to(law.borders[1:], (n, step.size))
            cut = found.cut[:, None]
            begin, end = (lo, np.minimum(hi, cut)) if is_below else (np.maximum(lo, cut), hi)
            one, two = rows.place[:, :-1], rows.place[:, 1:]
            if is_below:
                two = np.where(hi > cut, at_cut[:, None], two)
            else:
                one = np.where(lo < cut, at_cut[:, None], one)
            some = end > begin
            if not some.any():
                continue
            length = np.where(some, end - begin, 0.0)
            weight = law.density * length
            row = np.broadcast_to(np.arange(n)[:, None], some.shape)[some]
            number, first = self._landing(side, flips[row], one[some])
            _, second = self._landing(side, flips[row], two[some])
            self.segments.append((rows.number[row], weight[some], number, first, second))
            off = bend[:, None] * length**2 / 8.0 + 2.0 * rows.error[:, None]
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.where(some, off / np.abs(two - one), 0.0)
            far = (share > 0.5) & some
            # A place lies within `off` of at most three segments that are longer than that.
            much = 3.0 * np.where(far, 0.0, weight * share).max(axis=1) + np.where(far, weight, 0.0).sum(
                axis=1
            )
            widest = np.where(some, off, 0.0).max(axis=1)
            ends = np.where(some, one, np.inf), np.where(some, two, np.inf)
            least = np.minimum(*(end.min(axis=1) for end in ends))
            ends = np.where(some, one, -np.inf), np.where(some, two, -np.inf)
            most = np.maximum(*(end.max(axis=1) for end in ends))
            here = np.flatnonzero(some.any(axis=1))
            span = self._span(side, flips[here], (least - widest)[here], (most + widest)[here])
            self.at_nodes.append(Swings(rows.number[here], MORE * much[here], span))

    # ------------------------------------------------------------ cells

    def _cells(self, rows: _Rows, found: Decided, all_of: Derivatives, begin: int) -> None:
        """Deficits between nodes."""
        law, side = self.law, rows.side
        cell = rows.number[:-1]
        h = np.diff(rows.x)
        t_x, t_delta = all_of.x.absolute().hi, all_of.delta.absolute().hi
        reach = np.where(all_of.x.lo > 0.0, 0.0, t_x * h) + 2.0 * (rows.error[:-1] + rows.error[1:])
        if not law.certain:  # beyond a line between borders
            reach = reach + all_of.delta_delta.absolute().hi * np.diff(law.borders).max() ** 2 / 8.0
        lo = np.minimum(rows.place[:-1], rows.place[1:]).min(axis=1) - reach
        hi = np.maximum(rows.place[:-1], rows.place[1:]).max(axis=1) + reach
        known = (
            np.isfinite(t_x) & np.isfinite(t_delta) & rows.good[:-1] & rows.good[1:] & np.isfinite(lo + hi)
        )
        # At the joint: whatever lies between it and where the first place beyond it lands.
        lo[:begin] = np.minimum(lo[:begin], side.spans["a"][0])
        density = 1.0 if law.certain else float(law.density.max())
        self._undecided(rows, found, lo, hi, density, known)
        if begin:
            at = np.arange(begin)
            both = found.beta[at] > 0.0
            self._gap(cell[at], np.ones(begin), side, found.cell_below[at], lo[at], hi[at], both)
        live = np.flatnonzero(known & (np.arange(h.size) >= begin) & (h > 0.0))
        if law.ripple:
            for flips in (found.cell_below, found.cell_above):
                span = self._span(side, flips[live], lo[live], hi[live])
                self.swings.append(Swings(cell[live], np.full(live.size, law.ripple), span))
        self._any_way(rows, found, live, lo, hi)
        self._by_kinks(rows, found, all_of, live, lo, hi, density)
        # Where the speed moves the landing place by less than a cell its derivative says nothing, if it has a sign.
        rate = all_of.delta.absolute()
        spread = float(law.borders[-1] - law.borders[0]) * rate.lo
        curved = live[((spread > h) & (rate.hi < 2.0 * rate.lo))[live]]
        if curved.size:
            self._by_borders(rows, found, all_of, curved, lo, hi, density)

    def _gaps(self, cell, much, side, flips, lo, hi, both) -> Gaps:  # type: ignore[no-untyped-def]
        return Gaps(cell, much, self._span(side, flips, lo, hi), self._span(side, flips ^ both, lo, hi))

    def _gap(self, cell, much, side, flips, lo, hi, both) -> None:  # type: ignore[no-untyped-def]
        one = self._span(side, flips, lo, hi)
        two = self._span(side, flips ^ both, lo, hi)
        self.gaps.append(Gaps(cell, much, one, two))

    def _undecided(self, rows, found, lo, hi, density, known) -> None:  # type: ignore[no-untyped-def]
        """Where the branch is open, or not that of the node's row; where nothing is proved anything may be."""
        law, cell = self.law, rows.number[:-1]
        first, last = law.borders[0], law.borders[-1]
        off = np.zeros(cell.size)
        for k in (slice(None, -1), slice(1, None)):
            cut = found.cut[k]
            if law.certain:
                wrong = np.where(found.below[k] != found.cell_below, 1.0, 0.0)
            else:
                low, high = cut - first, last - cut
                wrong = np.where(found.below[k] != found.cell_below, low, 0.0)
                wrong = wrong + np.where(found.above[k] != found.cell_above, high, 0.0)
            off = np.maximum(off, wrong)
        much = np.minimum(density * (found.beta + off), 1.0)
        if law.ripple:
            much = much + np.where(found.cell_below == found.cell_above, 0.0, law.cut_ripple)
        some = np.flatnonzero((much > 0.0) & known)
        if some.size:
            self._gap(
                cell[some],
                MORE * much[some],
                rows.side,
                found.cell_below[some],
                lo[some],
                hi[some],
                np.ones(some.size, bool),
            )
        lost = cell[~known]
        if lost.size:
            everything = Span(np.zeros(lost.size, np.int64), np.full(lost.size, self.target.place.size - 2))
            self.gaps.append(Gaps(lost, np.ones(lost.size), everything, everything))

    def _any_way(self, rows, found, some, lo, hi) -> None:  # type: ignore[no-untyped-def]
        """By all that V may be where throws land."""
        cell = rows.number[:-1][some]
        below, above = found.cell_below[some], found.cell_above[some]
        gaps = self._gaps(cell, np.ones(some.size), rows.side, below, lo[some], hi[some], below != above)
        self.ways.append(Curvature(cell, gaps=(gaps,)))

    def _widest(self, span: Span) -> Array:
        """Width of the widest cell of the target on spans."""
        return Windows(span).ends(np.minimum(self.target.width, NEVER))[1]

    def _by_kinks(self, rows, found, all_of, some, lo, hi, density) -> None:  # type: ignore[no-untyped-def]
        """By what the slope of V falls at nodes, each met by a share of the deviations only."""
        law, side, cell = self.law, rows.side, rows.number[:-1]
        h = np.diff(rows.x)[some]
        t = Derivatives(*(each[some] for each in all_of))
        wide, rate = t.x.absolute().hi, t.delta.absolute().lo
        with np.errstate(divide="ignore"):
            share = np.ones(some.size) if law.certain else np.minimum(density * wide * h / rate, 1.0)
        below, above = found.cell_below[some], found.cell_above[some]
        split = np.flatnonzero(below != above)
        much, bow = MORE * 0.25 * h * wide * share, MORE * h * h / 8.0 * t.x_x.absolute().hi
        # A function that is affine between nodes at most d apart, and whose slope falls by at most L per length, lies
        # above no chord over a length l by more than L (l^2 + d^2) / 8: less a parabola's interpolant it is convex.
        # With borders that move the slope of the mean falls by L (l + d), and the factor is l^2 / 8 + l d / 4.
        span = self._span(side, below, lo[some], hi[some])
        far = self._widest(span)
        length = wide * h
        even = np.where(t.x.lo > 0.0, (length**2 + far**2) / 8.0, np.inf)
        even[split] = (length**2 / 8.0 + length * far / 4.0)[split]
        kinks = [Kinks(cell[some], much, MORE * np.minimum(even, NEVER), bow, span)]
        bends: list[Bends] = []
        if split.size:
            at = some[split]
            other = self._span(side, above[split], lo[at], hi[at])
            even_too = MORE * (length[split] ** 2 / 8.0 + length[split] * self._widest(other) / 4.0)
            kinks.append(Kinks(cell[at], much[split], even_too, bow[split], other))
            # Along a border that moves with x: p g' (2 T_x + g' T_delta) G'.
            drift = (found.cut[at + 1] - found.cut[at]) / h[split]
            moving = Intervals(drift, drift)
            by = h[split] ** 2 / 8.0 * density
            much = moving * (2.0 * t.x[split] + moving * t.delta[split]) * Intervals(0.0 * by, by)
            none = np.full(at.size, NEVER)
            for flips, sign in ((below[split], 1.0), (above[split], -1.0)):
                span = self._span(side, flips, lo[at], hi[at])
                low, high = (much.lo, much.hi) if sign > 0.0 else (-much.hi, -much.lo)
                bends.append(Bends(cell[at], low, high, none, span))
        self.ways.append(Curvature(cell[some], tuple(bends), kinks=tuple(kinks)))

    def _by_borders(self, rows, found, all_of, some, lo, hi, density) -> None:  # type: ignore[no-untyped-def]
        """By the borders of strata and branches, where the densities jump."""
        bends: list[Bends] = []
        swings: list[Swings] = []
        gaps: list[Gaps] = []
        law, side, cell = self.law, rows.side, rows.number[:-1]
        h = np.diff(rows.x)[some]
        t = Derivatives(*(each[some] for each in all_of))
        one = 1.0 / t.delta
        ratio = t.x * one
        by_delta = (2.0 * t.x_delta - ratio * t.delta_delta) * ratio
        inner = ((t.x_x - by_delta) * one).absolute().hi * density * h * h / 8.0
        below, above = found.cell_below[some], found.cell_above[some]
        one_cut, two_cut = found.cut[some], found.cut[some + 1]
        least, most = np.minimum(one_cut, two_cut), np.maximum(one_cut, two_cut)
        below = np.where(most <= law.borders[0], above, below)
        above = np.where(least >= law.borders[-1], below, above)
        split = below != above
        everywhere = np.arange(some.size)
        for flips, here in ((below, everywhere), (above, np.flatnonzero(split))):
            span = self._span(side, flips[here], lo[some[here]], hi[some[here]])
            swings.append(Swings(cell[some[here]], MORE * inner[here], span))
        jumps = -np.diff(law.density, prepend=0.0, append=0.0)
        still = np.zeros(some.size)
        for b in np.flatnonzero(np.abs(jumps) > 1e-12 * law.density.max()):
            delta = law.borders[b]
            level = np.full(some.size, delta)
            first, last = rows.phi[some, b], rows.phi[some + 1, b]
            ends = rows.place[some, b], rows.place[some + 1, b]
            between = split & (least < delta) & (delta < most)
            lower = ~split | (delta <= least)
            for flips, here in ((below, lower | between), (above, ~lower)):
                low = np.where(between, min(jumps[b], 0.0), jumps[b])
                high = np.where(between, max(jumps[b], 0.0), jumps[b])
                border = _Border(level, level, first, last, ends, still, low, high)
                bends += self._border(rows, some, np.flatnonzero(here), flips, border)
            at = np.flatnonzero(between)
            if at.size:
                much = MORE * 0.25 * abs(jumps[b]) * (most - least)[at]
                both = np.ones(at.size, dtype=bool)
                gaps.append(
                    self._gaps(cell[some[at]], much, side, below[at], lo[some[at]], hi[some[at]], both)
                )
        here = np.flatnonzero(split)
        if here.size:
            bends += self._moving(rows, found, some, here, below, above)
        self.ways.append(Curvature(cell[some], tuple(bends), tuple(swings), gaps=tuple(gaps)))

    def _moving(self, rows, found, some, here, below, above) -> list[Bends]:  # type: ignore[no-untyped-def]
        """Return what the border between the branches bends."""
        law, side = self.law, rows.side
        h = np.diff(rows.x)[some]
        one_cut, two_cut = found.cut[some], found.cut[some + 1]
        least, most = np.minimum(one_cut, two_cut), np.maximum(one_cut, two_cut)
        x_one, x_two = rows.x[some], rows.x[some + 1]
        first, last = landed(side, x_one, least).phi, landed(side, x_two, most).phi
        ends = landed(side, x_one, one_cut).place, landed(side, x_two, two_cut).place
        drift = (two_cut - one_cut) / h
        stratum = [
            np.clip(np.searchsorted(law.borders, cut) - 1, 0, law.weight.size - 1) for cut in (least, most)
        ]
        if law.ripple:
            window = Windows(Span(stratum[0], stratum[1]))
            low, high = window.ends(law.density)
        else:
            low = high = np.full(some.size, law.density[0])
        border = _Border(least, most, first, last, ends, drift, low, high)
        other = border._replace(low=-high, high=-low)
        return self._border(rows, some, here, below, border) + self._border(rows, some, here, above, other)

    def _border(
        self, rows: _Rows, some: Index, here: Index, flips: NDArray[np.bool_], border: _Border
    ) -> list[Bends]:
        """Return what the jump of the density at a border, fixed or moving with x, bends."""
        if not here.size:
            return []
        side, cell = rows.side, some[here]
        slack = np.maximum(rows.error[cell], rows.error[cell + 1])
        phi = Intervals(np.maximum(border.first[here] - slack, 0.0), border.last[here] + slack)
        t = slopes(side, phi, Intervals(border.least[here], border.most[here]))
        drift = border.drift[here]
        q = t.x + Intervals(drift, drift) * t.delta
        shape = q.square() / t.delta
        h = np.diff(rows.x)[cell]
        by = h * h / 8.0
        much = shape * Intervals(border.low[here] * by, border.high[here] * by)
        size = q.absolute()
        jump = np.maximum(np.abs(border.low[here]), np.abs(border.high[here]))
        with np.errstate(divide="ignore", invalid="ignore"):
            cap = MORE * 0.25 * h * jump * shape.absolute().hi / size.lo
        cap = np.where(np.isfinite(cap), cap, NEVER)
        wide = slack + np.where(size.lo > 0.0, 0.0, size.hi * h)
        one, two = border.ends[0][here], border.ends[1][here]
        span = self._span(side, flips[here], np.minimum(one, two) - wide, np.maximum(one, two) + wide)
        return [Bends(rows.number[cell], much.lo, much.hi, cap, span)]
