"""Cells of the function that is averaged, from one to another, and what of it on them bounds a mean."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


class Span(NamedTuple):
    """Cells of the target from `first` to `last`, both of them included; one pair for each entry."""

    first: Index
    last: Index


class Swings(NamedTuple):
    """To `row` is added `much` times the total variation of V on a span."""

    row: Index
    much: Array
    span: Span


class Bends(NamedTuple):
    """To 8/h^2 of `cell`'s deficit comes a coefficient in [lo, hi] times the slope of V on a span.

    Where that says less, the deficit grows by `cap` times the total variation of V there instead.
    """

    cell: Index
    lo: Array
    hi: Array
    cap: Array
    span: Span


class Gaps(NamedTuple):
    """To `row` is added `much` times the difference of the largest and the smallest V on two spans together."""

    row: Index
    much: Array
    one: Span
    two: Span


class Kinks(NamedTuple):
    """To `cell`'s deficit comes `much` times the sum of what the slope of V falls by at the nodes within a span.

    Or `even` times the most that it falls by per length, where that is less; and `bow` times the largest slope there.
    """

    cell: Index
    much: Array
    even: Array
    bow: Array
    span: Span


class Curvature(NamedTuple):
    """One way to bound the deficit by curvature, for the cells that it knows."""

    cells: Index
    bends: tuple[Bends, ...] = ()
    swings: tuple[Swings, ...] = ()
    kinks: tuple[Kinks, ...] = ()
    gaps: tuple[Gaps, ...] = ()


class Running(NamedTuple):
    """Running sums of numbers >= 0, from 0 on, and how far a difference of two may be off."""

    total: Array
    off: float

    def between(self, first: Index, last: Index) -> Array:
        """Bound the sum of the numbers from `first` up to the one before `last` from above."""
        found: Array = self.total[last] - self.total[first] + self.off
        return found


def running(numbers: Array) -> Running:
    """Add numbers up, one after the other."""
    total = np.concatenate([[0.0], np.cumsum(numbers)])
    return Running(total, numbers.size * 2.0**-52 * float(total[-1]))


class Windows:
    """Largest and smallest values on spans of an array: by windows of 2, 4, 8 ... that overlap."""

    def __init__(self, span: Span) -> None:
        level = np.frexp(span.last - span.first + 1)[1] - 1
        last = span.last - (1 << level) + 1
        self.count, self.groups = level.size, []
        for each in range(int(level.max(initial=0)) + 1):
            here = np.flatnonzero(level == each)
            self.groups.append((here, span.first[here], last[here]))

    def ends(self, values: Array) -> tuple[Array, Array]:
        """Return the smallest and the largest."""
        lo, hi = np.empty(self.count), np.empty(self.count)
        least = most = values
        for level, (here, first, last) in enumerate(self.groups):
            if level:
                half = 1 << (level - 1)
                least = np.minimum(least[:-half], least[half:])
                most = np.maximum(most[:-half], most[half:])
            if here.size:
                lo[here] = np.minimum(least[first], least[last])
                hi[here] = np.maximum(most[first], most[last])
        return lo, hi
