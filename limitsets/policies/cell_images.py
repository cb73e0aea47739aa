"""Outer images of sets of cells, from a transition graph, with the scatter of landings on top."""

from __future__ import annotations

import numpy as np

from limitsets.cells import Grid
from limitsets.graph import TransitionGraph
from limitsets.graph.ranges import expand
from limitsets.policies.game import Image, Mask

__all__ = ["image_of", "scattered"]


def image_of(graph: TransitionGraph) -> Image:
    """Give the image of a graph's cells: proved to hold that of every point where its method is "boxes".

    Examples
    --------
    >>> import limitsets as ls
    >>> grid = ls.grid([(0.0, 1.0)], cells=4)
    >>> image = image_of(ls.transitions(ls.maps.Logistic(2.0), grid, "boxes"))
    >>> image(np.array([True, False, False, False])).tolist()
    [True, True, False, False]
    """
    pointer, targets = expand(graph.ranges)
    leaves = graph.ranges.exits > 0

    def image(cells: Mask) -> Mask | None:
        if (cells & leaves).any():
            return None
        found = np.zeros(graph.n_cells, dtype=bool)
        for cell in np.flatnonzero(cells).tolist():
            found[targets[pointer[cell] : pointer[cell + 1]]] = True
        return found

    return image


def scattered(image: Image, grid: Grid, landing: float) -> Image:
    """Widen an image in one dimension by the scatter of the place of landing [length]; past the last cell it leaves."""
    first, last, leaves = [], [], []
    for side, (edges,) in enumerate(grid.edges):
        lo = np.nextafter(edges[:-1] - landing, -np.inf)
        hi = np.nextafter(edges[1:] + landing, np.inf)
        offset, n = int(grid.offset[side]), edges.size - 1
        first.append(offset + np.clip(np.searchsorted(edges, lo, side="left") - 1, 0, n - 1))
        last.append(offset + np.clip(np.searchsorted(edges, hi, side="right") - 1, 0, n - 1))
        leaves.append((lo < edges[0]) | (hi > edges[-1]))
    begin, end, lost = np.concatenate(first), np.concatenate(last), np.concatenate(leaves)

    def wider(cells: Mask) -> Mask | None:
        found = image(cells)
        if found is None or (found & lost).any():
            return None
        steps = np.zeros(grid.n_cells + 1, dtype=np.int64)
        np.add.at(steps, begin[found], 1)
        np.add.at(steps, end[found] + 1, -1)
        met: Mask = np.cumsum(steps[:-1]) > 0
        return met

    return wider
