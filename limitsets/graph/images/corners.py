"""The box around the images of a cell's corners, bare or enlarged by one cell on every side.

Neighbours share corners, so there are hardly more points than cells.  In one dimension, on branches that are
monotone in each cell, the corners are the end points and the box is the image itself; there a cell on which the
branch changes is cut where it does.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.graph.images.samples import SamplePoints


def corners(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """Two, four or eight corners per cell."""
    axes = grid.edges[side]
    sizes = [edges.size for edges in axes]
    strides = tuple(int(np.prod(sizes[k + 1 :])) for k in range(len(sizes)))
    offsets = [
        sum(s * c for s, c in zip(strides, corner, strict=True))
        for corner in product((0, 1), repeat=len(axes))
    ]
    return SamplePoints(axes, strides, np.array(offsets, np.int64))


def corners_padded(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """Corners, and one cell more on every side of the box."""
    bare = corners(grid, side)
    return SamplePoints(bare.axes, bare.strides, bare.offsets, pad=1)


def end_points(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """End points of cells in one dimension; raises AnswerError in more."""
    if grid.dimension != 1:
        raise AnswerError(
            "the image method", "end-points", "another in more than one dimension", "use corners-padded"
        )
    bare = corners(grid, side)
    return SamplePoints(bare.axes, bare.strides, bare.offsets, split=True)
