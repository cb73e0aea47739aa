"""Inner and outer basins: in which basin each cell lies, and in which ones an undecided cell may lie.

The basins are those of the map on the domain of the grid: an orbit that leaves the domain is in the basin of the exit.
Where the images of cells are enclosed, both are proved, for `limitsets.basins` labels a cell only where all of its
paths end in the same place, and an orbit that comes to attracting cells gives a path there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet, Grid
from limitsets.graph import TransitionGraph
from limitsets.graph.components import reach
from limitsets.maps import codes
from limitsets.sets import Attractor, Basins, basins

# Bits of one sweep over the graph.
BITS = 64

# Where a larger share is undecided there is a bracket, and no best value within it.
MOST_UNDECIDED = 0.1

# Proved shares and entropies are rounded by this much, against the rounding of sums.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Colours:
    """Basins of a graph, in the order: attractors, exits.

    Attributes
    ----------
    graph : TransitionGraph
        The graph.
    basins : Basins
        Its labels.
    blocks : ndarray of int32, shape (n_cells,)
        Number of the attractor on attracting cells, undecided on all others.
    codes : ndarray of int, shape (m,)
        The label of each basin.
    undecided : ndarray of int, shape (u,)
        Numbers of the undecided cells.
    possible : ndarray of bool, shape (m + 1, u)
        Whether a path from the cell comes to that basin's attracting cells or exit; last, whether one may stay
        elsewhere, in a recurrent set that does not attract.
    """

    graph: TransitionGraph
    basins: Basins
    blocks: NDArray[np.int32]
    codes: NDArray[np.int64]
    undecided: NDArray[np.int64]
    possible: NDArray[np.bool_]

    @property
    def grid(self) -> Grid:
        """The cells."""
        return self.graph.grid

    @property
    def labels(self) -> NDArray[np.int32]:
        """Label of each cell: an attractor's number, an exit's code, or undecided."""
        return self.basins.labels

    @property
    def proved(self) -> bool:
        """Whether the images of the cells are enclosures."""
        return self.graph.method == "boxes"

    @property
    def how(self) -> str:
        """How inner and outer basins were obtained: "proved", or "cells" whose images are sampled."""
        return "proved" if self.proved else "cells"

    @property
    def names(self) -> tuple[int | str, ...]:
        """Number of each attractor, name of each exit."""
        return (*range(len(self.basins.attractors)), *self.graph.exits)

    def inner(self, number: int) -> CellSet:
        """Cells all of whose starts lie in a basin."""
        return CellSet(self.grid, self.labels == self.codes[number])

    def outer(self, number: int) -> CellSet:
        """Cells outside which no start lies in a basin."""
        mask = self.labels == self.codes[number]
        mask[self.undecided[self.possible[number]]] = True
        return CellSet(self.grid, mask)


def colours(graph: TransitionGraph, found: tuple[Attractor, ...]) -> Colours:
    """Find the basins of a graph; AnswerError for attractors of another one."""
    shares = basins(graph, found)
    undecided = np.flatnonzero(shares.labels == codes.UNDECIDED)
    blocks = np.full(graph.n_cells, codes.UNDECIDED, dtype=np.int32)
    for number, attractor in enumerate(found):
        blocks[attractor.cells.mask] = number
    staying = graph.recurrent_set().mask & (blocks == codes.UNDECIDED)
    leaving = [(graph.ranges.exits >> number & 1).astype(bool) for number in range(len(graph.exits))]
    ends = [*(attractor.cells.mask for attractor in found), *leaving, staying]
    possible = np.zeros((len(ends), undecided.size), dtype=bool)
    for begin in range(0, len(ends) if undecided.size else 0, BITS):
        marks = np.zeros(graph.n_cells, dtype=np.uint64)
        for bit, mask in enumerate(ends[begin : begin + BITS]):
            marks[mask] |= np.uint64(1 << bit)
        seen = reach(graph.ranges, graph.components(), marks)[undecided]
        for bit in range(min(BITS, len(ends) - begin)):
            possible[begin + bit] = seen >> np.uint64(bit) & np.uint64(1)
    labels = np.array([*range(len(found)), *graph.exits.values()], dtype=np.int64)
    return Colours(graph, shares, blocks, labels, undecided, possible)


def best(value: float, undecided: float) -> float:
    """Give a best value, nan where more than a tenth is undecided."""
    return value if undecided <= MOST_UNDECIDED else np.nan


def told(caption: str, undecided: float, cut: bool = False) -> str:
    """Write what is beside a number into the caption of its table: what is left out, and where orbits were cut off."""
    words = [caption]
    if undecided > MOST_UNDECIDED:
        words.append(f"{undecided:.1%} undecided, no best value".replace("%", " %"))
    if cut:
        words.append("orbits end at the border of the domain, starts=... follows them beyond")
    return "; ".join(words)
