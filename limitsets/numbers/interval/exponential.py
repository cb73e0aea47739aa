"""The exponential and the natural logarithm on closed intervals.

Exponential of a double: x = n ln 2 + r by subtraction of ln 2 in two parts, |r| <= ln(2)/2 (a hair more), then the
Taylor polynomial, scaled by 2^n through the bits of the exponent.  For |x| <= `LARGEST` the result is within

    `RELATIVE` exp x

of the exact value in every rounding direction; a test proves it in exact rationals from the numbers as they are stored.
Beyond `LARGEST` the answer is [0, exp(-LARGEST)] and [exp LARGEST, inf].
"""

from __future__ import annotations

import math
import sys

import numpy as np

from limitsets.numbers.interval.arithmetic import Ends, add, div, holds, mul, or_empty, power, sqr, sub
from limitsets.numbers.interval.rounding import clamped, down, up
from limitsets.numbers.jit import mark_undefined, proof_kernel

LARGEST = 700.0
RELATIVE = 2.0**-50

# A real exponent that is a whole number up to this one is taken as a product of so many factors.
WHOLE = 200

# ln 2 in two parts; the first has 32 bits, so that n times it is exact for |n| < 2^20.
PARTS = (float.fromhex("0x1.62e42feep-1"), float.fromhex("0x1.a39ef35793c76p-33"))
L1, L2 = PARTS
PER_LN2 = 1.0 / math.log(2.0)

# exp r = 1 + r + r^2 (E2 + r (E3 + ...))
COEFFICIENTS = tuple(1 / math.factorial(k) for k in range(2, 15))
E2, E3, E4, E5, E6, E7, E8, E9, E10, E11, E12, E13, E14 = COEFFICIENTS

BIAS, MANTISSA = 1023, 52


@proof_kernel
def exponential(x: float) -> float:
    """Exp at one double, |x| <= `LARGEST`, within the bound of this module."""
    n = math.floor(x * PER_LN2 + 0.5)
    r = (x - n * L1) - n * L2
    tail = E9 + r * (E10 + r * (E11 + r * (E12 + r * (E13 + r * E14))))
    tail = E2 + r * (E3 + r * (E4 + r * (E5 + r * (E6 + r * (E7 + r * (E8 + r * tail))))))
    # The product with the power of two is exact: it stays in the normal range.
    power = np.int64((np.int64(n) + BIAS) << MANTISSA).view(np.float64)
    return float((1.0 + (r + r * r * tail)) * power)


@proof_kernel
def exp(a: Ends) -> Ends:
    """Exponential of an interval."""
    y = exponential(clamped(a[0], -LARGEST, LARGEST))
    z = exponential(clamped(a[1], -LARGEST, LARGEST))
    lo, hi = down(y - RELATIVE * y), up(z + RELATIVE * z)
    return or_empty(holds(a), 0.0 if a[0] < -LARGEST else lo, math.inf if a[1] > LARGEST else hi)


@proof_kernel
def _tanh(x: float) -> Ends:
    """Hyperbolic tangent at one double that is not negative, by 1 - 2/(exp 2x + 1), and by its series near 0.

    x - x^3/3 <= tanh x <= x - x^3/3 + 2 x^5/15 for x >= 0: the series alternates, with falling terms for x < 1.
    """
    at, one, two = (x, x), (1.0, 1.0), (2.0, 2.0)
    far = sub(one, div(two, add(exp(mul(two, at)), one)))
    first = sub(at, div(power(at, 3), (3.0, 3.0)))
    second = add(first, div(mul(two, power(at, 5)), (15.0, 15.0)))
    near = x < 0.5
    lo, hi = max(far[0], first[0] if near else 0.0), min(far[1], second[1] if near else 1.0)
    return max(lo, 0.0), min(hi, min(x, 1.0))


@proof_kernel
def tanh(a: Ends) -> Ends:
    """Hyperbolic tangent of an interval."""
    p, q = _tanh(abs(a[0])), _tanh(abs(a[1]))
    return or_empty(holds(a), p[0] if a[0] >= 0.0 else -p[1], q[1] if a[1] >= 0.0 else -q[0])


# ---------------------------------------------------------------- The natural logarithm on closed intervals
#
# Logarithm of a double: x = 2^e m with m between 0.7 and 1.5, and ln m = 2 s (1 + q/3 + q^2/5 + ...) with
# s = (m - 1)/(m + 1), q = s^2.  The sum is made in interval arithmetic, and so is its rest, so that nothing is left
# to be proved but the rest: it is between 0 and `REST` q^`TERMS`, for q < 1/25: 1/25 + q/27 + ... <= (1/25) / (1 -
# q).


TERMS = 12
REST = math.nextafter(1.0 / 24.0, 1.0)

LN2 = (math.nextafter(math.log(2.0), 0.0), math.nextafter(math.log(2.0), 1.0))

NORMAL, TINIEST, LARGEST_FLOAT = sys.float_info.min, math.ulp(0.0), sys.float_info.max
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
def log(a: Ends) -> Ends:
    """Natural logarithm of the part of a that is positive; the empty set where there is none.

    Where another part is not positive the cell whose image is computed is undecided, see `limitsets.interval`.
    """
    mark_undefined(a[0] <= 0.0)
    lo = _logarithm(clamped(a[0], TINIEST, LARGEST_FLOAT))
    hi = _logarithm(clamped(a[1], TINIEST, LARGEST_FLOAT))
    return or_empty(
        holds(a) & (a[1] > 0.0), -math.inf if a[0] <= 0.0 else lo[0], math.inf if a[1] == math.inf else hi[1]
    )


@proof_kernel
def real_power(a: Ends, exponent: Ends) -> Ends:
    """a^b for all exponents between two ends, of the part of a that is not negative: exp(b log a), and 0 at a = 0.

    A single whole exponent takes all of a.  Elsewhere the cell whose image is computed is undecided where a has another
    part, or holds 0 and the exponents are not all positive.
    """
    least, most = exponent
    if (least == most) & (least == math.floor(least)) & (abs(least) <= WHOLE):
        return power(a, int(least))
    mark_undefined((a[0] < 0.0) | ((a[0] == 0.0) & (least <= 0.0)))
    at_zero = (0.0, 0.0 if least > 0.0 else math.inf)
    low = at_zero if a[0] <= 0.0 else exp(mul(exponent, log((a[0], a[0]))))
    high = at_zero if a[1] <= 0.0 else exp(mul(exponent, log((a[1], a[1]))))
    good = holds(a) & holds(exponent) & (a[1] >= 0.0)
    return or_empty(good, min(low[0], high[0]), max(low[1], high[1]))
