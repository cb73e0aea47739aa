"""Bottlenecks: ends that only seem at rest, because steps shorter than the tolerance or the float spacing add up.

A step of length s at a point of slope q puts the next fixed point at a distance of s / |1 - q| (Newton's method).
If that distance is large, as in the ghost of a saddle-node, the end still moves.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.maps.contract import kind_of
from limitsets.maps.drivers import displacements, images
from limitsets.maps.forced import along
from limitsets.sets.unions import Union


def in_bottleneck(params: Any, union: Union, tolerance: float, scale: float) -> bool:
    """Tell whether a step moves some end, by no more than the tolerance, and no fixed point is that near."""
    for side, intervals in union.items():
        x = np.array([end.x for interval in intervals for end in interval])
        found = images(params, x, side)
        stays = (found.side == side) & (found.code >= 0)
        if not stays.any():
            continue
        x, branch = x[stays], found.code[stays]
        step = displacements(params, x, side) if kind_of(params).has_displacement else found.x[stays] - x
        slope = along(params, x, side, branch[:, None])[2]
        near = tolerance * np.maximum(scale, np.abs(x))
        if ((np.abs(step) <= near) & (np.abs(step) > np.abs(1.0 - slope) * near)).any():
            return True
    return False
