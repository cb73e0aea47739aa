"""The transition graph and its algorithms: components, their order, reachability, all on ranges of cells."""

from limitsets.graph.components import Components
from limitsets.graph.condensation import Condensation
from limitsets.graph.graph import TransitionGraph
from limitsets.graph.morse import morse_graph
from limitsets.graph.transitions import transitions

__all__ = ["Components", "Condensation", "TransitionGraph", "morse_graph", "transitions"]
