"""The Morse graph: recurrent components and the order among them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.graph.graph import TransitionGraph

if TYPE_CHECKING:
    import networkx as nx

__all__ = ["morse_graph", "reachable_components"]


def reachable_components(graph: TransitionGraph) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which recurrent components, and which exits, each recurrent component can reach.

    Returns
    -------
    order : ndarray of bool, shape (k, k)
        ``order[i, j]``: from component i orbits of cells lead to component j (each to itself).
    exits : ndarray of bool, shape (k, n_exits)
        The same for the ways out.
    """
    sets = graph.recurrent_components()
    order = np.zeros((len(sets), len(sets)), dtype=bool)
    exits = np.zeros((len(sets), len(graph.exits)), dtype=bool)
    one_of_each = np.array([cells[0] for cells in sets], dtype=np.int64)
    for chunk, bits in graph.reaches([np.asarray(cells, dtype=np.int64) for cells in sets]):
        seen = bits[one_of_each].astype(np.uint64)
        size = chunk.stop - chunk.start
        for b in range(size):
            order[:, chunk.start + b] = seen >> np.uint64(b) & np.uint64(1)
        for e in range(len(graph.exits)):
            exits[:, e] = seen >> np.uint64(size + e) & np.uint64(1)
    return order, exits


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
    order, exits = reachable_components(graph)
    proper = order & ~np.eye(len(sets), dtype=bool)
    between = (proper.astype(np.float32) @ proper.astype(np.float32)) > 0
    morse: nx.DiGraph[int] = nx.DiGraph()
    names = list(graph.exits)
    for k, cells in enumerate(sets):
        members = CellSet.of(graph.grid, cells)
        morse.add_node(
            k,
            cells=len(cells),
            members=members,
            attracting=not proper[k].any() and not exits[k].any(),
            extents=members.extents(),
            exits=[name for name, out in zip(names, exits[k], strict=True) if out],
        )
    morse.add_edges_from((int(i), int(j)) for i, j in np.argwhere(proper & ~between))
    return morse
