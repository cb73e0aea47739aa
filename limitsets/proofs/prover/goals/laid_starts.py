"""A goal whose starts are ranges in which parts are laid down: what these starts can come to, and their shares.

The goal says nothing about the rest of the arm: cells to which no orbit from the ranges can come count neither as
starts nor as attracting cells.  Source: docs/certificates.md, "Parts that are laid down".
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from limitsets.base.arrays import Mask
from limitsets.feeder.goals import Goal, Laid, by_side
from limitsets.feeder.scene import Scene
from limitsets.proofs.prover.attraction import Attraction, not_attracting
from limitsets.proofs.prover.basin import NO_STARTS, ROUNDING, leaving_cells
from limitsets.proofs.prover.cover import everywhere, met
from limitsets.proofs.prover.goals.kind import Answer, Kind, undecided
from limitsets.proofs.prover.goals.reaches import not_null
from limitsets.systems.cells import CellSet
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.images.enclosed import Enclosures
from limitsets.systems.graph.ranges import RUN

# If some starts leave and no more than this share is open, finer cells are not tried.
LITTLE = 1e-3

WHOLE = {"share": 1.0, "leaves": 0.0, "creeps": 0.0, "open": 0.0}


def starts_in(attraction: Attraction, laid: Laid) -> tuple[Mask, bool]:
    """Find the cells that meet the ranges, and whether the ranges lie in the cells as far as they lie on the arm."""
    grid, box = attraction.cover.grid, attraction.cover.box
    meets, inside = np.zeros(grid.n_cells, dtype=bool), True
    for side, lo, hi in laid:
        (edges,) = grid.edges[side]
        meets[grid.of_side(side)] |= (edges[1:] > lo) & (edges[:-1] < hi)
        inside &= bool(edges[0] <= lo < box.lo.arm_length)
    return meets, inside


def reached_from(attraction: Attraction, cells: Mask) -> Mask:
    """Return the cells to which an orbit from the given ones can come, these included."""
    reached, new, ways = cells.copy(), cells.copy(), everywhere(attraction.cover)
    while new.any():
        new = np.any([met(ends, new) for ends in ways], axis=0) & ~reached
        reached |= new
    return reached


def narrowed(attraction: Attraction, cells: Mask) -> Attraction:
    """Keep what orbits from some cells can come to: other cells have no images, and neither attract nor recur."""
    keep, cover = reached_from(attraction, cells), attraction.cover
    grid, ranges = cover.grid, cover.graph.ranges
    images = []
    for side, one in enumerate(cover.images):
        own = keep[grid.of_side(side)]
        hulls = {
            key: (np.where(own, lo, np.inf), np.where(own, hi, -np.inf))
            for key, (lo, hi) in one.hulls.items()
        }
        images.append(Enclosures(hulls, one.witness, one.lost & own))
    targets = ranges.box.copy()
    targets[~keep[np.repeat(np.arange(grid.n_cells), np.diff(ranges.first))], RUN] = 0
    leaving = np.where(keep, ranges.exits, 0).astype(np.uint8)
    graph = TransitionGraph(cover.graph.map, grid, ranges._replace(box=targets, exits=leaving), "boxes")
    of = np.where(keep, attraction.component, -1)
    component = np.where(of >= 0, np.searchsorted(np.unique(of[of >= 0]), of), -1).astype(np.int32)
    again = CellSet(grid, attraction.unresolved.mask & keep)
    reason = not_attracting(cover, again)
    lost = leaving > 0
    lost |= np.concatenate([one.lost for one in images])
    if lost.any():
        reason = f"the image of {cover.place(int(np.argmax(lost)))} may leave the cells"
    part = Attraction(
        replace(cover, images=tuple(images), graph=graph, points=()),
        component,
        (NO_STARTS,) * grid.sides,
        not reason,
        reason,
        again,
    )
    basin = attraction.basin
    thinning = basin.thinning if (basin.thin & keep).any() else 0
    # in place of the basin of all cells
    vars(part)["basin"] = replace(
        basin, rank=np.where(keep, basin.rank, -1), thinning=thinning, near=True, creeps=0.0
    )
    return part


def prove_laid(attraction: Attraction, scene: Scene, goal: Goal, kind: Kind) -> Answer:
    """Prove a goal of the starts that are laid down, all or those in some cells; or say what is missing."""
    meets, inside = starts_in(attraction, goal.laid)
    good = meets & (attraction.basin.rank >= 0)
    missing = attraction.basin.missing if (meets & ~good).any() else ""
    if not inside:
        missing = missing or "parts are laid down nearer to the joint than the first cells"
    if not good.any():
        return undecided(missing or "no start that is laid down lies in the cells")
    part = narrowed(attraction, good)
    answer = kind.prove(part, scene, goal)
    if answer.verdict != "proved":
        return laid_only(answer, part, goal.laid)
    anywhere, almost = goal.from_anywhere and not goal.of_every_start, kind.almost(goal)
    flat = not_null(part) if almost and not anywhere else ""
    if flat:
        return undecided(flat)
    whole = inside and bool((good == meets).all())
    section: dict[str, Any] = {**answer.section, "starts": {"within" if whole else "cells": hexed(goal.laid)}}
    if part.basin.thinning and not anywhere:
        section["thinning"] = part.basin.thinning
    if whole:
        return answer._replace(section=section, starts={"within": by_side(goal.laid)}, shares=WHOLE)
    shares = _shares(attraction, good, goal.laid)
    # finer cells do not bring back starts that leave
    final = shares["leaves"] + shares["creeps"] > 0.0 and shares["open"] < LITTLE
    return answer._replace(
        verdict="proved-on-cells", reason=missing, section=section, starts="cells", shares=shares, final=final
    )


def hexed(laid: Laid) -> dict[str, list[list[str]]]:
    """Write ranges by side, as a certificate has them."""
    return {side: [[end.hex() for end in pair] for pair in pairs] for side, pairs in by_side(laid).items()}


def _shares(attraction: Attraction, good: Mask, laid: Laid) -> dict[str, float]:
    """Shares of the ranges that are claimed, leave, creep to the joint, and are open."""
    grid, basin, box = attraction.cover.grid, attraction.basin, attraction.cover.box
    gone = leaving_cells(attraction.cover) if box.landing == 0.0 else np.zeros_like(good)
    whole = claimed = left = before = 0.0
    for side, lo, hi in laid:
        (edges,), own = grid.edges[side], grid.of_side(side)
        lengths = np.clip(np.minimum(edges[1:], hi) - np.maximum(edges[:-1], lo), 0.0, None)
        whole += min(hi, box.hi.arm_length) - lo
        claimed += float(lengths[good[own]].sum())
        left += float(lengths[gone[own] & ~good[own]].sum())
        # lost under the worst noise of the landing place, or creeping inward
        before += max(0.0, min(hi, float(basin.explained[side])) - lo)
    creeps, leaves = (before, left) if basin.creeps else (0.0, before if box.landing > 0.0 else left)
    share, gone_share, crept = (max(0.0, x / whole - ROUNDING) for x in (claimed, leaves, creeps))
    rest = min(1.0, max(0.0, 1.0 - share - gone_share - crept) + ROUNDING)
    return {"share": share, "leaves": gone_share, "creeps": crept, "open": rest}


def laid_only(answer: Answer, attraction: Attraction, laid: Laid) -> Answer:
    """Keep a refutation if an orbit or a component that refutes begins where parts are laid down, else nothing of it.

    Without ranges it is kept as it is.
    """
    if answer.verdict != "refuted" or not laid:
        return answer
    states = answer.counterexample[:1] if "once" in answer.recurs else answer.counterexample
    begins = any(
        side == state.side and lo < state.lo and state.hi < hi for state in states for side, lo, hi in laid
    )
    number = answer.recurs.get("component")
    if number is not None:
        meets: Mask = starts_in(attraction, laid)[0]
        begins |= bool((meets & (attraction.component == number)).any())
    if begins:
        return answer
    other = "an orbit refutes it, and no start that is laid down is proved to come to that orbit"
    return undecided(f"{answer.reason}; {other}" if answer.reason else other)
