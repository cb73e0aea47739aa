"""Answers about a map: attractors, basins, cycles, the limit set by its end points, the invariant measure."""

from limitsets.systems.sets.attracting import Attractor, attractors, spurious
from limitsets.systems.sets.basin import Basins, basins
from limitsets.systems.sets.closing import Cycle, Cycles
from limitsets.systems.sets.end_points import End, LimitSet, Origin, limit_set, limit_set_of
from limitsets.systems.sets.measure import Measure, invariant_measures
from limitsets.systems.sets.periodic import cycles, cycles_from, cycles_of

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
