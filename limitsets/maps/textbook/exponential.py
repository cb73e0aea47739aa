"""The exponential without branch or library call, so that a loop over an array vectorises (math.exp in one does not).

exp x = 2^k exp r with k = round(x / ln 2) and abs(r) <= ln(2)/2; exp r is summed from its series. 2^k is built from
the bits of k, in two factors because k leaves the range of a double's exponent at either end.
"""

from __future__ import annotations

import math

import numpy as np

from limitsets.jit import kernel

# exp r = 1 + r + r^2 (E2 + E3 r + ...). The first term left out, r^14/14!, is below 5e-18.
E2, E3, E4, E5, E6, E7, E8, E9, E10, E11, E12, E13 = (1 / math.factorial(k) for k in range(2, 14))
PER_LN2 = 1.0 / math.log(2.0)
# ln 2 in two parts; the first ends in 32 zero bits, so that its product with k is exact.
LN2_HI = 6.93147180369123816490e-01
LN2_LO = 1.90821492927058770002e-10
# Adding 1.5 2^52 rounds to an integer and leaves it in the lowest bits.
ROUND = 6755399441055744.0
BIAS = 1023.0


@kernel
def _power_of_two(k: float) -> float:
    """2^k for a whole number k from -1022 to 1023: k in the place of the exponent."""
    bits = np.float64(k + (ROUND + BIAS)).view(np.int64) << 52
    return np.int64(bits).view(np.float64)


@kernel
def exponential(x: float) -> float:
    """Exponential of x within one unit in the last place; 0, inf and nan where exp has them.

    Examples
    --------
    >>> from limitsets.maps.textbook.exponential import exponential
    >>> exponential(1.0)
    2.718281828459045
    """
    x = -746.0 if x < -746.0 else x  # 0 there
    x = 710.0 if x > 710.0 else x  # inf there
    k = (x * PER_LN2 + ROUND) - ROUND
    r = (x - k * LN2_HI) - k * LN2_LO
    tail = E8 + r * (E9 + r * (E10 + r * (E11 + r * (E12 + r * E13))))
    tail = E2 + r * (E3 + r * (E4 + r * (E5 + r * (E6 + r * (E7 + r * tail)))))
    half = (0.5 * k + ROUND) - ROUND
    return ((1.0 + (r + r * r * tail)) * _power_of_two(half)) * _power_of_two(k - half)
