"""Jogs per visit: how many throws a part stays on a side of an attracting block, between one flip and the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]
Ends = NDArray[np.int32]


class Visit(NamedTuple):
    """Bounds of the jogs in a row, from the landing after a flip to the next flip; `most` -1 where none is proved."""

    least: int
    most: int


def met(ends: Ends, cells: Mask) -> Mask:
    """Return the cells that images of some cells meet; `ends` are the first and last of each, -1 where it has none."""
    some = ends[cells & (ends[:, 0] >= 0)]
    count = np.zeros(cells.size + 1, dtype=np.int64)
    np.add.at(count, some[:, 0], 1)
    np.add.at(count, some[:, 1] + 1, -1)
    reached: Mask = np.cumsum(count[:-1]) > 0
    return reached


def visit(jog: Ends, flip: Ends, block: Mask, side: Mask) -> Visit | None:
    """Bound the jogs of a visit to one side of a block; None where no flip of the block leads to it.

    Parameters
    ----------
    jog, flip : ndarray of int, shape (n_cells, 2)
        Target cells, as in a certificate.
    block, side : ndarray of bool, shape (n_cells,)
        The cells of the block, all sides together, and those of the side.
    """
    here = met(flip, block) & side
    if not here.any():
        return None
    least, most = -1, int((block & side).sum())
    for jogs in range(most + 1):
        if least < 0 and (flip[here, 0] >= 0).any():
            least = jogs
        if not (jog[here, 0] >= 0).any():
            return Visit(least, jogs)
        here = met(jog, here)
    return Visit(max(least, 0), -1)  # longer than there are cells: some cell comes again
