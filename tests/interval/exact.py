"""Exact oracles: rationals for the four operations and roots, Arb and MPFR for sines and angles."""

from fractions import Fraction
from math import isqrt

import flint


def rational(x):
    return Fraction(x)


def arb(x):
    """A double as an exact ball."""
    return flint.arb(float(x))


def root_bounds(x: Fraction, bits: int = 200) -> tuple[Fraction, Fraction]:
    """Rationals around the square root of a rational >= 0."""
    scale = 1 << (2 * bits)
    below = isqrt(int(x * scale * scale))
    return Fraction(below, scale), Fraction(below + 1, scale)


def inside(ball, interval) -> bool:
    """Whether a ball lies in an interval of doubles, or overlaps its border by less than its own radius."""
    lo, hi = interval
    return not (ball < arb(lo)) and not (ball > arb(hi))
