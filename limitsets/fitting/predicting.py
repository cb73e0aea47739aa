"""What the model says of each throw, at many parameter points at once: where it lands, what decides, how both move.

The formulas are the kernels of the map; derivatives with respect to the start and to the logarithm of the speed are
central differences, in steps that leave ten digits.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.maps.forced import at_points
from limitsets.scene import Scene
from limitsets.scene.arrays import throw_stack

STEP = 1e-5

Array = NDArray[np.float64]


class Predicted(NamedTuple):
    """Of n throws on given branches, at m points; all of shape (m, n).

    Attributes
    ----------
    after : ndarray
        Where the throw ends: the place that is read there [length].
    slope, per_log_speed : ndarray
        Its derivatives with respect to the start [1] and to ln w [length].
    decides : ndarray
        Positive where the part flips [length^2].
    decides_slope, decides_per_log_speed : ndarray
        Its derivatives.
    possible : ndarray of bool, shape (m, 1)
        Where there is such a scene.
    """

    after: Array
    slope: Array
    per_log_speed: Array
    decides: Array
    decides_slope: Array
    decides_per_log_speed: Array
    possible: NDArray[np.bool_]


def predicted(
    scene: Scene,
    values: Mapping[str, Array],
    before: Array,
    side: NDArray[np.int64],
    branch: NDArray[np.int64],
    *,
    corner: bool,
) -> Predicted:
    """Predict throws from places on a side that take a branch, for a scene at m values of its quantities.

    Places are those of the centre of mass, or, with `corner`, of the left corner of the side that the part rests on.
    How far this corner is from the centre of mass is the part's geometry, which varies with the quantities.
    """
    stack = throw_stack(scene, values)
    params, move = stack.params, STEP * scene.arm_length
    x = before + params.a[:, side] if corner else before
    after, slope, decides = at_points(params, x, side, branch)
    fast, _, fast_decides = at_points(
        params._replace(kappa=params.kappa * np.exp(-2 * STEP)), x, side, branch
    )
    slow, _, slow_decides = at_points(params._replace(kappa=params.kappa * np.exp(2 * STEP)), x, side, branch)
    _, _, beyond = at_points(params, x + move, side, branch)
    _, _, short = at_points(params, x - move, side, branch)
    if corner:
        after = after - params.a[:, (side + branch) % len(scene.sides)]
    return Predicted(
        after,
        slope,
        (fast - slow) / (2 * STEP),
        decides,
        (beyond - short) / (2 * move),
        (fast_decides - slow_decides) / (2 * STEP),
        stack.possible[:, None],
    )
