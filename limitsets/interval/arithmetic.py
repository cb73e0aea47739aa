"""The four operations, square and square root on closed intervals.

Bodies are free of branches, so that loops over arrays of intervals vectorise.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from limitsets.interval.rounding import down, up
from limitsets.jit import proof_kernel

__all__ = [
    "Interval",
    "absolute",
    "add",
    "contains",
    "div",
    "hull",
    "maximum",
    "minimum",
    "mul",
    "neg",
    "point",
    "sqr",
    "sqrt",
    "sub",
]

Interval: TypeAlias = tuple[float, float]
"""``(lo, hi)`` with lo <= hi, both finite."""


@proof_kernel
def point(x: float) -> Interval:
    """Return the interval of one number."""
    return x, x


@proof_kernel
def contains(a: Interval, x: float) -> bool:
    """Whether x lies in a; False for nan."""
    return (a[0] <= x) & (x <= a[1])


@proof_kernel
def hull(a: Interval, b: Interval) -> Interval:
    """Return the smallest interval that holds both."""
    return min(a[0], b[0]), max(a[1], b[1])


@proof_kernel
def neg(a: Interval) -> Interval:
    """Return -a, exactly."""
    return -a[1], -a[0]


@proof_kernel
def absolute(a: Interval) -> Interval:
    """Return |a|, exactly."""
    lo = max(max(a[0], -a[1]), 0.0)
    return lo, max(-a[0], a[1])


@proof_kernel
def minimum(a: Interval, b: Interval) -> Interval:
    """Smaller of the two, exactly."""
    return min(a[0], b[0]), min(a[1], b[1])


@proof_kernel
def maximum(a: Interval, b: Interval) -> Interval:
    """Larger of the two, exactly."""
    return max(a[0], b[0]), max(a[1], b[1])


@proof_kernel
def add(a: Interval, b: Interval) -> Interval:
    """Return a + b."""
    return down(a[0] + b[0]), up(a[1] + b[1])


@proof_kernel
def sub(a: Interval, b: Interval) -> Interval:
    """Return a - b."""
    return down(a[0] - b[1]), up(a[1] - b[0])


@proof_kernel
def mul(a: Interval, b: Interval) -> Interval:
    """Return a b."""
    p, q, r, s = a[0] * b[0], a[0] * b[1], a[1] * b[0], a[1] * b[1]
    return down(min(min(p, q), min(r, s))), up(max(max(p, q), max(r, s)))


@proof_kernel
def div(a: Interval, b: Interval) -> Interval:
    """Return a / b; all numbers where b holds 0."""
    p, q, r, s = a[0] / b[0], a[0] / b[1], a[1] / b[0], a[1] / b[1]
    safe = (b[0] > 0.0) | (b[1] < 0.0)
    lo = down(min(min(p, q), min(r, s)))
    hi = up(max(max(p, q), max(r, s)))
    return lo if safe else -math.inf, hi if safe else math.inf


@proof_kernel
def sqr(a: Interval) -> Interval:
    """a^2, with both factors the same number."""
    p, q = a[0] * a[0], a[1] * a[1]
    across = (a[0] <= 0.0) & (a[1] >= 0.0)
    return 0.0 if across else max(down(min(p, q)), 0.0), up(max(p, q))


@proof_kernel
def sqrt(a: Interval) -> Interval:
    """Square root of the part of a that is not negative; nan where there is none."""
    lo = math.sqrt(max(a[0], 0.0))
    return max(down(lo), 0.0), up(math.sqrt(a[1]))
