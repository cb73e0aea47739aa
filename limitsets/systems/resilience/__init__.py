"""What the field measures of basins, on cells, for any map: how large, how uncertain, how mixed, how far to the edge.

Every function takes a transition graph and its attractors.  Exits are basins of their own; so is the joint, to which
the exit `inward` leads.  With proved images (method "boxes") the inner basin of an attractor is the least set of cells
all of whose successors lie in it or in the attracting cells, its outer basin the cells from which these can be reached:
what is measured then lies in a proved bracket.  Undecided cells are excluded from what is estimated, and their share is
told.  `docs/resilience.md` has the definitions and their sources.
"""

from __future__ import annotations

from limitsets.systems.resilience.mixing import BasinEntropy, basin_entropy, boundary_basin_entropy
from limitsets.systems.resilience.stability import (
    BasinStability,
    ConvergenceTimes,
    FatalShock,
    Share,
    Times,
    basin_stability,
    convergence_times,
    minimal_fatal_shock,
)
from limitsets.systems.resilience.uncertainty import UncertaintyExponent, Wada, uncertainty_exponent, wada

__all__ = [
    "BasinEntropy",
    "BasinStability",
    "ConvergenceTimes",
    "FatalShock",
    "Share",
    "Times",
    "UncertaintyExponent",
    "Wada",
    "basin_entropy",
    "basin_stability",
    "boundary_basin_entropy",
    "convergence_times",
    "minimal_fatal_shock",
    "uncertainty_exponent",
    "wada",
]
