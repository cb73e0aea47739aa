"""How far the mean after a throw may lie above its chord on a cell, for laws given as staircases.

There are three bounds: from the borders of strata and branches, where the density of the speed jumps; from the nodes
at which the slope of the averaged function falls; and from the range of this function where throws land.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise
from math import factorial
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scattering import Gaussian, Uniform
from limitsets.proofs.chances.averages import (
    Average,
    Bends,
    Curvature,
    Gaps,
    Kinks,
    Nodes,
    Span,
    Swings,
    Windows,
    mean_matrix,
)
from limitsets.proofs.chances.landings import Decided, Derivatives, OneSide, landed, slopes
from limitsets.proofs.prover.numbers import Intervals, RationalInterval, pi, square_root

# ----------------------------------------------------------------
# Laws as staircases: a density that is constant on strata, and how far the law itself may be from it.
#
# A uniform law is a staircase.  For a normal law the steps have its exact masses, enclosed in rationals, so that only
# the variation of a function V within a stratum contributes to the difference: with osc the change of the density on a
# stratum of width w,
#
#     | int (p - step) V | = | int (p - step) (V - c) | <= (osc w / 4) (total variation of V there).
#
# The weight beyond six standard deviations may lie anywhere.


# Standard deviations up to which a normal law is cut into strata.
SIGMAS = 6
# Terms of the series of the normal law: at six standard deviations the first one left out is below 1e-30.
TERMS = 110


@dataclass(frozen=True, eq=False)
class Staircase:
    """A density that is constant on strata.

    Attributes
    ----------
    borders : ndarray, shape (m + 1,)
        Ends of the strata; one number for a law of one value.
    weight : ndarray, shape (m,)
        Probability of each stratum.
    ripple : float
        A mean of V by the staircase differs from that by the law by at most this times the total variation of V.
    cut_ripple : float
        The same for a V that jumps once, times its jump.
    beyond : float
        Probability of deviations outside the strata.
    """

    borders: Array
    weight: Array
    ripple: float = 0.0
    cut_ripple: float = 0.0
    beyond: float = 0.0

    @property
    def certain(self) -> bool:
        """Whether it is the law of one value."""
        return self.borders.size == 1

    @property
    def density(self) -> Array:
        """Density on each stratum."""
        return self.weight / np.diff(self.borders)


def staircase(law: Any, strata: int, name: str) -> Staircase:
    """Cut a law into strata.

    Parameters
    ----------
    law : Uniform, Gaussian or None
        The law; None for a deviation of 0.
    strata : int
        Number of strata; a multiple of 12 for a normal law.
    name : str
        The quantity that deviates, for the message of an error.

    Raises
    ------
    AnswerError
        Any other law.
    """
    if law is None or (isinstance(law, Uniform) and law.bound == 0.0):
        return Staircase(np.zeros(1), np.ones(1))
    if isinstance(law, Uniform):
        return Staircase(np.linspace(-law.bound, law.bound, strata + 1), np.full(strata, 1.0 / strata))
    if not isinstance(law, Gaussian):
        remedy = "use one of them, or the transfer operator (limitsets robustness), which proves nothing"
        raise AnswerError(f"the law of {name}", law, "Uniform or Gaussian", remedy)
    if law.sigma == 0.0:
        return Staircase(np.zeros(1), np.ones(1))
    a_side = max(strata // (2 * SIGMAS), 1)
    masses, change = _normal(a_side)
    steps = np.arange(-SIGMAS * a_side, SIGMAS * a_side + 1).astype(np.float64)
    borders = law.sigma / a_side * steps
    beyond = float(np.nextafter(float(1 - 2 * sum(mass.lo for mass in masses)), 1.0))
    half = np.array([float(mass) for mass in masses])
    # osc w / 4 with osc in units of 1 / sigma and w of sigma; a jump inside leaves at most half of osc w / 2.
    return Staircase(
        borders, np.concatenate([half[::-1], half]), 0.25 * change / a_side, 0.25 * change / a_side, beyond
    )


@cache
def _normal(a_side: int) -> tuple[list[RationalInterval], float]:
    """Masses of a standard normal law on strata of width 1/a_side from 0 to 6, and the most its density changes."""
    scale = 1 / square_root(2 * pi())
    totals = [
        RationalInterval.of(_half_series(Fraction(j, a_side))) * scale for j in range(SIGMAS * a_side + 1)
    ]
    masses = [RationalInterval(b.lo - a.hi, b.hi - a.lo) for a, b in pairwise(totals)]
    # The slope of the density is largest at 1, exp(-1/2)/sqrt(2 pi) = 0.24197...
    return masses, 0.24198 / a_side


def _half_series(z: Fraction) -> Fraction:
    """Return int_0^z exp(-t^2/2) dt, its series cut off where the terms, falling in turns, are below 1e-30."""
    square = z * z / 2
    total, power = Fraction(0), z
    for k in range(TERMS):
        total += (-1) ** k * power / (factorial(k) * (2 * k + 1))
        power *= square
    return Fraction(round(total * (1 << 120)), 1 << 120)


# ----------------------------------------------------------------
# The mean of a function over the deviations of the landing place.


# Above the relative error of one addition.
ULP = 2.0**-52


def landing_average(target: Nodes, source: Nodes, law: Staircase) -> Average:
    """Build the average of V(y + e) over e, as a function of y.

    Parameters
    ----------
    target : Nodes
        Nodes of V.
    source : Nodes
        Nodes of y; the outermost nodes lie as far out as those of V.
    law : Staircase
        The law of e.
    """
    n, strata = source.place.size, law.weight.size
    side, y = source.side(), source.place
    reach = max(law.borders[-1], -law.borders[0])
    # Far out V is constant, also within the reach of the law.
    y = np.clip(y, target.place[0] + reach, target.place[-1] - reach)
    row = np.repeat(np.arange(n), strata)
    ends = y[:, None] + law.borders
    matrix = mean_matrix(
        n,
        target,
        row,
        weight=np.tile(law.weight, n),
        side=np.repeat(side, strata),
        one=ends[:, :-1].ravel(),
        two=ends[:, 1:].ravel(),
    )
    cells = np.flatnonzero(np.isfinite(source.width))
    h = np.maximum(y[cells + 1] - y[cells], 0.0)
    cells, h = cells[h > 0.0], h[h > 0.0]
    jumps = -np.diff(law.density, prepend=0.0, append=0.0)
    bends, swings = [], []
    for border, jump in zip(law.borders, jumps, strict=True):
        # A jump below rounding is none, and bends nothing.
        if abs(jump) > 1e-12 * law.density.max():
            span = _span(target, side[cells], y[cells] + border, y[cells + 1] + border)
            much = h * h / 8.0 * jump
            cap = 0.25 * h * abs(jump)
            bends.append(Bends(cells, much, much, cap, span))
    if law.ripple:
        span = _span(target, side[cells], y[cells] + law.borders[0], y[cells + 1] + law.borders[-1])
        swings.append(Swings(cells, np.full(cells.size, law.ripple), span))
    whole = _span(target, side, y + law.borders[0], y + law.borders[-1])
    # The places y + e are rounded: each end of a stratum moves the mean by what the density jumps there.
    off = np.abs(jumps).sum() * ULP * (np.abs(y) + reach)
    return Average(
        source,
        target,
        matrix,
        beyond=law.beyond,
        at_nodes=(Swings(np.arange(n), off, whole),),
        swings=tuple(swings),
        ways=(Curvature(cells, tuple(bends)),),
    )


def _span(target: Nodes, side: Ints, lo: Array, hi: Array) -> Span:
    return Span(target.cell(side, lo), target.cell(side, hi))


# ----------------------------------------------------------------
# How far the mean after a throw may lie above its chord on a cell, in three ways.


# Inflates coefficients against the rounding of the few operations that make them.
MORE = 1.0 + 2.0**-40
# Stands for the absence of a cap.
NEVER = 1e200


class Rows(NamedTuple):
    """Throws from consecutive nodes of a side."""

    side: OneSide
    number: Ints  # of the nodes
    x: Array
    place: Array  # where jogs land, (n, borders)
    phi: Array
    error: Array  # of angles and places, the largest of each node
    good: Mask


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


class Deficits:
    """Ways to bound the deficits of throws, collected run by run.

    Parameters
    ----------
    target : Nodes
        Of the function that is averaged.
    law : Staircase
        Of the relative deviation of the speed.
    """

    def __init__(self, target: Nodes, law: Staircase) -> None:
        self.target, self.law = target, law
        self.ways: list[Curvature] = []

    def landing(self, side: OneSide, flips: Mask, place: Array) -> tuple[Ints, Array]:
        """Return the side and the place where throws land, from the places where jogs land."""
        return np.where(flips, side.after, side.number), np.where(flips, place - side.shift, place)

    def span_of(self, side: OneSide, flips: Mask, lo: Array, hi: Array) -> Span:
        """Return the cells between two such places."""
        number, low = self.landing(side, flips, lo)
        _, high = self.landing(side, flips, hi)
        return Span(self.target.cell(number, low), self.target.cell(number, high))

    def gaps_of(
        self, cell: Ints, much: Array, side: OneSide, flips: Mask, lo: Array, hi: Array, both: Mask
    ) -> Gaps:
        """Return gaps over the cells between two places of jogs, on both branches where `both`."""
        return Gaps(cell, much, self.span_of(side, flips, lo, hi), self.span_of(side, flips ^ both, lo, hi))

    def any_way(self, rows: Rows, branches: Decided, some: Ints, lo: Array, hi: Array) -> None:
        """Bound deficits by the range of V where throws land."""
        cell = rows.number[:-1][some]
        below, above = branches.cell_below[some], branches.cell_above[some]
        gaps = self.gaps_of(
            cell, np.ones(some.size), rows.side, flips=below, lo=lo[some], hi=hi[some], both=below != above
        )
        self.ways.append(Curvature(cell, gaps=(gaps,)))

    def _widest(self, span: Span) -> Array:
        """Width of the widest cell of the target on spans."""
        return Windows(span).ends(np.minimum(self.target.width, NEVER))[1]

    def by_kinks(
        self,
        rows: Rows,
        branches: Decided,
        all_of: Derivatives,
        some: Ints,
        lo: Array,
        hi: Array,
        density: float,
    ) -> None:
        """Bound deficits by the falls of the slope of V at nodes, each met by only a share of the deviations."""
        law, side, cell = self.law, rows.side, rows.number[:-1]
        h = np.diff(rows.x)[some]
        t = Derivatives(*(each[some] for each in all_of))
        wide, rate = t.x.absolute().hi, t.delta.absolute().lo
        with np.errstate(divide="ignore"):
            share = np.ones(some.size) if law.certain else np.minimum(density * wide * h / rate, 1.0)
        below, above = branches.cell_below[some], branches.cell_above[some]
        split = np.flatnonzero(below != above)
        much, bow = MORE * 0.25 * h * wide * share, MORE * h * h / 8.0 * t.x_x.absolute().hi
        # A function that is affine between nodes at most d apart, and whose slope falls by at most L per length, lies
        # above no chord over a length l by more than L (l^2 + d^2) / 8: less a parabola's interpolant it is convex.
        # With borders that move the slope of the mean falls by L (l + d), and the factor is l^2 / 8 + l d / 4.
        span = self.span_of(side, below, lo[some], hi[some])
        far = self._widest(span)
        length = wide * h
        even = np.where(t.x.lo > 0.0, (length**2 + far**2) / 8.0, np.inf)
        even[split] = (length**2 / 8.0 + length * far / 4.0)[split]
        kinks = [Kinks(cell[some], much, MORE * np.minimum(even, NEVER), bow, span)]
        bends: list[Bends] = []
        if split.size:
            at = some[split]
            other = self.span_of(side, above[split], lo[at], hi[at])
            even_too = MORE * (length[split] ** 2 / 8.0 + length[split] * self._widest(other) / 4.0)
            kinks.append(Kinks(cell[at], much[split], even_too, bow[split], other))
            # Along a border that moves with x: p g' (2 T_x + g' T_delta) G'.
            drift = (branches.cut[at + 1] - branches.cut[at]) / h[split]
            moving = Intervals(drift, drift)
            by = h[split] ** 2 / 8.0 * density
            turned = moving * (2.0 * t.x[split] + moving * t.delta[split]) * Intervals(0.0 * by, by)
            none = np.full(at.size, NEVER)
            for flips, sign in ((below[split], 1.0), (above[split], -1.0)):
                span = self.span_of(side, flips, lo[at], hi[at])
                low, high = (turned.lo, turned.hi) if sign > 0.0 else (-turned.hi, -turned.lo)
                bends.append(Bends(cell[at], low, high, none, span))
        self.ways.append(Curvature(cell[some], tuple(bends), kinks=tuple(kinks)))

    def by_borders(
        self,
        rows: Rows,
        branches: Decided,
        all_of: Derivatives,
        some: Ints,
        lo: Array,
        hi: Array,
        density: float,
    ) -> None:
        """Bound deficits by the borders of strata and branches, where the densities jump."""
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
        below, above = branches.cell_below[some], branches.cell_above[some]
        one_cut, two_cut = branches.cut[some], branches.cut[some + 1]
        least, most = np.minimum(one_cut, two_cut), np.maximum(one_cut, two_cut)
        below = np.where(most <= law.borders[0], above, below)
        above = np.where(least >= law.borders[-1], below, above)
        split = below != above
        everywhere = np.arange(some.size)
        for flips, here in ((below, everywhere), (above, np.flatnonzero(split))):
            span = self.span_of(side, flips[here], lo[some[here]], hi[some[here]])
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
                border = _Border(level, level, first, last=last, ends=ends, drift=still, low=low, high=high)
                bends += self._border(rows, some, np.flatnonzero(here), flips, border)
            at = np.flatnonzero(between)
            if at.size:
                much = MORE * 0.25 * abs(jumps[b]) * (most - least)[at]
                both = np.ones(at.size, dtype=bool)
                gaps.append(
                    self.gaps_of(
                        cell[some[at]],
                        much,
                        side,
                        flips=below[at],
                        lo=lo[some[at]],
                        hi=hi[some[at]],
                        both=both,
                    )
                )
        here = np.flatnonzero(split)
        if here.size:
            bends += self._moving(rows, branches, some, here, below, above)
        self.ways.append(Curvature(cell[some], tuple(bends), tuple(swings), gaps=tuple(gaps)))

    def _moving(
        self, rows: Rows, branches: Decided, some: Ints, here: Ints, below: Mask, above: Mask
    ) -> list[Bends]:
        """Return the bends at the border between the branches."""
        law, side = self.law, rows.side
        h = np.diff(rows.x)[some]
        one_cut, two_cut = branches.cut[some], branches.cut[some + 1]
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
        border = _Border(least, most, first, last=last, ends=ends, drift=drift, low=low, high=high)
        other = border._replace(low=-high, high=-low)
        return self._border(rows, some, here, below, border) + self._border(rows, some, here, above, other)

    def _border(self, rows: Rows, some: Ints, here: Ints, flips: Mask, border: _Border) -> list[Bends]:
        """Return the bends by the jump of the density at a border, fixed or moving with x."""
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
        span = self.span_of(side, flips[here], np.minimum(one, two) - wide, np.maximum(one, two) + wide)
        return [Bends(rows.number[cell], much.lo, much.hi, cap, span)]
