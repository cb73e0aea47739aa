"""Where throws from places land and whether they flip, and how that changes with place and speed, with proved bounds.

The impact angle p of a start x solves x = P(p), P(p) = kappa p / 2 + S(p); the part comes to rest at x + D(p), less
the shift of a flip (`proofs/prover/two_throws.py`).  With kappa above the vertex's distance from the centre of mass P
grows and has one solution.  The speed w (1 + delta) has kappa = kappa_0 / (1 + delta)^2.  At points a solution is
proposed by Newton's method, and the change of sign of P - x around it proves it; derivatives are enclosed over boxes
of angles and speeds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.thrower import Exact, SmallAngle2
from limitsets.proofs.prover.numbers import Intervals, Jet
from limitsets.proofs.prover.two_throws import Formulas, OneSide as Part, ThrowNumbers, angle, variable

# ----------------------------------------------------------------
# Moments of sine and cosine: what the flight's formulas depend on, without cancellation and with a bound.
#
#     c_k(p) = int_0^1 t^k cos(p t) dt,      s_k(p) = int_0^1 t^k sin(p t) dt,
#
# so that sin p = p c_0, 1 - cos p = p s_0, and c_k' = -s_(k+1), s_k' = c_(k+1), none above 1/(k + 2) in size.


# The first term left out is below 1e-22 for p <= 2 pi.
TERMS = 25
# The terms of a sum add up to less than e^p <= 536; Horner's rule loses fewer than 4 TERMS half units of it.
ERROR = 1e-11

_COS = [[(-1) ** j / (math.factorial(2 * j) * (2 * j + k + 1)) for j in range(TERMS)] for k in range(3)]
_SIN = [[(-1) ** j / (math.factorial(2 * j + 1) * (2 * j + k + 2)) for j in range(TERMS)] for k in range(3)]


class Moments(NamedTuple):
    """c_0, c_1, c_2 and s_0, s_1, s_2 at some angles, each within `ERROR`."""

    c: tuple[Array, Array, Array]
    s: tuple[Array, Array, Array]


def _horner(coefficients: list[float], q: Array) -> Array:
    total = np.full(q.shape, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        total *= q
        total += coefficient
    return total


def moments(phi: Array, most: int = 2) -> Moments:
    """Evaluate the moments at angles from 0 to 2 pi, up to k = `most`; nan beyond."""
    q = phi * phi
    count = range(most + 1)
    return Moments(
        tuple(_horner(_COS[k], q) for k in count),  # type: ignore[arg-type]  # as many as asked for
        tuple(phi * _horner(_SIN[k], q) for k in count),  # type: ignore[arg-type]  # likewise
    )


# ----------------------------------------------------------------
# Where throws from places land, and how that changes with place and speed, with proved bounds.


NEWTON = 12
# Roundings of a sum of a few terms, relative to their sizes.
ROUNDED = 2.0**-47


@dataclass(frozen=True)
class OneSide:
    """A side's numbers: middles, with how far each may be off in `slack`; of one parameter box.

    Attributes
    ----------
    number, after : int
        The side, and the one after a flip.
    a, d, h, kappa, shift : float
        See `thrower.params.Side`; kappa of a throw without deviation.
    spans : dict of str to (float, float)
        Enclosures of all that the decision depends on: a, d, h, kappa, rho, shift.
    slack : float
        The widest of them.
    flight, flip : NamedTuple
        The models.
    """

    number: int
    after: int
    a: float
    d: float
    h: float
    kappa: float
    shift: float
    spans: dict[str, tuple[float, float]]
    slack: float
    flight: Any
    flip: Any


class Landed(NamedTuple):
    """Impact angles and landing places of jogs, each within its error; `good` where that is proved."""

    phi: Array
    phi_error: Array
    place: Array
    error: Array
    good: Mask


class Derivatives(NamedTuple):
    """Enclosures over boxes: derivatives of the landing place T by x and delta, and of the angle by x and kappa."""

    x: Intervals
    delta: Intervals
    x_x: Intervals
    x_delta: Intervals
    delta_delta: Intervals
    phi_x: Intervals
    phi_kappa: Intervals


def one_side(lo: Any, hi: Any, number: int) -> OneSide:
    """Gather a side's numbers from the corners of the parameters."""
    after = (number + 1) % lo.a.size
    spans = {
        "a": (lo.a[number], hi.a[number]),
        "d": (lo.d[number], hi.d[number]),
        "h": (lo.surface_height, hi.surface_height),
        "kappa": (lo.kappa, hi.kappa),
        "rho": (lo.radius_of_gyration, hi.radius_of_gyration),
        "a_next": (lo.a[after], hi.a[after]),
        "length": (lo.length[after], hi.length[after]),
    }
    low = lo.a[number] + lo.length[after] - hi.a[after]
    high = hi.a[number] + hi.length[after] - lo.a[after]
    spans["shift"] = (low - ROUNDED * abs(low), high + ROUNDED * abs(high))
    middle = {name: 0.5 * (ends[0] + ends[1]) for name, ends in spans.items()}
    slack = max(ends[1] - ends[0] for ends in spans.values())
    a, d, h, kappa, shift = (float(middle[name]) for name in ("a", "d", "h", "kappa", "shift"))
    return OneSide(
        number,
        after,
        a,
        d=d,
        h=h,
        kappa=kappa,
        shift=shift,
        spans=spans,
        slack=float(slack),
        flight=lo.flight,
        flip=lo.flip,
    )


def kappa_of(side: OneSide, delta: Array) -> Array:
    """Return kappa of throws whose speed deviates."""
    factor = 1.0 + delta
    return side.kappa / (factor * factor)


def _start(side: OneSide, kappa: Array, phi: Array) -> tuple[Array, Array]:
    """P and its derivative."""
    if isinstance(side.flight, Exact):
        m = moments(phi, 1)
        along = side.a * m.c[0] - side.d * m.s[0]
        return 0.5 * kappa * phi + along, 0.5 * kappa - side.a * m.s[1] - side.d * m.c[1]
    pull = kappa - side.d if isinstance(side.flight, SmallAngle2) else kappa
    return side.a + 0.5 * pull * phi, 0.5 * pull


def _jog(side: OneSide, phi: Array) -> Array:
    if not isinstance(side.flight, Exact):
        return -side.h * phi
    m = moments(phi, 0)
    return phi * (side.a * m.s[0] - side.d * (1.0 - m.c[0]) - side.h)


def landed(side: OneSide, x: Array, delta: Array) -> Landed:
    """Throw from places on a side with deviations of the speed; both of one shape."""
    kappa = kappa_of(side, delta)
    phi = 2.0 * (x - side.a) / (kappa - side.d)
    for _ in range(NEWTON):
        at, slope = _start(side, kappa, phi)
        phi = np.clip(phi - (at - x) / slope, 0.0, 2.0 * math.pi)
    at, slope = _start(side, kappa, phi)
    size = side.a + side.d
    # The parameters: a and d enter P with factors up to 1, kappa with phi/2; a, d, h enter D with up to 2 phi.
    known = 2.0 * size * ERROR + ROUNDED * (np.abs(x) + kappa * phi + size) + (2.0 + phi) * side.slack
    # P'' is below (a + d)/3: within 0.01 of phi P' is within a hundredth of it.
    steep = 0.99 * slope - 0.01 * size
    phi_error = (np.abs(at - x) + known) / steep
    rate = side.a + 2.0 * side.d + abs(side.h)
    place = x + _jog(side, phi)
    error = (
        rate * phi_error + 2.0 * phi * (size * ERROR + 2.0 * side.slack) + ROUNDED * (np.abs(x) + phi * rate)
    )
    # The shift of a flip is known to its slack.
    error = error + 3.0 * side.slack + ROUNDED * side.shift
    good = (steep > 0.0) & (phi_error < 0.01) & (phi > phi_error) & (phi + phi_error <= 2.0 * math.pi)
    return Landed(phi, phi_error, place, error, good)


def _ball(middle: Array, radius: Array) -> Intervals:
    return Intervals(middle - radius, middle + radius)


def slopes(side: OneSide, phi: Intervals, delta: Intervals) -> Derivatives:
    """Enclose the derivatives over boxes of impact angles and deviations of the speed."""
    middle, half = 0.5 * (phi.lo + phi.hi), 0.51 * (phi.hi - phi.lo)
    a, d, h, kappa_0 = (Intervals.of(*side.spans[name]) for name in ("a", "d", "h", "kappa"))
    factor = 1.0 + delta
    kappa = kappa_0 / (factor * factor)
    if isinstance(side.flight, Exact):
        m = moments(middle)
        # S' = -a s_1 - d c_1, S'' = -a c_2 + d s_2; c_k and s_k change by less than phi / (k + 2).
        c1, s1 = (_ball(f, half / 3.0 + ERROR) for f in (m.c[1], m.s[1]))
        c2, s2 = (_ball(f, half / 4.0 + ERROR) for f in (m.c[2], m.s[2]))
        bend, p_slope = d * s2 - a * c2, 0.5 * kappa - a * s1 - d * c1
        sine = _ball(middle * m.c[0], half + 7.0 * ERROR)
        versin = _ball(middle * m.s[0], half + 7.0 * ERROR)
        rate, turn = a * sine - d * versin - h, a * (1.0 - versin) - d * sine
    else:
        pull = kappa - d if isinstance(side.flight, SmallAngle2) else kappa
        none = Intervals(np.zeros(middle.shape), np.zeros(middle.shape))
        bend, p_slope, rate, turn = none, 0.5 * pull + none, none - h, none
    one = 1.0 / p_slope
    phi_kappa = -0.5 * (phi * one)
    # Derivatives of 1/P' and -phi/(2 P') along x and kappa; P' changes by P'' with phi and by 1/2 with kappa.
    square = one * one
    mixed = bend * phi_kappa + 0.5
    phi_xx, phi_xk = -(bend * square * one), -(mixed * square)
    phi_kk = 0.5 * (phi * square * mixed) - 0.5 * (phi_kappa * one)
    by_kappa = rate * phi_kappa
    first, second = -2.0 * (kappa / factor), 6.0 * (kappa / (factor * factor))
    x_kappa = turn * one * phi_kappa + rate * phi_xk
    kappa_kappa = turn * phi_kappa * phi_kappa + rate * phi_kk
    return Derivatives(
        1.0 + rate * one,
        by_kappa * first,
        turn * square + rate * phi_xx,
        x_delta=x_kappa * first,
        delta_delta=kappa_kappa * first * first + by_kappa * second,
        phi_x=one,
        phi_kappa=phi_kappa,
    )


# ----------------------------------------------------------------
# Where throws flip: decided on whole cells, or by the speed, with a bound on the border between.
#
# F(x, delta) > 0 where a part flips.  On a cell where F has both signs, and grows or falls with delta throughout, the
# border delta*(x) is compared with a chord between two proposed numbers g at the nodes: along x -> g(x) the change of F
# is enclosed by its derivative, so that delta* is within
#
#     beta = (|F(x_k, g_k)| + h/2 |F_x + g' F_delta|) / min |F_delta|
#
# of it.  Elsewhere the border may be anywhere.


# For all cells: certain flips, certain jogs, how far the border is open, and the branches below and above the border.
_Cells = tuple[Mask, Mask, Array, Mask, Mask]

BISECTIONS = 48
# Places at which critical points are looked for.
SAMPLES = 4096


class Piece(NamedTuple):
    """Deviations of the speed from `first` to `last`, and the impact angles from every cell with these."""

    first: float
    last: float
    phi: Intervals

    @property
    def delta(self) -> Intervals:
        """The deviations, for every cell."""
        return Intervals(np.full(self.phi.lo.shape, self.first), np.full(self.phi.lo.shape, self.last))


class Decided(NamedTuple):
    """The branches of throws from nodes x_k of a side and from the cells between them.

    Attributes
    ----------
    cut : ndarray, shape (n,)
        Deviation of the speed, within the law's bounds, at which the branch changes.
    below, above : ndarray of bool, shape (n,)
        Whether a throw flips there with smaller, and with larger deviations.
    cell_below, cell_above : ndarray of bool, shape (n - 1,)
        The same for the cells.
    beta : ndarray, shape (n - 1,)
        How far from the chord of `cut` the branch may change.
    """

    cut: Array
    below: Mask
    above: Mask
    cell_below: Mask
    cell_above: Mask
    beta: Array


def _numbers(side: OneSide, kappa: Intervals | Jet) -> tuple[ThrowNumbers, Part]:
    a, d, h, rho, shift = (Intervals.of(*side.spans[name]) for name in ("a", "d", "h", "rho", "shift"))
    part = Part(a, d, shift)
    return ThrowNumbers([part], rho, kappa, h), part


def margin(
    side: OneSide, x: Intervals, phi: Intervals, delta: Intervals, steep: bool = False
) -> tuple[Intervals, Intervals, Intervals]:
    """Enclose F over boxes and, where `steep`, its derivatives by x and delta."""
    factor = 1.0 + delta
    kappa = Intervals.of(*side.spans["kappa"]) / (factor * factor)
    formulas = Formulas(side.flight, side.flip)
    if not steep:
        n, part = _numbers(side, kappa)
        enclosure = formulas.margin(n, part, angle(phi), x)
        return enclosure, enclosure, enclosure
    n, part = _numbers(side, variable(kappa, 1, 3))
    enclosure = formulas.margin(n, part, angle(variable(phi, 0, 3)), variable(x, 2, 3))
    by_phi, by_kappa, by_x = enclosure.derivatives
    along = slopes(side, phi, delta)
    by_delta = (by_kappa + by_phi * along.phi_kappa) * (-2.0 * (kappa / factor))
    return enclosure.value, by_x + by_phi * along.phi_x, by_delta


def _at(side: OneSide, x: Array, delta: Array) -> Intervals:
    """Enclose F at points."""
    hit = landed(side, x, delta)
    phi = Intervals(np.maximum(hit.phi - hit.phi_error, 0.0), hit.phi + hit.phi_error)
    return margin(side, Intervals(x, x), phi, Intervals(delta, delta))[0]


def _bisected(side: OneSide, x: Array, lo: Array, hi: Array, rising: Mask) -> Array:
    """Propose the deviation at which F changes its sign between two; one of these two where it keeps its sign."""
    lo, hi = lo.copy(), hi.copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (lo + hi)
        f = _at(side, x, middle)
        up = (f.lo + f.hi > 0.0) == rising
        hi, lo = np.where(up, middle, hi), np.where(up, lo, middle)
    return 0.5 * (lo + hi)


def hull(some: Iterable[Intervals]) -> Intervals:
    """Give the least intervals that hold all of the given ones."""
    lo, hi = zip(*((each.lo, each.hi) for each in some), strict=True)
    return Intervals(np.minimum.reduce(lo), np.maximum.reduce(hi))


def decided(side: OneSide, x: Array, pieces: Sequence[Piece]) -> Decided:
    """Decide between jog and flip, on the cells between nodes, for all deviations of a law.

    Parameters
    ----------
    side : OneSide
        The side.
    x : ndarray, shape (n,)
        Nodes; the decision at them is proved by the cells that they bound.
    pieces : sequence of Piece
        The deviations of the speed in ascending pieces, and the impact angles from every cell with these.
    """
    first, last = bounds = pieces[0].first, pieces[-1].last
    n = x.size
    middle = _at(side, x, np.full(n, 0.5 * (first + last)))
    flips = middle.lo + middle.hi > 0.0
    cut, below, above = np.full(n, last), flips.copy(), flips.copy()
    box = Intervals(x[:-1], x[1:])
    margins = hull(margin(side, box, each.phi, each.delta)[0] for each in pieces)
    yes, no = margins.lo > 0.0, margins.hi <= 0.0
    anywhere = last - first if last > first else 1.0
    beta = np.where(yes | no, 0.0, anywhere)
    cell_below, cell_above = yes.copy(), yes.copy()
    open_ = np.flatnonzero(~(yes | no))
    if open_.size:
        steep = [margin(side, box[open_], each.phi[open_], each.delta[open_], steep=True) for each in pieces]
        by_x, by_delta = (hull(each[k] for each in steep) for k in (1, 2))
        rising, falling = by_delta.lo > 0.0, by_delta.hi < 0.0
        _by_corners(
            side,
            x,
            open_,
            by_x=by_x,
            rising=rising,
            falling=falling,
            bounds=bounds,
            cells=(yes, no, beta, cell_below, cell_above),
        )
        if last > first:
            _by_border(
                side,
                x,
                open_,
                by_x=by_x,
                by_delta=by_delta,
                bounds=bounds,
                nodes=(cut, below, above),
                cells=(yes, no, beta, cell_below, cell_above),
            )
        else:
            cell_below[open_] |= flips[open_] & ~no[open_]
            cell_above[open_] = cell_below[open_]
    return Decided(cut, below, above, cell_below, cell_above, beta)


def _by_corners(
    side: OneSide,
    x: Array,
    open_: Ints,
    by_x: Intervals,
    rising: Mask,
    falling: Mask,
    bounds: tuple[float, float],
    cells: _Cells,
) -> None:
    """Where F is monotone in both, the sign at two corners decides."""
    yes, no, beta, cell_below, cell_above = cells
    up, down = by_x.lo > 0.0, by_x.hi < 0.0
    still = bounds[0] == bounds[1]
    known = np.flatnonzero((up | down) & (rising | falling | still))
    cell = open_[known]
    left, right = x[cell], x[cell + 1]
    least_x, most_x = np.where(up[known], left, right), np.where(up[known], right, left)
    least_d = np.where(rising[known], *bounds)
    most_d = np.where(rising[known], bounds[1], bounds[0])
    flips, jogs = _at(side, least_x, least_d).lo > 0.0, _at(side, most_x, most_d).hi <= 0.0
    yes[cell] |= flips
    no[cell] |= jogs
    sure = cell[flips | jogs]
    beta[sure] = 0.0
    cell_below[cell] |= flips
    cell_above[cell] |= flips


def _by_border(
    side: OneSide,
    x: Array,
    open_: Ints,
    by_x: Intervals,
    by_delta: Intervals,
    bounds: tuple[float, float],
    nodes: tuple[Array, Mask, Mask],
    cells: _Cells,
) -> None:
    """Cut the cells at a chord, and bound how far the border may be from it."""
    cut, below, above = nodes
    yes, no, beta, cell_below, cell_above = cells
    ends = np.unique(np.concatenate([open_, open_ + 1]))
    rises = np.zeros(x.size, dtype=bool)
    grows = by_delta.lo + by_delta.hi > 0.0
    rises[open_ + 1] = grows
    rises[open_] = grows
    size = ends.size
    cut[ends] = _bisected(side, x[ends], np.full(size, bounds[0]), np.full(size, bounds[1]), rises[ends])
    tiny = 1e-13 * (bounds[1] - bounds[0])
    cut[ends] = np.where(cut[ends] - bounds[0] < tiny, bounds[0], cut[ends])
    cut[ends] = np.where(bounds[1] - cut[ends] < tiny, bounds[1], cut[ends])
    below[ends], above[ends] = ~rises[ends], rises[ends]
    left = np.flatnonzero(~(yes[open_] | no[open_]))
    cell = open_[left]
    cell_below[cell], cell_above[cell] = ~grows[left], grows[left]
    h = x[cell + 1] - x[cell]
    slope = (cut[cell + 1] - cut[cell]) / h
    off = np.maximum(*(_at(side, x[k], cut[k]).absolute().hi for k in (cell, cell + 1)))
    far = _distance(by_x[left], by_delta[left], slope, off, h)
    good = far < bounds[1] - bounds[0]
    # Once more, with the derivatives near the chord alone.
    near = np.flatnonzero(good)
    at, reach = cell[near], far[near]
    ends_of = cut[at], cut[at + 1]
    least = np.maximum(np.minimum(*ends_of) - reach, bounds[0])
    most = np.minimum(np.maximum(*ends_of) + reach, bounds[1])
    first, last = landed(side, x[at], least), landed(side, x[at + 1], most)
    angles = Intervals(np.maximum(first.phi - first.phi_error, 0.0), last.phi + last.phi_error)
    _, along, across = margin(side, Intervals(x[at], x[at + 1]), angles, Intervals(least, most), steep=True)
    again = _distance(along, across, slope[near], off[near], h[near])
    far[near] = np.minimum(reach, np.where(first.good & last.good, again, np.inf))
    # As far as the next rounding of the chord itself.
    beta[cell] = np.where(good, far * (1.0 + 1e-9) + 1e-15, bounds[1] - bounds[0])


def crossings(side: OneSide, lo: float, hi: float, delta: float) -> list[float]:
    """Propose the places between two at which throws with a deviation of the speed change between jog and flip."""
    x = np.linspace(lo, hi, SAMPLES)
    flips = _flips(side, x, delta)
    at = np.flatnonzero(flips[1:] != flips[:-1])
    low, high, first = x[at], x[at + 1], flips[at]
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        same = _flips(side, middle, delta) == first
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return [float(each) for each in 0.5 * (low + high)]


def _flips(side: OneSide, x: Array, delta: float) -> Mask:
    f = _at(side, x, np.full(x.shape, delta))
    return f.lo + f.hi > 0.0


def _distance(by_x: Intervals, by_delta: Intervals, slope: Array, off: Array, h: Array) -> Array:
    """Bound how far the border is from a chord along which F is `off` at the nodes; infinite where F_delta may be 0."""
    along = (by_x + Intervals(slope, slope) * by_delta).absolute().hi
    steep = by_delta.absolute().lo
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (off + 0.5 * h * along) / steep
    return np.where(steep > 0.0, far, np.inf)
