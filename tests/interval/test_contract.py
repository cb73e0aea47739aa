"""The contract of the intervals for every operand: infinite, nan and empty ones, against exact arithmetic.

The oracle is apart from the package: the numbers of an interval are sampled as rationals (the ends that are finite, and
what lies between and beyond), and each exact result has to lie in the interval found.  An infinite end is approached
by rationals far beyond the largest double.
"""

import itertools
import math
import sys
from fractions import Fraction

import flint
import pytest
from hypothesis import given, strategies as st

from limitsets import interval
from limitsets.numbers.interval import exponential as logarithm
from limitsets.numbers.jit import proof_kernel, take_mark
from tests.interval.exact import root_bounds

INF, NAN = math.inf, math.nan
LARGEST, TINY = sys.float_info.max, math.ulp(0.0)
ENDS = [-INF, -LARGEST, -1.0, -TINY, -0.0, 0.0, TINY, 1.0, LARGEST, INF, NAN]
PAIRS = list(itertools.product(ENDS, ENDS))
# Twice the same infinity holds no real number.
INTERVALS = [(a, b) for a, b in PAIRS if a <= b and not (math.isinf(a) and a == b)]
BROKEN = [pair for pair in PAIRS if math.isnan(pair[0]) or math.isnan(pair[1])]
BEYOND = Fraction(LARGEST) ** 4

UNARY = ["neg", "absolute", "sqr", "sqrt", "log", "exp", "sin", "cos"]
BINARY = ["add", "sub", "mul", "div", "minimum", "maximum", "hull", "atan2"]


def is_empty(a):
    return math.isnan(a[0]) and math.isnan(a[1])


def numbers(a):
    """Rationals of an interval: its ends, points between, and points beyond all doubles towards an infinite end."""
    lo = -BEYOND if a[0] == -INF else Fraction(a[0])
    hi = BEYOND if a[1] == INF else Fraction(a[1])
    inside = [Fraction(x) for x in ENDS if math.isfinite(x) and lo <= Fraction(x) <= hi]
    return {lo, hi, (lo + hi) / 2, *inside}


def holds(a, x):
    """Whether a rational lies in an interval of doubles."""
    return (a[0] == -INF or Fraction(a[0]) <= x) and (a[1] == INF or x <= Fraction(a[1]))


def is_interval(a):
    return a[0] <= a[1] and a[0] < INF and a[1] > -INF


EXACT = {
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y if y else None,
    "minimum": min,
    "maximum": max,
}


@pytest.mark.parametrize("name", EXACT)
def test_two_intervals_against_rationals(name):
    for a, b in itertools.product(INTERVALS, INTERVALS):
        got = getattr(interval, name)(a, b)
        assert is_interval(got), (a, b, got)
        for x, y in itertools.product(numbers(a), numbers(b)):
            value = EXACT[name](x, y)
            assert value is None or holds(got, value), (a, b, got, x, y)


def test_hull_holds_both():
    for a, b in itertools.product(INTERVALS, INTERVALS):
        assert interval.hull(a, b) == (min(a[0], b[0]), max(a[1], b[1]))


def far(x):
    """A ball around a rational."""
    return flint.arb(flint.fmpq(x.numerator, x.denominator))


def test_one_interval_against_rationals_and_arb():
    with flint.ctx.workprec(300):
        for a in INTERVALS:
            values = numbers(a)
            assert interval.neg(a) == (-a[1], -a[0])
            assert all(holds(interval.absolute(a), abs(x)) for x in values)
            assert all(holds(interval.sqr(a), x * x) for x in values)
            root, logarithm = interval.sqrt(a), interval.log(a)
            assert is_interval(root) if a[1] >= 0.0 else is_empty(root)
            assert is_interval(logarithm) if a[1] > 0.0 else is_empty(logarithm)
            for x in values:
                if x >= 0:
                    low, high = root_bounds(x, 700)
                    assert holds(root, high) or holds(root, low), (a, root)
                if x > 0:
                    ball = far(x).log()
                    assert not ball < flint.arb(logarithm[0]), (a, logarithm)
                    assert not ball > flint.arb(logarithm[1]), (a, logarithm)
            for name in ("exp", "sin", "cos"):
                got = getattr(interval, name)(a)
                assert is_interval(got)
                for x in values:
                    if name == "exp" and abs(x) > 10**4:  # beyond all doubles, or below the smallest
                        assert got[1] == INF if x > 0 else got[0] == 0.0
                    elif abs(x) < 10**400:
                        with flint.ctx.workprec(1500):
                            ball = getattr(far(x), name)()
                        assert not ball < flint.arb(got[0]), (name, a, got)
                        assert math.isinf(got[1]) or not ball > flint.arb(got[1]), (name, a, got)


def test_angles_of_every_box_against_arb():
    with flint.ctx.workprec(300):
        for y, x in itertools.product(INTERVALS, INTERVALS):
            got = interval.atan2(y, x)
            assert is_interval(got)
            for v, u in itertools.product(numbers(y), numbers(x)):
                if u or v:
                    ball = flint.arb.atan2(far(v), far(u))
                    assert not ball < flint.arb(got[0]), (y, x, got)
                    assert not ball > flint.arb(got[1]), (y, x, got)


@pytest.mark.parametrize("name", UNARY)
def test_the_empty_set_gives_the_empty_set(name):
    for a in BROKEN:
        assert is_empty(getattr(interval, name)(a)), a


@pytest.mark.parametrize("name", BINARY)
def test_the_empty_set_and_another(name):
    for broken, other in itertools.product(BROKEN, INTERVALS):
        for got in (getattr(interval, name)(broken, other), getattr(interval, name)(other, broken)):
            assert got == other if name == "hull" else is_empty(got), (broken, other, got)
    for a, b in itertools.product(BROKEN, BROKEN):
        assert is_empty(getattr(interval, name)(a, b))


def test_half_a_nan_never_occurs():
    """Whatever pair is given, also one that is no interval."""
    for a in PAIRS:
        for name in UNARY:
            got = getattr(interval, name)(a)
            assert math.isnan(got[0]) == math.isnan(got[1]), (name, a, got)
        for b in PAIRS:
            for name in BINARY:
                got = getattr(interval, name)(a, b)
                assert math.isnan(got[0]) == math.isnan(got[1]), (name, a, b, got)


def test_nothing_is_lost():
    """What was wrong: each of these gave nan, or a bound on one side of the truth."""
    assert interval.mul(interval.exp((0.0, 800.0)), (0.0, 1.0))[1] == INF
    got = interval.mul(interval.sqr(interval.div((1.0, 1.0), (-1.0, 1.0))), (0.0, 8.0))
    assert got[1] == INF
    assert -1e-300 < got[0] <= 0.0
    quarter = interval.atan2((0.0, INF), (1.0, INF))
    assert -1e-12 < quarter[0] <= 0.0
    assert math.pi / 2 <= quarter[1] < 1.5707963267950
    assert interval.add((LARGEST, LARGEST), (LARGEST, LARGEST))[0] > 1e308


def test_zero_times_an_infinite_end_is_zero():
    for b in ((-INF, INF), (0.0, INF), (1.0, INF), (-INF, -1.0)):
        for got in (interval.mul((0.0, 0.0), b), interval.mul(b, (0.0, 0.0))):
            assert max(map(abs, got)) < 1e-320


def test_sums_of_zeros_are_zero():
    """So that the root of a sum of squares is defined where both are 0."""
    assert interval.add((0.0, 0.0), (0.0, TINY)) == (0.0, TINY)
    assert interval.sub((TINY, 1.0), (TINY, TINY))[0] == 0.0


@proof_kernel(entry=True)
def _marks(name, a, b):
    take_mark()
    if name == 0:
        interval.sqrt((a, b))
    elif name == 1:
        interval.log((a, b))
    elif name == 2:
        interval.sin((a, b))
    elif name == 3:
        interval.cos((a, b))
    else:
        interval.sqr(interval.exp(interval.div((1.0, 1.0), (a, b))))
    return take_mark()


@pytest.mark.parametrize(
    ("name", "marked", "unmarked"),
    [
        (0, [(-1.0, 4.0), (-TINY, 0.0), (-INF, INF), (-2.0, -1.0)], [(0.0, 4.0), (-0.0, INF), (1.0, 2.0)]),
        (1, [(0.0, 1.0), (-1.0, 1.0), (-0.0, INF)], [(TINY, INF), (1.0, 2.0)]),
        (2, [(0.0, INF), (-INF, 0.0), (-INF, INF)], [(-LARGEST, LARGEST), (0.0, 1.0)]),
        (3, [(0.0, INF), (-INF, 0.0), (-INF, INF)], [(-LARGEST, LARGEST), (0.0, 1.0)]),
        (4, [], [(-1.0, 1.0), (0.0, 0.0), (1.0, INF)]),
    ],
)
def test_what_is_not_defined_everywhere_is_marked(name, marked, unmarked):
    assert all(_marks(name, *a) for a in marked)
    assert not any(_marks(name, *a) for a in unmarked)


def test_the_rest_of_the_series_of_the_logarithm():
    """The sum of q^j / (2 TERMS + 1 + 2 j) is at most 1 / ((2 TERMS + 1) (1 - q)); 0.7 <= m <= 1.4."""
    most = max(Fraction(7, 10) - 1, Fraction(14, 10) - 1, key=lambda s: abs(s / (s + 2)))
    q = (most / (most + 2)) ** 2
    assert q < Fraction(1, 25)
    assert 1 / ((2 * logarithm.TERMS + 1) * (1 - Fraction(1, 25))) <= Fraction(1, 24)
    assert Fraction(logarithm.REST) > Fraction(1, 24)
    terms = [Fraction(1, k * 2**k) for k in range(1, 160)]  # of ln 2; the rest is less than the last one
    assert Fraction(logarithm.LN2[0]) < sum(terms) < sum(terms) + terms[-1] < Fraction(logarithm.LN2[1])


@given(
    x=st.one_of(
        st.floats(0.0, exclude_min=True, allow_infinity=False),
        st.floats(0.5, 2.0),
        st.integers(1, 50).map(TINY.__mul__),
    )
)
def test_the_logarithm_of_one_number_against_arb(x):
    with flint.ctx.workprec(300):
        got, ball = interval.log((x, x)), flint.arb(x).log()
    assert flint.arb(got[0]) <= ball
    assert ball <= flint.arb(got[1])
    assert got[1] - got[0] <= 3e-14 * abs(got[0]) + 1e-320
