"""Where throws flip: decided on whole cells, or by the speed, with a bound on the border between.

F(x, delta) > 0 where a part flips.  On a cell where F has both signs, and grows or falls with delta throughout, the
border delta*(x) is compared with a chord between two proposed numbers g at the nodes: along x -> g(x) the change of F
is enclosed by its derivative, so that delta* is within

    beta = (|F(x_k, g_k)| + h/2 |F_x + g' F_delta|) / min |F_delta|

of it.  Elsewhere the border may be anywhere.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.proofs.by_angle import Formulas, ThrowNumbers, angle, variable
from limitsets.proofs.by_angle import OneSide as Part
from limitsets.proofs.intervals import Intervals
from limitsets.proofs.mean_value import Jet
from limitsets.robust.brackets.landings import OneSide, landed, slopes

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]
# Of all cells: surely flips, surely jogs, what is open, and the branches below and above the border.
_Cells = tuple[Flags, Flags, Array, Flags, Flags]

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
    """Of nodes x_k of a side and the cells between them.

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
    below: NDArray[np.bool_]
    above: NDArray[np.bool_]
    cell_below: NDArray[np.bool_]
    cell_above: NDArray[np.bool_]
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
        found = formulas.margin(n, part, angle(phi), x)
        return found, found, found
    n, part = _numbers(side, variable(kappa, 1, 3))
    found = formulas.margin(n, part, angle(variable(phi, 0, 3)), variable(x, 2, 3))
    by_phi, by_kappa, by_x = found.derivatives
    along = slopes(side, phi, delta)
    by_delta = (by_kappa + by_phi * along.phi_kappa) * (-2.0 * (kappa / factor))
    return found.value, by_x + by_phi * along.phi_x, by_delta


def _at(side: OneSide, x: Array, delta: Array) -> Intervals:
    """Enclose F at points."""
    hit = landed(side, x, delta)
    phi = Intervals(np.maximum(hit.phi - hit.phi_error, 0.0), hit.phi + hit.phi_error)
    return margin(side, Intervals(x, x), phi, Intervals(delta, delta))[0]


def _bisected(side: OneSide, x: Array, lo: Array, hi: Array, rising: NDArray[np.bool_]) -> Array:
    """Propose where F changes its sign between two deviations; an end where it does not."""
    lo, hi = lo.copy(), hi.copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (lo + hi)
        f = _at(side, x, middle)
        up = (f.lo + f.hi > 0.0) == rising
        hi, lo = np.where(up, middle, hi), np.where(up, lo, middle)
    return 0.5 * (lo + hi)


def hull(some: Iterable[Intervals]) -> Intervals:
    """Give the least intervals that hold all of these."""
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
    found = hull(margin(side, box, each.phi, each.delta)[0] for each in pieces)
    yes, no = found.lo > 0.0, found.hi <= 0.0
    anywhere = last - first if last > first else 1.0
    beta = np.where(yes | no, 0.0, anywhere)
    cell_below, cell_above = yes.copy(), yes.copy()
    open_ = np.flatnonzero(~(yes | no))
    if open_.size:
        steep = [margin(side, box[open_], each.phi[open_], each.delta[open_], steep=True) for each in pieces]
        by_x, by_delta = (hull(each[k] for each in steep) for k in (1, 2))
        rising, falling = by_delta.lo > 0.0, by_delta.hi < 0.0
        _by_corners(side, x, open_, by_x, rising, falling, bounds, (yes, no, beta, cell_below, cell_above))
        if last > first:
            _by_border(
                side,
                x,
                open_,
                by_x,
                by_delta,
                bounds,
                (cut, below, above),
                (yes, no, beta, cell_below, cell_above),
            )
        else:
            cell_below[open_] |= flips[open_] & ~no[open_]
            cell_above[open_] = cell_below[open_]
    return Decided(cut, below, above, cell_below, cell_above, beta)


def _by_corners(
    side: OneSide,
    x: Array,
    open_: Index,
    by_x: Intervals,
    rising: Flags,
    falling: Flags,
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
    open_: Index,
    by_x: Intervals,
    by_delta: Intervals,
    bounds: tuple[float, float],
    nodes: tuple[Array, Flags, Flags],
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


def _flips(side: OneSide, x: Array, delta: float) -> NDArray[np.bool_]:
    f = _at(side, x, np.full(x.shape, delta))
    return f.lo + f.hi > 0.0


def _distance(by_x: Intervals, by_delta: Intervals, slope: Array, off: Array, h: Array) -> Array:
    """Bound how far the border is from a chord along which F is `off` at the nodes; infinite where F_delta may be 0."""
    along = (by_x + Intervals(slope, slope) * by_delta).absolute().hi
    steep = by_delta.absolute().lo
    with np.errstate(divide="ignore", invalid="ignore"):
        far = (off + 0.5 * h * along) / steep
    return np.where(steep > 0.0, far, np.inf)
