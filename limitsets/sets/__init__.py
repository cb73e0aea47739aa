"""Answers about a map: attractors, basins, cycles, the limit set by its end points."""

from limitsets.sets.attractors import Attractor, attractors
from limitsets.sets.basins import Basins, basins
from limitsets.sets.cycles import Cycle, cycles
from limitsets.sets.limit_set import End, LimitSet, limit_set
from limitsets.sets.spurious import spurious

__all__ = [
    "Attractor",
    "Basins",
    "Cycle",
    "End",
    "LimitSet",
    "attractors",
    "basins",
    "cycles",
    "limit_set",
    "spurious",
]
