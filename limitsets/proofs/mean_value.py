"""Intervals with their derivatives (forward mode): narrow enclosures of functions over boxes.

If a formula contains an uncertain quantity several times, its natural interval extension is too wide, because the
places vary independently (dependency problem).  The mean-value form reduces the excess.  With c in the box and f'
enclosed over it,

    f(q)  lies in  f(c) + sum of f'_j (q_j - c_j),

whose excess falls with the square of the width.  The same formulas give f and f' here (forward differentiation).
Source: Moore, Interval Analysis, 1966; Griewank and Walther, Evaluating Derivatives, 2008, chapter 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, TypeAlias

from limitsets.proofs.intervals import Intervals
from limitsets.proofs.rational import RationalInterval, square_root

Number: TypeAlias = Any
"""A `RationalInterval`, or `Intervals` of many boxes."""


@dataclass(frozen=True)
class Jet:
    """A span, and the spans of its derivatives; or arrays of intervals.

    Examples
    --------
    >>> x = Jet(RationalInterval.of(1, 2), (RationalInterval.of(1),))
    >>> (x * x).derivatives[0]
    RationalInterval(lo=Fraction(2, 1), hi=Fraction(4, 1))
    """

    value: Number
    derivatives: tuple[Number, ...]

    def __float__(self) -> float:
        return float(self.value)

    def __neg__(self) -> Jet:
        return Jet(-self.value, tuple(-d for d in self.derivatives))

    def __add__(self, other: Jet | Number) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.value + other.value, _each(self.derivatives, other.derivatives))
        return Jet(self.value + other, self.derivatives)

    __radd__ = __add__

    def __sub__(self, other: Jet | Number) -> Jet:
        return self + (-other)

    def __rsub__(self, other: Number) -> Jet:
        return Jet(other - self.value, tuple(-d for d in self.derivatives))

    def __mul__(self, other: Jet | Number) -> Jet:
        if other is self:
            return Jet(self.value * self.value, tuple(2 * (self.value * d) for d in self.derivatives))
        if isinstance(other, Jet):
            one, two = (
                tuple(d * other.value for d in self.derivatives),
                tuple(self.value * d for d in other.derivatives),
            )
            return Jet(self.value * other.value, _each(one, two))
        return Jet(self.value * other, tuple(d * other for d in self.derivatives))

    __rmul__ = __mul__

    def __truediv__(self, other: Jet | Number) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value / other, tuple(d / other for d in self.derivatives))
        ratio = self.value / other.value
        by = (one - ratio * two for one, two in zip(self.derivatives, other.derivatives, strict=True))
        return Jet(ratio, tuple(d / other.value for d in by))

    def __rtruediv__(self, other: Number) -> Jet:
        ratio = other / self.value
        return Jet(ratio, tuple(-(ratio * d) / self.value for d in self.derivatives))


def _each(one: Sequence[Number], two: Sequence[Number]) -> tuple[Number, ...]:
    return tuple(a + b for a, b in zip(one, two, strict=True))


def root(x: Jet | Number) -> Any:
    """Square root.

    Raises
    ------
    ZeroDivisionError
        It may be 0, where it has no derivative.
    """
    if isinstance(x, Intervals):
        return x.square_root()
    if isinstance(x, RationalInterval):
        return square_root(x)
    found = root(x.value)
    return Jet(found, tuple(d / (2 * found) for d in x.derivatives))


def about(
    centre: RationalInterval,
    steep: Jet | RationalInterval,
    offsets: Sequence[RationalInterval],
    plain: RationalInterval,
) -> RationalInterval:
    """Enclose a function over a box by the mean value theorem, if that is narrower than the plain enclosure.

    Parameters
    ----------
    centre : RationalInterval
        The function at the middle of the box.
    steep : Jet or RationalInterval
        Over the box, with its derivatives; a span where it depends on none.
    offsets : sequence of RationalInterval
        The box less its middle.
    plain : RationalInterval
        Another enclosure.
    """
    if isinstance(steep, RationalInterval):
        return plain
    total = centre
    for slope, offset in zip(steep.derivatives, offsets, strict=True):
        total = total + slope * offset
    return RationalInterval(max(total.lo, plain.lo), min(total.hi, plain.hi))


def middle(span: RationalInterval) -> RationalInterval:
    """Return its middle."""
    return RationalInterval.of(Fraction(span.lo + span.hi) / 2)
