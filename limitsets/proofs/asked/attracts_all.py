"""One attracting component takes every start on the arm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from limitsets.goals import AttractsAll
from limitsets.proofs.asked.kind import Answer, Kind, once, undecided
from limitsets.proofs.asked.starts import leaving
from limitsets.proofs.attraction import Attraction
from limitsets.scene import Scene

__all__ = ["KIND"]


def _ask(found: Attraction, _: Scene, goal: AttractsAll) -> Answer:
    several = int(found.component.max(initial=-1)) + 1
    if several > 1:  # each is mapped into itself, however fine the cells are
        reason = f"{several} attracting components are each mapped into themselves: none takes every start"
        return undecided(reason, final=True)
    if found.missing:
        return once(leaving(found), found.missing)
    return Answer("proved", "", {"kind": goal.kind})


def _sentence(_: Mapping[str, Any]) -> str:
    return "From every position on the arm and every side, a part comes into the one component of attracting cells."


KIND = Kind(_ask, _sentence, lambda _: ())
