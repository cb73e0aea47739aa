"""Cells that are recurrent only because they are coarse."""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.cells import CellSet
from limitsets.graph import TransitionGraph, transitions

# Refinements are tried from coarse to fine, and only up to this many cells in all.
MOST_CELLS = 4_000_000


def spurious(graph: TransitionGraph, parts: int = 8, **options: Any) -> tuple[CellSet, ...]:
    """Recurrent components in which nothing recurs once their cells are cut finer.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    parts : int
        Pieces per cell and axis; fewer are used where the finer graph would have more than four million cells.
    **options
        Of the image method, as given to `limitsets.transitions`.

    Returns
    -------
    tuple of CellSet
        One per component without a recurrent cell in the finer graph.  Those that remain are not thereby proved.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Logistic(1.4), ls.grid([(0, 1)], depth=10), method="corners-padded")
    >>> recurrent = ls.morse_graph(graph).number_of_nodes()
    >>> from limitsets.sets import spurious
    >>> 0 < len(spurious(graph)) < recurrent
    True
    """
    while parts > 2 and graph.n_cells * parts**graph.grid.dimension > MOST_CELLS:
        parts //= 2
    fine = transitions(graph.map, graph.grid.refine(parts), graph.method, **options)
    recurrent = fine.recurrent_set()
    components = [CellSet.of(graph.grid, np.asarray(cells)) for cells in graph.recurrent_components()]
    return tuple(cells for cells in components if not (cells.refined(fine.grid) & recurrent).mask.any())
