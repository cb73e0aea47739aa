"""Moments of sine and cosine: what the flight's formulas depend on, without cancellation and with a bound.

    c_k(p) = int_0^1 t^k cos(p t) dt,      s_k(p) = int_0^1 t^k sin(p t) dt,

so that sin p = p c_0, 1 - cos p = p s_0, and c_k' = -s_(k+1), s_k' = c_(k+1), none above 1/(k + 2) in size.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# The first term left out is below 1e-22 for p <= 2 pi.
TERMS = 25
# The terms of a sum add up to less than e^p <= 536; Horner's rule loses fewer than 4 TERMS half units of it.
ERROR = 1e-11

_COS = [[(-1) ** j / (math.factorial(2 * j) * (2 * j + k + 1)) for j in range(TERMS)] for k in range(3)]
_SIN = [[(-1) ** j / (math.factorial(2 * j + 1) * (2 * j + k + 2)) for j in range(TERMS)] for k in range(3)]


class Moments(NamedTuple):
    """c_0, c_1, c_2 and s_0, s_1, s_2 at some angles, each within `ERROR`."""

    c: tuple[Array, Array, Array]
    s: tuple[Array, Array, Array]


def _horner(coefficients: list[float], q: Array) -> Array:
    total = np.full(q.shape, coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        total *= q
        total += coefficient
    return total


def moments(phi: Array, most: int = 2) -> Moments:
    """Evaluate them at angles from 0 to 2 pi, up to k = `most`; nan beyond."""
    q = phi * phi
    count = range(most + 1)
    return Moments(
        tuple(_horner(_COS[k], q) for k in count),  # type: ignore[arg-type]  # as many as asked for
        tuple(phi * _horner(_SIN[k], q) for k in count),  # type: ignore[arg-type]  # likewise
    )
