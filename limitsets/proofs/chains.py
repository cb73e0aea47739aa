"""Two throws with the same parameters: how far they lead, at most, in every scene of a box.

Cells proved for a box of parameters allow other parameters at every throw, as noise does.  What is fixed but unknown
leads less far: the scene whose slow throws jog to the highest place is not the one whose fast throws then flip there.
Two throws with the same parameters keep nearly all of that; and the limit set lies in the images of the attracting
cells under two throws, as under any number.

A throw is told by its impact angle p instead of its start x: then nothing is implicit,

    x = P(p) = kappa p / 2 + (a sin p - d (1 - cos p)) / p,    x' = P(p) + D(p) (- shift),

with the displacement D of a jog.  Two throws are two angles p, r with x'(p) + e = P(r), e the noise of the landing
place, and m(p), m(r), signed so that they are at least 0 where the branches are taken.  For weights v, w >= 0 and any u

    x''  <=  G = x''(r) + v m(p) + w m(r) + u (x'(p) + e - P(r)).

The weights are chosen so that G hardly depends on the angles.  Its derivatives are enclosed over a box of angles and
quantities: along a quantity in which G is proved to rise, or fall, only that end counts, any other costs the derivative
times half its width.  Boxes that are not settled are cut.
Source: weak duality (Lagrange multipliers); the monotonicity test of interval analysis (Moore, 1966).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.jit import proof_kernel
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.certificate import targets
from limitsets.proofs.intervals import Intervals
from limitsets.proofs.mean_value import Slope, root
from limitsets.proofs.parameters import body_at, lengths_of
from limitsets.scene import Scene
from limitsets.thrower import Energy, Exact, SmallAngle2
from limitsets.thrower.turn_box import turn_box

__all__ = ["stays_below"]

# Variables before the part's lengths: both angles, where the first throw lands beyond its place, kappa, surface height.
FIRST, SECOND, LANDED, KAPPA, HEIGHT, LENGTHS = range(6)

JOG, FLIP = 0, 1

# Pieces of each angle to begin with; boxes that are looked at before it is given up, and at a time.
PIECES, MOST_BOXES, BATCH = 12, 1_500, 4000

Floats = NDArray[np.float64]


class _Side(NamedTuple):
    """What a throw from one side depends on: numbers of any arithmetic."""

    a: Any
    d: Any
    shift: Any


class _Numbers(NamedTuple):
    """What all throws depend on."""

    sides: list[_Side]
    rho: Any
    kappa: Any
    h: Any
    landed: Any


class _Angle(NamedTuple):
    """An angle p, sin p, 1 - cos p and p - sin p."""

    p: Any
    s: Any
    v: Any
    w: Any


@proof_kernel(entry=True)
def _turns(lo: Any, hi: Any, out: Any) -> None:
    for k in range(lo.size):
        for row, found in enumerate(turn_box(lo[k], hi[k])):
            out[2 * row, k], out[2 * row + 1, k] = found


def _angle(p: Intervals) -> _Angle:
    out = np.empty((6, p.lo.size))
    _turns(np.ascontiguousarray(p.lo), np.ascontiguousarray(p.hi), out)
    return _Angle(p, *(Intervals(out[2 * k], out[2 * k + 1]) for k in range(3)))


def _rising_angle(p: Intervals, number: int, count: int) -> _Angle:
    """Return the same, with derivatives by the angle as one of some variables."""
    _, s, v, w = _angle(p)

    def by(slope: Intervals) -> tuple[Intervals, ...]:
        return tuple(slope if k == number else Intervals.of(0.0) for k in range(count))

    return _Angle(Slope(p, by(Intervals.of(1.0))), Slope(s, by(1.0 - v)), Slope(v, by(s)), Slope(w, by(v)))


def _signed_square(x: Any) -> Any:
    """x |x|."""
    if not isinstance(x, Slope):
        return x * x.absolute()
    size = x.value.absolute()
    return Slope(x.value * size, tuple(2.0 * (size * rise) for rise in x.by))


@dataclass(frozen=True)
class _Model:
    """The formulas of the throw by its angle: docs/model.md, flight, impact, decision, landing."""

    flight: Any
    flip: Any

    def place(self, n: _Numbers, part: _Side, at: _Angle) -> Any:
        """Where a throw with this angle begins."""
        if isinstance(self.flight, Exact):
            return n.kappa * at.p * 0.5 + (part.a * at.s - part.d * at.v) / at.p
        pull = n.kappa - part.d if isinstance(self.flight, SmallAngle2) else n.kappa
        return part.a + pull * at.p * 0.5

    def lands(self, n: _Numbers, part: _Side, at: _Angle, x: Any, branch: int) -> Any:
        """Where it ends."""
        jog = x - n.h * at.p
        if isinstance(self.flight, Exact):
            jog = jog + (part.a * at.v - part.d * at.w)
        return jog - part.shift if branch == FLIP else jog

    def margin(self, n: _Numbers, part: _Side, at: _Angle, x: Any) -> Any:
        """Evaluate what decides: above 0 where it flips."""
        a, d = part.a, part.d
        inertia = n.rho * n.rho + a * a + d * d
        ell = root(a * a + d * d)
        if isinstance(self.flight, Exact):
            c = 1.0 - at.v
            right, above = a * c - d * at.s, a * at.s + d * c
            spin = n.rho * n.rho + right * (x - n.kappa * at.p) + above * (n.h + d)
            barrier = n.kappa * (_signed_square(right) / (ell + above))
        else:
            reach = x - a
            spin = n.rho * n.rho + a * a + d * d + d * n.h - a * reach
            barrier = n.kappa * (a * a / (ell + d)) - 2.0 * (a * reach)
        turned = spin * spin if isinstance(self.flip, Energy) else _signed_square(spin)
        return turned / (inertia * 2.0) - barrier


class _Kind(NamedTuple):
    """Two throws: the side they begin on, their branches."""

    side: int
    first: int
    second: int


def _kinds(found: Attraction, bad: NDArray[np.bool_]) -> Iterator[tuple[_Kind, Floats]]:
    """Two throws that may end in the bad cells, as far as cells tell, and the ranges of both angles, shape (2, 2)."""
    grid, ways = found.cover.grid, (targets(found.cover, JOG), targets(found.cover, FLIP))
    angles = np.concatenate([images.witness for images in found.cover.images], axis=1)
    number = np.concatenate([[0], np.cumsum(bad)])
    attracting = found.component >= 0
    for second in (JOG, FLIP):
        begin, end = ways[second].T
        into = attracting & (begin >= 0) & (number[end + 1] > number[begin])
        hits = np.concatenate([[0], np.cumsum(into)])
        for first in (JOG, FLIP):
            begin, end = ways[first].T
            cells = np.flatnonzero(attracting & (begin >= 0) & (hits[end + 1] > hits[begin]))
            for side in range(grid.sides):
                own = cells[(cells >= grid.offset[side]) & (cells < grid.offset[side + 1])]
                if own.size:
                    between = np.zeros(grid.n_cells + 1, dtype=np.int64)
                    np.add.at(between, begin[own], 1)
                    np.add.at(between, end[own] + 1, -1)
                    then = np.flatnonzero((np.cumsum(between)[:-1] > 0) & into)
                    ranges = [[angles[0, some].min(), angles[1, some].max()] for some in (own, then)]
                    yield _Kind(side, first, second), np.array(ranges)


def stays_below(found: Attraction, scene: Scene, bad: NDArray[np.bool_], x: float) -> str:
    """Prove that no second throw from attracting cells, with the same parameters, leads beyond x to cells called bad.

    Parameters
    ----------
    found : Attraction
        Cells and images of a box of parameters; throws may land anywhere within the noise of the landing place.
    scene : Scene
        The scene.
    bad : ndarray of bool, shape (n_cells,)
        Cells in question, all of those beyond x on some sides.
    x : float
        The place.

    Returns
    -------
    str
        What is missing; empty if it is proved.
    """
    box = found.cover.box
    if box.effects or {"throw.speed", "gravity.tilt"} & box.noise.keys():
        return "throws differ"
    boxes = _Boxes(found, scene, x)
    for kind, ranges in _kinds(found, bad & (found.component >= 0)):
        why = boxes.settled(kind, ranges)
        if why:
            return why
    return ""


class _Boxes:
    """Boxes of angles and quantities: arrays of shape (variables, boxes)."""

    def __init__(self, found: Attraction, scene: Scene, x: float) -> None:
        box = found.cover.box
        lo, hi = box.bare
        self.scene, self.tree, self.x, self.landing = scene, box.scene, x, box.landing
        self.model, self.sides = _Model(lo.flight, lo.flip), found.cover.grid.sides
        lengths = lengths_of(scene, box.scene)
        self.names = [name for name, span in lengths.items() if span.lo < span.hi]
        self.known = {name: Intervals.of(*span.outward()) for name, span in lengths.items()}
        spans = [lengths[name].outward() for name in self.names]
        self.whole = np.array(
            [
                (-box.landing, box.landing),
                (lo.kappa, hi.kappa),
                (lo.surface_height, hi.surface_height),
                *spans,
            ]
        ).T

    def settled(self, kind: _Kind, ranges: Floats) -> str:
        """Prove that two throws stay below x; say where not."""
        cuts = [np.linspace(*ends, PIECES + 1) for ends in ranges]
        rows = np.arange(PIECES * PIECES)
        i, j = rows // PIECES, rows % PIECES
        lo = np.concatenate([[cuts[0][i], cuts[1][j]], np.repeat(self.whole[0][:, None], rows.size, axis=1)])
        hi = np.concatenate(
            [[cuts[0][i + 1], cuts[1][j + 1]], np.repeat(self.whole[1][:, None], rows.size, axis=1)]
        )
        looked = 0
        while lo.shape[1]:
            looked += min(BATCH, lo.shape[1])
            if looked > MOST_BOXES:
                return "too many boxes"
            now, later = slice(lo.shape[1] - BATCH if lo.shape[1] > BATCH else 0, None), slice(0, max(0, lo.shape[1] - BATCH))
            left, cut = self._open(kind, lo[:, now], hi[:, now])
            some_lo, some_hi = lo[:, now][:, left], hi[:, now][:, left]
            at = (cut, np.arange(cut.size))
            middle = 0.5 * (some_lo[at] + some_hi[at])
            lower, upper = some_hi.copy(), some_lo.copy()
            lower[at], upper[at] = middle, middle
            lo = np.concatenate([lo[:, later], some_lo, upper], axis=1)
            hi = np.concatenate([hi[:, later], lower, some_hi], axis=1)

        return ""

    def _numbers(self, lo: Floats, hi: Floats, rising: bool) -> _Numbers:
        """Read the scene's numbers for every box; with derivatives if they are asked for."""
        count = lo.shape[0]

        def variable(number: int) -> Any:
            own = Intervals(lo[number], hi[number])
            one, none = Intervals.of(1.0), Intervals.of(0.0)
            return Slope(own, tuple(one if k == number else none for k in range(count))) if rising else own

        lengths = self.known | {name: variable(LENGTHS + k) for k, name in enumerate(self.names)}
        sides, rho = body_at(self.scene, self.tree, lengths)
        after = [*sides[1:], sides[0]]
        parts = [_Side(a, d, a + length - a_next) for (a, d, _), (a_next, _, length) in zip(sides, after, strict=True)]
        return _Numbers(parts, rho, variable(KAPPA), variable(HEIGHT), variable(LANDED))

    def _terms(self, kind: _Kind, n: _Numbers, one: _Angle, two: _Angle) -> list[Any]:
        """x'', both numbers that decide, signed, and what has to be 0."""
        begin = n.sides[kind.side]
        then = n.sides[kind.side if kind.first == JOG else (kind.side + 1) % self.sides]
        x, place = self.model.place(n, begin, one), self.model.place(n, then, two)
        away = self.model.lands(n, begin, one, x, kind.first) + n.landed - place
        decides = [self.model.margin(n, begin, one, x), self.model.margin(n, then, two, place)]
        signed = [m if branch == FLIP else -m for m, branch in zip(decides, kind[1:], strict=True)]
        return [self.model.lands(n, then, two, place, kind.second), *signed, away]

    def _at(self, kind: _Kind, point: Floats) -> list[Intervals]:
        n = self._numbers(point, point, rising=False)
        one, two = (_angle(Intervals(point[k], point[k])) for k in (FIRST, SECOND))
        return [_as_rows(term, point.shape[1]) for term in self._terms(kind, n, one, two)]

    def _open(self, kind: _Kind, lo: Floats, hi: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Which boxes are not settled, and along which variable each is to be cut."""
        count, rows = lo.shape
        middle = 0.5 * (lo + hi)
        half = np.nextafter(np.maximum(middle - lo, hi - middle), np.inf)
        angles = (_rising_angle(Intervals(lo[k], hi[k]), k, count) for k in (FIRST, SECOND))
        terms = self._terms(kind, self._numbers(lo, hi, rising=True), *angles)
        slopes = [[_as_rows(by, rows) for by in term.by] for term in terms]
        centre = self._at(kind, middle)
        reach = [_most(of, half).hi for of in slopes]
        over = [mid + Intervals(-wide, wide) for mid, wide in zip(centre, reach, strict=True)]
        # settled on a comparison that is true: nan leaves a box open
        settled = ((over[0] + self.landing).hi <= self.x) | (over[1].hi < 0.0) | (over[2].hi < 0.0)
        settled |= (over[3].hi < 0.0) | (over[3].lo > 0.0)
        left = np.flatnonzero(~settled)
        if not left.size:
            return left, left
        slopes = [[by[left] for by in of] for of in slopes]
        centre, half = [value[left] for value in centre], half[:, left]
        weights = _weights(centre, slopes, half)
        exact = [Intervals(w, w) for w in weights]
        total = [
            a + b * exact[0] + c * exact[1] + d * exact[2] for a, b, c, d in zip(*slopes, strict=True)
        ]
        rises = np.array([np.where(by.lo >= 0.0, 1, np.where(by.hi <= 0.0, -1, 0)) for by in total])
        ends = np.where(rises > 0, hi[:, left], np.where(rises < 0, lo[:, left], middle[:, left]))
        value = self._at(kind, ends)
        bound = value[0] + value[1] * exact[0] + value[2] * exact[1] + value[3] * exact[2]
        open_width = np.where(rises == 0, half, 0.0)
        bound = bound + self.landing
        bound = bound + _most(total, open_width)
        failed = np.flatnonzero(~(bound.hi <= self.x))
        size = np.array([np.where(way == 0, by.absolute().hi, 0.5 * (by.hi - by.lo))[failed] for way, by in zip(rises, total, strict=True)]) * half[:, failed]
        return left[failed], np.argmax(size, axis=0)


def _most(slopes: list[Intervals], half: Floats) -> Intervals:
    """Sum of |slope| times half width."""
    parts = (by.absolute() * Intervals(np.zeros(1), wide) for by, wide in zip(slopes, half, strict=True))
    return sum(parts, Intervals.of(0.0))


def _as_rows(value: Any, rows: int) -> Intervals:
    return Intervals(np.broadcast_to(value.lo, (rows,)), np.broadcast_to(value.hi, (rows,)))


def _weights(values: list[Intervals], slopes: list[list[Intervals]], half: Floats) -> Floats:
    """Propose weights, in floats, shape (3, boxes): any would be right, but for the sign of the first two.

    The least sum of absolute values is met where three of the derivatives, or weights, are nothing.
    """
    count = half.shape[1]
    at = np.array([0.5 * (value.lo + value.hi) for value in values])
    lines = np.array([[0.5 * (by.lo + by.hi) for by in of] for of in slopes]) * half
    axes = np.zeros((4, 2, count))
    axes[1, 0] = axes[2, 1] = 1.0
    best, weights = np.full(count, np.inf), np.zeros((3, count))
    every = np.concatenate([lines, axes], axis=1)
    # both angles count most: they are among the three, or one of them and a weight
    number = every.shape[1]
    for three in combinations(range(number), 3):
        if FIRST not in three and SECOND not in three:
            continue
        matrix = np.moveaxis(every[1:, three], (0, 1, 2), (2, 1, 0))
        right = -every[0, three].T
        with np.errstate(all="ignore"):
            some = _solved(matrix, right)
        good = np.isfinite(some).all(axis=0) & (some[0] >= 0.0) & (some[1] >= 0.0)
        some = np.where(good, some, 0.0)
        worst = at[0] + (some * at[1:]).sum(axis=0)
        worst = worst + np.abs(lines[0] + (some[:, None] * lines[1:]).sum(axis=0)).sum(axis=0)
        better = worst < best
        best, weights = np.where(better, worst, best), np.where(better, some, weights)
    return weights


def _solved(m: Floats, b: Floats) -> Floats:
    """Cramer's rule, shape (3, boxes); not finite where there is no solution."""
    det = np.linalg.det(m)
    out = []
    for k in range(3):
        other = m.copy()
        other[:, :, k] = b
        out.append(np.linalg.det(other) / det)
    return np.array(out)
