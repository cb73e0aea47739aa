"""What stands beside the film: limit sets, critical points and the goal, from an analysis; and a good start."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from limitsets.animation.film import Lanes
from limitsets.errors import AnswerError
from limitsets.goals import Goal, OrientedBeyond, Reaches
from limitsets.plot.style import stretch

if TYPE_CHECKING:
    from limitsets.analysis import Analysis
    from limitsets.scene import Scene

Progress = Any

# Cells per side: enough for a picture a few hundred pixels wide.
CELLS = 1024


def known_of(scene: Scene, progress: Progress = None, **more: Any) -> tuple[Analysis, Lanes]:
    """Analyse a scene, and keep what the lanes show of it; its effects by `auto` are then chosen."""
    from limitsets.analysis import analyse

    found = analyse(scene, CELLS, progress=progress)
    return found, lanes_of(found.scene, found, **more)


def lanes_of(scene: Scene, found: Analysis | None = None, goal: Goal | None = None, **more: Any) -> Lanes:
    """Lay the lanes out; without an analysis they show no sets.  The goal is the scene's, or another."""
    goal = scene.goal if goal is None else goal
    return Lanes(
        tuple(scene.sides.a.tolist()),
        scene.arm_length,
        ()
        if found is None
        else tuple({side: list(parts) for side, parts in each.items()} for each in found.extents),
        {}
        if found is None
        else {s: tuple(p.x for p in points) for s, points in found.critical_points.items()},
        (goal.x, goal.side) if isinstance(goal, OrientedBeyond | Reaches) else None,
        **more,
    )


def good_start(found: Analysis, throws: int) -> tuple[float, int]:
    """Choose a start on the limit set: where whole rounds of the sides begin; else the middle of the longest side."""
    for extents in found.extents[:1]:
        path = stretch(found.scene, extents, throws)
        if path is not None:
            return float(path.x[0]), int(path.side[0])
    return 0.5 * (float(found.scene.sides.a[0]) + found.scene.arm_length), 0


def require_start(scene: Scene, start: tuple[float, int]) -> tuple[float, int]:
    """Refuse a start from which nothing is thrown."""
    x, side = start
    if not (isinstance(side, int) and 0 <= side < len(scene.sides)):
        allowed = f"a whole number from 0 to {len(scene.sides) - 1}"
        raise AnswerError("the side of the start", side, allowed, "name a side of the part")
    least = float(scene.sides.a[side])
    if not (math.isfinite(x) and least < x <= scene.arm_length):
        allowed = f"more than {least:.6g} and up to {scene.arm_length:g} {scene.unit} on side {side}"
        raise AnswerError("x of the start", x, allowed, "start where the part can rest and is thrown")
    return float(x), int(side)
