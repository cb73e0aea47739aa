"""The transition graph: images of cells, and on their ranges the components, their order, what reaches what."""

from limitsets.systems.graph.building import transitions
from limitsets.systems.graph.components import Components, Condensation
from limitsets.systems.graph.graph import TransitionGraph, morse_graph

__all__ = ["Components", "Condensation", "TransitionGraph", "morse_graph", "transitions"]
