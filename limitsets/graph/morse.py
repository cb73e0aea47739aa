"""The Morse graph: recurrent components and the order among them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.cells import CellSet
from limitsets.graph.graph import TransitionGraph

if TYPE_CHECKING:
    import networkx as nx


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
    found = graph.condensation()
    proper = found.order & ~np.eye(len(sets), dtype=bool)
    between = (proper.astype(np.float32) @ proper.astype(np.float32)) > 0
    morse: nx.DiGraph[int] = nx.DiGraph()
    names = list(graph.exits)
    for k, cells in enumerate(sets):
        members = CellSet.of(graph.grid, cells)
        morse.add_node(
            k,
            cells=len(cells),
            members=members,
            attracting=bool(found.attracting[k]),
            extents=members.extents(),
            exits=[name for name, out in zip(names, found.exits[k], strict=True) if out],
        )
    morse.add_edges_from((int(i), int(j)) for i, j in np.argwhere(proper & ~between))
    return morse
