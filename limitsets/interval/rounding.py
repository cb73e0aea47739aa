"""Stepping outward by arithmetic.

For a double y and any rounding direction, the exact result of one operation that gave y lies within one unit in the
last place of y, at most ``2^-52 |y|``, or ``2^-1074`` below the normal range.  ``3 * 2^-52 |y| + 3 * 2^-1074`` covers
that and the rounding of the step itself.
"""

from __future__ import annotations

from limitsets.jit import proof_kernel

__all__ = ["down", "up"]

RELATIVE = 3.0 * 2.0**-52
ABSOLUTE = 3.0 * 2.0**-1074


@proof_kernel
def down(y: float) -> float:
    """Return a number below the exact result that was rounded to y."""
    return y - (RELATIVE * abs(y) + ABSOLUTE)


@proof_kernel
def up(y: float) -> float:
    """Return a number above the exact result that was rounded to y."""
    return y + (RELATIVE * abs(y) + ABSOLUTE)
