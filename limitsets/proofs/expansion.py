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
from limitsets.thrower.motion import FullThrow
from limitsets.thrower.side_box import gather_box
from limitsets.thrower.throw_box import NOTHING, sure_throw_box, throw_box

__all__ = ["least_slope", "slopes"]

# Cells are cut into this many pieces, so that the slope is not lost in the width of a cell.
PIECES = 8


@proof_kernel(entry=True)
def _slopes(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, out: Any) -> None:
    b = gather_box(lo_map, hi_map, side)
    for k in range(lo.size):
        state, _, _, slope, _ = throw_box(b, Interval(lo[k], hi[k]))
        if state == NOTHING:  # parameters so wide that the fast bracket of the impact angle is not confirmed
            state, _, _, slope, _ = sure_throw_box(b, Interval(lo[k], hi[k]))
        out[k] = slope.lo if state != NOTHING else -1.0


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
    for side, _, lo, hi, out in _pieces(found, cells):
        worst = int(out.argmin())
        if out[worst] < least:
            least, place = float(out[worst]), f"side {side}, x in [{lo[worst]:.6g}, {hi[worst]:.6g}]"
    return least, place


def slopes(found: Cover, cells: CellSet) -> NDArray[np.float64]:
    """Lower bounds of the slope on each of the given cells; nan on the others, -1 where nothing is proved."""
    least = np.full(found.grid.n_cells, np.nan)
    for side, k, _, _, out in _pieces(found, cells):
        least[found.grid.offset[side] + k] = out.reshape(k.size, PIECES).min(axis=1)
    return least


def _pieces(found: Cover, cells: CellSet) -> Iterator[tuple[int, Any, Any, Any, Any]]:
    """Per side: the cells, both ends of their pieces, and a lower bound of the slope on each piece."""
    for side, (edges,) in enumerate(found.grid.edges):
        k = np.flatnonzero(cells.mask[found.grid.of_side(side)])
        if not k.size:
            continue
        weights = np.arange(PIECES + 1) / PIECES
        cuts = edges[k][:, None] + weights * (edges[k + 1] - edges[k])[:, None]
        cuts[:, -1] = edges[k + 1]
        out = np.empty(k.size * PIECES)
        lo, hi = np.ascontiguousarray(cuts[:, :-1].ravel()), np.ascontiguousarray(cuts[:, 1:].ravel())
        _slopes(*found.box.bare, side, lo, hi, out)
        lowest = found.box.lo
        if isinstance(lowest, FullThrow) and entry_of(lowest.effects, Landing) is not None:
            # where another vertex may land the displacement is another function
            late = ~(found.images[side].witness[1, k] <= lowest.bare.corner[side])
            out.reshape(k.size, PIECES)[late] = -1.0
        yield side, k, lo, hi, out
