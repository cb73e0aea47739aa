"""A margin for others: plain tables for JSON, certificates of what is proved, and the orbit that refutes."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from limitsets.errors import AnswerError
from limitsets.goals import Goal, Predicate, as_written
from limitsets.proofs.asked import State, rechecked
from limitsets.proofs.certify import weakest_of
from limitsets.proofs.confirm import DeniedError
from limitsets.proofs.proof import Claim, Proof
from limitsets.proofs.refutation import KINDS, write_refutation

if TYPE_CHECKING:
    from limitsets.robust.margins.finding import Margin

__all__ = ["file_stem", "goal_table", "save", "settled", "to_json"]


def goal_table(goal: Goal, unit: str) -> dict[str, Any]:
    """Give a goal as a scene would name it; a function by its name."""
    if isinstance(goal, Predicate):
        return {"predicate": goal.name, "from_anywhere": goal.from_anywhere}
    return as_written(goal, unit)


def to_json(margin: Margin) -> dict[str, Any]:
    """Give a margin as a plain table; every number is finite or null."""
    goals = [goal_table(goal, margin.scene.unit) for goal in margin.goals]
    return {
        "quantity": margin.quantity,
        "reading": margin.reading,
        "goal": goals[0] if len(goals) == 1 else goals,
        "proved": margin.proved,
        "refuted": margin.refuted,
        "unit": margin.unit or None,
        "nominal": margin.nominal,
        "closed": margin.closed,
        "reason": margin.reason or None,
        "counterexample": _states(margin) or None,
        "certificate": None,
        "pieces": len(margin.pieces),
        "timings": {"margin": margin.seconds},
    }


def _states(margin: Margin) -> list[dict[str, Any]]:
    against = margin.against
    if against is None:
        return []
    fixed: dict[str, Any] = {} if against.piece is None else dict(against.piece.texts())
    return [_state(state, fixed, margin.scene.unit) for state in against.counterexample]


def _state(state: State, fixed: dict[str, Any], unit: str) -> dict[str, Any]:
    thrown = dict(fixed)
    if state.kappa is not None and "throw.kappa" not in thrown:
        thrown["throw.kappa"] = f"{state.kappa!r} {unit}"
    if state.landing is not None:
        thrown["landing.x"] = f"{state.landing!r} {unit}"
    return {
        "x": 0.5 * (state.lo + state.hi),
        "between": [state.lo, state.hi],
        "side": state.side,
        "parameters": thrown if state.kappa is not None else None,
    }


def file_stem(margin: Margin) -> str:
    """Name the files of a margin: scene, quantity, reading."""
    quantity = re.sub(r"[^A-Za-z0-9]+", "-", margin.quantity).strip("-")
    return f"{margin.scene.name}-{quantity}-{margin.reading}".replace(" ", "-")


def _require_checkable(margin: Margin) -> None:
    on = [name for name in margin.scene.effects.on() if name != "spread"]
    if on:
        raise AnswerError(
            "the certificate",
            f"with the effects {', '.join(on)}",
            "the minimal model, and noise",
            "nothing rechecks other maps; the margin stands",
        )
    for goal in margin.goals:
        if not rechecked(goal):
            raise AnswerError(
                "the certificate",
                f"of the goal {goal.kind}",
                "goals that the checker knows",
                "nothing rechecks others; the margin stands",
            )


def settled(margin: Margin, folder: Path, *, recheck: bool = True) -> tuple[Margin, tuple[Path, ...]]:
    """Write a margin's files; the margin without what the checker denies, for that is undecided."""
    try:
        return margin, save(margin, folder, recheck=recheck)
    except DeniedError as error:
        reason = f"{error}"
        left = replace(margin, proved=0.0, pieces=(), closed=False, reason=reason)
        if "refuted" in error.claims:
            left = replace(margin, refuted=None, against=None, closed=False, reason=reason)
        return settled(left, folder, recheck=recheck)


def save(margin: Margin, folder: Path, *, recheck: bool = True) -> tuple[Path, ...]:
    """Write the certificates of what is proved, one per goal, and the orbit that refutes (`Margin.save`)."""
    _require_checkable(margin)
    folder.mkdir(parents=True, exist_ok=True)
    stem, written = file_stem(margin), []
    for number, goal in enumerate(margin.goals if margin.pieces else ()):
        claims = [Claim("goal", "proved", "", dict(piece.answers[number].section)) for piece in margin.pieces]
        found = tuple(piece.found for piece in margin.pieces if piece.found is not None)
        proof = Proof(
            margin.scene, margin.noise, margin.deviations, found, (weakest_of(claims),), margin.seconds
        )
        last = f"-{goal.kind.replace('_', '-')}" if len(margin.goals) > 1 else ""
        written.append(proof.save(folder / f"{stem}{last}.proof.zip", recheck=recheck))
    against = margin.against
    if against is not None and against.found is not None and against.refuted is not None:
        states, recurs = against.counterexample, against.answers[0].recurs
        if any(word in recurs for word in KINDS):
            path = folder / f"{stem}.refuted.zip"
            write_refutation(
                path,
                against.found,
                against.refuted,
                states,
                recurs,
                against.within,
                margin.scene,
                recheck=recheck,
            )
            written.append(path)
    return tuple(written)
