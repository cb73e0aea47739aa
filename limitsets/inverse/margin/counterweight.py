"""The counterweight (lead weight) that gives a plate a wanted centre and radius of gyration: one point mass, if any.

With the share f of the whole mass at the point p, and the plate's own centre g and radius of gyration r,

    c = g + f (p - g)        rho^2 = (1 - f) r^2 + f (1 - f) |p - g|^2 = (1 - f) r^2 + (1 - f)/f |c - g|^2

so that f is the positive root of r^2 f^2 + (rho^2 - r^2 + |c - g|^2) f - |c - g|^2.  Source: the paper's parts are
plates with a lead weight (section 5); docs/model.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.geometry import plate_with_points, side_ends
from limitsets.geometry.polygon import above_side
from limitsets.scene import Scene


class Counterweight(NamedTuple):
    """A point mass on a uniform plate.

    Attributes
    ----------
    share : float
        Of the whole mass; below 0 or from 1 on there is no such mass.
    x, y : float
        Where, in the frame of the vertices [length].
    inside : float
        How far inside the plate, least over the sides; below 0 it lies outside [length].
    """

    share: float
    x: float
    y: float
    inside: float


def counterweight_for(
    vertices: NDArray[np.float64], centre: tuple[float, float], radius_of_gyration: float
) -> Counterweight:
    """Find the point mass that moves a plate's centre of mass and sets its radius of gyration.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2)
        The plate, counterclockwise [length].
    centre : pair of floats
        Centre of mass of plate and point [length].
    radius_of_gyration : float
        Of both, about that centre [length].

    Returns
    -------
    Counterweight

    Examples
    --------
    >>> square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    >>> found = counterweight_for(square, (0.4, 0.0), (1 / 3 + 0.16) ** 0.5)  # half of the mass 0.8 off: r^2 = 2/3
    >>> round(found.share, 12), round(found.x, 12), round(found.inside, 12)
    (0.5, 0.8, 0.2)
    """
    plate = plate_with_points(vertices, 1.0)
    g, own = plate.centre, plate.radius_of_gyration**2
    across = (centre[0] - g[0], centre[1] - g[1])
    off = across[0] ** 2 + across[1] ** 2
    half = 0.5 * (radius_of_gyration**2 - own + off)
    share = (math.sqrt(half * half + own * off) - half) / own
    if not share > 0.0:
        return Counterweight(share, *g, -math.inf)
    point = (g[0] + across[0] / share, g[1] + across[1] / share)
    corners = [(float(x), float(y)) for x, y in vertices]
    ends = [side_ends(len(corners), side) for side in range(len(corners))]
    inside = min(above_side(corners[left], corners[right], point, math.sqrt)[1] for left, right in ends)
    return Counterweight(share, *point, float(inside))


def counterweight_of(scene: Scene) -> Counterweight:
    """Find the point mass that makes a scene's part of a uniform plate of its shape.

    Examples
    --------
    >>> import limitsets as ls
    >>> counterweight_of(ls.load("paper-designed")).inside > 0
    True
    """
    return counterweight_for(scene.vertices, scene.centre, scene.radius_of_gyration)
