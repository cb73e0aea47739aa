"""The sides follow each other in one cyclic order.

In the minimal map a flip leads from side i to side i + 1, so the only question is whether every orbit leaves every side
again: whether jogs alone, peeled off the attracting cells, come to an end.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.feeder.goals import FlipOrder
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.cover import cell_ends, targets
from limitsets.proofs.prover.goals.kind import (
    Answer,
    Kind,
    against,
    begins,
    common,
    throws_to_reach,
    undecided,
)
from limitsets.proofs.prover.goals.recurrent_orbits import Loop, cycle_that, meets
from limitsets.systems.maps import codes

AGAINST = "a flip leads from each side to the one that is next in number, and the last one's to side 0"


def _prove(attraction: Attraction, _: Scene, goal: FlipOrder) -> Answer:
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
    if any((ends[inside, 0] >= 0).any() for ends in _rolls(attraction)):
        return undecided(
            "parts may roll on to other sides than the next, in this version no order is proved then"
        )
    visits, left = throws_to_reach(attraction, inside, np.zeros_like(inside), codes.JOG)
    if left.size:
        return undecided(f"orbits may jog for ever on {attraction.cover.place(int(left[0]))}")
    section = {"kind": goal.kind, "order": list(goal.order), "jogs": max(visits - 1, 0)}
    return Answer("proved", "", section | ({"from_anywhere": True} if goal.from_anywhere else {}))


def _refute(attraction: Attraction, scene: Scene, goal: FlipOrder) -> Answer:
    if common(attraction, anywhere=False):
        return undecided(common(attraction, anywhere=False))

    def otherwise(loop: Loop) -> bool:
        return meets(loop, goal.laid) and _flips_otherwise(loop, goal.order)

    if not _is_cycle(goal.order, attraction.cover.grid.sides):
        return against(cycle_that(attraction, scene, otherwise), AGAINST)
    return against(
        cycle_that(attraction, scene, lambda loop: meets(loop, goal.laid) and not loop.branches.any())
    )


def _rolls(attraction: Attraction) -> list[NDArray[np.int32]]:
    """Target cells of all branches but jog and flip."""
    others = {of for images in attraction.cover.images for _, of in images.hulls} - {codes.JOG, codes.FLIP}
    return [targets(attraction.cover, branch) for branch in sorted(others)]


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


def _sentence(section: Mapping[str, Any]) -> str:
    order = ", ".join(str(side) for side in section["order"])
    if len(section["order"]) == 1:
        return f"In the attracting cells, a part stays on side {order}."
    where = f"From {begins(section)}" if section.get("from_anywhere") else "In the attracting cells"
    jogs = f"in the attracting cells {section['jogs']} jogs at most follow each other"
    return f"{where}, parts come to lie on sides {order} in turn, again and again; {jogs}."


KIND = Kind(_prove, _refute, _sentence, lambda _: (), rechecked=True)
