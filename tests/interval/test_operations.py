"""Every operation against exact rationals, Arb and MPFR: containment always, an excess of a few ulp."""

import math
from fractions import Fraction

import flint
import gmpy2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from limitsets import interval
from limitsets.numbers.jit import proof_kernel
from tests.interval.exact import arb, root_bounds

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
    "hull": None,
}


@pytest.mark.parametrize("name", ["add", "sub", "mul", "div", "minimum", "maximum"])
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


def test_subnormal_operands():
    tiny = (SMALL, 2 * SMALL)
    assert within(interval.add(tiny, tiny), Fraction(2 * SMALL), Fraction(4 * SMALL))
    product = interval.mul(tiny, (0.5, 0.5))
    assert within(product, Fraction(SMALL) / 2, Fraction(SMALL))
    assert interval.sqrt(tiny)[0] <= math.sqrt(SMALL) <= interval.sqrt(tiny)[1]


def test_nan_rejects():
    bad = (math.nan, math.nan)
    for got in (interval.add(bad, (1.0, 2.0)), interval.mul(bad, (1.0, 2.0)), interval.sqr(bad)):
        assert not interval.contains(got, 1.0)


@proof_kernel(entry=True)
def _loop(a, b, lo, hi):
    for k in range(a.size):
        lo[k], hi[k] = interval.mul((a[k], a[k]), interval.add((b[k], b[k]), (1.0, 1.0)))


def test_the_machine_code_of_a_proof_kernel_has_no_fused_operation():
    x = np.linspace(0.1, 1.0, 64)
    _loop(x, x, np.empty(64), np.empty(64))
    text = "".join(_loop.inspect_asm().values())
    assert "vmulpd" in text or "mulpd" in text or "vmulsd" in text or "mulsd" in text
    assert "vfm" not in text
    assert "vfnm" not in text
