"""Near the hinge: starts before the first cell of a side; and thinning: which cells come to the cells wanted.

docs/certificates.md, "What it rests on", number 6 (near the joint), and "The surface above the joint".
"""

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from flint import arb

from .balls import HALF, ONE, ZERO, Arb, Array, Pair, UnprovedError, about, prove
from .cells import check_reach
from .file import Cells, by_side, hex_float, require, rounded, rows, table
from .model import (
    Ratios,
    at_angle,
    flight,
    gain_at,
    gain_slope,
    guess_root,
    landing_at,
    landing_slope,
    over_angles,
    ratios,
    rise_of_jog,
    root_above,
    root_below,
    slope_over,
)
from .scene import Scene, Side, check_by_halves


def read_near_hinge(value: object, n_sides: int) -> tuple[list[float], list[Pair | None]]:
    """Read the claims about starts before the first cell: factors q, and brackets of fixed points or None, by side."""
    near = by_side(value, "near_joint", n_sides)
    each = [table(one, "near_joint", "q", "fixed_point") for one in near]
    fixed = [read_bracket(one["fixed_point"]) if "fixed_point" in one else None for one in each]
    return [hex_float(one["q"], "q") for one in each], fixed


def read_bracket(value: object) -> tuple[float, float]:
    """Read two numbers that enclose a fixed point."""
    lo, hi = (hex_float(end, "fixed_point") for end in rows(value, "fixed_point", 2, 2))
    require(lo <= hi, "fixed_point is an empty interval")
    return lo, hi


def near_angle(s: Side, k_lo: Arb, k_hi: Arb, edge: float) -> Arb:
    """Bound the impact angle of throws from (a, edge] by a sign of f, which rises with R; nan if no bound is found."""
    x = arb(edge)
    bound = arb(float((2 * (x - s.a) / (k_hi - s.small_d)).upper()))
    for _ in range(21):
        if flight(x, k_lo, at_angle(s, bound)) < 0:
            return bound
        bound = bound * 1.25
    return arb("nan")


def near_landing(s: Side, k_lo: Arb, k_hi: Arb, edge: float) -> Arb:
    """Bound where throws from (a, edge] land: R' <= R - h phi + a phi^2/2."""
    bound = near_angle(s, k_lo, k_hi, edge)
    bound = root_above(s, arb(edge), k_lo, at_angle(s, bound)).p if bound.is_finite() else bound
    return arb(edge) + abs(s.h) * bound + HALF * s.a * bound**2 + s.landing


def check_near_hinge(s: Side, k_lo: Arb, k_hi: Arb, edge: float, q: float) -> None:
    """Prove on (a, edge] that a throw is a decided jog and R' - a >= q (R - a), R' <= arm.

    f = (R - a) phi + a (phi - sin phi) + d (1 - cos phi) - (kappa/2) phi^2 and both brackets are >= 0, so f > 0 for
    phi < 2 (R - a)/kappa: the impact comes later than that.  f rises with R, so f(bound) < 0 at the edge bounds it
    from above.  R' - R = -h phi + a (1 - cos phi) - d (phi - sin phi) >= -h phi + phi^2 (a/2 - a phi^2/24 - d phi/6)
    and <= -h phi + a phi^2/2.  Small angles: phi = 2 (R - a)/(kappa - small_d) and R' - R = -h phi.
    """
    x, height = arb(edge), -s.h
    prove(s.landing <= 0, "with noise of the landing place a part near the joint may land at x <= a")
    prove(height > 0, "the arm's surface is not below the joint")
    prove(x > s.a, "the cells begin left of a")
    bound = near_angle(s, k_lo, k_hi, edge)
    prove(bound < 1, "the impact angle is not bounded")
    rises = not s.exact or HALF * s.a - s.a * bound**2 / 24 - s.d * bound / 6 > 0
    prove(rises, "a (1 - cos phi) >= d (phi - sin phi) is not proved")
    grows = q > 1 and q <= 1 + 2 * height / (k_hi - s.small_d)
    prove(grows, f"R' - a >= q (R - a) is not proved for q = {q!r}")
    last = x + height * bound + HALF * (s.a if s.exact else ZERO) * bound**2
    prove(last <= s.arm, "R' <= arm.length is not proved")
    check_all_jog(s, k_lo.union(k_hi), x, bound)


def check_all_jog(s: Side, kappa: Arb, x: Arb, bound: Arb) -> None:
    """Prove that throws from (a, x] with impact angles up to the bound are jogs."""
    R, pieces = s.a.union(x), 64
    for k in range(pieces):
        phi = (bound * k / pieces).union(bound * (k + 1) / pieces)
        prove(over_angles(s, phi, R, kappa)[0] == 0, "a jog is not proved")


def check_everywhere(c: Cells, scene: Scene) -> None:
    """Check that every start on the arm is in a cell, or near the joint and thrown outward."""
    for i in range(len(c.edges)):
        check_reach(c, scene, i)
        check_near_joint(c, scene, i, check_thrown_out)


def check_near_joint(c: Cells, scene: Scene, side: int, check: Callable[..., None], *more: Any) -> None:
    """Check something of the starts before the first cell of a side."""
    edge = float(c.edges[side][0])
    with about(f"side {side}, near the joint, x in (a, {edge!r}]"):
        check_by_halves(scene, check, side, edge, *more)


def check_thrown_out(scene: Scene, side: int, edge: float) -> None:
    """Check that starts up to the edge are thrown outward, by any factor above 1."""
    s = scene.sides[side]
    gain = -2 * s.h / (scene.k_hi - s.small_d)
    q = float((1 + gain * (1 - 2.0**-20)).lower())
    check_near_hinge(s, scene.k_lo, scene.k_hi, edge, q)


def fixed_angles(s: Side) -> tuple[Ratios, Ratios] | None:
    """Find two angles, proved E < 0 at the first and E > 0 at the second for all parameters; None if Newton fails."""
    angles = []
    for sign, a, d, h in (
        (-1, s.a.upper(), s.d.lower(), s.h.lower()),
        (1, s.a.lower(), s.d.upper(), s.h.upper()),
    ):
        p = 2 * h / a
        for _ in range(60):
            r = ratios(p)
            slope = gain_slope(a, d, r).mid()
            if not (slope > 0 and p < 3):
                return None
            p = (p - gain_at(a, d, h, r).mid() / slope).mid()
        if not (p > 0 and p < 3):
            return None
        for k in range(10):
            r = ratios(arb(float(p) * (1 + sign * 2.0 ** (3 * k - 46))))
            if sign * gain_at(s.a, s.d, s.h, r) > 0:
                break
        else:
            return None
        angles.append(r)
    return angles[0], angles[1]


def last_angle(s: Side, x: float, k_lo: Arb) -> Ratios | None:
    """Find an angle p, proved R(p) > x for all parameters; None if there is none near the guess."""
    guess = guess_root(s.late, s.exact, x, float(k_lo), 4 * (x - s.floats[0]) / float(k_lo) + 0.1)
    for k in range(20):
        p = guess * (1 + 2.0 ** (2 * k - 38))
        if 0 < p < 3:
            r = ratios(arb(p))
            if landing_at(s, r, k_lo) > arb(x):
                return r
    return None


def check_fixed_point(s: Side, k_lo: Arb, k_hi: Arb, edge: float, q: float, said: Pair) -> None:
    """Prove the claims about starts up to the edge where the arm's surface is above the joint.

    The claims are: on (a, edge] a throw is a jog; the jog has one fixed point R* there, with said[0] <= R* <= said[1];
    starts in (a, R*) tend to a; and R' - R* >= q (R - R*), R' <= arm on (R*, edge].

    f(p) = (R - R(p)) p.  Where dR/dp > 0 on (0, top] and R(top) > edge, each start in (a, edge] has one root there, its
    first, and they grow together: the angle tells everything.  dE/dp > 0 with E < 0 at one angle and E > 0 at a later
    one leaves one zero p* between, R* = R(p*); E has the sign of p - p*.
    """
    prove(s.exact, "every jog goes inward in this flight, where the arm's surface is above the joint")
    angles, last = fixed_angles(s), last_angle(s, edge, k_lo)
    if angles is None or last is None:
        raise UnprovedError("the fixed point of the jog is not found")
    before, after = angles
    least, most = landing_at(s, before, k_lo), landing_at(s, after, k_hi)
    ordered = before.p < after.p and after.p < last.p and most < arb(edge)
    prove(ordered, "the cells do not begin beyond the fixed point of the jog")
    within = least >= arb(said[0]) and most <= arb(said[1])
    prove(within, f"the fixed point of the jog is not proved to lie in [{said[0]!r}, {said[1]!r}]")
    check_jogs_up_to(s, k_lo, k_hi, last.p)
    check_growth_beyond(s, k_hi, before.p, last.p, q)
    prove(arb(edge) + at_angle(s, last.p).D <= s.arm, "R' <= arm.length is not proved")


def check_jogs_up_to(s: Side, k_lo: Arb, k_hi: Arb, top: Arb) -> None:
    """Check for all angles in (0, top] that dR/dp > 0, dE/dp > 0, R' > a, and that the throw is a jog.

    (R' - a)/p = kappa/2 - h + a (V - W) p - d (V + 1 - sin p/p) > 0 keeps a jog right of a: below R* starts fall and
    stay above a, to a limit, which is a fixed point and so a.  (With another kappa at every throw they fall too: by a
    least step on any closed interval in there.)
    """
    kappa, pieces = k_lo.union(k_hi), 256
    for k in range(pieces):
        ends = ratios(top * k / pieces), ratios(top * (k + 1) / pieces)
        r = ratios(ends[0].p.union(ends[1].p))
        alone = landing_slope(s, r, k_lo) > 0 and gain_slope(s.a, s.d, r) > 0
        prove(alone, "the fixed point of the jog is not proved to be the only one")
        right = HALF * k_lo - s.h + s.a * (r.V - r.W) * r.p - s.d * (r.V + ONE - r.sine)
        prove(right > 0, "R' > a is not proved")
        R = landing_at(s, ends[0], k_lo).union(landing_at(s, ends[1], k_hi))
        prove(over_angles(s, r.p, R, kappa)[0] == 0, "a jog is not proved")


def check_growth_beyond(s: Side, k_hi: Arb, first: Arb, top: Arb, q: float) -> None:
    """Check on [first, top] that dD/dR = (dD/dp)/(dR/dp) >= q - 1, with R' - R = D(p) and D = 0 at R*."""
    pieces = 16
    for k in range(pieces):
        r = ratios((first + (top - first) * k / pieces).union(first + (top - first) * (k + 1) / pieces))
        rise = rise_of_jog(s, *r.p.sin_cos())
        grows = q > 1 and rise > 0 and rise >= (arb(q) - 1) * landing_slope(s, r, k_hi)
        prove(grows, f"R' - R* >= q (R - R*) is not proved for q = {q!r}")


def check_below_cells(scene: Scene, side: int, edge: float, q: float, said: Pair | None) -> None:
    """Check the claims about starts before the first cell, which depend on the sign of h."""
    s = scene.sides[side]
    if s.h > 0:
        if said is None:
            raise UnprovedError(
                "the arm's surface is above the joint, and no fixed point of the jog is given"
            )
        still = s.landing <= 0
        prove(
            still, "with noise of the landing place a part may come to either side of the jog's fixed point"
        )
        check_fixed_point(s, scene.k_lo, scene.k_hi, edge, q, said)
    else:
        above = "a fixed point of the jog is given, but the arm's surface is not above the joint"
        prove(said is None, above)
        check_near_hinge(s, scene.k_lo, scene.k_hi, edge, q)


def fixed_points_in_words(section: dict[str, Any], noisy: bool) -> str:
    """Put attracts-all in words where the arm's surface is above the joint."""
    factor = rounded(min(section["q"]), up=False)
    said = "; ".join(f"side {i}: [{lo!r}, {hi!r}]" for i, (lo, hi) in enumerate(section["fixed"]))
    if noisy:
        what = (
            "for each speed of the noise the jog has an unstable fixed point, all in an interval [lo_i, hi_i]"
        )
        beyond, before, rest = "hi_i", "lo_i", "; nothing is claimed of starts between lo_i and hi_i"
    else:
        what = "the jog has an unstable fixed point R*_i in an interval"
        beyond, before, rest = "R*_i", "R*_i", ""
    return (
        f"attracts-all, with the arm's surface above the joint: on every side i {what} ({said});"
        f" every start {beyond} < x <= arm.length on every side i enters the attracting cells and stays in them, within"
        f" {section['max_rank']} throws where x is in the cells; nearer to it x - {beyond} grows by a factor of at"
        f" least {factor} with every throw; every start a_i < x < {before} stays on side i"
        f" and tends to a_i{rest}"
    )


# ----------------------------------------------------------------
# Which cells come to the cells wanted: all orbits (backward reachability), or almost all (thinning).
#
# docs/certificates.md, "Goals, end points, orbits", numbers 7 (backward reachability) and 8 (thinning).


MOST_EDGES = 20_000_000  # pairs of a cell and a target, for one thinning


def not_arriving(ways: list[Array], cells: Array, wanted: Array, throws: int) -> Array:
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
        enclosed = slope_over(s, both, k_lo.union(k_hi), rise, f_slope)
        if enclosed is None:
            return 0.0
        slope = float(enclosed.lower())
        least = min(least, slope if slope > 0 else 0.0)
    return least


def check_thinning(c: Cells, scene: Scene, left: Array, throws: int, kind: Array) -> None:
    """Check that almost every orbit leaves the cells `left`, or comes to cells of another kind.

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
    cells = np.flatnonzero(left)
    for k, enclosed in throws_of(c, scene, cells):
        steep[k] = steepness(*enclosed)
    c.prove_all(~left | (steep > 0), "dR'/dR > 0 is not proved")
    source, to, group = links_within(c, left, cells, kind)
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
            return
        density[cells[gone[number]]] = 0.0  # no other kind depends on this one
        if not (density < 1e100).all():
            break
    raise UnprovedError(f"what has not arrived is not proved to thin out within {throws} throws")


def throws_of(
    c: Cells, scene: Scene, cells: Array
) -> Iterator[tuple[int, tuple[Side, Arb, Arb, Pair, Pair]]]:
    """Give for each of some cells its number, and what encloses its throws: side, kappa, x and bracket of phi."""
    lower, upper = c.lower(), c.upper()
    for k in cells.tolist():
        least, most = c.phi[k].tolist()
        x = float(lower[k]), float(upper[k])
        yield k, (scene.sides[int(c.side[k])], scene.k_lo, scene.k_hi, x, (least, most))


def links_within(c: Cells, left: Array, cells: Array, kind: Array) -> tuple[Array, Array, Array]:
    """List the throws within cells of one kind: the cell, its target, and a number for its run and branch.

    `cells` are the cells `left`, ascending.
    """
    run = np.cumsum((np.diff(cells, prepend=-2) > 1) | (np.diff(c.side[cells], prepend=-1) != 0))
    froms, tos, groups = [], [], []
    for branch, array in enumerate((c.jog, c.flip)):
        q = np.flatnonzero(array[cells, 0] >= 0)
        first, last = array[cells[q], 0].astype(np.int64), array[cells[q], 1].astype(np.int64)
        prove(int((last - first + 1).sum()) <= MOST_EDGES, "there are too many targets")
        for step in range(int((last - first).max(initial=-1)) + 1):
            to = first + step
            some = (to <= last) & left[np.minimum(to, len(left) - 1)]
            some[some] &= kind[cells[q][some]] == kind[to[some]]
            froms.append(cells[q][some])
            tos.append(to[some])
            groups.append(2 * run[q][some] + branch)
    source, to, group = (np.concatenate([np.zeros(0, np.int64), *part]) for part in (froms, tos, groups))
    return source, to, group


def check_null(c: Cells, scene: Scene, cells: Array, near: bool) -> None:
    """Check that on some cells starts of length zero come from starts of length zero only.

    Where dR'/dR > 0 is proved on a cell each branch has an inverse with bounded slope.  Near the joint, which counts if
    `near`, phi rises with R, possibly by jumps; where D' > 0 on all angles possible R' = R + D(phi) grows at least as
    fast as R.  (Beyond a fixed point of the jog check_growth_beyond has proved it.)
    """
    rises = np.ones(len(c.side), dtype=bool)
    for k, enclosed in throws_of(c, scene, np.flatnonzero(cells)):
        rises[k] = steepness(*enclosed, pieces=1) > 0 or steepness(*enclosed) > 0
    for i, s in enumerate(scene.sides if near else ()):
        phi = ZERO.union(near_angle(s, scene.k_lo, scene.k_hi, float(c.edges[i][0])))
        outward = rise_of_jog(s, phi.sin(), phi.cos()) > 0
        prove(outward, f"side {i}, near the joint: R' is not proved to rise with R")
    c.prove_all(rises, "dR'/dR > 0 is not proved")
