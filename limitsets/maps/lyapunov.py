"""Largest Lyapunov exponent of one orbit: the mean logarithm of what a step does to a small displacement."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.errors import MapError
from limitsets.jit import generic, kernel
from limitsets.maps.contract import has_slope, kind_of
from limitsets.maps.drivers import start_of, step
from limitsets.maps.kernels import image_on, pick

__all__ = ["Lyapunov", "lyapunov"]

# The tangent vector is scaled back only when its size leaves this range: with a root, a logarithm and a division at
# every step the Henon map took 39 ns a step, not 4.
SMALL, LARGE = 1e-100, 1e100


@generic
def carry(xs: Any, slope: Any, tangent: Any, scale: float) -> Any:
    """Image of ``scale * tangent`` by a slope, and its size; chosen by the number of coordinates in `xs`."""


def _carry1(xs: Any, slope: Any, tangent: Any, scale: float) -> Any:
    u = slope * (scale * tangent)
    return u, abs(u)


def _carry2(xs: Any, slope: Any, tangent: Any, scale: float) -> Any:
    (a, b), (c, d) = slope
    x, y = scale * tangent[0], scale * tangent[1]
    u, v = a * x + b * y, c * x + d * y
    return (u, v), abs(u) + abs(v)


def _carry3(xs: Any, slope: Any, tangent: Any, scale: float) -> Any:
    (a, b, c), (d, e, f), (g, h, i) = slope
    x, y, z = scale * tangent[0], scale * tangent[1], scale * tangent[2]
    u, v, w = a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z
    return (u, v, w), abs(u) + abs(v) + abs(w)


for _n, _method in ((1, _carry1), (2, _carry2), (3, _carry3)):
    carry.on(_n, _method)


@kernel(entry=True)
def _growth(params: Any, xs: Any, tangents: Any, side: int, skip: int, count: int) -> tuple[float, int, int]:
    """Logarithm of the tangent vector's growth after `skip` steps, over how many steps, and the last code."""
    x, tangent, code = pick(xs, 0), pick(tangents, 0), 0
    total, size, scale, made = 0.0, 1.0, 1.0, 0
    for k in range(skip + count):
        if k == skip:
            total = -math.log(size)
        after, side_after, code = step(params, x, side)
        if code < 0:
            break
        _, _, slope = image_on(params, x, side, code)
        tangent, size = carry(xs, slope, tangent, scale)
        x, side, made = after, side_after, k + 1 - skip
        scale = 1.0
        if size < SMALL or size > LARGE:
            total += math.log(size)
            if size == 0.0:  # and stays 0
                break
            scale = 1.0 / size
            size = 1.0
    return total + math.log(size), made, code


@dataclass(frozen=True)
class Lyapunov:
    """Largest Lyapunov exponent of one orbit.

    Attributes
    ----------
    exponent : float or None
        Mean growth of a small displacement [natural logarithm per step]: positive for chaos, negative for an
        attracting cycle, minus infinity where a slope on the orbit is exactly 0. None where no step was left to
        take the mean over.
    steps : int
        Steps the mean is taken over.
    stopped : str or None
        The exit the orbit left through.
    """

    exponent: float | None
    steps: int
    stopped: str | None


def lyapunov(params: Any, x: Any, side: int, count: int, skip: int = 1000) -> Lyapunov:
    """Largest Lyapunov exponent along one orbit.

    Parameters
    ----------
    params : NamedTuple
        A map with `image_on`.
    x : float or sequence of float
        Start.
    side : int
        Side of the start.
    count : int
        Steps to take the mean over.
    skip : int
        Steps made before, so that the orbit has reached its attractor and the displacement its direction.

    Returns
    -------
    Lyapunov
        The exponent, and the exit if the orbit left.

    Raises
    ------
    MapError
        For a map without slopes, a start that is no state of the map, or a negative number of steps.

    Notes
    -----
    On a superstable orbit that only passes within rounding of a slope 0 the exponent is some -36, not -inf.
    Source: Benettin, Galgani, Giorgilli, Strelcyn, "Lyapunov characteristic exponents", Meccanica 15, 1980.

    Examples
    --------
    >>> from limitsets import maps
    >>> round(maps.lyapunov(maps.Logistic(4.0), 0.3, 0, 100_000).exponent, 2)  # ln 2
    0.69
    """
    kind = kind_of(params)
    start = start_of(params, x, side)
    if not has_slope(params):
        raise MapError("the map", kind.name, "a map with image_on", "register its slope with image_on=...")
    for name, value in (("the number of steps", count), ("the number of steps to skip", skip)):
        if value < 0:
            raise MapError(name, value, "an integer from 0", "count from 0")
    xs = tuple(np.array([value]) for value in start)
    tangents = tuple(np.array([1.0 / len(xs)]) for _ in xs)
    total, made, code = _growth(params, xs, tangents, side, skip, count)
    stopped = next((name for name, exit_code in kind.exits.items() if exit_code == code), None)
    if total == -math.inf:
        return Lyapunov(-math.inf, max(made, 0), stopped)
    if made <= 0 or math.isnan(total):
        return Lyapunov(None, max(made, 0), stopped)
    return Lyapunov(total / made, made, stopped)
