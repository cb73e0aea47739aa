"""Two throws with the same parameters, for `oriented_beyond` with `throws` 2.

docs/certificates.md, "Goals, end points, orbits", number 9.  A throw with the impact angle p begins at x = P(p), where
f = 0, and jogs to P(p) + D(p): no equation has to be solved.  Two throws are angles p and r with x'(p) + e = P(r), e
the noise of the landing.  For weights v, w >= 0 and any u

    x'' <= G = x'' + v m(p) + w m(r) + u (x' + e - P(r)),

where m decides the branch, its sign turned so that m >= 0 where the branch is taken.  The value of G at a point of a
box and its derivatives over the box bound G there.
"""

import itertools
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import (
    HALF,
    ONE,
    ZERO,
    Arb,
    Array,
    Pair,
    Rising,
    float_above,
    float_below,
    prove,
    span,
)
from .cells import leading_by
from .file import LENGTHS, Cells, quantity
from .model import barrier
from .part import ends_of, read_lengths, read_part
from .scene import Scene

# The variables of two throws: two impact angles, the landing between them, kappa, h, and the lengths of the part.
AT_FIRST, AT_SECOND, AT_LANDING, AT_KAPPA, AT_HEIGHT, AT_LENGTHS = range(6)
ANGLE_PIECES = 12  # of each angle, to begin with
MOST_PAIRS = 20_000  # boxes, for one kind of two throws


class Two(NamedTuple):
    """Two throws in turn: the side they begin on, and their branches (0 jog, 1 flip)."""

    side: int
    first: int
    second: int


def check_two_throws(c: Cells, scene: Scene, bad: Array, x: float) -> None:
    """Check that two throws with the same parameters never end beyond x in the bad cells."""
    names = scene.noise if isinstance(scene.noise, dict) else {}
    same = set(names) <= {"landing.x"}
    prove(same, "with noise of the throw no two throws have the same parameters")
    unit = LENGTHS[scene.unit]
    known = read_lengths(scene.raw["part"], unit)
    h = quantity(scene.raw["arm"]["surface_height"], "length", "arm.surface_height")
    landing = scene.sides[0].landing
    balls = [(-landing).union(landing), scene.k_lo.union(scene.k_hi), span(h.lo / unit, h.hi / unit)]
    balls += [ball for _, _, ball in known]
    fixed = [(float_below(ball), float_above(ball)) for ball in balls]
    for kind, ranges in kinds_of_two(c, bad):
        cuts = [np.linspace(*ends, ANGLE_PIECES + 1).tolist() for ends in ranges]
        pairs = itertools.product(*(itertools.pairwise(each) for each in cuts))
        stack, looked = [[*pair, *fixed] for pair in pairs], 0
        while stack:
            box = stack.pop()
            looked += 1
            k = pair_stays(scene, kind, [one for one, _, _ in known], box, arb(x))
            if k < 0:
                continue
            lo, hi = box[k]
            cut = lo + (hi - lo) / 2
            more = looked + len(stack) <= MOST_PAIRS and lo < cut < hi
            prove(more, f"two throws with the same parameters may end beyond x = {x!r} on another side")
            stack += [[*box[:k], (lo, cut), *box[k + 1 :]], [*box[:k], (cut, hi), *box[k + 1 :]]]


def kinds_of_two(c: Cells, bad: Array) -> Iterator[tuple[Two, list[Pair]]]:
    """Yield each kind of two throws from attracting cells that may end in bad ones, with the ranges of both angles."""
    inside = c.component >= 0
    for second, first in itertools.product((0, 1), (0, 1)):
        then = inside & leading_by([(c.jog, c.flip)[second]], bad)
        begin = inside & leading_by([(c.jog, c.flip)[first]], then)
        for side in range(len(c.edges)):
            own = np.flatnonzero(begin & (c.side == side))
            if len(own):
                next_side = (side + first) % len(c.edges)
                at = np.flatnonzero(then & (c.side == next_side))
                ranges = [(float(c.phi[some, 0].min()), float(c.phi[some, 1].max())) for some in (own, at)]
                yield Two(side, first, second), ranges


def pair_stays(scene: Scene, kind: Two, lengths: list[int], box: list[Pair], x: Arb) -> int:
    """Prove a box of angles and parameters: -1, or the variable along which the box has to be halved."""
    terms, landing = terms_over(scene, kind, lengths, box), scene.sides[0].landing
    over = terms.over()
    if over[0] + landing <= x or over[1] < 0 or over[2] < 0 or over[3] > 0 or over[3] < 0:
        return -1
    weights = weights_of(terms)
    if weights is None:
        return int(np.argmax(terms.half))
    slopes = [
        sum((w * by[k] for w, by in zip(weights, terms.steep, strict=True)), ZERO) for k in range(len(box))
    ]
    if bound_of_sum(scene, kind, lengths, terms, weights, slopes) <= x:
        return -1
    sizes = [float(abs(d).upper()) if d.contains(0) else float(d.rad()) for d in slopes]
    return int(np.argmax([size * h for size, h in zip(sizes, terms.half, strict=True)]))


class Terms(NamedTuple):
    """The four values of `two_throws` over a box of the variables: at its middle, and their derivatives over it."""

    ends: list[tuple[Arb, Arb]]
    middle: list[Arb]
    off: list[Arb]  # the box less its middle
    half: list[float]  # half the width along each variable
    centre: list[Arb]
    steep: list[list[Arb]]

    def over(self) -> list[Arb]:
        """Enclose each of the four over the box, by the mean value theorem."""
        return [
            c + sum((d * o for d, o in zip(by, self.off, strict=True)), ZERO)
            for c, by in zip(self.centre, self.steep, strict=True)
        ]


def terms_over(scene: Scene, kind: Two, lengths: list[int], box: list[Pair]) -> Terms:
    """Compute the four values of `two_throws` at the middle of a box, and their derivatives over the box."""
    n = len(box)
    ends = [(arb(lo), arb(hi)) for lo, hi in box]
    middle = [arb(lo + (hi - lo) / 2) for lo, hi in box]
    rising = [
        Rising(lo.union(hi), [ONE if j == k else ZERO for j in range(n)]) for k, (lo, hi) in enumerate(ends)
    ]
    steep = [term.by for term in two_throws(scene, kind, lengths, rising)]
    centre = two_throws(scene, kind, lengths, middle)
    off = [lo.union(hi) - mid for (lo, hi), mid in zip(ends, middle, strict=True)]
    half = [float((hi - lo).mid()) / 2 for lo, hi in ends]
    return Terms(ends, middle, off, half, centre, steep)


def weights_of(terms: Terms) -> list[Arb] | None:
    """Choose the weights 1, v, w and u of the four terms; None where floats propose none with v, w >= 0."""
    half = terms.half
    floats = np.array([[float(d.mid()) * h for d, h in zip(by, half, strict=True)] for by in terms.steep])
    at = np.array([float(c.mid()) for c in terms.centre])
    if not (np.isfinite(floats).all() and np.isfinite(at).all()):
        return None
    weights = [ONE, *(arb(w) for w in weigh(at, floats))]
    return weights if weights[1] >= 0 and weights[2] >= 0 else None


def weigh(at: Array, slopes: Array) -> list[float]:
    """Propose v, w and u in floats: the corner (three derivatives or weights are 0) with the least bound."""
    lines = np.concatenate([slopes, [[0, 0], [1, 0], [0, 1], [0, 0]]], axis=1)
    three = np.array([t for t in itertools.combinations(range(lines.shape[1]), 3) if t[0] <= AT_SECOND])
    matrix = np.moveaxis(lines[1:, three], 0, 2)
    good = abs(np.linalg.det(matrix)) > 1e-300
    weights = np.linalg.solve(matrix[good], -lines[0, three[good]][:, :, None])[:, :, 0]
    weights = np.concatenate([[[0.0, 0.0, 0.0]], weights[(weights[:, :2] >= 0).all(axis=1)]])
    cost = at[0] + weights @ at[1:] + abs(slopes[0] + weights @ slopes[1:]).sum(axis=1)
    return [float(w) for w in weights[int(np.nanargmin(cost))]]


def bound_of_sum(
    scene: Scene, kind: Two, lengths: list[int], terms: Terms, weights: list[Arb], slopes: list[Arb]
) -> Arb:
    """Bound G over a box from above, the noise of the last landing included.

    G at a point, and its derivatives over the box: along a variable in which G is proved to rise or fall the point
    lies at the end where G is largest, and the variable adds nothing.
    """
    point = [
        hi if d >= 0 else lo if d <= 0 else mid
        for d, (lo, hi), mid in zip(slopes, terms.ends, terms.middle, strict=True)
    ]
    value = sum(
        (w * t for w, t in zip(weights, two_throws(scene, kind, lengths, point), strict=True)),
        scene.sides[0].landing,
    )
    loose = [ZERO if d >= 0 or d <= 0 else abs(d) * abs(o) for d, o in zip(slopes, terms.off, strict=True)]
    return value + sum(loose, ZERO)


def two_throws(scene: Scene, kind: Two, lengths: list[int], v: list[Any]) -> list[Any]:
    """Compute the four terms of G in any arithmetic: x'', m(p), m(r), and x' + e - P(r)."""
    known = dict(zip(lengths, v[AT_LENGTHS:], strict=True))
    unit = LENGTHS[scene.unit]

    def read(value: object, where: str) -> Any:
        return known.get(id(value), span(*ends_of(value, where, unit)))

    rests, rho = read_part(scene.raw["part"], unit, read)
    begin, then = rests[kind.side], rests[(kind.side + kind.first) % len(rests)]
    _, mid, m = by_angle(scene, begin, rho, v[AT_KAPPA], v[AT_HEIGHT], v[AT_FIRST])
    start, end, n = by_angle(scene, then, rho, v[AT_KAPPA], v[AT_HEIGHT], v[AT_SECOND])
    mid = mid - begin[3] if kind.first else mid
    end = end - then[3] if kind.second else end
    return [end, m if kind.first else -m, n if kind.second else -n, mid + v[AT_LANDING] - start]


def by_angle(scene: Scene, rest: Any, rho: Any, kappa: Any, h: Any, p: Any) -> tuple[Any, Any, Any]:
    """Compute P(p), R'(jog), and the value that decides (a flip where it is positive), of a throw with the angle p."""
    a, d = rest[0], rest[1]
    s = scene.sides[0]
    ell2 = a**2 + d**2
    ell = ell2.sqrt()
    if s.exact:
        sin, cos = p.sin_cos()
        x = HALF * kappa * p + (a * sin - d * (ONE - cos)) / p
        jog = x - h * p + a * (ONE - cos) - d * (p - sin)
        X, H = a * cos - d * sin, a * sin + d * cos
        spin = rho**2 + X * (x - kappa * p) + H * (h + d)
        V = kappa * barrier(ell, X, H, signed=True)
    else:
        x = a + HALF * (kappa - d if "2" in scene.raw["model"]["flight"] else kappa) * p
        jog = x - h * p
        spin = rho**2 - a * x + 2 * a**2 + d**2 + d * h
        V = kappa * (a**2 / (ell + d)) - 2 * a * (x - a)
    turned = spin * abs(spin) if s.signed else spin * spin
    return x, jog, turned / (2 * (rho**2 + ell2)) - V
