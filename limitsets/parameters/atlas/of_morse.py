"""The task that an atlas asks of a map of several coordinates where no other is named: its Morse graph on cells."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from limitsets.parameters.atlas.plan import Block, Variable, block_task
from limitsets.proofs.prover.attraction import components_of
from limitsets.systems.cells import Domain, grid
from limitsets.systems.graph import transitions
from limitsets.systems.maps.pieces import point_of

_VARIABLES = {
    "attractors": Variable("int32", about="how many attracting components"),
    "recurrent": Variable("int32", about="how many recurrent components, the attracting ones with them"),
    "attracting_share": Variable(about="share of the cells that lie in attracting components"),
}


@block_task(lambda subject, **options: _VARIABLES)
def morse(block: Block, cells: int = 128, method: str | None = None) -> Mapping[str, npt.NDArray[Any]]:
    """Count the components of the Morse graph at each point, on so many cells along each axis.

    Parameters
    ----------
    block : Block
        The points.
    cells : int
        Cells along each axis of the domain.
    method : str, optional
        How the image of a cell is found, as for `limitsets.transitions`.
    """
    points, rows = block.points, []
    for k in range(block.numbers.size):
        domain = Domain(points.lo[k], points.hi[k], None if points.anchor is None else points.anchor[k])
        graph = transitions(point_of(points.params, k), grid(domain, cells=cells), method)
        component, others = components_of(graph)
        attractors = int(component.max(initial=-1)) + 1
        rows.append((attractors, attractors + len(others), float((component >= 0).mean())))
    return {
        name: np.array(column, dtype=_VARIABLES[name].dtype)
        for name, column in zip(_VARIABLES, zip(*rows, strict=True), strict=True)
    }
