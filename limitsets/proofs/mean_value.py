"""Spans that carry how they change with some quantities: narrow enclosures of functions over boxes.

A formula in which a quantity stands several times is enclosed too widely, where that quantity is known to a tolerance
only: each place counts as another one.  The mean value theorem mends it.  With c in the box and f' enclosed over it,

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
from limitsets.proofs.rational import Span, square_root

__all__ = ["Slope", "about", "middle", "root"]

Number: TypeAlias = Any
"""A `Span`, or `Intervals` of many boxes."""


@dataclass(frozen=True)
class Slope:
    """A span, and the spans of its derivatives; or arrays of intervals.

    Examples
    --------
    >>> x = Slope(Span.of(1, 2), (Span.of(1),))
    >>> (x * x).by[0]
    Span(lo=Fraction(2, 1), hi=Fraction(4, 1))
    """

    value: Number
    by: tuple[Number, ...]

    def __float__(self) -> float:
        return float(self.value)

    def __neg__(self) -> Slope:
        return Slope(-self.value, tuple(-d for d in self.by))

    def __add__(self, other: Slope | Number) -> Slope:
        if isinstance(other, Slope):
            return Slope(self.value + other.value, _each(self.by, other.by))
        return Slope(self.value + other, self.by)

    __radd__ = __add__

    def __sub__(self, other: Slope | Number) -> Slope:
        return self + (-other)

    def __rsub__(self, other: Number) -> Slope:
        return Slope(other - self.value, tuple(-d for d in self.by))

    def __mul__(self, other: Slope | Number) -> Slope:
        if other is self:
            return Slope(self.value * self.value, tuple(2 * (self.value * d) for d in self.by))
        if isinstance(other, Slope):
            one, two = tuple(d * other.value for d in self.by), tuple(self.value * d for d in other.by)
            return Slope(self.value * other.value, _each(one, two))
        return Slope(self.value * other, tuple(d * other for d in self.by))

    __rmul__ = __mul__

    def __truediv__(self, other: Slope | Number) -> Slope:
        if not isinstance(other, Slope):
            return Slope(self.value / other, tuple(d / other for d in self.by))
        ratio = self.value / other.value
        by = (one - ratio * two for one, two in zip(self.by, other.by, strict=True))
        return Slope(ratio, tuple(d / other.value for d in by))

    def __rtruediv__(self, other: Number) -> Slope:
        ratio = other / self.value
        return Slope(ratio, tuple(-(ratio * d) / self.value for d in self.by))


def _each(one: Sequence[Number], two: Sequence[Number]) -> tuple[Number, ...]:
    return tuple(a + b for a, b in zip(one, two, strict=True))


def root(x: Slope | Number) -> Any:
    """Square root.

    Raises
    ------
    ZeroDivisionError
        It may be 0, where it has no derivative.
    """
    if isinstance(x, Intervals):
        return x.square_root()
    if isinstance(x, Span):
        return square_root(x)
    found = root(x.value)
    return Slope(found, tuple(d / (2 * found) for d in x.by))


def about(centre: Span, steep: Slope | Span, offsets: Sequence[Span], plain: Span) -> Span:
    """Enclose a function over a box by the mean value theorem, if that is narrower than the plain enclosure.

    Parameters
    ----------
    centre : Span
        The function at the middle of the box.
    steep : Slope or Span
        Over the box, with its derivatives; a span where it depends on none.
    offsets : sequence of Span
        The box less its middle.
    plain : Span
        Another enclosure.
    """
    if isinstance(steep, Span):
        return plain
    total = centre
    for slope, offset in zip(steep.by, offsets, strict=True):
        total = total + slope * offset
    return Span(max(total.lo, plain.lo), min(total.hi, plain.hi))


def middle(span: Span) -> Span:
    """Return its middle."""
    return Span.of(Fraction(span.lo + span.hi) / 2)
