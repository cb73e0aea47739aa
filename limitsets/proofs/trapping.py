"""Trapping: every attracting component is mapped into its own interior.

Then the component is an isolating neighbourhood of an attractor that persists under small changes of the map.  The
interior is relative to (a_i, arm.length], where a part can rest: a component may reach the arm's end, but no image may
lie beyond it.
"""

from __future__ import annotations

import numpy as np

from limitsets.cells import CellSet
from limitsets.proofs.attraction import Attraction


def _held(lo: float, hi: float, intervals: list[tuple[float, float]], end: float, arm: float) -> bool:
    """Whether [lo, hi] lies in the interior of one of the intervals, relative to x <= arm."""
    return any(bottom < lo and (hi < top or (top >= end and hi <= arm)) for bottom, top in intervals)


def trapping(found: Attraction) -> str:
    """Prove that the images of each attracting component lie in the interior of its cells.

    Parameters
    ----------
    found : Attraction
        Cells, components and enclosed images.

    Returns
    -------
    str
        What is missing and where; empty if it is proved.

    Notes
    -----
    Comparisons of the enclosures' ends with the cells' borders only, both exact.  Source: docs/model.md, attraction.
    """
    grid, arm = found.cover.grid, float(found.cover.box.lo.arm_length)
    if not (found.component >= 0).any():
        return "there are no attracting cells"
    for number in range(int(found.component.max()) + 1):
        inside = CellSet(grid, found.component == number)
        extents = inside.extents()
        for side, images in enumerate(found.cover.images):
            mine = inside.mask[grid.of_side(side)]
            edges = grid.edges[side][0]
            cells = [*((int(k), "nothing is proved of") for k in np.flatnonzero(mine & images.lost))]
            for (to, _), (lo, hi) in images.hulls.items():
                end = float(grid.edges[to][0][-1])
                cells += [
                    (int(k), "not interior to the component is")
                    for k in np.flatnonzero(mine & (lo <= hi))
                    if not _held(float(lo[k]), float(hi[k]), extents.get(to, []), end, arm)
                ]
            if cells:
                k, what = cells[0]
                return f"{what} the image of side {side}, x in [{edges[k]:.6g}, {edges[k + 1]:.6g}]"
    return ""
