"""Orbits come to rest on a side at x or beyond: every one, or all but a set of starts of length zero."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from limitsets.base.arrays import Mask
from limitsets.feeder.goals import Reaches
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.goals.kind import (
    Answer,
    Kind,
    above,
    against,
    begins,
    below,
    common,
    place_text,
    proved_unless,
    throws_to_reach,
    undecided,
)
from limitsets.proofs.prover.goals.recurrent_orbits import Loop, Refutation, cycle_that, meets
from limitsets.proofs.prover.goals.violating_orbits import sample_passage
from limitsets.proofs.prover.thinning import perron_frobenius_bound, slopes
from limitsets.systems.cells import CellSet, cell_ends


def _wanted(attraction: Attraction, goal: Reaches) -> Mask:
    """Cells on the side that lie at x or beyond."""
    side, lo, _ = cell_ends(attraction.cover.grid)
    wanted: Mask = (side == goal.side) & (lo >= above(goal.x))
    return wanted


def _refute(attraction: Attraction, scene: Scene, goal: Reaches) -> Answer:
    every = goal.every_orbit

    def refutes(loop: Loop) -> bool:
        return (every or loop.attracts) and meets(loop, goal.laid) and not _arrives(loop, goal)

    never = cycle_that(attraction, scene, refutes, attracting=not every)
    short = falls_short(attraction, goal)
    if short is None:
        return against(never)
    return short._replace(counterexample=never.states) if never.states else short


def _prove(attraction: Attraction, scene: Scene, goal: Reaches) -> Answer:
    missing = common(attraction, anywhere=False)
    if missing:
        return undecided(missing)
    wanted, inside = _wanted(attraction, goal), attraction.component >= 0
    short = falls_short(attraction, goal)
    if short is not None:
        return short
    if goal.every_orbit:
        return _every(attraction, scene, goal, wanted)
    missing = (attraction.missing or not_null(attraction)) if goal.from_anywhere else ""
    if missing:
        return undecided(missing, final=attraction.cover.box.landing > 0.0 and not goal.laid)
    throws, _, reason = perron_frobenius_bound(attraction.cover, inside & ~wanted)
    # a little more, so that other arithmetic can confirm it
    return proved_unless(reason, _section(scene, goal, throws + throws // 8 + 1))


def not_null(attraction: Attraction) -> str:
    """Say what is missing for this: almost no start of the basin comes to a given set of length zero.

    Where the slope is positive, the starts that are thrown to a set of length zero have length zero.
    """
    basin = attraction.basin
    for side, near in enumerate(attraction.joint):
        if basin.near and not near.rises:
            return f"near the joint on side {side}: the landing is not proved to rise with the start"
    off = (attraction.component < 0) & (basin.rank >= 0)
    flat = np.flatnonzero(off & ~(slopes(attraction.cover, CellSet(attraction.cover.grid, off)) > 0.0))
    return f"the slope is not proved positive on {attraction.cover.place(int(flat[0]))}" if flat.size else ""


def _every(attraction: Attraction, scene: Scene, goal: Reaches, wanted: Mask) -> Answer:
    missing = common(attraction, anywhere=True) if goal.from_anywhere else ""
    cells = attraction.basin.rank >= 0 if goal.laid else np.ones_like(wanted)
    cells = cells if goal.from_anywhere else attraction.component >= 0
    throws, left = throws_to_reach(attraction, cells, wanted)
    if left.size:
        return undecided(f"an orbit from {attraction.cover.place(int(left[0]))} may never get there")
    final = attraction.cover.box.landing > 0.0 and not goal.laid
    return proved_unless(missing, _section(scene, goal, throws), final=final)


def _section(scene: Scene, goal: Reaches, throws: int) -> dict[str, Any]:
    section = {
        "kind": goal.kind,
        "x": place_text(goal, scene),
        "side": goal.side,
        "every_orbit": goal.every_orbit,
        "throws": throws,
    }
    return section | ({"from_anywhere": True} if goal.from_anywhere else {})


def _arrives(loop: Loop, goal: Reaches) -> bool:
    """Whether it is not excluded that a periodic orbit gets there."""
    return bool(((loop.side == goal.side) & (loop.hi >= below(goal.x))).any())


def falls_short(attraction: Attraction, goal: Reaches) -> Answer | None:
    """Refute the goal by an attracting component that ends below x: no orbit in it gets there.

    The component is mapped into itself and has an interior, so a set of starts of positive length never gets there.
    The orbit is an illustration; the proof does not need it.
    """
    side, _, hi = cell_ends(attraction.cover.grid)
    reach = (side == goal.side) & (hi >= below(goal.x))
    for number in range(int(attraction.component.max(initial=-1)) + 1):
        mine = attraction.component == number
        if not (mine & reach).any():
            cells = np.flatnonzero(mine)
            reason = (
                f"no orbit in the attracting component of {attraction.cover.place(int(cells[0]))} gets there"
            )
            return against(
                Refutation(sample_passage(attraction, cells), "almost-every", {"component": number}), reason
            )
    return None


def _sentence(section: Mapping[str, Any]) -> str:
    where = begins(section) if section.get("from_anywhere") else "in the attracting cells"
    there = f"comes to rest on side {section['side']} at x = {section['x']} or beyond"
    if section["every_orbit"]:
        return f"From every start {where} a part {there}, after {section['throws']} throws at most."
    return f"From every start {where}, but for starts of total length zero, a part {there}."


KIND = Kind(
    _prove,
    _refute,
    _sentence,
    lambda goal: [above(goal.x)],
    lambda goal: not goal.every_orbit,
    rechecked=True,
)
