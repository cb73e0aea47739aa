"""Where a part's vertices are: lying on a side, and in flight.  Figures and animations place it by the same functions.

A pose is the centre of mass (x, y) and the angle by which the part has turned from the frame of the scene's vertices.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from limitsets.geometry import side_ends

if TYPE_CHECKING:
    from limitsets.scene import Scene

Array = NDArray[np.float64]


def about_centre(scene: Scene) -> Array:
    """Vertices about the centre of mass, in the frame in which the scene gives them; shape (n, 2)."""
    about: Array = scene.vertices - np.asarray(scene.centre)
    return about


def angle_on_side(scene: Scene, side: int) -> float:
    """Angle of the part when it lies on a side [rad]."""
    left, right = side_ends(len(scene.vertices), side)
    along = scene.vertices[right] - scene.vertices[left]
    return -math.atan2(float(along[1]), float(along[0]))


def outline(scene: Scene, side: int) -> Array:
    """Vertices about the centre of mass with `side` at the bottom, its left end first."""
    left, _ = side_ends(len(scene.vertices), side)
    rolled: Array = np.roll(turned(about_centre(scene), angle_on_side(scene, side)), -left, axis=0)
    return rolled


def turned(points: Array, angle: float) -> Array:
    """Turn points counterclockwise about the origin."""
    cosine, sine = math.cos(angle), math.sin(angle)
    found: Array = points @ np.array([[cosine, sine], [-sine, cosine]])
    return found


def centre_in_flight(
    scene: Scene, x: float, side: int, phi: float | Array, kappa: float | None = None
) -> Array:
    """Centre of mass in flight after the part has turned by phi (docs/model.md, flight); shape (..., 2)."""
    h, d, fall = scene.surface_height, float(scene.sides.d[side]), scene.kappa if kappa is None else kappa
    at = np.asarray(phi)
    return np.stack([x - (h + d) * at, h + d + x * at - 0.5 * fall * at * at], axis=-1)
