"""Certified margins: the largest proved square around a point, and the point of a plane that has the most room."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from limitsets.errors import AnswerError
from limitsets.regions.run import CODES, Regions
from limitsets.robust.margins.finding import goals_of
from limitsets.robust.margins.joint import joint_margin
from limitsets.robust.margins.margin_result import Margin
from limitsets.scene import Scene
from limitsets.scene.quantities import find
from limitsets.scene.units import exact_factor, parse

# Halvings of a size; it is lessened by this share, against the rounding of its ends.
HALVINGS, ROOM = 40, 1e-9


class Pick(NamedTuple):
    """A point of a plane, and how much room it has.

    Attributes
    ----------
    values : dict of str to str
        The two quantities, with units.
    factor : float
        The goal is proved for all parameters that differ from the values by at most so many times the scales.
    """

    values: dict[str, str]
    factor: float


def largest_square(
    scene: Scene, centre: Mapping[str, str], scales: Mapping[str, str], *, width: float = 0.01
) -> Margin:
    """Bracket the largest square around a point for all parameters of which the scene's goal is proved.

    Parameters
    ----------
    scene : Scene
        The scene, with its goal.
    centre : mapping of str to str
        The point: quantities with units.
    scales : mapping of str to str
        Half the square of factor 1, by quantity: in percent or with a unit.
    width : float
        How close the proved and the refuted factor have to be, as a share of the upper one.

    Returns
    -------
    Margin
        The joint margin of the scene at this point: its `proved` and `refuted` are factors on the scales.

    Examples
    --------
    >>> import limitsets as ls
    >>> centre = {"throw.speed": "162 deg/s", "arm.surface_height": "-0.2 in"}
    >>> scales = {"throw.speed": "0.5 deg/s", "arm.surface_height": "0.02 in"}
    >>> square = largest_square(ls.load("paper-designed"), centre, scales, width=0.2)
    >>> 2.0 < square.proved < square.refuted < 6.0
    True
    """
    placed = scene.with_values(centre)
    return joint_margin(placed, goals_of(placed, None), scales, width=width)


def roomiest(found: Regions, scales: Mapping[str, str]) -> Pick:
    """Pick the border point of a plane around which the largest square, in units of the scales, is proved.

    Parameters
    ----------
    found : Regions
        The plane.
    scales : mapping of str to str
        Half the square of factor 1, by quantity of the axes, with a unit.

    Returns
    -------
    Pick

    Raises
    ------
    AnswerError
        No scale of a quantity, or nothing of the plane is proved.
    """
    places, units = [], []
    for axis in found.axes:
        if axis.quantity not in scales:
            raise AnswerError("the scales", list(scales), f"one of {axis.quantity}", "give it, with a unit")
        given = parse(scales[axis.quantity], find(axis.quantity).dimension)
        places.append(np.array([float(value) for value in axis.borders]))
        units.append(float(given.number) * float(exact_factor(given.unit, axis.unit)))
    bad = np.zeros(tuple(each.size for each in places), dtype=np.int64)
    bad[1:, 1:] = np.cumsum(
        np.cumsum(found.raster(found.code) != CODES.index("proved"), axis=0, dtype=np.int64), axis=1
    )
    x, y = (each.ravel() for each in np.meshgrid(*places, indexing="ij"))
    low = np.zeros(x.size)
    high = np.full(x.size, min(np.ptp(each) / unit for each, unit in zip(places, units, strict=True)))
    for _ in range(HALVINGS):
        size = 0.5 * (low + high)
        a, b = _between(places[0], x, size * units[0])
        c, d = _between(places[1], y, size * units[1])
        inside = (a >= 0) & (b < places[0].size) & (c >= 0) & (d < places[1].size)
        a, b, c, d = (np.where(inside, each, 0) for each in (a, b, c, d))
        good = inside & (bad[b, d] - bad[a, d] - bad[b, c] + bad[a, c] == 0)
        low, high = np.where(good, size, low), np.where(good, high, size)
    best = int(low.argmax())
    if not low[best] > 0.0:
        raise AnswerError(
            "the plane", found.shares(), "one in which something is proved", "choose another one"
        )
    i, j = np.unravel_index(best, tuple(each.size for each in places))
    values = {axis.quantity: axis.text(int(k)) for axis, k in zip(found.axes, (i, j), strict=True)}
    return Pick(values, float(low[best]) * (1.0 - ROOM))


def _between(
    borders: np.ndarray[tuple[int], np.dtype[np.float64]], middle: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the last border not above, and the first not below, middle -+ half; -1 or n where there is none."""
    low = np.searchsorted(borders, middle - half, side="right") - 1
    return low, np.searchsorted(borders, middle + half, side="left")
