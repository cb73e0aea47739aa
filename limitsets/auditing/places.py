"""States at which assumptions are evaluated: cells that hold the limit set, orbits on it, and the whole domain."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.maps import codes, orbit

if TYPE_CHECKING:
    from limitsets.cells import CellSet
    from limitsets.proofs.parameters import ParameterBox
    from limitsets.scene import Scene

Array = NDArray[np.float64]
Cells: TypeAlias = dict[int, tuple[Array, Array]]

# Cells per side for the proof; sampled where the map has effects on.
CELLS, SAMPLED_CELLS = 2048, 4096
# Steps of an orbit before it is taken to be on the limit set, and those counted.
TRANSIENT, THROWS = 1000, 20_000
# Samples of a side of the domain.
SAMPLES = 4096


@dataclass(frozen=True, eq=False)
class Sample:
    """Throws to look at on one side.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Where they start, ascending on the domain [length].
    code : ndarray of int, shape (n,)
        What they do (`limitsets.maps.codes`); empty where nobody asks.
    """

    x: Array
    code: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Places:
    """What to look at.

    Attributes
    ----------
    limit_cells, domain_cells : dict of int to (ndarray, ndarray)
        Per side the lower and upper ends of cells.
    enclosed : bool
        Whether the cells are proved to hold the limit set.
    orbits, domain : dict of int to Sample
        Per side throws of long orbits on the limit set, and samples of the domain.
    extents : dict of int to list of (lo, hi)
        The cells of the limit set, put together.
    """

    limit_cells: Cells
    domain_cells: Cells
    enclosed: bool
    orbits: dict[int, Sample]
    domain: dict[int, Sample]
    extents: dict[int, list[tuple[float, float]]]


def _cells_of(found: CellSet) -> Cells:
    cells = {}
    for side, (edges,) in enumerate(found.grid.edges):
        here = np.flatnonzero(found.mask[found.grid.of_side(side)])
        if here.size:
            cells[side] = (edges[here], edges[here + 1])
    return cells


def _limit_sets(scene: Scene, box: ParameterBox) -> tuple[list[CellSet], Cells, bool]:
    """Attracting cells, one set per component; the cells of the domain; whether they are proved to hold the limit set.

    The enclosed images are those of the minimal map: with effects on, or where no cells are proved to attract, the
    cells come from sampled images.
    """
    from limitsets.cells import CellSet, grid
    from limitsets.graph import transitions
    from limitsets.proofs.attraction import attraction
    from limitsets.proofs.cover import cover
    from limitsets.sets import attractors

    covered = cover(box, CELLS)
    domain = {
        side: (edges[:-1], edges[1:]) for side, (edges,) in enumerate(covered.grid.edges) if edges.size > 1
    }
    if not scene.effects.on():
        found = attraction(covered)
        sets = [CellSet(covered.grid, found.component == k) for k in range(int(found.component.max()) + 1)]
        if sets:
            return sets, domain, True
    graph = transitions(scene.map, grid(scene.domain, cells=SAMPLED_CELLS))
    return [each.cells for each in attractors(graph, throws=1)], domain, False


def _throws(scene: Scene, cells: CellSet) -> tuple[Array, NDArray[np.int64], NDArray[np.int64]]:
    """Throws of an orbit from the middle of the middle cell, once it is on the limit set."""
    numbers = cells.numbers()
    middle = int(numbers[numbers.size // 2])
    side = int(cells.grid.side_of(middle))
    lo, hi = cells.grid.boxes(np.array([middle]), side)
    path = orbit(scene.map, 0.5 * float(lo[0, 0] + hi[0, 0]), side, TRANSIENT + THROWS)
    made = path.code.size
    on = slice(min(TRANSIENT, made), made)
    return path.x[on], path.side[on], path.code[on]


def _orbits(scene: Scene, sets: list[CellSet]) -> dict[int, Sample]:
    if not sets:
        return {}
    x, side, code = map(np.concatenate, zip(*(_throws(scene, cells) for cells in sets), strict=True))
    return {k: Sample(x[side == k], code[side == k]) for k in np.unique(side).tolist()}


def places(scene: Scene, box: ParameterBox) -> Places:
    """Find what to look at.

    Parameters
    ----------
    scene : Scene
        The scene.
    box : ParameterBox
        Its parameters.

    Returns
    -------
    Places
    """
    sets, domain_cells, enclosed = _limit_sets(scene, box)
    union = reduce(or_, sets) if sets else None
    limit = {} if union is None else _cells_of(union)
    lo, hi = scene.domain.lo[:, 0], scene.domain.hi[:, 0]
    domain = {
        side: Sample(np.linspace(lo[side], hi[side], SAMPLES), np.full(SAMPLES, codes.UNDECIDED))
        for side in np.flatnonzero(scene.sides.rests).tolist()
    }
    extents = {} if union is None else union.extents()
    return Places(limit, domain_cells, enclosed, _orbits(scene, sets), domain, extents)
