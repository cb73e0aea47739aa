"""A predicate of the caller: of every attracting cell, or of every landing from anywhere on the arm.

The proof trusts the caller's code: no certificate can hold the code, and nothing rechecks it.  An orbit refutes the
predicate if it is false at both ends and in the middle of the enclosure of the orbit's last state.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.goals import Predicate
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction
from limitsets.proofs.prover.goals.kind import Answer, Kind, against, common, once, thrown_into, undecided
from limitsets.proofs.prover.goals.recurrent_orbits import recurrent_violation
from limitsets.proofs.prover.goals.violating_orbits import State, one_throw


def _good(goal: Predicate, lo: Array, hi: Array, side: int) -> Mask:
    """Ask the caller, and refuse what is no answer."""
    said = np.asarray(goal.holds(lo, hi, side))
    if said.dtype != np.bool_ or said.shape != lo.shape:
        allowed = f"an array of bool of shape {lo.shape}"
        raise AnswerError(
            f"what {goal.name} returns", f"{said.dtype} of shape {said.shape}", allowed, "correct it"
        )
    return said


def _bad_cells(attraction: Attraction, goal: Predicate) -> Mask:
    grid = attraction.cover.grid
    parts = [_good(goal, edges[:-1], edges[1:], side) for side, (edges,) in enumerate(grid.edges)]
    return ~np.concatenate(parts)


def _missing(attraction: Attraction, goal: Predicate) -> str:
    """Say where it is not proved; empty if it is."""
    bad = _bad_cells(attraction, goal)
    if not goal.from_anywhere:
        wrong = np.flatnonzero(bad & (attraction.component >= 0))
        return f"{goal.name}: not on {attraction.cover.place(int(wrong[0]))}" if wrong.size else ""
    start = thrown_into(attraction, bad)
    if start:
        return f"{goal.name}: not where a throw from {start} may land"
    foot = attraction.cover.box.bare[0].a
    for side, near in enumerate(attraction.joint):
        if near.empty:
            continue
        landing = np.array([foot[side]]), np.array([near.reach])
        if near.rolls or not _good(goal, *landing, side).all():
            return f"{goal.name}: not where a throw from near the joint on side {side} may land"
    return ""


def _prove(attraction: Attraction, _: Scene, goal: Predicate) -> Answer:
    missing = common(attraction, anywhere=goal.from_anywhere)
    reason = missing or _missing(attraction, goal)
    return undecided(reason) if reason else Answer("proved", "", {"kind": goal.kind, "name": goal.name})


def _refute(attraction: Attraction, scene: Scene, goal: Predicate) -> Answer:
    def wrong(x: Any, side: Any) -> Mask:
        bad = np.zeros(x.shape, dtype=bool)
        for s in np.unique(side).tolist():
            mine = side == s
            bad[mine] = ~_good(goal, x[mine], x[mine], s)
        return bad

    if not goal.from_anywhere:
        return against(recurrent_violation(attraction, scene, wrong, goal.laid))
    orbit = one_throw(attraction, wrong, laid=goal.laid)
    return once(orbit if orbit and _throughout(goal, orbit[-1]) else ())


def _throughout(goal: Predicate, last: State) -> bool:
    x = np.array([last.lo, 0.5 * (last.lo + last.hi), last.hi])
    return not _good(goal, x, x, last.side).any()


KIND = Kind(
    _prove,
    _refute,
    lambda section: f"In the attracting cells: {section['name']}, as its code says.",
    lambda goal: goal.cuts,
)
