"""Derivatives with the value: a number and how fast it changes with one coordinate, in compiled code.

The entries of a `Dual` are floats, for slopes, or intervals: then the slope holds every derivative on the interval, and
of a function that has a corner there (`abs`, `min`, `max`) every number between its one-sided derivatives.  By the mean
value theorem (Lebourg's for corners) f(x) - f(m) lies in slope times x - m.  Where a function jumps (`floor`, `atan2`
across its cut) the slope is everything.

A number beside a `Dual` that is none (a float, an `Interval`) does not change with the coordinate.
Source: Griewank and Walther, "Evaluating Derivatives", 2008, chapter 3; Clarke, "Optimization and Nonsmooth Analysis",
1983, theorem 2.3.7.
"""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.numbers.interval.number import Interval, ends_of, larger, smaller
from limitsets.numbers.jit import number, operation


@number(twice=False)
@dataclass(frozen=True, slots=True)
class Dual:
    """A number and its derivative.

    Attributes
    ----------
    value, slope : float or Interval
        Both of one kind.
    """

    value: Any
    slope: Any


# ---------------------------------------------------------------- parts of any number


def value_of(x: Any) -> Any:
    """Return the value of a number, whether it changes or not."""
    return x.value if isinstance(x, Dual) else x


def slope_of(x: Any) -> Any:
    """Return the derivative of a number: 0 where it is no `Dual`."""
    return x.slope if isinstance(x, Dual) else 0.0


def seed(x: Any, slope: float) -> Dual:
    """Return a coordinate with its derivative."""
    return Dual(x, slope)


operation(seed, float, seed)
operation(seed, Interval, lambda x, slope: Dual(x, Interval(slope, slope)))
operation(value_of, Dual, lambda x: x.value)
operation(slope_of, Dual, lambda x: x.slope)
for _cls in (Interval, float):
    operation(value_of, _cls, lambda x: x)
    operation(slope_of, _cls, lambda x: 0.0)


# ---------------------------------------------------------------- what floats and intervals do each in their way


def _where_negative(x: Any, yes: Any, no: Any) -> Any:
    """Choose a slope by the sign of x; all that lies between the two where x may have both signs."""
    return yes if x < 0.0 else no


def _where_negative_box(x: Any, yes: Any, no: Any) -> Interval:
    one, two = ends_of(yes), ends_of(no)
    first, second = x.hi <= 0.0, x.lo >= 0.0
    both = (min(one[0], two[0]), max(one[1], two[1]))
    lo, hi = (two if second else one) if first | second else both
    return Interval(lo, hi)


def _flat(whole: Any) -> Any:
    """Return the slope of `floor`, whose value is given."""
    return 0.0


def _flat_box(whole: Any) -> Interval:
    rise = 0.0 if whole.lo == whole.hi else math.inf
    return Interval(-rise, rise)


def _but_at_the_cut(y: Any, x: Any, slope: Any) -> Any:
    """Return the slope of `atan2`, but for a box on which the angle jumps."""
    return slope


def _but_at_the_cut_box(y: Any, x: Any, slope: Any) -> Interval:
    a, b = ends_of(y), ends_of(x)
    jumps = (a[0] <= 0.0) & (a[1] >= 0.0) & (b[0] <= 0.0)
    return Interval(-math.inf if jumps else slope.lo, math.inf if jumps else slope.hi)


for _plain, _enclosed in (
    (_where_negative, _where_negative_box),
    (_flat, _flat_box),
    (_but_at_the_cut, _but_at_the_cut_box),
):
    operation(_plain, float, _plain)
    operation(_plain, Interval, _enclosed)


# ---------------------------------------------------------------- the operators


def _div(a: Any, b: Any) -> Dual:
    ratio = a.value / b.value
    return Dual(ratio, (a.slope - ratio * b.slope) / b.value)


def _div_right(a: Any, b: Any) -> Dual:
    ratio = a / b.value
    return Dual(ratio, -(ratio * b.slope) / b.value)


def _min(a: Any, b: Any) -> Dual:
    one, two = value_of(a), value_of(b)
    return Dual(smaller(one, two), _where_negative(one - two, slope_of(a), slope_of(b)))


def _max(a: Any, b: Any) -> Dual:
    one, two = value_of(a), value_of(b)
    return Dual(larger(one, two), _where_negative(two - one, slope_of(a), slope_of(b)))


# ---------------------------------------------------------------- functions


def _sqrt(a: Any) -> Dual:
    root = math.sqrt(a.value)
    return Dual(root, a.slope / (2.0 * root))


def _cbrt(a: Any) -> Dual:
    root = np.cbrt(a.value)
    return Dual(root, a.slope / (3.0 * root**2))


def _floor(a: Any) -> Dual:
    whole = math.floor(a.value)
    return Dual(whole, _flat(whole))


def _exp(a: Any) -> Dual:
    power = math.exp(a.value)
    return Dual(power, power * a.slope)


def _tan(a: Any) -> Dual:
    ratio = math.tan(a.value)
    return Dual(ratio, (1.0 + ratio**2) * a.slope)


def _tanh(a: Any) -> Dual:
    share = math.tanh(a.value)
    return Dual(share, (1.0 - share**2) * a.slope)


def _atan2(a: Any, b: Any) -> Dual:
    y, x = value_of(a), value_of(b)
    slope = (x * slope_of(a) - y * slope_of(b)) / (x**2 + y**2)
    return Dual(math.atan2(y, x), _but_at_the_cut(y, x, slope))


# Stubs; the method of two numbers that change, of one beside a plain one on its right, and on its left.
for _stubs, _method, _left, _right in (
    ((operator.pos,), lambda a: a, None, None),
    ((operator.neg,), lambda a: Dual(-a.value, -a.slope), None, None),
    (
        (operator.add,),
        lambda a, b: Dual(a.value + b.value, a.slope + b.slope),
        lambda a, b: Dual(a.value + b, a.slope),
        lambda a, b: Dual(a + b.value, b.slope),
    ),
    (
        (operator.sub,),
        lambda a, b: Dual(a.value - b.value, a.slope - b.slope),
        lambda a, b: Dual(a.value - b, a.slope),
        lambda a, b: Dual(a - b.value, -b.slope),
    ),
    (
        (operator.mul,),
        lambda a, b: Dual(a.value * b.value, a.value * b.slope + a.slope * b.value),
        lambda a, b: Dual(a.value * b, a.slope * b),
        lambda a, b: Dual(a * b.value, a * b.slope),
    ),
    ((operator.truediv,), _div, lambda a, b: Dual(a.value / b, a.slope / b), _div_right),
    (
        (operator.pow,),
        lambda a, count: Dual(a.value**count, count * a.value ** (count - 1) * a.slope),
        None,
        None,
    ),
    (
        (abs, math.fabs, np.abs),
        lambda a: Dual(abs(a.value), _where_negative(a.value, -a.slope, a.slope)),
        None,
        None,
    ),
    ((min, np.minimum), _min, None, None),
    ((max, np.maximum), _max, None, None),
    ((math.sqrt, np.sqrt), _sqrt, None, None),
    ((np.cbrt,), _cbrt, None, None),
    ((math.floor, np.floor), _floor, None, None),
    ((math.exp, np.exp), _exp, None, None),
    ((math.log, np.log), lambda a: Dual(math.log(a.value), a.slope / a.value), None, None),
    ((math.sin, np.sin), lambda a: Dual(math.sin(a.value), math.cos(a.value) * a.slope), None, None),
    ((math.cos, np.cos), lambda a: Dual(math.cos(a.value), -(math.sin(a.value) * a.slope)), None, None),
    ((math.tan, np.tan), _tan, None, None),
    ((math.tanh, np.tanh), _tanh, None, None),
    ((math.atan2, np.arctan2), _atan2, None, None),
):
    for _stub in _stubs:
        operation(_stub, Dual, _method, left=_left, right=_right, beside=(Interval,))
