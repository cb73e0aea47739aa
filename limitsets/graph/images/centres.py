"""The image of a cell's centre represents the cell."""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.cells import Grid
from limitsets.graph.images.samples import SamplePoints


def centres(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """One point per cell: the middle."""
    axes = tuple(0.5 * (edges[1:] + edges[:-1]) for edges in grid.edges[side])
    shape = [int(n) for n in grid.shape[side]]
    strides = tuple(int(np.prod(shape[k + 1 :])) for k in range(len(shape)))
    return SamplePoints(axes, strides, np.zeros(1, np.int64))
