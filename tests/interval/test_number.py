"""The interval as a number: its operators against exact rationals, in Python and in compiled code."""

import operator
from fractions import Fraction

import numpy as np
import pytest

import limitsets.numbers.interval as iv
from limitsets.numbers.interval import Interval
from limitsets.numbers.interval.number import (
    larger,
    signed_square,
    smaller,
    square_root,
    where_positive,
    with_sign_of,
)
from limitsets.numbers.jit import formula, proof_kernel

ENDS = (-3.0, -1.1, -(2.0**-30), 0.0, 0.3, 1.0, 2.7)
SOME = [Interval(lo, hi) for lo in ENDS for hi in ENDS if lo <= hi]


def points(x):
    """Ends and two points between, exactly."""
    lo, hi = Fraction(x.lo), Fraction(x.hi)
    return [lo, lo + (hi - lo) / 3, lo + (hi - lo) * 2 / 3, hi]


def holds(x, value):
    return Fraction(x.lo) <= value <= Fraction(x.hi)


@pytest.mark.parametrize("name", ["add", "sub", "mul", "truediv"])
def test_an_operator_holds_the_exact_results(name):
    exact = getattr(operator, name)
    for x in SOME:
        for y in SOME:
            if name == "truediv" and y.lo <= 0.0 <= y.hi:
                continue
            found = exact(x, y)
            assert all(holds(found, exact(p, q)) for p in points(x) for q in points(y))
            assert holds(exact(2.5, y), exact(Fraction(5, 2), points(y)[1]))
            assert holds(exact(x, 2.5), exact(points(x)[1], Fraction(5, 2)))


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


def test_python_and_compiled_code_agree_with_the_kernels_of_pairs():
    x, y = Interval(-1.1, 2.7), Interval(0.3, 1.0)
    for name, pairs in (("add", iv.add), ("sub", iv.sub), ("mul", iv.mul), ("truediv", iv.div)):
        found = getattr(operator, name)(x, y)
        assert (found.lo, found.hi) == pairs((x.lo, x.hi), (y.lo, y.hi))
    assert iv.power((-1.1, 2.7), 2) == iv.sqr((-1.1, 2.7))
    assert abs(x) == Interval(0.0, 2.7)
    assert -x == Interval(-2.7, 1.1)
