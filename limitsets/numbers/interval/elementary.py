"""Sine, cosine and the angle of a vector on closed intervals.

Sine and cosine of a double: x = n pi/2 + r by Cody and Waite's subtraction of pi/2 in three parts, then the Taylor
polynomials on |r| <= pi/4 (a hair more, for n is rounded).  For |x| <= `LARGEST` the result is within

    `RELATIVE` |sin x|   for n = 0,        `NEAR` otherwise,

of the exact value; a test proves both bounds in exact rationals from the coefficients as they are stored.  Beyond
`LARGEST` the answer is [-1, 1].
"""

from __future__ import annotations

import math

from limitsets.numbers.interval.arithmetic import Ends, holds, or_empty
from limitsets.numbers.interval.rounding import clamped, down, up
from limitsets.numbers.jit import mark_undefined, proof_kernel

LARGEST = 2.0**17
NEAR = 2.0**-50
RELATIVE = 2.0**-50

# pi/2 in three parts; the first two have 33 bits, so that n times either is exact for |n| < 2^20.
PARTS = (
    float.fromhex("0x1.921fb544p+0"),
    float.fromhex("0x1.0b4611a6p-34"),
    float.fromhex("0x1.3198a2e037073p-69"),
)
P1, P2, P3 = PARTS
TWO_OVER_PI = 2.0 / math.pi

# sin r = r + r q (S0 + q S1 + ...),  cos r = 1 + q (C0 + q C1 + ...),  q = r^2.
SINE = tuple((-1) ** (k + 1) / math.factorial(2 * k + 3) for k in range(7))
COSINE = tuple((-1) ** (k + 1) / math.factorial(2 * k + 2) for k in range(8))
S0, S1, S2, S3, S4, S5, S6 = SINE
C0, C1, C2, C3, C4, C5, C6, C7 = COSINE


@proof_kernel
def sin_cos(x: float) -> tuple[float, float, float]:
    """``(sin x, cos x, quarter turns taken off)``, each within the bounds of this module."""
    n = math.floor(x * TWO_OVER_PI + 0.5)
    r = ((x - n * P1) - n * P2) - n * P3
    q = r * r
    s = r + r * (q * (S0 + q * (S1 + q * (S2 + q * (S3 + q * (S4 + q * (S5 + q * S6)))))))
    c = 1.0 + q * (C0 + q * (C1 + q * (C2 + q * (C3 + q * (C4 + q * (C5 + q * (C6 + q * C7)))))))
    quarter = n - 4.0 * math.floor(0.25 * n)
    swap = (quarter == 1.0) | (quarter == 3.0)
    sine, cosine = c if swap else s, s if swap else c
    sine = -sine if quarter >= 2.0 else sine
    cosine = -cosine if (quarter == 1.0) | (quarter == 2.0) else cosine
    return sine, cosine, n


@proof_kernel
def _sine(x: float) -> Ends:
    """Enclosure of sin at one double, beyond the range at the end of it."""
    s, _, n = sin_cos(clamped(x, -LARGEST, LARGEST))
    error = RELATIVE * abs(s) if n == 0.0 else NEAR
    # Next to 0 the sine has the sign of x: an end that is 0 stays 0.
    least, most = 0.0 if (n == 0.0) & (x >= 0.0) else -1.0, 0.0 if (n == 0.0) & (x <= 0.0) else 1.0
    return max(down(s - error), least), min(up(s + error), most)


@proof_kernel
def _cosine(x: float) -> Ends:
    """Enclosure of cos at one double, beyond the range at the end of it."""
    _, c, _ = sin_cos(clamped(x, -LARGEST, LARGEST))
    return max(down(c - NEAR), -1.0), min(up(c + NEAR), 1.0)


@proof_kernel
def _meets(lo: float, hi: float, offset: float) -> bool:
    """Whether [lo, hi] may hold a number ``(offset + 4 k) pi/2``; never False where it does.

    In units of pi/2 the ends are widened by far more than their rounding: 2^-30 against |x| 2^-51 < 2^-33.
    """
    a = (lo * TWO_OVER_PI - offset) * 0.25 - 2.0**-30
    b = (hi * TWO_OVER_PI - offset) * 0.25 + 2.0**-30
    return math.floor(b) >= math.ceil(a)


@proof_kernel
def _waves(a: Ends, u: Ends, v: Ends, bottom: float, top: float) -> Ends:
    """Range of sine or cosine, whose values at the ends are u and v, lowest and highest at that many quarter turns."""
    far = (a[0] < -LARGEST) | (a[1] > LARGEST)
    # A sine of an infinite end is a nan in plain numbers, so that what leads here is not defined on all of the cell.
    mark_undefined((a[0] == -math.inf) | (a[1] == math.inf))
    x, y = clamped(a[0], -LARGEST, LARGEST), clamped(a[1], -LARGEST, LARGEST)
    lo = -1.0 if far | _meets(x, y, bottom) else min(u[0], v[0])
    hi = 1.0 if far | _meets(x, y, top) else max(u[1], v[1])
    return or_empty(holds(a), lo, hi)


@proof_kernel
def sin(a: Ends) -> Ends:
    """Sine of an interval."""
    return _waves(a, _sine(a[0]), _sine(a[1]), 3.0, 1.0)


@proof_kernel
def cos(a: Ends) -> Ends:
    """Cosine of an interval."""
    return _waves(a, _cosine(a[0]), _cosine(a[1]), 2.0, 0.0)


PI_ABOVE = math.nextafter(math.pi, 4.0)


@proof_kernel
def _not_beyond(angle: float, y: float, x: float) -> bool:
    """Whether `angle` is proved to be at most the angle of (x, y), for the two less than pi/2 apart."""
    s, c, _ = sin_cos(angle)
    # y cos - x sin = |(x, y)| sin(angle of (x, y) - angle), in which each term is known to a relative 2^-48 of |.|
    size = abs(x) + abs(y)
    across = y * c - x * s
    along = x * c + y * s
    slack = 2.0**-47 * size + 2.0**-1060
    return (across > slack) & (along > slack)


@proof_kernel
def _angle(y: float, x: float) -> Ends:
    """Enclosure of the angle of one vector of finite size: libm proposes, signs of sines decide.

    Very large and very small vectors are scaled by a power of two; the candidates are 2^-44 to either side, far above
    libm's error and the slack.
    """
    size = max(abs(x), abs(y))
    scale = 2.0**560 if size < 2.0**-500 else (2.0**-560 if size > 2.0**500 else 1.0)
    u, v = x * scale, y * scale
    guess = math.atan2(v, u)
    lo, hi = guess - 2.0**-44, guess + 2.0**-44
    low = _not_beyond(lo, v, u)
    high = _not_beyond(-hi, -v, u)
    return max(lo, -PI_ABOVE) if low else -PI_ABOVE, min(hi, PI_ABOVE) if high else PI_ABOVE


@proof_kernel
def _angles(y: float, x: float) -> Ends:
    """Angles at one corner of a box.  Where a coordinate is infinite the vectors turn to its axis, or to both axes."""
    tall, long = abs(y) == math.inf, abs(x) == math.inf
    up_or_down = _angle(math.copysign(1.0, y), 0.0)
    left_or_right = _angle(math.copysign(0.0, y), math.copysign(1.0, x))
    plain = _angle(0.0 if tall else y, 1.0 if long else x)
    one = up_or_down if tall else (left_or_right if long else plain)
    two = left_or_right if long else one
    return min(one[0], two[0]), max(one[1], two[1])


@proof_kernel
def atan2(y: Ends, x: Ends) -> Ends:
    """Angle of the vectors of a box, in (-pi, pi]; everything where the box holds the origin or meets the cut."""
    everything = (y[0] <= 0.0) & (y[1] >= 0.0) & (x[0] <= 0.0)
    # Away from the origin the angle is monotone along each border of the box, so the corners span it.
    p, q = _angles(y[0], x[0]), _angles(y[0], x[1])
    r, s = _angles(y[1], x[0]), _angles(y[1], x[1])
    lo = -PI_ABOVE if everything else min(min(p[0], q[0]), min(r[0], s[0]))
    hi = PI_ABOVE if everything else max(max(p[1], q[1]), max(r[1], s[1]))
    return or_empty(holds(y) & holds(x), lo, hi)
