"""For which starts a goal holds: those proved to come to the attracting cells.

docs/certificates.md, "For which starts": falling, passing and thin cells, starts that are lost, and those laid down.
"""

import itertools
import math
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import (
    ZERO,
    Array,
    Pair,
    about,
    exact,
    float_above,
    float_below,
    prove,
    reason_of,
    sine_cosine,
)
from .cells import check_reach, grown, leading_into, targets_of
from .file import Cells, by_side, hex_float, require, rows, table, whole_number
from .labels import range_max
from .model import (
    at_angle,
    rise_of_jog,
)
from .near_foot import check_lost, check_outward
from .near_hinge import (
    check_below_cells,
    check_near_joint,
    check_null,
    check_thinning,
    near_landing,
    read_near_hinge,
)
from .scene import Scene, check_by_halves

MOST_COUNTED = 100_000  # throws, or rounds, that a goal may count

Span = tuple[float, float]


class Starts(NamedTuple):
    """The starts of a goal: "every", "almost-every", "from" (beyond x on each side), "cells", "within" (some ranges).

    "from_foot": those with x - a_i beyond `x` on each side, whatever a_i is; `lost` then is such a distance too.
    `thinning` counts its rounds; `near` has factors and fixed points where starts before the first cells are claimed; a
    worst sequence of landings takes starts up to `lost`, by side, to the joint; `only` the starts in the attracting
    cells are claimed.  `laid` has by side the ranges of x in which all starts lie: "within" claims all of these starts,
    "cells" those in cells with a rank.
    """

    kind: str
    x: list[float] | None = None
    thinning: int = 0
    near: tuple[list[float], list[Pair | None]] | None = None
    lost: list[float] | None = None
    only: bool = False
    laid: list[list[Span]] | None = None

    def fixed(self, side: int) -> Pair | None:
        """Return the bracket of the jog's fixed point on a side, where one is named."""
        return None if self.near is None else self.near[1][side]


def read_starts(section: dict[str, Any], goal: dict[str, Any], n_sides: int) -> Starts:
    """Read for which starts a goal is claimed."""
    require("starts" in section, "goal.starts is missing")
    said, kind = section["starts"], section["starts"]
    x = laid = None
    if isinstance(said, dict):
        table(said, "goal.starts", "", "from from_foot within cells")
        require(len(said) == 1, "goal.starts is not one of from, from_foot, within and cells")
        ((kind, value),) = said.items()
        if kind.startswith("from"):
            x = [hex_float(each, "goal.starts") for each in by_side(value, kind, n_sides)]
        else:
            laid = read_laid(value, n_sides)
    require(
        kind in ("every", "almost-every", "from", "from_foot", "cells") or bool(laid),
        "goal.starts is none that is known",
    )
    thinning = 0
    if "thinning" in section:
        rounds = "goal.thinning is not a number of rounds"
        thinning = whole_number(section["thinning"], 1, MOST_COUNTED - 1, rounds)
    near = read_near_hinge(section["near_joint"], n_sides) if "near_joint" in section else None
    lost = None
    if "lost" in section:
        lost = [hex_float(each, "lost") for each in by_side(section["lost"], "lost", n_sides)]
        require(kind != "from_foot" or min(lost) >= 0.0, "goal.lost is a distance below 0")
    almost = goal["kind"] == "reaches" and not goal["every"]
    starts = Starts(
        kind, x, thinning, near=near, lost=lost, only=almost and kind == "cells" and laid is None, laid=laid
    )
    require_fitting(starts, goal, almost, [starts.fixed(i) for i in range(n_sides)])
    return starts


def read_laid(value: object, n_sides: int) -> list[list[Span]]:
    """Read by side the ranges in which parts are laid down: ascending, apart, and one at least."""
    known = table(value, "the ranges of the starts", "", " ".join(map(str, range(n_sides))))
    require(bool(known), "there are no ranges of the starts")
    ranges: list[list[Span]] = []
    for i in range(n_sides):
        pairs = rows(known[str(i)], "ranges", 1, 100) if str(i) in known else []
        ends = [hex_float(end, "a range") for pair in pairs for end in rows(pair, "a range", 2, 2)]
        ascending = all(a < b for a, b in itertools.pairwise(ends))
        require(ascending, "the ranges of the starts are empty, or do not ascend")
        ranges.append(list(zip(ends[::2], ends[1::2], strict=True)))
    return ranges


def require_fitting(starts: Starts, goal: dict[str, Any], almost: bool, points: list[Pair | None]) -> None:
    """Require that the parts of a claim about starts fit each other and the goal; `points` are the fixed points."""
    kind = starts.kind
    anywhere = goal["anywhere"] and goal["kind"] != "attracts_all"  # which is about every start anyway
    lossy = kind in ("from", "from_foot", "cells") and not starts.only
    require(starts.lost is None or lossy, f"starts {kind}: none of them are lost")
    require(kind != "from_foot" or starts.near is None, "starts from the foot on have no near_joint")
    if kind in ("every", "almost-every"):
        near = (starts.near is not None or anywhere) and not any(points)
        require(near, f"starts {kind}: near_joint does not say so")
        fits = (starts.thinning > 0) == (kind == "almost-every") or (almost and kind == "almost-every")
        require(fits, f"starts {kind} and thinning do not fit")
    for x, point in zip(starts.x or (), points, strict=False):
        require(point is None or x >= point[1], "starts before the end of a fixed point are claimed")
    require(not (almost and kind == "every"), "a goal of almost every orbit is claimed for every start")
    of = "almost-every" if almost else "every"
    if starts.laid is not None:
        require(starts.near is None and starts.lost is None, "starts laid down are those in cells")
        return
    require(kind == of or not anywhere, f"this goal from anywhere is one of starts {of}")
    require(kind != "cells" or goal["kind"] != "attracts_all", "attracts_all of some cells")


def check_starts(c: Cells, scene: Scene, goal: dict[str, Any], starts: Starts) -> None:
    """Check that the starts claimed come into the attracting cells, given all images.

    Let G be the cells with a rank.  No orbit leaves them, and off the components the rank never rises: so in the end it
    stays what it is.  It cannot stay where it falls along every target; nor for ever in a cell that only leads to
    itself and to lower ranks, while each jog from it moves the part one way by more than the landing scatters.  What is
    left, Z, has to thin out, rank by rank; and starts of length zero have to come from starts of length zero only.
    """
    if starts.only:  # of starts elsewhere a file says no more than where they creep
        for side in range(len(c.edges)):
            if starts.near is not None and starts.fixed(side) is not None:
                q, points = starts.near
                check_near_joint(c, scene, side, check_below_cells, q[side], points[side])
        return
    almost = goal["kind"] == "reaches" and not goal["every"]
    creeps = goal["kind"] == "attracts_all" and starts.near is not None and any(starts.near[1])
    prove(not creeps, "parts near the joint creep to it: there are two basins")
    for side in range(len(c.edges) if starts.laid is None else 0):
        check_starts_of_side(c, scene, starts, side)
    # other goals from anywhere ask something of every throw, or of a number of throws: no orbit has to arrive
    if not goal["anywhere"] or goal["kind"] == "flip_order" or almost:
        check_arrival(c, scene, starts, almost)


def laid_down(c: Cells, scene: Scene, starts: Starts) -> Cells:
    """Keep of the cells what starts laid down in the ranges can come to; all of it has to have a rank.

    Any other cell gets neither rank nor component nor targets, so that nothing is asked of it and nothing rests on it.
    No orbit from the ranges meets such a cell: the cells kept hold the ranges, and all targets of the cells kept.
    """
    begin = cells_of_ranges(c, scene, starts.laid or [])
    if starts.kind == "cells":
        begin &= c.rank >= 0
    prove(bool(begin.any()), "no start is claimed that lies in a cell with a rank")
    met = led_to(c, begin)
    c.prove_all(~met | (c.rank >= 0), "a part laid down may come to it, and its rank is -1")
    jog, flip = (np.where(met[:, None], array, -1) for array in (c.jog, c.flip))
    rank, component = np.where(met, c.rank, -1), np.where(met, c.component, -1)
    return replace(c, jog=jog, flip=flip, rank=rank, component=component)


def cells_of_ranges(c: Cells, scene: Scene, laid: list[list[Span]]) -> Array:
    """Find the cells that hold the starts of some ranges, as far as these lie on the arm; all of them have to."""
    begin = np.zeros(len(c.rank), dtype=bool)
    for i, (edges, ranges) in enumerate(zip(c.edges, laid, strict=True)):
        for lo, hi in ranges:
            last = Fraction(float(edges[-1]))
            prove(bool(lo >= edges[0]), f"side {i}: starts are claimed that lie before the cells")
            prove(Fraction(lo) < scene.arm[0], f"side {i}: starts are claimed that lie beyond arm.length")
            prove(last >= min(Fraction(hi), scene.arm[1]), f"side {i}: the cells end before the starts do")
            begin[c.start[i] : c.start[i + 1]] |= (edges[1:] > lo) & (edges[:-1] < hi)
    return begin


def length_within(c: Cells, cells: Array, side: int, lo: float, hi: float) -> float:
    """Return the length of some cells of a side from lo to hi, but for the rounding of the sum."""
    edges = c.edges[side]
    inside = np.minimum(edges[1:], hi) - np.maximum(edges[:-1], lo)
    return float(np.clip(inside, 0.0, None)[cells[c.start[side] : c.start[side + 1]]].sum())


def share_of_ranges(c: Cells, laid: list[list[Span]], cells: Array, end: float) -> float:
    """Bound from below the share of some ranges that lies in some cells, up to some x."""
    claimed = length = 0.0
    for i, ranges in enumerate(laid):
        for lo, hi in ranges:
            length += float_above(exact(Fraction(hi) - Fraction(lo)))
            claimed += length_within(c, cells, i, lo, min(hi, end))
    return claimed / length * (1 - 2.0**-30)  # against the rounding of these sums


def led_to(c: Cells, cells: Array) -> Array:
    """Find the cells given, and all to which some orbit from them may come, by the targets of the cells."""
    return grown(cells, lambda known: targets_of([c.jog, c.flip], known))


def check_starts_of_side(c: Cells, scene: Scene, starts: Starts, side: int) -> None:
    """Check that the starts claimed on a side lie in cells with a rank or near the joint."""
    edges, near = c.edges[side], starts.near
    first, claimed = float(edges[0]), c.rank >= 0
    if starts.kind == "from_foot" and starts.x is not None:
        check_starts_from_foot(c, scene, side, starts.x[side])
        check_lost_starts(scene, starts, side)
        return
    since = None if starts.x is None else starts.x[side]
    needed = np.zeros(len(edges) - 1, dtype=bool)
    if starts.kind != "cells":
        check_reach(c, scene, side)
        needed = edges[1:] > (-math.inf if since is None else since)
    known = since is None or near is not None or since >= first
    prove(known, f"side {side}: starts are claimed that lie before the cells")
    if near is not None:
        check_near_joint(c, scene, side, check_below_cells, near[0][side], near[1][side])
        needed |= edges[:-1] <= float_above(near_landing(scene.sides[side], scene.k_lo, scene.k_hi, first))
    claimed[c.start[side] : c.start[side + 1]] |= ~needed
    claimed[: c.start[side]] = claimed[c.start[side + 1] :] = True
    c.prove_all(claimed, "nothing is claimed of starts in it: its rank is -1")
    check_lost_starts(scene, starts, side)


def check_lost_starts(scene: Scene, starts: Starts, side: int) -> None:
    """Check that the starts that are said to be lost on a side are lost."""
    if starts.lost is not None:
        foot = starts.kind == "from_foot"
        with about(f"side {side}, starts up to x{f' - a_{side}' * foot} = {starts.lost[side]!r}"):
            check_by_halves(scene, check_lost, side, starts.lost[side], foot)


def check_starts_from_foot(c: Cells, scene: Scene, side: int, away: float) -> None:
    """Check that starts with x - a_i > away come to cells with a rank, beyond the last cell of the side without one."""
    check_reach(c, scene, side)
    edges, ranked = c.edges[side], c.rank[c.start[side] : c.start[side + 1]] >= 0
    until = float(edges[int(np.flatnonzero(~ranked).max(initial=-1)) + 1])
    begin = scene.sides[side].a + away
    prove(begin < scene.sides[side].arm, f"side {side}: no start is claimed that lies on the arm")
    if begin >= until:
        return  # all these starts lie in cells with a rank
    with about(f"side {side}, starts with x - a_{side} > {away!r}"):
        check_by_halves(scene, check_outward, side, until, away)


def check_arrival(c: Cells, scene: Scene, starts: Starts, almost: bool) -> None:
    """Check that orbits from the cells with a rank arrive, every one or almost every one."""
    stuck = level_cells(c, scene)
    if stuck.any():
        c.prove_all(~stuck | (starts.thinning > 0), "the rank does not fall along a throw")
        check_thinning(c, scene, stuck, starts.thinning, c.rank)
    if stuck.any() or almost:
        claimed = c.rank >= 0
        some = claimed if almost else grown(stuck, lambda known: leading_into(c, known))
        outward = starts.near is not None and not any(starts.near[1])
        check_null(c, scene, some & claimed & ~(c.component >= 0), outward)


def level_cells(c: Cells, scene: Scene) -> Array:
    """Find the cells of Z: off the components, those in which an orbit may stay at its rank, which never rises."""
    inside, claimed = c.component >= 0, c.rank >= 0
    level = np.zeros(len(inside), dtype=bool)
    alone = np.ones(len(inside), dtype=bool)  # no other cell than itself has its rank among its targets
    c.prove_all(~inside | (c.rank == 0), "a cell of a component has a rank other than 0")
    for array, (what, q, least, most) in zip(
        (c.jog, c.flip), c.targets(c.rank, claimed & ~inside), strict=True
    ):
        stays, falls = np.ones(len(inside), dtype=bool), np.ones(len(inside), dtype=bool)
        stays[q], falls[q] = least >= 0, most <= c.rank[q]
        c.prove_all(stays, f"{what} may lead to a cell with the rank -1")
        c.prove_all(falls, f"the rank may rise along {what}")
        level[q] |= most == c.rank[q]
        first, last = array[q].T
        for lo, hi in ((first, np.minimum(last, q - 1)), (np.maximum(first, q + 1), last)):
            some = lo <= hi
            alone[q[some]] &= range_max(c.rank, lo[some], hi[some]) < c.rank[q[some]]
    for k in np.flatnonzero(level & alone).tolist():
        turn = check_by_halves, scene, check_passing, int(c.side[k]), c.phi[k].tolist()
        level[k] = bool(reason_of(*turn))
    return level


def check_passing(scene: Scene, side: int, phi: list[float]) -> None:
    """Check that jogs with angles in the bracket all go one way by more than the landing scatters."""
    s = scene.sides[side]
    low, high = at_angle(s, arb(phi[0])), at_angle(s, arb(phi[1]))
    rise = rise_of_jog(s, *sine_cosine(low.p.union(high.p)))
    moved = low.D.union(high.D) if rise > 0 else low.D + rise * ZERO.union(high.p - low.p)
    prove(moved > s.landing or moved < -s.landing, "a jog is not proved to move it one way")


def shares(c: Cells, scene: Scene, starts: Starts, cells: Array) -> tuple[float, float]:
    """Bound from below the shares of the arm whose starts are claimed, and whose starts are lost or creep inward."""
    if starts.kind in ("every", "almost-every", "within"):
        return 1.0, 0.0
    if starts.kind == "from_foot":
        return shares_from_foot(scene, starts)
    length = claimed = explained = 0.0
    end = float_below(exact(scene.arm[0]))
    if starts.laid is not None:
        return share_of_ranges(c, starts.laid, cells, end), 0.0
    for i, s in enumerate(scene.sides):
        begin, fixed = float_above(s.a), starts.fixed(i)
        length += float_above(exact(scene.arm[1])) - float_below(s.a)
        since = -math.inf if starts.x is None else starts.x[i]
        claimed += length_within(c, cells, i, since, end)
        if starts.near is not None and not starts.only:
            first = min(float(c.edges[i][0]), end)
            claimed += max(0.0, first - max(begin if fixed is None else fixed[1], since))
        until = fixed[0] if fixed is not None else begin if starts.lost is None else starts.lost[i]
        explained += max(0.0, min(until, end) - begin)
    room = 1 - 2.0**-30  # against the rounding of these sums
    return claimed / length * room, explained / length * room


def shares_from_foot(scene: Scene, starts: Starts) -> tuple[float, float]:
    """Bound from below the shares, of the starts with each value of the parameters, that are claimed, and lost."""
    least, most = (
        sum(arm - foot for foot in feet)
        for arm, feet in (
            (float_below(exact(scene.arm[0])), [float_above(s.a) for s in scene.sides]),
            (float_above(exact(scene.arm[1])), [float_below(s.a) for s in scene.sides]),
        )
    )
    claimed, lost = 1.0 - sum(starts.x or ()) / least, sum(starts.lost or ()) / most
    return claimed * (1 - 2.0**-30), lost * (1 - 2.0**-30)  # against the rounding of the sums


def starts_in_words(starts: Starts, noisy: bool) -> str:
    """Put the starts in words, with the numbers that are checked."""
    some = "every start a_i < x <= arm.length on every side i"
    if starts.kind == "from_foot":
        beyond = [f"x - a_{i} > {x!r} on side {i}" for i, x in enumerate(starts.x or ())]
        some = f"every start with {', or '.join(beyond)}, up to arm.length, whatever a_i is"
    elif starts.x is not None:
        beyond = [f"{x!r} < x <= arm.length on side {i}" for i, x in enumerate(starts.x)]
        some = f"every start with {', or '.join(beyond)}"
    elif starts.laid is not None:
        some = f"every start on the arm with {ranges_in_words(starts.laid)}"
        some += " that lies in a cell with a rank" if starts.kind == "cells" else ""
    elif starts.kind == "cells":
        before = ", and before the first cells" if starts.near is not None else ""
        some = f"every start in the cells that have a rank{before}"
    others = ", others for other throws" if noisy else ""
    return some + (f", but for starts of total length zero{others}" if starts.thinning else "")


def ranges_in_words(laid: list[list[Span]]) -> str:
    """Name the ranges in which parts are laid down."""
    return ", or ".join(
        f"{lo!r} <= x <= {hi!r} on side {i}" for i, ranges in enumerate(laid) for lo, hi in ranges
    )


def explained_in_words(starts: Starts) -> list[str]:
    """Say what becomes of starts that are not claimed."""
    lines = []
    for i in range(len(starts.lost or (starts.near or ([], []))[0])):
        fixed = starts.fixed(i)
        if fixed is not None:
            lines.append(f"    side {i}: starts a_{i} < x < {fixed[0]!r} stay on it and creep to a_{i}")
        elif starts.lost is not None:
            foot = f"a_{i} + " if starts.kind == "from_foot" else ""
            lost = f"each start a_{i} < x <= {foot}{starts.lost[i]!r} is lost by a worst sequence of landings"
            lines.append(f"    side {i}: {lost}")
    return lines
