"""Expansion: |dx'/dx| > 1 on every attracting cell.

Then no periodic orbit in the limit set attracts, so the limit set is no attracting cycle; and every interval in it
grows until it meets a critical point, so the topological entropy is at least the logarithm of the least slope.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.interval import Interval
from limitsets.jit import entry_of, proof_kernel
from limitsets.proofs.cover import Cover
from limitsets.thrower.effects.landing import Landing
from limitsets.thrower.flight_box import bracket
from limitsets.thrower.motion import FullThrow
from limitsets.thrower.side_box import gather_box
from limitsets.thrower.throw_box import slope_between, sure_slope_box

# Cells are cut into this many pieces, so that the slope is not lost in the width of a cell.
PIECES = 8


@proof_kernel(entry=True)
def _slopes(lo_map: Any, hi_map: Any, side: int, cuts: Any, out: Any) -> None:
    b = gather_box(lo_map, hi_map, side)
    for k in range(out.shape[0]):
        last, fine = bracket(b.flight, b, cuts[k, 0])
        for j in range(out.shape[1]):
            first, good = last, fine
            last, fine = bracket(b.flight, b, cuts[k, j + 1])
            x = Interval(cuts[k, j], cuts[k, j + 1])
            slope, proved = slope_between(b, x, first, last, good & fine)
            if not proved:  # parameters so wide that the fast bracket of the impact angle is not confirmed
                slope, proved = sure_slope_box(b, x)
            out[k, j] = slope.lo if proved else -1.0


def least_slope(found: Cover, cells: CellSet) -> tuple[float, str]:
    """Lower bound of the slope on the given cells (the same for a jog, a flip and a roll), and where it is met.

    Returns
    -------
    float
        The bound; at most 1 if expansion is not proved.
    str
        The side and cell of the least slope.
    """
    least, place = np.inf, ""
    for side, _, cuts, out in _pieces(found, cells):
        k, j = divmod(int(out.argmin()), PIECES)
        if out[k, j] < least:
            least, place = float(out[k, j]), f"side {side}, x in [{cuts[k, j]:.6g}, {cuts[k, j + 1]:.6g}]"
    return least, place


def slopes(found: Cover, cells: CellSet) -> NDArray[np.float64]:
    """Lower bounds of the slope on each of the given cells; nan on the others, -1 where nothing is proved."""
    least = np.full(found.grid.n_cells, np.nan)
    for side, k, _, out in _pieces(found, cells):
        least[found.grid.offset[side] + k] = out.min(axis=1)
    return least


def _pieces(found: Cover, cells: CellSet) -> Iterator[tuple[int, Any, Any, Any]]:
    """Per side: the cells, the cuts between their pieces, and a lower bound of the slope on each piece."""
    for side, (edges,) in enumerate(found.grid.edges):
        k = np.flatnonzero(cells.mask[found.grid.of_side(side)])
        if not k.size:
            continue
        weights = np.arange(PIECES + 1) / PIECES
        cuts = edges[k][:, None] + weights * (edges[k + 1] - edges[k])[:, None]
        cuts[:, -1] = edges[k + 1]
        out = np.empty((k.size, PIECES))
        _slopes(*found.box.bare, side, cuts, out)
        lowest = found.box.lo
        if isinstance(lowest, FullThrow) and entry_of(lowest.effects, Landing) is not None:
            # where another vertex may land the displacement is another function
            late = ~(found.images[side].witness[1, k] <= lowest.bare.corner[side])
            out[late] = -1.0
        yield side, k, cuts, out
