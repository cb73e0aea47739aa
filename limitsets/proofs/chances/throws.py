"""The mean of a function after a throw without deviation of the landing place, as a function of the start.

M(x) is the integral of p(delta) G(T(x, delta)) over the deviation of the speed, in one or two runs of strata between
which the branch changes at a border g(x), affine on each cell.  With q = T_x + g' T_delta along a border (g' = 0 at the
ends of strata) its second derivative is

    sum over borders of (jump of p) (q^2 / T_delta) G'(T)  +  int p G'(T) E,   E = T_xx - d/d delta (T_x^2 / T_delta),

where T_delta has a sign; the integral is at most max |E / T_delta| times the total variation of G.  Where it has none,
M' = int p G'(T) T_x + (p g') G at the border, whose oscillation is bounded.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.proofs.chances.averages import Average, Gaps, Nodes, Span, Swings, Windows, mean_matrix
from limitsets.proofs.chances.deficits import MORE, Deficits, Rows, Staircase
from limitsets.proofs.chances.landings import (
    Decided,
    Derivatives,
    OneSide,
    Piece,
    decided,
    hull,
    landed,
    slopes,
)
from limitsets.proofs.prover.numbers import Intervals

# Deviations of the speed enclosed at a time: of 6 % at once no derivative keeps its sign.
PIECE = 0.005


def throw_average(
    sides: list[OneSide],
    source: Nodes,
    target: Nodes,
    law: Staircase,
    runs: list[Ints],
) -> Average:
    """Build the average over the speed's deviations.

    Parameters
    ----------
    sides : list of OneSide
        The sides.
    source : Nodes
        Nodes of the starts.
    target : Nodes
        Nodes of the averaged function.
    law : Staircase
        The law of the relative deviation of the speed.
    runs : list of ndarray of int
        Runs of consecutive nodes of one side whose cells are bounded; the first node may lie at the joint.
    """
    parts = _Parts(source, target, law)
    for numbers in runs:
        side = sides[int(np.searchsorted(source.first, numbers[0], side="right")) - 1]
        parts.add(side, numbers)
    return parts.average()


def _columns(borders: Array) -> list[tuple[int, int]]:
    """Cut the borders of a law into pieces, each narrow enough for enclosures of derivatives to keep their signs."""
    last = borders.size - 1
    if not last:
        return [(0, 0)]
    count = min(math.ceil(float(borders[-1] - borders[0]) / PIECE), last)
    cuts = np.unique(np.rint(np.linspace(0, last, count + 1)).astype(int)).tolist()
    return list(pairwise(cuts))


class _Parts(Deficits):
    """The segments, swings and gaps of an average, collected side by side."""

    def __init__(self, source: Nodes, target: Nodes, law: Staircase) -> None:
        super().__init__(target, law)
        self.source = source
        self.segments: list[tuple[Any, ...]] = []
        self.at_nodes: list[Swings] = []
        self.swings: list[Swings] = []
        self.gaps: list[Gaps] = []

    def average(self) -> Average:
        """Join the collected parts to an average."""
        columns = [np.concatenate(column) for column in zip(*self.segments, strict=True)]
        matrix = mean_matrix(self.source.place.size, self.target, *columns)
        return Average(
            self.source,
            self.target,
            matrix,
            beyond=self.law.beyond,
            at_nodes=tuple(self.at_nodes),
            swings=tuple(self.swings),
            gaps=tuple(self.gaps),
            ways=tuple(self.ways),
        )

    def add(self, side: OneSide, numbers: Ints) -> None:
        """Add the starts of consecutive nodes."""
        law, n = self.law, numbers.size
        x = self.source.place[numbers]
        joint = x <= side.spans["a"][1]
        begin = int(joint.sum())
        x = np.maximum(x, x[begin])  # starts at the joint are taken as the first one beyond
        every = landed(side, np.repeat(x, law.borders.size), np.tile(law.borders, n))
        table: list[Any] = [column.reshape(n, -1) for column in every]
        rows = Rows(
            side,
            numbers,
            x,
            place=table[2],
            phi=table[0],
            error=np.maximum(table[1], table[3]).max(axis=1),
            good=table[4].all(axis=1),
        )
        slack = np.maximum(rows.error[:-1], rows.error[1:])
        pieces = []
        for first, last in _columns(law.borders):
            phi_lo = np.minimum(rows.phi[:-1, first], rows.phi[1:, first]) - slack
            phi_hi = np.maximum(rows.phi[:-1, last], rows.phi[1:, last]) + slack
            phi_lo[:begin] = 0.0
            phi = Intervals(np.maximum(phi_lo, 0.0), phi_hi)
            pieces.append(Piece(float(law.borders[first]), float(law.borders[last]), phi))
        places = x.copy()
        places[:begin] = self.source.place[numbers[:begin]]
        branches = decided(side, places, pieces)
        at_cut = landed(side, x, np.full(n, law.borders[0]) if law.certain else branches.cut)
        rows = rows._replace(
            error=np.maximum(rows.error, np.maximum(at_cut.phi_error, at_cut.error)),
            good=rows.good & at_cut.good,
        )
        all_of = Derivatives(
            *map(hull, zip(*(slopes(side, each.phi, each.delta) for each in pieces), strict=True))
        )
        self._nodes(rows, branches, all_of, at_cut.place)
        self._cells(rows, branches, all_of, begin)

    # ------------------------------------------------------------ nodes

    def _nodes(self, rows: Rows, branches: Decided, all_of: Derivatives, at_cut: Array) -> None:
        """Segments between the places of borders, and how far the places between them may be off a line."""
        law, side, n = self.law, rows.side, rows.x.size
        if law.certain:
            number, place = self.landing(side, branches.below, rows.place[:, 0])
            self.segments.append((rows.number, np.ones(n), number, place, place))
            span = self.span_of(
                side, branches.below, rows.place[:, 0] - rows.error, rows.place[:, 0] + rows.error
            )
            # Of the variation on a cell no more is met than the share of it that the error makes.
            narrowest = Windows(span).ends(self.target.width)[0]
            much = np.minimum(2.0 * MORE * rows.error / narrowest, 1.0)
            self.at_nodes.append(Swings(rows.number, much, span))
            return
        step = np.diff(law.borders)
        bend = all_of.delta_delta.absolute().hi
        bend = np.nan_to_num(np.maximum(np.append(bend, bend[-1]), np.insert(bend, 0, bend[0])), nan=np.inf)
        for flips, is_below in ((branches.below, True), (branches.above, False)):
            lo = np.broadcast_to(law.borders[:-1], (n, step.size))
            hi = np.broadcast_to(law.borders[1:], (n, step.size))
            cut = branches.cut[:, None]
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
            number, first = self.landing(side, flips[row], one[some])
            _, second = self.landing(side, flips[row], two[some])
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
            span = self.span_of(side, flips[here], (least - widest)[here], (most + widest)[here])
            self.at_nodes.append(Swings(rows.number[here], MORE * much[here], span))

    # ------------------------------------------------------------ cells

    def _cells(self, rows: Rows, branches: Decided, all_of: Derivatives, begin: int) -> None:
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
        # At the joint: throws land between the joint and the landing place of the first start beyond it.
        lo[:begin] = np.minimum(lo[:begin], side.spans["a"][0])
        density = 1.0 if law.certain else float(law.density.max())
        self._undecided(rows, branches, lo, hi, density, known)
        if begin:
            at = np.arange(begin)
            both = branches.beta[at] > 0.0
            self.gaps.append(
                self.gaps_of(
                    cell[at],
                    np.ones(begin),
                    side,
                    flips=branches.cell_below[at],
                    lo=lo[at],
                    hi=hi[at],
                    both=both,
                )
            )
        live = np.flatnonzero(known & (np.arange(h.size) >= begin) & (h > 0.0))
        if law.ripple:
            for flips in (branches.cell_below, branches.cell_above):
                span = self.span_of(side, flips[live], lo[live], hi[live])
                self.swings.append(Swings(cell[live], np.full(live.size, law.ripple), span))
        self.any_way(rows, branches, live, lo, hi)
        self.by_kinks(rows, branches, all_of, some=live, lo=lo, hi=hi, density=density)
        # Where the speed moves the landing place by less than a cell its derivative says nothing, if it has a sign.
        rate = all_of.delta.absolute()
        spread = float(law.borders[-1] - law.borders[0]) * rate.lo
        curved = live[((spread > h) & (rate.lo > 0.0))[live]]
        if curved.size:
            self.by_borders(rows, branches, all_of, some=curved, lo=lo, hi=hi, density=density)

    def _undecided(
        self, rows: Rows, branches: Decided, lo: Array, hi: Array, density: float, known: Mask
    ) -> None:
        """Add gaps where the branch is open or is not that of the node's row, and where no landing place is proved."""
        law, cell = self.law, rows.number[:-1]
        first, last = law.borders[0], law.borders[-1]
        off = np.zeros(cell.size)
        for k in (slice(None, -1), slice(1, None)):
            cut = branches.cut[k]
            if law.certain:
                wrong = np.where(branches.below[k] != branches.cell_below, 1.0, 0.0)
            else:
                low, high = cut - first, last - cut
                wrong = np.where(branches.below[k] != branches.cell_below, low, 0.0)
                wrong = wrong + np.where(branches.above[k] != branches.cell_above, high, 0.0)
            off = np.maximum(off, wrong)
        much = np.minimum(density * (branches.beta + off), 1.0)
        if law.ripple:
            much = much + np.where(branches.cell_below == branches.cell_above, 0.0, law.cut_ripple)
        some = np.flatnonzero((much > 0.0) & known)
        if some.size:
            below, both = branches.cell_below[some], np.ones(some.size, bool)
            self.gaps.append(
                self.gaps_of(
                    cell[some], MORE * much[some], rows.side, flips=below, lo=lo[some], hi=hi[some], both=both
                )
            )
        lost = cell[~known]
        if lost.size:
            everything = Span(np.zeros(lost.size, np.int64), np.full(lost.size, self.target.place.size - 2))
            self.gaps.append(Gaps(lost, np.ones(lost.size), everything, everything))
