"""Where throws from places land, and how that changes with place and speed, with proved bounds.

The impact angle p of a start x solves x = P(p), P(p) = kappa p / 2 + S(p); the part comes to rest at x + D(p), less
the shift of a flip (`proofs/by_angle.py`).  With kappa above the vertex's distance from the centre of mass P grows and
has one solution.  The speed w (1 + delta) has kappa = kappa_0 / (1 + delta)^2.  At points a solution is proposed by
Newton's method, and the change of sign of P - x around it proves it; derivatives are enclosed over boxes of angles and
speeds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.proofs.intervals import Intervals
from limitsets.robust.brackets.moments import ERROR, moments
from limitsets.thrower import Exact, SmallAngle2

Array = NDArray[np.float64]

NEWTON = 12
# Roundings of a sum of a few terms, relative to their sizes.
ROUNDED = 2.0**-47


@dataclass(frozen=True)
class OneSide:
    """A side's numbers: middles, with how far each may be off in `slack`; of one parameter box.

    Attributes
    ----------
    number, after : int
        The side, and the one after a flip.
    a, d, h, kappa, shift : float
        See `thrower.params.Side`; kappa of a throw without deviation.
    spans : dict of str to (float, float)
        Enclosures of all that the decision depends on: a, d, h, kappa, rho, shift.
    slack : float
        The widest of them.
    flight, flip : NamedTuple
        The models.
    """

    number: int
    after: int
    a: float
    d: float
    h: float
    kappa: float
    shift: float
    spans: dict[str, tuple[float, float]]
    slack: float
    flight: Any
    flip: Any


class Landed(NamedTuple):
    """Impact angles and landing places of jogs, each within its error; `good` where that is proved."""

    phi: Array
    phi_error: Array
    place: Array
    error: Array
    good: NDArray[np.bool_]


class Derivatives(NamedTuple):
    """Enclosures over boxes: derivatives of the landing place T by x and delta, and of the angle by x and kappa."""

    x: Intervals
    delta: Intervals
    x_x: Intervals
    x_delta: Intervals
    delta_delta: Intervals
    phi_x: Intervals
    phi_kappa: Intervals


def one_side(lo: Any, hi: Any, number: int) -> OneSide:
    """Gather a side's numbers from the corners of the parameters."""
    after = (number + 1) % lo.a.size
    spans = {
        "a": (lo.a[number], hi.a[number]),
        "d": (lo.d[number], hi.d[number]),
        "h": (lo.surface_height, hi.surface_height),
        "kappa": (lo.kappa, hi.kappa),
        "rho": (lo.radius_of_gyration, hi.radius_of_gyration),
        "a_next": (lo.a[after], hi.a[after]),
        "length": (lo.length[after], hi.length[after]),
    }
    low = lo.a[number] + lo.length[after] - hi.a[after]
    high = hi.a[number] + hi.length[after] - lo.a[after]
    spans["shift"] = (low - ROUNDED * abs(low), high + ROUNDED * abs(high))
    middle = {name: 0.5 * (ends[0] + ends[1]) for name, ends in spans.items()}
    slack = max(ends[1] - ends[0] for ends in spans.values())
    a, d, h, kappa, shift = (float(middle[name]) for name in ("a", "d", "h", "kappa", "shift"))
    return OneSide(number, after, a, d, h, kappa, shift, spans, float(slack), lo.flight, lo.flip)


def kappa_of(side: OneSide, delta: Array) -> Array:
    """Return kappa of throws whose speed deviates."""
    factor = 1.0 + delta
    return side.kappa / (factor * factor)


def _start(side: OneSide, kappa: Array, phi: Array) -> tuple[Array, Array]:
    """P and its derivative."""
    if isinstance(side.flight, Exact):
        m = moments(phi, 1)
        along = side.a * m.c[0] - side.d * m.s[0]
        return 0.5 * kappa * phi + along, 0.5 * kappa - side.a * m.s[1] - side.d * m.c[1]
    pull = kappa - side.d if isinstance(side.flight, SmallAngle2) else kappa
    return side.a + 0.5 * pull * phi, 0.5 * pull


def _jog(side: OneSide, phi: Array) -> Array:
    if not isinstance(side.flight, Exact):
        return -side.h * phi
    m = moments(phi, 0)
    return phi * (side.a * m.s[0] - side.d * (1.0 - m.c[0]) - side.h)


def landed(side: OneSide, x: Array, delta: Array) -> Landed:
    """Throw from places on a side with deviations of the speed; both of one shape."""
    kappa = kappa_of(side, delta)
    phi = 2.0 * (x - side.a) / (kappa - side.d)
    for _ in range(NEWTON):
        at, slope = _start(side, kappa, phi)
        phi = np.clip(phi - (at - x) / slope, 0.0, 2.0 * math.pi)
    at, slope = _start(side, kappa, phi)
    size = side.a + side.d
    # The parameters: a and d enter P with factors up to 1, kappa with phi/2; a, d, h enter D with up to 2 phi.
    known = 2.0 * size * ERROR + ROUNDED * (np.abs(x) + kappa * phi + size) + (2.0 + phi) * side.slack
    # P'' is below (a + d)/3: within 0.01 of phi P' is within a hundredth of it.
    steep = 0.99 * slope - 0.01 * size
    phi_error = (np.abs(at - x) + known) / steep
    rate = side.a + 2.0 * side.d + abs(side.h)
    place = x + _jog(side, phi)
    error = (
        rate * phi_error + 2.0 * phi * (size * ERROR + 2.0 * side.slack) + ROUNDED * (np.abs(x) + phi * rate)
    )
    # The shift of a flip is known to its slack.
    error = error + 3.0 * side.slack + ROUNDED * side.shift
    good = (steep > 0.0) & (phi_error < 0.01) & (phi > phi_error) & (phi + phi_error <= 2.0 * math.pi)
    return Landed(phi, phi_error, place, error, good)


def _ball(middle: Array, radius: Array) -> Intervals:
    return Intervals(middle - radius, middle + radius)


def slopes(side: OneSide, phi: Intervals, delta: Intervals) -> Derivatives:
    """Enclose the derivatives over boxes of impact angles and deviations of the speed."""
    middle, half = 0.5 * (phi.lo + phi.hi), 0.51 * (phi.hi - phi.lo)
    a, d, h, kappa_0 = (Intervals.of(*side.spans[name]) for name in ("a", "d", "h", "kappa"))
    factor = 1.0 + delta
    kappa = kappa_0 / (factor * factor)
    if isinstance(side.flight, Exact):
        m = moments(middle)
        # S' = -a s_1 - d c_1, S'' = -a c_2 + d s_2; c_k and s_k change by less than phi / (k + 2).
        c1, s1 = (_ball(f, half / 3.0 + ERROR) for f in (m.c[1], m.s[1]))
        c2, s2 = (_ball(f, half / 4.0 + ERROR) for f in (m.c[2], m.s[2]))
        bend, p_slope = d * s2 - a * c2, 0.5 * kappa - a * s1 - d * c1
        sine = _ball(middle * m.c[0], half + 7.0 * ERROR)
        versin = _ball(middle * m.s[0], half + 7.0 * ERROR)
        rate, turn = a * sine - d * versin - h, a * (1.0 - versin) - d * sine
    else:
        pull = kappa - d if isinstance(side.flight, SmallAngle2) else kappa
        none = Intervals(np.zeros(middle.shape), np.zeros(middle.shape))
        bend, p_slope, rate, turn = none, 0.5 * pull + none, none - h, none
    one = 1.0 / p_slope
    phi_kappa = -0.5 * (phi * one)
    # Derivatives of 1/P' and -phi/(2 P') along x and kappa; P' changes by P'' with phi and by 1/2 with kappa.
    square = one * one
    mixed = bend * phi_kappa + 0.5
    phi_xx, phi_xk = -(bend * square * one), -(mixed * square)
    phi_kk = 0.5 * (phi * square * mixed) - 0.5 * (phi_kappa * one)
    by_kappa = rate * phi_kappa
    first, second = -2.0 * (kappa / factor), 6.0 * (kappa / (factor * factor))
    x_kappa = turn * one * phi_kappa + rate * phi_xk
    kappa_kappa = turn * phi_kappa * phi_kappa + rate * phi_kk
    return Derivatives(
        1.0 + rate * one,
        by_kappa * first,
        turn * square + rate * phi_xx,
        x_kappa * first,
        kappa_kappa * first * first + by_kappa * second,
        one,
        phi_kappa,
    )
