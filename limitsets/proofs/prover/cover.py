"""Cells for a proof and the enclosures of their images, from the unstable fixed point of the jog on (h > 0).

The cells of side i run from just beyond a_i to the arm's end, graded towards a_i; starts nearer to a_i are treated
in `basin.py`.  Where the arm's surface is above the joint the cells begin just beyond the unstable fixed point of the
jog instead, if the search finds one.  Borders that a goal needs (its x) are cut in.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.thrower import Exact
from limitsets.feeder.thrower.flight_box import bracket, exact_turn, turn_box, turn_point
from limitsets.feeder.thrower.impact import margin, strike
from limitsets.feeder.thrower.params import SideBox, gather_box
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import proof_kernel
from limitsets.proofs.prover.parameters import ParameterBox
from limitsets.systems.cells import Domain, Grid, grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.images.enclosed import Enclosures, boxes_of, enclosures
from limitsets.systems.graph.ranges import build
from limitsets.systems.graph.target import Target
from limitsets.systems.maps import kind_of

# ----------------------------------------------------------------
# The unstable fixed point of the jog where the arm's surface lies above the joint (h > 0): one on each side.
#
# In the exact flight the landing angle phi parametrises everything: with V = (1 - cos phi)/phi^2 and
# W = (phi - sin phi)/phi^3, which both fall on (0, 2 pi), f(phi) = phi (R - R(phi)) and
#
#     R(phi)      = a (1 - phi^2 W) + phi (kappa/2 - d V),       the start that lands at phi,
#     E(phi)      = (R' - R)/phi = -h + a phi V - d phi^2 W,     the displacement of a jog,
#     (R' - a)/phi = kappa/2 - h + a Q - d (V + phi^2 W),        P = 1 - phi^2 W - V,   Q = phi (V - W),
#     dR/dphi     = kappa/2 - a Q - d P,       dE/dphi = a P - d Q.
#
# None of them cancels near phi = 0.  On (0, top], where R(top) > x for a wanted x, it is proved that
#
# 1. dR/dphi > 0.  Then a start R <= x lands at the one phi with R(phi) = R, for f > 0 before it, and phi grows with R.
# 2. dE/dphi > 0.  With E < 0 at phi_lo and E > 0 at phi_hi there is one fixed angle phi* between them; a jog goes
# inward
#    before it and outward beyond it.  The fixed point R* = R(phi*) lies between R(phi_lo) and R(phi_hi).
# 3. the throw is a decided jog, and (R' - a)/phi > 0.  So a start in (a, R*) stays there for ever and moves inward with
#    every throw: its limit L >= a would be a fixed point if L > a were true, for the map is continuous.  Hence L = a.
# 4. on [phi_lo, top]:  1 + (d(R' - R)/dphi)/(dR/dphi) >= q > 1, and no jog from there ends beyond the arm.  By the mean
# value theorem R' - R* >= q (R - R*) on (R*, x]: such a start is beyond x after ln((x - R*)/(R - R*))/ln q + 1
# throws.
#
# For a box of parameters each of them has its own R* in the bracket, and all this holds with it.  If they differ at
# every throw (noise), 4 still holds with the bracket's upper end B in place of R*: R' - R >= (q - 1)(R - R*) >= (q -
# 1)(R - B). And in 3 a start below the lower end moves inward for whichever parameters, on any [L, R] by at least
# some step
# > 0, the box being compact: L > a is no limit either.  Of starts between the two ends nothing is claimed then.
#
# The small-angle flights have E = -h: every jog goes inward, there is no fixed point.
# Source: docs/model.md, "The sign of h".


# Relative distance of the angles that enclose phi* from the root that Newton's method proposes: wide against the bounds
# of sine and cosine (2^-45), narrow against the 1e-9 that the bracket of R* should have.
MARGIN = 2.0**-41

# The bracket of R* is widened by these shares of R* - a and of its own width (balls have coarse radii), and q - 1 is
# lowered by the last, so that other arithmetic can confirm.
SLACK_OF_ROOT, SLACK_OF_WIDTH, SLACK_OF_Q = 2.0**-36, 2.0**-20, 2.0**-10

# The largest angle is looked for so far, relative to it, beyond the impact: wide against the rounding of R(phi).
BEYOND = 2.0**-30

# Angles up to this are looked at: other arithmetic may sum series.
LARGEST = 3.0

# Pieces of (0, top], and of [phi_lo, top].
PIECES, PIECES_BEYOND = 128, 8


@dataclass(frozen=True)
class FixedPoint:
    """Where a jog moves the part neither inward nor outward.

    Attributes
    ----------
    lo, hi : float
        Bracket of R* for all the parameters; nan where it is not proved.
    phi_lo, phi_hi : float
        Angles between which it lands [rad].
    reason : str
        Why the fixed point is not enclosed; empty if it is.
    """

    lo: float
    hi: float
    phi_lo: float
    phi_hi: float
    reason: str


# ---------------------------------------------------------------- functions of the angle


@proof_kernel
def _ratios(phi: float) -> tuple[Interval, Interval]:
    """V and W at one angle, and their limits 1/2 and 1/6 at 0."""
    if phi == 0.0:
        return Interval(0.5, 0.5), Interval(1.0, 1.0) / 6.0
    at = turn_point(phi)
    square = at.phi**2
    return at.versin / square, at.phi_minus_sin / (square * at.phi)


@proof_kernel
def _terms(phi: Interval) -> tuple[Interval, Interval, Interval, Interval]:
    """V, phi^2 W, P and Q over angles from 0 to 2 pi: V and W fall."""
    big_first, small_first = _ratios(phi.lo)
    big_last, small_last = _ratios(phi.hi)
    big, small = Interval(big_last.lo, big_first.hi), Interval(small_last.lo, small_first.hi)
    short = phi**2 * small
    return big, short, 1.0 - short - big, phi * (big - small)


@proof_kernel
def _start(b: SideBox, phi: float) -> Interval:
    """R(phi), for all parameters."""
    big, short, _, _ = _terms(Interval(phi, phi))
    fall = 0.5 * b.kappa - b.d * big
    return b.a * (1.0 - short) + phi * fall


@proof_kernel
def _gain(b: SideBox, phi: float) -> Interval:
    """E(phi), for all parameters."""
    big, short, _, _ = _terms(Interval(phi, phi))
    out = b.a * phi * big - b.d * short
    return out - b.h


@proof_kernel
def _growth(b: SideBox, p: Interval, q: Interval) -> Interval:
    """dR/dphi."""
    return 0.5 * b.kappa - (b.a * q + b.d * p)


@proof_kernel
def _guess(a: float, d: float, h: float) -> float:
    """Propose a root of E by Newton's method from below, where E is concave; the proof does not rely on it."""
    phi = 2.0 * h / a
    for _ in range(60):
        _, v, w = exact_turn(phi)
        big, small = v / (phi * phi), w / (phi * phi * phi)
        slope = a * (1.0 - phi * phi * small - big) - d * phi * (big - small)
        gain = a * phi * big - d * phi * phi * small - h
        phi = phi - gain / slope if (slope > 0.0) & (phi <= LARGEST) else np.nan
    return phi


@proof_kernel(entry=True)
def _find(lo: Any, hi: Any, side: int, out: Any) -> None:
    """Two angles, -E at the first and E at the second (both to be positive), and R at both."""
    b = gather_box(lo, hi, side)
    # E grows with a and falls with d and h
    first = _guess(b.a.hi, b.d.lo, b.h.lo) * (1.0 - MARGIN)
    last = _guess(b.a.lo, b.d.hi, b.h.hi) * (1.0 + MARGIN)
    out[0], out[1] = first, last
    out[2], out[3] = -_gain(b, first).hi, _gain(b, last).lo
    out[4], out[5] = _start(b, first).lo, _start(b, last).hi


@proof_kernel
def _decided(b: SideBox, phi: Interval) -> float:
    """Return a number that is positive if every start that lands between two angles jogs; R(phi) grows there."""
    x = Interval(_start(b, phi.lo).lo, _start(b, phi.hi).hi)
    omega, barrier = strike(b.flight, b, x, turn_box(phi))
    flips: Interval = margin(b.flip, b.inertia, omega, barrier)
    return -flips.hi


@proof_kernel(entry=True)
def _examine(lo: Any, hi: Any, side: int, x: float, phi: Any, pieces: Any, ends: Any, rates: Any) -> None:
    """Numbers that have to be positive: `pieces` over (0, top], `ends` there; and slopes of R' over [phi_lo, top]."""
    b = gather_box(lo, hi, side)
    first, _ = bracket(b.flight, b, x)
    top = first.hi * (1.0 + BEYOND)
    ends[0] = _start(b, top).lo - x
    ends[1], ends[2] = top - phi[1], LARGEST - top
    shift = top * _gain(b, top)
    ends[3] = (lo.arm_length - (x + shift)).lo
    n = pieces.shape[1]
    for k in range(n):
        angle = Interval(top * (k / n), top * ((k + 1) / n))
        big, short, p, q = _terms(angle)
        left = 0.5 * b.kappa - b.h
        left = left + b.a * q - b.d * (big + short)
        pieces[0, k] = _growth(b, p, q).lo
        pieces[1, k] = (b.a * p - b.d * q).lo
        pieces[2, k] = left.lo
        pieces[3, k] = _decided(b, angle)
    n = rates.size
    for k in range(n):
        near, far = phi[0] + (top - phi[0]) * (k / n), phi[0] + (top - phi[0]) * ((k + 1) / n)
        far = top if k == n - 1 else far  # the sum need not round to it
        angle = Interval(near, far)
        big, short, p, q = _terms(angle)
        rise = b.a * angle * (1.0 - short)
        rise = rise - b.d * (angle**2 * big) - b.h
        rates[k] = (1.0 + rise / _growth(b, p, q)).lo


# ---------------------------------------------------------------- answers


def fixed_points(box: ParameterBox) -> tuple[FixedPoint, ...]:
    """Enclose the fixed point of the jog on every side, if the surface is above the joint; without claims about it.

    Parameters
    ----------
    box : ParameterBox
        The parameters.

    Returns
    -------
    tuple of FixedPoint
        One per side; none unless h > 0 for all parameters.
    """
    if not box.lo.surface_height > 0.0:
        return ()
    return tuple(_fixed_point(box, side) for side in range(box.lo.a.size))


def _fixed_point(box: ParameterBox, side: int) -> FixedPoint:
    def none(reason: str) -> FixedPoint:
        return FixedPoint(np.nan, np.nan, np.nan, np.nan, reason)

    if box.effects:
        return none(
            "with effects beyond the minimal model nothing is proved where the surface is above the joint"
        )
    if not isinstance(box.lo.flight, Exact):
        return none("with this flight every jog goes inward where the arm's surface is above the joint")
    out = np.full(6, np.nan)
    _find(box.lo, box.hi, side, out)
    phi_lo, phi_hi, before, after, least, most = out.tolist()
    if not (0.0 < phi_lo < phi_hi <= LARGEST and before > 0.0 and after > 0.0):
        return none(
            "near the joint jogs go inward (h > 0), and no unstable fixed point of the jog is found up to which they do"
        )
    slack = SLACK_OF_ROOT * (most - float(box.lo.a[side])) + SLACK_OF_WIDTH * (most - least) + 2.0**-48 * most
    lo, hi = least - slack, most + slack
    if not box.hi.a[side] < lo:
        return none("the fixed point of the jog is too near to the joint to be told from it")
    if not hi < box.lo.arm_length:
        return none(
            f"the fixed point of the jog, x = {hi:.6g}, is not on the arm: up to it jogs go inward (h > 0)"
        )
    return FixedPoint(lo, hi, phi_lo, phi_hi, "")


def leaves(box: ParameterBox, side: int, point: FixedPoint, x: float) -> tuple[float, str]:
    """Prove that starts in (R*, x] are thrown outward by a factor, and that starts in (a, R*) tend to a.

    Parameters
    ----------
    box : ParameterBox
        The parameters.
    side : int
        The side.
    point : FixedPoint
        The fixed point of the jog on this side, without a reason against it.
    x : float
        Where the cells begin, beyond it.

    Returns
    -------
    float
        q: R' - R* >= q (R - R*).
    str
        What is missing, empty if nothing.
    """
    pieces, ends, rates = np.full((4, PIECES), np.nan), np.full(4, np.nan), np.full(PIECES_BEYOND, np.nan)
    _examine(box.lo, box.hi, side, x, np.array([point.phi_lo, point.phi_hi]), pieces, ends, rates)
    q = 1.0 + (float(rates.min()) - 1.0) * (1.0 - SLACK_OF_Q)  # numpy's least is nan if one is
    missing = (
        ((ends[:3] > 0.0).all(), "the impact is not enclosed"),
        ((pieces[0] > 0.0).all(), "the impact angle is not proved to grow with the start"),
        ((pieces[1] > 0.0).all(), "the displacement is not proved to grow with the impact angle"),
        ((pieces[2] > 0.0).all(), "a jog may end left of a"),
        ((pieces[3] > 0.0).all(), "not every start up to the fixed point of the jog is proved to jog"),
        (1.0 < q < np.inf, "no expansion is proved at the fixed point of the jog"),
        (ends[3] > 0.0, "the throw may reach beyond the arm"),
    )
    return q, next((reason for good, reason in missing if not good), "")


# ----------------------------------------------------------------
# Cells for a proof, and the enclosures of their images.


# Share of a side's extent that is left to the argument near the joint.
NEAREST = 1e-6

# At least so many times the width of the enclosure of a_i is left to that argument: nearer to the joint a jog, whose
# length grows with x - a, is shorter than a cell, whose width grows with the distance from the least a.
UNKNOWN = 4.0

# Images are widened by this share of the cell they come from, so that other arithmetic can confirm them.
SLACK_OF_IMAGE = 1e-3


@dataclass(frozen=True, eq=False)
class Cover:
    """Cells of every side and enclosures of their images.

    Attributes
    ----------
    box : ParameterBox
        The parameters for which it holds.
    grid : Grid
        The cells.
    images : tuple of Enclosures
        Per side, widened by `SLACK_OF_IMAGE` and by the noise of the landing place.
    graph : TransitionGraph
        The images as a graph; an image that may leave the cells leads to a sink.
    points : tuple of FixedPoint
        Where the arm's surface is above the joint: the fixed points of the jog, one per side; otherwise none.
    """

    box: ParameterBox
    grid: Grid
    images: tuple[Enclosures, ...]
    graph: TransitionGraph
    points: tuple[FixedPoint, ...]

    def place(self, cell: int) -> str:
        """Name a cell for people."""
        side = int(self.grid.side_of(cell))
        lo, hi = self.grid.boxes([cell], side)
        return f"side {side}, x in [{lo[0, 0]:.6g}, {hi[0, 0]:.6g}]"

    @property
    def leaving(self) -> str:
        """A cell whose image may leave the cells, for people; empty if there is none."""
        leaving = np.flatnonzero(self.graph.ranges.exits)
        return f"the image of {self.place(int(leaving[0]))} may leave the cells" if leaving.size else ""


def _widened(enclosed: Enclosures, edges: Array, landing: float) -> Enclosures:
    """Widen the images by the slack and by the scatter of the landing place, which no decision depends on."""
    more = np.nextafter(landing + SLACK_OF_IMAGE * np.diff(edges), np.inf)
    hulls = {
        key: (np.nextafter(lo - more, -np.inf), np.nextafter(hi + more, np.inf))
        for key, (lo, hi) in enclosed.hulls.items()
    }
    return Enclosures(hulls, enclosed.witness, enclosed.lost)


def cover(
    box: ParameterBox,
    cells: int,
    cuts: Mapping[int, Sequence[float]] | None = None,
    pieces: int | None = None,
) -> Cover:
    """Cut the sides into cells and enclose their images.

    Parameters
    ----------
    box : ParameterBox
        Parameters.
    cells : int
        Cells per side.
    cuts : mapping of int to sequence of float, optional
        Borders wanted on each side.
    pieces : int, optional
        Pieces of the parameter that is known least, where the decision of a cell is open: fewer are quicker.

    Returns
    -------
    Cover

    Raises
    ------
    AnswerError
        For a part that may stand beyond the arm's end.
    """
    rests, end = box.rests, np.full(box.hi.a.size, box.hi.arm_length)
    foot, anchor, points = np.where(rests, box.hi.a, 0.0), np.where(rests, box.lo.a, 0.0), fixed_points(box)
    if not (foot < box.lo.arm_length).all():
        raise AnswerError("the arm", box.lo.arm_length, f"longer than a = {foot.max()}", "lengthen it")
    for side, point in enumerate(points):
        if not point.reason:
            foot[side] = anchor[side] = point.hi
    unknown = np.minimum(UNKNOWN * (box.hi.a - box.lo.a), 0.1 * (end - foot)) if not points else 0.0
    lo = np.where(rests, foot + np.maximum(NEAREST * (end - foot), unknown), end)
    plain = grid(Domain(lo[:, None], end[:, None], anchor), cells=cells)
    return cover_on(box, cut_at(plain, cuts or {}), pieces, points)


def cut_at(plain: Grid, cuts: Mapping[int, Sequence[float]]) -> Grid:
    """Cut the cells of a grid at more places, by side."""
    sides = (
        (np.union1d(edges, [x for x in cuts.get(side, ()) if edges[0] < x < edges[-1]]),)
        for side, (edges,) in enumerate(plain.edges)
    )
    return Grid(plain.domain, tuple(sides))


def cover_on(
    box: ParameterBox, cells: Grid, pieces: int | None = None, points: tuple[FixedPoint, ...] = ()
) -> Cover:
    """Enclose the images of cells that are given; `pieces` as in `cover`, `points` where the cells begin there."""
    enclosed = tuple(
        _widened(enclosures(box.lo, box.hi, edges, side, pieces), edges, box.landing)
        for side, (edges,) in enumerate(cells.edges)
    )
    return Cover(box, cells, enclosed, _graph(box, cells, enclosed), points)


def _graph(box: ParameterBox, cells: Grid, enclosed: Sequence[Enclosures]) -> TransitionGraph:
    exits = kind_of(box.lo).exits
    target = Target.of(cells, exits)
    # the arm's end itself, not the last border: an image that may lie beyond the end may leave
    parts = [boxes_of(images, target, len(exits)) for images in enclosed]
    cell = np.concatenate([part.cell + cells.offset[k] for k, part in enumerate(parts)])
    joined = [
        np.concatenate([getattr(part, name) for part in parts]) for name in ("side", "lo", "hi", "exits")
    ]
    first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=cells.n_cells))])
    leaving = joined[3]
    outward = np.uint8(1 << list(exits).index("outward"))
    for side, images in enumerate(enclosed):
        for lo, hi in images.hulls.values():
            beyond = (lo <= hi) & (hi > box.lo.arm_length)
            leaving[cells.of_side(side)] |= np.where(beyond, outward, 0).astype(np.uint8)
    ranges = build(cells, first, joined[0], joined[1], joined[2], leaving)
    return TransitionGraph(box.lo, cells, ranges, "boxes")


def met(ends: NDArray[np.int32], cells: Mask) -> Mask:
    """Return the cells that images of some cells meet; `ends` are the first and last of each, -1 where it has none."""
    some = ends[cells & (ends[:, 0] >= 0)]
    begin, past = (np.bincount(at, minlength=cells.size + 1) for at in (some[:, 0], some[:, 1] + 1))
    reached: Mask = np.cumsum((begin - past)[:-1]) > 0
    return reached


def leading_to(ends: NDArray[np.int32], cells: Mask) -> Mask:
    """Return the cells whose images meet some cells; `ends` as in `met`."""
    number = np.concatenate([[0], np.cumsum(cells)])
    leads: Mask = (ends[:, 0] >= 0) & (number[ends[:, 1] + 1] > number[ends[:, 0]])
    return leads


def everywhere(covered: Cover) -> list[NDArray[np.int32]]:
    """First and last target cells, as `targets`, of every branch and every number of sides that it turns."""
    sides = covered.grid.sides
    keys = {
        ((to - side) % sides, of) for side, images in enumerate(covered.images) for to, of in images.hulls
    }
    return [targets(covered, branch, turned) for turned, branch in sorted(keys)]


def targets(covered: Cover, branch: int, turned: int | None = None) -> NDArray[np.int32]:
    """First and last target cell of one branch, -1 -1 where it is impossible.

    A branch that leads to several sides is asked for with the number of sides it turns.
    """
    grid = covered.grid
    out = np.full((grid.n_cells, 2), -1, dtype=np.int32)
    for side, images in enumerate(covered.images):
        for (to, of_branch), (lo, hi) in images.hulls.items():
            if of_branch != branch or (turned is not None and (to - side) % grid.sides != turned):
                continue
            edges = grid.edges[to][0]
            some = (lo <= hi) & (edges.size > 1)  # no image comes to rest on a side without cells
            first = np.clip(np.searchsorted(edges, lo[some], side="right") - 1, 0, edges.size - 2)
            last = np.clip(np.searchsorted(edges, hi[some], side="left") - 1, 0, edges.size - 2)
            rows = grid.offset[side] + np.flatnonzero(some)
            out[rows] = np.stack([first, last], axis=1) + grid.offset[to]
    return out
