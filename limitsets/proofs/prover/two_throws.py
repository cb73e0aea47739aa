"""Two throws with the same parameters: a bound of where they lead in every scene of a box, by impact angles.

Cells proved for a box of parameters allow other parameters at every throw, as time-varying noise does.  Time-invariant
parameters lead less far: the scene whose slow throws jog to the highest place is not the one whose fast throws then
flip there.  Two throws with the same parameters capture nearly all of this difference, and the limit set lies in the
images of the attracting cells under two throws, as under any number.

Two throws are two impact angles p, r (`by_angle.py`) with x'(p) + e = P(r), e the noise of the landing place, and with
the deciding numbers m(p) and m(r), signed so that they are at least 0 where the branches are taken.  For weights v, w
>= 0 and any u, with the second throw's end x'',

    x''  <=  G = x''(r) + v m(p) + w m(r) + u (x'(p) + e - P(r)).

The weights are chosen so that G hardly depends on the angles.  Its derivatives are enclosed over a box of angles and
quantities: along a quantity in which G is proved to rise, or fall, only that end counts, any other costs the derivative
times half its width.  Boxes that are not settled are cut.
Source: weak duality (Lagrange multipliers); the monotonicity test of interval analysis (Moore, 1966).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower import Energy, Exact, SmallAngle2
from limitsets.feeder.thrower.flight_box import turn_box
from limitsets.feeder.thrower.impact import pose
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import proof_kernel
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.cover import leading_to, targets
from limitsets.proofs.prover.numbers import Intervals, Jet, root
from limitsets.proofs.prover.parameters import ParameterBox, body_at, lengths_of

# ----------------------------------------------------------------
# Throws parametrised by their impact angle p instead of their start x: no equation has to be solved.
#
#     x = P(p) = kappa p / 2 + (a sin p - d (1 - cos p)) / p,    x' = P(p) + D(p), less the shift of a flip,
#
# with the displacement D of a jog: docs/model.md.  The formulas take numbers of any arithmetic with ``+ - * /``, here
# arrays of intervals, bare or with their derivatives by some variables (`mean_value.Jet`).


JOG, FLIP = 0, 1


class OneSide(NamedTuple):
    """What a throw from one side depends on: a, d, and by how much less a flip moves than a jog."""

    a: Any
    d: Any
    shift: Any


class ThrowNumbers(NamedTuple):
    """What throws depend on: their sides, the radius of gyration, kappa, height of the arm's surface."""

    sides: list[OneSide]
    rho: Any
    kappa: Any
    h: Any


class Angle(NamedTuple):
    """An angle p, sin p, 1 - cos p and p - sin p."""

    p: Any
    sin: Any
    versin: Any
    phi_minus_sin: Any


@proof_kernel(entry=True)
def _turns(lo: Any, hi: Any, out: Any) -> None:
    for k in range(lo.size):
        at = turn_box(Interval(lo[k], hi[k]))
        out[0, k], out[1, k] = at.sin.lo, at.sin.hi
        out[2, k], out[3, k] = at.versin.lo, at.versin.hi
        out[4, k], out[5, k] = at.phi_minus_sin.lo, at.phi_minus_sin.hi


def variable(value: Intervals, number: int, count: int) -> Jet:
    """Return the variable of a number, among so many."""
    one, none = Intervals.of(1.0), Intervals.of(0.0)
    return Jet(value, tuple(one if k == number else none for k in range(count)))


def angle(p: Any) -> Angle:
    """Evaluate what depends on an angle alone, with derivatives if it has any."""
    bare = p.value if isinstance(p, Jet) else p
    out = np.empty((6, bare.lo.size))
    _turns(np.ascontiguousarray(bare.lo), np.ascontiguousarray(bare.hi), out)
    s, v, w = (Intervals(out[2 * k], out[2 * k + 1]) for k in range(3))
    if not isinstance(p, Jet):
        return Angle(p, s, v, w)
    c = 1.0 - v
    return Angle(p, *(Jet(f, tuple(of * by for by in p.derivatives)) for f, of in ((s, c), (v, s), (w, v))))


def _signed_square(x: Any) -> Any:
    """x |x|."""
    if not isinstance(x, Jet):
        return x * x.absolute()
    size = x.value.absolute()
    return Jet(x.value * size, tuple(2.0 * (size * rise) for rise in x.derivatives))


@dataclass(frozen=True)
class Formulas:
    """The formulas of one model.

    Attributes
    ----------
    flight, flip : NamedTuple
        The models, as a `Throw` has them.
    """

    flight: Any
    flip: Any

    def start(self, n: ThrowNumbers, part: OneSide, at: Angle) -> Any:
        """Where the throw begins."""
        if isinstance(self.flight, Exact):
            return n.kappa * at.p * 0.5 + (part.a * at.sin - part.d * at.versin) / at.p
        pull = n.kappa - part.d if isinstance(self.flight, SmallAngle2) else n.kappa
        return part.a + pull * at.p * 0.5

    def end(self, n: ThrowNumbers, part: OneSide, at: Angle, x: Any, branch: int) -> Any:
        """Where it ends, on a branch."""
        jog = x - n.h * at.p
        if isinstance(self.flight, Exact):
            jog = jog + (part.a * at.versin - part.d * at.phi_minus_sin)
        return jog - part.shift if branch == FLIP else jog

    def margin(self, n: ThrowNumbers, part: OneSide, at: Angle, x: Any) -> Any:
        """Evaluate what decides: above 0 where it flips."""
        a, d = part.a, part.d
        ell = root(a * a + d * d)
        if isinstance(self.flight, Exact):
            right, above = pose(part, at)
            spin = n.rho * n.rho + right * (x - n.kappa * at.p) + above * (n.h + d)
            barrier = n.kappa * (_signed_square(right) / (ell + above))
        else:
            reach = x - a
            spin = n.rho * n.rho + a * a + d * d + d * n.h - a * reach
            barrier = n.kappa * (a * a / (ell + d)) - 2.0 * (a * reach)
        turned = spin * spin if isinstance(self.flip, Energy) else _signed_square(spin)
        return turned / (2.0 * (n.rho * n.rho + a * a + d * d)) - barrier


# ----------------------------------------------------------------
# Two throws with the same parameters: a bound of the place they lead to, in every scene of a box.


# Variables before the part's lengths: both angles, where the first throw lands beyond its place, kappa, surface height.
FIRST, SECOND, LANDED, KAPPA, HEIGHT, LENGTHS = range(6)

# Pieces of each angle to begin with, and boxes that are looked at before it is given up: a proof takes some hundreds.
PIECES, MOST_BOXES = 12, 1500

# A parameter as narrow as this, relative to itself, is known but for rounding.
KNOWN = 1e-9


class TwoThrows(NamedTuple):
    """Two throws: the side they begin on, their branches."""

    side: int
    first: int
    second: int


def kinds_of_two_throws(attraction: Attraction, bad: Mask) -> Iterator[tuple[TwoThrows, Array]]:
    """Two throws from attracting cells that may end in bad ones, and the ranges of both angles, shape (2, 2)."""
    grid, ways = attraction.cover.grid, (targets(attraction.cover, JOG), targets(attraction.cover, FLIP))
    angles = np.concatenate([images.witness for images in attraction.cover.images], axis=1)
    attracting = attraction.component >= 0
    for second in (JOG, FLIP):
        last = attracting & leading_to(ways[second], bad)
        for first in (JOG, FLIP):
            begin = attracting & leading_to(ways[first], last)
            for side in range(grid.sides):
                own, then = np.zeros_like(begin), np.zeros_like(begin)
                at, after = grid.of_side(side), grid.of_side((side + first) % grid.sides)
                own[at], then[after] = begin[at], last[after]
                if own.any():
                    ranges = [[angles[0, some].min(), angles[1, some].max()] for some in (own, then)]
                    yield TwoThrows(side, first, second), np.array(ranges)


def stays_below(attraction: Attraction, scene: Scene, bad: Mask, x: float) -> bool:
    """Prove that no second throw from attracting cells, with the same parameters, leads beyond x to cells called bad.

    Parameters
    ----------
    attraction : Attraction
        Cells and images of a box of parameters; throws may land anywhere within the noise of the landing place.
    scene : Scene
        The scene.
    bad : ndarray of bool, shape (n_cells,)
        All attracting cells that reach beyond x on some sides.
    x : float
        The place.

    Returns
    -------
    bool
        Whether it is proved.
    """
    box = attraction.cover.box
    if box.effects or {"throw.speed", "gravity.tilt"} & box.noise.keys():
        return False  # nothing is the same at two throws
    boxes = _Boxes(box, scene, x)
    return boxes.wide and all(boxes.settled(*each) for each in kinds_of_two_throws(attraction, bad))


class _Boxes:
    """Boxes of angles and quantities: arrays of shape (variables, boxes)."""

    def __init__(self, box: ParameterBox, scene: Scene, x: float) -> None:
        lo, hi = box.bare
        self.scene, self.tree, self.x, self.landing = scene, box.scene, x, box.landing
        self.formulas, self.sides = Formulas(lo.flight, lo.flip), lo.a.size
        lengths = lengths_of(scene, box.scene)
        self.names = [name for name, span in lengths.items() if span.lo < span.hi]
        self.known = {name: Intervals.of(*span.outward()) for name, span in lengths.items()}
        ends = [
            (-box.landing, box.landing),
            (lo.kappa, hi.kappa),
            (lo.surface_height, hi.surface_height),
            *(lengths[name].outward() for name in self.names),
        ]
        self.ends = np.array(ends).T
        widths = (hi.kappa / lo.kappa - 1.0, hi.surface_height - lo.surface_height)
        self.wide = bool(self.names) or max(widths) > KNOWN

    def settled(self, kind: TwoThrows, ranges: Array) -> bool:
        """Prove that two throws stay below x."""
        cuts = [np.linspace(low, high, PIECES + 1) for low, high in ranges.tolist()]
        i, j = np.divmod(np.arange(PIECES * PIECES), PIECES)
        same = [np.repeat(ends[:, None], i.size, axis=1) for ends in self.ends]
        lo = np.concatenate([[cuts[0][i], cuts[1][j]], same[0]])
        hi = np.concatenate([[cuts[0][i + 1], cuts[1][j + 1]], same[1]])
        looked = 0
        while lo.shape[1]:
            looked += lo.shape[1]
            if looked > MOST_BOXES:
                return False
            left, along = self._open(kind, lo, hi)
            lo, hi = lo[:, left], hi[:, left]
            at = (along, np.arange(along.size))
            low, high = lo.copy(), hi.copy()
            high[at] = low[at] = 0.5 * (lo[at] + hi[at])
            lo, hi = np.concatenate([lo, low], axis=1), np.concatenate([high, hi], axis=1)
        return True

    def _open(self, kind: TwoThrows, lo: Array, hi: Array) -> tuple[Ints, Ints]:
        """Which boxes are not settled, and along which variable each is to be cut."""
        count, rows = lo.shape
        middle = 0.5 * (lo + hi)
        half = np.nextafter(np.maximum(middle - lo, hi - middle), np.inf)
        terms = self._terms(kind, [variable(Intervals(lo[k], hi[k]), k, count) for k in range(count)])
        slopes = [[by.rows(rows) for by in term.derivatives] for term in terms]
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
        weights = _weights([mid[left] for mid in centre], slopes, half[:, left])
        return self._weighed(kind, left, slopes, weights, (lo, middle, hi), half)

    def _weighed(
        self,
        kind: TwoThrows,
        left: Ints,
        slopes: list[list[Intervals]],
        weights: list[Intervals],
        ends: tuple[Array, Array, Array],
        half: Array,
    ) -> tuple[Ints, Ints]:
        """Bound G on the boxes that are left: which fail, and what matters most to each."""
        lo, middle, hi = (each[:, left] for each in ends)
        total = [_sum(parts, weights) for parts in zip(*slopes, strict=True)]
        rises, falls = np.array([by.lo >= 0.0 for by in total]), np.array([by.hi <= 0.0 for by in total])
        value = _sum(self._at(kind, np.where(rises, hi, np.where(falls, lo, middle))), weights)
        open_half = np.where(rises | falls, 0.0, half[:, left])
        bound = value + self.landing + _most(total, open_half)
        failed = np.flatnonzero(~(bound.hi <= self.x))
        # what a variable costs where its sign is open, and half of how loose its derivative is where it is not
        sizes = np.array(
            [np.where(by.absolute().lo > 0.0, 0.5 * (by.hi - by.lo), by.absolute().hi) for by in total]
        )
        return left[failed], np.argmax((sizes * half[:, left])[:, failed], axis=0)

    def _at(self, kind: TwoThrows, point: Array) -> list[Intervals]:
        """Enclose the terms at one point of every box."""
        terms = self._terms(kind, [Intervals(each, each) for each in point])
        return [term.rows(point.shape[1]) for term in terms]

    def _terms(self, kind: TwoThrows, at: list[Any]) -> list[Any]:
        """x'', what decides in both throws, signed, and what has to be 0, of variables with or without derivatives."""
        lengths = self.known | dict(zip(self.names, at[LENGTHS:], strict=True))
        sides, rho = body_at(self.scene, self.tree, lengths)
        after = [*sides[1:], sides[0]]
        parts = [
            OneSide(a, d, a + length - a_next)
            for (a, d, _), (a_next, _, length) in zip(sides, after, strict=True)
        ]
        n = ThrowNumbers(parts, rho, at[KAPPA], at[HEIGHT])
        begin, then = parts[kind.side], parts[(kind.side + kind.first) % self.sides]
        one, two, of = angle(at[FIRST]), angle(at[SECOND]), self.formulas
        x, place = of.start(n, begin, one), of.start(n, then, two)
        away = of.end(n, begin, one, x, kind.first) + at[LANDED] - place
        decides = of.margin(n, begin, one, x), of.margin(n, then, two, place)
        signed = [m if branch == FLIP else -m for m, branch in zip(decides, kind[1:], strict=True)]
        return [of.end(n, then, two, place, kind.second), *signed, away]


def _most(slopes: list[Intervals], half: Array) -> Intervals:
    """Sum of |slope| times half width."""
    parts = (by.absolute() * Intervals(wide, wide) for by, wide in zip(slopes, half, strict=True))
    return sum(parts, Intervals.of(0.0))


def _sum(terms: Any, weights: list[Intervals]) -> Intervals:
    """First term, and the others weighed."""
    total: Intervals = terms[0]
    for term, weight in zip(terms[1:], weights, strict=True):
        total = total + term * weight
    return total


def _weights(values: list[Intervals], slopes: list[list[Intervals]], half: Array) -> list[Intervals]:
    """Propose weights, in floats: any are right whose first two are not below 0.

    How x'' changes with r is taken up by m(r), where the second branch ends; or by u, handed on to p, and there taken
    up by m(p), where the first branch ends; or by nothing.  The best of these is taken.
    """
    at = np.array([0.5 * (value.lo + value.hi) for value in values])
    steep = np.array([[0.5 * (by.lo + by.hi) for by in of] for of in slopes])
    none = np.zeros(half.shape[1])
    with np.errstate(all="ignore"):
        handed = -steep[0, SECOND] / steep[3, SECOND]
        some = [
            (none, none, none),
            (none, -steep[0, SECOND] / steep[2, SECOND], none),
            (none, none, handed),
            (-handed * steep[3, FIRST] / steep[1, FIRST], none, handed),
        ]
    best, chosen = np.full(half.shape[1], np.inf), np.zeros((3, half.shape[1]))
    for weights in map(np.array, some):
        good = np.isfinite(weights).all(axis=0) & (weights[:2] >= 0.0).all(axis=0)
        tried = np.where(good, weights, 0.0)
        loose = np.abs(steep[0] + (tried[:, None] * steep[1:]).sum(axis=0)) * half
        bound = at[0] + (tried * at[1:]).sum(axis=0) + loose.sum(axis=0)
        better = bound < best
        best, chosen = np.where(better, bound, best), np.where(better, tried, chosen)
    return [Intervals(each, each) for each in chosen]
