"""Throws with all details beside their end, for the command line, pictures and reports."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import MapError
from limitsets.feeder.thrower.impact import strike
from limitsets.feeder.thrower.motion import FullThrow
from limitsets.feeder.thrower.params import Throw, gather
from limitsets.feeder.thrower.throw import flip_margin, outcome, settle
from limitsets.numbers.jit import generic, kernel
from limitsets.systems.maps import codes
from limitsets.systems.maps.drivers import orbit
from limitsets.systems.maps.kernels import scattered

_gather = kernel(gather)


@generic
def details(params: Any, x: float, side: int) -> tuple[float, float, int, bool]:
    """Angle at the first impact, displacement, sides turned, whether another vertex would have landed first."""


@kernel
def _details(params: Throw, x: float, side: int) -> tuple[float, float, int, bool]:
    part = _gather(params, side)
    at, _ = settle(part, x)
    _, _, _, shift = outcome(part, x, at)
    return at.phi, shift, int(flip_margin(part, x, at) > 0.0), at.phi > part.corner


details.on(Throw, _details)


@kernel(entry=True)
def _all_details(params: Any, x: Any, side: Any, path: bool, seen: Any) -> None:
    phi, shift, turned, other = seen
    for k in range(x.size):
        # along a path throw number k of start number 0, as `orbit` draws them where throws scatter
        throw = scattered(params, 0, k) if path else params
        phi[k], shift[k], turned[k], other[k] = details(throw, x[k], side[k])


@kernel(entry=True)
def _fly(params: Throw, x: float, side: int) -> tuple[float, float, float, float]:
    part = _gather(params, side)
    at, _ = settle(part, x)
    omega, barrier = strike(part.flight, part, x, at)
    return at.phi, omega, 0.5 * part.inertia * omega * omega, barrier


@dataclass(frozen=True)
class Trace:
    """Successive throws of one start.

    Attributes
    ----------
    x, side : ndarray, shape (m + 1,)
        Where the part rests before the first throw and after each [length], and on which side.
    code : ndarray of int, shape (m,)
        What each throw was (`limitsets.systems.maps.codes`).
    phi : ndarray, shape (m,)
        Angle at the first impact [rad]; nan where the throw is outside the model.
    displacement : ndarray, shape (m,)
        Shift of the centre of mass [length], exact where x' - x has rounded away; nan outside the model.
    turned : ndarray of int, shape (m,)
        Sides turned, counterclockwise positive.
    other_vertex_first : ndarray of bool, shape (m,)
        Whether another vertex would have landed before the left one: an assumption of the model broken.
    stopped : str or None
        The exit, or "stalled".
    reason : str or None
        Why the last throw is outside the model, where it is.
    """

    x: NDArray[np.float64]
    side: NDArray[np.int64]
    code: NDArray[np.int64]
    phi: NDArray[np.float64]
    displacement: NDArray[np.float64]
    turned: NDArray[np.int64]
    other_vertex_first: NDArray[np.bool_]
    stopped: str | None
    reason: str | None = None


@dataclass(frozen=True)
class Flight:
    """One throw up to its impact.

    Attributes
    ----------
    phi : float
        Angle at the impact [rad], nan if there is none within a full turn.
    omega : float
        Rate of rotation after the impact, in units of the throw's; positive towards a flip.
    kinetic, barrier : float
        Energy of that rotation and what is left to climb to the top, in units of m w^2.
    """

    phi: float
    omega: float
    kinetic: float
    barrier: float


def _seen(params: Any, x: Any, side: Any, *, path: bool) -> tuple[Any, Any, Any, Any]:
    """Return the details of many throws: angles, displacements, sides turned, flags."""
    seen = np.empty(x.size), np.empty(x.size), np.empty(x.size, np.int64), np.empty(x.size, np.bool_)
    _all_details(params, x, side, path, seen)
    return seen


def _check_side(params: Throw | FullThrow, side: int) -> None:
    if not 0 <= side < params.a.size:
        raise MapError(
            "the side", side, f"an integer from 0 to {params.a.size - 1}", "name a side of the part"
        )


def _rests(params: Throw | FullThrow, side: int) -> bool:
    return bool(0.0 < params.a[side] < params.length[side])


def trace(params: Throw | FullThrow, x: float, side: int, count: int = 1) -> Trace:
    """Throw a part `count` times, with the angle, displacement and broken assumptions of each throw.

    Parameters
    ----------
    params : Throw or FullThrow
        The throw map.
    x : float
        Where the part rests [length].
    side : int
        On which side.
    count : int
        Throws; fewer are made when the part leaves or stalls.

    Returns
    -------
    Trace
        One entry per throw made.

    Raises
    ------
    MapError
        For a side the part has not, or on which it cannot rest.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.thrower import trace
    >>> round(float(trace(ls.load("paper-designed").map, 8.0, 2).phi[0]), 6)
    0.311437
    """
    _check_side(params, side)
    if not _rests(params, side):
        rests = [str(k) for k in range(params.a.size) if _rests(params, k)]
        raise MapError(
            "the side",
            side,
            f"a side on which the part rests: {', '.join(rests)}",
            f"it tips over on side {side}, so that no throw begins there",
        )
    path = orbit(params, x, side, count)
    made = path.code.size
    phi, shift, turned, other = _seen(params, path.x[:made], path.side[:made], path=True)
    outside = path.code == codes.OUTSIDE_MODEL
    phi[outside] = shift[outside] = math.nan
    other &= ~outside
    turned[outside] = 0
    reason = (
        _beyond_model(params, float(path.x[made - 1]), int(path.side[made - 1])) if outside.any() else None
    )
    return Trace(
        path.x,
        path.side,
        path.code,
        phi=phi,
        displacement=shift,
        turned=turned,
        other_vertex_first=other,
        stopped=path.stopped,
        reason=reason,
    )


def _beyond_model(params: Throw | FullThrow, x: float, side: int) -> str:
    """Say why a throw from x is outside the model."""
    a = float(params.a[side])
    if x <= a:
        return f"R <= a: no part rests on side {side} with its centre of mass at x = {x:.6g}, for a = {a:.6g}"
    if isinstance(params, FullThrow):
        return "no impact within a full turn, or a case that an effect does not describe (docs/model.md, effects)"
    return "no impact within a full turn"


def impact_angles(params: Throw | FullThrow, x: ArrayLike, side: int) -> NDArray[np.float64]:
    """Angles by which the part has turned when it lands, for many starts on one side.

    Parameters
    ----------
    params : Throw or FullThrow
        The throw map.
    x : array_like, shape (n,)
        Where the part rests [length].
    side : int
        On which side.

    Returns
    -------
    ndarray, shape (n,)
        Angles [rad]; nan outside the model.

    Raises
    ------
    MapError
        For a side the part has not.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.thrower import impact_angles
    >>> impact_angles(ls.load("paper-designed").map, [8.0, 1.0], 2).round(6)
    array([0.311437,      nan])
    """
    _check_side(params, side)
    starts = np.ascontiguousarray(x, dtype=np.float64)
    phi, _, _, _ = _seen(params, starts, np.full(starts.size, side, dtype=np.int64), path=False)
    inside = _rests(params, side) & (starts > params.a[side]) & (phi > 0.0) & (phi <= params.flight.full_turn)
    return np.where(inside, phi, math.nan)


def fly(params: Throw | FullThrow, x: float, side: int) -> Flight:
    """Return one throw's flight and impact in the minimal model.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.thrower import fly
    >>> flight = fly(ls.load("paper-designed").map, 21.0, 2)
    >>> flight.kinetic > flight.barrier and flight.omega > 0  # beyond r_2 = 20 it flips
    True
    """
    _check_side(params, side)
    bare = params.bare if isinstance(params, FullThrow) else params
    return Flight(*(float(value) for value in _fly(bare, float(x), side)))
