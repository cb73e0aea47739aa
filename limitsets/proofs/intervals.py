"""Arrays of closed intervals, for formulas that are evaluated on many boxes at a time.

Each operation is rounded to nearest by the processor and moved outward by one unit in the last place, which holds
the exact result (`limitsets.interval` has the same for compiled kernels).  An impossible operation gives nan, and a
comparison with nan is false: a proof accepts on comparisons that are true.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.proofs.rational import RationalInterval

Array = NDArray[np.float64]


def _outward(lo: Array, hi: Array) -> Intervals:
    return Intervals(np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf))


@dataclass(frozen=True, eq=False)
class Intervals:
    """Intervals, one for each element; arrays of one element stand for all.

    Attributes
    ----------
    lo, hi : ndarray, shape (n,)
        Ends.

    Examples
    --------
    >>> import numpy as np
    >>> x = Intervals(np.array([-1.0]), np.array([2.0]))
    >>> y = x * x
    >>> bool(y.lo[0] <= -2.0 and y.hi[0] >= 4.0), bool(x.square().lo[0] >= -1e-300)
    (True, True)
    """

    lo: Array
    hi: Array

    @classmethod
    def of(cls, lo: float, hi: float | None = None) -> Intervals:
        """Return one interval."""
        return cls(np.array([lo], dtype=float), np.array([lo if hi is None else hi], dtype=float))

    def __getitem__(self, chosen: NDArray[np.int64]) -> Intervals:
        return Intervals(self.lo[chosen], self.hi[chosen])

    def rows(self, count: int) -> Intervals:
        """Return so many, where one stands for all."""
        return Intervals(np.broadcast_to(self.lo, (count,)), np.broadcast_to(self.hi, (count,)))

    def __float__(self) -> float:
        """Return a middle: formulas are put in order by it."""
        return float(0.5 * (self.lo + self.hi).mean())

    def __neg__(self) -> Intervals:
        return Intervals(-self.hi, -self.lo)

    def __add__(self, other: Intervals | RationalInterval | float) -> Intervals:
        b = _as(other)
        if b is None:
            return NotImplemented
        return _outward(self.lo + b.lo, self.hi + b.hi)

    __radd__ = __add__

    def __sub__(self, other: Intervals | RationalInterval | float) -> Intervals:
        b = _as(other)
        if b is None:
            return NotImplemented
        return _outward(self.lo - b.hi, self.hi - b.lo)

    def __rsub__(self, other: RationalInterval | float) -> Intervals:
        return -self + other

    def __mul__(self, other: Intervals | RationalInterval | float) -> Intervals:
        b = _as(other)
        if b is None:
            return NotImplemented
        some = (self.lo * b.lo, self.lo * b.hi, self.hi * b.lo, self.hi * b.hi)
        return _outward(
            np.minimum(np.minimum(some[0], some[1]), np.minimum(some[2], some[3])),
            np.maximum(np.maximum(some[0], some[1]), np.maximum(some[2], some[3])),
        )

    __rmul__ = __mul__

    def __truediv__(self, other: Intervals | RationalInterval | float) -> Intervals:
        b = _as(other)
        if b is None:
            return NotImplemented
        sure = (b.lo > 0.0) | (b.hi < 0.0)
        lo, hi = np.where(sure, b.lo, np.nan), np.where(sure, b.hi, np.nan)
        return self * _outward(1.0 / hi, 1.0 / lo)

    def __rtruediv__(self, other: RationalInterval | float) -> Intervals:
        b = _as(other)
        return NotImplemented if b is None else b / self

    def square(self) -> Intervals:
        """Return x^2, at least 0 but for the rounding."""
        size = self.absolute()
        return _outward(size.lo * size.lo, size.hi * size.hi)

    def absolute(self) -> Intervals:
        """Return |x|, exactly."""
        least = np.maximum(np.maximum(self.lo, -self.hi), 0.0)
        return Intervals(least, np.maximum(np.abs(self.lo), np.abs(self.hi)))

    def square_root(self) -> Intervals:
        """Square root of numbers above 0; both ends are nan where some are not."""
        sure = self.lo > 0.0
        return _outward(*(np.sqrt(np.where(sure, end, np.nan)) for end in (self.lo, self.hi)))


def _as(value: object) -> Intervals | None:
    """Make intervals of a number; None of anything else, which may know what to do with intervals."""
    if isinstance(value, Intervals):
        return value
    if isinstance(value, RationalInterval):
        return Intervals.of(*value.outward())
    return Intervals.of(float(value)) if isinstance(value, (int, float)) else None
