"""The interval as a number: a formula with ``+ - * /`` that is written once runs on floats and on intervals.

In compiled code an `Interval` is a structure of two floats.  Its operators are the kernels of `arithmetic.py`: the
bounds are theirs to the bit.  A plain number beside an interval stands for the interval of that number alone.  The
functions below say what ``+ - * /`` do not say tightly; a formula calls them on any kind of number.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from limitsets.numbers.interval import arithmetic, elementary, exponential
from limitsets.numbers.interval.rounding import down, up
from limitsets.numbers.jit import corners_as_numbers, mark_undefined, number, operation

Number = TypeVar("Number", bound=Any)
"""A float, an `Interval`, or a number of Python with the same operators."""


@number(twice=True)
@dataclass(frozen=True, slots=True)
class Interval:
    """All real numbers from lo to hi, with the contract of `limitsets.interval`.

    Attributes
    ----------
    lo, hi : float
        The ends.

    Examples
    --------
    >>> from limitsets.interval import Interval
    >>> third = 1.0 / Interval(3.0, 3.0)
    >>> third.lo < 1.0 / 3.0 < third.hi
    True
    """

    lo: float
    hi: float

    def __neg__(self) -> Interval:
        return _neg(self)

    def __abs__(self) -> Interval:
        return _abs(self)

    def __add__(self, other: Interval | float) -> Interval:
        return _add(self, other)

    def __sub__(self, other: Interval | float) -> Interval:
        return _sub(self, other)

    def __mul__(self, other: Interval | float) -> Interval:
        return _mul(self, other)

    def __truediv__(self, other: Interval | float) -> Interval:
        return _div(self, other)

    def __rsub__(self, other: float) -> Interval:
        return _sub(other, self)

    def __rtruediv__(self, other: float) -> Interval:
        return _div(other, self)

    def __pow__(self, exponent: Interval | float) -> Interval:
        return _whole_pow(self, exponent) if isinstance(exponent, int) else _real_pow(self, exponent)

    __radd__, __rmul__ = __add__, __mul__


# ---------------------------------------------------------------- the operators, on the kernels of pairs


def ends_of(x: Any) -> Any:
    """Return an interval, or a plain number, as a pair."""
    return (x.lo, x.hi) if isinstance(x, Interval) else (float(x), float(x))


def _neg(a: Any) -> Interval:
    return Interval(*arithmetic.neg(ends_of(a)))


def _abs(a: Any) -> Interval:
    return Interval(*arithmetic.absolute(ends_of(a)))


def _sqrt(a: Any) -> Interval:
    return Interval(*arithmetic.sqrt(ends_of(a)))


def _add(a: Any, b: Any) -> Interval:
    return Interval(*arithmetic.add(ends_of(a), ends_of(b)))


def _sub(a: Any, b: Any) -> Interval:
    return Interval(*arithmetic.sub(ends_of(a), ends_of(b)))


def _mul(a: Any, b: Any) -> Interval:
    return Interval(*arithmetic.mul(ends_of(a), ends_of(b)))


def _div(a: Any, b: Any) -> Interval:
    return Interval(*arithmetic.div(ends_of(a), ends_of(b)))


def _min(a: Any, b: Any) -> Interval:
    return Interval(*arithmetic.minimum(ends_of(a), ends_of(b)))


def _max(a: Any, b: Any) -> Interval:
    return Interval(*arithmetic.maximum(ends_of(a), ends_of(b)))


def _real_pow(a: Any, exponent: Any) -> Interval:
    lo, hi = exponential.real_power(ends_of(a), ends_of(exponent))
    return Interval(lo, hi)


def _whole_pow(a: Any, count: Any) -> Interval:
    lo, hi = arithmetic.power(ends_of(a), count)
    return Interval(lo, hi)


def _tan(a: Any) -> Interval:
    ratio: Any = math.sin(a) / math.cos(a)
    return ratio  # type: ignore[no-any-return]  # `math` has types for floats alone; this is an interval


operation(ends_of, Interval, lambda x: (x.lo, x.hi))
operation(ends_of, float, lambda x: (float(x), float(x)))
for _stubs, _method in (
    ((operator.pos,), lambda a: a),
    ((operator.neg,), _neg),
    ((operator.add,), _add),
    ((operator.sub,), _sub),
    ((operator.mul,), _mul),
    ((operator.truediv,), _div),
    ((abs, math.fabs, np.abs), _abs),
    ((min, np.minimum), _min),
    ((max, np.maximum), _max),
    ((math.sqrt, np.sqrt), _sqrt),
    ((np.cbrt,), lambda a: Interval(*arithmetic.cbrt(ends_of(a)))),
    ((math.floor, np.floor), lambda a: Interval(*arithmetic.floor(ends_of(a)))),
    ((math.exp, np.exp), lambda a: Interval(*exponential.exp(ends_of(a)))),
    ((math.log, np.log), lambda a: Interval(*exponential.log(ends_of(a)))),
    ((math.sin, np.sin), lambda a: Interval(*elementary.sin(ends_of(a)))),
    ((math.cos, np.cos), lambda a: Interval(*elementary.cos(ends_of(a)))),
    ((math.tan, np.tan), _tan),
    ((math.tanh, np.tanh), lambda a: Interval(*exponential.tanh(ends_of(a)))),
    ((math.atan2, np.arctan2), lambda a, b: Interval(*elementary.atan2(ends_of(a), ends_of(b)))),
):
    for _stub in _stubs:
        operation(_stub, Interval, _method)
operation(operator.pow, Interval, _real_pow, whole=_whole_pow)


def _whole_number(x: Any) -> int:
    """Return the whole number of an interval that has but this one, as the sides to which a map leads have."""
    mark_undefined(math.floor(x.lo) != math.floor(x.hi))
    return int(x.lo)


operation(int, Interval, _whole_number)


# ---------------------------------------------------------------- parameters


@number(twice=True)
@dataclass(frozen=True, slots=True)
class PerSide:
    """Intervals, one for each side: two arrays of ends.

    Attributes
    ----------
    lo, hi : ndarray
        The ends.
    """

    lo: Any
    hi: Any


operation(operator.getitem, PerSide, lambda ends, side: Interval(ends.lo[side], ends.hi[side]))
operation(len, PerSide, lambda ends: len(ends.lo))

intervals_between = corners_as_numbers(Interval, PerSide)
"""The parameters between two corners, each an interval: `lo` and `hi` are of one NamedTuple class; in compiled code."""


# ---------------------------------------------------------------- what the operators do not say tightly


def square_root(x: Number) -> Number:
    """Return the square root."""
    root: Any = math.sqrt(x)
    return root  # type: ignore[no-any-return]  # `math` has types for floats alone; this is of the kind of x


def smaller(x: Number, y: Number) -> Number:
    """Return the smaller of two."""
    return min(x, y)


def larger(x: Number, y: Number) -> Number:
    """Return the larger of two."""
    return max(x, y)


def signed_square(x: Number) -> Number:
    """Return x |x|, which grows with x."""
    return x * abs(x)  # type: ignore[no-any-return]  # the operators of floats, arrays and intervals share no type


def with_sign_of(x: Number, size: Number) -> Number:
    """Return a size where x > 0, less the size where not."""
    return size if x > 0.0 else -size  # type: ignore[no-any-return]  # the operators of floats, arrays and intervals share no type


def where_positive(x: Number, yes: Number, no: Number) -> Number:
    """Choose between two forms of one number: `yes` where x > 0 (is proved), `no` elsewhere.

    Where x has no proved sign the interval of `no` stands for both: so both have to be the same number there.
    """
    return yes if x > 0.0 else no


def hull_of(a: Any, b: Any) -> Any:
    """Return the smallest interval that holds both."""
    return Interval(*arithmetic.hull(ends_of(a), ends_of(b)))


def _with_sign_of(x: Any, size: Any) -> Interval:
    least, most = max(size.lo, 0.0), max(size.hi, 0.0)
    return Interval(-most if x.lo < 0.0 else least, most if x.hi > 0.0 else -least)


def _where_positive(x: Any, yes: Any, no: Any) -> Interval:
    sure = x.lo > 0.0
    return Interval(yes.lo if sure else no.lo, yes.hi if sure else no.hi)


operation(hull_of, Interval, hull_of)
for _plain, _enclosed in (
    (square_root, _sqrt),
    (smaller, _min),
    (larger, _max),
    (signed_square, lambda x: Interval(down(x.lo * abs(x.lo)), up(x.hi * abs(x.hi)))),
    (with_sign_of, _with_sign_of),
    (where_positive, _where_positive),
):
    operation(_plain, float, _plain)  # as it stands
    operation(_plain, Interval, _enclosed)
