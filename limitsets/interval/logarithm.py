"""The natural logarithm on closed intervals.

Logarithm of a double: x = 2^e m with m between 0.7 and 1.5, and ln m = 2 s (1 + q/3 + q^2/5 + ...) with
s = (m - 1)/(m + 1), q = s^2.  The sum is made in interval arithmetic, and so is its rest, so that nothing is left to be
proved but the rest: it is between 0 and `REST` q^`TERMS`, for q < 1/25: 1/25 + q/27 + ... <= (1/25) / (1 - q).
"""

from __future__ import annotations

import math
import sys

import numpy as np

from limitsets.interval.arithmetic import Ends, add, div, holds, mul, or_empty, sqr
from limitsets.jit import mark_undefined, proof_kernel

TERMS = 12
REST = math.nextafter(1.0 / 24.0, 1.0)

LN2 = (math.nextafter(math.log(2.0), 0.0), math.nextafter(math.log(2.0), 1.0))

NORMAL, TINIEST, LARGEST = sys.float_info.min, math.ulp(0.0), sys.float_info.max
MANTISSA, BIAS = 52, 1023
FRACTION = (1 << MANTISSA) - 1


@proof_kernel
def _logarithm(x: float) -> Ends:
    """Enclosure of ln at one positive finite double."""
    small = x < NORMAL
    bits = np.float64(x * 2.0**MANTISSA if small else x).view(np.int64)
    e = (bits >> MANTISSA) - BIAS - (MANTISSA if small else 0)
    m = np.int64((bits & FRACTION) | (BIAS << MANTISSA)).view(np.float64)
    upper = m > 1.4
    m, n = 0.5 * m if upper else m, float(e + 1 if upper else e)
    s = div((m - 1.0, m - 1.0), add((m, m), (1.0, 1.0)))  # the difference of two numbers this close is exact
    q = sqr(s)
    total = (0.0, REST)
    for k in range(TERMS):
        odd = 2.0 * (TERMS - k) - 1.0
        total = add(div((1.0, 1.0), (odd, odd)), mul(q, total))
    return add(mul((n, n), LN2), mul((2.0, 2.0), mul(s, total)))


@proof_kernel
def _positive(x: float) -> float:
    """X moved to the nearer end of the positive numbers; no nan."""
    x = x if x > TINIEST else TINIEST
    return x if x < LARGEST else LARGEST


@proof_kernel
def log(a: Ends) -> Ends:
    """Natural logarithm of the part of a that is positive; the empty set where there is none.

    Where another part is not positive the cell whose image is computed is undecided, see `limitsets.interval`.
    """
    mark_undefined(a[0] <= 0.0)
    lo, hi = _logarithm(_positive(a[0])), _logarithm(_positive(a[1]))
    return or_empty(
        holds(a) & (a[1] > 0.0), -math.inf if a[0] <= 0.0 else lo[0], math.inf if a[1] == math.inf else hi[1]
    )
