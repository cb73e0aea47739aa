"""The error bound of our own sine and cosine, proved in exact rationals from the numbers as they are stored.

Three errors: the polynomial against the function (Taylor's remainder, and coefficients rounded to doubles), rounding in
its evaluation, and the reduction of the argument.  u = 2^-53 is the unit of rounding; the bounds hold in rounding to
nearest.  All of it is arithmetic on `Fraction`, with |r| <= R, the largest reduced argument.
"""

import math
from fractions import Fraction

import flint

from limitsets.numbers.interval import elementary as e

U = Fraction(1, 2**53)


def pi_bounds():
    """Rational bounds of pi from Machin's formula."""

    def arctan_inverse(n, terms):
        parts = [Fraction((-1) ** k, (2 * k + 1) * n ** (2 * k + 1)) for k in range(terms)]
        total = sum(parts)
        return total - abs(parts[-1]), total + abs(parts[-1])

    five, far = arctan_inverse(5, 60), arctan_inverse(239, 20)
    return 16 * five[0] - 4 * far[1], 16 * five[1] - 4 * far[0]


PI = pi_bounds()
N = math.ceil(e.LARGEST * 2 / 3.14)  # quarter turns taken off, at most


def largest_reduced():
    """|x 2/pi - n| <= 1/2 up to rounding: of 2/pi, the product, and the sum with 1/2, each relative u of N + 1."""
    slack = (N + 2) * 4 * U
    return PI[1] / 2 * (Fraction(1, 2) + slack)


R = largest_reduced()
Q = R * R * (1 + 2 * U)


def test_pi_is_bounded_tightly():
    assert PI[0] < PI[1]
    assert PI[1] - PI[0] < Fraction(1, 10**30)
    assert PI[0] < Fraction(math.pi) + U * 4
    assert Fraction(math.pi) < PI[1]


def test_the_parts_of_the_reduction_are_exact_in_products():
    for part in e.PARTS[:2]:
        mantissa = abs(Fraction(part)).numerator
        assert mantissa.bit_length() <= 34
        assert (mantissa * N).bit_length() <= 53


def reduction_error():
    """|r computed - (x - n pi/2)| for n != 0.

    x - n P1 is exact: both are multiples of 2^-53 or coarser and the difference is below 1.  The next two differences
    are below 1 and round by u/2 each at most ( |.| < 1 ), n P3 rounds by u |n P3|, and the parts miss pi/2 by a little.
    """
    p1, p2, p3 = map(Fraction, e.PARTS)
    missing = max(abs(PI[0] / 2 - p1 - p2 - p3), abs(PI[1] / 2 - p1 - p2 - p3))
    return N * missing + U * N * abs(p3) + 2 * U / 2


def test_the_difference_to_the_first_part_is_exact():
    """For n != 0, |x| >= pi/4 (1 - small) > 1/2, so x is a multiple of 2^-53, as n P1 is; |x - n P1| < 1."""
    p1 = Fraction(e.PARTS[0])
    assert (p1 * 2**53).denominator == 1
    assert R + N * (PI[1] / 2 - p1) < 1
    assert PI[0] / 4 * (1 - 8 * U) > Fraction(1, 2)


def rounded_horner(coefficients):
    """Bounds of the size and of the rounding error of Horner's scheme in q on [0, Q]."""
    size, error = abs(Fraction(coefficients[-1])), Fraction(0)
    for c in reversed(coefficients[:-1]):
        product = size * Q * (1 + U)
        error = error * Q * (1 + U) + U * size * Q + size * 2 * U * Q  # also q itself is known to 2 u
        size = product + abs(Fraction(c))
        error = error * (1 + U) + U * size
    return size, error


def coefficient_error(coefficients, exact):
    return sum(abs(Fraction(c) - x) * Q**k for k, (c, x) in enumerate(zip(coefficients, exact, strict=True)))


def exact_sine():
    return [Fraction((-1) ** (k + 1), math.factorial(2 * k + 3)) for k in range(len(e.SINE))]


def exact_cosine():
    return [Fraction((-1) ** (k + 1), math.factorial(2 * k + 2)) for k in range(len(e.COSINE))]


def sine_error_relative_to_r():
    """|computed - sin r| / |r| for the polynomial r + r (q h(q))."""
    size, rounding = rounded_horner(e.SINE)
    h = rounding + coefficient_error(e.SINE, exact_sine())
    remainder = Q ** len(e.SINE) / math.factorial(2 * len(e.SINE) + 3)
    inner = Q * (h + remainder) + U * Q * size + 2 * U * Q * size  # q h rounds; q is known to 2 u
    inner = inner + U * Q * size  # r (q h) rounds
    return inner + U * (1 + Q * size + inner)  # and the last sum


def cosine_error():
    size, rounding = rounded_horner(e.COSINE)
    h = rounding + coefficient_error(e.COSINE, exact_cosine())
    remainder = Q ** len(e.COSINE) / math.factorial(2 * len(e.COSINE) + 2)
    inner = Q * (h + remainder) + 3 * U * Q * size
    return inner + U * (1 + inner)


def test_the_bound_for_arguments_that_are_not_reduced():
    """sin r >= r (1 - Q/6) turns the error relative to r into one relative to the computed sine."""
    relative = sine_error_relative_to_r()
    of_computed = relative / (1 - Q / 6 - relative)
    assert of_computed < Fraction(e.RELATIVE) / 2
    assert cosine_error() < Fraction(e.NEAR) / 2


def test_the_bound_for_reduced_arguments():
    reduction = reduction_error()
    assert R * sine_error_relative_to_r() + reduction < Fraction(e.NEAR) / 2
    assert cosine_error() + reduction < Fraction(e.NEAR) / 2


def test_the_bound_is_met_where_it_is_worst():
    """Near multiples of pi/2 and at the ends of the range, against Arb."""
    flint.ctx.prec = 200
    try:
        worst = 0.0
        for n in [1, 2, 3, 4, 5, 1000, 83442, -7, -83441]:
            for step in range(-30, 31):
                x = math.nextafter(n * math.pi / 2, math.inf) + step * math.ulp(n * math.pi / 2)
                if abs(x) <= e.LARGEST:
                    s, c, _ = e.sin_cos(x)
                    worst = max(worst, float(abs(flint.arb(x).sin() - s)), float(abs(flint.arb(x).cos() - c)))
        assert worst < e.NEAR / 2
    finally:
        flint.ctx.prec = 53
