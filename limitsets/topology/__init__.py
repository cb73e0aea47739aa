"""The topology of attractors at one parameter point after another: how many, of how many bands, in which order."""

from limitsets.topology.following import reaches
from limitsets.topology.points import region_of, topologies
from limitsets.topology.records import DOUBTS, Topologies

__all__ = ["DOUBTS", "Topologies", "reaches", "region_of", "topologies"]
