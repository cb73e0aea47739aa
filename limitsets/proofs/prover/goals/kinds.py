"""The kinds of goal whose proof is short: one component, on the arm, in order, on one side, a predicate of the caller.

`reaches.py` has the one that is longer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.goals import AttractsAll, FlipOrder, OrientedBeyond, Predicate, StaysOnArm
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.bands import throws_below
from limitsets.proofs.prover.cover import targets
from limitsets.proofs.prover.goals.kind import (
    Answer,
    Kind,
    above,
    against,
    begins,
    below,
    common,
    once,
    place_text,
    proved_unless,
    thrown_into,
    throws_to_reach,
    undecided,
)
from limitsets.proofs.prover.goals.recurrent_orbits import (
    Loop,
    Refutation,
    cycle_that,
    meets,
    recurrent_violation,
)
from limitsets.proofs.prover.goals.violating_orbits import State, one_throw, start_that_leaves
from limitsets.proofs.prover.thinning import perron_frobenius_bound, slopes
from limitsets.systems.cells import CellSet, cell_ends
from limitsets.systems.maps import codes

# ----------------------------------------------------------------
# attracts_all
#
# One attracting component takes every start.


TWO_BASINS = (
    "starts nearer to the joint than the fixed point of the jog tend to the joint: there are two basins"
)


def _prove_attracts_all(attraction: Attraction, _: Scene, goal: AttractsAll) -> Answer:
    several = int(attraction.component.max(initial=-1)) + 1
    if several > 1:  # each is mapped into itself, however fine the cells are
        reason = f"{several} attracting components are each mapped into themselves: none takes every start"
        return undecided(reason, final=True)
    missing = common(attraction, anywhere=False)
    if missing:
        return undecided(missing)
    if attraction.basin.creeps:
        return undecided(TWO_BASINS, final=True)
    starts = attraction.basin.starts
    if goal.laid:
        starts = "almost-every" if attraction.basin.thinning else "every"
    enough = starts == "every" or (starts == "almost-every" and not goal.from_anywhere)
    return Answer("proved", "", {"kind": goal.kind}) if enough else undecided(attraction.missing)


def _refute_attracts_all(attraction: Attraction, _: Scene, goal: AttractsAll) -> Answer:
    if attraction.basin.creeps:
        side = int(np.argmax([point.lo for point in attraction.cover.points]))
        x = 0.5 * (float(attraction.cover.box.bare[1].a[side]) + attraction.cover.points[side].lo)
        return against(Refutation((State(x, x, side, None),), "almost-every"), TWO_BASINS)
    return once(start_that_leaves(attraction, goal.laid), attraction.missing)


ATTRACTS_ALL = Kind(
    _prove_attracts_all,
    _refute_attracts_all,
    lambda _: "The attracting cells are one component.",
    lambda _: (),
    rechecked=True,
)


# ----------------------------------------------------------------
# stays_on_arm
#
# No throw carries a part off the arm or into the joint: from the attracting cells, or from anywhere on the arm.


def _prove_stays_on_arm(attraction: Attraction, _: Scene, goal: StaysOnArm) -> Answer:
    section = {"kind": goal.kind} | ({"from_anywhere": True} if goal.from_anywhere else {})
    return proved_unless(common(attraction, anywhere=goal.from_anywhere), section)


def _refute_stays_on_arm(attraction: Attraction, _: Scene, goal: StaysOnArm) -> Answer:
    return once(start_that_leaves(attraction, goal.laid), attraction.missing)


def _sentence_stays_on_arm(section: Mapping[str, Any]) -> str:
    if section.get("from_anywhere"):
        if isinstance(section.get("starts"), dict):
            return "From there no throw ever leads off the arm or into the joint."
        return "From every position on the arm and every side, no throw ever leads off the arm or into the joint."
    return "No throw leads out of the attracting cells, so none leads off the arm."


STAYS_ON_ARM = Kind(
    _prove_stays_on_arm, _refute_stays_on_arm, _sentence_stays_on_arm, lambda _: (), rechecked=True
)


# ----------------------------------------------------------------
# flip_order
#
# The sides follow each other in one cyclic order.
#
# In the minimal map a flip leads from side i to side i + 1, so the only question is whether every orbit leaves every
# side again: whether jogs alone, peeled off the attracting cells, come to an end.


AGAINST = "a flip leads from each side to the one that is next in number, and the last one's to side 0"


def _prove_flip_order(attraction: Attraction, _: Scene, goal: FlipOrder) -> Answer:
    missing = common(attraction, anywhere=False)
    if missing:
        return undecided(missing)
    inside = attraction.component >= 0
    if len(goal.order) == 1 and not goal.from_anywhere:
        on = cell_ends(attraction.cover.grid)[0]
        if not (inside & (on != goal.order[0])).any():
            return Answer("proved", "", {"kind": goal.kind, "order": list(goal.order), "jogs": 0})
    if not _is_cycle(goal.order, attraction.cover.grid.sides):
        return undecided(AGAINST, final=True)
    if goal.from_anywhere and attraction.missing:
        return undecided(attraction.missing, final=attraction.cover.box.landing > 0.0 and not goal.laid)
    others = {of for images in attraction.cover.images for _, of in images.hulls} - {codes.JOG, codes.FLIP}
    if any((targets(attraction.cover, branch)[inside, 0] >= 0).any() for branch in others):
        return undecided(
            "parts may roll on to other sides than the next, in this version no order is proved then"
        )
    visits, left = throws_to_reach(attraction, inside, np.zeros_like(inside), codes.JOG)
    lasting = f"orbits may jog for ever on {attraction.cover.place(int(left[0]))}" if left.size else ""
    section = {"kind": goal.kind, "order": list(goal.order), "jogs": max(visits - 1, 0)}
    return proved_unless(lasting, section | ({"from_anywhere": True} if goal.from_anywhere else {}))


def _refute_flip_order(attraction: Attraction, scene: Scene, goal: FlipOrder) -> Answer:
    missing = common(attraction, anywhere=False)
    if missing:
        return undecided(missing)

    def otherwise(loop: Loop) -> bool:
        return meets(loop, goal.laid) and _flips_otherwise(loop, goal.order)

    if not _is_cycle(goal.order, attraction.cover.grid.sides):
        return against(cycle_that(attraction, scene, otherwise), AGAINST)
    return against(
        cycle_that(attraction, scene, lambda loop: meets(loop, goal.laid) and not loop.branches.any())
    )


def _is_cycle(order: tuple[int, ...], sides: int) -> bool:
    """Whether these are all sides, each followed by the one that a flip leads to."""
    return len(order) == sides and all(
        (a + 1) % sides == b for a, b in zip(order, (*order[1:], order[0]), strict=True)
    )


def _flips_otherwise(loop: Loop, order: tuple[int, ...]) -> bool:
    """Whether a periodic orbit has a flip that the order has not."""
    allowed = set(zip(order, (*order[1:], order[0]), strict=True))
    pairs = zip(loop.side.tolist(), np.roll(loop.side, -1).tolist(), strict=True)
    return any(a != b and (a, b) not in allowed for a, b in pairs)


def _sentence_flip_order(section: Mapping[str, Any]) -> str:
    order = ", ".join(str(side) for side in section["order"])
    if len(section["order"]) == 1:
        return f"In the attracting cells, a part stays on side {order}."
    where = f"From {begins(section)}" if section.get("from_anywhere") else "In the attracting cells"
    jogs = f"in the attracting cells {section['jogs']} jogs at most follow each other"
    return f"{where}, parts come to lie on sides {order} in turn, again and again; {jogs}."


FLIP_ORDER = Kind(_prove_flip_order, _refute_flip_order, _sentence_flip_order, lambda _: (), rechecked=True)


# ----------------------------------------------------------------
# oriented_beyond
#
# Beyond x every part lies on one side: of the attracting cells, or of every throw from anywhere on the arm.


def _exceptions(attraction: Attraction, goal: OrientedBeyond) -> Mask:
    """Cells that lie, in part, beyond x on another side."""
    side, _, hi = cell_ends(attraction.cover.grid)
    bad: Mask = (side != goal.side) & (hi > below(goal.x))
    return bad


def _prove_oriented_beyond(attraction: Attraction, scene: Scene, goal: OrientedBeyond) -> Answer:
    missing = common(attraction, anywhere=goal.from_anywhere)
    bad = _exceptions(attraction, goal)
    more: dict[str, Any] = {}
    if goal.from_anywhere:
        reason = _thrown_there(attraction, goal, bad)
        # above the joint no cells are near enough: say that, not that a throw from there may land anywhere
        reason = missing if attraction.cover.points else reason or missing
    else:
        bad &= attraction.component >= 0
        cells = "1 attracting cell reaches" if bad.sum() == 1 else f"{bad.sum()} attracting cells reach"
        beyond = f"{cells} beyond x = {goal.x:g} {scene.unit} on other sides than {goal.side}"
        reason = missing or (beyond if bad.any() else "")
        throws = throws_below(attraction, bad, below(goal.x)) if reason and not missing else 0
        if throws:
            reason, more = "", {"throws": throws}
    if reason:
        return undecided(reason)
    ends = max(hi for parts in attraction.cells.extents().values() for _, hi in parts)
    before = f"the attracting cells end at x = {ends:.6g} {scene.unit}, before x = {goal.x:g}"
    vacuous = f"{before}: the goal asks nothing of them"
    note = vacuous if ends <= goal.x and not goal.from_anywhere else ""
    section: dict[str, Any] = {"kind": goal.kind, "x": place_text(goal, scene), "side": goal.side}
    section |= {"from_anywhere": True} if goal.from_anywhere else {}
    return Answer("proved", "", section | more, note=note)


def _refute_oriented_beyond(attraction: Attraction, scene: Scene, goal: OrientedBeyond) -> Answer:
    wrong = goal.wrong()
    if not goal.from_anywhere:
        refutation = recurrent_violation(attraction, scene, wrong, goal.laid)
        again = _again(attraction, goal) if refutation.of == "every" else {}
        if again:
            refutation = refutation._replace(of="almost-every", recurs={**refutation.recurs, **again})
        return against(refutation)
    reason = _thrown_there(attraction, goal, _exceptions(attraction, goal))
    return once(one_throw(attraction, wrong, laid=goal.laid) if reason else (), reason)


def _again(attraction: Attraction, goal: OrientedBeyond) -> dict[str, int]:
    """Find an attracting component almost every orbit of which violates the goal again and again.

    Almost every orbit leaves the cells of the component that do not violate the goal.  Where the slope is positive, a
    throw carries no set of positive length into one of length zero: so almost every orbit leaves them after each throw.
    """
    side, lo, _ = cell_ends(attraction.cover.grid)
    bad = (side != goal.side) & (lo >= above(goal.x))
    for number in np.unique(attraction.component[bad & (attraction.component >= 0)]).tolist():
        mine = attraction.component == number
        if (slopes(attraction.cover, CellSet(attraction.cover.grid, mine))[mine] > 0.0).all():
            throws, _, reason = perron_frobenius_bound(attraction.cover, mine & ~bad)
            if not reason:
                return {"component": number, "thinning": throws}
    return {}


def _thrown_there(attraction: Attraction, goal: OrientedBeyond, bad: Mask) -> str:
    """Name a throw that may land beyond x on another side; empty if there is none."""
    start = thrown_into(attraction, bad)
    if start:
        return f"a throw from {start} may land beyond x = {goal.x:g} on another side than {goal.side}"
    for side, near in enumerate(attraction.joint):
        if (side != goal.side or near.rolls) and not near.reach <= below(goal.x):
            return f"a throw from near the joint on side {side} may land beyond x = {goal.x:g}"
    return ""


def _sentence_oriented_beyond(section: Mapping[str, Any]) -> str:
    beyond = f"at rest beyond x = {section['x']} lies on side {section['side']}."
    if section.get("from_anywhere"):
        return f"After a throw from {begins(section)}, every part {beyond}"
    if section.get("throws"):
        throws = "a throw" if section["throws"] == 1 else f"{section['throws']} throws"
        return f"After {throws} with the same parameters in the attracting cells, every part {beyond}"
    return f"In the attracting cells, every part {beyond}"


ORIENTED_BEYOND = Kind(
    _prove_oriented_beyond,
    _refute_oriented_beyond,
    _sentence_oriented_beyond,
    lambda goal: [below(goal.x)],
    rechecked=True,
)


# ----------------------------------------------------------------
# predicate
#
# A predicate of the caller: of every attracting cell, or of every landing from anywhere on the arm.
#
# The proof trusts the caller's code: no certificate can hold the code, and nothing rechecks it.  An orbit refutes the
# predicate if it is false at both ends and in the middle of the enclosure of the orbit's last state.


def _good(goal: Predicate, lo: Array, hi: Array, side: int) -> Mask:
    """Ask the caller, and refuse what is no answer."""
    said = np.asarray(goal.holds(lo, hi, side))
    if said.dtype != np.bool_ or said.shape != lo.shape:
        allowed = f"an array of bool of shape {lo.shape}"
        raise AnswerError(
            f"what {goal.name} returns", f"{said.dtype} of shape {said.shape}", allowed, "correct it"
        )
    return said


def _missing_of_predicate(attraction: Attraction, goal: Predicate) -> str:
    """Say where it is not proved; empty if it is."""
    edges_of_sides = enumerate(attraction.cover.grid.edges)
    bad = ~np.concatenate([_good(goal, edges[:-1], edges[1:], side) for side, (edges,) in edges_of_sides])
    if not goal.from_anywhere:
        wrong = np.flatnonzero(bad & (attraction.component >= 0))
        return f"{goal.name}: not on {attraction.cover.place(int(wrong[0]))}" if wrong.size else ""
    start = thrown_into(attraction, bad)
    if start:
        return f"{goal.name}: not where a throw from {start} may land"
    foot = attraction.cover.box.bare[0].a
    for side, near in enumerate(attraction.joint):
        if near.empty:
            continue
        landing = np.array([foot[side]]), np.array([near.reach])
        if near.rolls or not _good(goal, *landing, side).all():
            return f"{goal.name}: not where a throw from near the joint on side {side} may land"
    return ""


def _prove_predicate(attraction: Attraction, _: Scene, goal: Predicate) -> Answer:
    missing = common(attraction, anywhere=goal.from_anywhere)
    reason = missing or _missing_of_predicate(attraction, goal)
    return proved_unless(reason, {"kind": goal.kind, "name": goal.name})


def _refute_predicate(attraction: Attraction, scene: Scene, goal: Predicate) -> Answer:
    def wrong(x: Any, side: Any) -> Mask:
        bad = np.zeros(x.shape, dtype=bool)
        for s in np.unique(side).tolist():
            mine = side == s
            bad[mine] = ~_good(goal, x[mine], x[mine], s)
        return bad

    if not goal.from_anywhere:
        return against(recurrent_violation(attraction, scene, wrong, goal.laid))
    orbit = one_throw(attraction, wrong, laid=goal.laid)
    return once(orbit if orbit and _throughout(goal, orbit[-1]) else ())


def _throughout(goal: Predicate, last: State) -> bool:
    x = np.array([last.lo, 0.5 * (last.lo + last.hi), last.hi])
    return not _good(goal, x, x, last.side).any()


PREDICATE = Kind(
    _prove_predicate,
    _refute_predicate,
    lambda section: f"In the attracting cells: {section['name']}, as its code says.",
    lambda goal: goal.cuts,
)
