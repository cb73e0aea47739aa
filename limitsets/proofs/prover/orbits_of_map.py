"""Periodic orbits of any map, proved by Newton's operator for all points of an orbit at once.

For the points x_0 .. x_p-1 of an orbit along an itinerary, F_k = f(x_k) - x_k+1 and boxes X_k around them,
K(X) = m - C F(m) + (1 - C DF(X)) (X - m) lies in the interior of X.  Then F has one root in X, whatever the matrix C,
and it is no multiple one (Krawczyk; Neumaier, "Interval Methods for Systems of Equations", 1990, section 5.1).  All
points at once, and not the first one under f^p: so images of a box of parameters do not grow along the orbit.  On X
every branch is proved to be taken.

The functions take many orbits of one period, shape (n, p, d), so that a search for all of them is one computation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.base.arrays import Array, Ints
from limitsets.proofs.prover.certificate_of_map import widened
from limitsets.proofs.prover.converging import Ball, Entries, entries, times
from limitsets.proofs.prover.numbers import Intervals
from limitsets.proofs.prover.programs import names_alone
from limitsets.systems.maps.derived import SURE, UNKNOWN, branch_boxes
from limitsets.systems.sets import Cycle

Corners: TypeAlias = tuple[Any, Any]  # of the parameters
Lies: TypeAlias = Callable[
    [Array, Array, Ints], bool
]  # whether boxes (p, d), by side, lie where orbits are asked for

# X is K(X) of the step before and so much more of its width, until it holds its own; relative to the point at first.
MORE, FIRST, TRIES = 0.125, 2.0**-40, 24

# Of a box, between its ends and K(X): the balls of the checker are wider than our boxes.
ROOM = 2.0**-20

OPEN = -1  # a side or a branch that is not known yet


@dataclass(frozen=True, eq=False)
class CycleOfMap:
    """A periodic orbit that is proved to exist, alone in its boxes.

    Attributes
    ----------
    lo, hi : ndarray, shape (p, d)
        Boxes of its points in the order of the steps; the first is the one in which it is alone.
    side, branches : ndarray of int, shape (p,)
        The side of each point, and the branch taken from it.
    slope_lo, slope_hi : ndarray, shape (d, d)
        Enclosure of the derivative of F^p.
    attracts : bool or None
        Whether every eigenvalue of it is below 1 in modulus; False where one is above 1, the orbit being unstable; None
        where that is open.
    ball : Ball or None
        Balls around its points that the map contracts, if "converges" was asked for.
    turns : ndarray of int, shape (p, d), or None
        Where axes close: the periods that are taken off the image of each point, so that it is the next one.
    """

    lo: Array
    hi: Array
    side: Ints
    branches: Ints
    slope_lo: Array
    slope_hi: Array
    attracts: bool | None
    ball: Ball | None = None
    turns: Ints | None = None

    @property
    def period(self) -> int:
        """p, the smallest one."""
        return int(self.side.size)

    @property
    def kind(self) -> str:
        """Whether it is attracting or unstable; empty where that is open."""
        return {True: "attracting", False: "unstable", None: ""}[self.attracts]


class Turns(NamedTuple):
    """How many periods are taken off the image of each point of an orbit, and the period there, shape (p, d)."""

    number: Ints
    period: Array

    @classmethod
    def of(cls, image: Intervals, ahead: Array, period: Array) -> Turns:
        """Choose whole numbers by which images, shape (1, p, d), come near the points ahead, shape (p, d)."""
        gap = 0.5 * (image.lo[0] + image.hi[0]) - ahead
        return cls(np.round(gap / np.where(period > 0.0, period, np.inf)).astype(np.int64), period)

    def gaps(self, image: Intervals, ahead: Array) -> Intervals:
        """Return F, from images that are not turned and the points ahead."""
        gap = image - exactly(ahead[None])
        if not self.number.any():
            return gap
        # a period is written as a decimal, or as 2 pi, which lies beside its double
        beside = Intervals(np.nextafter(self.period, -np.inf), np.nextafter(self.period, np.inf))
        return gap - exactly(self.number[None].astype(np.float64)) * beside


class Steps(NamedTuple):
    """One step from each of many boxes, shape (..., d).

    Attributes
    ----------
    image, slope : Intervals, shape (..., d) and (..., d, d)
        Infinite, and nan, where the branch is open or nothing is proved.
    state : ndarray of int8, shape (...)
        Whether the branch is taken: `SURE`, `NEVER`, `MAYBE`, or `UNKNOWN`.
    to : ndarray of int, shape (...)
        The side that the branch leads to.
    """

    image: Intervals
    slope: Intervals
    state: NDArray[np.int8]
    to: Ints


def stepped(corners: Corners, boxes: Intervals, side: Ints, branch: Ints) -> Steps:
    """Enclose images and slopes of boxes (..., d), each on its side and branch (...)."""
    d = boxes.lo.shape[-1]
    lo, hi = boxes.lo.reshape(-1, d), boxes.hi.reshape(-1, d)
    image, slope = np.full((2, *lo.shape), np.inf), np.full((2, *lo.shape, d), np.nan)
    image[0] = -np.inf
    state, to = np.full(len(lo), UNKNOWN, np.int8), np.full(len(lo), OPEN)
    flat_side, flat_branch = np.broadcast_to(side, branch.shape).ravel(), branch.ravel()
    for s, b in np.unique(np.stack([flat_side, flat_branch]), axis=1).T.tolist():
        if OPEN in (s, b):
            continue
        here = np.flatnonzero((flat_side == s) & (flat_branch == b))
        each = branch_boxes(*corners, s, b, lo[here], hi[here])
        state[here], to[here], sound = each.state, each.side, each.state != UNKNOWN
        if names_alone(corners[0]):
            state[here[sound]] = SURE
        image[:, here[sound]] = each.lo[sound], each.hi[sound]
        slope[:, here[sound]] = each.slope_lo[sound], each.slope_hi[sound]
    shape = branch.shape
    return Steps(
        Intervals(*image.reshape(2, *shape, d)),
        Intervals(*slope.reshape(2, *shape, d, d)),
        state.reshape(shape),
        to.reshape(shape),
    )


def exactly(x: Array) -> Intervals:
    """Return the intervals of single numbers."""
    return Intervals(x, x)


def total(terms: Intervals) -> Intervals:
    """Add along the last axis."""
    return reduce(add, map(Intervals, np.moveaxis(terms.lo, -1, 0), np.moveaxis(terms.hi, -1, 0)))


def inverse(slope: Intervals) -> Array:
    """Invert DF of each orbit in floats, shape (n, p d, p d); nan, which proves nothing, where it is singular."""
    n, p, d = slope.lo.shape[:3]
    derivative = np.zeros((n, p, d, p, d))
    for k in range(p):
        derivative[:, k, :, k] += 0.5 * (slope.lo[:, k] + slope.hi[:, k])
        derivative[:, k, :, (k + 1) % p] -= np.eye(d)
    matrices = derivative.reshape(n, p * d, p * d)
    sound = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    sound[sound] = np.linalg.slogdet(matrices[sound])[0] != 0.0
    inverted = np.full_like(matrices, np.nan)
    inverted[sound] = np.linalg.inv(matrices[sound])
    return inverted


def krawczyk(middle: Array, c: Array, off: Intervals, slope: Intervals, wide: Intervals) -> Intervals:
    """K(X), shape (n, p, d), from F at the middles, the slopes on X, and X less the middles."""
    n, p, d = middle.shape
    of_points = c.reshape(n, p * d, p, d)
    turned = Intervals(slope.lo.swapaxes(2, 3)[:, None], slope.hi.swapaxes(2, 3)[:, None])
    product = total(exactly(of_points[..., None, :]) * turned) - exactly(np.roll(of_points, 1, axis=2))
    rest = exactly(np.eye(p * d).reshape(p * d, p, d)) - product
    newton = total(total(exactly(of_points) * Intervals(off.lo[:, None], off.hi[:, None])))
    spread = total(total(rest * Intervals(wide.lo[:, None], wide.hi[:, None])))
    moved = exactly(middle.reshape(n, -1)) - newton + spread
    return Intervals(moved.lo.reshape(n, p, d), moved.hi.reshape(n, p, d))


# ---------------------------------------------------------------- one orbit


def _sure_steps(
    corners: Corners, lo: Array, hi: Array, cycle: Cycle | CycleOfMap
) -> tuple[Intervals, Intervals] | str:
    """Enclose images (1, p, d) and slopes (1, p, d, d) of boxes around an orbit; or say what is missing."""
    steps = stepped(corners, Intervals(lo[None], hi[None]), cycle.side[None], cycle.branches[None])
    state = steps.state[0]
    if (state == UNKNOWN).any():
        return "its images are not bounded on the boxes that are tried"
    if (state != SURE).any():
        return f"the branch of point {np.argmax(state != SURE)} is not proved"
    if (steps.to[0] != np.roll(cycle.side, -1)).any():
        return "it ends on another side"
    return steps.image, steps.slope


def slopes_on(corners: Corners, lo: Array, hi: Array, cycle: Cycle | CycleOfMap) -> Intervals | None:
    """Enclose the derivatives (p, d, d) on boxes around an orbit; None where its branches are not proved there."""
    steps = _sure_steps(corners, lo, hi, cycle)
    return None if isinstance(steps, str) else Intervals(steps[1].lo[0], steps[1].hi[0])


def slopes_of(corners: Corners, cycle: CycleOfMap) -> Array:
    """Return the derivatives of the steps of a proved orbit, in the middles of their enclosures, shape (p, d, d)."""
    slopes = slopes_on(corners, cycle.lo, cycle.hi, cycle)
    assert slopes is not None  # it was proved on these boxes
    return np.asarray(0.5 * (slopes.lo + slopes.hi))


def _ends(a: Entries) -> tuple[Array, Array]:
    lo, hi = (np.array([[getattr(entry, end)[0] for entry in row] for row in a]) for end in ("lo", "hi"))
    return lo, hi


def _determinant(a: Entries) -> Intervals:
    """Enclose a determinant, by its first row."""
    minors = ([[*row[:j], *row[j + 1 :]] for row in a[1:]] for j in range(len(a)))
    terms = [
        v * _determinant(minor) * (-1.0) ** j if minor else v
        for j, (v, minor) in enumerate(zip(a[0], minors, strict=True))
    ]
    return reduce(add, terms)


def _unstable(slope: Entries) -> bool:
    """Whether each of some matrices M has an eigenvalue beyond the unit circle, by its size or as a real one.

    |det M| > 1; or det(1 - M) < 0, and so a real one above 1: det(s - M) > 0 for large s; or det(1 + M) < 0 and so a
    real one below -1.
    """
    rows, size = range(len(slope)), _determinant(slope).absolute()
    above, below = (
        _determinant([[slope[i][j] * sign + float(i == j) for j in rows] for i in rows])
        for sign in (-1.0, 1.0)
    )
    return bool(size.lo[0] > 1.0 or above.hi[0] < 0.0 or below.hi[0] < 0.0)


def _attracts(slope: Entries) -> bool | None:
    """Whether every eigenvalue lies in the unit disc: of a 2 x 2 matrix by |det| < 1 and |trace| < 1 + det (Jury)."""
    if _unstable(slope):
        return False
    if len(slope) > 2:
        return None  # open: the checker knows such orbits, and asks for nothing
    if len(slope) == 1:
        return True if slope[0][0].absolute().hi[0] < 1.0 else None
    det, trace = _determinant(slope), (slope[0][0] + slope[1][1]).absolute()
    return True if det.absolute().hi[0] < 1.0 and (det + 1.0 - trace).lo[0] > 0.0 else None


def _product(slopes: Intervals) -> Entries:
    """Multiply the derivatives (p, d, d) of the steps of an orbit."""
    steps = (entries(slopes.lo[k : k + 1], slopes.hi[k : k + 1]) for k in range(len(slopes.lo)))
    return reduce(lambda product, step: times(step, product), steps)


@np.errstate(all="ignore")
def is_unstable_in_file(corners: Corners, cycle: CycleOfMap) -> bool:
    """Whether an orbit is unstable by slopes on boxes beyond those of its certificate, for which the checker asks."""
    slopes = slopes_on(corners, *widened(*widened(cycle.lo, cycle.hi)), cycle)
    return slopes is not None and _unstable(_product(slopes))


@np.errstate(all="ignore")  # a singular matrix or an overflow gives inf and nan, which prove nothing
def prove_orbit(corners: Corners, cycle: Cycle, lies: Lies, period: Array | None = None) -> CycleOfMap | str:
    """Prove that there is one orbit near one that floats give, and that it lies where asked; or say what is missing.

    `period`: of the axes that close, by side and axis, 0 of the others.
    """
    middle = cycle.x.reshape(cycle.period, -1).astype(np.float64)
    step = _sure_steps(corners, middle, middle, cycle)
    if isinstance(step, str):
        return step
    c, least = inverse(step[1]), FIRST * np.maximum(np.abs(middle), 1.0)
    ahead = np.roll(middle, -1, axis=0)
    along = np.zeros_like(middle) if period is None else period[np.roll(cycle.side, -1)]
    turns = Turns.of(step[0], ahead, along)
    off, lo, hi = turns.gaps(step[0], ahead), middle, middle
    for _ in range(TRIES):
        wide = Intervals(lo, hi) - exactly(middle)
        held = krawczyk(middle[None], c, off, step[1], Intervals(wide.lo[None], wide.hi[None]))
        at = Intervals(held.lo[0], held.hi[0])
        if ((lo < at.lo) & (at.hi < hi)).all():
            return _proved(corners, at, cycle, lies, turns)
        more = MORE * (at.hi - at.lo) + least
        lo, hi = np.minimum(at.lo - more, middle), np.maximum(at.hi + more, middle)
        if not np.isfinite([lo, hi]).all():
            break
        step = _sure_steps(corners, lo, hi, cycle)
        if isinstance(step, str):
            return step
    return "no box is found that Newton's operator contracts"


def _confirmed(corners: Corners, lo: Array, hi: Array, cycle: Cycle, turns: Turns) -> bool:
    """Whether Newton's operator leads the boxes of a certificate into their interior, as the checker asks of them."""
    middle = 0.5 * (lo + hi)
    first, step = (_sure_steps(corners, *ends, cycle) for ends in ((middle, middle), (lo, hi)))
    if isinstance(first, str) or isinstance(step, str):
        return False
    off, wide = turns.gaps(first[0], np.roll(middle, -1, axis=0)), Intervals(lo, hi) - exactly(middle)
    held = krawczyk(middle[None], inverse(step[1]), off, step[1], Intervals(wide.lo[None], wide.hi[None]))
    room = ROOM * (hi - lo)
    return bool(((lo + room < held.lo[0]) & (held.hi[0] < hi - room)).all())


def _proved(corners: Corners, at: Intervals, cycle: Cycle, lies: Lies, turns: Turns) -> CycleOfMap | str:
    """Prove the sides, branches, period and slope of an orbit that lies in boxes; or say what is missing."""
    step = _sure_steps(corners, at.lo, at.hi, cycle)
    if isinstance(step, str):
        return step
    if any(
        ((at.lo[0] <= at.hi[k]) & (at.lo[k] <= at.hi[0])).all()
        for k in range(1, cycle.period)
        if cycle.period % k == 0 and cycle.side[k] == cycle.side[0]
    ):
        return "its period may be smaller"
    if not lies(at.lo, at.hi, cycle.side):
        return "its boxes do not lie in the cells that it is looked for in"
    if not _confirmed(corners, *widened(at.lo, at.hi), cycle, turns):
        return "its boxes are too wide for a certificate"
    slope = _product(Intervals(step[1].lo[0], step[1].hi[0]))
    proved = CycleOfMap(at.lo, at.hi, cycle.side, cycle.branches, *_ends(slope), _attracts(slope))
    return replace(proved, turns=turns.number) if turns.period.any() else proved
