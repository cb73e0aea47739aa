"""Outer images of sets of cells, from a transition graph."""

from __future__ import annotations

import numpy as np

from limitsets.graph import TransitionGraph
from limitsets.graph.ranges import expand
from limitsets.policies.game import Image, Mask


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
