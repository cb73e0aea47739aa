"""Standard circle map."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from limitsets.numbers.interval import Interval
from limitsets.numbers.jit import kernel, proof_kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.contract import register
from limitsets.systems.maps.textbook.shared import DOMAINS, Line, on_circle


class Circle(NamedTuple):
    """x' = x + omega - coupling / (2 pi) sin(2 pi x) mod 1 on the circle [0, 1); x = 1 is read as 0.

    Known answers: without coupling it is the rotation by omega. For a coupling of at most 1 all orbits have one
    rotation number; it is 0 (mode locking) where omega, or omega - 1, is within coupling / (2 pi) of 0. There the
    fixed points have sin(2 pi x) = 2 pi omega / coupling and the slopes 1 -+ sqrt(coupling^2 - (2 pi omega)^2).
    Source: Arnold, "Small denominators I", 1961.

    Attributes
    ----------
    omega : float
        Turn per step without coupling, 0 <= omega < 1 [turns].
    coupling : float
        Strength of the wave, K in the literature, 0 <= coupling <= 1. Beyond 1 the map folds, and images below 0
        count as outside.
    """

    omega: float = 0.6180339887498949
    coupling: float = 0.5


# 2 pi lies between these two neighbours.
TURN = (math.tau, math.nextafter(math.tau, 7.0))


@kernel
def _lifted(params: Circle, x: float) -> float:
    """Image before whole turns are taken off."""
    return x + params.omega - params.coupling / math.tau * math.sin(math.tau * x)


def _image(params: Circle, x: float, side: int) -> tuple[float, int, int]:
    after = _lifted(params, x)
    wraps = after >= 1.0
    after = after - 1.0 if wraps else after
    # Up to a coupling of 1 only rounding carries an image below 0.
    after = 0.0 if (after < 0.0) & (params.coupling <= 1.0) else after
    code = 1 if wraps else 0
    return after, side, code if (x >= 0.0) & (x <= 1.0) & (after >= 0.0) & (after <= 1.0) else codes.OUTSIDE


def _image_on(params: Circle, x: float, side: int, branch: int) -> tuple[float, int, float]:
    after = _lifted(params, x)
    slope = 1.0 - params.coupling * math.cos(math.tau * x)
    return after - 1.0 if branch == 1 else after, side, slope


def _margin(params: Circle, x: float, side: int) -> float:
    return _lifted(params, x) - 1.0


@proof_kernel
def _lifted_box(omega: Interval, coupling: Interval, x: Any) -> Interval:
    """Images before whole turns are taken off; exact where x is one number."""
    turn: Any = Interval(TURN[0], TURN[1])
    wave: Any = math.sin(turn * x) / turn
    return (omega + x) - coupling * wave  # type: ignore[no-any-return]  # an interval


def _image_box(params_lo: Circle, params_hi: Circle, lo: float, hi: float, side: int) -> Line:
    """Up to a coupling of 1 the map rises from omega to omega + 1."""
    omega, coupling = (
        Interval(params_lo.omega, params_hi.omega),
        Interval(params_lo.coupling, params_hi.coupling),
    )
    rises = (coupling.lo >= 0.0) & (coupling.hi <= 1.0)
    first, last = (
        _lifted_box(omega, coupling, Interval(lo, lo)),
        _lifted_box(omega, coupling, Interval(hi, hi)),
    )
    turned = Interval(first.lo, last.hi) if rises else _lifted_box(omega, coupling, Interval(lo, hi))
    bottom = 0.0 if rises & (omega.lo >= 0.0) else -math.inf
    top = 1.0 if rises & (omega.hi <= 1.0) else math.inf
    return on_circle(turned, bottom, top, lo, hi, side)


register(
    Circle,
    image=_image,
    image_on=_image_on,
    image_box=_image_box,
    margin=_margin,
    branches=("stay", "wrap"),
)
DOMAINS[Circle] = ((0.0, 1.0),)
