"""Balls of Arb, rounding, and derivatives: the arithmetic of every proof.

A computation with balls holds for all numbers in them; a comparison of balls is true only if it is true for all of
their numbers.
"""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb, fmpq

PRECISION = 100  # bits of every ball
Arb = Any  # flint.arb has no stubs
Array = np.ndarray[Any, np.dtype[Any]]
Pair = tuple[float, float]
HALF, ZERO, ONE = arb(0.5), arb(0), arb(1)


class UnprovedError(Exception):
    """A file says something that was not proved; the text is the reason, in words for people."""


def prove(condition: bool, message: str) -> None:
    """Raise UnprovedError unless the condition holds."""
    if not condition:
        raise UnprovedError(message)


@contextmanager
def about(what: str) -> Iterator[None]:
    """Name what a proof is about, before the reason why it fails."""
    try:
        yield
    except UnprovedError as error:
        raise UnprovedError(f"{what}: {error}") from None


def reason_of(check: Callable[..., object], *more: Any) -> str:
    """Return the reason why a check fails; "" if it proves its statement."""
    try:
        check(*more)
    except UnprovedError as error:
        return str(error) or "it is not proved"  # an empty text would count as a proof
    return ""


def exact(value: Fraction) -> Arb:
    """Enclose a rational number."""
    return arb(fmpq(value.numerator, value.denominator))


def span(lo: Fraction, hi: Fraction) -> Arb:
    """Enclose an interval."""
    return exact(lo) if lo == hi else exact(lo).union(exact(hi))


def float_below(value: Arb) -> float:
    """Round a ball down, to a float that is not above any of its numbers."""
    prove(value.is_finite(), "an image is not bounded")
    x = float(value.lower())
    while not arb(x) <= value:
        x = math.nextafter(x, -math.inf)
    return x


def float_above(value: Arb) -> float:
    """Round a ball up, to a float that is not below any of its numbers."""
    return -float_below(-value)


def floats_around(x: Arb) -> Pair:
    """Return a float below a ball and one above it: a conversion is off by less than the step to the next float."""
    return math.nextafter(float(x.lower()), -math.inf), math.nextafter(float(x.upper()), math.inf)


def float_of(value: Fraction, *, up: bool) -> float:
    """Round a rational number, up or down where it is no float."""
    x = float(value)
    wrong = Fraction(x) < value if up else Fraction(x) > value
    return math.nextafter(x, math.inf if up else -math.inf) if wrong else x


def sine_cosine(phi: Arb) -> tuple[Arb, Arb]:
    """Enclose sine and cosine by the mean value theorem: over a wide ball Arb's own results are as wide as the ball."""
    sin, cos = phi.sin_cos()
    middle = phi.mid()
    at, off = middle.sin_cos(), phi - middle
    return at[0] + cos * off, at[1] - sin * off


class Rising:
    """A ball with its derivatives by several quantities, for the mean value theorem."""

    __slots__ = ("by", "x")

    def __init__(self, x: Arb, by: list[Arb]):
        self.x, self.by = x, by

    def __neg__(self) -> "Rising":
        return Rising(-self.x, [-d for d in self.by])

    def __add__(self, other: Any) -> "Rising":
        if isinstance(other, Rising):
            return Rising(self.x + other.x, [d + e for d, e in zip(self.by, other.by, strict=True)])
        return Rising(self.x + other, self.by)

    def __sub__(self, other: Any) -> "Rising":
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> "Rising":
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> "Rising":
        if isinstance(other, Rising):
            pairs = zip(self.by, other.by, strict=True)
            return Rising(self.x * other.x, [d * other.x + self.x * e for d, e in pairs])
        return Rising(self.x * other, [d * other for d in self.by])

    def __truediv__(self, other: Any) -> "Rising":
        if isinstance(other, Rising):
            ratio, pairs = self.x / other.x, zip(self.by, other.by, strict=True)
            return Rising(ratio, [(d - ratio * e) / other.x for d, e in pairs])
        return Rising(self.x / other, [d / other for d in self.by])

    def __rtruediv__(self, other: Any) -> "Rising":
        ratio = other / self.x
        return Rising(ratio, [-ratio * d / self.x for d in self.by])

    def __pow__(self, two: int) -> "Rising":
        return Rising(self.x**two, [two * self.x ** (two - 1) * d for d in self.by])

    def sqrt(self) -> "Rising":
        """Take the square root, with its derivatives."""
        root = self.x.sqrt()
        return Rising(root, [d / (2 * root) for d in self.by])

    def sin_cos(self) -> "tuple[Rising, Rising]":
        """Take sine and cosine, with their derivatives."""
        sin, cos = self.x.sin_cos()
        return Rising(sin, [cos * d for d in self.by]), Rising(cos, [-sin * d for d in self.by])

    def __abs__(self) -> "Rising":  # only ever used in x |x|, where the sign of 0 does not matter
        sign = ONE if self.x > 0 else -ONE if self.x < 0 else ONE.union(-ONE)
        return Rising(abs(self.x), [sign * d for d in self.by])

    def __gt__(self, other: Any) -> bool:
        return bool(self.x > (other.x if isinstance(other, Rising) else other))

    __radd__, __rmul__ = __add__, __mul__
