"""Stepping outward by arithmetic.

For a double y and any rounding direction, the exact result of one operation that gave y lies within one unit in the
last place of y, at most ``2^-52 |y|``, or ``2^-1074`` below the normal range.  ``3 * 2^-52 |y| + 3 * 2^-1074`` covers
that and the rounding of the step itself.  Where y overflowed the exact result lies beyond the largest double.
"""

from __future__ import annotations

import sys

from limitsets.jit import proof_kernel

RELATIVE = 3.0 * 2.0**-52
ABSOLUTE = 3.0 * 2.0**-1074
LARGEST = sys.float_info.max


@proof_kernel
def down(y: float) -> float:
    """Return a number below the exact result that was rounded to y, a finite one."""
    return y - (RELATIVE * abs(y) + ABSOLUTE)


@proof_kernel
def up(y: float) -> float:
    """Return a number above the exact result that was rounded to y, a finite one."""
    return y + (RELATIVE * abs(y) + ABSOLUTE)


@proof_kernel
def below(y: float) -> float:
    """As `down`, of any y: finite where y overflowed upward; -inf and nan stay."""
    return down(LARGEST if y > LARGEST else y)


@proof_kernel
def above(y: float) -> float:
    """As `up`, of any y: finite where y overflowed downward; inf and nan stay."""
    return up(-LARGEST if y < -LARGEST else y)


@proof_kernel
def below_sum(y: float) -> float:
    """As `below`, of a sum or a difference: below the normal range these are exact, so that 0 stays 0."""
    y = LARGEST if y > LARGEST else y
    return y - RELATIVE * abs(y)


@proof_kernel
def above_sum(y: float) -> float:
    """As `above`, of a sum or a difference."""
    y = -LARGEST if y < -LARGEST else y
    return y + RELATIVE * abs(y)
