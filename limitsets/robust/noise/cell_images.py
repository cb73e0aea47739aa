"""Images of cells under the noise of the throw itself: boxcars of a map and a stratum of its parameter.

In one dimension, with forced branches, cells are cut where the map of each stratum changes its branch, turns or jumps:
a critical point moves with the noise, and so does the cut.  Otherwise points of the cells are mapped; if neighbouring
points take the same branch, each is spread over the distance between their images.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.maps import along, has_slope, images, kind_of
from limitsets.robust.noise.boxcars import Boxcars
from limitsets.robust.noise.interpolated_pieces import Pieces
from limitsets.sets.markov_chain import sample_points

Array = NDArray[np.float64]
MapOf = Callable[[float], Any]

# Places per piece at which the effect of the noise within a stratum is computed; between them it is interpolated.
PLACES = 512
# Samples per cell and axis where there are no pieces, by dimension.
SAMPLES = {1: 32, 2: 4, 3: 3}


def _within(map_of: MapOf, mean: float, half: float, x: Array, side: int, branch: int) -> tuple[Array, Array]:
    """How far the noise within a stratum moves images: width of what it spreads them over, and shift of their mean."""
    if half == 0.0:
        return np.zeros(x.size), np.zeros(x.size)
    some = x if x.size <= PLACES else x[np.linspace(0, x.size - 1, PLACES).astype(np.int64)]
    below, at, above = (along(map_of(mean + d), some, side, [branch])[0] for d in (-half, 0.0, half))
    width, shift = np.abs(above - below), (below - 2.0 * at + above) / 6.0
    known = np.isfinite(width) & np.isfinite(shift)
    width, shift = np.where(known, width, 0.0), np.where(known, shift, 0.0)
    return np.interp(x, some, width), np.interp(x, some, shift)


def boxes_of_pieces(
    map_of: MapOf, grid: Grid, pieces: Pieces, mean: float, sd: float, weight: float
) -> Iterator[Boxcars]:
    """Boxcars of all cells under one stratum of the map's parameter, piece by piece.

    Parameters
    ----------
    map_of : callable
        From the parameter to the map.
    grid : Grid
        The cells.
    pieces : dict
        Monotone pieces of every side at the stratum's mean.
    mean, sd, weight : float
        The stratum.
    """
    params, half = map_of(mean), math.sqrt(3.0) * sd
    for side, cuts in pieces.items():
        edges = grid.edges[side][0]
        for cut in cuts:
            lo, hi = max(cut.lo, float(edges[0])), min(cut.hi, float(edges[-1]))
            if not hi > lo:
                continue
            first = int(np.searchsorted(edges, lo, side="right")) - 1
            last = int(np.searchsorted(edges, hi, side="left"))
            x = edges[first : last + 1].copy()
            x[0], x[-1] = lo, hi
            y, to, _ = along(params, x, side, [cut.branch])
            if not 0 <= int(to[0]) < grid.sides:
                continue
            finite = np.isfinite(y)
            known = finite[1:] & finite[:-1]  # elsewhere the mass is missing: outside the model
            y = np.where(finite, y, 0.0)
            width, shift = _within(map_of, mean, half, 0.5 * (x[1:] + x[:-1]), side, cut.branch)
            middle = 0.5 * (y[1:] + y[:-1]) + shift
            reach = 0.5 * np.hypot(np.diff(y), width)
            share = np.where(known, weight * np.diff(x) / np.diff(edges[first : last + 1]), 0.0)
            number = int(grid.offset[side]) + first
            yield Boxcars(number, int(to[0]), cut.branch, middle - reach, middle + reach, share)


def rows_of_points(
    map_of: MapOf, grid: Grid, mean: float, sd: float, weight: float, side: int
) -> tuple[NDArray[Any], ...]:
    """Send evenly spread points of the cells of one side, each for an equal share of its cell.

    Returns
    -------
    source, x, side, code, weight, width : ndarray
        Cell each comes from, where it lands, and over what width the noise within the stratum spreads it (in one
        dimension, where the branch stays the same; else 0).
    """
    dimension = grid.dimension
    samples = SAMPLES[dimension]
    cells = np.arange(grid.offset[side], grid.offset[side + 1])
    points = sample_points(grid, cells, side, samples)
    found = images(map_of(mean), points, side)
    width = np.zeros(found.code.size)
    if dimension == 1:
        width = _spread_of_points(map_of, mean, math.sqrt(3.0) * sd, points, side, found, samples)
    source = np.repeat(cells, samples**dimension)
    share = np.full(source.size, weight * samples ** -float(dimension))
    return source, found.x, found.side, found.code, share, width


def _spread_of_points(
    map_of: MapOf, mean: float, half: float, points: Array, side: int, found: Any, samples: int
) -> Array:
    """Width over which each point's image is spread: that of its part of the cell, and that of the noise."""
    x, code = found.x.reshape(-1, samples), found.code.reshape(-1, samples)
    gap = np.abs(np.diff(x, axis=1))
    same = (np.diff(code, axis=1) == 0) & (np.diff(found.side.reshape(-1, samples), axis=1) == 0)
    gap = np.where(same, gap, np.inf)
    left, right = np.pad(gap, ((0, 0), (1, 0)), mode="edge"), np.pad(gap, ((0, 0), (0, 1)), mode="edge")
    part = np.minimum(left, right)
    width: Array = np.where(np.isfinite(part), part, 0.0).ravel()
    if half > 0.0:
        ends = [images(map_of(mean + d), points, side) for d in (-half, half)]
        alike = (ends[0].code == found.code) & (ends[1].code == found.code)
        alike &= (ends[0].side == found.side) & (ends[1].side == found.side)
        noise = np.where(alike, np.abs(ends[1].x - ends[0].x), 0.0)
        width = np.hypot(width, noise)
    return width


def uses_pieces(params: Any) -> bool:
    """Whether cells of a map can be cut into monotone pieces."""
    kind = kind_of(params)
    return kind.dimension == 1 and has_slope(params)
