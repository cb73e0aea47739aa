"""Interval arithmetic for proofs: kernels on closed intervals ``(lo, hi)``.

Every operation is computed in the processor's rounding to nearest and then widened by a few units in the last place,
by arithmetic, so that the exact result of every choice of points lies inside.  That holds in all four rounding
directions of the processor and needs no change of its state; the family of such formulas is due to Rump, Zimmermann,
Boldo and Melquiond (BIT 49, 2009, doi 10.1007/s10543-009-0218-z).

The contract, for every operand:

* An interval is a set of real numbers, all those from lo to hi; either end may be infinite.
* 0 times an infinite end is 0.  What overflows has an infinite end.
* The empty set is ``(nan, nan)``.  Every operation on it gives it again; `hull` gives the other operand.  Half a nan
  never occurs: what is done with a pair that has one nan is done with the empty set.
* Divided by an interval that holds 0, anything is all numbers.
* `sqrt` and `log` enclose the part that is defined, the empty set where there is none.

There are no decorations.  A result is to be accepted only on a comparison that is true, so that a nan rejects.  That
a function was asked beyond where it is defined is marked beside the intervals instead, by `sqrt` and `log` of an
interval that is only partly defined, and by `sin` and `cos` of one that is not bounded (plain numbers give nan there):
the cell whose image is then being computed counts as one of which nothing is proved, whatever a kernel makes of
the number.  So does a cell whose image has an infinite or a nan end.  A kernel for which that is not meant, because
only rounding carries an operand below 0, takes ``maximum(a, (0.0, 0.0))`` first.

Sine, cosine and exponential are our own, with error bounds that tests prove in exact rationals, and the logarithm is
summed in intervals; libm may only propose numbers, which are then verified.
"""

from limitsets.numbers.interval.arithmetic import (
    absolute,
    add,
    contains,
    div,
    hull,
    maximum,
    minimum,
    mul,
    neg,
    point,
    power,
    sqr,
    sqrt,
    sub,
)
from limitsets.numbers.interval.dual import Dual, seed, slope_of, value_of
from limitsets.numbers.interval.elementary import atan2, cos, sin
from limitsets.numbers.interval.exponential import exp, log, tanh
from limitsets.numbers.interval.number import Interval, intervals_between
from limitsets.numbers.interval.rounding import guard, rounding_is_sound

__all__ = [
    "Dual",
    "Interval",
    "absolute",
    "add",
    "atan2",
    "contains",
    "cos",
    "div",
    "exp",
    "guard",
    "hull",
    "intervals_between",
    "log",
    "maximum",
    "minimum",
    "mul",
    "neg",
    "point",
    "power",
    "rounding_is_sound",
    "seed",
    "sin",
    "slope_of",
    "sqr",
    "sqrt",
    "sub",
    "tanh",
    "value_of",
]
