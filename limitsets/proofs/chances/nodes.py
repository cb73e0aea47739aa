"""Nodes of a function that is continuous and affine between them: per side, and close together where it may jump.

Where a function jumps (the border of an absorbing set, the joint, the arm's end) there are nodes so close together that
a continuous bound from either side costs nothing.  Beyond the outermost ones it is constant.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from limitsets.base.arrays import Array, Ints

# How near to a jump the next nodes lie, relative to the arm.
CLOSE = 2.0**-33
# The narrowest cells near the joint, and places at which the graded ones are counted.
NARROWEST, TABLE = 0.11, 4097


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of all sides in one row.

    Attributes
    ----------
    place : ndarray, shape (n,)
        Places x, growing on each side [length].
    first : ndarray of int, shape (n_sides + 1,)
        Number of the first node of each side.
    """

    place: Array
    first: Ints

    def of_side(self, side: int) -> slice:
        """Return the nodes of a side."""
        return slice(int(self.first[side]), int(self.first[side + 1]))


def extra(graded: float) -> float:
    """Return by how much longer a side is, counted in cells, where those near the joint are narrower."""
    return graded * float(np.log(1.0 / NARROWEST))


def _even(lo: float, hi: float, width: float, graded: float) -> tuple[Array, Array]:
    """Places whose distances grow in proportion to that from the joint up to `graded`, and the distances."""
    if not 0.0 < graded < hi - lo:
        count = int(np.ceil((hi - lo) / width))
        return np.linspace(lo, hi, count + 1), np.full(count + 1, width)
    x = np.unique(np.concatenate([np.linspace(0.0, graded, TABLE), [NARROWEST * graded, hi - lo]]))
    share = np.clip(x / graded, NARROWEST, 1.0)
    steps = np.diff(x) / share[:-1]
    inner = (x[:-1] >= NARROWEST * graded) & (x[1:] <= graded)
    steps[inner] = graded * np.diff(np.log(np.maximum(x, 1e-300)))[inner]
    total = np.concatenate([[0.0], np.cumsum(steps)])
    count = int(np.ceil(total[-1] / width))
    at = np.interp(np.linspace(0.0, total[-1], count + 1), total, x)
    places = np.clip(lo + at, lo, hi)
    places[0], places[-1] = lo, hi
    return places, width * np.clip(at / graded, NARROWEST, 1.0)


def nodes_of(
    ends: Sequence[tuple[float, float]],
    width: float,
    special: Sequence[Sequence[float]],
    without: Sequence[Sequence[tuple[float, float]]],
    graded: float,
) -> Nodes:
    """Place nodes at distances of about `width`, closer near the joint, and at the special places.

    Parameters
    ----------
    ends : sequence of (float, float)
        Per side where functions begin and cease to vary.
    width : float
        Widest cell between them.
    special : sequence of sequence of float
        Per side further nodes.
    without : sequence of sequence of (float, float)
        Per side where no nodes are wanted but the special ones.
    graded : float
        So far beyond the joint cells are narrower, by at most `NARROWEST`: a function of the start varies the more
        quickly the more throws are to come.
    """
    rows = []
    for (lo, hi), more, gone in zip(ends, special, without, strict=True):
        even, own = _even(lo, hi, width, graded)
        places = np.array([x for x in more if lo <= x <= hi])
        # No even node so near to a special one that cells of no use arise.
        near = np.searchsorted(np.sort(places), even[:, None] + np.array([-0.02, 0.02]) * own[:, None])
        keep = (near[:, 0] == near[:, 1]) | (even == lo) | (even == hi)
        for begin, end in gone:
            keep &= (even <= begin) | (even >= end)
        rows.append(np.unique(np.concatenate([even[keep], places])))
    return Nodes(np.concatenate(rows), np.cumsum([0, *(row.size for row in rows)]))
