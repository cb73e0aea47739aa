"""Exact oracles: rationals for the four operations and roots, Arb and MPFR for sines and angles."""

from fractions import Fraction
from math import isqrt

import flint


def arb(x):
    """A double as an exact ball."""
    return flint.arb(float(x))


def root_bounds(x: Fraction, bits: int = 200) -> tuple[Fraction, Fraction]:
    """Rationals around the square root of a rational >= 0."""
    scale = 1 << (2 * bits)
    below = isqrt(int(x * scale * scale))
    return Fraction(below, scale), Fraction(below + 1, scale)
