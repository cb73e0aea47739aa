"""Which cells come to the cells wanted: all orbits (backward reachability), or almost all (thinning).

docs/certificates.md, "Goals, end points, orbits", numbers 7 (backward reachability) and 8 (thinning).
"""

import itertools
import math

import numpy as np
from flint import arb

from .balls import ZERO, Arb, Array
from .cells import first_bad
from .file import Cells
from .model import at_angle, over_angles, rise_of_jog, root_above, root_below, slope_over
from .near_hinge import near_angle
from .scene import Scene, Side

MOST_EDGES = 20_000_000  # pairs of a cell and a target, for one thinning


def not_arriving(c: Cells, ways: list[Array], cells: Array, wanted: Array, throws: int) -> Array:
    """Find the cells from which orbits are not proved to come to the wanted cells within so many throws.

    Backward reachability: after k rounds every orbit from a cell that is done comes to a wanted cell within k throws,
    because all targets of the cell were done a round before.  A throw that is none of the ways has arrived.
    """
    done = cells & wanted
    for _ in range(throws):
        left = np.flatnonzero(cells & ~done)
        undone = np.concatenate([[0], np.cumsum(~done)])
        good = np.ones(len(left), dtype=bool)
        for array in ways:
            first, last = array[left, 0], array[left, 1]
            good &= (first < 0) | (undone[last + 1] - undone[np.maximum(first, 0)] == 0)
        if not good.any():
            break
        done[left[good]] = True
    return cells & ~done


def steepness(
    s: Side, k_lo: Arb, k_hi: Arb, x: tuple[float, float], phi: tuple[float, float], pieces: int = 8
) -> float:
    """Bound dR'/dR on a cell from below, piece by piece; 0 where df/dphi < 0, and so one root, is not proved."""
    low, high = at_angle(s, arb(phi[0])), at_angle(s, arb(phi[1]))
    cuts = [x[0] + (x[1] - x[0]) * k / pieces for k in range(pieces)] + [x[1]]
    least = math.inf
    for x0, x1 in itertools.pairwise(cuts):
        if not x0 < x1:
            continue
        to = root_above(s, arb(x1), k_lo, high)
        since = root_below(s, arb(x0), k_hi, low, to.p)
        both = since.p.union(to.p)
        _, rise, f_slope = over_angles(s, both, arb(x0).union(arb(x1)), k_lo.union(k_hi))
        told = slope_over(s, both, k_lo.union(k_hi), rise, f_slope)
        if told is None:
            return 0.0
        slope = float(told.lower())
        least = min(least, slope if slope > 0 else 0.0)
    return least


def check_thinning(c: Cells, scene: Scene, left: Array, throws: int, kind: Array) -> str:
    """Check that almost every orbit leaves the cells `left`, or comes to cells of another kind; "" or the reason.

    A bound of densities under the Perron-Frobenius operator.  Spread starts evenly over the cells, and look at those
    that have not left.  After a throw their density is, at y, the sum over all x thrown to y of the density at x over
    dR'/dR.  On neighbouring cells of a side where that slope is positive a jog rises and is continuous, and so is a
    flip: at most one x for each run of such cells and branch.  The density is bounded by numbers, one for each cell;
    those at a target are at most the sum, over runs and branches, of the largest number over slope that leads to it.
    This rises with the numbers and is proportional to them, so once all are below 1 they fall to 0 by repetition, and
    the starts that never leave have length zero.  Slopes are lower bounds; sums of floats are taken 2^-30 too large.
    An orbit that comes to another kind of cells has left: the kinds are looked at apart.
    """
    steep = np.full(len(left), math.nan)
    lower, upper = c.lower(), c.upper()
    for k in np.flatnonzero(left).tolist():
        s, x, phi = scene.sides[int(c.side[k])], (float(lower[k]), float(upper[k])), c.phi[k].tolist()
        steep[k] = steepness(s, scene.k_lo, scene.k_hi, x, (phi[0], phi[1]))
    bad = first_bad(c, [(~left | (steep > 0), "dR'/dR > 0 is not proved")])
    if bad:
        return bad
    cells = np.flatnonzero(left)
    found = links_within(c, left, cells, kind)
    if found is None:
        return "there are too many targets"
    source, to, group = found
    slots, slot = np.unique(to * (2 * len(cells) + 2) + group, return_inverse=True)
    owner = slots // (2 * len(cells) + 2)
    density: Array = left.astype(np.float64)
    names, number = np.unique(kind[cells], return_inverse=True)
    gone = np.zeros(len(names), dtype=bool)
    for _ in range(throws):
        most = np.zeros(len(slots))
        np.maximum.at(most, slot, density[source] / steep[source] * (1 + 2.0**-30))
        density = np.bincount(owner, most, minlength=len(left)).astype(np.float64) * (1 + 2.0**-30)
        worst = np.zeros(len(names))
        np.maximum.at(worst, number, density[cells])
        gone |= worst < 1
        if gone.all():
            return ""
        density[cells[gone[number]]] = 0.0  # no other kind depends on this one
        if not (density < 1e100).all():
            break
    return f"what has not arrived is not proved to thin out within {throws} throws"


def links_within(c: Cells, left: Array, cells: Array, kind: Array) -> tuple[Array, Array, Array] | None:
    """List the throws within cells of one kind: the cell, its target, and a number for its run and branch.

    `cells` are the cells `left`, ascending.  None if there are too many.
    """
    run = np.cumsum((np.diff(cells, prepend=-2) > 1) | (np.diff(c.side[cells], prepend=-1) != 0))
    froms, tos, groups = [], [], []
    for branch, array in enumerate((c.jog, c.flip)):
        q = np.flatnonzero(array[cells, 0] >= 0)
        first, last = array[cells[q], 0].astype(np.int64), array[cells[q], 1].astype(np.int64)
        if int((last - first + 1).sum()) > MOST_EDGES:
            return None
        for step in range(int((last - first).max(initial=-1)) + 1):
            to = first + step
            some = (to <= last) & left[np.minimum(to, len(left) - 1)]
            some[some] &= kind[cells[q][some]] == kind[to[some]]
            froms.append(cells[q][some])
            tos.append(to[some])
            groups.append(2 * run[q][some] + branch)
    source, to, group = (np.concatenate([np.zeros(0, np.int64), *part]) for part in (froms, tos, groups))
    return source, to, group


def check_null(c: Cells, scene: Scene, cells: Array, near: bool) -> str:
    """Check that on some cells starts of length zero come from starts of length zero only; "" or the reason.

    Where dR'/dR > 0 is proved on a cell each branch has an inverse with bounded slope.  Near the joint, which counts if
    `near`, phi rises with R, possibly by jumps; where D' > 0 on all angles possible R' = R + D(phi) grows at least as
    fast as R.  (Beyond a fixed point of the jog check_growth_beyond has proved it.)
    """
    lower, upper = c.lower(), c.upper()
    rises = np.ones(len(c.side), dtype=bool)
    for k in np.flatnonzero(cells).tolist():
        s, x, phi = scene.sides[int(c.side[k])], (float(lower[k]), float(upper[k])), c.phi[k].tolist()
        told = s, scene.k_lo, scene.k_hi, x, (phi[0], phi[1])
        rises[k] = steepness(*told, 1) > 0 or steepness(*told) > 0
    for i, s in enumerate(scene.sides if near else ()):
        bound = near_angle(s, scene.k_lo, scene.k_hi, float(c.edges[i][0]))
        phi = ZERO.union(bound)
        if not rise_of_jog(s, phi.sin(), phi.cos()) > 0:
            return f"side {i}, near the joint: R' is not proved to rise with R"
    return first_bad(c, [(rises, "dR'/dR > 0 is not proved")])
