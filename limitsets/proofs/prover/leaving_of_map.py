"""Starts that leave the domain of a map: labels of cells beside their ranks.

The exit of a cell is 0 where all of its image lies beyond the domain, else larger than the exits of all target cells
inside.  An orbit from there is outside after that many steps and one, for a whole number cannot fall for ever.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.base.arrays import Arrays
from limitsets.proofs.prover.certificate_of_map import (
    IMPOSSIBLE,
    NO_CLAIM,
    Numbers,
    Targets,
    ranges_of,
    targets_of,
)
from limitsets.systems.cells import Grid
from limitsets.systems.graph.components import ranks, reach, strong_components


def exits_of(images: Targets, grid: Grid) -> Numbers:
    """Find the longest path out of the domain from each cell, less the last step; -1 where one may stay."""
    first, last = np.split(images.cells, 2, axis=2)
    inside = np.concatenate([np.maximum(first, 0), np.minimum(last, grid.shape[images.to] - 1)], axis=2)
    inside[(inside[..., : grid.dimension] > inside[..., grid.dimension :]).any(axis=2)] = IMPOSSIBLE
    graph = ranges_of(grid, inside, images.to, images.unknown)
    parts = strong_components(graph)
    exits = ranks(graph, parts, parts.recurrent)
    exits[reach(graph, parts, (images.unknown | parts.recurrent[parts.label]).astype(np.uint8)) > 0] = (
        NO_CLAIM
    )
    return exits


def with_exits(arrays: Arrays, lower: Any, upper: Any, grid: Grid) -> Arrays:
    """Add the exits of the cells to the arrays of a certificate, with targets beyond the domain where they have one."""
    images = targets_of(lower, upper, grid)
    exits = exits_of(images, grid)
    return arrays | {"exit": exits} | targets_beyond(arrays, images, exits >= 0)


def targets_beyond(arrays: Arrays, images: Targets, chosen: Any) -> Arrays:
    """Return the targets of a certificate, of the chosen cells (n,) with those beyond the domain."""
    names = (f"target.{branch}" for branch in range(len(images.cells)))
    return {
        name: np.where(chosen[:, None], cells, arrays[name])
        for name, cells in zip(names, images.cells, strict=True)
    }
