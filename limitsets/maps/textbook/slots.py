"""Answers of `image_box`: one or two boxes, and whether they are proved.

A box that is not finite (an operation overflowed, or was impossible) proves nothing.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from limitsets.interval import Interval
from limitsets.jit import proof_kernel
from limitsets.maps.derived import NO_WITNESS

Point: TypeAlias = tuple[float, float]
Pair: TypeAlias = tuple[Interval, Interval]

LineSlot: TypeAlias = tuple[float, float, int, int]
Line: TypeAlias = tuple[int, LineSlot, LineSlot, Point]
"""Answer in one dimension: count, two slots (lo', hi', side', branch), witness."""

PlaneSlot: TypeAlias = tuple[Point, Point, int, int]
Plane: TypeAlias = tuple[int, PlaneSlot, PlaneSlot, Point]
"""Answer in two dimensions."""


@proof_kernel
def _count(first: bool, second: bool, sound: bool) -> int:
    """Count the images: -1 where there is none or one of them is not sound."""
    count = (1 if first else 0) + (1 if second else 0)
    return count if sound & (count > 0) else -1


@proof_kernel
def _finite(a: Interval) -> bool:
    return (a.lo <= a.hi) & (a.hi - a.lo < math.inf)


@proof_kernel
def rectangle(lo: Point, hi: Point) -> Pair:
    """Intervals of the coordinates of a box."""
    return Interval(lo[0], hi[0]), Interval(lo[1], hi[1])


@proof_kernel
def line(a: Interval, side: int, branch: int) -> Line:
    """One image."""
    slot = (a.lo, a.hi, side, branch)
    return _count(True, False, _finite(a)), slot, slot, NO_WITNESS


@proof_kernel
def line_of_two(first: bool, a: Interval, second: bool, b: Interval, side: int) -> Line:
    """Images of branches 0 and 1, each as far as it is possible."""
    sound = (_finite(a) | (not first)) & (_finite(b) | (not second))
    zero, one = (a.lo, a.hi, side, 0), (b.lo, b.hi, side, 1)
    return _count(first, second, sound), zero if first else one, one, NO_WITNESS


@proof_kernel
def plane(a: Pair, side: int, branch: int) -> Plane:
    """One image in the plane."""
    slot = ((a[0].lo, a[1].lo), (a[0].hi, a[1].hi), side, branch)
    return _count(True, False, _finite(a[0]) & _finite(a[1])), slot, slot, NO_WITNESS
