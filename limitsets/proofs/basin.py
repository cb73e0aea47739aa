"""The proved basin: starts that are proved to come to the attracting cells and stay there.

Every start in a cell of the basin either comes to the attracting cells, by ranks that fall, or belongs to a set of
length zero.  Off the attracting cells a cell of the basin is of one of three kinds:

* *falling*: every image lies in cells of smaller rank;
* *passing*: besides in such cells it may lie in the cell itself again, and jogs from the cell are proved to go one way,
  all outward or all inward, by more than the noise of the landing place: an orbit leaves the cell after finitely many;
* *thin*: the rank does not rise, and almost every start leaves the cells of that rank (`perron_frobenius.py`).

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

from limitsets.cells import CellSet
from limitsets.graph.components import ranks, reach
from limitsets.interval import Interval
from limitsets.jit import proof_kernel
from limitsets.proofs.cover import Cover
from limitsets.proofs.expansion import slopes
from limitsets.proofs.near_hinge import SCATTERED, NearHinge
from limitsets.proofs.perron_frobenius import perron_frobenius_bound
from limitsets.thrower.impact import jog_displacement
from limitsets.thrower.side_box import gather_box, with_kappa
from limitsets.thrower.throw_box import throw_box
from limitsets.thrower.turn_box import turn_box, turn_point

Mask = NDArray[np.bool_]
Floats = NDArray[np.float64]

# A goal that is claimed from some x on counts as proved if the starts nearer to the joint, of which nothing is proved,
# make no more than this share of the arm (docs/certificates.md).
MOST_UNEXPLAINED = 0.01

# Displacements differ from the noise of the landing place by this share at least, so that others can confirm it.
ROOM = 2.0**-20

# Shares are rounded by this much, against the rounding of sums.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Basin:
    """What is proved of where starts come to.

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
    start: Floats
    explained: Floats
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


def _displacements(found: Cover, side: int, wanted: NDArray[np.int64]) -> Floats:
    """Return what `_shifts` says of some cells of a side, by their numbers there."""
    (edges,) = found.grid.edges[side]
    out = np.full((wanted.size, 4), np.nan)
    _shifts(*found.box.bare, side, edges[:-1][wanted], edges[1:][wanted], out)
    return out


# ---------------------------------------------------------------- the basin


def basin(found: Cover, component: NDArray[np.int32], joint: Sequence[NearHinge]) -> Basin:
    """Prove which starts come to the attracting cells.

    Parameters
    ----------
    found : Cover
        Cells and images.
    component : ndarray of int32, shape (n_cells,)
        Number of the attracting component of each cell, -1 off them.
    joint : sequence of NearHinge
        What is proved of the starts below the cells.

    Returns
    -------
    Basin
    """
    parts, inside = found.graph.components(), component >= 0
    settled = np.zeros(parts.count, dtype=bool)
    settled[parts.label[inside]] = True
    rank = ranks(found.graph.ranges, parts, settled)
    lost = np.concatenate([images.lost for images in found.images])
    leaving = found.graph.ranges.exits > 0
    again = parts.recurrent[parts.label] & ~inside
    again &= ~_passing(found, again & (parts.size[parts.label] == 1))
    shut = _reaching(found, lost | leaving)
    thin, throws = again & ~shut, 0
    thick = flat = np.zeros_like(inside)
    if thin.any():
        result = perron_frobenius_bound(found, thin, rank)
        throws, thick = result.throws, result.thick
        shut |= _reaching(found, thick)
        thin &= ~shut
    if thin.any():
        before = _reaching(found, thin) & ~shut & ~inside
        flat = before & ~(slopes(found, CellSet(found.grid, before)) > 0.0)
        shut |= _reaching(found, flat)
        thin &= ~shut
    near = _near(found, joint, shut, thin=bool(thin.any()))
    rank[shut] = -1
    start, explained = _start(found, joint, shut, near)
    reasons = (
        (lost, "nothing is proved of the image of {}"),
        (leaving, "the image of {} may leave the cells"),
        (thick, "orbits are not proved to leave the recurrent cells at {}, which do not attract"),
        (flat, "the slope is not proved positive on {}"),
    )
    missing = next(
        (text.format(found.place(int(np.argmax(mask)))) for mask, text in reasons if mask.any()), ""
    )
    if not missing and not near:
        missing = next(
            (
                f"near the joint on side {side}: {each.reason}"
                for side, each in enumerate(joint)
                if each.reason
            ),
            "",
        )
    # a little more, so that other arithmetic can confirm it
    throws = throws + throws // 8 + 1 if thin.any() else 0
    return Basin(
        rank,
        throws,
        near,
        start,
        explained,
        *shares_of(found, joint, shut, near, start, explained),
        missing,
        thin,
    )


def _reaching(found: Cover, cells: Mask) -> Mask:
    """Return the cells from which some of the given ones can be reached, these included."""
    if not cells.any():
        return np.zeros_like(cells)
    marks: Mask = reach(found.graph.ranges, found.graph.components(), cells.astype(np.uint8)) > 0
    return marks


def _passing(found: Cover, alone: Mask) -> Mask:
    """Of some cells, those from which jogs are proved to go one way by more than the noise of the landing place."""
    passing = np.zeros_like(alone)
    if found.box.effects:  # another vertex may land, elsewhere
        return passing
    for side in range(len(found.grid.edges)):
        own = found.grid.of_side(side)
        wanted = np.flatnonzero(alone[own])
        least, _, _, most = _displacements(found, side, wanted).T
        by = np.maximum(least, -most)
        passing[own][wanted] = by - found.box.landing > ROOM * by
    return passing


def _near(found: Cover, joint: Sequence[NearHinge], shut: Mask, *, thin: bool) -> bool:
    """Whether the starts below the cells, beyond a fixed point of the jog, come to cells that are not shut."""
    for side, (each, (edges,)) in enumerate(zip(joint, found.grid.edges, strict=True)):
        own = shut[found.grid.of_side(side)]
        reached = edges[:-1] <= each.reach
        if not each.proved or own[reached].any() or (each.rolls and shut.any()) or (thin and not each.rises):
            return False
    return True


def _start(found: Cover, joint: Sequence[NearHinge], shut: Mask, near: bool) -> tuple[Floats, Floats]:
    """On each side, from where on every start is claimed, and up to where the starts are lost or creep."""
    (lo, hi), start, explained = found.box.bare, [], []
    for side, (each, (edges,)) in enumerate(zip(joint, found.grid.edges, strict=True)):
        if each.empty:
            start.append(math.inf)
            explained.append(math.inf)
            continue
        last = int(np.flatnonzero(shut[found.grid.of_side(side)]).max(initial=-1))
        point = each.fixed_point if near else None
        below = float(hi.a[side]) if point is None else point[1]
        start.append(below if near and last < 0 else float(edges[last + 1]))
        ends = float(lo.a[side]) if point is None else point[0]
        if each.reason == SCATTERED and each.reach - each.x < found.box.landing:
            _, _, decided, most = _displacements(found, side, np.arange(last + 1)).T
            lost = (most < found.box.landing * (1.0 - ROOM)) & (decided > 0.0)
            ends = float(edges[int(np.argmin([*lost, False]))])
        explained.append(ends)
    return np.array(start), np.array(explained)


def shares_of(
    found: Cover, joint: Sequence[NearHinge], shut: Mask, near: bool, start: Floats, explained: Floats
) -> tuple[float, float, float, float, bool]:
    """Shares of the arm that are claimed, leave, creep and are open; whether all beyond `start` is claimed.

    `start` and `explained` may be those of several boxes of parameters together, as of a joined claim.
    """
    (lo, hi), rests = found.box.bare, found.box.rests
    total = float((lo.arm_length - hi.a)[rests].sum())
    wide = float((hi.arm_length - lo.a)[rests].sum())
    unexplained = float((start[rests] - explained[rests]).sum())
    from_start = unexplained <= MOST_UNEXPLAINED * total and bool((start[rests] < lo.arm_length).all())
    claimed = 0.0
    for side, (edges,) in enumerate(found.grid.edges):
        good = ~shut[found.grid.of_side(side)] & ((edges[:-1] >= start[side]) | (not from_start))
        claimed += float(np.diff(edges)[good].sum())
        if near and rests[side]:
            point = joint[side].fixed_point
            below = float(hi.a[side]) if point is None else point[1]
            claimed += max(0.0, float(edges[0]) - (max(below, float(start[side])) if from_start else below))
    explains = float((explained - lo.a)[rests].sum())
    creeps = explains if near and any(each.fixed_point is not None for each in joint) else 0.0
    if found.box.landing > 0.0:
        leaves = explains
    else:
        widths = np.concatenate([np.diff(edges) for (edges,) in found.grid.edges])
        leaves = float(widths[leaving_cells(found)].sum()) if shut.any() else 0.0
    if near and not creeps and not shut.any():
        return 1.0, 0.0, 0.0, 0.0, from_start
    share, gone, crept = (max(0.0, x / wide - ROUNDING) for x in (claimed, leaves, creeps))
    return share, gone, crept, min(1.0, max(0.0, 1.0 - share - gone - crept) + ROUNDING), from_start


def leaving_cells(found: Cover) -> Mask:
    """Return the cells all of whose orbits are proved to leave the arm.

    From these no recurrent cell can be reached, and no cell whose image may lie, in part, between the foot
    and the cells.
    """
    foot, parts = found.box.bare[0].a, found.graph.components()
    stays = parts.recurrent[parts.label] | np.concatenate([images.lost for images in found.images])
    for side, images in enumerate(found.images):
        own = stays[found.grid.of_side(side)]
        for (to, _), (low, high) in images.hulls.items():
            own |= (low <= high) & (low < found.grid.edges[to][0][0]) & (high > foot[to])
    gone: Mask = ~_reaching(found, stays)
    return gone
