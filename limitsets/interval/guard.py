"""The guard before every certified run: the processor, in the thread that computes, does what the proofs assume.

Rounding is to nearest and numbers below the normal range are not flushed to zero.  Some libraries change that for the
whole process as a side effect of being imported.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from limitsets.errors import AnswerError
from limitsets.jit import proof_kernel


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
