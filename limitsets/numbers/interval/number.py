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
from limitsets.numbers.interval import exponential as logarithm
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

    def __add__(self, other: Interval | float) -> Interval:
        return _add(self, other)

    def __sub__(self, other: Interval | float) -> Interval:
        return _sub(self, other)

    def __mul__(self, other: Interval | float) -> Interval:
        return _mul(self, other)

    def __truediv__(self, other: Interval | float) -> Interval:
        return _div(self, other)

    def __radd__(self, other: float) -> Interval:
        return _add(other, self)

    def __rsub__(self, other: float) -> Interval:
        return _sub(other, self)

    def __rmul__(self, other: float) -> Interval:
        return _mul(other, self)

    def __rtruediv__(self, other: float) -> Interval:
        return _div(other, self)

    def __pow__(self, count: int) -> Interval:
        return _pow(self, count)

    def __abs__(self) -> Interval:
        return _abs(self)


# ---------------------------------------------------------------- the operators, on the kernels of pairs

# One function for each: code that takes a kernel as an argument, or keeps one in a closure, is not cached on disk.


def ends_of(x: Any) -> Any:
    """Return an interval, or a plain number, as a pair."""
    return _ends_of_interval(x) if isinstance(x, Interval) else _ends_of_number(x)


def _ends_of_interval(x: Any) -> Any:
    return x.lo, x.hi


def _ends_of_number(x: Any) -> Any:
    return float(x), float(x)


def _itself(a: Any) -> Any:
    return a


def _neg(a: Any) -> Interval:
    lo, hi = arithmetic.neg(ends_of(a))
    return Interval(lo, hi)


def _add(a: Any, b: Any) -> Interval:
    lo, hi = arithmetic.add(ends_of(a), ends_of(b))
    return Interval(lo, hi)


def _sub(a: Any, b: Any) -> Interval:
    lo, hi = arithmetic.sub(ends_of(a), ends_of(b))
    return Interval(lo, hi)


def _mul(a: Any, b: Any) -> Interval:
    lo, hi = arithmetic.mul(ends_of(a), ends_of(b))
    return Interval(lo, hi)


def _div(a: Any, b: Any) -> Interval:
    lo, hi = arithmetic.div(ends_of(a), ends_of(b))
    return Interval(lo, hi)


def _pow(a: Any, count: Any) -> Interval:
    lo, hi = arithmetic.power(ends_of(a), count)
    return Interval(lo, hi)


def _abs(a: Any) -> Interval:
    lo, hi = arithmetic.absolute(ends_of(a))
    return Interval(lo, hi)


def _min(a: Any, b: Any) -> Interval:
    lo, hi = arithmetic.minimum(ends_of(a), ends_of(b))
    return Interval(lo, hi)


def _max(a: Any, b: Any) -> Interval:
    lo, hi = arithmetic.maximum(ends_of(a), ends_of(b))
    return Interval(lo, hi)


def _sqrt(a: Any) -> Interval:
    lo, hi = arithmetic.sqrt(ends_of(a))
    return Interval(lo, hi)


def _floor(a: Any) -> Interval:
    lo, hi = arithmetic.floor(ends_of(a))
    return Interval(lo, hi)


def _exp(a: Any) -> Interval:
    lo, hi = exponential.exp(ends_of(a))
    return Interval(lo, hi)


def _log(a: Any) -> Interval:
    lo, hi = logarithm.log(ends_of(a))
    return Interval(lo, hi)


def _sin(a: Any) -> Interval:
    lo, hi = elementary.sin(ends_of(a))
    return Interval(lo, hi)


def _cos(a: Any) -> Interval:
    lo, hi = elementary.cos(ends_of(a))
    return Interval(lo, hi)


def _tanh(a: Any) -> Interval:
    lo, hi = exponential.tanh(ends_of(a))
    return Interval(lo, hi)


def _tan(a: Any) -> Interval:
    ratio: Any = math.sin(a) / math.cos(a)
    return ratio  # type: ignore[no-any-return]  # `math` has types for floats alone; this is an interval


def _atan2(a: Any, b: Any) -> Interval:
    lo, hi = elementary.atan2(ends_of(a), ends_of(b))
    return Interval(lo, hi)


operation(ends_of, Interval, _ends_of_interval)
operation(ends_of, float, _ends_of_number)
for _stubs, _method in (
    ((operator.pos,), _itself),
    ((operator.neg,), _neg),
    ((operator.add,), _add),
    ((operator.sub,), _sub),
    ((operator.mul,), _mul),
    ((operator.truediv,), _div),
    ((operator.pow,), _pow),
    ((abs, math.fabs, np.abs), _abs),
    ((min, np.minimum), _min),
    ((max, np.maximum), _max),
    ((math.sqrt, np.sqrt), _sqrt),
    ((math.floor, np.floor), _floor),
    ((math.exp, np.exp), _exp),
    ((math.log, np.log), _log),
    ((math.sin, np.sin), _sin),
    ((math.cos, np.cos), _cos),
    ((math.tan, np.tan), _tan),
    ((math.tanh, np.tanh), _tanh),
    ((math.atan2, np.arctan2), _atan2),
):
    for _stub in _stubs:
        operation(_stub, Interval, _method)


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


def _of_side(ends: Any, side: Any) -> Interval:
    return Interval(ends.lo[side], ends.hi[side])


def _sides(ends: Any) -> int:
    return len(ends.lo)


operation(operator.getitem, PerSide, _of_side)
operation(len, PerSide, _sides)

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


def hull_of(x: Interval, y: Interval) -> Interval:
    """Return the smallest interval that holds both."""
    lo, hi = arithmetic.hull(ends_of(x), ends_of(y))
    return Interval(lo, hi)


def _signed_square(x: Any) -> Interval:
    return Interval(down(x.lo * abs(x.lo)), up(x.hi * abs(x.hi)))


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
    (signed_square, _signed_square),
    (with_sign_of, _with_sign_of),
    (where_positive, _where_positive),
):
    operation(_plain, float, _plain)  # as it stands
    operation(_plain, Interval, _enclosed)
