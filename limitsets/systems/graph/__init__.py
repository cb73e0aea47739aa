"""The transition graph and its algorithms: components, their order, reachability, all on ranges of cells."""

from limitsets.systems.graph.building import transitions
from limitsets.systems.graph.components import Components, Condensation
from limitsets.systems.graph.graph import TransitionGraph, morse_graph

__all__ = ["Components", "Condensation", "TransitionGraph", "morse_graph", "transitions"]
