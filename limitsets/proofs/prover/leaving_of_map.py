"""Starts that leave the domain of a map, or the cells without a rank: labels of cells beside their ranks.

The exit of a cell is 0 where all of its image lies beyond the domain, else larger than the exits of all target cells
inside.  An orbit from there is outside after that many steps and one, for a whole number cannot fall for ever.

Almost every start, on a line, leaves the cells without a rank, Z, where Z has a weight w > T(w): for each cell t of Z,
T(w) adds over branches and runs of cells on which the map is one to one the largest w/|slope| of the cells that lead
to t.  Densities up to w become densities up to T(w) by a step (limitsets/checker/map_weights.py has the proof).
T(u + v) <= T(u) + T(v), so that w = u_0 + ... + u_N with u_0 = 1 and u_(k+1) = T(u_k)/theta has T(w) <= theta w once
u_(N+1) <= u_0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from limitsets.base.arrays import Array, Arrays, Ints, Mask
from limitsets.proofs.prover.certificate_of_map import (
    IMPOSSIBLE,
    NO_CLAIM,
    Numbers,
    Targets,
    ranges_of,
)
from limitsets.systems.cells import Grid
from limitsets.systems.graph.components import ranks, reach, strong_components
from limitsets.systems.maps.derived import branch_boxes

# What a step brings is at most this share of the weights; at most so many terms, and a size from which none comes down.
THETA, TERMS, TOO_LARGE = 0.999, 5_000, 1e100


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


def targets_beyond(arrays: Arrays, images: Targets, chosen: Any) -> Arrays:
    """Return the targets of a certificate, of the chosen cells (n,) with those beyond the domain."""
    names = (f"target.{branch}" for branch in range(len(images.cells)))
    return {
        name: np.where(chosen[:, None], cells, arrays[name])
        for name, cells in zip(names, images.cells, strict=True)
    }


# ---------------------------------------------------------------- almost every start


def weights_of(lower: Any, upper: Any, grid: Grid, images: Targets, thin: Mask) -> Array | str:
    """Find weights of the cells without a rank, `thin`, on a line; or say what is missing."""
    if (images.unknown & thin).any():
        return "an image of a cell without a rank is not enclosed"
    links = _links(lower, upper, grid, images, thin)
    if isinstance(links, str):
        return links
    weight = _weight(_step(*links), thin.astype(np.float64))
    if weight is None:
        return "the starts in cells without a rank are not seen to thin out: finer cells may show it"
    return weight


def _links(
    lower: Any, upper: Any, grid: Grid, images: Targets, thin: Mask
) -> tuple[Ints, Ints, Ints, Array] | str:
    """List run, cell, target and slope of the links between cells without a rank; or say where it may be 0."""
    parts, runs = [], 0
    for branch, side in np.ndindex(len(images.cells), grid.sides):
        cells = np.flatnonzero(thin & (grid.side_of(np.arange(grid.n_cells)) == side))
        boxes = branch_boxes(lower, upper, side, branch, *grid.boxes(cells, side))
        low, high = boxes.slope_lo[:, 0, 0], boxes.slope_hi[:, 0, 0]
        slope = np.where(low > 0.0, low, np.where(high < 0.0, high, 0.0))
        first, last = images.cells[branch, cells].T.astype(np.int64)
        begin = int(grid.offset[boxes.side])
        first, last = np.maximum(first, 0), np.minimum(last, grid.shape[boxes.side, 0] - 1)
        sizes = np.maximum(last - first + 1, 0)
        owner = np.repeat(np.arange(cells.size), sizes)
        target = begin + np.arange(owner.size) - np.repeat(np.cumsum(sizes) - sizes - first, sizes)
        owner, target = owner[thin[target]], target[thin[target]]
        used = np.unique(owner)
        flat = cells[used[slope[used] == 0.0]]
        if flat.size:
            lo, hi = grid.boxes(flat[:1], side)
            where = f"[{lo[0, 0]:.6g}, {hi[0, 0]:.6g}]"
            return f"the slope may be 0 on {where}, from where orbits may come to cells without a rank"
        sign = np.zeros(cells.size)
        sign[used] = np.sign(slope[used])
        run = runs + np.cumsum((np.diff(cells, prepend=-2) != 1) | (np.diff(sign, prepend=2.0) != 0))
        parts.append((run[owner], cells[owner], target, np.abs(slope[owner])))
        runs += cells.size
    run, cell, target, slopes = (np.concatenate(column) for column in zip(*parts, strict=True))
    return run, cell, target, slopes


def _step(run: Ints, cell: Ints, target: Ints, slope: Array) -> Callable[[Array], Array]:
    """Return T, which gives the weights after a step from those before."""
    order = np.lexsort((target, run))
    run, cell, target, slope = run[order], cell[order], target[order], slope[order]
    begins = np.flatnonzero(np.diff(run, prepend=-1) | np.diff(target, prepend=-1))

    def after(weight: Array) -> Array:
        largest = np.maximum.reduceat(weight[cell] / slope, begins) if begins.size else np.zeros(0)
        return np.bincount(target[begins], largest, weight.size).astype(np.float64)

    return after


def _weight(step: Callable[[Array], Array], first: Array) -> Array | None:
    """Add up terms until the next is no larger than the first, which is 1 on some cells; None where none comes."""
    weight = term = first
    for _ in range(TERMS):
        term = step(term) / THETA
        if (term <= first).all():
            return weight
        if term.max() > TOO_LARGE:
            break
        weight = weight + term
    return None
