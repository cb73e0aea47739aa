"""One attracting component takes every start."""

from __future__ import annotations

import numpy as np

from limitsets.feeder.goals import AttractsAll
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.goals.kind import Answer, Kind, against, common, once, undecided
from limitsets.proofs.prover.goals.recurrent_orbits import Refutation
from limitsets.proofs.prover.goals.violating_orbits import State, start_that_leaves

TWO_BASINS = (
    "starts nearer to the joint than the fixed point of the jog tend to the joint: there are two basins"
)


def _prove(attraction: Attraction, _: Scene, goal: AttractsAll) -> Answer:
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
    if starts != "every" and (goal.from_anywhere or starts != "almost-every"):
        return undecided(attraction.missing)
    return Answer("proved", "", {"kind": goal.kind})


def _refute(attraction: Attraction, _: Scene, goal: AttractsAll) -> Answer:
    if attraction.basin.creeps:
        side = int(np.argmax([point.lo for point in attraction.cover.points]))
        x = 0.5 * (float(attraction.cover.box.bare[1].a[side]) + attraction.cover.points[side].lo)
        return against(Refutation((State(x, x, side, None),), "almost-every"), TWO_BASINS)
    return once(start_that_leaves(attraction, goal.laid), attraction.missing)


KIND = Kind(
    _prove, _refute, lambda _: "The attracting cells are one component.", lambda _: (), rechecked=True
)
