"""Throws whose speed deviates, and the mean of a function after a throw, bounded for every start: one step in floats.

docs/certificates.md, "Probabilities", numbers 20 (means at nodes) and 21 (between nodes).  A function V is continuous
and affine between nodes.  With e the scatter of the landing, W(y) is the mean of V on [y - e, y + e] and
W'(y) = (V(y + e) - V(y - e))/(2 e), affine between the places node + e and node - e.
"""

from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import HALF, ONE, ZERO, Arb, Array, Rising, sine_cosine
from .model import (
    FULL_TURN,
    SLACKS,
    at_angle,
    barrier,
    flight,
    guess_root,
    over_angles,
    rise_of_jog,
)
from .scene import Side

# ----------------------------------------------------------------
# Throws whose speed deviates: where they land, how that changes with place and speed, and where they flip.
#
# docs/certificates.md, "Probabilities", numbers 18 (landings) and 19 (the border).  The speed w (1 + delta) has kappa =
# kappa_0/(1 + delta)^2.  The impact angle p of a start x solves x = P(p), P(p) = kappa p/2 + S(p), and a jog ends at
# T = x + D(p); with kappa > ell there is one solution, which rises with x and with delta.


NEWTON = 60
SMALL_ANGLE = 1e-4  # up to here moments by one term and a bound: the closed forms cancel


class Hit(NamedTuple):
    """A throw from one place at one speed: a bracket of the angle, and where a jog ends."""

    before: Arb
    after: Arb
    place: Arb


class Slopes(NamedTuple):
    """Derivatives of T by x and delta, and of the angle by x and kappa, over a box."""

    x: Arb
    d: Arb
    xx: Arb
    xd: Arb
    dd: Arb
    phi_x: Arb
    phi_k: Arb


def kappa_at(kappa: Arb, delta: Arb) -> Arb:
    """Return kappa of throws whose speed deviates."""
    return kappa / (1 + delta) ** 2


def guess_angles(s: Side, x: Array, kappa: Array) -> Array:
    """Guess impact angles by Newton's method in floats, from beyond the root; no proof rests on it."""
    a, d, small, _ = s.floats
    if not s.exact:
        return 2.0 * (x - a) / (kappa - small)
    phi = 2.0 * (x + a + d) / kappa
    with np.errstate(all="ignore"):
        for _ in range(NEWTON):
            sin, cos = np.sin(phi), np.cos(phi)
            half = np.sin(0.5 * phi)
            f = (x - 0.5 * kappa * phi) * phi + 2.0 * d * half * half - a * sin
            step = f / (x - a * cos + d * sin - kappa * phi)
            phi = phi - step
            if bool((np.abs(step) < 1e-15 * phi).all()):
                break
    return phi


def guess_angle(s: Side, x: float, kappa: float) -> float:
    """Guess one impact angle."""
    return guess_root(s.floats, s.exact, x, kappa, 2.0 * (x + float(s.ell.mid())) / kappa)


def land(s: Side, x: Arb, kappa: Arb, guess: float) -> Hit | None:
    """Enclose a throw, kappa > ell being known; None where the guess is none."""
    for slack in SLACKS:
        if not 0.0 < guess * (1 + slack) < FULL_TURN:
            return None
        before, after = arb(guess * (1 - slack)), arb(guess * (1 + slack))
        if flight(x, kappa, at_angle(s, before)) > 0 and flight(x, kappa, at_angle(s, after)) < 0:
            return Hit(before, after, x + advance_over(s, before.union(after)))
    return None


def advance_over(s: Side, phi: Arb) -> Arb:
    """Enclose D over angles, by the mean value theorem."""
    middle = phi.mid()
    sin, cos = sine_cosine(phi)
    return at_angle(s, middle).D + rise_of_jog(s, sin, cos) * (phi - middle)


def moments(p: Arb) -> tuple[Arb, Arb, Arb, Arb]:
    """Enclose c_1, s_1, c_2, s_2 over angles p from 0: the integrals of t^k cos(p t) and t^k sin(p t), 0 < t < 1.

    c_k' = -s_(k+1) and s_k' = c_(k+1), none above 1/(k + 2) in size.
    """
    middle = p.mid()
    off = p - middle
    if middle > SMALL_ANGLE:
        sin, cos = middle.sin_cos()
        q, r = ONE / middle, ONE / middle**2
        c1, s1 = sin * q - (1 - cos) * r, sin * r - cos * q
        c2, s2 = sin * q - 2 * s1 * q, 2 * c1 * q - cos * q
    else:
        c1, s1, c2, s2 = HALF, ZERO, ONE / 3, ZERO
        off = p
    third, quarter = (ONE / 3).union(-ONE / 3), (ONE / 4).union(-ONE / 4)
    return c1 + third * off, s1 + third * off, c2 + quarter * off, s2 + quarter * off


def slopes_over(s: Side, phi: Arb, kappa: Arb, factor: Arb) -> Slopes:
    """Enclose the derivatives over a box of angles and speeds, kappa and factor = 1 + delta told apart."""
    if s.exact:
        c1, s1, c2, s2 = moments(phi)
        sin, cos = sine_cosine(phi)
        steep, bend = HALF * kappa - s.a * s1 - s.d * c1, s.d * s2 - s.a * c2
        rate, turn = rise_of_jog(s, sin, cos), s.a * cos - s.d * sin
    else:
        steep, bend, rate, turn = HALF * (kappa - s.small_d), ZERO, -s.h, ZERO
    one = 1 / steep if steep > 0 else arb("nan")
    phi_k = -HALF * phi * one
    mixed = bend * phi_k + HALF
    phi_xx, phi_xk = -bend * one**3, -mixed * one**2
    phi_kk = (HALF * phi * mixed * one - HALF * phi_k) * one
    by_d, by_dd = -2 * kappa / factor, 6 * kappa / factor**2
    return Slopes(
        1 + rate * one,
        rate * phi_k * by_d,
        turn * one**2 + rate * phi_xx,
        xd=(turn * one * phi_k + rate * phi_xk) * by_d,
        dd=(turn * phi_k**2 + rate * phi_kk) * by_d**2 + rate * phi_k * by_dd,
        phi_x=one,
        phi_k=phi_k,
    )


def signed_square(z: Any) -> Any:
    """Evaluate z |z|, whose derivative 2 |z| is narrower than that of a product."""
    if isinstance(z, Rising):
        return Rising(z.x * abs(z.x), [2 * abs(z.x) * d for d in z.by])
    return z * abs(z)


def deciding(s: Side, phi: Any, x: Any, kappa: Any) -> Any:
    """Evaluate the number that is positive where the part flips, in any arithmetic."""
    if s.exact:
        sin, cos = phi.sin_cos()
        X, H = s.a * cos - s.d * sin, s.a * sin + s.d * cos
        spin = s.rho2 + X * (x - kappa * phi) + H * s.hd
        over = s.ell + H
        V = kappa * (signed_square(X) / over if s.signed and H > 0 else barrier(s.ell, X, H, s.signed))
    else:
        spin = s.rho2 - s.a * x + 2 * s.a * s.a + s.d * s.d + s.d * s.h
        V = kappa * (s.ell - s.d) - 2 * s.a * (x - s.a)
    return (signed_square(spin) if s.signed else spin * spin) * s.over_2m - V


def deciding_slopes(s: Side, phi: Arb, x: Arb, kappa: Arb, factor: Arb) -> tuple[Arb, Arb]:
    """Enclose the derivatives of `deciding` by x and delta over a box; nan where it does not decide."""
    if s.exact and not s.signed:
        sin, cos = sine_cosine(phi)
        if not s.a * cos - s.d * sin > 0:  # past the vertex every part flips
            return arb("nan"), arb("nan")
    unit = [[ONE if j == k else ZERO for j in range(3)] for k in range(3)]
    decision = deciding(s, Rising(phi, unit[0]), Rising(x, unit[1]), Rising(kappa, unit[2]))
    by_phi, by_x, by_kappa = decision.by
    along = slopes_over(s, phi, kappa, factor)
    return by_x + by_phi * along.phi_x, (by_kappa + by_phi * along.phi_k) * (-2 * kappa / factor)


def decides(s: Side, x: tuple[float, float], kappa: Arb, most: Arb, hits: tuple[Hit, Hit]) -> int:
    """Decide for all starts in x and all deviations up to `most`: 0 jog, 1 flip, 2 not settled.

    `hits`: the first and the last throw of the box.
    """
    box, deviations = arb(x[0]).union(arb(x[1])), (-most).union(most)
    whole, phi = kappa_at(kappa, deviations), hits[0].before.union(hits[1].after)
    branch = int(over_angles(s, phi, box, whole)[0])
    if branch != 2:
        return branch
    middle = arb(0.5 * (x[0] + x[1]))
    by_x, by_d = deciding_slopes(s, phi, box, whole, 1 + deviations)
    at = decided_at(s, float(middle), kappa, ZERO)
    reach = abs(by_x) * abs(box - middle) + abs(by_d) * most
    if at - reach > 0 or at + reach < 0:
        return 1 if at > 0 else 0
    if not ((by_x > 0 or by_x < 0) and (by_d > 0 or by_d < 0 or most == 0)):
        return 2
    # it rises or falls with both: its least and its largest value are at corners
    corner = (int(bool(by_x < 0)), 1 if by_d < 0 else -1)
    least = decided_at(s, x[corner[0]], kappa, most * corner[1])
    largest = decided_at(s, x[1 - corner[0]], kappa, -most * corner[1])
    return 1 if least > 0 else 0 if largest < 0 else 2


def decided_at(s: Side, x: float, kappa: Arb, delta: Arb) -> Arb:
    """Enclose `deciding` of one throw; nan where the throw is not enclosed."""
    k = kappa_at(kappa, delta)
    hit = land(s, arb(x), k, guess_angle(s, x, float(k.mid())))
    return arb("nan") if hit is None else deciding(s, hit.before.union(hit.after), arb(x), k)


def guess_border(s: Side, x: Array, kappa: float, most: float, rises: Array) -> Array:
    """Guess by bisection the deviations at which throws from some places change their branch, an end if none does."""
    lo, hi = np.full(x.shape, -most), np.full(x.shape, most)
    for _ in range(50):
        middle = 0.5 * (lo + hi)
        k = kappa / (1.0 + middle) ** 2
        phi = guess_angles(s, x, k)
        up = (deciding_floats(s, phi, x, k) > 0.0) == rises
        hi, lo = np.where(up, middle, hi), np.where(up, lo, middle)
    border = 0.5 * (lo + hi)
    near = 1e-12 * most
    return np.where(border > most - near, most, np.where(border < near - most, -most, border))


def deciding_floats(s: Side, phi: Array, x: Array, kappa: Array) -> Array:
    """Evaluate `deciding` in floats; no proof rests on it."""
    a, d, h, rho2, ell = (float(ball.mid()) for ball in (s.a, s.d, s.h, s.rho2, s.ell))
    if s.exact:
        sin, cos = np.sin(phi), np.cos(phi)
        X, H = a * cos - d * sin, a * sin + d * cos
        spin = rho2 + X * (x - kappa * phi) + H * (h + d)
        V = kappa * (ell - H) * (np.sign(X) if s.signed else 1.0)
    else:
        spin = rho2 - a * x + 2.0 * a * a + d * d + d * h
        V = kappa * (ell - d) - 2.0 * a * (x - a)
    size = np.abs(spin) if s.signed else spin
    return np.asarray(spin * size * float(s.over_2m.mid()) - V)


# ----------------------------------------------------------------
# The mean of a function after a throw with even noise, bounded for every start: the arithmetic of one step in
# floats.


OUTERMOST = 1e4  # beyond its nodes a function is constant up to here
PAD = 2.0**-40  # more than the roundings of a place, as a share of the largest place
NARROW = 2.0**-20  # cells below this share of the largest place are not interpolated in,
TOLERANCE = 2.0**-26  # and an interpolated value is off by less than this share of the largest value
INFLATE = 1.0 + 2.0**-30  # against the roundings of the few operations that make a coefficient or add it up
GAUSS = 0.5 * (1.0 - 1.0 / np.sqrt(3.0))


class Mesh(NamedTuple):
    """Nodes of all sides one after another; the first and the last of each side lie far out."""

    place: Array
    first: Array  # number of the first node of each side; at the end the number of all

    def cells(self, side: Array, y: Array) -> Array:
        """Find the cells, by their left nodes, in which places lie."""
        left_nodes = np.empty(len(y), dtype=np.int64)
        for k in range(len(self.first) - 1):
            here = side == k
            row = self.place[self.first[k] : self.first[k + 1]]
            at = np.searchsorted(row, y[here], side="right") - 1
            left_nodes[here] = self.first[k] + np.clip(at, 0, len(row) - 2)
        return left_nodes

    def size(self) -> float:
        """Return the largest place but the far ones."""
        inner = np.ones(len(self.place), dtype=bool)
        inner[self.first[:-1]] = inner[self.first[1:] - 1] = False
        return float(np.abs(self.place[inner]).max()) + 1.0


def extremes(values: Array, first: Array, last: Array) -> tuple[Array, Array]:
    """Return the least and the largest of values[first..last] of each range."""
    level = np.frexp((last - first + 1).astype(np.float64))[1] - 1
    lo, hi = np.empty(len(first)), np.empty(len(first))
    least = most = values
    for k in range(int(level.max(initial=0)) + 1):
        q = np.flatnonzero(level == k)
        end = last[q] - (1 << k) + 1
        lo[q], hi[q] = np.minimum(least[first[q]], least[end]), np.maximum(most[first[q]], most[end])
        least = np.minimum(least[: -(1 << k)], least[1 << k :])
        most = np.maximum(most[: -(1 << k)], most[1 << k :])
    return lo, hi


class Rows(NamedTuple):
    """A sparse matrix with entries >= 0, and how far from exact it may be: times the largest |V|."""

    height: int
    row: Array
    column: Array
    entry: Array
    off: float

    def times(self, values: Array) -> Array:
        """Multiply."""
        return np.bincount(self.row, self.entry * values[self.column], self.height)


class Spread(NamedTuple):
    """Weights spread evenly over a range on a side: of the mean number `row`."""

    row: Array
    weight: Array
    side: Array
    lo: Array
    hi: Array


def mean_rows(count: int, mesh: Mesh, spread: Spread, e: float) -> Rows:
    """Build the matrix from V at nodes to the means over places, each of them scattered evenly within e.

    The density of an even place plus an even scatter rises, is level and falls.  On each of these pieces and each cell
    density times V is quadratic, for which two points of Gauss are exact, with weights >= 0 throughout.
    """
    size, n = mesh.size(), len(mesh.place)
    keys, sums = [], []
    off, longest = np.zeros(count), 0
    order = np.argsort(spread.row, kind="stable")
    for chunk in np.array_split(order, max(1, len(order) // 50_000)):
        part = Spread(*(each[chunk] for each in spread))
        row, column, entry, wrong = spread_over_cells(mesh, part, e, size)
        key, inverse = np.unique(row * n + column, return_inverse=True)
        keys.append(key)
        sums.append(np.bincount(inverse, entry))
        off += np.bincount(part.row, wrong, count)
        longest = max(longest, int(np.bincount(row, minlength=1).max()))
    key, inverse = np.unique(np.concatenate(keys), return_inverse=True)
    entry = np.bincount(inverse, np.concatenate(sums))
    rounding = float(off.max()) + (2 * longest + 64) * 2.0**-52
    return Rows(count, key // n, key % n, entry, rounding)


def spread_over_cells(mesh: Mesh, s: Spread, e: float, size: float) -> tuple[Array, Array, Array, Array]:
    """Share weights out to the nodes: row, node and share, and how far each weight's shares may be off together."""
    length = s.hi - s.lo
    inner = np.minimum(s.hi - e, s.lo + e), np.maximum(s.hi - e, s.lo + e)
    ends = np.stack([s.lo - e, *inner, s.hi + e])
    height = 1.0 / np.maximum(length, 2.0 * e)
    first, last = mesh.cells(s.side, ends[0]), mesh.cells(s.side, ends[3])
    many = last - first + 1
    of = np.repeat(np.arange(len(many)), many)
    cell = np.arange(len(of)) - np.repeat(np.cumsum(many) - many, many) + first[of]
    left, right = mesh.place[cell], mesh.place[cell + 1]
    low, high = np.zeros(len(of)), np.zeros(len(of))  # the shares of the left and the right node
    for piece in range(3):
        begin, end = np.maximum(left, ends[piece][of]), np.minimum(right, ends[piece + 1][of])
        step = np.maximum(end - begin, 0.0)
        for gauss in (GAUSS, 1.0 - GAUSS):
            y = begin + gauss * step
            share = 0.5 * step * height[of] * density_at(piece, y, ends[:, of])
            at = np.clip((y - left) / (right - left), 0.0, 1.0)
            low += share * (1.0 - at)
            high += share * at
    # Each end of a piece, each height of a ramp and each place in a cell is off by a few roundings of a place; a shift
    # by that changes the mass of a piece by the height times it.
    wrong = s.weight * height * many * (128 * 2.0**-52 * size)
    row, weight = s.row[of], s.weight[of]
    both = np.concatenate([low * weight, high * weight])
    return np.concatenate([row, row]), np.concatenate([cell, cell + 1]), both, wrong


def density_at(piece: int, y: Array, ends: Array) -> Array:
    """Return the density of place and scatter as a share of its height: on the rise, on the level, on the fall."""
    if piece == 1:
        return np.ones(len(y))
    a, b = (y - ends[0], ends[1] - ends[0]) if piece == 0 else (ends[3] - y, ends[3] - ends[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(np.clip(a / b, 0.0, 1.0), nan=1.0))


class Stretches(NamedTuple):
    """Ranges of places among bends: the bends outside, and where in the first and the last gap each range ends."""

    first: Array
    last: Array
    begin: Array
    end: Array

    def extremes(self, low: Array, high: Array) -> tuple[Array, Array]:
        """Bound a function from below and above that lies between `low` and `high` at bends, and is affine between."""
        i, j = self.first, self.last - 1
        ends_low = low[i] + self.begin * (low[i + 1] - low[i]), low[j] + self.end * (low[j + 1] - low[j])
        ends_high = (
            high[i] + self.begin * (high[i + 1] - high[i]),
            high[j] + self.end * (high[j + 1] - high[j]),
        )
        lo, hi = np.minimum(*ends_low), np.maximum(*ends_high)
        some = np.flatnonzero(i < j)  # with bends inside
        lo[some] = np.minimum(lo[some], extremes(low, i[some] + 1, j[some])[0])
        hi[some] = np.maximum(hi[some], extremes(high, i[some] + 1, j[some])[1])
        return lo, hi


class Table:
    """Extremes of V, and of V(y + e) - V(y - e), on ranges of places; which places is known once for all V.

    The difference is looked up at all nodes + e and nodes - e, between which it is affine.  One of its two places is a
    node.  The other is interpolated in an ordinary cell, where a few roundings of a place (2^-50) change V by less than
    2 * 2^-50 / NARROW of the largest |V|; near narrow cells the extremes of all nodes nearby count.
    """

    def __init__(self, mesh: Mesh, e: float):
        self.mesh, self.e, self.pad = mesh, e, PAD * mesh.size()
        n, sides = len(mesh.place), len(mesh.first) - 1
        side = np.repeat(np.arange(sides), np.diff(mesh.first))
        at = np.concatenate([mesh.place + e, mesh.place - e])
        order = np.lexsort((at, np.concatenate([side, side])))
        self.where, self.side = at[order], np.concatenate([side, side])[order]
        self.first = 2 * mesh.first
        self.node, self.sign = order % n, np.where(order < n, 1.0, -1.0)
        # at node + e the node is the lower of the two places, at node - e the upper one
        other = mesh.place[self.node] + 2.0 * e * self.sign
        self.begin = mesh.cells(self.side, other - self.pad)
        self.end = mesh.cells(self.side, other + self.pad)
        left, right = mesh.place[self.begin], mesh.place[self.begin + 1]
        self.rough = np.flatnonzero((self.begin != self.end) | (right - left < NARROW * mesh.size()))
        self.share = np.clip((other - left) / (right - left), 0.0, 1.0)

    def rises(self, values: Array) -> tuple[Array, Array]:
        """Bound V(y + e) - V(y - e) at the places where it bends."""
        low = values[self.begin] + self.share * (values[self.begin + 1] - values[self.begin])
        high = low.copy()
        low[self.rough], high[self.rough] = extremes(values, self.begin[self.rough], self.end[self.rough] + 1)
        some = TOLERANCE * float(np.abs(values).max())
        here = values[self.node]
        up = self.sign > 0.0
        return np.where(up, low - here, here - high) - some, np.where(up, high - here, here - low) + some

    def ranges_of_rises(self, side: Array, lo: Array, hi: Array) -> "Stretches":
        """Find the bends between places from lo to hi, and how far these lie between bends."""
        begin, end = np.empty(len(lo), dtype=np.int64), np.empty(len(lo), dtype=np.int64)
        for k in range(len(self.first) - 1):
            here, last = side == k, int(self.first[k + 1] - self.first[k]) - 2
            row = self.where[self.first[k] : self.first[k + 1]]
            for index, y in ((begin, lo - self.pad), (end, hi + self.pad)):
                at = np.searchsorted(row, y[here], side="right") - 1
                index[here] = self.first[k] + np.clip(at, 0, last)
        shares = []
        for at, y in ((begin, lo), (end, hi)):
            gap = self.where[at + 1] - self.where[at]
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.clip((y - self.where[at]) / gap, 0.0, 1.0)
            # between bends close together the one that lies outward
            outer = np.zeros(len(y)) if at is begin else np.ones(len(y))
            shares.append(np.where(gap < NARROW * self.mesh.size(), outer, share))
        return Stretches(begin, end + 1, shares[0], shares[1])

    def ranges_of_values(self, side: Array, lo: Array, hi: Array) -> tuple[Array, Array]:
        """Find the nodes that surround places that are scattered, from lo to hi before that."""
        reach = self.e + self.pad
        return self.mesh.cells(side, lo - reach), self.mesh.cells(side, hi + reach) + 1
