"""The transition graph: cells and, last, exits as nodes; an edge where an image meets a cell; its Morse graph.

For networkx it is a directed graph with its own backend (`backend.py`); it carries its map and its grid.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import compress
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Table, Tabled, arguments_checked, facts
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.graph.components import Components, Condensation, strong_components
from limitsets.systems.graph.ranges import Ranges, cells_of, count_edges, expand
from limitsets.systems.maps import kind_of

if TYPE_CHECKING:
    import networkx as nx


@dataclass(frozen=True, eq=False)
class TransitionGraph(Tabled):
    """Transitions between the cells of a grid under a map.

    Nodes are the cells ``0 .. n_cells - 1`` and then one sink per way out, in the order of `exits`, each with an edge
    to itself; no other node is without successors.  Build it with `limitsets.transitions`.

    Attributes
    ----------
    map : NamedTuple
        The map.
    grid : Grid
        The cells.
    ranges : Ranges
        Images of the cells.
    method : str
        How the images were found; proved for "boxes", sampled otherwise.
    second_pass : float
        Share of the sampled states that the map's fast kernel could not vouch for.
    upper : NamedTuple or None
        The upper corner, where the images are those of a box of parameters with the lower corner `map`.
    graph : dict
        Attributes of the graph, for networkx.
    """

    map: Any
    grid: Grid
    ranges: Ranges
    method: str
    second_pass: float = 0.0
    upper: Any = None
    graph: dict[str, Any] = field(default_factory=dict)

    __networkx_backend__ = "limitsets"

    @property
    def how(self) -> str:
        """How what follows from the cells alone is found: "proved" by boxes, else "cells", of sampled images."""
        return "proved" if self.method == "boxes" else "cells"

    @property
    def exits(self) -> dict[str, int]:
        """Names and codes of the ways out, in the order of the sinks."""
        return kind_of(self.map).exits

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.grid.n_cells

    def __len__(self) -> int:
        return self.n_cells + len(self.exits)

    def __iter__(self) -> Iterator[int]:
        return iter(range(len(self)))

    def __contains__(self, node: object) -> bool:
        return isinstance(node, int | np.integer) and 0 <= int(node) < len(self)

    def __repr__(self) -> str:
        return f"TransitionGraph({type(self.map).__name__}, {self.n_cells} cells, {self.method})"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        how = "proved" if self.method == "boxes" else "sampled, not proved"
        values = {
            "cells": self.n_cells,
            "transitions": self.number_of_cell_edges(),
            "method": self.method,
            "exits": ", ".join(self.exits),
        }
        return (facts(f"Transitions of {type(self.map).__name__}", values, how),)

    def is_directed(self) -> bool:
        """Tell networkx that edges have a direction."""
        return True

    def is_multigraph(self) -> bool:
        """Tell networkx that no edge comes twice."""
        return False

    def number_of_nodes(self) -> int:
        """Cells and ways out."""
        return len(self)

    def number_of_cell_edges(self) -> int:
        """Count the edges from cell to cell."""
        return count_edges(self.ranges)

    def number_of_edges(self) -> int:
        """Count all edges: from cell to cell, from cells to sinks, and the loops of the sinks."""
        bits = np.unpackbits(self.ranges.exits[:, None], axis=1).sum()
        return self.number_of_cell_edges() + int(bits) + len(self.exits)

    def successors(self, node: int) -> NDArray[np.int64]:
        """Nodes that a node's image meets, ascending.

        Raises
        ------
        AnswerError
            For a number that is no node.
        """
        if node not in self:
            raise AnswerError(
                "the node", node, f"an integer from 0 to {len(self) - 1}", "pass the number of a cell"
            )
        if node >= self.n_cells:
            return np.array([node])
        r = self.ranges
        sinks = [self.n_cells + e for e in range(len(self.exits)) if r.exits[node] >> e & 1]
        cells = cells_of(r, slice(r.first[node], r.first[node + 1]))
        return np.concatenate([cells, np.array(sinks, dtype=np.int64)])

    @cached_property
    def _components(self) -> Components:
        return strong_components(self.ranges)

    def components(self) -> Components:
        """Strongly connected components of the cells, as labels."""
        return self._components

    @cached_property
    def _recurrent_components(self) -> list[NDArray[np.int32]]:
        parts = self.components()
        ends = np.concatenate([[0], np.cumsum(parts.size)])
        chosen = np.flatnonzero(parts.recurrent)
        components = [
            parts.order[a:b] for a, b in zip(ends[chosen].tolist(), ends[chosen + 1].tolist(), strict=True)
        ]
        return [np.sort(cells) if cells.size > 1 else cells for cells in components]

    def recurrent_components(self) -> list[NDArray[np.int32]]:
        """Cells of each recurrent component, ascending in topological number: attracting ones come early."""
        return list(self._recurrent_components)

    def attracting_sets(self) -> list[NDArray[np.int32]]:
        """Cells of the recurrent components from which no path leads elsewhere."""
        return list(compress(self._recurrent_components, self._condensation.attracting))

    @cached_property
    def _condensation(self) -> Condensation:
        return Condensation(self.ranges, self.components(), self.exits, self.recurrent_components())

    def condensation(self) -> Condensation:
        """Order of the recurrent components, and where each cell leads."""
        return self._condensation

    def recurrent_set(self) -> CellSet:
        """All cells in which an orbit of cells can stay."""
        parts = self.components()
        return CellSet(self.grid, parts.recurrent[parts.label])

    def edge_arrays(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """All edges, written out: from where, to where."""
        pointer, targets = expand(self.ranges)
        sources = [np.repeat(np.arange(self.n_cells), np.diff(pointer))]
        ends = [targets]
        for e in range(len(self.exits)):
            leaving = np.flatnonzero(self.ranges.exits >> e & 1)
            sources += [leaving, np.array([self.n_cells + e])]
            ends.append(np.full(leaving.size + 1, self.n_cells + e))
        return np.concatenate(sources), np.concatenate(ends)

    def to_networkx(self) -> nx.DiGraph[int]:
        """Write the graph out as a `networkx.DiGraph`, edge by edge."""
        import networkx as nx

        plain: nx.DiGraph[int] = nx.DiGraph(**self.graph)
        plain.add_nodes_from(range(len(self)))
        source, target = self.edge_arrays()
        plain.add_edges_from(zip(source.tolist(), target.tolist(), strict=True))
        return plain


# ----------------------------------------------------------------
# The Morse graph: recurrent components and the order among them.


@arguments_checked
def morse_graph(graph: TransitionGraph) -> nx.DiGraph[int]:
    """Recurrent components as nodes, an edge where one leads to another with none in between.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.

    Returns
    -------
    networkx.DiGraph
        Nodes ``0 .. k - 1``.  Attributes of a node: ``cells`` (how many), ``members`` (the CellSet), ``attracting``
        (it leads nowhere else), ``extents``, ``exits`` (names of the ways out it can reach).  The edges are the
        transitive reduction of the order.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> ls.morse_graph(ls.transitions(scene.map, ls.grid(scene.domain, cells=4096))).number_of_nodes()
    1
    """
    import networkx as nx

    sets = graph.recurrent_components()
    condensation = graph.condensation()
    proper = condensation.order & ~np.eye(len(sets), dtype=bool)
    between = (proper.astype(np.float32) @ proper.astype(np.float32)) > 0
    morse: nx.DiGraph[int] = nx.DiGraph()
    names = list(graph.exits)
    for k, cells in enumerate(sets):
        members = CellSet.of(graph.grid, cells)
        morse.add_node(
            k,
            cells=len(cells),
            members=members,
            attracting=bool(condensation.attracting[k]),
            extents=members.extents(),
            exits=[name for name, out in zip(names, condensation.exits[k], strict=True) if out],
        )
    morse.add_edges_from((int(i), int(j)) for i, j in np.argwhere(proper & ~between))
    return morse
