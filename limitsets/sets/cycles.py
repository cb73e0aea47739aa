"""Periodic orbits, stable or not, inside an answer: by itinerary on a line, by Newton's method in the plane."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.cells import CellSet
from limitsets.errors import AnswerError, shown
from limitsets.graph.graph import TransitionGraph
from limitsets.sets.cycle import Array, Cycle, Cycles, Ints
from limitsets.sets.line_cycles import cycles_of
from limitsets.sets.plane_cycles import cycles_from

MOST_STARTS = 20_000


def _cells(graph: TransitionGraph, within: Any) -> CellSet | None:
    """Cells of a set or of an answer, by default all recurrent ones; None where it has none."""
    if within is None:
        return graph.recurrent_set()
    cells = within if isinstance(within, CellSet) else getattr(within, "cells", None)
    return cells if isinstance(cells, CellSet) else None


def _middles(cells: CellSet) -> tuple[Array, Ints]:
    """Middles of the cells, of every second, third, ... one where there are very many, and their sides."""
    numbers = cells.numbers()
    numbers = numbers[:: max(1, -(-numbers.size // MOST_STARTS))]
    sides = cells.grid.side_of(numbers)
    middles = np.empty((numbers.size, cells.grid.dimension))
    for side in np.unique(sides).tolist():
        lo, hi = cells.grid.boxes(numbers[sides == side], side)
        middles[sides == side] = 0.5 * (lo + hi)
    return middles, sides


def _inside(cycle: Cycle, cells: CellSet) -> bool:
    """Whether every point of an orbit lies in the cells."""
    numbers = [
        int(cells.grid.index(x[None, :], int(side))[0]) for x, side in zip(cycle.x, cycle.side, strict=True)
    ]
    return all(number >= 0 and cells.mask[number] for number in numbers)


@arguments_checked
def cycles(graph: TransitionGraph, up_to: int, within: Any = None) -> Cycles:
    """Find periodic orbits, attracting or not.

    Parameters
    ----------
    graph : TransitionGraph
        Transitions of a map with `image_on`, in one or two dimensions.
    up_to : int
        Largest period.
    within : Attractor, LimitSet or CellSet, optional
        Where to look; default all recurrent cells.  In two dimensions a set of cells, or an answer with `cells`.

    Returns
    -------
    Cycles
        A tuple of `Cycle`; its `complete` says whether every itinerary was followed (one dimension only).

    Raises
    ------
    AnswerError
        For a map of three dimensions or without `image_on`, a period below 1, or a set of another kind.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Logistic(3.83), ls.grid([(0.0, 1.0)], cells=4096))
    >>> [cycle.period for cycle in ls.cycles(graph, 3) if abs(cycle.multiplier) < 1]
    [3]
    """
    cells = _cells(graph, within)
    if graph.grid.dimension == 1:
        extents = cells.extents() if cells is not None else getattr(within, "extents", None)
        if not isinstance(extents, Mapping):
            raise AnswerError(
                "the set to look in", shown(within), "an attractor, limit set or cells", "pass one of these"
            )
        return cycles_of(graph.map, extents, graph.grid.domain, up_to)
    if cells is None:
        raise AnswerError(
            "the set to look in", shown(within), "cells, or an answer with cells", "pass an attractor"
        )
    found = cycles_from(graph.map, *_middles(cells), up_to)
    if within is None:
        return found
    return Cycles((cycle for cycle in found if _inside(cycle, cells)), complete=False, how=found.how)
