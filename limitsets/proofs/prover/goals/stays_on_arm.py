"""No throw carries a part off the arm or into the joint: from the attracting cells, or from anywhere on the arm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from limitsets.feeder.goals import StaysOnArm
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.goals.kind import Answer, Kind, common, once, undecided
from limitsets.proofs.prover.goals.violating_orbits import start_that_leaves


def _prove(attraction: Attraction, _: Scene, goal: StaysOnArm) -> Answer:
    missing = common(attraction, anywhere=goal.from_anywhere)
    if missing:
        return undecided(missing)
    return Answer("proved", "", {"kind": goal.kind} | ({"from_anywhere": True} if goal.from_anywhere else {}))


def _refute(attraction: Attraction, _: Scene, goal: StaysOnArm) -> Answer:
    return once(start_that_leaves(attraction, goal.laid), attraction.missing)


def _sentence(section: Mapping[str, Any]) -> str:
    if section.get("from_anywhere"):
        if isinstance(section.get("starts"), dict):
            return "From there no throw ever leads off the arm or into the joint."
        return "From every position on the arm and every side, no throw ever leads off the arm or into the joint."
    return "No throw leads out of the attracting cells, so none leads off the arm."


KIND = Kind(_prove, _refute, _sentence, lambda _: (), rechecked=True)
