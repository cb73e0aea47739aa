"""Stepping outward by arithmetic, and the guard before every certified run that the processor does what proofs assume.

For a double y and any rounding direction, the exact result of one operation that gave y lies within one unit in the
last place of y, at most ``2^-52 |y|``, or ``2^-1074`` below the normal range.  ``3 * 2^-52 |y| + 3 * 2^-1074`` covers
that and the rounding of the step itself.  Where y overflowed the exact result lies beyond the largest double.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.numbers.jit import proof_kernel

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
def clamped(x: float, least: float, most: float) -> float:
    """X moved to the nearer end of a range; no nan, for what is made an integer must be a number."""
    x = x if x > least else least
    return x if x < most else most


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


# ----------------------------------------------------------------
# The guard before every certified run: the processor, in the thread that computes, does what the proofs assume.
#
# Rounding is to nearest and numbers below the normal range are not flushed to zero.  Some libraries change that for the
# whole process as a side effect of being imported.


@proof_kernel(entry=True)
def _signs(numbers: Any) -> Any:
    """Bits of what is wrong; the numbers come from memory, so that nothing is computed beforehand."""
    one, half_ulp, tiny = numbers[0], numbers[1], numbers[2]
    wrong = 0
    if one + half_ulp != one or -one - half_ulp != -one:  # up, or down
        wrong |= 1
    if (one + 3.0 * half_ulp) - one != 4.0 * half_ulp:  # towards zero, or down
        wrong |= 1
    if not (0.5 * tiny > 0.0 and (2.0 * (0.5 * tiny)) == tiny):  # flushed to zero
        wrong |= 2
    return wrong


def rounding_is_sound() -> bool:
    """Whether this thread rounds to nearest and keeps subnormal numbers.

    Examples
    --------
    >>> from limitsets import interval
    >>> interval.rounding_is_sound()
    True
    """
    return bool(_signs(np.array([1.0, 2.0**-53, 2.0**-1022])) == 0)


def guard() -> None:
    """Refuse to go on where proofs would be worth nothing.

    Raises
    ------
    AnswerError
        The rounding direction is not to nearest, or subnormal numbers are flushed to zero.
    """
    wrong = int(_signs(np.array([1.0, 2.0**-53, 2.0**-1022])))
    if wrong:
        what = " and ".join(
            text for bit, text in ((1, "another rounding"), (2, "flushed subnormals")) if wrong & bit
        )
        raise AnswerError(
            "the floating-point state of this thread",
            what,
            "rounding to nearest with subnormal numbers",
            "find the library that changed it and load it in another process",
        )
