"""The four operations, square and square root on closed intervals.

Bodies are free of branches, so that loops over arrays of intervals vectorise.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from limitsets.numbers.interval.rounding import above, above_sum, below, below_sum
from limitsets.numbers.jit import mark_undefined, proof_kernel

Ends: TypeAlias = tuple[float, float]
"""``(lo, hi)`` with lo <= hi, either of which may be infinite; (nan, nan) is the empty set."""


# By which share the ends of a cube root are wider than a root in floats.
OF_ROOT = 2.0**-48


@proof_kernel
def point(x: float) -> Ends:
    """Return the interval of one number."""
    return x, x


@proof_kernel
def contains(a: Ends, x: float) -> bool:
    """Whether x lies in a; False for nan."""
    return (a[0] <= x) & (x <= a[1])


@proof_kernel
def holds(a: Ends) -> bool:
    """Whether a is an interval; False for the empty set, and for any other pair with a nan or the wrong way round."""
    return a[0] <= a[1]


@proof_kernel
def or_empty(good: bool, lo: float, hi: float) -> Ends:
    """(lo, hi), or the empty set: never half of it."""
    return lo if good else math.nan, hi if good else math.nan


@proof_kernel
def _number(y: float) -> float:
    """Product or quotient of two ends: 0 times an infinite end is 0."""
    return y if y == y else 0.0  # nan alone is unequal to itself


@proof_kernel
def hull(a: Ends, b: Ends) -> Ends:
    """Return the smallest interval that holds both; of the empty set and b, b."""
    one, two = holds(a), holds(b)
    lo = min(a[0] if one else math.inf, b[0] if two else math.inf)
    hi = max(a[1] if one else -math.inf, b[1] if two else -math.inf)
    return or_empty(one | two, lo, hi)


@proof_kernel
def neg(a: Ends) -> Ends:
    """Return -a, exactly."""
    return or_empty(holds(a), -a[1], -a[0])


@proof_kernel
def absolute(a: Ends) -> Ends:
    """Return |a|, exactly."""
    lo = max(max(a[0], -a[1]), 0.0)
    return or_empty(holds(a), lo, max(-a[0], a[1]))


@proof_kernel
def minimum(a: Ends, b: Ends) -> Ends:
    """Smaller of the two, exactly."""
    return or_empty(holds(a) & holds(b), min(a[0], b[0]), min(a[1], b[1]))


@proof_kernel
def maximum(a: Ends, b: Ends) -> Ends:
    """Larger of the two, exactly."""
    return or_empty(holds(a) & holds(b), max(a[0], b[0]), max(a[1], b[1]))


@proof_kernel
def add(a: Ends, b: Ends) -> Ends:
    """Return a + b."""
    lo, hi = a[0] + b[0], a[1] + b[1]
    return or_empty(lo <= hi, below_sum(lo), above_sum(hi))


@proof_kernel
def sub(a: Ends, b: Ends) -> Ends:
    """Return a - b."""
    lo, hi = a[0] - b[1], a[1] - b[0]
    return or_empty(lo <= hi, below_sum(lo), above_sum(hi))


@proof_kernel
def _keep_sign(a: Ends, b: Ends, lo: float, hi: float) -> Ends:
    """Cut the bounds of a product, or quotient, of a and b at 0 where their signs allow none beyond it.

    So an end that is 0 stays 0: a face x = 0 that a map keeps is not left by rounding.
    """
    over, under = (a[0] >= 0.0, b[0] >= 0.0), (a[1] <= 0.0, b[1] <= 0.0)
    zero = (over[0] & under[0]) | (over[1] & under[1])
    not_below = (over[0] & over[1]) | (under[0] & under[1]) | zero
    not_above = (over[0] & under[1]) | (under[0] & over[1]) | zero
    return max(lo, 0.0 if not_below else -math.inf), min(hi, 0.0 if not_above else math.inf)


@proof_kernel
def mul(a: Ends, b: Ends) -> Ends:
    """Return a b."""
    p, q = _number(a[0] * b[0]), _number(a[0] * b[1])
    r, s = _number(a[1] * b[0]), _number(a[1] * b[1])
    lo, hi = min(min(p, q), min(r, s)), max(max(p, q), max(r, s))
    lo, hi = _keep_sign(a, b, below(lo), above(hi))
    return or_empty(holds(a) & holds(b), lo, hi)


@proof_kernel
def div(a: Ends, b: Ends) -> Ends:
    """Return a / b; all numbers where b holds 0."""
    p, q = _number(a[0] / b[0]), _number(a[0] / b[1])
    r, s = _number(a[1] / b[0]), _number(a[1] / b[1])
    safe = (b[0] > 0.0) | (b[1] < 0.0)
    lo, hi = below(min(min(p, q), min(r, s))), above(max(max(p, q), max(r, s)))
    lo, hi = _keep_sign(a, b, lo, hi)
    return or_empty(holds(a) & holds(b), lo if safe else -math.inf, hi if safe else math.inf)


@proof_kernel
def sqr(a: Ends) -> Ends:
    """a^2, with both factors the same number."""
    p, q = a[0] * a[0], a[1] * a[1]
    across = (a[0] <= 0.0) & (a[1] >= 0.0)
    return or_empty(holds(a), 0.0 if across else max(below(min(p, q)), 0.0), above(max(p, q)))


@proof_kernel
def power(a: Ends, count: int) -> Ends:
    """a^count for a whole number: that of each end, or of |a| where the power is even."""
    if count == 2:
        return sqr(a)
    n = abs(count)
    base = a if n & 1 else absolute(a)  # `&`: a power that is a float does not compile
    lo, hi = (1.0, 1.0), (1.0, 1.0)
    for _ in range(n):
        lo, hi = mul(lo, (base[0], base[0])), mul(hi, (base[1], base[1]))
    ends = or_empty(holds(a), lo[0], hi[1])
    return ends if count >= 0 else div((1.0, 1.0), ends)


@proof_kernel
def floor(a: Ends) -> Ends:
    """Largest whole number that is not above, exactly: those of all of a."""
    return or_empty(holds(a), math.floor(a[0] + 0.0), math.floor(a[1] + 0.0))


@proof_kernel
def sqrt(a: Ends) -> Ends:
    """Square root of the part of a that is not negative; the empty set where there is none.

    Where another part is negative the cell whose image is computed is undecided, see `limitsets.interval`.
    """
    mark_undefined(a[0] < 0.0)
    lo, hi = math.sqrt(max(a[0], 0.0)), math.sqrt(max(a[1], 0.0))
    return or_empty(holds(a) & (a[1] >= 0.0), max(below(lo), 0.0), above(hi))


@proof_kernel
def cbrt(a: Ends) -> Ends:
    """Cube root: a little beyond a root in floats, if the cubes of the two ends are proved to enclose a."""
    lo, hi = np.cbrt(a[0]), np.cbrt(a[1])
    lo, hi = lo - OF_ROOT * abs(lo), hi + OF_ROOT * abs(hi)
    low = (a[0] == 0.0) | (power((lo, lo), 3)[1] <= a[0])
    high = (a[1] == 0.0) | (power((hi, hi), 3)[0] >= a[1])
    return or_empty(holds(a), lo if low else -math.inf, hi if high else math.inf)
