"""The topology of attractors at many parameters, on cells of its own: how many, of how many bands, in which order."""

from limitsets.systems.sets.topology.points import reaches, region_of, topologies
from limitsets.systems.sets.topology.work import DOUBTS, Topologies

__all__ = ["DOUBTS", "Topologies", "reaches", "region_of", "topologies"]
