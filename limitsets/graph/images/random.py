"""The box around the images of random points of a cell."""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.graph.images.samples import SamplePoints


def random(grid: Grid, side: int, *, samples: int = 16, seed: int = 0, **_: Any) -> SamplePoints:
    """Draw `samples` uniform points per cell, from a seeded generator, so that a graph can be built again."""
    if samples < 1:
        raise AnswerError("the number of samples", samples, "an integer from 1", "pass samples=16")
    cells = np.arange(grid.offset[side], grid.offset[side + 1])
    lo, hi = grid.boxes(cells, side)
    points = np.random.default_rng([seed, side]).uniform(
        lo[:, None, :], hi[:, None, :], (len(cells), samples, lo.shape[1])
    )
    shape = [int(n) for n in grid.shape[side]]
    strides = tuple(samples * int(np.prod(shape[k + 1 :])) for k in range(len(shape)))
    axes = tuple(np.ascontiguousarray(points[:, :, axis].ravel()) for axis in range(grid.dimension))
    return SamplePoints(axes, strides, np.arange(samples), scattered=True)
