"""Dual numbers: a value and its derivatives with respect to several quantities, carried through one computation.

In the formulas of `geometry`, which use scalars with ``+ - * /`` and a passed-in ``sqrt``, they give exact derivatives
up to rounding, without finite differences.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MultiDual:
    """A number that knows its derivatives.

    Parameters
    ----------
    value : float
        The number.
    slope : ndarray, shape (k,)
        Its derivatives with respect to k quantities.

    Examples
    --------
    >>> import numpy as np
    >>> x, y = MultiDual(3.0, np.array([1.0, 0.0])), MultiDual(2.0, np.array([0.0, 1.0]))
    >>> (x * y / (x + y)).slope
    array([0.16, 0.36])
    """

    value: float
    slope: Array

    def __float__(self) -> float:
        return self.value

    def __neg__(self) -> MultiDual:
        return MultiDual(-self.value, -self.slope)

    def __add__(self, other: MultiDual | float) -> MultiDual:
        if isinstance(other, MultiDual):
            return MultiDual(self.value + other.value, self.slope + other.slope)
        return MultiDual(self.value + other, self.slope)

    __radd__ = __add__

    def __sub__(self, other: MultiDual | float) -> MultiDual:
        return self + -other

    def __rsub__(self, other: float) -> MultiDual:
        return -self + other

    def __mul__(self, other: MultiDual | float) -> MultiDual:
        if isinstance(other, MultiDual):
            return MultiDual(self.value * other.value, self.value * other.slope + other.value * self.slope)
        return MultiDual(self.value * other, self.slope * other)

    __rmul__ = __mul__

    def __truediv__(self, other: MultiDual | float) -> MultiDual:
        if isinstance(other, MultiDual):
            quotient = self.value / other.value
            return MultiDual(quotient, (self.slope - quotient * other.slope) / other.value)
        return MultiDual(self.value / other, self.slope / other)

    def __pow__(self, count: int) -> MultiDual:
        return MultiDual(self.value**count, count * self.value ** (count - 1) * self.slope)

    def __abs__(self) -> MultiDual:
        return -self if self.value < 0.0 else self

    def __gt__(self, other: float) -> bool:
        return self.value > other

    def __rtruediv__(self, other: float) -> MultiDual:
        quotient = other / self.value
        return MultiDual(quotient, -quotient / self.value * self.slope)


def square_root(x: MultiDual) -> MultiDual:
    """Square root of a number above 0; that of 0 has no derivative."""
    root = math.sqrt(x.value)
    return MultiDual(root, x.slope / (2.0 * root))


def sine(x: MultiDual) -> MultiDual:
    """Sine of an angle [rad]."""
    return MultiDual(math.sin(x.value), math.cos(x.value) * x.slope)


def cosine(x: MultiDual) -> MultiDual:
    """Cosine of an angle [rad]."""
    return MultiDual(math.cos(x.value), -math.sin(x.value) * x.slope)
