"""What textbook maps share: their usual domains, the answers of `image_box`, and an exponential that vectorises.

exp x = 2^k exp r with k = round(x / ln 2) and abs(r) <= ln(2)/2; exp r is summed from its series. 2^k is built from
the bits of k, in two factors because k leaves the range of a double's exponent at either end.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np

from limitsets.base import MapError
from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import kernel, proof_kernel
from limitsets.systems.maps.derived import NO_WITNESS

# ----------------------------------------------------------------
# Domains of textbook maps as in the literature, as plain pairs of numbers.
#
# Pairs, and not `limitsets.cells.Domain`: rooms on one floor do not import each other.


DOMAINS: dict[type, tuple[tuple[float, float], ...]] = {}
"""Class of a map -> one pair (lo, hi) per coordinate; each map's file adds its own."""


def domain_of(params: Any) -> list[tuple[float, float]]:
    """Return the domain that a textbook map is usually looked at on.

    Parameters
    ----------
    params : NamedTuple
        A textbook map.

    Returns
    -------
    list of (float, float)
        One pair (lo, hi) per coordinate.

    Raises
    ------
    MapError
        For a map that is none of them.

    Examples
    --------
    >>> from limitsets import maps
    >>> maps.domain_of(maps.Leslie())
    [(-0.001, 90.0), (-0.001, 70.0)]
    """
    pairs = DOMAINS.get(type(params))
    if pairs is None:
        known = ", ".join(sorted(cls.__name__ for cls in DOMAINS))
        raise MapError("the map", type(params).__name__, f"one of {known}", "give the domain yourself")
    return list(pairs)


# ----------------------------------------------------------------
# Answers of `image_box`: one or two boxes, and whether they are proved.
#
# A box that is not finite (an operation overflowed, or was impossible) proves nothing.


Point: TypeAlias = tuple[float, float]
Pair: TypeAlias = tuple[Interval, Interval]

LineSlot: TypeAlias = tuple[float, float, int, int]
Line: TypeAlias = tuple[int, LineSlot, LineSlot, Point]
"""Answer in one dimension: count, two slots (lo', hi', side', branch), witness."""

PlaneSlot: TypeAlias = tuple[Point, Point, int, int]
Plane: TypeAlias = tuple[int, PlaneSlot, PlaneSlot, Point]
"""Answer in two dimensions."""


@proof_kernel
def _count(first: bool, second: bool, sound: bool) -> int:
    """Count the images: -1 where there is none or one of them is not sound."""
    count = (1 if first else 0) + (1 if second else 0)
    return count if sound & (count > 0) else -1


@proof_kernel
def _finite(a: Interval) -> bool:
    return (a.lo <= a.hi) & (a.hi - a.lo < math.inf)


@proof_kernel
def rectangle(lo: Point, hi: Point) -> Pair:
    """Intervals of the coordinates of a box."""
    return Interval(lo[0], hi[0]), Interval(lo[1], hi[1])


@proof_kernel
def line(a: Interval, side: int, branch: int) -> Line:
    """One image."""
    slot = (a.lo, a.hi, side, branch)
    return _count(True, False, _finite(a)), slot, slot, NO_WITNESS


@proof_kernel
def line_of_two(first: bool, a: Interval, second: bool, b: Interval, side: int) -> Line:
    """Images of branches 0 and 1, each as far as it is possible."""
    sound = (_finite(a) | (not first)) & (_finite(b) | (not second))
    zero, one = (a.lo, a.hi, side, 0), (b.lo, b.hi, side, 1)
    return _count(first, second, sound), zero if first else one, one, NO_WITNESS


@proof_kernel
def on_circle(moved: Interval, bottom: float, top: float, lo: float, hi: float, side: int) -> Line:
    """Images of [lo, hi] on the circle [0, 1]: what stays, from `bottom` on, and what wraps, up to `top`.

    Both branches at equality; `moved` is the image before a whole turn is taken off.
    """
    less = moved - 1.0
    circle = (lo >= 0.0) & (hi <= 1.0)
    stay = Interval(max(moved.lo, bottom), min(moved.hi, 1.0))
    wrap = Interval(max(less.lo, 0.0), min(less.hi, top))
    return line_of_two(circle & (moved.lo <= 1.0), stay, circle & (moved.hi >= 1.0), wrap, side)


@proof_kernel
def plane(a: Pair, side: int, branch: int) -> Plane:
    """One image in the plane."""
    slot = ((a[0].lo, a[1].lo), (a[0].hi, a[1].hi), side, branch)
    return _count(True, False, _finite(a[0]) & _finite(a[1])), slot, slot, NO_WITNESS


# ----------------------------------------------------------------
# The exponential without branch or library call, so that a loop over an array vectorises (math.exp in one does
# not).


# exp r = 1 + r + r^2 (E2 + E3 r + ...). The first term left out, r^14/14!, is below 5e-18.
E2, E3, E4, E5, E6, E7, E8, E9, E10, E11, E12, E13 = (1 / math.factorial(k) for k in range(2, 14))
PER_LN2 = 1.0 / math.log(2.0)
# ln 2 in two parts; the first ends in 32 zero bits, so that its product with k is exact.
LN2_HI = 6.93147180369123816490e-01
LN2_LO = 1.90821492927058770002e-10
# Adding 1.5 2^52 rounds to an integer and leaves it in the lowest bits.
ROUND = 6755399441055744.0
BIAS = 1023.0


@kernel
def _power_of_two(k: float) -> float:
    """2^k for a whole number k from -1022 to 1023: k in the place of the exponent."""
    bits = np.float64(k + (ROUND + BIAS)).view(np.int64) << 52
    return np.int64(bits).view(np.float64)


@kernel
def exponential(x: float) -> float:
    """Exponential of x within one unit in the last place; 0, inf and nan where exp has them.

    Examples
    --------
    >>> from limitsets.systems.maps.textbook.shared import exponential
    >>> exponential(1.0)
    2.718281828459045
    """
    x = -746.0 if x < -746.0 else x  # 0 there
    x = 710.0 if x > 710.0 else x  # inf there
    k = (x * PER_LN2 + ROUND) - ROUND
    r = (x - k * LN2_HI) - k * LN2_LO
    tail = E8 + r * (E9 + r * (E10 + r * (E11 + r * (E12 + r * E13))))
    tail = E2 + r * (E3 + r * (E4 + r * (E5 + r * (E6 + r * (E7 + r * tail)))))
    half = (0.5 * k + ROUND) - ROUND
    return ((1.0 + (r + r * r * tail)) * _power_of_two(half)) * _power_of_two(k - half)
