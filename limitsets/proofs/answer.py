"""A proof as plain tables for JSON: what is proved, for which parameters, within how many throws, and what is not."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.proofs.tiles import joined
from limitsets.scene.quantities import texts
from limitsets.scene.units import convert, parse

if TYPE_CHECKING:
    from limitsets.proofs.asked import State
    from limitsets.proofs.attraction import Attraction
    from limitsets.proofs.certify import Claim, Proof

__all__ = ["SHARES", "jog_fixed_points", "max_throws", "outer_extents", "thrown", "to_json", "values"]


SHARES = ("share", "leaves", "creeps", "open")


def to_json(proof: Proof) -> list[dict[str, Any]]:
    """Give a proof as plain tables, one per claim.

    Parameters
    ----------
    proof : Proof
        What `limitsets.certify` returned.

    Returns
    -------
    list of dict
        In the words of docs/certificates.md; every number is finite or null.
    """
    return [_claim(proof, claim) for claim in proof.claims]


def _claim(proof: Proof, claim: Claim) -> dict[str, Any]:
    proved = claim.written
    slope = float.fromhex(claim.section["least_slope"]) if "least_slope" in claim.section else None
    return {
        "claim": claim.claim,
        "verdict": claim.verdict,
        "starts": claim.starts,
        **{word: claim.shares.get(word) for word in SHARES},
        "note": claim.note or None,
        "reason": claim.reason or None,
        "recurs": claim.recurs or None,
        "counterexample": [_state(proof, claim, state) for state in claim.counterexample] or None,
        "parameters": dict(values(proof)),
        "effects": list(proof.effects) or None,
        "noise": proof.noise or None,
        "tolerance": proof.tolerance or None,
        "max_throws": max_throws(proof) if proved and claim.claim == "attracts-all" else None,
        "jog_fixed_points": jog_fixed_points(claim),
        "extents": _extents(proof, claim) if proved else None,
        "least_slope": slope,
        "entropy": math.log(slope) if slope is not None and not proof.noise else None,
        "section": claim.section or None,
        "cells": sum(found.cover.grid.n_cells for found in proof.attractions),
        "undecided": sum(_undecided(found) for found in proof.attractions),
        "unresolved": _unresolved(proof.attractions),
        "timings": {"certify": proof.seconds},
    }


def values(proof: Proof) -> Iterator[tuple[str, str | list[str]]]:
    """Name every quantity of the scene with its text: the two ends where it is fixed but unknown."""
    spans = proof.spans
    for name, text in texts(proof.scene.text):
        yield name, spans.get(name, text)


def _state(proof: Proof, claim: Claim, state: State) -> dict[str, Any]:
    fixed: dict[str, Any] = dict(claim.fixed)
    return {
        "x": state.lo if state.lo == state.hi else 0.5 * (state.lo + state.hi),
        "between": [state.lo, state.hi],
        "side": state.side,
        "parameters": None if state.kappa is None else fixed | thrown(proof, state),
    }


def thrown(proof: Proof, state: State) -> dict[str, str]:
    """Say what a throw was like, by quantity.

    kappa always, as it was replayed; the tilt that makes it, where the tilt alone differs; how far beyond the model's
    place it landed, where that differs.
    """
    found = {"throw.kappa": f"{state.kappa!r} {proof.scene.unit}"}
    if "gravity.tilt" in proof.noise and "throw.speed" not in proof.noise and state.kappa is not None:
        given = parse(proof.scene.text["gravity"]["tilt"], "angle")
        nominal = convert(given, "rad")
        # kappa goes with the sine of the tilt
        tilt = math.asin(min(1.0, math.sin(nominal) * state.kappa / proof.scene.kappa))
        degrees = given.unit == "deg"
        found["gravity.tilt"] = f"{math.degrees(tilt) if degrees else tilt!r} {given.unit}"
    if state.landing is not None:
        found["landing.x"] = f"{state.landing!r} {proof.scene.unit}"
    return found


def max_throws(proof: Proof) -> dict[str, Any]:
    """Bound the throws until a start is in the attracting cells.

    Returns
    -------
    dict
        `throws` from `beyond` (x by side) on; below it, x - a grows by a factor of `near_joint` at least with each, or
        with the arm's surface above the joint x - R* does, down to the jog's fixed point R*.
    """
    starts = [[float(edges[0]) for (edges,) in found.cover.grid.edges] for found in proof.attractions]
    return {
        "beyond": {str(side): max(each) for side, each in enumerate(zip(*starts, strict=True))},
        "throws": max(found.max_rank for found in proof.attractions),
        "near_joint": min(near.q for found in proof.attractions for near in found.joint),
    }


def jog_fixed_points(claim: Claim) -> dict[str, list[float]] | None:
    """Brackets of the jog's unstable fixed point by side, where the claim rests on them."""
    near = claim.section.get("near_joint", {})
    found = {side: [float.fromhex(end) for end in each.get("fixed_point", ())] for side, each in near.items()}
    return found if found and all(found.values()) else None


def outer_extents(proof: Proof) -> dict[int, list[tuple[float, float]]]:
    """Per side the intervals of attracting cells, of all pieces of a tolerance together."""
    together: dict[int, list[tuple[float, float]]] = {}
    for found in proof.attractions:
        for side, parts in found.cells.extents().items():
            together.setdefault(side, []).extend(parts)
    return {side: joined(together[side]) for side in sorted(together)}


def _extents(proof: Proof, claim: Claim) -> dict[str, Any]:
    """Per side `[[lo_outer, lo_inner], [hi_inner, hi_outer]]`: inner ends where the claim proves them."""
    ends = claim.section.get("ends")
    if ends is None:
        return {
            str(side): [[[lo, None], [None, hi]] for lo, hi in parts]
            for side, parts in outer_extents(proof).items()
        }
    found: dict[str, Any] = {}
    for lo, hi in zip(ends[::2], ends[1::2], strict=True):
        pair = [[_float(lo["outer"]), _float(lo["inner"])], [_float(hi["inner"]), _float(hi["outer"])]]
        found.setdefault(str(lo["side"]), []).append(pair)
    return found


def _float(text: str | None) -> float | None:
    return None if text is None else float.fromhex(text)


def _undecided(found: Attraction) -> int:
    """Count the cells on which both a jog and a flip are possible."""
    count = 0
    for images in found.cover.images:
        possible = [(lo <= hi).reshape(lo.shape[0], -1).all(axis=1) for lo, hi in images.hulls.values()]
        count += int((np.sum(possible, axis=0) > 1).sum()) if possible else 0
    return count


def _unresolved(attractions: tuple[Attraction, ...]) -> dict[str, list[list[float]]]:
    """Recurrent cells that do not attract, by side."""
    found: dict[str, list[list[float]]] = {}
    for each in attractions:
        for side, parts in each.unresolved.extents().items():
            if parts:
                found.setdefault(str(side), []).extend([lo, hi] for lo, hi in parts)
    return found
