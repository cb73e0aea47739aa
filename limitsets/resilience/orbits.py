"""Random starts in cells, and where their orbits come to."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.graph import TransitionGraph
from limitsets.graph.target import Target
from limitsets.maps import codes, images
from limitsets.resilience.colours import Colours

__all__ = ["STEPS", "follow", "labelled_starts", "random_starts", "starts_in"]

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Steps after which an orbit that has come nowhere is given up.
STEPS = 10_000


def starts_in(grid: Grid, cells: Integers, rng: np.random.Generator) -> tuple[Floats, Integers]:
    """Draw a start in each of the given cells, evenly: states of shape (n, dimension), and their sides."""
    side, x = grid.side_of(cells), np.empty((cells.size, grid.dimension))
    part = rng.random(x.shape)
    for s in range(grid.sides):
        here = np.flatnonzero(side == s)
        lo, hi = grid.boxes(cells[here], s)
        x[here] = lo + part[here] * (hi - lo)
    return x, side


def random_starts(grid: Grid, count: int, rng: np.random.Generator) -> tuple[Floats, Integers]:
    """Draw starts evenly by length (area, volume) over all sides."""
    measure = grid.measure
    return starts_in(grid, rng.choice(grid.n_cells, count, p=measure / measure.sum()), rng)


def _next(params: Any, x: Floats, side: Integers) -> tuple[Floats, Integers, Integers]:
    """One step of states on several sides."""
    after, to, code = np.empty_like(x), np.empty_like(side), np.empty_like(side)
    for s in np.unique(side).tolist():
        here = np.flatnonzero(side == s)
        there = images(params, x[here], s)
        after[here], to[here], code[here] = there.x.reshape(here.size, -1), there.side, there.code
    return after, to, code


def follow(
    graph: TransitionGraph, stops: NDArray[np.int32], x: Floats, side: Integers, steps: int
) -> tuple[Integers, Integers]:
    """Follow starts, as the cells do without random noise, until they come to a cell with a label or leave the domain.

    Parameters
    ----------
    graph : TransitionGraph
        Map and cells.
    stops : ndarray of int32, shape (n_cells,)
        Labels; undecided cells are passed through.
    x, side : ndarray, shape (n, dimension) and (n,)
        Starts in the domain.
    steps : int
        At most so many.

    Returns
    -------
    ndarray of int, shape (n,)
        Label, or code of the exit; undecided for those still on their way.
    ndarray of int, shape (n,)
        Steps made.
    """
    grid, ways = graph.grid, list(graph.exits.values())
    target = Target.of(grid, graph.exits)
    below, above = ways[target.sink_below], ways[target.sink_above]
    end, made = np.full(side.size, codes.UNDECIDED, dtype=np.int64), np.zeros(side.size, dtype=np.int64)
    going, code = np.arange(side.size), np.zeros(side.size, dtype=np.int64)
    for step in range(steps + 1):
        if step:
            x, side, code = _next(graph.map, x, side)
            made[going] = step
        label = np.where(code < 0, code, codes.UNDECIDED)
        for s in np.unique(side[code >= 0]).tolist():
            here = np.flatnonzero((side == s) & (code >= 0))
            cell = grid.index(x[here], s)
            low = (x[here] < grid.domain.lo[s]).any(axis=1)
            label[here] = np.where(cell >= 0, stops[cell], np.where(low, below, above))
        end[going] = label
        on = np.flatnonzero(label == codes.UNDECIDED)
        going, x, side = going[on], x[on], side[on]
        if not going.size:
            break
    return end, made


def labelled_starts(parted: Colours, steps: int, rng: np.random.Generator) -> Integers:
    """Label of a start in each cell: the cell's where it is decided, else where its orbit comes to.

    The places along each axis are drawn once, so that starts of one row differ in one coordinate only.
    """
    grid, label = parted.grid, parted.labels.astype(np.int64)
    for s, axes in enumerate(grid.edges):
        places = [edges[:-1] + rng.random(edges.size - 1) * np.diff(edges) for edges in axes]
        cells = parted.undecided[grid.side_of(parted.undecided) == s]
        x = np.stack([at[k] for at, k in zip(places, grid.axes(cells, s), strict=True)], axis=1)
        label[cells] = follow(parted.graph, parted.labels, x, np.full(cells.size, s), steps)[0]
    return label
