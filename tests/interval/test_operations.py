"""Interval operations and functions against exact rationals."""

import itertools
import math
import operator
from fractions import Fraction

import flint
import gmpy2
import numpy as np
import pytest
from hypothesis import given, strategies as st

import limitsets.numbers.interval as iv
from limitsets import interval
from limitsets.numbers.interval import Interval, arithmetic, elementary as e_of_sine_bound, exponential as e
from limitsets.numbers.interval.number import (
    ends_of,
    larger,
    signed_square,
    smaller,
    square_root,
    where_positive,
    with_sign_of,
)
from limitsets.numbers.jit import formula, proof_kernel
from tests.interval.exact import arb, root_bounds

# ----------------------------------------------------------------
# Every operation against exact rationals, Arb and MPFR: containment always, an excess of a few ulp.


SMALL = 2.0**-1074
# Sizes from the smallest subnormal to 1e140, and plain numbers in between.
numbers = st.one_of(
    st.floats(-1e140, 1e140, allow_nan=False),
    st.floats(-100.0, 100.0),
    st.floats(-1e-300, 1e-300),
    st.integers(-40, 40).map(lambda k: k * SMALL),
    st.integers(-20, 20).map(float),
)


def intervals(values=numbers):
    return st.tuples(values, values).map(lambda pair: (min(pair), max(pair)))


def within(interval, lo: Fraction, hi: Fraction) -> bool:
    return Fraction(interval[0]) <= lo and hi <= Fraction(interval[1])


def excess_is_small(interval, lo: Fraction, hi: Fraction, ulps: float = 8.0) -> bool:
    slack = [abs(x) * Fraction(2.0**-52) * Fraction(ulps) + Fraction(SMALL) * 8 for x in (lo, hi)]
    return Fraction(interval[0]) >= lo - slack[0] and Fraction(interval[1]) <= hi + slack[1]


BINARY = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "minimum": min,
    "maximum": max,
}


@pytest.mark.parametrize("name", BINARY)
@given(a=intervals(), b=intervals())
def test_binary_operations_against_rationals(name, a, b):
    if name == "div":
        if b[0] <= 0.0 <= b[1]:
            assert interval.div(a, b) == (-math.inf, math.inf)
            return
        if min(abs(b[0]), abs(b[1])) < 1e-10 and max(abs(a[0]), abs(a[1])) > 1e100:
            return  # beyond the size of numbers the module speaks of
    got = getattr(interval, name)(a, b)
    corners = [BINARY[name](Fraction(x), Fraction(y)) for x in a for y in b]
    if max(abs(c) for c in corners) > Fraction(1e290):
        return
    assert within(got, min(corners), max(corners))
    assert excess_is_small(got, min(corners), max(corners))


@given(a=intervals())
def test_unary_operations_against_rationals(a):
    ends = [Fraction(x) for x in a]
    across = a[0] <= 0.0 <= a[1]
    assert interval.neg(a) == (-a[1], -a[0])
    smallest = Fraction(0) if across else min(abs(e) for e in ends)
    largest = max(abs(e) for e in ends)
    assert tuple(map(Fraction, interval.absolute(a))) == (smallest, largest)
    square = interval.sqr(a)
    assert within(square, smallest**2, largest**2)
    assert excess_is_small(square, smallest**2, largest**2)
    assert square[0] >= 0.0
    if a[1] >= 0.0:
        root = interval.sqrt(a)
        low, high = root_bounds(max(ends[0], Fraction(0)), 700)[0], root_bounds(ends[1], 700)[1]
        assert within(root, low, high)
        assert excess_is_small(root, low, high)
    else:
        assert math.isnan(interval.sqrt(a)[1])


@given(a=intervals())
def test_cube_roots_against_rationals(a):
    lo, hi = arithmetic.cbrt(a)
    for end, root, sign in ((a[0], lo, -1), (a[1], hi, 1)):
        assert math.isinf(root) or sign * (Fraction(root) ** 3 - Fraction(end)) >= 0
        if end == 0.0 or abs(end) > 1e-290:  # below, a cube in floats has no digits
            nearly = math.copysign(abs(end) ** (1.0 / 3.0), end)
            assert sign * (root - nearly) <= 2.0**-40 * abs(nearly)


def test_cube_roots_of_ends_that_are_infinite_or_none():
    assert arithmetic.cbrt((-math.inf, math.inf)) == (-math.inf, math.inf)
    assert all(math.isnan(end) for end in arithmetic.cbrt((math.nan, math.nan)))


reals = st.one_of(st.floats(-10.0, 10.0), st.floats(-131072.0, 131072.0), st.floats(-1e-8, 1e-8))


@pytest.mark.parametrize("name", ["sin", "cos"])
@given(a=intervals(reals), share=st.floats(0.0, 1.0))
def test_sine_and_cosine_against_arb_and_mpfr(name, a, share):
    got = getattr(interval, name)(a)
    for x in (a[0], a[1], min(max(a[0] + share * (a[1] - a[0]), a[0]), a[1])):
        ball = getattr(arb(x), name)()
        assert not (ball < arb(got[0]))
        assert not (ball > arb(got[1]))
        with gmpy2.context(precision=120):
            value = getattr(gmpy2, name)(gmpy2.mpfr(x))
            assert gmpy2.mpfr(got[0]) <= value <= gmpy2.mpfr(got[1])
    one = getattr(interval, name)((a[0], a[0]))
    assert one[1] - one[0] <= 2.0**-47
    if name == "sin" and 0.0 < abs(a[0]) < 0.7 and abs(a[0]) > 1e-300:
        assert one[1] - one[0] <= 2.0**-47 * abs(a[0])  # relative accuracy for small arguments


@pytest.mark.parametrize("k", range(-6, 7))
def test_extremes_inside_are_met(k):
    middle = k * math.pi / 2
    a = (middle - 0.01, middle + 0.01)
    sine, cosine = interval.sin(a), interval.cos(a)
    assert (sine if k % 2 else cosine)[(k % 4) < 2] == (1.0 if k % 4 < 2 else -1.0)


def test_beyond_the_reduction_nothing_is_claimed():
    assert interval.sin((1e6, 1e6)) == (-1.0, 1.0)
    assert interval.cos((-1e300, 1e300)) == (-1.0, 1.0)


@given(y=intervals(reals), x=intervals(reals), u=st.floats(0.0, 1.0), v=st.floats(0.0, 1.0))
def test_angles_against_arb(y, x, u, v):
    got = interval.atan2(y, x)
    b, a = y[0] + u * (y[1] - y[0]), x[0] + v * (x[1] - x[0])
    b, a = min(max(b, y[0]), y[1]), min(max(a, x[0]), x[1])
    if a == 0.0 and b == 0.0:
        return
    ball = flint.arb.atan2(arb(b), arb(a))
    assert not (ball < arb(got[0]))
    assert not (ball > arb(got[1]))
    narrow = interval.atan2((b, b), (a, a))
    if not (b == 0.0 and a <= 0.0) and max(abs(a), abs(b)) > 1e-290:
        assert narrow[1] - narrow[0] < 1e-12


@proof_kernel(entry=True)
def _loop(a, b, lo, hi):
    for k in range(a.size):
        lo[k], hi[k] = interval.mul((a[k], a[k]), interval.add((b[k], b[k]), (1.0, 1.0)))
        lo[k], hi[k] = interval.exp((lo[k], hi[k]))


def test_the_machine_code_of_a_proof_kernel_has_no_fused_operation():
    x = np.linspace(0.1, 1.0, 64)
    _loop(x, x, np.empty(64), np.empty(64))
    text = "".join(_loop.inspect_asm().values())
    assert "vmulpd" in text or "mulpd" in text or "vmulsd" in text or "mulsd" in text
    assert "vfm" not in text
    assert "vfnm" not in text


# ----------------------------------------------------------------
# The interval as a number: its operators against exact rationals, in Python and in compiled code.


ENDS = (-3.0, -1.1, -(2.0**-30), 0.0, 0.3, 1.0, 2.7)
SOME = [Interval(lo, hi) for lo in ENDS for hi in ENDS if lo <= hi]


def points(x):
    """Ends and two points between, exactly."""
    lo, hi = Fraction(x.lo), Fraction(x.hi)
    return [lo, lo + (hi - lo) / 3, lo + (hi - lo) * 2 / 3, hi]


def holds(x, value):
    return Fraction(x.lo) <= value <= Fraction(x.hi)


@pytest.mark.parametrize("name", ["add", "sub", "mul", "div"])
def test_an_operator_is_the_kernel_of_pairs(name):
    """To the bit, also beside a plain number; that the kernels hold the exact results is tested above."""
    operation = operator.truediv if name == "div" else getattr(operator, name)
    for a, b in [*itertools.product(SOME, [*SOME, 2.5]), *((2.5, x) for x in SOME)]:
        found = operation(a, b)
        assert (found.lo, found.hi) == getattr(iv, name)(ends_of(a), ends_of(b))


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5, -1, -2])
def test_a_power_holds_its_values_and_is_hardly_wider(count):
    for x in SOME:
        if count < 0 and x.lo <= 0.0 <= x.hi:
            continue
        found, values = x**count, [p**count for p in points(x)]
        values += [Fraction(0)] if x.lo < 0.0 < x.hi and count > 0 else []
        assert all(holds(found, value) for value in values)
        size = float(max(map(abs, values))) * 1e-14 + 1e-300
        assert found.lo >= float(min(values)) - size
        assert found.hi <= float(max(values)) + size


@pytest.mark.parametrize("ends", [(0.5, 0.5), (-0.3, 1.7), (2.5, 3.5), (-2.0, -0.25), (1.9, 2.0)])
def test_a_real_power_holds_its_values_and_is_hardly_wider(ends):
    """The extremes of x^b, which is monotone in x and in b, lie at the corners."""
    for x in (Interval(0.2, 0.7), Interval(0.9, 1.4), Interval(2.0, 2.0), Interval(1e-3, 30.0)):
        found = x ** Interval(*ends)
        values = [arb(p) ** arb(b) for p in (x.lo, x.hi) for b in ends]  # 53 bits: nearly exact
        assert not any(value < found.lo or value > found.hi for value in values)
        least, most = (float(end(map(float, values))) for end in (min, max))
        assert found.lo >= least * (1 - 1e-12)
        assert found.hi <= most * (1 + 1e-12)
    zero = Interval(0.0, 4.0) ** Interval(*ends)
    assert (zero.lo, zero.hi >= 4.0 ** ends[1]) == (0.0, True)
    assert (zero.hi < math.inf) == (ends[0] > 0.0)
    assert Interval(-2.0, 3.0) ** 2.0 == Interval(-2.0, 3.0) ** 2


@formula
def mixed(a, x, y):
    """One formula with everything in it."""
    near = signed_square(x) / (3.5 + a**2)
    return smaller(near + with_sign_of(x, abs(y)), larger(-x, y)) * 2.0 - square_root(a**2) / 7.0


@formula
def product(x, y):
    """Two forms of one number, of which the first needs y > 0."""
    return where_positive(y, x * abs(y), x * y)


@proof_kernel(entry=True)
def boxes(ends, out):
    for k in range(ends.shape[0]):
        x, y = Interval(ends[k, 0], ends[k, 1]), Interval(ends[k, 2], ends[k, 3])
        found = mixed(1.5, x, y) if ends[k, 4] > 0.0 else mixed(x, x, y)
        out[k, 0], out[k, 1] = found.lo, found.hi
        found = product(x, y)
        out[k, 2], out[k, 3] = found.lo, found.hi


def test_a_formula_written_once_holds_on_intervals_what_it_is_on_numbers():
    rng = np.random.default_rng(7)
    ends = np.sort(rng.uniform(-2.0, 2.0, (4000, 2, 2)), axis=2).reshape(-1, 4)
    ends = np.column_stack([ends, np.where(np.arange(len(ends)) % 2, 1.0, -1.0)])
    out = np.empty((len(ends), 4))
    boxes(ends, out)
    share = rng.random((len(ends), 2))
    for (a, b, c, d, plain), bounds, (s, t) in zip(ends.tolist(), out.tolist(), share.tolist(), strict=True):
        x, y = a + s * (b - a), c + t * (d - c)
        assert bounds[0] - 1e-15 <= mixed(1.5 if plain > 0.0 else x, x, y) <= bounds[1] + 1e-15
        assert bounds[2] - 1e-15 <= product(x, y) <= bounds[3] + 1e-15


def test_square_size_and_negative():
    x = Interval(-1.1, 2.7)
    assert iv.power((-1.1, 2.7), 2) == iv.sqr((-1.1, 2.7))
    assert abs(x) == Interval(0.0, 2.7)
    assert -x == Interval(-2.7, 1.1)


# ----------------------------------------------------------------
# The error bound of our own exponential, proved in exact rationals from the numbers as they are stored.
# Three errors: the reduction of the argument, the polynomial against the function (Taylor's remainder, and
# coefficients rounded to doubles), and rounding in its evaluation.  U = 2^-52 bounds the relative rounding error of
# one operation in every rounding direction.


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
    with flint.ctx.workprec(200):
        got = interval.exp((x, x))
        assert contains(got, x)
        assert got[1] - got[0] < 1e-14 * got[1]


def test_near_the_changes_of_n():
    with flint.ctx.workprec(200):
        worst = 0.0
        for n in [*range(-6, 7), 500, 1009, -500, -1010]:
            middle = (n + 0.5) * math.log(2.0)
            for step in range(-20, 21):
                x = middle + step * math.ulp(middle)
                if abs(x) <= e.LARGEST:
                    assert contains(interval.exp((x, x)), x)
                    worst = max(worst, float(abs(arb(e.exponential(x)) / arb(x).exp() - 1)))
        assert worst < e.RELATIVE / 2


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


# ----------------------------------------------------------------
# The error bound of our own sine and cosine, proved in exact rationals from the numbers as they are stored.
# Three errors: the polynomial against the function (Taylor's remainder, and coefficients rounded to doubles),
# rounding in its evaluation, and the reduction of the argument.  u = 2^-53 is the unit of rounding; the bounds hold
# in rounding to nearest.  All of it is arithmetic on `Fraction`, with |r| <= R, the largest reduced argument.


U_SINE = Fraction(1, 2**53)


def pi_bounds():
    """Rational bounds of pi from Machin's formula."""

    def arctan_inverse(n, terms):
        parts = [Fraction((-1) ** k, (2 * k + 1) * n ** (2 * k + 1)) for k in range(terms)]
        total = sum(parts)
        return total - abs(parts[-1]), total + abs(parts[-1])

    five, far = arctan_inverse(5, 60), arctan_inverse(239, 20)
    return 16 * five[0] - 4 * far[1], 16 * five[1] - 4 * far[0]


PI = pi_bounds()
N_SINE = math.ceil(e_of_sine_bound.LARGEST * 2 / 3.14)  # quarter turns taken off, at most


def largest_reduced_sine_bound():
    """|x 2/pi - n| <= 1/2 up to rounding: of 2/pi, the product, and the sum with 1/2, each relative u of N + 1."""
    slack = (N_SINE + 2) * 4 * U_SINE
    return PI[1] / 2 * (Fraction(1, 2) + slack)


R_SINE = largest_reduced_sine_bound()
Q = R_SINE * R_SINE * (1 + 2 * U_SINE)


def test_pi_is_bounded_tightly():
    assert PI[0] < PI[1]
    assert PI[1] - PI[0] < Fraction(1, 10**30)
    assert PI[0] < Fraction(math.pi) + U_SINE * 4
    assert Fraction(math.pi) < PI[1]


def test_the_parts_of_the_reduction_are_exact_in_products():
    for part in e_of_sine_bound.PARTS[:2]:
        mantissa = abs(Fraction(part)).numerator
        assert mantissa.bit_length() <= 34
        assert (mantissa * N_SINE).bit_length() <= 53


def reduction_error_sine_bound():
    """|r computed - (x - n pi/2)| for n != 0.

    x - n P1 is exact: both are multiples of 2^-53 or coarser and the difference is below 1.  The next two differences
    are below 1 and round by u/2 each at most ( |.| < 1 ), n P3 rounds by u |n P3|, and the parts miss pi/2 by a little.
    """
    p1, p2, p3 = map(Fraction, e_of_sine_bound.PARTS)
    missing = max(abs(PI[0] / 2 - p1 - p2 - p3), abs(PI[1] / 2 - p1 - p2 - p3))
    return N_SINE * missing + U_SINE * N_SINE * abs(p3) + 2 * U_SINE / 2


def test_the_difference_to_the_first_part_is_exact_of_sine_bound():
    """For n != 0, |x| >= pi/4 (1 - small) > 1/2, so x is a multiple of 2^-53, as n P1 is; |x - n P1| < 1."""
    p1 = Fraction(e_of_sine_bound.PARTS[0])
    assert (p1 * 2**53).denominator == 1
    assert R_SINE + N_SINE * (PI[1] / 2 - p1) < 1
    assert PI[0] / 4 * (1 - 8 * U_SINE) > Fraction(1, 2)


def rounded_horner(coefficients):
    """Bounds of the size and of the rounding error of Horner's scheme in q on [0, Q]."""
    size, error = abs(Fraction(coefficients[-1])), Fraction(0)
    for c in reversed(coefficients[:-1]):
        product = size * Q * (1 + U_SINE)
        error = error * Q * (1 + U_SINE) + 3 * U_SINE * size * Q  # q itself is known to 2 u
        size = product + abs(Fraction(c))
        error = error * (1 + U_SINE) + U_SINE * size
    return size, error


def coefficient_error(coefficients, exact):
    return sum(abs(Fraction(c) - x) * Q**k for k, (c, x) in enumerate(zip(coefficients, exact, strict=True)))


def series_error(coefficients, first):
    """Size of a series in q whose first term is 1 / first!, and the error of q h(q); q h rounds, q is known to 2 u."""
    size, rounding = rounded_horner(coefficients)
    exact = [Fraction((-1) ** (k + 1), math.factorial(2 * k + first)) for k in range(len(coefficients))]
    remainder = Q ** len(coefficients) / math.factorial(2 * len(coefficients) + first)
    return size, Q * (rounding + coefficient_error(coefficients, exact) + remainder) + 3 * U_SINE * Q * size


def sine_error_relative_to_r():
    """|computed - sin r| / |r| for the polynomial r + r (q h(q))."""
    size, inner = series_error(e_of_sine_bound.SINE, 3)
    inner = inner + U_SINE * Q * size  # r (q h) rounds
    return inner + U_SINE * (1 + Q * size + inner)  # and the last sum


def cosine_error():
    _, inner = series_error(e_of_sine_bound.COSINE, 2)
    return inner + U_SINE * (1 + inner)


def test_the_bound_for_arguments_that_are_not_reduced():
    """sin r >= r (1 - Q/6) turns the error relative to r into one relative to the computed sine."""
    relative = sine_error_relative_to_r()
    of_computed = relative / (1 - Q / 6 - relative)
    assert of_computed < Fraction(e_of_sine_bound.RELATIVE) / 2
    assert cosine_error() < Fraction(e_of_sine_bound.NEAR) / 2


def test_the_bound_for_reduced_arguments():
    reduction = reduction_error_sine_bound()
    assert R_SINE * sine_error_relative_to_r() + reduction < Fraction(e_of_sine_bound.NEAR) / 2
    assert cosine_error() + reduction < Fraction(e_of_sine_bound.NEAR) / 2


def test_the_bound_is_met_where_it_is_worst():
    """Near multiples of pi/2 and at the ends of the range, against Arb."""
    with flint.ctx.workprec(200):
        worst = 0.0
        for n in [1, 2, 3, 4, 5, 1000, 83442, -7, -83441]:
            for step in range(-30, 31):
                x = math.nextafter(n * math.pi / 2, math.inf) + step * math.ulp(n * math.pi / 2)
                if abs(x) <= e_of_sine_bound.LARGEST:
                    s, c, _ = e_of_sine_bound.sin_cos(x)
                    worst = max(worst, float(abs(flint.arb(x).sin() - s)), float(abs(flint.arb(x).cos() - c)))
        assert worst < e_of_sine_bound.NEAR / 2


def test_ends_at_0_stay_where_the_signs_of_the_operands_allow_nothing_beyond():
    """Exact zeros stay; a product that underflows keeps its sign only, and one of both signs keeps neither end."""
    tiny, zero = (0.0, 5e-324), (0.0, 0.0)
    assert iv.mul(zero, (-1.0, 1.0)) == zero == iv.div(zero, (-2.0, -1.0)) == iv.sin(zero)
    assert iv.mul((0.0, 0.5), (0.5, 1.0))[0] == 0.0 == iv.mul((-0.5, 0.0), (0.5, 1.0))[1]
    assert iv.mul((5e-324, 5e-324), tiny)[0] == 0.0 < iv.mul((5e-324, 5e-324), (5e-324, 1e-300))[1]
    lo, hi = iv.mul((-5e-324, 5e-324), (-5e-324, 5e-324))
    assert lo < 0.0 < hi
    assert iv.sin((0.0, 1e-3))[0] == 0.0 == iv.sin((-1e-3, 0.0))[1]
