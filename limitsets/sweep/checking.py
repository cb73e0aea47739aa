"""Checks in the run itself: a sample of the points against fine cells, and some of these against a proved goal.

Which points are checked depends on their numbers in the plan alone.  A point is a disagreement where any field of its
topology differs on cells twenty times as fine, or where a certificate proves or refutes what the threshold denies.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.errors import LimitsetsError
from limitsets.goals import OrientedBeyond
from limitsets.maps.stacks import chosen
from limitsets.sweep.float_margins import threshold_of
from limitsets.sweep.subjects import SceneSubject
from limitsets.sweep.tasks import Block
from limitsets.topology import Topologies, topologies
from limitsets.topology.records import DECIDED

NOT_CHECKED, AGREES, DIFFERS, PROVED, CONTRADICTED = range(5)
CODES = {
    "not_checked": NOT_CHECKED,
    "agrees_with_fine_cells": AGREES,
    "differs_from_fine_cells": DIFFERS,
    "agrees_with_certificate": PROVED,
    "differs_from_certificate": CONTRADICTED,
}
ABOUT = (
    "a sample: every field against cells twenty times as fine; of these some against a proof of the goal too"
)

# One point of so many is checked on fine cells, one of so many of these by a proof.
SAMPLED, PROVED_OF = 1000, 10
# Cells and samples of a side.
FINE = ((4801, 768), (16_381, 1536))
# Extents that agree, as a share of the largest side, and shares of starts: fine cells split these better.
CLOSE, NEAR = 1e-8, 0.02
# Multiples of this odd number, modulo 2^32, come in no order.
SCATTERED = np.uint64(2654435761)


def checks(block: Block, told: Topologies) -> npt.NDArray[np.int8]:
    """Check a sample of the points that are decided."""
    found = np.full(told.attractors.size, NOT_CHECKED, np.int8)
    mixed = (block.numbers.astype(np.uint64) * SCATTERED) % np.uint64(2**32)
    at = np.flatnonzero((mixed % np.uint64(SAMPLED) == 0) & (told.undecided == DECIDED))
    if not at.size:
        return found
    points = chosen(block.points, at)
    fine = topologies(points.params, points.lo, points.hi, points.anchor, levels=FINE)
    scale = (points.hi - points.lo).max(axis=1)
    found[at] = np.where(_same(chosen(told, at), fine, scale), AGREES, DIFFERS)
    for k in at[(mixed[at] // np.uint64(SAMPLED)) % np.uint64(PROVED_OF) == 0]:
        if found[k] == AGREES:
            found[k] = _against_proof(block, told, int(k))
    return found


def _same(one: Topologies, other: Topologies, scale: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Whether two records of the same points say the same."""
    same = other.undecided == DECIDED
    for name in ("attractors", "bands", "jogs_min", "jogs_max", "flip_order", "period"):
        a, b = getattr(one, name), getattr(other, name)
        same &= (a == b).reshape(len(same), -1).all(axis=1)
    for name in ("lowest", "reach", "share", "leaves", "collapses"):
        a, b = (getattr(each, name).reshape(len(same), -1) for each in (one, other))
        close = CLOSE * scale[:, None] if name in ("lowest", "reach") else NEAR
        same &= ((np.abs(a - b) <= close) | (np.isnan(a) & np.isnan(b))).all(axis=1)
    return np.asarray(same)


def _against_proof(block: Block, told: Topologies, k: int) -> int:
    """Compare the threshold of one point with what is proved of the goal there."""
    scene: Any = block.subject.at({name: float(each[k]) for name, each in block.values.items()})
    goal = scene.goal if isinstance(block.subject, SceneSubject) and scene is not None else None
    if not isinstance(goal, OrientedBeyond) or goal.from_anywhere or told.share[k, 0] != 1.0:
        return AGREES
    from limitsets.proofs import certify  # lazily: most chunks need no proof

    try:
        claim = certify(scene, ["goal"]).claims[0]
    except LimitsetsError:
        return AGREES
    holds = not threshold_of(goal, told.reach[k : k + 1, 0])[0] > goal.x
    if claim.verdict not in ("proved", "refuted"):
        return AGREES
    return PROVED if (claim.verdict == "proved") == holds else CONTRADICTED
