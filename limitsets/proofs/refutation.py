"""Writing an orbit that refutes a goal, so that it can be checked independently.

A certificate with the one claim "refuted": the goal; an orbit that comes back, or that refutes by one passage; and
within which deviations of which nominal values the scene lies.  The scene's cells are in the file as in every other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from limitsets.errors import AnswerError
from limitsets.goals import Goal
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.certificate import write
from limitsets.proofs.goals import State, hexed, rechecked
from limitsets.scene import Scene
from limitsets.scene.quantities import text_at

KINDS = ("cycle", "closed", "once")
"""Why an orbit refutes, where a certificate can say it."""


def _nominal(scene: Scene, name: str) -> str:
    by_kappa = name == "throw.speed" and "kappa" in scene.text["throw"]
    return str(text_at(scene.text, "throw.kappa" if by_kappa else name))


def _goal(goal: Goal, scene: Scene) -> dict[str, Any]:
    words: dict[str, Any] = {"kind": goal.kind} | asdict(goal)
    if words.pop("laid", ()):
        words["starts"] = {"within": hexed(goal.laid)}
    if "x" in words:
        words["x"] = f"{words['x']!r} {scene.unit}"
    if "order" in words:
        words["order"] = list(words["order"])
    return words


def thrown_orbit(states: Sequence[State], recurs: Mapping[str, Any], varies: bool) -> dict[str, Any]:
    """Give the start and the throws, of a closed orbit from its exact state on."""
    states = list(states)
    throws = [
        {
            "kappa": float(state.kappa).hex() if varies and state.kappa is not None else None,
            "landing": float(state.landing).hex() if state.landing else None,
        }
        for state in states[:-1]
    ]
    first = 0
    if "closed" in recurs:
        first = next(k for k, state in enumerate(states) if state.lo == state.hi)
        throws = [*throws[first:], *throws[:first]]
        throws[-1] = {"kappa": recurs.get("kappa", throws[-1]["kappa"]), "landing": None}
    return {"start": {"x": float(states[first].lo).hex(), "side": states[first].side}, "throws": throws}


def write_refutation(
    path: str | Path,
    found: Attraction,
    goal: Goal,
    states: Sequence[State],
    recurs: Mapping[str, Any],
    within: Mapping[str, str],
    scene: Scene,
    *,
    recheck: bool = True,
) -> None:
    """Write it, replacing an older file whole; it gets its name once the checker has confirmed it.

    Parameters
    ----------
    path : str or Path
        The file.
    found : Attraction
        The cells, of the scene that refutes and its noise.
    goal : Goal
        What is refuted.
    states : sequence of State
        The orbit.
    recurs : mapping
        Why it refutes: `limitsets.proofs.goals.recurrent_orbits.Refutation`.
    within : mapping of str to str
        Deviations from the nominal scene that its own do not exceed, by quantity.
    scene : Scene
        The nominal scene.
    recheck : bool
        Whether to check it first.

    Raises
    ------
    AnswerError
        A goal that the checker does not know, or an orbit that no certificate can show.
    """
    kind = next((word for word in KINDS if word in recurs), None)
    if not rechecked(goal) or kind is None:
        raise AnswerError(
            "the refutation",
            goal.kind,
            "by an orbit that comes back, of a goal that the checker knows",
            "leave it",
        )
    box = found.cover.box
    section = {
        "goal": _goal(goal, scene),
        "recurs": {kind: recurs[kind]},
        "nominal": {name: _nominal(scene, name) for name in within},
        "tolerance": dict(within),
    }
    if kind != "cycle":
        section |= thrown_orbit(states, recurs, box.kappa_varies)
    write(
        path,
        [found],
        [{"claim": "refuted", "section": section, "verdict": "refuted"}],
        noise=box.noise or None,
        tolerance=None,
        unit=scene.unit,
        producer={},
        recheck=recheck,
    )
