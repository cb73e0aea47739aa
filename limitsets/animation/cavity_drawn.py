"""The cavity in a film: a sheet as thick as the arm, that is part of the arm and turns with it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from limitsets.animation.picture import THICK

if TYPE_CHECKING:
    from limitsets.scene import Scene

Array = NDArray[np.float64]


def cavity_pieces(scene: Scene, wall: float) -> tuple[Array, ...]:
    """Give ramp, floor and far wall as convex polygons, with the arm level.

    Parameters
    ----------
    scene : Scene
        The scene; without a cavity there are no pieces.
    wall : float
        How high the far wall stands over the arm's surface [length].
    """
    cavity, top = scene.cavity, scene.surface_height
    if cavity is None:
        return ()
    end, low, thick = cavity.position, top - cavity.depth, THICK * cavity.position / 28.0
    foot, far = end + cavity.depth / math.tan(cavity.angle), end + cavity.width
    corners = [
        [(end, top - thick), (foot, low - thick), (foot, low), (end, top)],
        [(foot, low - thick), (far, low - thick), (far, low), (foot, low)],
        [(far, low - thick), (far + thick, low - thick), (far + thick, top + wall), (far, top + wall)],
    ]
    return tuple(np.array(each) for each in corners if each[1][0] - each[0][0] > 1e-6 * cavity.width)
