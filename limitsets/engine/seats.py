"""Where a part is seated in the cavity: a side on the ramp, slid down to the wall, the floor or the parts below."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.geometry import side_ends

if TYPE_CHECKING:
    from limitsets.scene import Scene

SEATED = 0.01
"""So much of the mouth's width a seated part's corners are off its seat at most: less than the play of
studies/sizes.toml, 0.1 of 9.3 in.  A part farther off keeps the next one from fitting."""

Points = NDArray[np.float64]


@arguments_checked
def seat_of(scene: Scene, side: int, below: Sequence[Points] = ()) -> Points:
    """Give the corners of a part seated in its scene's cavity.

    Parameters
    ----------
    scene : Scene
        With a cavity.
    side : int
        The side on the ramp.
    below : sequence of ndarray, shape (m, 2)
        Corners of parts that are seated already [length].

    Returns
    -------
    ndarray, shape (n, 2)
        In the scene's order, from the joint [length].

    Raises
    ------
    AnswerError
        For a scene without [cavity], and for a part that would stand out of it.

    Examples
    --------
    >>> import limitsets as ls
    >>> cavity = {"position": "20 in", "width": "9.3 in", "depth": "5.8633 in", "angle": "32.23 deg"}
    >>> scene = ls.load({**ls.load("paper-designed").as_dict(), "cavity": cavity})
    >>> seat_of(scene, 2).round(2).tolist()
    [[29.3, -2.44], [23.55, -2.44], [29.26, -6.04]]
    """
    cavity = scene.cavity
    if cavity is None:
        remedy = "add [cavity] with position, width, depth and angle"
        raise AnswerError("the scene", "without [cavity]", "one with a cavity", remedy)
    left, right = side_ends(len(scene.vertices), side)
    along, up = (scene.vertices[right] - scene.vertices[left]).tolist()
    turn = -cavity.angle - math.atan2(up, along)
    cos, sin = math.cos(turn), math.sin(turn)
    corners = (scene.vertices - scene.vertices[left]) @ np.array([[cos, sin], [-sin, cos]])
    # from so far up the ramp's line that nothing is met yet
    down = np.array([math.cos(cavity.angle), -math.sin(cavity.angle)])
    size = 2.0 * float(np.hypot(*np.ptp(scene.vertices, axis=0)))
    corners += np.array([cavity.position, scene.surface_height]) - size * down
    wall, floor = cavity.position + cavity.width, scene.surface_height - cavity.depth
    way = [float(((wall - corners[:, 0]) / down[0]).min()), float(((floor - corners[:, 1]) / down[1]).min())]
    for other in below:
        way += [_ahead(corner, other, down) for corner in corners]
        way += [_ahead(corner, corners, -down) for corner in other]
    seated: Points = corners + min(way) * down
    out = max(float(seated[:, 1].max()) - scene.surface_height, cavity.position - float(seated[left, 0]))
    if out > 0.0:
        remedy = "widen or deepen the cavity, or let another side lie on the ramp"
        thing = f"the part on side {side} in the cavity"
        raise AnswerError(thing, f"standing out by {out:.4g} {scene.unit}", "a part that fits", remedy)
    return seated


@arguments_checked
def off_seat(corners: Sequence[tuple[float, float]], seat: Points) -> float:
    """Give by how much the corner that is farthest from its seat is off.

    Parameters
    ----------
    corners : sequence of (float, float)
        Corners of the part [length].
    seat : ndarray, shape (n, 2)
        Where they should be [length].

    Returns
    -------
    float
        The largest distance [length].

    Examples
    --------
    >>> import numpy as np
    >>> off_seat([(0.0, 0.0), (1.0, 0.0)], np.array([[0.0, 0.0], [1.0, 0.5]]))
    0.5
    """
    return float(np.hypot(*(np.asarray(corners) - seat).T).max())


def _ahead(point: Points, outline: Points, way: Points) -> float:
    """How far a point can go this way until it meets an outline."""
    nearest = math.inf
    for one, two in pairwise([*outline, outline[0]]):
        side, to = two - one, one - point
        across = way[0] * side[1] - way[1] * side[0]
        if abs(across) <= 1e-9 * math.hypot(side[0], side[1]):  # along it: its ends are met on other sides
            continue
        time = (to[0] * side[1] - to[1] * side[0]) / across
        share = (to[0] * way[1] - to[1] * way[0]) / across
        if time >= 0.0 and -1e-9 <= share <= 1.0 + 1e-9:
            nearest = min(nearest, float(time))
    return nearest
