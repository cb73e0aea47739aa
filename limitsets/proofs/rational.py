"""Rational intervals: exact arithmetic for the few numbers that a scene's decimals give.

A scene says "5.75 in"; the exact scene is that decimal, not the double next to it.  Everything a map needs is computed
once per scene in spans with rational ends, exactly but for square roots and sines, whose ends are rounded outward at
200 bits; only the last step goes to doubles, outward again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import Any

BITS = 200


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

    def __add__(self, other: RationalInterval | int) -> RationalInterval:
        b = _span(other)
        if b is None:
            return NotImplemented
        return _short(self.lo + b.lo, self.hi + b.hi)

    __radd__ = __add__

    def __sub__(self, other: RationalInterval | int) -> RationalInterval:
        b = _span(other)
        if b is None:
            return NotImplemented
        return _short(self.lo - b.hi, self.hi - b.lo)

    def __rsub__(self, other: int) -> RationalInterval:
        return RationalInterval.of(other) - self

    def __mul__(self, other: RationalInterval | int) -> RationalInterval:
        b = _span(other)
        if b is None:
            return NotImplemented
        if self.lo.numerator >= 0 and b.lo.numerator >= 0:  # most lengths: two products instead of four
            return _short(self.lo * b.lo, self.hi * b.hi)
        ends = [self.lo * b.lo, self.lo * b.hi, self.hi * b.lo, self.hi * b.hi]
        if other is self:  # a square
            ends = [self.lo**2, self.hi**2, *([Fraction(0)] if self.lo < 0 < self.hi else [])]
        return _short(min(ends), max(ends))

    __rmul__ = __mul__

    def __truediv__(self, other: RationalInterval | int) -> RationalInterval:
        b = _span(other)
        if b is None:
            return NotImplemented
        if b.lo <= 0 <= b.hi:
            raise ZeroDivisionError
        found: RationalInterval = self * RationalInterval(1 / b.hi, 1 / b.lo)
        return found

    def __rtruediv__(self, other: int) -> RationalInterval:
        return RationalInterval.of(other) / self


def _span(value: Any) -> Any:
    """Make a span of a number; None of anything else, which may know what to do with a span."""
    if isinstance(value, RationalInterval):
        return value
    return RationalInterval(Fraction(value), Fraction(value)) if isinstance(value, int) else None


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
