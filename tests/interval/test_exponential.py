"""The error bound of our own exponential, proved in exact rationals from the numbers as they are stored.

Three errors: the reduction of the argument, the polynomial against the function (Taylor's remainder, and coefficients
rounded to doubles), and rounding in its evaluation.  U = 2^-52 bounds the relative rounding error of one operation in
every rounding direction.
"""

import math
from fractions import Fraction

import flint
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limitsets import interval
from limitsets.numbers.interval import exponential as e
from limitsets.numbers.jit import proof_kernel
from tests.interval.exact import arb

U = Fraction(1, 2**52)
L1, L2 = map(Fraction, e.PARTS)


def ln2_bounds():
    """ln 2 = sum 1 / (k 2^k); the terms left out sum to less than the last one kept."""
    parts = [Fraction(1, k * 2**k) for k in range(1, 160)]
    return sum(parts), sum(parts) + parts[-1]


LN2 = ln2_bounds()
N = math.ceil(e.LARGEST / 0.69) + 1


def largest_reduced():
    """|x / ln 2 - n| <= 1/2 up to rounding: of 1 / ln 2 (libm, hence 8 U), the product, and the sum with 1/2."""
    assert abs(Fraction(e.PER_LN2) * LN2[0] - 1) < 8 * U
    return LN2[1] * (Fraction(1, 2) + (N + 2) * 16 * U) + reduction_error()


def reduction_error():
    """|r computed - (x - n ln 2)|.

    x - n L1 is exact (below); n L2 rounds by U of itself, the last difference is below 1/2 and rounds by its
    unit in the last place, U/4, at most, and the parts miss ln 2 by a little.
    """
    missing = max(abs(LN2[0] - L1 - L2), abs(LN2[1] - L1 - L2))
    return N * missing + U * N * L2 + U / 4


R = largest_reduced()


def test_ln2_is_bounded_tightly():
    assert 0 < LN2[1] - LN2[0] < Fraction(1, 10**45)
    assert abs(Fraction(math.log(2.0)) - LN2[0]) < U


def test_the_difference_to_the_first_part_is_exact():
    """n L1 has 53 bits.  For n != 0, |x| > 1/4, so x is a multiple of 2^-54, as n L1 is, and so is the difference,
    which is below 1/2 and so has 53 bits at most; for n = 0 it is x."""
    assert (L1.numerator * N).bit_length() <= 53
    assert (L1 * 2**54).denominator == 1
    assert LN2[0] * (Fraction(1, 2) - (N + 2) * 16 * U) > Fraction(1, 4)
    assert R + N * abs(LN2[1] - L1) + 2 * U < Fraction(1, 2)


def test_the_scaled_result_stays_in_the_normal_range():
    """The sum is between 1/2 and 2 and n between -1021 and 1022, so that the product only moves the exponent."""
    assert Fraction(2, 5) > R  # exp(+-2/5) is in (0.67, 1.5)
    assert math.floor(-e.LARGEST * e.PER_LN2) - 1 >= -1021
    assert math.ceil(e.LARGEST * e.PER_LN2) + 1 <= 1022


@pytest.mark.parametrize(
    ("unit", "allowed"), [(U / 2, e.RELATIVE / 2), (U, e.RELATIVE)], ids=["nearest", "any"]
)
def test_the_bound(unit, allowed):
    # Horner's scheme: size and rounding error of the tail.
    exact = [Fraction(1, math.factorial(k)) for k in range(2, 2 + len(e.COEFFICIENTS))]
    stored = [Fraction(c) for c in e.COEFFICIENTS]
    size, error = stored[-1], Fraction(0)
    for c in reversed(stored[:-1]):
        product = size * R
        error = error * R * (1 + unit) + unit * product
        size = product + c
        error = error * (1 + unit) + unit * size
    error += sum(abs(a - b) * R**k for k, (a, b) in enumerate(zip(stored, exact, strict=True)))
    # Taylor's remainder over r^2: the first term left out times a geometric series.
    last = len(exact) + 2
    error += R ** (last - 2) / math.factorial(last) / (1 - R / (last + 1))
    # r r tail: two products; then r + it, then 1 + that.
    top = R * R * (size + error)
    error = R * R * error + top * ((1 + unit) ** 2 - 1)
    inner = R + top * (1 + unit) ** 2
    error += unit * inner
    # Relative to exp r >= 1 - R; the last sum rounds relative to itself; exp(r + d) = exp(r) (1 + 2 d) at most.
    relative = error / (1 - R)
    total = (1 + relative) * (1 + unit) * (1 + 2 * reduction_error()) - 1
    # `exp` widens by RELATIVE of the computed number.
    assert total / (1 - total) < Fraction(allowed)


def contains(got, x):
    ball = arb(x).exp()
    return ball > arb(got[0]) and ball < arb(got[1])


@given(x=st.one_of(st.floats(-700.0, 700.0), st.floats(-1.0, 1.0), st.floats(-1e-8, 1e-8)))
def test_exponential_against_arb(x):
    flint.ctx.prec = 200
    try:
        got = interval.exp((x, x))
        assert contains(got, x)
        assert got[1] - got[0] < 1e-14 * got[1]
    finally:
        flint.ctx.prec = 53


def test_near_the_changes_of_n():
    flint.ctx.prec = 200
    try:
        worst = 0.0
        for n in [*range(-6, 7), 500, 1009, -500, -1010]:
            middle = (n + 0.5) * math.log(2.0)
            for step in range(-20, 21):
                x = middle + step * math.ulp(middle)
                if abs(x) <= e.LARGEST:
                    assert contains(interval.exp((x, x)), x)
                    worst = max(worst, float(abs(arb(e.exponential(x)) / arb(x).exp() - 1)))
        assert worst < e.RELATIVE / 2
    finally:
        flint.ctx.prec = 53


@given(a=st.floats(-800.0, 800.0), b=st.floats(-800.0, 800.0), share=st.floats(0.0, 1.0))
def test_an_interval_holds_what_is_between(a, b, share):
    lo, hi = min(a, b), max(a, b)
    x = min(max(lo + share * (hi - lo), lo), hi)
    got = interval.exp((lo, hi))
    ball = arb(x).exp()
    assert not (ball < arb(got[0]))
    assert math.isinf(got[1]) or not (ball > arb(got[1]))


@pytest.mark.parametrize(("x", "want"), [(-701.0, (0.0, 1e-303)), (701.0, (1e304, math.inf))])
def test_beyond_the_range(x, want):
    lo, hi = interval.exp((x, x))
    assert (lo == want[0] and hi < want[1]) if x < 0 else (lo > 1e303 and hi == want[1])
    assert interval.exp((-1e300, 1e300)) == (0.0, math.inf)


def test_nan_rejects():
    assert not interval.contains(interval.exp((math.nan, math.nan)), 1.0)
    lo, hi = interval.exp((0.0, math.nan))
    assert not lo <= hi


@proof_kernel(entry=True)
def _loop(x, lo, hi):
    for k in range(x.size):
        lo[k], hi[k] = interval.exp((x[k], x[k]))


def test_no_fused_operation():
    x = np.linspace(-1.0, 1.0, 64)
    _loop(x, np.empty(64), np.empty(64))
    text = "".join(_loop.inspect_asm().values())
    assert "vfm" not in text
    assert "vfnm" not in text
