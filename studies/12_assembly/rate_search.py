"""A search over the cavity's place and the throw for a higher rate of assembly, confirmed on fresh seeds."""

from __future__ import annotations

from typing import Any

import numpy as np

import limitsets as ls
from limitsets.cell.assembly.assembly_run import rate_of
from limitsets.feeder.scattering import Scattering

# Between these: where the arm ends, as a multiple of where it does now, and the speed likewise.
PLACES, SPEEDS = (0.85, 1.3), (0.88, 1.08)
LOOKED_AT, KEPT = 16, 4


def changed(parts: list[Any], place: float, speed: float) -> list[Any]:
    """Move the cavity, and throw at another speed."""
    found = []
    for part in parts:
        tree = part.as_dict()
        position = part.cavity.position * place
        tree["cavity"]["position"] = f"{position!r} in"
        tree["arm"]["length"] = f"{position + part.cavity.width + 0.7!r} in"
        tree["throw"] = {"kappa": f"{part.kappa / speed**2!r} in"}
        tree["goal"]["oriented_beyond"]["x"] = f"{position!r} in"
        found.append(ls.load(tree))
    return found


def count(parts: list[Any], noise: Scattering, seed: int, trials: int) -> int:
    """Count pairs assembled."""
    return ls.assemble(*parts, noise, trials=trials, seed=seed).counts["assembled"]


def confirmed(
    parts: list[Any], noise: Scattering, seed: int, *, trials: int = 30, last: int = 300, fresh: int = 1000
) -> dict[str, Any]:
    """Look at random places and speeds, all with the same draws; the best few at more trials; the best with fresh ones.

    The rate of the best on the draws that chose it is too high: it is given beside that on fresh ones.
    """
    random = np.random.default_rng(seed)
    drawn = [(1.0, 1.0)]
    drawn += [(float(random.uniform(*PLACES)), float(random.uniform(*SPEEDS))) for _ in range(LOOKED_AT)]
    first = sorted(
        ((count(changed(parts, *each), noise, seed, trials), each) for each in drawn), reverse=True
    )
    again = [(count(changed(parts, *each), noise, seed, last // 4), each) for _, each in first[:KEPT]]
    chosen, best = max(again)
    scenes = changed(parts, *best)
    return {
        "cavity.position": scenes[0].cavity.position,
        "throw.kappa": scenes[0].kappa,
        "looked at": len(drawn),
        "chosen by": rate_of(chosen, last // 4),
        "fresh": rate_of(count(scenes, noise, seed + fresh, last), last),
        "before, on the same fresh draws": rate_of(count(parts, noise, seed + fresh, last), last),
    }
