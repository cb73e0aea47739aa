"""Answers of `image_box`: one or two boxes, and whether they are proved.

A box that is not finite (an operation overflowed, or was impossible) proves nothing.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from limitsets.interval.arithmetic import Ends
from limitsets.jit import proof_kernel

__all__ = [
    "NO_WITNESS",
    "Line",
    "Plane",
    "Point",
    "line",
    "line_of_two",
    "plane",
    "plane_of_two",
    "rectangle",
]

Point: TypeAlias = tuple[float, float]
Pair: TypeAlias = tuple[Ends, Ends]

LineSlot: TypeAlias = tuple[float, float, int, int]
Line: TypeAlias = tuple[int, LineSlot, LineSlot, Point]
"""Answer in one dimension: count, two slots (lo', hi', side', branch), witness."""

PlaneSlot: TypeAlias = tuple[Point, Point, int, int]
Plane: TypeAlias = tuple[int, PlaneSlot, PlaneSlot, Point]
"""Answer in two dimensions."""

NO_WITNESS = (0.0, 0.0)


@proof_kernel
def _count(first: bool, second: bool, sound: bool) -> int:
    """Count the images: -1 where there is none or one of them is not sound."""
    count = (1 if first else 0) + (1 if second else 0)
    return count if sound & (count > 0) else -1


@proof_kernel
def _finite(a: Ends) -> bool:
    return (a[0] <= a[1]) & (a[1] - a[0] < math.inf)


@proof_kernel
def rectangle(lo: Point, hi: Point) -> Pair:
    """Intervals of the coordinates of a box."""
    return (lo[0], hi[0]), (lo[1], hi[1])


@proof_kernel
def line(a: Ends, side: int, branch: int) -> Line:
    """One image."""
    slot = (a[0], a[1], side, branch)
    return _count(True, False, _finite(a)), slot, slot, NO_WITNESS


@proof_kernel
def line_of_two(first: bool, a: Ends, second: bool, b: Ends, side: int) -> Line:
    """Images of branches 0 and 1, each as far as it is possible."""
    sound = (_finite(a) | (not first)) & (_finite(b) | (not second))
    zero, one = (a[0], a[1], side, 0), (b[0], b[1], side, 1)
    return _count(first, second, sound), zero if first else one, one, NO_WITNESS


@proof_kernel
def plane(a: Pair, side: int, branch: int) -> Plane:
    """One image in the plane."""
    slot = ((a[0][0], a[1][0]), (a[0][1], a[1][1]), side, branch)
    return _count(True, False, _finite(a[0]) & _finite(a[1])), slot, slot, NO_WITNESS


@proof_kernel
def plane_of_two(first: bool, a: Pair, second: bool, b: Pair, side: int) -> Plane:
    """Images of branches 0 and 1 in the plane, each as far as it is possible."""
    sound = ((_finite(a[0]) & _finite(a[1])) | (not first)) & ((_finite(b[0]) & _finite(b[1])) | (not second))
    zero = ((a[0][0], a[1][0]), (a[0][1], a[1][1]), side, 0)
    one = ((b[0][0], b[1][0]), (b[0][1], b[1][1]), side, 1)
    return _count(first, second, sound), zero if first else one, one, NO_WITNESS
