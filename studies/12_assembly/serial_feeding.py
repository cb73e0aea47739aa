"""Serial feeding in the engine: the first part alone, then the second one onto the first, which is seated already."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from limitsets.cell.assembly.assembly_run import rate_of
from limitsets.cell.assembly.pairing import Draws, angle_on, pair_of
from limitsets.cell.assembly.trials import FRICTION, MOST_THROWS
from limitsets.feeder.engine.crowd import Crowd
from limitsets.feeder.engine.depression import SEATED, off_seat, seat_of
from limitsets.feeder.scattering import Scattering


def one_by_one(parts: list[Any], noise: Scattering, contact: str, trials: int, seed: int) -> dict[str, Any]:
    """Give the rate of each part by itself, and their product: the two are thrown at different times."""
    pair = pair_of(*parts, noise)
    below = seat_of(parts[0], pair.ends[0].side)
    seats = below, seat_of(parts[1], pair.ends[1].side, [below])
    near = SEATED * parts[0].cavity.width
    counts = []
    for k in (0, 1):
        seated = 0
        for number in range(trials):
            draws = Draws(pair, seed, number)
            crowd = Crowd(parts, contact=contact, friction=FRICTION)
            if k == 1:
                crowd.drop(0, _pose(parts[0], pair.ends[0].side, below))
            crowd.place(k, *draws.starts(apart=False)[k])
            for _ in range(MOST_THROWS):
                deviation, landing = draws.throw()
                rest = crowd.throw(deviation, {k: landing[k]})[k]
                if rest.where in ("cavity", "lost", "unfinished"):
                    break
                if rest.where == "arm" and rest.x <= float(parts[k].sides.a[rest.side]):
                    break
            seated += all(off_seat(crowd.members[j].world(), seats[j]) <= near for j in range(k + 1))
        counts.append(rate_of(seated, trials))
    return {"triangle": counts[0], "quadrilateral": counts[1], "product": counts[0].share * counts[1].share}


def _pose(scene: Any, side: int, corners: Any) -> tuple[float, float, float]:
    """Pose of a seated part: its centre of mass, and its angle."""
    angle = angle_on(scene, side) - scene.cavity.angle
    cos, sin = math.cos(angle), math.sin(angle)
    about = (scene.vertices - np.asarray(scene.centre)) @ np.array([[cos, sin], [-sin, cos]])
    x, y = (corners - about).mean(axis=0).tolist()
    return x, y, angle
