"""Arrays of intervals: against exact rationals."""

import math
from fractions import Fraction

import numpy as np
import pytest

from limitsets.proofs.prover.numbers import Intervals

# ------------------------------------------------------------------------------------------------- the intervals

ENDS = [0.0, -0.0, 5e-324, -5e-324, 1e-310, 1e-160, -1e-160, 0.1, 1.0, -1.0, 3.0, -7.3, 1e10, -1e154]
ENDS += [1.7e308, -1.7e308]


def some_intervals(random, count):
    """Intervals of all signs and sizes, zeros, points and subnormal ends among them."""
    sizes = np.where(random.random((2, count)) < 0.3, random.choice(ENDS, (2, count)), 0.0)
    plain = random.normal(size=(2, count)) * 10.0 ** random.integers(-5, 5, (2, count))
    ends = np.where(random.random((2, count)) < 0.7, plain, sizes)
    ends[1] = np.where(random.random(count) < 0.2, ends[0], ends[1])
    return Intervals(ends.min(axis=0), ends.max(axis=0))


def members(random, x, k):
    """Exact numbers of one of them: its ends, and one between."""
    lo, hi = Fraction(float(x.lo[k])), Fraction(float(x.hi[k]))
    return lo, hi, lo + (hi - lo) * Fraction(int(random.integers(0, 1 << 30)), 1 << 30)


def holds(found, k, exact):
    lo, hi = float(found.lo[k]), float(found.hi[k])
    below = lo == -math.inf or (math.isfinite(lo) and Fraction(lo) <= exact)
    return below and (hi == math.inf or (math.isfinite(hi) and exact <= Fraction(hi)))


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_every_operation_holds_the_exact_results():
    random = np.random.default_rng(0)
    x, y = (some_intervals(random, 1500) for _ in range(2))
    two = {
        "+": (x + y, lambda a, b: a + b),
        "-": (x - y, lambda a, b: a - b),
        "*": (x * y, lambda a, b: a * b),
        "/": (x / y, lambda a, b: a / b),
    }
    one = {
        "negative": (-x, lambda a: -a),
        "square": (x.square(), lambda a: a * a),
        "absolute": (x.absolute(), abs),
        "float": (3.5 - x * 0.1, lambda a: Fraction(3.5) - a * Fraction(0.1)),
        "int": (2 * x + 1, lambda a: 2 * a + 1),
    }
    looked = dict.fromkeys([*two, *one], 0)
    for k in range(x.lo.size):
        of_x, of_y = members(random, x, k), members(random, y, k)
        for name, (found, plain) in two.items():
            if math.isnan(found.lo[k]) or math.isnan(found.hi[k]):
                continue
            assert all(holds(found, k, plain(a, b)) for a in of_x for b in of_y), (name, k)
            looked[name] += 1
        for name, (found, plain) in one.items():
            assert all(holds(found, k, plain(a)) for a in of_x), (name, k)
            looked[name] += 1
    assert min(looked.values()) > 400


def test_results_are_hardly_wider_than_the_exact_ones():
    """Else `holds` would be satisfied by anything."""
    random = np.random.default_rng(1)
    at = random.uniform(0.5, 2.0, (2, 200))
    x, y = (Intervals(each, each) for each in at)
    for found in (x + y, x - y, x * y, x / y, x.square(), x.square_root(), x.absolute()):
        assert (found.hi - found.lo < 1e-14).all()


def test_square_roots():
    random = np.random.default_rng(2)
    lo = 10.0 ** random.uniform(-300, 300, 300)
    x = Intervals(lo, lo * random.uniform(1.0, 3.0, 300))
    found = x.square_root()
    for k in range(300):
        assert 0 <= Fraction(float(found.lo[k])) ** 2 <= Fraction(float(x.lo[k]))
        assert Fraction(float(found.hi[k])) ** 2 >= Fraction(float(x.hi[k]))


@pytest.mark.parametrize("ends", [(0.0, 1.0), (-1.0, 4.0), (-2.0, -1.0), (-1.0, 0.0), (0.0, 0.0)])
def test_what_is_impossible_is_nan_and_every_comparison_with_it_is_false(ends):
    wrong = [Intervals.of(*ends).square_root()]
    if ends[0] <= 0.0 <= ends[1]:
        wrong += [1.0 / Intervals.of(*ends), Intervals.of(1.0, 2.0) / Intervals.of(*ends)]
    for bad in wrong:
        for found in (bad, -bad, bad + 1.0, 2 * bad, bad.square(), bad.absolute(), bad * 0.0, 0.0 / bad):
            assert np.isnan(found.lo).all()
            assert np.isnan(found.hi).all()
            assert not (found.hi <= math.inf).any()
            assert not (found.lo >= -math.inf).any()
