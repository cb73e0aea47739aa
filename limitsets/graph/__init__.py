"""The transition graph and what is read off it: components, their order, reachability; all on ranges of cells."""

from limitsets.graph.components import Components
from limitsets.graph.graph import TransitionGraph
from limitsets.graph.morse import morse_graph
from limitsets.graph.survey import Survey
from limitsets.graph.transitions import transitions

__all__ = ["Components", "Survey", "TransitionGraph", "morse_graph", "transitions"]
