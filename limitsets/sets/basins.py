"""Basins: where each cell's paths end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.graph import TransitionGraph
from limitsets.maps import codes
from limitsets.sets.attractors import Attractor

__all__ = ["Basins", "basins"]


@dataclass(frozen=True, eq=False)
class Basins:
    """Where the paths from each cell end.

    Attributes
    ----------
    grid : Grid
        The cells.
    labels : ndarray of int32, shape (n_cells,)
        0 and up: attractor of that number, on every path.  -1, -2, -3: the exit of that code, on every path.
        -4: paths end in different places, so the cell is undecided.
    attractors : tuple of float
        Share of each attractor's basin, weighted by length (area, volume) over all sides.
    undecided_between : float
        Share of undecided cells.
    exits : dict of str to float
        Share of the cells all of whose paths leave by that exit.
    """

    grid: Grid
    labels: NDArray[np.int32]
    attractors: tuple[float, ...]
    undecided_between: float
    exits: dict[str, float]


def basins(graph: TransitionGraph, found: tuple[Attractor, ...]) -> Basins:
    """Label every cell with what all its paths end in.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.

    Returns
    -------
    Basins
        Labels and shares; undecided cells and each exit are states of their own.

    Raises
    ------
    AnswerError
        For attractors of another graph.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.TwoState(1.0), ls.grid([(-2, 2), (-2, 2)], cells=32), method="centres")
    >>> ls.basins(graph, ls.attractors(graph)).attractors
    (0.5, 0.5)
    """
    known = graph.survey()
    if any(a.cells.grid is not graph.grid for a in found) or len(found) != int(known.attracting.sum()):
        raise AnswerError(
            "the attractors",
            f"{len(found)} of another graph",
            "those of this graph",
            "call attractors(graph)",
        )
    weight = graph.grid.measure
    total = float(weight.sum())
    labels = known.destination
    share = (
        np.bincount(labels - codes.UNDECIDED, weights=weight, minlength=len(found) - codes.UNDECIDED) / total
    )
    by_code = {code: float(share[code - codes.UNDECIDED]) for code in range(codes.UNDECIDED, len(found))}
    return Basins(
        graph.grid,
        labels,
        tuple(by_code[k] for k in range(len(found))),
        by_code[codes.UNDECIDED],
        {name: by_code[code] for name, code in graph.exits.items()},
    )
