"""Intervals of a side on which a condition holds."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def where(true: Callable[[Array], Flags], x: Array, seen: Flags | None = None) -> list[tuple[float, float]]:
    """Intervals on which a condition holds, seen at samples, their ends bisected down to adjacent floats.

    Parameters
    ----------
    true : callable
        The condition, of many places at once.
    x : ndarray, shape (n,)
        Samples [length], ascending; a narrower interval between two of them may be missed.
    seen : ndarray of bool, shape (n,), optional
        The condition at the samples, where that is known.

    Examples
    --------
    >>> import numpy as np
    >>> [(lo, round(hi, 9)) for lo, hi in where(lambda x: x * x < 2.0, np.linspace(0.0, 2.0, 5))]
    [(0.0, 1.414213562)]
    """
    seen = true(x) if seen is None else seen
    changes = np.flatnonzero(seen[1:] != seen[:-1])
    lo, hi, before = x[changes], x[changes + 1], seen[changes]
    while True:
        middle = lo + 0.5 * (hi - lo)
        if not ((middle > lo) & (middle < hi)).any():
            break
        same = true(middle) == before
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    # The end of a true stretch is the last float where the condition holds.
    ends = np.where(before, lo, hi).tolist()
    if seen[0]:
        ends.insert(0, float(x[0]))
    if seen[-1]:
        ends.append(float(x[-1]))
    return list(zip(ends[::2], ends[1::2], strict=True))
