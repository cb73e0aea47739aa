"""Build the transition graph of a map on a grid."""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.graph.agreement import require_agreement
from limitsets.graph.boxes import no_boxes
from limitsets.graph.graph import TransitionGraph
from limitsets.graph.images import METHODS
from limitsets.graph.memory import require_memory
from limitsets.graph.ranges import build
from limitsets.graph.target import Target
from limitsets.maps import kind_of
from limitsets.maps.contract import require_dimension, require_sides


@arguments_checked
def transitions(map: Any, grid: Grid, method: str | None = None, **options: Any) -> TransitionGraph:  # noqa: A002  # `map` is the word of the field and of the other calls
    """Who can go where in one step.

    Parameters
    ----------
    map : NamedTuple
        A map (`scene.map`, `limitsets.maps`, or your own after `limitsets.register`).
    grid : Grid
        Cells to go between.
    method : {"end-points", "corners", "corners-padded", "boxes"}, optional
        How the image of a cell is found.  Default: the end points in one dimension, padded corners in more.  "boxes"
        proves that no image of any point is missed, for a map with `image_box`; the others sample.
    **options
        For "boxes": upper, the upper corner of a box of parameters.

    Returns
    -------
    TransitionGraph
        A directed graph that networkx runs on.

    Raises
    ------
    AnswerError
        For a method that is none, or does not fit the map, an image on a side that the grid has not, or more cells
        than memory has room for.
    MapError
        For a grid of more sides than the map's, or a map of your own whose kernels contradict each other.

    Examples
    --------
    >>> import limitsets as ls
    >>> import networkx as nx
    >>> scene = ls.load("paper-designed")
    >>> graph = ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))
    >>> nx.number_attracting_components(graph)  # the limit set, and the four sinks
    5
    """
    kind = kind_of(map)
    require_dimension(map, "grid", grid.dimension)
    require_sides(map, 0, grid.sides - 1)
    chosen = method or ("end-points" if grid.dimension == 1 else "corners-padded")
    if chosen not in METHODS:
        raise AnswerError("the image method", chosen, ", ".join(METHODS), "correct the word")
    require_memory(grid, chosen)
    require_agreement(map, grid.domain, chosen == "boxes", options.get("upper"))
    target = Target.of(grid, kind.exits)
    inhabited = grid.domain.inhabited.tolist()
    parts = [
        METHODS[chosen](map, grid, side, target, **options) if some else no_boxes(grid.dimension)
        for side, some in enumerate(inhabited)
    ]
    if len(parts) == 1:
        cell, side, lo, hi, exits = (
            getattr(parts[0], name) for name in ("cell", "side", "lo", "hi", "exits")
        )
    else:
        cell = np.concatenate([part.cell + grid.offset[k] for k, part in enumerate(parts)])
        side, lo, hi, exits = (
            np.concatenate([getattr(part, name) for part in parts]) for name in ("side", "lo", "hi", "exits")
        )
    if cell.size == grid.n_cells and int(cell[-1]) == grid.n_cells - 1 and (np.diff(cell) == 1).all():
        first = np.arange(grid.n_cells + 1)
    else:
        first = np.concatenate([[0], np.cumsum(np.bincount(cell, minlength=grid.n_cells))])
    weights = grid.shape.prod(axis=1)
    share = float((np.array([part.second_pass for part in parts]) * weights).sum() / weights.sum())
    ranges = build(grid, first, side, lo, hi, exits)
    return TransitionGraph(map, grid, ranges, chosen, share, options.get("upper"))
