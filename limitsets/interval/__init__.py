"""Interval arithmetic for proofs: kernels on closed intervals ``(lo, hi)``.

Every operation is computed in the processor's rounding to nearest and then widened by a few units in the last place,
by arithmetic, so that the exact result of every choice of points lies inside.  That holds in all four rounding
directions of the processor and needs no change of its state; the family of such formulas is due to Rump, Zimmermann,
Boldo and Melquiond (BIT 49, 2009, doi 10.1007/s10543-009-0218-z).

Intervals are finite and below 1e150 in size.  There are no decorations: a result is to be accepted only on a
comparison that is true, so that a nan, which an impossible operation returns, rejects.  Sine, cosine and exponential
are our own, with error bounds that tests prove in exact rationals; libm may only propose numbers, which are then
verified.
"""

from limitsets.interval.arithmetic import (
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
    sqr,
    sqrt,
    sub,
)
from limitsets.interval.elementary import atan2, cos, sin
from limitsets.interval.exponential import exp
from limitsets.interval.guard import guard, rounding_is_sound

__all__ = [
    "absolute",
    "add",
    "atan2",
    "contains",
    "cos",
    "div",
    "exp",
    "guard",
    "hull",
    "maximum",
    "minimum",
    "mul",
    "neg",
    "point",
    "rounding_is_sound",
    "sin",
    "sqr",
    "sqrt",
    "sub",
]
