"""Result of an image method: points of one side, and the cell that each point represents."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class SamplePoints:
    """Points of one side and their cells.

    The points of the cell at position (i, j, ...) are those with number ``i s_0 + j s_1 + ... + offset``.

    Attributes
    ----------
    axes : tuple of ndarray
        The points are all combinations of these values, the last axis running fastest.
    strides : tuple of int
        s_0, s_1, ...
    offsets : ndarray of int64, shape (points per cell,)
        The offsets.
    pad : int
        Cells by which the image's box is enlarged on every side.
    split : bool
        In one dimension: an undecided cell is cut where the branch changes, and each piece's image taken, instead
        of the image of the whole cell under every branch.
    """

    axes: tuple[NDArray[np.float64], ...]
    strides: tuple[int, ...]
    offsets: NDArray[np.int64]
    pad: int = 0
    split: bool = False

    def points(self) -> tuple[NDArray[np.float64], ...]:
        """All points, one array per coordinate."""
        return tuple(m.ravel() for m in np.meshgrid(*self.axes, indexing="ij"))
