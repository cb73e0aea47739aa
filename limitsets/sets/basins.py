"""Basins: the ends of the paths from each cell."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.arguments import arguments_checked
from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.graph import TransitionGraph
from limitsets.graph.components import reach
from limitsets.graph.ranges import RUN, SIDE
from limitsets.maps import codes
from limitsets.sets.attractors import Attractor
from limitsets.sets.passing import passing
from limitsets.tables import Column, Table, Tabled, how_found

# A recurrent set of more cells is hardly one unstable cycle.
MOST_OF_A_CYCLE = 64


@dataclass(frozen=True, eq=False)
class Basins(Tabled):
    """Where the paths from each cell end.

    Attributes
    ----------
    grid : Grid
        The cells.
    labels : ndarray of int32, shape (n_cells,)
        0 and up: attractor of that number, on every path.  -1, -2, -3, -5: the exit of that code, on every path.
        -4: paths end in different places, or may stay in a recurrent set that is not closed: the cell is undecided.
    attractors : tuple of float
        Share of each attractor's basin, weighted by length (area, volume) over all sides.
    undecided_between : float
        Share of undecided cells.
    exits : dict of str to float
        Share of the cells all of whose paths leave by that exit.
    advice : str or None
        What to do about recurrent sets that are not closed, where there are any.
    how : str
        "proved" where the transitions are (method "boxes"), "cells" where the images of cells are sampled.
    """

    grid: Grid
    labels: NDArray[np.int32]
    attractors: tuple[float, ...]
    undecided_between: float
    exits: dict[str, float]
    advice: str | None = None
    how: str = "cells"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            *((f"attractor {k}", share) for k, share in enumerate(self.attractors)),
            *((f"leave: {name}", share) for name, share in self.exits.items()),
            ("undecided", self.undecided_between),
        ]
        return (Table(("where paths end", Column("share", show=".6f")), rows, "Basins", how_found(self.how)),)


@arguments_checked
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
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=100), method="corners")
    >>> ls.basins(graph, ls.attractors(graph)).attractors
    (0.49, 0.49)
    """
    attracting = graph.condensation().attracting
    if any(a.cells.grid is not graph.grid for a in found) or len(found) != int(attracting.sum()):
        raise AnswerError(
            "the attractors",
            f"{len(found)} of another graph",
            "those of this graph",
            "call attractors(graph)",
        )
    weight = graph.grid.measure
    total = float(weight.sum())
    sets, through = graph.recurrent_components(), passing(graph)
    labels = graph.condensation().destinations(through)
    lowest = min(codes.UNDECIDED, *graph.exits.values())
    share = np.bincount(labels - lowest, weights=weight, minlength=len(found) - lowest) / total
    by_code = {code: float(share[code - lowest]) for code in range(lowest, len(found))}
    return Basins(
        graph.grid,
        labels,
        tuple(by_code[k] for k in range(len(found))),
        by_code[codes.UNDECIDED],
        {name: by_code[code] for name, code in graph.exits.items()},
        _advice(graph, list(itertools.compress(sets, ~(attracting | through)))),
        graph.how,
    )


def _advice(graph: TransitionGraph, lasting: list[NDArray[np.int32]]) -> str | None:
    """Say from how many starts a recurrent set that is not closed can be reached, and what to do."""
    if not lasting:
        return None
    share = _share_reaching(graph, np.concatenate(lasting))
    reached = f"from {100 * share:.3g} % of the starts a recurrent set that is not closed can be reached"
    spread = _share_reaching(graph, _spread_over_a_side(graph))
    if spread:
        return (
            f"{reached}, from {100 * spread:.3g} % a cell whose enclosed image is a whole side: the map jumps there "
            "within a branch (a floor), and finer cells decide few more starts; give it one branch before the jump and "
            "one after it (docs/own_map.md), or sample the images: limitsets.transitions(map, grid)"
        )
    coarse = "an attractor in cells that are too coarse for it: they are undecided; ask for finer cells"
    if max(map(len, lasting)) <= MOST_OF_A_CYCLE:
        return f"{reached}, an unstable cycle or {coarse}"
    return (
        f"{reached}, a chaotic repeller or {coarse}; near a repeller they decide few more starts, sample the shares: "
        "limitsets.resilience.basin_stability(graph, found, starts=10000)"
    )


def _share_reaching(graph: TransitionGraph, cells: NDArray[np.integer]) -> float:
    """Share of the starts from which some of the cells can be reached."""
    marks = np.zeros(graph.n_cells, dtype=np.uint8)
    marks[cells] = 1
    weight = graph.grid.measure
    return float(weight[reach(graph.ranges, graph.components(), marks) > 0].sum() / weight.sum())


def _spread_over_a_side(graph: TransitionGraph) -> NDArray[np.integer]:
    """Cells on a line of which one enclosed image is a whole side."""
    if graph.method != "boxes" or graph.grid.dimension > 1:
        return np.zeros(0, dtype=np.int64)
    box, shape = graph.ranges.box, graph.grid.shape
    whole = box[:, RUN] == shape[box[:, SIDE], 0]
    return np.searchsorted(graph.ranges.first, np.flatnonzero(whole), side="right") - 1
