"""Bisection along a line: changes between samples, down to adjacent floats, and changes hidden between samples.

Nothing here knows a map.  A bracket that holds a change is halved until its ends are neighbours.  Two changes between
a pair of samples of one sign have an extremum towards zero between them: golden section follows each to its top.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from limitsets.maps import codes

Array = NDArray[np.float64]
Codes = NDArray[np.int64]
Flags = NDArray[np.bool_]

# Golden section: 0.618^50 = 4e-11 of two sample spacings, where the top of a parabola is flat to rounding.
NARROWINGS = 50
GOLDEN = 0.5 * (5.0**0.5 - 1.0)
SHARES = np.arange(1, 16)[:, None] / 16.0


def sign_code(values: Array) -> Codes:
    """1 where a number is positive, 0 where it is not, `OUTSIDE_MODEL` for nan."""
    return np.where(np.isnan(values), codes.OUTSIDE_MODEL, values > 0.0).astype(np.int64)


def inserted(x: Array, extra: Array) -> Array:
    """Put more samples among the samples: ascending, each once."""
    return np.unique(np.concatenate([x, extra]))


def bisected(lo: Array, hi: Array, is_above: Callable[[Array, Array, Array], Flags]) -> tuple[Array, Array]:
    """Halve brackets until their ends are adjacent floats.

    Parameters
    ----------
    lo, hi : ndarray, shape (n,)
        The brackets.
    is_above : callable
        ``is_above(lo, middle, hi)``: whether what is sought lies in the upper half, for all brackets at once.

    Returns
    -------
    lo, hi : ndarray, shape (n,)
        The halved brackets.
    """
    while True:
        middle = lo + 0.5 * (hi - lo)
        inside = (middle > lo) & (middle < hi)
        if not inside.any():
            return lo, hi
        above = is_above(lo, middle, hi)
        lo, hi = np.where(inside & above, middle, lo), np.where(inside & ~above, middle, hi)


def _first_change(
    code_of: Callable[[Array], Codes], lo: Array, hi: Array, before: Codes
) -> tuple[Array, Array]:
    """Cut brackets until their ends are adjacent floats: 16 parts at a time, for a call of a map is dear by itself."""
    at = np.arange(lo.size)
    while True:
        points = lo + SHARES * (hi - lo)
        inside = (points > lo) & (points < hi)
        if not inside.any():
            return lo, hi
        same = np.where(inside, code_of(points.ravel()).reshape(points.shape) == before, points <= lo)
        count = np.logical_and.accumulate(same, axis=0).sum(axis=0)  # below the first change
        ends = np.concatenate([lo[None], points, hi[None]])
        lo, hi = ends[count, at], ends[count + 1, at]


def located(code_of: Callable[[Array], Codes], x: Array) -> tuple[Array, Codes]:
    """Refine samples until every change of code stands between adjacent floats: samples, and their codes."""
    code = code_of(x)
    while True:
        k = np.flatnonzero((code[1:] != code[:-1]) & (np.nextafter(x[:-1], np.inf) < x[1:]))
        if k.size == 0:
            return x, code
        lo, hi = _first_change(code_of, x[k], x[k + 1], code[k])
        x = inserted(x, np.concatenate([lo, hi]))
        code = code_of(x)


def _dips(values: Array, x: Array) -> tuple[Array, Array, Array]:
    """Brackets around samples nearer to zero than their neighbours: lower end, upper end, sign of the sample.

    A sample beside a border, of the range or of where there are values, is compared on its other side alone.
    """
    sign = np.where(values > 0.0, 1.0, -1.0)
    here, left, right = sign * values, np.full(x.size, np.nan), np.full(x.size, np.nan)
    left[1:], right[:-1] = sign[1:] * values[:-1], sign[:-1] * values[1:]
    no_left, no_right = np.isnan(left), np.isnan(right)
    least = (no_left | (left > here)) & (no_right | (right >= here))
    k = np.flatnonzero(np.isfinite(values) & least & ~(no_left & no_right))
    return x[k - ~no_left[k]], x[k + ~no_right[k]], sign[k]


def hidden(value_of: Callable[[Array], Array], x: Array) -> Array:
    """Points whose value has the other sign than the samples around them.

    Parameters
    ----------
    value_of : callable
        The values, nan where there are none.
    x : ndarray, shape (n,)
        Samples, ascending.

    Returns
    -------
    ndarray
        Points found on the way to the tops of all extrema towards zero; none where no top crosses it.
    """
    a, b, sign = _dips(value_of(x), x)
    if sign.size == 0:
        return np.empty(0)
    found = []
    for _ in range(NARROWINGS):
        c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
        at_c, at_d = value_of(c), value_of(d)
        found += [at[sign_code(value) == (sign < 0)] for at, value in ((c, at_c), (d, at_d))]
        lower = sign * at_c < sign * at_d
        a, b = np.where(lower, a, c), np.where(lower, d, b)
    return np.concatenate(found)
