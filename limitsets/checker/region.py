"""One cell of a plane of parameters: all that is claimed of every parameter in it.

docs/certificates.md, "Regions": the attracting blocks and the starts that come to them, the goal, what the blocks are
like, and the orbit that refutes the goal for every parameter.
"""

import copy
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .balls import ZERO, Array, Pair, UnprovedError, about, prove
from .cells import (
    Checked,
    Failure,
    check_cells_of,
    check_components,
    check_structure,
    targets_of,
    tasks_of,
)
from .end_points import Piece, Throws, unproved_of
from .file import BadFileError, Cells
from .goals import check_goal, goal_of_scene
from .near_hinge import not_arriving
from .refutations import State, breaks
from .scene import Scene, place_of, read_scene
from .starts import Starts, check_starts, require_fitting, shares

UNDECIDED, GOAL_PROVED, GOAL_REFUTED = 0, 1, 2
LARGEST_OPEN = (
    0.01  # the share of the arm of whose starts nothing may be known where starts are claimed from some x on
)
MOST_CUT = 64  # pieces of an interval of an orbit, so that the decision is proved on it


class Claimed(NamedTuple):
    """What is claimed of one cell of parameters; `grid` is None where nothing is but, perhaps, the refutation."""

    number: int
    raw: dict[str, Any]  # the scene
    ranges: dict[str, list[str]]  # its two quantities, as pairs of texts
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

    @property
    def cells(self) -> Array:
        """One entry for each cell of the arm."""
        return self.arrays["rank"]


def check_region_cell(claimed: Claimed) -> Checked:
    """Check everything that is claimed of one cell of parameters."""
    try:
        check_claimed(claimed)
    except (BadFileError, UnprovedError) as error:
        return claimed.number, Failure("region", str(error)), 0
    return -1, None, 0


def check_claimed(claimed: Claimed) -> None:
    """Check the orbit that refutes the goal, and the record of the cell of parameters."""
    raw = copy.deepcopy(claimed.raw)
    for name, ends in claimed.ranges.items():
        holder, at = place_of(raw, name)
        holder[at] = ends
    scene = read_scene(raw, None)
    goal = goal_of_scene(raw, len(scene.sides), checked=True)
    if claimed.goal == GOAL_REFUTED:
        check_chain(scene, goal, claimed)
    else:
        said = "an orbit refutes the goal, but it is not said to be refuted"
        prove(not claimed.chain, said)
    if claimed.grid is None:
        empty = claimed.goal != GOAL_PROVED and not claimed.blocks
        prove(empty, "something is claimed of it, but it has no cells")
    else:
        check_record(scene, goal, claimed)


def check_record(scene: Scene, goal: dict[str, Any] | None, claimed: Claimed) -> None:
    """Check the blocks, the starts that come to them, the goal if it is claimed, and the throws."""
    c = cells_of(claimed)
    check_structure(c, scene)
    check_components(c)
    starts = starts_of(claimed)
    every_throw = False
    if claimed.goal == GOAL_PROVED:
        known = claimed.starts != "cells" and 1.0 - sum(shares(c, scene, starts, c.rank >= 0)) <= LARGEST_OPEN
        prove(known, "starts of more than 1 % of the arm are open")
        if goal is not None:
            check_goal_of_cell(c, scene, goal, starts, claimed.counts)
            every_throw = bool(goal["anywhere"])
    pseudo = {"kind": "region", "every": True, "anywhere": False}
    require_fitting(starts, pseudo, False, [starts.fixed(i) for i in range(len(c.edges))])
    check_starts(c, scene, pseudo, starts)
    check_blocks(c, claimed.blocks)
    # decision, landing and images of the cells of which something is claimed
    chosen = np.flatnonzero((c.component >= 0) | (c.rank >= 0) | every_throw)
    for task in tasks_of(c, scene, 0, chosen, None):
        cell, failure, _ = check_cells_of(scene, task)
        if failure is not None:
            raise UnprovedError(f"{c.name(cell)}: {failure.text}")


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
) -> None:
    """Check that the scene's goal holds of the blocks, for the starts claimed."""
    almost = goal["kind"] == "reaches" and not goal["every"]
    kind = "almost-every" if almost and starts.kind == "every" else starts.kind
    own = goal | {"throws": counts[1], "jogs": counts[2], "starts": starts._replace(kind=kind)}
    require_fitting(own["starts"], own, almost, [starts.fixed(i) for i in range(len(c.edges))])
    check_goal(c, scene, own)


# ------------------------------------------------------------------------------------------------- the blocks


def check_blocks(c: Cells, blocks: list[list[int]]) -> None:
    """Check what is said of each block: its visits, its flip order, its bands."""
    prove([row[0] for row in blocks] == list(range(len(blocks))), "the blocks are not numbered from 0")
    components = set(np.unique(c.component).tolist()) - {-1}
    prove(components == set(range(len(blocks))), "the blocks are not the components")
    for number, ordered, *rest in blocks:
        inside, n = c.component == number, len(c.edges)
        visits = [visits_of(c, inside, i) for i in range(n)]
        for i, (bands, least, most) in enumerate(zip(rest[::3], rest[1::3], rest[2::3], strict=True)):
            with about(f"block {number}, side {i}"):
                check_visits(visits[i], least, most)
                check_bands(c, inside, i, bands)
        round_it = not ordered or comes_round(c, inside, visits)
        prove(round_it, f"block {number}: that its orbits come to the sides in order is not proved")


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


def check_visits(jogs: tuple[int, int] | None, least: int, most: int) -> None:
    """Check bounds of the jogs of a visit: -1 -1 where no flip leads to the side; `most` is -1 if none is claimed."""
    if jogs is None:
        prove((least, most) == (-1, -1), "no flip leads to it")
        return
    prove(0 <= least <= jogs[0], "the least number of jogs of a visit is not proved")
    prove(most == -1 or 0 <= jogs[1] <= most, "the largest number of jogs of a visit is not proved")


def check_bands(c: Cells, inside: Array, side: int, bands: int) -> None:
    """Check that every orbit of the block comes to so many of its intervals on a side."""
    own = inside & (c.side == side)
    number = np.cumsum(np.diff(own.astype(np.int8), prepend=0) == 1)
    met = 0
    for k in range(1, int(number.max(initial=0)) + 1):
        late = not_arriving([c.jog, c.flip], inside, own & (number == k), int(inside.sum()))
        met += not late.any()
    prove(0 <= bands <= met, f"that every orbit comes to {bands} of its intervals is not proved")


def comes_round(c: Cells, inside: Array, visits: list[tuple[int, int] | None]) -> bool:
    """Whether every orbit of a block leaves every side again, so that flips lead it round; or stays on its one side."""
    sides = [bool((inside & (c.side == i)).any()) for i in range(len(visits))]
    if sum(sides) == 1 and not any(visits):
        return not (c.flip[inside, 0] >= 0).any()
    return all(sides) and all(jogs is not None and jogs[1] >= 0 for jogs in visits)


# ------------------------------------------------------------------------------------------------- the orbit


def check_chain(scene: Scene, goal: dict[str, Any] | None, claimed: Claimed) -> None:
    """Check that every parameter has a periodic orbit which violates the goal.

    Each interval of the chain lies where the decision is proved and, f being concave, the throw is continuous.  Where
    its ends go the image holds the next interval, and that of the last one the first: by the intermediate value theorem
    there is an orbit through the intervals in turn, back to its start, for each parameter.
    """
    why = "the orbit that refutes the goal: "
    if goal is None or goal["anywhere"] or goal["kind"] not in ("oriented_beyond", "flip_order", "reaches"):
        raise UnprovedError(why + "the goal is none that a periodic orbit refutes")
    prove(goal["kind"] != "reaches" or goal["every"], why + "the goal speaks of almost every orbit")
    prove(all(bool(s.concave) for s in scene.sides), "kappa > ell is not proved")
    prove(len(claimed.chain) > 0, "it is missing")
    throws, states = Throws(scene), list[State]()
    for k, ((side, branch), (lo, hi)) in enumerate(zip(claimed.chain, claimed.ends, strict=True)):
        prove(0 <= side < len(scene.sides) and branch in (0, 1), "a side or a branch is none")
        s = scene.sides[side]
        prove(
            lo < hi and bool(arb(lo) > s.a) and bool(arb(hi) <= s.arm), f"interval {k} is not one of the arm"
        )
        unproved = unproved_of(throws, Piece(side, lo, hi, branch, 0), MOST_CUT)
        prove(not unproved, f"the decision on interval {k} is not proved")
        after = (k + 1) % len(claimed.chain)
        on = (side + branch) % len(scene.sides)
        prove(claimed.chain[after][0] == on, f"throw {k} leads to another side")
        shift = s.shift if branch else ZERO
        first, last = (throws.box(side, arb(x), arb(x), scene.k_lo, scene.k_hi) for x in (lo, hi))
        low, high = claimed.ends[after]
        holds = bool(first.hi - shift < low) and bool(last.lo - shift > high)
        prove(holds, f"that the image of interval {k} holds the next one is not proved")
        states.append((side, arb(lo), arb(hi)))
    prove(breaks(scene, goal, states), "no place of the orbit violates the goal")
