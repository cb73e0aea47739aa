"""The scene's goal, asked of what is proved: one file per kind of goal, and one line here.

A file gives a `Kind`: how the goal is proved or refuted, how a proved one reads, and the borders that the cells need.
`limitsets/goals/ask.py` reads the same goals off samples; what each means is said there and in docs/certificates.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from limitsets.goals import Goal
from limitsets.proofs.asked import attracts_all, flip_order, oriented_beyond, predicate, reaches, stays_on_arm
from limitsets.proofs.asked.kind import Answer, Kind
from limitsets.proofs.asked.search import State
from limitsets.proofs.attraction import Attraction
from limitsets.scene import Scene

__all__ = ["Answer", "State", "ask", "borders", "prove", "sentence"]

KINDS: dict[str, Kind] = {
    "attracts_all": attracts_all.KIND,
    "flip_order": flip_order.KIND,
    "oriented_beyond": oriented_beyond.KIND,
    "predicate": predicate.KIND,
    "reaches": reaches.KIND,
    "stays_on_arm": stays_on_arm.KIND,
}


def ask(found: Attraction, scene: Scene, goal: Goal) -> Answer:
    """Prove or refute a goal.

    Parameters
    ----------
    found : Attraction
        What is proved of where starts end.
    scene : Scene
        The scene.
    goal : Goal
        Its goal.
    """
    return KINDS[goal.kind].ask(found, scene, goal)


def prove(found: Attraction, scene: Scene, goal: Goal) -> Answer:
    """Prove a goal, or say what is missing; what refutes it is not searched for where that would take longer.

    Parameters
    ----------
    found : Attraction
        What is proved of where starts end.
    scene : Scene
        The scene.
    goal : Goal
        What is asked.
    """
    kind = KINDS[goal.kind]
    return (kind.prove or kind.ask)(found, scene, goal)


def borders(goal: Goal | None) -> Sequence[float]:
    """Borders of cells that the goal needs on every side."""
    return () if goal is None else KINDS[goal.kind].borders(goal)


def sentence(section: Mapping[str, Any]) -> str:
    """Put a proved goal in words for people, from its section of the certificate."""
    return KINDS[section["kind"]].sentence(section)
