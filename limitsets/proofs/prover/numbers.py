"""Numbers of the prover: rational intervals, arrays of intervals, and intervals with derivatives (forward mode).

If a formula contains an uncertain quantity several times, its natural interval extension is too wide, because the
places vary independently (dependency problem).  The mean-value form reduces the excess.  With c in the box and f'
enclosed over it,

    f(q)  lies in  f(c) + sum of f'_j (q_j - c_j),

whose excess falls with the square of the width.  The same formulas give f and f' here (forward differentiation).
Source: Moore, Interval Analysis, 1966; Griewank and Walther, Evaluating Derivatives, 2008, chapter 3.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import Any, TypeVar

import numpy as np

from limitsets.base.arrays import Array

# ----------------------------------------------------------------
# Rational intervals: exact arithmetic for the few numbers that a scene's decimals give.
#
# A scene says "5.75 in"; the exact scene is that decimal, not the double next to it.  Everything a map needs is
# computed once per scene in spans with rational ends, exactly but for square roots and sines, whose ends are rounded
# outward at 200 bits; only the last step goes to doubles, outward again.


BITS = 200

Class = TypeVar("Class")


def _with_operand(
    convert: Callable[[Any], Class | None],
) -> Callable[[Callable[[Class, Class], Class]], Callable[[Class, Any], Class]]:
    """Make the operand of an operation a number of its class; one of another class may take a number of this."""

    def of(operation: Callable[[Class, Class], Class]) -> Callable[[Class, Any], Class]:
        def converted(self: Class, other: Any) -> Class:
            b = convert(other)
            return NotImplemented if b is None else operation(self, b)

        return converted

    return of


def _span(value: Any) -> RationalInterval | None:
    """Make a span of a number; None of another operand, whose own class may take a span."""
    if isinstance(value, RationalInterval):
        return value
    return RationalInterval(Fraction(value), Fraction(value)) if isinstance(value, int) else None


@dataclass(frozen=True)
class RationalInterval:
    """All numbers from `lo` to `hi`.

    Examples
    --------
    >>> from fractions import Fraction
    >>> (RationalInterval.of("0.1") * 3).contains(Fraction(3, 10))
    True
    """

    lo: Fraction
    hi: Fraction

    @classmethod
    def of(cls, lo: str | float | Fraction, hi: str | float | Fraction | None = None) -> RationalInterval:
        """Read a decimal, or two."""
        return cls(Fraction(lo), Fraction(lo if hi is None else hi))

    def contains(self, value: Fraction) -> bool:
        """Whether a number lies in the span."""
        return self.lo <= value <= self.hi

    def outward(self) -> tuple[float, float]:
        """Doubles strictly around the span: ball arithmetic cannot confirm an end that is met exactly."""
        return math.nextafter(float(self.lo), -math.inf), math.nextafter(float(self.hi), math.inf)

    def __float__(self) -> float:
        return float((self.lo + self.hi) / 2)

    def __neg__(self) -> RationalInterval:
        return RationalInterval(-self.hi, -self.lo)

    @_with_operand(_span)
    def __add__(self, b: RationalInterval) -> RationalInterval:
        return _short(self.lo + b.lo, self.hi + b.hi)

    __radd__ = __add__

    def __sub__(self, other: RationalInterval | int) -> RationalInterval:
        return self + (-other)

    def __rsub__(self, other: int) -> RationalInterval:
        return -self + other

    @_with_operand(_span)
    def __mul__(self, b: RationalInterval) -> RationalInterval:
        if self.lo.numerator >= 0 and b.lo.numerator >= 0:  # most lengths: two products instead of four
            return _short(self.lo * b.lo, self.hi * b.hi)
        ends = [self.lo * b.lo, self.lo * b.hi, self.hi * b.lo, self.hi * b.hi]
        if b is self:  # a square
            ends = [self.lo**2, self.hi**2, *([Fraction(0)] if self.lo < 0 < self.hi else [])]
        return _short(min(ends), max(ends))

    __rmul__ = __mul__

    @_with_operand(_span)
    def __truediv__(self, b: RationalInterval) -> RationalInterval:
        if b.lo <= 0 <= b.hi:
            raise ZeroDivisionError
        return self * RationalInterval(1 / b.hi, 1 / b.lo)

    def __rtruediv__(self, other: int) -> RationalInterval:
        return RationalInterval.of(other) / self


def _short(lo: Fraction, hi: Fraction) -> RationalInterval:
    """Round ends with long denominators outward, so that numbers do not grow without bound."""
    if lo.denominator.bit_length() + hi.denominator.bit_length() > 4 * BITS:
        scale = 1 << BITS
        lo = Fraction(math.floor(lo * scale), scale)
        hi = Fraction(math.ceil(hi * scale), scale)
    return RationalInterval(lo, hi)


def square_root(x: RationalInterval) -> RationalInterval:
    """Square root of a span of numbers >= 0."""
    scale = 1 << BITS
    below = isqrt(math.floor(max(x.lo, Fraction(0)) * scale * scale))
    above = isqrt(math.ceil(x.hi * scale * scale)) + 1
    return RationalInterval(Fraction(below, scale), Fraction(above, scale))


@functools.cache
def pi() -> RationalInterval:
    """pi, by Machin's formula."""

    def arctan_inverse(n: int, terms: int) -> RationalInterval:
        parts = [Fraction((-1) ** k, (2 * k + 1) * n ** (2 * k + 1)) for k in range(terms)]
        total, last = sum(parts, Fraction(0)), abs(parts[-1])
        return RationalInterval(total - last, total + last)

    value = 16 * arctan_inverse(5, 50) - 4 * arctan_inverse(239, 16)
    scale = 1 << BITS
    return RationalInterval(
        Fraction(math.floor(value.lo * scale), scale), Fraction(math.ceil(value.hi * scale), scale)
    )


def sine(x: RationalInterval) -> RationalInterval:
    """Sine of a span within [0, pi/2]."""

    def bounds(t: Fraction) -> tuple[Fraction, Fraction]:
        t = Fraction(round(t * (1 << BITS)), 1 << BITS)
        parts = [(-1) ** k * t ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(24)]
        total, last = sum(parts, Fraction(0)), abs(parts[-1]) + Fraction(1, 1 << (BITS - 2))
        return total - last, total + last

    return _short(bounds(x.lo)[0], min(bounds(x.hi)[1], Fraction(1)))


def _turned(angle: Fraction) -> tuple[RationalInterval, RationalInterval]:
    """Sine and cosine of an angle in [0, pi]: by its half."""
    s = sine(RationalInterval.of(angle / 2))
    c = square_root(1 - s * s)
    return 2 * (s * c), 1 - 2 * (s * s)


def _angle(y: Fraction, x: Fraction) -> tuple[Fraction, Fraction]:
    """Bounds of the angle of one vector with y > 0: libm proposes, signs decide."""
    guess, step = Fraction(math.atan2(float(y), float(x))), Fraction(1, 1 << 50)
    lo, hi, top = guess - step, guess + step, pi().lo

    def across(angle: Fraction) -> RationalInterval:
        s, c = _turned(angle)
        return RationalInterval.of(y) * c - RationalInterval.of(x) * s

    while lo > 0 and not across(lo).lo > 0:
        step, lo = 2 * step, lo - step
    while hi < top and not across(hi).hi < 0:
        step, hi = 2 * step, hi + step
    return max(lo, Fraction(0)), min(hi, pi().hi)


def angle(y: RationalInterval, x: RationalInterval) -> RationalInterval:
    """Angle of the vectors with y > 0 in a box, in (0, pi).

    Raises
    ------
    ZeroDivisionError
        y may be 0.
    """
    if not y.lo > 0:
        raise ZeroDivisionError
    # along each border of the box it is monotone
    ends = [_angle(b, a) for b in {y.lo, y.hi} for a in {x.lo, x.hi}]
    return RationalInterval(min(lo for lo, _ in ends), max(hi for _, hi in ends))


# ----------------------------------------------------------------
# Arrays of closed intervals, for formulas that are evaluated on many boxes at a time.
#
# Each operation is rounded to nearest by the processor and moved outward by one unit in the last place, which holds
# the exact result (`limitsets.interval` has the same for compiled kernels).  An impossible operation gives nan, and a
# comparison with nan is false: a proof accepts on comparisons that are true.


def _outward(lo: Array, hi: Array) -> Intervals:
    return Intervals(np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf))


def _as(value: object) -> Intervals | None:
    """Make intervals of a number; None of another operand, whose own class may take intervals."""
    if isinstance(value, Intervals):
        return value
    return Intervals.of(float(value)) if isinstance(value, (int, float)) else None


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

    def __neg__(self) -> Intervals:
        return Intervals(-self.hi, -self.lo)

    @_with_operand(_as)
    def __add__(self, b: Intervals) -> Intervals:
        return _outward(self.lo + b.lo, self.hi + b.hi)

    __radd__ = __add__

    @_with_operand(_as)
    def __sub__(self, b: Intervals) -> Intervals:
        return _outward(self.lo - b.hi, self.hi - b.lo)

    def __rsub__(self, other: float) -> Intervals:
        return -self + other

    @_with_operand(_as)
    def __mul__(self, b: Intervals) -> Intervals:
        some = (self.lo * b.lo, self.lo * b.hi, self.hi * b.lo, self.hi * b.hi)
        return _outward(
            np.minimum(np.minimum(some[0], some[1]), np.minimum(some[2], some[3])),
            np.maximum(np.maximum(some[0], some[1]), np.maximum(some[2], some[3])),
        )

    __rmul__ = __mul__

    @_with_operand(_as)
    def __truediv__(self, b: Intervals) -> Intervals:
        sure = (b.lo > 0.0) | (b.hi < 0.0)
        lo, hi = np.where(sure, b.lo, np.nan), np.where(sure, b.hi, np.nan)
        return self * _outward(1.0 / hi, 1.0 / lo)

    @_with_operand(_as)
    def __rtruediv__(self, b: Intervals) -> Intervals:
        return b / self

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


# ----------------------------------------------------------------
# Intervals with their derivatives (forward mode): narrow enclosures of functions over boxes.


@dataclass(frozen=True)
class Jet:
    """A span, and the spans of its derivatives.

    Examples
    --------
    >>> x = Jet(RationalInterval.of(1, 2), (RationalInterval.of(1),))
    >>> (x * x).derivatives[0]
    RationalInterval(lo=Fraction(2, 1), hi=Fraction(4, 1))
    """

    value: Any  # a RationalInterval
    derivatives: tuple[Any, ...]

    def __float__(self) -> float:
        return float(self.value)

    def __neg__(self) -> Jet:
        return Jet(-self.value, tuple(-d for d in self.derivatives))

    def __add__(self, other: Any) -> Jet:
        if isinstance(other, Jet):
            return Jet(self.value + other.value, _each(self.derivatives, other.derivatives))
        return Jet(self.value + other, self.derivatives)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Jet:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Jet:
        return Jet(other - self.value, tuple(-d for d in self.derivatives))

    def __mul__(self, other: Any) -> Jet:
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

    def __truediv__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet(self.value / other, tuple(d / other for d in self.derivatives))
        ratio = self.value / other.value
        by = (one - ratio * two for one, two in zip(self.derivatives, other.derivatives, strict=True))
        return Jet(ratio, tuple(d / other.value for d in by))

    def __rtruediv__(self, other: Any) -> Jet:
        ratio = other / self.value
        return Jet(ratio, tuple(-(ratio * d) / self.value for d in self.derivatives))

    def __pow__(self, count: int) -> Jet:
        rate = count * self.value ** (count - 1)
        return Jet(self.value**count, tuple(rate * d for d in self.derivatives))

    def __abs__(self) -> Jet:
        return self if self > 0.0 else -self

    def __gt__(self, other: float) -> bool:
        return bool(self.value > other)


def _each(one: Sequence[RationalInterval], two: Sequence[RationalInterval]) -> tuple[RationalInterval, ...]:
    return tuple(a + b for a, b in zip(one, two, strict=True))


def root(x: Jet | RationalInterval) -> Any:
    """Square root.

    Raises
    ------
    ZeroDivisionError
        It may be 0, where it has no derivative.
    """
    if isinstance(x, RationalInterval):
        return square_root(x)
    half_power = square_root(x.value)
    return Jet(half_power, tuple(d / (2 * half_power) for d in x.derivatives))


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
