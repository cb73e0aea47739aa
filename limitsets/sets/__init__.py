"""Answers about a map: attractors, basins, cycles, the limit set by its end points, the invariant measure."""

from limitsets.sets.attractors import Attractor, attractors
from limitsets.sets.basins import Basins, basins
from limitsets.sets.cycle import Cycle, Cycles
from limitsets.sets.cycles import cycles
from limitsets.sets.limit_set import End, LimitSet, Origin, limit_set, limit_set_of
from limitsets.sets.line_cycles import cycles_of
from limitsets.sets.measure import Measure, invariant_measures
from limitsets.sets.plane_cycles import cycles_from
from limitsets.sets.spurious import spurious

__all__ = [
    "Attractor",
    "Basins",
    "Cycle",
    "Cycles",
    "End",
    "LimitSet",
    "Measure",
    "Origin",
    "attractors",
    "basins",
    "cycles",
    "cycles_from",
    "cycles_of",
    "invariant_measures",
    "limit_set",
    "limit_set_of",
    "spurious",
]
