"""An analysis in the words of its JSON form, and a scene read back from it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from limitsets.analysis.run import Analysis
    from limitsets.scene import Scene

__all__ = ["scene_of", "to_json"]


def _number(value: float | None) -> float | None:
    """Give a number that JSON has, or None."""
    return None if value is None or not math.isfinite(value) else float(value)


def _extents(extents: Mapping[int, Sequence[tuple[float, float]]]) -> dict[str, list[list[float]]]:
    return {
        str(side): [[float(lo), float(hi)] for lo, hi in parts] for side, parts in sorted(extents.items())
    }


def to_json(analysis: Analysis) -> dict[str, Any]:
    """Write an analysis as tables, lists, text and finite numbers; None where a number is missing.

    Parameters
    ----------
    analysis : Analysis
        From `limitsets.analyse`.

    Returns
    -------
    dict
        Sides are keys "0", "1", ...; lengths are in ``units["length"]``, angles in rad, times in seconds.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.analyse("paper-designed")
    >>> found.to_json()["attractors"][0]["flip_order"]
    [0, 1, 2]
    """
    scene, goal, basins = analysis.scene, analysis.goal, analysis.basins
    return {
        "scene": scene.as_dict(),
        "units": {"length": scene.unit, "angle": "rad", "time": "s", "lyapunov": "per throw"},
        "cells": [int(n) for n in analysis.grid.shape[:, 0]],
        "critical_points": {
            str(side): [{"x": point.x, "kind": point.kind} for point in points]
            for side, points in sorted(analysis.critical_points.items())
        },
        "attractors": _attractors(analysis),
        "basins": {
            "attractors": [_number(share) for share in basins.attractors],
            "undecided_between": _number(basins.undecided_between),
            **{name.replace("-", "_"): _number(share) for name, share in basins.exits.items()},
        },
        "starts": None if analysis.starts is None else analysis.starts.to_json(),
        "advice": list(analysis.advice),
        "cycles": [
            {
                "period": cycle.period,
                "x": [float(x) for x in cycle.x],
                "sides": [int(side) for side in cycle.side],
                "multiplier": _number(cycle.multiplier),
                "admissible": cycle.admissible,
            }
            for cycle in analysis.cycles
        ],
        "goal": None
        if goal is None
        else {
            "kind": goal.goal.kind,
            "holds": goal.holds,
            "threshold": _number(goal.threshold),
            "how": goal.how,
        },
        "goal_vacuous": None if goal is None else goal.vacuous,
        "effects": analysis.choice.to_json(),
        "other_vertex_first": _extents(analysis.other_vertex_first),
        "spurious": [
            {"cells": len(cells), "extents": _extents(cells.extents())} for cells in analysis.spurious
        ],
        "accuracy": None if analysis.accuracy is None else analysis.accuracy.to_json(),
        "second_pass": _number(analysis.second_pass),
        "timings": {step: round(seconds, 6) for step, seconds in analysis.timings.items()},
    }


def _attractors(analysis: Analysis) -> list[dict[str, Any]]:
    known = zip(
        analysis.attractors, analysis.limit_sets, analysis.extents, analysis.extents_from, strict=True
    )
    return [
        {
            "extents": _extents(extents),
            "extents_from": source,
            "flip_order": None if attractor.flip_order is None else list(attractor.flip_order),
            "jogs_per_visit": {
                str(side): list(pair) for side, pair in sorted(attractor.jogs_per_visit.items())
            },
            "flips_per_throw": _number(attractor.flips_per_throw),
            "lyapunov": _number(attractor.lyapunov),
            "throws": attractor.throws,
            "in_cells": _number(attractor.in_cells),
            "stopped": attractor.stopped,
            "advice": limit.advice,
        }
        for attractor, limit, extents, source in known
    ]


def scene_of(record: Mapping[str, Any]) -> Scene:
    """Read back the scene of an analysis written as JSON.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.analysis import scene_of
    >>> scene = ls.load("paper-designed")
    >>> scene_of({"scene": scene.as_dict()}) == scene
    True
    """
    from limitsets.scene import load

    return load(record["scene"])
