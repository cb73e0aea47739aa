"""Largest Lyapunov exponent of one orbit: the mean logarithm of what a step does to a small displacement."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.base import MapError, arguments_checked
from limitsets.numbers.jit import generic, kernel
from limitsets.systems.cells import Domain
from limitsets.systems.maps.contract import compiled_kind_of, has_slope
from limitsets.systems.maps.drivers import Orbit, as_orbit, closing_of, empty_orbit, start_in, step
from limitsets.systems.maps.kernels import Closing, image_on, in_domain, pick, put

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


# Steps recorded at a time, where the orbit is not asked for.
CHUNK = 16_384


@kernel(entry=True)
def _growth(
    params: Any, xs: Any, sides: Any, code_after: Any, tangents: Any, sums: Any, axes: Closing | None
) -> int:
    """Fill an orbit from its first state and carry a tangent vector along; the number of steps before an exit.

    `sums`: logarithm of the growth so far, size of the vector since it was scaled back last, the scale to come, and
    steps carried: no more once the vector is 0.
    The slope is not waited for by the next step, so that the vector costs next to nothing beside the orbit.
    """
    tangent = pick(tangents, 0)
    total, size, scale, carried = sums[0], sums[1], sums[2], sums[3]
    made: int = code_after.size
    for k in range(code_after.size):
        x, side = pick(xs, k), sides[k]
        after, side_after, code = step(params, x, side)
        put(xs, k + 1, in_domain(after, side_after, axes))
        sides[k + 1], code_after[k] = side_after, code
        if code < 0:
            made = k + 1
            break
        if size == 0.0:  # and stays 0
            continue
        _, _, slope = image_on(params, x, side, code)
        tangent, size = carry(xs, slope, tangent, scale)
        scale, carried = 1.0, carried + 1.0
        if size < SMALL or size > LARGE:
            total += math.log(size)
            if size > 0.0:
                scale, size = 1.0 / size, 1.0
    put(tangents, 0, tangent)
    sums[0], sums[1], sums[2], sums[3] = total, size, scale, carried
    return made


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


@arguments_checked
def lyapunov(
    params: Any, x: Any, side: int, count: int, skip: int = 1000, *, domain: Domain | None = None
) -> Lyapunov:
    """Largest Lyapunov exponent along one orbit.

    Parameters
    ----------
    params : NamedTuple
        A map with `image_on`.
    x : float or sequence of float
        Start, in the map's unit.
    side : int
        Side of the start.
    count : int
        Steps to take the mean over.
    skip : int
        Steps made before, so that the orbit has reached its attractor and the displacement its direction.
    domain : Domain, optional
        With axes that close: each state is turned to it, as by `orbit`.

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
    tangent = _Tangent(params, x, side, count, skip, domain=domain)
    xs, sides, code = empty_orbit(tangent.start, side, min(max(skip, count), CHUNK))
    for steps in (skip, count):
        tangent.begin()
        while steps > 0 and not tangent.left:
            most = min(steps, code.size)
            made = tangent.follow(xs, sides, code[:most])
            for values in (*xs, sides):
                values[0] = values[made]
            steps -= most
    return tangent.answer(skip)


def orbit_with_exponent(
    params: Any, x: Any, side: int, skip: int, count: int, *, domain: Domain | None = None
) -> tuple[Orbit, Lyapunov]:
    """`orbit` of skip + count steps and `lyapunov` of the same start, in one pass, for a map that does not scatter."""
    tangent = _Tangent(params, x, side, count, skip, domain=domain)
    xs, sides, code = empty_orbit(tangent.start, side, skip + count)
    made = 0
    for begin, end in ((0, skip), (skip, skip + count)):
        tangent.begin()
        if not tangent.left:
            made = begin + tangent.follow(
                tuple(v[begin : end + 1] for v in xs), sides[begin:], code[begin:end]
            )
    return as_orbit(params, xs, sides, code, made), tangent.answer(skip)


class _Tangent:
    """A tangent vector on its way along an orbit, beginning where `start` is."""

    def __init__(
        self, params: Any, x: Any, side: int, count: int, skip: int, *, domain: Domain | None
    ) -> None:
        self.params, self.kind = params, compiled_kind_of(params, "lyapunov")
        self.start, self.axes = start_in(params, x, side, domain), closing_of(domain)
        if not has_slope(params):
            raise MapError(
                "the map", self.kind.name, "a map with image_on", "register its slope with image_on=..."
            )
        for name, value in (("the number of steps", count), ("the number of steps to skip", skip)):
            if value < 0:
                raise MapError(name, value, "an integer from 0", "count from 0")
        dimension = len(self.start)
        self.tangents = tuple(np.array([1.0 / dimension]) for _ in self.start)
        self.sums = np.array([0.0, 1.0, 1.0, 0.0])
        self.left = False
        self.stopped: str | None = None

    def begin(self) -> None:
        """Measure growth from here."""
        if self.sums[1] > 0.0:
            self.sums[0] = -math.log(self.sums[1])

    def follow(self, xs: Any, sides: Any, code: Any) -> int:
        """Fill an orbit; steps made before an exit."""
        made = int(_growth(self.params, xs, sides, code, self.tangents, self.sums, self.axes))
        if made and code[made - 1] < 0:
            self.left = True
            self.stopped = next(
                (name for name, number in self.kind.exits.items() if number == code[made - 1]), None
            )
        return made

    def answer(self, skip: int) -> Lyapunov:
        """Mean of the growth."""
        total, size, _, carried = self.sums.tolist()
        steps = max(int(carried) - skip, 0)
        if size == 0.0:
            return Lyapunov(-math.inf, steps, self.stopped)
        grown = total + math.log(size)
        if steps == 0 or math.isnan(grown):
            return Lyapunov(None, steps, self.stopped)
        return Lyapunov(grown / steps, steps, self.stopped)
