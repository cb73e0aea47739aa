"""The sides follow each other in one cyclic order.

In the minimal map a flip leads from side i to side i + 1, so the only question is whether every orbit leaves every side
again: whether jogs alone, peeled off the attracting cells, come to an end.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.goals import FlipOrder
from limitsets.maps import codes
from limitsets.proofs.asked.kind import Answer, Kind, against, common, peeled, place, undecided
from limitsets.proofs.asked.recurring import Loop, Refutation, cycle_that
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.certificate import targets
from limitsets.scene import Scene

__all__ = ["KIND"]


def _ask(found: Attraction, scene: Scene, goal: FlipOrder) -> Answer:
    sides = found.cover.grid.sides
    missing = common(found, anywhere=False)
    if missing:
        return undecided(missing)
    inside = found.component >= 0
    if len(goal.order) == 1 and not goal.from_anywhere:
        here = np.zeros_like(inside)
        here[found.cover.grid.of_side(goal.order[0])] = True
        if not (inside & ~here).any():
            return Answer("proved", "", {"kind": goal.kind, "order": list(goal.order), "jogs": 0})
    if not _is_cycle(goal.order, sides):
        reason = "a flip leads from each side to the one that is next in number, and the last one's to side 0"
        return against(_other_flip(found, scene, goal.order), reason, final=True)
    if goal.from_anywhere and found.missing:
        return undecided(found.missing, final=found.cover.box.landing > 0.0)
    if any((ends[inside, 0] >= 0).any() for ends in _rolls(found)):
        return undecided(
            "parts may roll on to other sides than the next, in this version no order is proved then"
        )
    visits, left = peeled(found, inside, np.zeros_like(inside), (0,))
    if left.size:
        stays = cycle_that(found, scene, lambda loop: not loop.branches.any())
        return against(stays, f"orbits may jog for ever on {place(found, int(left[0]))}")
    section = {"kind": goal.kind, "order": list(goal.order), "jogs": max(visits - 1, 0)}
    return Answer("proved", "", section | ({"from_anywhere": True} if goal.from_anywhere else {}))


def _rolls(found: Attraction) -> list[NDArray[np.int32]]:
    """Target cells of all branches but jog and flip."""
    others = {of for images in found.cover.images for _, of in images.hulls} - {codes.JOG, codes.FLIP}
    return [targets(found.cover, branch) for branch in sorted(others)]


def _is_cycle(order: tuple[int, ...], sides: int) -> bool:
    """Whether these are all sides, each followed by the one that a flip leads to."""
    return len(order) == sides and all(
        (a + 1) % sides == b for a, b in zip(order, (*order[1:], order[0]), strict=True)
    )


def _other_flip(found: Attraction, scene: Scene, order: tuple[int, ...]) -> Refutation:
    """Find a periodic orbit with a flip that the order has not."""
    allowed = set(zip(order, (*order[1:], order[0]), strict=True))

    def other(loop: Loop) -> bool:
        sides = loop.side.tolist()
        return any(a != b and (a, b) not in allowed for a, b in pairwise([*sides, sides[0]]))

    return cycle_that(found, scene, other)


def _sentence(section: Mapping[str, Any]) -> str:
    order = ", ".join(str(side) for side in section["order"])
    if len(section["order"]) == 1:
        return f"In the attracting cells, a part stays on side {order}."
    where = "From anywhere on the arm" if section.get("from_anywhere") else "In the attracting cells"
    jogs = f"in the attracting cells {section['jogs']} jogs at most follow each other"
    return f"{where}, parts come to lie on sides {order} in turn, again and again; {jogs}."


KIND = Kind(_ask, _sentence, lambda _: ())
