"""Finite covers of the state space: grids of cells per side, and the algebra of sets of cells.

Cells are closed, so neighbours share their border, and are numbered side by side, row-major within a side (the
last axis runs fastest): the numbers are the nodes of the transition graph.
"""

from limitsets.systems.cells.domain import Domain, as_domain
from limitsets.systems.cells.grids import CellSet, Grid, cell_ends, grid

__all__ = ["CellSet", "Domain", "Grid", "as_domain", "cell_ends", "grid"]
