"""Tasks of one scene at a time, as a user would write them; useful too."""

from __future__ import annotations

import math
from typing import Any

from limitsets.feeder.scene import Scene
from limitsets.systems import maps


def critical_points(scene: Scene) -> dict[str, Any]:
    """Give the first critical point of each side, nan where there is none up to the arm's end.

    Examples
    --------
    >>> from limitsets.scene import load
    >>> critical_points(load("paper-designed"))["critical_point"]
    [10.0000..., 9.9999..., 20.0000...]
    """
    sides = maps.critical_points(scene.map, scene.domain).values()
    return {"critical_point": [points[0].x if points else math.nan for points in sides]}
