"""One cell of a plane of parameters: all that is claimed of every parameter in it.

docs/certificates.md, "Regions": the attracting blocks and the starts that come to them, the goal, what the blocks are
like, and the orbit that refutes the goal for every parameter.
"""

from typing import Any, NamedTuple

import flint
import numpy as np
from flint import arb

from .balls import PRECISION, Array, Pair, UnprovedError, prove
from .cells import check_cell, check_components, check_structure, targets_of, tasks_of
from .end_points import Throws, halved_box
from .file import BadFileError, Cells
from .goals import check_goal, goal_of_scene
from .near_hinge import not_arriving
from .refutations import State, breaks
from .scene import Scene, read_scene
from .starts import Starts, check_starts, require_fitting, shares

UNDECIDED, GOAL_PROVED, GOAL_REFUTED = 0, 1, 2
LARGEST_OPEN = (
    0.01  # the share of the arm of whose starts nothing may be known where starts are claimed from some x on
)
MOST_CUT = 64  # pieces of an interval of an orbit, so that the decision is proved on it


class Claimed(NamedTuple):
    """What is claimed of one cell of parameters; `grid` is None where nothing is but, perhaps, the refutation."""

    raw: dict[str, Any]  # the scene, the two quantities as pairs of texts
    goal: int  # UNDECIDED, GOAL_PROVED or GOAL_REFUTED
    grid: list[Array] | None  # the borders of the cells of the arm, by side
    arrays: dict[str, Array]  # jog, flip, rank, component, phi
    starts: str
    since: list[float]  # where the starts begin that are claimed, by side
    near: list[list[float]] | None  # by side q and the ends of a fixed point, 0 0 without one
    counts: list[int]  # thinning, throws, jogs
    blocks: list[
        list[int]
    ]  # per block its number, 1 if the flip order is claimed, and per side bands, least, most
    chain: list[list[int]]  # side and branch of each interval of the orbit
    ends: list[list[float]]  # and its ends


def start_region_worker() -> None:
    """Set up a process that checks cells of parameters."""
    flint.ctx.prec = PRECISION


def check_region_cell(claimed: Claimed) -> str:
    """Check everything that is claimed of one cell of parameters; "" or the reason."""
    try:
        scene = read_scene(claimed.raw, None)
        goal = goal_of_scene(claimed.raw, len(scene.sides))
        if claimed.goal == GOAL_REFUTED:
            bad = check_chain(scene, goal, claimed)
            if bad:
                return f"the orbit that refutes the goal: {bad}"
        elif claimed.chain:
            return "an orbit refutes the goal, but it is not said to be refuted"
        if claimed.grid is None:
            empty = claimed.goal != GOAL_PROVED and not claimed.blocks
            return "" if empty else "something is claimed of it, but it has no cells"
        return check_record(scene, goal, claimed)
    except BadFileError as error:
        return str(error)
    except UnprovedError as error:
        return str(error)


def check_record(scene: Scene, goal: dict[str, Any] | None, claimed: Claimed) -> str:
    """Check the blocks, the starts that come to them, the goal if it is claimed, and the throws; "" or the reason."""
    c = cells_of(claimed)
    bad = check_structure(c, scene) or check_components(c)
    if bad:
        return bad
    starts = starts_of(claimed)
    every_throw = False
    if claimed.goal == GOAL_PROVED:
        if claimed.starts == "cells" or 1.0 - sum(shares(c, scene, starts, c.rank >= 0)) > LARGEST_OPEN:
            return "starts of more than 1 % of the arm are open"
        if goal is not None:
            bad = check_goal_of_cell(c, scene, goal, starts, claimed.counts)
            every_throw = bool(goal["anywhere"])
    if not bad:
        pseudo = {"kind": "region", "every": True, "anywhere": False}
        require_fitting(starts, pseudo, False, [starts.fixed(i) for i in range(len(c.edges))])
        bad = check_starts(c, scene, pseudo, starts)
    return bad or check_blocks(c, claimed.blocks) or check_throws(c, scene, every_throw)


def cells_of(claimed: Claimed) -> Cells:
    """Put the cells of the arm together; which branches are possible is told by their targets."""
    a = claimed.arrays
    jog, flip = (a[name].astype(np.int64) for name in ("jog", "flip"))
    both = (jog[:, 0] >= 0) & (flip[:, 0] >= 0)
    branch = np.where(both, 2, np.where(flip[:, 0] >= 0, 1, 0))
    rank, component = a["rank"].astype(np.int64), a["component"].astype(np.int64)
    return Cells(
        list(claimed.grid or ()),
        jog,
        flip,
        branch=branch,
        rank=rank,
        component=component,
        phi=a["phi"].astype(np.float64),
    )


def starts_of(claimed: Claimed) -> Starts:
    """Put together for which starts it is claimed that they come to the blocks."""
    near: tuple[list[float], list[Pair | None]] | None = None
    if claimed.near is not None:
        fixed = [(lo, hi) if (lo, hi) != (0.0, 0.0) else None for _, lo, hi in claimed.near]
        near = ([q for q, _, _ in claimed.near], fixed)
    since = list(claimed.since) if claimed.starts == "from" else None
    return Starts(claimed.starts, since, claimed.counts[0], near)


def check_goal_of_cell(
    c: Cells, scene: Scene, goal: dict[str, Any], starts: Starts, counts: list[int]
) -> str:
    """Check that the scene's goal holds of the blocks, for the starts claimed; "" or the reason."""
    almost = goal["kind"] == "reaches" and not goal["every"]
    kind = "almost-every" if almost and starts.kind == "every" else starts.kind
    own = goal | {"throws": counts[1], "jogs": counts[2], "starts": starts._replace(kind=kind)}
    require_fitting(own["starts"], own, almost, [starts.fixed(i) for i in range(len(c.edges))])
    return check_goal(c, scene, own)


def check_throws(c: Cells, scene: Scene, every_throw: bool) -> str:
    """Check decision, landing and images of the cells of which something is claimed; "" or the reason."""
    chosen = np.flatnonzero((c.component >= 0) | (c.rank >= 0) | every_throw)
    for task in tasks_of(c, scene, 0, chosen, None):
        for cell, (x0, x1, p0, p1, j0, j1, f0, f1) in zip(
            task.cells.tolist(), task.rows.tolist(), strict=True
        ):
            failure, _ = check_cell(scene, task.side, (x0, x1), (p0, p1), ((j0, j1), (f0, f1)), None)
            if failure is not None:
                return f"{c.name(cell)}: {failure.text}"
    return ""


# ------------------------------------------------------------------------------------------------- the blocks


def check_blocks(c: Cells, blocks: list[list[int]]) -> str:
    """Check what is said of each block: its visits, its flip order, its bands; "" or the reason."""
    if [row[0] for row in blocks] != list(range(len(blocks))):
        return "the blocks are not numbered from 0"
    if set(np.unique(c.component).tolist()) - {-1} != set(range(len(blocks))):
        return "the blocks are not the components"
    for number, ordered, *rest in blocks:
        inside, n = c.component == number, len(c.edges)
        visits = [visits_of(c, inside, i) for i in range(n)]
        for i, (bands, least, most) in enumerate(zip(rest[::3], rest[1::3], rest[2::3], strict=True)):
            bad = check_visits(visits[i], least, most) or check_bands(c, inside, i, bands)
            if bad:
                return f"block {number}, side {i}: {bad}"
        if ordered and not comes_round(c, inside, visits):
            return f"block {number}: that its orbits come to the sides in order is not proved"
    return ""


def visits_of(c: Cells, inside: Array, side: int) -> tuple[int, int] | None:
    """Bound the jogs between the flip that leads to a side of a block and the next one; None if no flip leads there."""
    here = targets_of([c.flip], inside) & (c.side == side)
    if not here.any():
        return None
    least, cells = -1, int((inside & (c.side == side)).sum())
    for jogs in range(cells + 1):
        if least < 0 and (c.flip[here, 0] >= 0).any():
            least = jogs
        on = here & (c.jog[:, 0] >= 0)
        if not on.any():
            return least, jogs
        here = targets_of([c.jog], on)
    return max(least, 0), -1


def check_visits(jogs: tuple[int, int] | None, least: int, most: int) -> str:
    """Check bounds of the jogs of a visit: -1 -1 where no flip leads to the side; `most` is -1 if none is claimed."""
    if jogs is None:
        return "" if (least, most) == (-1, -1) else "no flip leads to it"
    if not 0 <= least <= jogs[0]:
        return "the least number of jogs of a visit is not proved"
    right = most == -1 or 0 <= jogs[1] <= most
    return "" if right else "the largest number of jogs of a visit is not proved"


def check_bands(c: Cells, inside: Array, side: int, bands: int) -> str:
    """Check that every orbit of the block comes to so many of its intervals on a side; "" or the reason."""
    own = inside & (c.side == side)
    number = np.cumsum(np.diff(own.astype(np.int8), prepend=0) == 1)
    met = 0
    for k in range(1, int(number.max(initial=0)) + 1):
        late = not_arriving(c, [c.jog, c.flip], inside, own & (number == k), int(inside.sum()))
        met += not late.any()
    return "" if 0 <= bands <= met else f"that every orbit comes to {bands} of its intervals is not proved"


def comes_round(c: Cells, inside: Array, visits: list[tuple[int, int] | None]) -> bool:
    """Whether every orbit of a block leaves every side again, so that flips lead it round; or stays on its one side."""
    sides = [bool((inside & (c.side == i)).any()) for i in range(len(visits))]
    if sum(sides) == 1 and not any(visits):
        return not (c.flip[inside, 0] >= 0).any()
    return all(sides) and all(jogs is not None and jogs[1] >= 0 for jogs in visits)


# ------------------------------------------------------------------------------------------------- the orbit


def check_chain(scene: Scene, goal: dict[str, Any] | None, claimed: Claimed) -> str:
    """Check that every parameter has a periodic orbit which violates the goal; "" or the reason.

    Each interval of the chain lies where the decision is proved and, f being concave, the throw is continuous.  Where
    its ends go the image holds the next interval, and that of the last one the first: by the intermediate value theorem
    there is an orbit through the intervals in turn, back to its start, for each parameter.
    """
    if goal is None or goal["anywhere"] or goal["kind"] not in ("oriented_beyond", "flip_order", "reaches"):
        return "the goal is none that a periodic orbit refutes"
    if goal["kind"] == "reaches" and not goal["every"]:
        return "the goal speaks of almost every orbit"
    prove(all(bool(s.concave) for s in scene.sides), "kappa > ell is not proved")
    prove(len(claimed.chain) > 0, "it is missing")
    throws, states = Throws(scene), list[State]()
    for k, ((side, branch), (lo, hi)) in enumerate(zip(claimed.chain, claimed.ends, strict=True)):
        prove(0 <= side < len(scene.sides) and branch in (0, 1), "a side or a branch is none")
        s = scene.sides[side]
        prove(
            lo < hi and bool(arb(lo) > s.a) and bool(arb(hi) <= s.arm), f"interval {k} is not one of the arm"
        )
        prove(decided_on(throws, side, branch, lo, hi), f"the decision on interval {k} is not proved")
        after = (k + 1) % len(claimed.chain)
        on = (side + branch) % len(scene.sides)
        prove(claimed.chain[after][0] == on, f"throw {k} leads to another side")
        shift = s.shift if branch else arb(0)
        first, last = (throws.box(side, arb(x), arb(x), scene.k_lo, scene.k_hi) for x in (lo, hi))
        low, high = claimed.ends[after]
        holds = bool(first.hi - shift < low) and bool(last.lo - shift > high)
        prove(holds, f"that the image of interval {k} holds the next one is not proved")
        states.append((side, arb(lo), arb(hi)))
    prove(breaks(scene, goal, states), "no place of the orbit violates the goal")
    return ""


def decided_on(throws: Throws, side: int, branch: int, lo: float, hi: float) -> bool:
    """Whether the decision is proved on an interval, cut into pieces in x and in kappa where need be."""
    stack, cut = [(arb(lo), arb(hi), throws.scene.k_lo, throws.scene.k_hi)], 0
    while stack:
        piece = stack.pop()
        cut += 1
        if throws.box(side, *piece).decision == branch:
            continue
        halves = halved_box(*piece)
        if cut > MOST_CUT or not halves:
            return False
        stack += halves
    return True
