"""Balls of Arb, rounding, and derivatives: the arithmetic of every proof.

A computation with balls holds for all numbers in them; a comparison of balls is true only if it is true for all of
their numbers.
"""

import math
import operator
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

    def signed_square(self) -> "Rising":
        """Take z |z|, whose derivative 2 |z| is narrower than that of a product."""
        size = abs(self.x) if self.x > 0 or self.x < 0 else ZERO.union(abs(self.x).upper())
        return Rising(self.x * size, [2 * size * d for d in self.by])

    def __gt__(self, other: Any) -> bool:
        return bool(self.x > (other.x if isinstance(other, Rising) else other))

    __radd__, __rmul__ = __add__, __mul__


def signed_square(z: Any) -> Any:
    """Take z |z| in any arithmetic."""
    return z.signed_square() if isinstance(z, Rising) else z * abs(z)


class Centred(Rising):
    """Such a ball, and the number at one point of the box: the mean value theorem narrows the ball at each operation.

    `at`: the number at the point; `off`: the box less the point, quantity by quantity.
    """

    __slots__ = ("at", "off")

    def __init__(self, at: Arb, x: Arb, by: list[Arb], off: list[Arb]):
        mean = sum((d * o for d, o in zip(by, off, strict=True)), at)
        super().__init__(x.intersection(mean) if mean.is_finite() and x.is_finite() else x, by)
        self.at, self.off = at, off

    def made(self, take: Callable[..., Any], *others: Any) -> "Centred":
        """Apply an operation of balls, and of balls with derivatives, to this number and others."""
        at = take(self.at, *(other.at if isinstance(other, Centred) else other for other in others))
        plain = (Rising(z.x, z.by) if isinstance(z, Centred) else z for z in (self, *others))
        over = take(*plain)
        return Centred(at, over.x, over.by, self.off)

    def __neg__(self) -> "Centred":
        return self.made(operator.neg)

    def __add__(self, other: Any) -> "Centred":
        return self.made(operator.add, other)

    def __sub__(self, other: Any) -> "Centred":
        return self.made(operator.sub, other)

    def __rsub__(self, other: Any) -> "Centred":
        return self.made(lambda z, other: other - z, other)

    def __mul__(self, other: Any) -> "Centred":
        return self.made(operator.mul, other)

    def __truediv__(self, other: Any) -> "Centred":
        return self.made(operator.truediv, other)

    def __rtruediv__(self, other: Any) -> "Centred":
        return self.made(lambda z, other: other / z, other)

    def __pow__(self, two: int) -> "Centred":
        return self.made(operator.pow, two)

    def sqrt(self) -> "Centred":
        """Take the square root."""
        return self.made(lambda z: z.sqrt())

    def sin_cos(self) -> "tuple[Centred, Centred]":
        """Take sine and cosine."""
        return self.made(lambda z: z.sin_cos()[0]), self.made(lambda z: z.sin_cos()[1])

    def signed_square(self) -> "Centred":
        """Take z |z|."""
        return self.made(signed_square)

    __radd__, __rmul__ = __add__, __mul__


def centred(points: list[Arb], balls: list[Arb], off: list[Arb]) -> list[Centred]:
    """Return the quantities of a box, each with its derivatives by all of them."""
    return [
        Centred(point, ball, [ONE if j == k else ZERO for j in range(len(off))], off)
        for k, (point, ball) in enumerate(zip(points, balls, strict=True))
    ]
