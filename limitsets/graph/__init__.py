"""The transition graph and what is read off it: components, their order, reachability; all on ranges of cells."""

from limitsets.graph.graph import Components, TransitionGraph
from limitsets.graph.morse import morse_graph, reachable_components
from limitsets.graph.transitions import transitions

__all__ = ["Components", "TransitionGraph", "morse_graph", "reachable_components", "transitions"]
