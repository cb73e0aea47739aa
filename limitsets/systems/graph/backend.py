"""The transition graph as a networkx backend: networkx's own functions run on it at compiled speed.

networkx finds this module by the entry point ``networkx.backends`` of the installed package and loads it when a
graph says ``__networkx_backend__ = "limitsets"``; importing networkx alone does not.  Functions that are not here
work on ``graph.to_networkx()``, or on their own after ``networkx.config.fallback_to_nx = True``.

Nodes are cells and, last, the exits.  The exits are sinks, and networkx counts them as attracting components.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.systems.graph.components import attracting_of, descend, reach
from limitsets.systems.graph.graph import TransitionGraph

if TYPE_CHECKING:
    import networkx as nx


def _sinks(graph: TransitionGraph) -> Iterator[set[int]]:
    return ({graph.n_cells + e} for e in range(len(graph.exits)))


def _attracting(graph: TransitionGraph) -> list[NDArray[np.int32]]:
    """Cells of each attracting component; where cells lead, which networkx does not ask for, is not looked at."""
    sets = graph.recurrent_components()
    return list(itertools.compress(sets, attracting_of(graph.ranges, graph.components(), sets)))


def _check(graph: TransitionGraph, node: Any) -> int:
    if node not in graph:
        import networkx as nx

        raise nx.NetworkXError(f"The node {node} is not in the digraph.")
    return int(node)


class Backend:
    """What networkx dispatches to; each method has the signature of the networkx function of its name."""

    @staticmethod
    def strongly_connected_components(graph: TransitionGraph) -> Iterator[set[int]]:
        """Yield the node sets of the components, each before those that lead to it."""
        yield from _sinks(graph)
        parts = graph.components()
        ends = np.concatenate([[0], np.cumsum(parts.size)])
        nodes = parts.order.tolist()
        for begin, end in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
            yield set(nodes[begin:end])

    @staticmethod
    def number_strongly_connected_components(graph: TransitionGraph) -> int:
        """Count the components."""
        return graph.components().count + len(graph.exits)

    @staticmethod
    def is_strongly_connected(graph: TransitionGraph) -> bool:
        """Whether every node can reach every other: not with a sink beside the cells."""
        return graph.components().count + len(graph.exits) == 1

    @staticmethod
    def attracting_components(graph: TransitionGraph) -> Iterator[set[int]]:
        """Yield the components that nothing leaves, the sinks first."""
        yield from _sinks(graph)
        yield from (set(cells.tolist()) for cells in _attracting(graph))

    @staticmethod
    def number_attracting_components(graph: TransitionGraph) -> int:
        """Count them."""
        return len(_attracting(graph)) + len(graph.exits)

    @staticmethod
    def is_attracting_component(graph: TransitionGraph) -> bool:
        """Whether the whole graph is one attracting component."""
        return Backend.is_strongly_connected(graph)

    @staticmethod
    def condensation(graph: TransitionGraph, scc: Iterable[set[int]] | None = None) -> nx.DiGraph[int]:
        """Components as nodes, with the attribute `members`; the graph attribute `mapping` as networkx has it."""
        import networkx as nx

        components = list(Backend.strongly_connected_components(graph) if scc is None else scc)
        label = np.full(len(graph), -1)
        for number, members in enumerate(components):
            label[list(members)] = number
        dense: nx.DiGraph[int] = nx.DiGraph()
        dense.add_nodes_from((number, {"members": members}) for number, members in enumerate(components))
        dense.graph["mapping"] = dict(enumerate(label.tolist()))
        source, target = graph.edge_arrays()
        pairs = np.unique(np.stack([label[source], label[target]], axis=1), axis=0)
        dense.add_edges_from((int(a), int(b)) for a, b in pairs if a != b)
        return dense

    @staticmethod
    def descendants(graph: TransitionGraph, source: int) -> set[int]:
        """Nodes that can be reached from `source`, without itself."""
        start = _check(graph, source)
        if start >= graph.n_cells:
            return set()
        seen = descend(graph.ranges, np.array([start]))
        met = int(np.bitwise_or.reduce(graph.ranges.exits[seen], initial=graph.ranges.exits[start]))
        sinks = {graph.n_cells + e for e in range(len(graph.exits)) if met >> e & 1}
        return (set(np.flatnonzero(seen).tolist()) | sinks) - {start}

    @staticmethod
    def ancestors(graph: TransitionGraph, source: int) -> set[int]:
        """Nodes from which `source` can be reached, without itself."""
        end = _check(graph, source)
        marks = np.zeros(graph.n_cells, dtype=np.uint8)
        if end >= graph.n_cells:
            marks[:] = graph.ranges.exits >> (end - graph.n_cells) & 1
        else:
            marks[end] = 1
        reached = reach(graph.ranges, graph.components(), marks)
        return set(np.flatnonzero(reached).tolist()) - {end}

    @staticmethod
    def convert_from_nx(graph: Any, *_: Any, **__: Any) -> Any:
        """Refuse: a plain graph has no map and no grid."""
        if isinstance(graph, TransitionGraph):
            return graph
        raise AnswerError(
            "the graph", type(graph).__name__, "a transition graph", "build one with limitsets.transitions"
        )

    @staticmethod
    def convert_to_nx(result: Any, **_: Any) -> Any:
        """Write a transition graph out; everything else is plain already."""
        return result.to_networkx() if isinstance(result, TransitionGraph) else result


backend = Backend()
