"""Beyond x every part lies on one side: of the attracting cells, or of every throw from anywhere on the arm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from limitsets.base.arrays import Mask
from limitsets.feeder.goals import OrientedBeyond
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.cover import cell_ends
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
    thrown_into,
    undecided,
)
from limitsets.proofs.prover.goals.recurrent_orbits import recurrent_violation
from limitsets.proofs.prover.goals.violating_orbits import one_throw
from limitsets.proofs.prover.thinning import perron_frobenius_bound, slopes
from limitsets.proofs.prover.two_throws import stays_below
from limitsets.systems.cells import CellSet


def _exceptions(attraction: Attraction, goal: OrientedBeyond) -> Mask:
    """Cells that lie, in part, beyond x on another side."""
    side, _, hi = cell_ends(attraction.cover.grid)
    bad: Mask = (side != goal.side) & (hi > below(goal.x))
    return bad


def _prove(attraction: Attraction, scene: Scene, goal: OrientedBeyond) -> Answer:
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
        if reason and not missing and stays_below(attraction, scene, bad, below(goal.x)):
            reason, more = "", {"throws": 2}
    if reason:
        return undecided(reason)
    ends = max(hi for parts in attraction.cells.extents().values() for _, hi in parts)
    before = f"the attracting cells end at x = {ends:.6g} {scene.unit}, before x = {goal.x:g}"
    vacuous = f"{before}: the goal asks nothing of them"
    note = vacuous if ends <= goal.x and not goal.from_anywhere else ""
    return Answer("proved", "", section_of(goal, scene) | more, note=note)


def section_of(goal: OrientedBeyond, scene: Scene) -> dict[str, Any]:
    """Write the goal as a certificate has it."""
    section = {"kind": goal.kind, "x": place_text(goal, scene), "side": goal.side}
    return section | ({"from_anywhere": True} if goal.from_anywhere else {})


def _refute(attraction: Attraction, scene: Scene, goal: OrientedBeyond) -> Answer:
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


def _sentence(section: Mapping[str, Any]) -> str:
    beyond = f"at rest beyond x = {section['x']} lies on side {section['side']}."
    if section.get("from_anywhere"):
        return f"After a throw from {begins(section)}, every part {beyond}"
    if section.get("throws"):
        return f"After two throws with the same parameters in the attracting cells, every part {beyond}"
    return f"In the attracting cells, every part {beyond}"


KIND = Kind(_prove, _refute, _sentence, lambda goal: [below(goal.x)], rechecked=True)
