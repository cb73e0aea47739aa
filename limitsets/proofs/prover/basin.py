"""The proved basin: starts, also those near the hinge, that come to the attracting cells and stay there.

Every start in a cell of the basin either comes to the attracting cells, by ranks that fall, or belongs to a set of
length zero.  Off the attracting cells a cell of the basin is of one of three kinds:

* *falling*: every image lies in cells of smaller rank;
* *passing*: besides in such cells it may lie in the cell itself again, and jogs from the cell are proved to go one way,
  all outward or all inward, by more than the noise of the landing place: an orbit leaves the cell after finitely many;
* *thin*: the rank does not rise, and almost every start leaves the cells of that rank (`thinning.py`).

Ranks do not rise along any image, so an orbit that does not come to the attracting cells stays in thin cells of one
rank from some throw on.  Such starts have length zero, and so have all that are thrown there, where the slope is proved
positive on all cells that can reach thin ones.  Cells from which a cell of no kind can be reached are *open*: nothing
is claimed of their starts.
Source: docs/certificates.md, "For which starts".
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.thrower.flight_box import bracket, sure_bracket, turn_box, turn_point
from limitsets.feeder.thrower.full_box import full_ways
from limitsets.feeder.thrower.impact import jog_displacement, margin, strike
from limitsets.feeder.thrower.motion import gather_full_box
from limitsets.feeder.thrower.params import gather_box, with_kappa
from limitsets.feeder.thrower.throw_box import throw_box
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import proof_kernel
from limitsets.proofs.prover.cover import Cover, leaves
from limitsets.proofs.prover.thinning import perron_frobenius_bound, slopes
from limitsets.systems.cells import CellSet
from limitsets.systems.graph.components import ranks, reach

# ----------------------------------------------------------------
# Near the hinge: every start on (a_i, a_i + delta_i] is thrown outward, by a proved factor.
#
# For h < 0 and R - a = r small the throw is a decided jog with R' - a = r - h phi + a v - d w, v = 1 - cos phi,
# w = phi - sin phi, and
#
#     phi >= 2 r / kappa                      (f(phi) = r phi + a w + d v - (kappa/2) phi^2 is positive before that),
#     a v - d w >= phi^2 (a/2 - a phi^2/24 - d phi/6) >= 0      where the bracket is proved positive,
#
# so R' - a >= q r with q = 1 + 2 |h| / kappa > 1: the orbit leaves the interval after ln(delta/r) / ln q throws at
# most. With effects the left vertex has to land first, phi at most the exterior angle there, and a part that rolls on
# has to come to rest in the cells: every start then either rests as above, or is in the cells at once. The
# small-angle flights have phi >= 2 r / kappa and no v and w in the displacement, so the same q serves. For h > 0 see
# `cover.py`. Source: docs/model.md, "Conventions": near a_i.


# q - 1 is lowered by this share, so that the checker's arithmetic can confirm it where the parameters are wide.
SLACK_OF_Q = 2.0**-26


@dataclass(frozen=True)
class NearHinge:
    """What is proved of starts between a_i and the first cell of side i.

    Attributes
    ----------
    x : float
        Where the cells begin.
    q : float
        R' - a >= q (R - a) on (a_i, x]; or, if there is a fixed point R*, R' - R* >= q (R - R*) on (R*, x], and starts
        in (a_i, R*) tend to a_i.
    reach : float
        No throw from (a_i, x] lands beyond it.
    rises : bool
        Whether R' is proved to grow with R on (a_i, x] at least as fast: the displacement grows with the angle.
    proved : bool
        Whether q > 1 is proved, with everything that the factor rests on.
    reason : str
        What is missing, empty if nothing.
    fixed_point : (float, float) or None
        With the arm's surface above the joint: R* lies between them.
    rolls : bool
        Whether a throw from (a_i, x] may roll on to another side.
    empty : bool
        Whether no throw begins on this side, because the part cannot rest on it; the proof is then trivial.
    """

    x: float
    q: float
    reach: float
    rises: bool
    proved: bool
    reason: str
    fixed_point: tuple[float, float] | None = None
    rolls: bool = False
    empty: bool = False


# The entry of a side on which the part cannot rest.
NO_STARTS = NearHinge(np.inf, np.inf, -np.inf, True, True, "", empty=True)


@proof_kernel(entry=True)
def _near_hinge(lo: Any, hi: Any, side: int, x: float, out: Any) -> None:
    """Root found, jog decided, bracket, -h, room on the arm: positive if proved; q, reach, slope."""
    b = gather_box(lo, hi, side)
    last, good = bracket(b.flight, b, x)
    if not good:  # so near to the joint its starts may lie far apart, where a is known to a tolerance only
        last, good = sure_bracket(b.flight, b, x)
    phi, starts = Interval(0.0, last.hi), Interval(b.a.lo, x)
    at = turn_box(phi)
    omega, barrier = strike(b.flight, b, starts, at)
    flips = margin(b.flip, b.inertia, omega, barrier)
    square = b.a * phi**2
    left = b.a * 0.5 - square / 24.0
    left = left - b.d * phi / 6.0
    shift, rise = jog_displacement(b.flight, b, at)
    reached = (x + shift).hi
    out[0] = 1.0 if good else -1.0
    out[1] = -flips.hi
    out[2] = left.lo
    out[3] = -b.h.hi
    out[4] = (lo.arm_length - Interval(reached, reached)).lo
    gain = 2.0 * -b.h / b.kappa
    out[5] = (1.0 + gain).lo
    out[6] = reached
    out[7] = rise.lo


@proof_kernel(entry=True)
def _near_ways(lo: Any, hi: Any, side: int, x: float, corner: Any, turned: Any, place: Any) -> int:
    """Places of rest with effects, of starts up to x, their sides turned and bounds; how many, -1 if not known.

    `corner`: by how much the exterior angle at the left vertex exceeds the angle of impact.
    """
    part = gather_full_box(lo, hi, side, Interval(lo.bare.kappa, hi.bare.kappa))
    b = part.own
    last, good = bracket(b.flight, b, x)
    phi, starts = Interval(0.0, last.hi), Interval(b.a.lo, x)
    shift, _ = jog_displacement(b.flight, b, turn_box(phi))
    corner[0] = (lo.bare.corner[side] - Interval(last.hi, last.hi)).lo
    ways = full_ways(part, starts, 0 if good else -1, phi, starts + shift)
    turned[0], turned[1] = ways.first.turned, ways.second.turned
    place[0, 0], place[0, 1] = ways.first.lo, ways.first.hi
    place[1, 0], place[1, 1] = ways.second.lo, ways.second.hi
    return ways.number


REASONS = (
    "the impact is not enclosed",
    "the jog is not decided",
    "the displacement is not proved to grow",
    "the arm's surface is not below the joint (h < 0)",
    "the throw may reach beyond the arm",
    "no expansion is proved",
)

SCATTERED = (
    "with noise of landing.x a part that lies nearer to a than that may land at x <= a, and leave inward"
)

SCATTERED_BEYOND = (
    "with noise of landing.x a part may come to either side of the unstable fixed point of the jog"
)


def near_hinge(cover: Cover) -> tuple[NearHinge, ...]:
    """Prove the expansion near a_i, or from the fixed point of the jog on, on every side.

    Parameters
    ----------
    cover : Cover
        The cells, which say where "near" ends.

    Returns
    -------
    tuple of NearHinge
        One per side.
    """
    return tuple(_near_side(cover, side, float(edges[0])) for side, (edges,) in enumerate(cover.grid.edges))


def _near_side(cover: Cover, side: int, x: float) -> NearHinge:
    """Prove the expansion on one side, whose cells begin at x."""
    if not cover.box.rests[side]:
        return NO_STARTS
    if cover.points:
        return _beyond(cover, side, x)
    out = np.full(8, np.nan)
    _near_hinge(*cover.box.bare, side, x, out)
    q = 1.0 + (float(out[5]) - 1.0) * (1.0 - SLACK_OF_Q)
    good = [*(out[:5] > 0.0), q > 1.0]
    reason = "" if all(good) else REASONS[good.index(False)]
    if cover.box.landing > 0.0 and not reason:
        reason = SCATTERED
    rises, reach, rolls = bool(out[7] > 0.0), float(out[6]), False
    if cover.box.effects and not reason:
        reach, rolls, reason = _rolled(cover, side, x, reach)
    return NearHinge(x, q, reach, rises, not reason, reason, rolls=rolls)


def missing_near(joint: Sequence[NearHinge]) -> str:
    """Say on which side what is missing near the joint; empty if nothing is."""
    missing = (
        f"near the joint on side {side}: {near.reason}" for side, near in enumerate(joint) if near.reason
    )
    return next(missing, "")


def _rolled(cover: Cover, side: int, x: float, reach: float) -> tuple[float, bool, str]:
    """Prove that what is thrown from (a_i, x] rests as in the minimal model, or rolls into the cells.

    Returns the farthest place of all, whether anything may roll to another side, and what is missing.
    """
    corner, turned, place = np.full(1, np.nan), np.zeros(2, np.int64), np.full((2, 2), np.nan)
    count = _near_ways(cover.box.lo, cover.box.hi, side, x, corner, turned, place)
    if not corner[0] >= 0.0:
        return reach, True, "another vertex than the left one may land first"
    if count < 1:
        return reach, True, "where the part rolls to is not enclosed"
    sides, end = cover.grid.sides, cover.box.bare[0].arm_length
    rolls = [k for k in range(count) if turned[k] != 0]
    for k in rolls:
        lo, hi = place[k]
        edges = cover.grid.edges[(side + int(turned[k])) % sides][0]
        if not (lo >= edges[0] and hi <= edges[-1] and hi <= end):
            return reach, True, "the part may roll to where it is not on the arm, or near to the joint again"
        reach = max(reach, float(hi))
    return reach, bool(rolls), ""


def _beyond(cover: Cover, side: int, x: float) -> NearHinge:
    """Prove the expansion beyond the fixed point of the jog, where the arm's surface is above the joint."""
    point = cover.points[side]
    if point.reason:
        return NearHinge(x, np.nan, np.inf, False, False, point.reason)
    q, reason = leaves(cover.box, side, point, x)
    reason = SCATTERED_BEYOND if cover.box.landing > 0.0 else reason
    # R' grows with R there, by a factor of q at least
    return NearHinge(
        x, q, np.inf, rises=not reason, proved=not reason, reason=reason, fixed_point=(point.lo, point.hi)
    )


# ----------------------------------------------------------------
# The proved basin: starts that are proved to come to the attracting cells and stay there.


# A goal that is claimed from some x on counts as proved if the starts nearer to the joint, of which nothing is proved,
# make no more than this share of the arm (docs/certificates.md).
MOST_UNEXPLAINED = 0.01

# Displacements differ from the noise of the landing place by this share at least, so that others can confirm it.
ROOM = 2.0**-20

# Shares are rounded by this much, against the rounding of sums.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Basin:
    """The starts that are proved to come to the attracting cells.

    Attributes
    ----------
    rank : ndarray of int32, shape (n_cells,)
        Of cells of the basin, 0 on the attracting ones; -1 on the open cells.
    thinning : int
        Throws after which thin cells are proved to thin out; 0 if there are none.
    near : bool
        Whether the starts below the cells are in it, on every side: those beyond the jog's fixed point, if it has one.
    start : ndarray, shape (sides,)
        On each side every start beyond this x is in it; inf where the part cannot rest.
    explained : ndarray, shape (sides,)
        Starts up to this x are proved to be lost under the worst noise of the landing place, or to creep to the joint;
        the foot of the part, a_i, where there are none; inf where the part cannot rest.
    share : float
        Share of the arm that is in it, rounded down.
    leaves : float
        Share of the starts proved to leave the arm; with noise of the landing place, for the worst sequence.
    creeps : float
        Share of the starts proved to creep to the joint.
    open : float
        Share of the starts of which nothing is proved, rounded up.
    from_start : bool
        Whether the starts beyond `start`, on all sides, are claimed: what lies below is explained, or little.
    missing : str
        The first place of which nothing is proved, and why; empty if there is none.
    thin : ndarray of bool, shape (n_cells,)
        The thin cells.
    """

    rank: NDArray[np.int32]
    thinning: int
    near: bool
    start: Array
    explained: Array
    share: float
    leaves: float
    creeps: float
    open: float
    from_start: bool
    missing: str
    thin: Mask

    @property
    def shares(self) -> dict[str, float]:
        """Shares of the arm, as JSON has them."""
        return {"share": self.share, "leaves": self.leaves, "creeps": self.creeps, "open": self.open}

    @property
    def starts(self) -> Any:
        """For which starts it is claimed: "every", "almost-every", {"from": {side: x}} or "cells"."""
        if self.near and not self.creeps and not (self.rank < 0).any():
            return "almost-every" if self.thinning else "every"
        if self.from_start:
            return {"from": {str(side): float(x) for side, x in enumerate(self.start) if math.isfinite(x)}}
        return "cells"


# ---------------------------------------------------------------- kernels


@proof_kernel(entry=True)
def _shifts(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, out: Any) -> None:
    """Bound the displacement of a jog from each cell.

    `out`: rows of the least for all kappa, the largest for the largest kappa, 1 where that one is a decided jog, the
    largest for all kappa.
    """
    whole = gather_box(lo_map, hi_map, side)
    slow = with_kappa(whole, whole.kappa.hi, whole.kappa.hi)
    for k in range(lo.size):
        _, _, phi, _, _ = throw_box(whole, Interval(lo[k], hi[k]))
        out[k, 0], out[k, 3] = _ends(whole, phi)
        state, _, phi, _, _ = throw_box(slow, Interval(lo[k], hi[k]))
        out[k, 1] = _ends(slow, phi)[1]
        out[k, 2] = 1.0 if state == 0 else 0.0


@proof_kernel
def _ends(b: Any, phi: Any) -> Any:
    """Bounds of the displacement over a bracket of the angle, at its ends where the displacement grows."""
    shift, rise = jog_displacement(b.flight, b, turn_box(phi))
    least, _ = jog_displacement(b.flight, b, turn_point(phi.lo))
    most, _ = jog_displacement(b.flight, b, turn_point(phi.hi))
    grows = rise.lo > 0.0
    return (least.lo if grows else shift.lo), (most.hi if grows else shift.hi)


def _displacements(cover: Cover, side: int, wanted: Ints) -> Array:
    """Return what `_shifts` says of some cells of a side, by their numbers there."""
    (edges,) = cover.grid.edges[side]
    out = np.full((wanted.size, 4), np.nan)
    _shifts(*cover.box.bare, side, edges[:-1][wanted], edges[1:][wanted], out)
    return out


# ---------------------------------------------------------------- the basin


def basin(cover: Cover, component: NDArray[np.int32], joint: Sequence[NearHinge]) -> Basin:
    """Prove which starts come to the attracting cells.

    Parameters
    ----------
    cover : Cover
        Cells and images.
    component : ndarray of int32, shape (n_cells,)
        Number of the attracting component of each cell, -1 off them.
    joint : sequence of NearHinge
        What is proved of the starts below the cells.

    Returns
    -------
    Basin
    """
    parts, inside = cover.graph.components(), component >= 0
    settled = np.zeros(parts.count, dtype=bool)
    settled[parts.label[inside]] = True
    rank = ranks(cover.graph.ranges, parts, settled)
    lost = np.concatenate([images.lost for images in cover.images])
    leaving = cover.graph.ranges.exits > 0
    again = parts.recurrent[parts.label] & ~inside
    again &= ~_passing(cover, again & (parts.size[parts.label] == 1))
    shut = _reaching(cover, lost | leaving)
    thin, throws = again & ~shut, 0
    thick = flat = np.zeros_like(inside)
    if thin.any():
        result = perron_frobenius_bound(cover, thin, rank)
        throws, thick = result.throws, result.thick
        shut |= _reaching(cover, thick)
        thin &= ~shut
    if thin.any():
        before = _reaching(cover, thin) & ~shut & ~inside
        flat = before & ~(slopes(cover, CellSet(cover.grid, before)) > 0.0)
        shut |= _reaching(cover, flat)
        thin &= ~shut
    near = _below_cells(cover, joint, shut, thin=bool(thin.any()))
    rank[shut] = -1
    start, explained = _start(cover, joint, shut, near)
    reasons = (
        (lost, "nothing is proved of the image of {}"),
        (leaving, "the image of {} may leave the cells"),
        (thick, "orbits are not proved to leave the recurrent cells at {}, which do not attract"),
        (flat, "the slope is not proved positive on {}"),
    )
    missing = next(
        (text.format(cover.place(int(np.argmax(mask)))) for mask, text in reasons if mask.any()), ""
    )
    if not missing and not near:
        missing = missing_near(joint)
    # a little more, so that other arithmetic can confirm it
    throws = throws + throws // 8 + 1 if thin.any() else 0
    return Basin(
        rank,
        throws,
        near,
        start,
        explained,
        *shares_of(cover, joint, shut, near, start, explained),
        missing=missing,
        thin=thin,
    )


def _reaching(cover: Cover, cells: Mask) -> Mask:
    """Return the cells from which some of the given ones can be reached, these included."""
    if not cells.any():
        return np.zeros_like(cells)
    marks: Mask = reach(cover.graph.ranges, cover.graph.components(), cells.astype(np.uint8)) > 0
    return marks


def _passing(cover: Cover, alone: Mask) -> Mask:
    """Return the cells from which jogs are proved to go one way by more than the noise of the landing place."""
    passing = np.zeros_like(alone)
    if cover.box.effects:  # another vertex may land first, at another place
        return passing
    for side in range(len(cover.grid.edges)):
        own = cover.grid.of_side(side)
        wanted = np.flatnonzero(alone[own])
        least, _, _, most = _displacements(cover, side, wanted).T
        by = np.maximum(least, -most)
        passing[own][wanted] = by - cover.box.landing > ROOM * by
    return passing


def _below_cells(cover: Cover, joint: Sequence[NearHinge], shut: Mask, *, thin: bool) -> bool:
    """Whether the starts below the cells, beyond a fixed point of the jog, come to cells that are not shut."""
    for side, (each, (edges,)) in enumerate(zip(joint, cover.grid.edges, strict=True)):
        own = shut[cover.grid.of_side(side)]
        reached = edges[:-1] <= each.reach
        if not each.proved or own[reached].any() or (each.rolls and shut.any()) or (thin and not each.rises):
            return False
    return True


def _start(cover: Cover, joint: Sequence[NearHinge], shut: Mask, near: bool) -> tuple[Array, Array]:
    """On each side, from where on every start is claimed, and up to where the starts are lost or creep."""
    (lo, hi), start, explained = cover.box.bare, np.full(len(joint), math.inf), np.full(len(joint), math.inf)
    for side, (each, (edges,)) in enumerate(zip(joint, cover.grid.edges, strict=True)):
        if each.empty:
            continue
        last = int(np.flatnonzero(shut[cover.grid.of_side(side)]).max(initial=-1))
        point = each.fixed_point if near else None
        below = float(hi.a[side]) if point is None else point[1]
        start[side] = below if near and last < 0 else edges[last + 1]
        explained[side] = lo.a[side] if point is None else point[0]
        if each.reason == SCATTERED and each.reach - each.x < cover.box.landing:
            _, _, decided, most = _displacements(cover, side, np.arange(last + 1)).T
            lost = (most < cover.box.landing * (1.0 - ROOM)) & (decided > 0.0)
            explained[side] = edges[int(np.argmin([*lost, False]))]
    return start, explained


def shares_of(
    cover: Cover, joint: Sequence[NearHinge], shut: Mask, near: bool, start: Array, explained: Array
) -> tuple[float, float, float, float, bool]:
    """Shares of the arm that are claimed, leave, creep and are open; whether all beyond `start` is claimed.

    `start` and `explained` may be those of several boxes of parameters together, as of a joined claim.
    """
    (lo, hi), rests = cover.box.bare, cover.box.rests
    total = float((lo.arm_length - hi.a)[rests].sum())
    wide = float((hi.arm_length - lo.a)[rests].sum())
    unexplained = float((start[rests] - explained[rests]).sum())
    from_start = unexplained <= MOST_UNEXPLAINED * total and bool((start[rests] < lo.arm_length).all())
    claimed = 0.0
    for side, (edges,) in enumerate(cover.grid.edges):
        good = ~shut[cover.grid.of_side(side)] & ((edges[:-1] >= start[side]) | (not from_start))
        claimed += float(np.diff(edges)[good].sum())
        if near and rests[side]:
            point = joint[side].fixed_point
            below = float(hi.a[side]) if point is None else point[1]
            claimed += max(0.0, float(edges[0]) - (max(below, float(start[side])) if from_start else below))
    explains = float((explained - lo.a)[rests].sum())
    creeps = explains if near and any(each.fixed_point is not None for each in joint) else 0.0
    if cover.box.landing > 0.0:
        leaves = explains
    else:
        widths = np.concatenate([np.diff(edges) for (edges,) in cover.grid.edges])
        leaves = float(widths[leaving_cells(cover)].sum()) if shut.any() else 0.0
    if near and not creeps and not shut.any():
        return 1.0, 0.0, 0.0, 0.0, from_start
    share, gone, crept = (max(0.0, x / wide - ROUNDING) for x in (claimed, leaves, creeps))
    return share, gone, crept, min(1.0, max(0.0, 1.0 - share - gone - crept) + ROUNDING), from_start


def leaving_cells(cover: Cover) -> Mask:
    """Return the cells all of whose orbits are proved to leave the arm.

    From these no recurrent cell can be reached, and no cell whose image may lie, in part, between the foot
    and the cells.
    """
    foot, parts = cover.box.bare[0].a, cover.graph.components()
    stays = parts.recurrent[parts.label] | np.concatenate([images.lost for images in cover.images])
    for side, images in enumerate(cover.images):
        own = stays[cover.grid.of_side(side)]
        for (to, _), (low, high) in images.hulls.items():
            own |= (low <= high) & (low < cover.grid.edges[to][0][0]) & (high > foot[to])
    gone: Mask = ~_reaching(cover, stays)
    return gone
