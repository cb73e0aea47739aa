"""Proofs of the scene's goal: by kind of goal a `Kind` in `kinds.py`, or in a file of its own, and one line here.

A kind says how the goal is proved of the attracting cells, how it is refuted, how a proved one reads, and the borders
that the cells need.  For which starts it is proved is added here, for all kinds alike, from the basin.
`limitsets/feeder/goals/` declares the goals and reads them off samples; what each means is said there and in
docs/certificates.md.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from limitsets.base import rounded
from limitsets.feeder.goals import Goal, laid_words, unknown_goal
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction, near_section
from limitsets.proofs.prover.basin import MOST_UNEXPLAINED
from limitsets.proofs.prover.from_foot import is_nearly_all, starts_from_foot
from limitsets.proofs.prover.goals import kinds, reaches
from limitsets.proofs.prover.goals.kind import Answer, Kind, undecided
from limitsets.proofs.prover.goals.laid_starts import (
    LITTLE,
    WHOLE,
    hexed,
    laid_only,
    narrowed,
    prove_laid,
    starts_in,
)
from limitsets.proofs.prover.goals.reaches import not_null
from limitsets.proofs.prover.goals.violating_orbits import State

__all__ = [
    "KINDS",
    "Answer",
    "Kind",
    "State",
    "cuts",
    "hexed",
    "prove",
    "prove_or_refute",
    "rechecked",
    "sentence",
]

KINDS: dict[str, Kind] = {
    "attracts_all": kinds.ATTRACTS_ALL,
    "flip_order": kinds.FLIP_ORDER,
    "oriented_beyond": kinds.ORIENTED_BEYOND,
    "predicate": kinds.PREDICATE,
    "reaches": reaches.KIND,
    "stays_on_arm": kinds.STAYS_ON_ARM,
}
"""What proves each goal, by its word."""


def _nothing(attraction: Attraction, scene: Scene, goal: Goal) -> Answer:
    return undecided(f"nothing proves {goal.kind} in this version", final=True)


# Of a goal that is declared without a proof.
NONE = Kind(_nothing, _nothing, lambda _: "", lambda _: ())


def _kind(goal: Goal) -> Kind:
    return KINDS.get(goal.kind, NONE)


def rechecked(goal: Goal) -> bool:
    """Whether the checker knows a goal, so that a certificate of it can be written."""
    return _kind(goal).rechecked


def prove(attraction: Attraction, scene: Scene, goal: Goal) -> Answer:
    """Prove a goal, and say for which starts; or say what is missing.

    Parameters
    ----------
    attraction : Attraction
        What is proved of where starts end.
    scene : Scene
        The scene.
    goal : Goal
        What is asked.

    Returns
    -------
    Answer
        "proved" for every start, almost every start, or the starts from some x on, or for all where parts are laid
        down; "proved-on-cells" where the goal is proved for the starts in some cells only; else "undecided".

    Raises
    ------
    AnswerError
        For what is no goal of `limitsets.goals`.
    """
    if not isinstance(goal, Goal):  # whatever it calls itself
        raise unknown_goal(goal)
    kind = _kind(goal)
    if goal.laid:
        return prove_laid(attraction, scene, goal, kind)
    answer = kind.prove(attraction, scene, goal)
    if answer.verdict != "proved":
        return answer
    if goal.from_anywhere and not goal.of_every_start:  # of every start, as its kind proves it
        starts = "almost-every" if kind.almost(goal) else "every"
        return answer._replace(section={**answer.section, "starts": starts}, starts=starts, shares=WHOLE)
    return _for_starts(attraction, answer, almost=kind.almost(goal))


def prove_or_refute(attraction: Attraction, scene: Scene, goal: Goal) -> Answer:
    """Prove a goal, as `prove`; where it is not proved, search for what refutes it."""
    answer = prove(attraction, scene, goal)
    if answer.verdict == "proved":
        return answer
    if goal.laid:
        attraction = narrowed(attraction, starts_in(attraction, goal.laid)[0])
    against = _kind(goal).refute(attraction, scene, goal)
    if goal.laid:
        against = laid_only(against, attraction, goal.laid)
    if against.verdict == "refuted":
        return against._replace(reason=against.reason or answer.reason)
    return answer


def _for_starts(attraction: Attraction, answer: Answer, *, almost: bool) -> Answer:
    """Say for which starts a goal holds that is proved of the attracting cells."""
    basin, missing = attraction.basin, attraction.basin.missing
    starts, shares, places = _begin(attraction)
    if almost:
        starts = "almost-every" if starts == "every" else starts
        flat = not_null(attraction) if starts != "cells" else ""
        if starts == "cells" or flat:
            starts, missing = "cells", missing or flat
            shares = attraction.shares
    section: dict[str, Any] = {**answer.section, "starts": starts}
    if isinstance(starts, dict):
        section |= places
    if basin.thinning:
        section["thinning"] = basin.thinning
    if basin.near:
        section["near_joint"] = near_section(attraction)
    if starts != "cells":
        return answer._replace(section=section, starts=starts, shares=shares)
    # finer cells do not bring back starts that leave
    final = basin.leaves > 0.0 and basin.open < LITTLE
    return answer._replace(
        verdict="proved-on-cells", reason=missing, section=section, starts=starts, shares=shares, final=final
    )


def _begin(attraction: Attraction) -> tuple[Any, dict[str, float], dict[str, Any]]:
    """Say which starts come to the attracting cells, their shares, and the entries that name places."""
    basin, starts = attraction.basin, attraction.basin.starts
    if starts == "cells" and basin.open > MOST_UNEXPLAINED:
        foot = starts_from_foot(attraction)
        if foot is not None and is_nearly_all(foot.shares_of(attraction)):
            return foot.starts, foot.shares_of(attraction), foot.section
    if not isinstance(starts, dict):
        return starts, basin.shares, {}
    section: dict[str, Any] = {"starts": {"from": {side: x.hex() for side, x in starts["from"].items()}}}
    if attraction.cover.box.landing > 0.0:
        finite = ((side, float(x)) for side, x in enumerate(basin.explained) if np.isfinite(x))
        section["lost"] = {str(side): x.hex() for side, x in finite}
    return starts, basin.shares, section


def cuts(goals: Sequence[Goal], sides: int) -> dict[int, list[float]]:
    """Borders of cells that some goals need, by side: their places, and the ends of where parts are laid down."""
    wanted = [float(x) for goal in goals for x in _kind(goal).borders(goal)]
    laid = [each for goal in goals for each in goal.laid]
    return {side: wanted + [end for on, *ends in laid if on == side for end in ends] for side in range(sides)}


COMES = {
    "every": "Every start on the arm comes to the attracting cells.",
    "almost-every": "Every start on the arm comes to the attracting cells, but for starts of total length zero.",
    "cells": "Only some starts are proved to come to the attracting cells.",
}


def sentence(section: Mapping[str, Any]) -> str:
    """Put a proved goal in words for people, from its section of the certificate."""
    said = KINDS[section["kind"]].sentence(section)
    starts = section.get("starts")
    if isinstance(starts, dict) and not starts.keys() & {"from", "from_foot"}:
        return _of_laid(section, said)
    if section.get("from_anywhere") or starts is None:
        return said
    if isinstance(starts, str):
        return f"{said} {COMES[starts]}"
    ((word, places),) = starts.items()
    beyond = ", ".join(
        f"x{f' - a_{side}' * (word == 'from_foot')} > {rounded(float.fromhex(x), '.6g', up=True)} on side {side}"
        for side, x in places.items()
    )
    but = ", but for starts of total length zero" if "thinning" in section else ""
    return f"{said} Every start with {beyond} comes to the attracting cells{but}."


def _of_laid(section: Mapping[str, Any], said: str) -> str:
    """Put a goal of parts that are laid down in words."""
    ((word, spans),) = section["starts"].items()
    laid = tuple(
        (int(side), float.fromhex(lo), float.fromhex(hi)) for side, pairs in spans.items() for lo, hi in pairs
    )
    which = "Every start" if word == "within" else "Each start in the cells named"
    but = ", but for starts of total length zero" if "thinning" in section else ""
    comes = "" if section.get("from_anywhere") else f" {which} comes to attracting cells{but}."
    return f"Parts are laid down at {laid_words(laid, '').replace('  ', ' ')}. {said}{comes}"
