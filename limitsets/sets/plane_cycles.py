"""Cycles of a map of the plane by Newton's method on F^p(x) = x from many starts.

In the plane pieces have no order and words no intervals; nothing tells whether all cycles were found, and the answer
says so.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitsets.errors import AnswerError
from limitsets.jit import kernel
from limitsets.maps.contract import has_slope, kind_of
from limitsets.maps.drivers import images, step
from limitsets.maps.kernels import image_on
from limitsets.sets.cycle import NEAR, Array, Cycle, Cycles, Ints, distinct, require_period

__all__ = ["cycles_from"]

NEWTON_STEPS = 60
# Relative to the extent of x: a Newton step this small has arrived, and an orbit closed to this is one.
ARRIVED = 1e-13
CLOSED = 1e-6


@kernel(entry=True)
def _returns(
    params: Any, count: int, u: Any, v: Any, side: Any, after: Any, jacobian: Any, ends: Any
) -> None:
    """F^count of starts in the plane and its derivative; `ends` is the side, or -1 for an orbit that leaves."""
    for k in range(u.size):
        x, at, code = (u[k], v[k]), side[k], 0
        a, b, c, d = 1.0, 0.0, 0.0, 1.0
        for _ in range(count):
            to, side_to, code = step(params, x, at)
            if code < 0:
                break
            _, _, slope = image_on(params, x, at, code)
            (p, q), (r, s) = slope
            a, b, c, d = p * a + q * c, p * b + q * d, r * a + s * c, r * b + s * d
            x, at = to, side_to
        after[0, k], after[1, k] = x
        jacobian[0, k], jacobian[1, k], jacobian[2, k], jacobian[3, k] = a, b, c, d
        ends[k] = at if code >= 0 else -1


def _returned(params: Any, count: int, x: Array, side: Ints) -> tuple[Array, Array, Ints]:
    """F^count, its derivative (n, 4) and the side reached (-1: left) of states (n, 2)."""
    after, jacobian, ends = np.empty((2, len(x))), np.empty((4, len(x))), np.empty(len(x), np.int64)
    u, v = np.ascontiguousarray(x[:, 0]), np.ascontiguousarray(x[:, 1])
    _returns(params, count, u, v, np.ascontiguousarray(side), after, jacobian, ends)
    return after.T.copy(), jacobian.T.copy(), ends


def _newton(params: Any, count: int, x: Array, side: Ints, scale: float) -> tuple[Array, Ints]:
    """Newton's method on F^count(x) = x from all starts at once: the roots reached and their sides."""
    roots, sides = [np.empty((0, 2))], [np.empty(0, np.int64)]
    for _ in range(NEWTON_STEPS):
        if not len(x):
            break
        y, j, ends = _returned(params, count, x, side)
        a, b, c, d = j[:, 0] - 1.0, j[:, 1], j[:, 2], j[:, 3] - 1.0
        with np.errstate(all="ignore"):  # starts that run away
            f = y - x
            det = a * d - b * c
            move = np.stack([(d * f[:, 0] - b * f[:, 1]) / det, (a * f[:, 1] - c * f[:, 0]) / det], axis=1)
            size = np.abs(move).max(axis=1)
            alive = (ends == side) & np.isfinite(size) & (size < 10.0 * scale)
            better = x - move
        arrived = alive & (size <= ARRIVED * scale)
        roots.append(better[arrived])
        sides.append(side[arrived])
        x, side = better[alive & ~arrived], side[alive & ~arrived]
    return np.concatenate(roots), np.concatenate(sides)


def _through(params: Any, x: Array, side: int, period: int) -> Cycle | None:
    """Follow one root around and measure it; None where it leaves."""
    points, sides, branches = np.empty((period, 2)), np.empty(period, np.int64), np.empty(period, np.int64)
    at, on = x, side
    for j in range(period):
        points[j], sides[j] = at, on
        found = images(params, at[None, :], on)
        branches[j] = found.code[0]
        if found.code[0] < 0:
            return None
        at, on = found.x[0], int(found.side[0])
    _, jacobian, _ = _returned(params, period, points[:1], sides[:1])
    size = float(np.abs(np.linalg.eigvals(jacobian.reshape(2, 2))).max())
    return Cycle.through(points, sides, branches, size, float(np.abs(at - points[0]).max()))


def cycles_from(params: Any, starts: ArrayLike, side: ArrayLike, up_to: int) -> Cycles:
    """Find periodic orbits of a map of the plane by Newton's method from given starts.

    Parameters
    ----------
    params : NamedTuple
        A two-dimensional map with `image_on`.
    starts : array_like, shape (n, 2)
        Starts, such as the centres of recurrent cells.
    side : int or array_like of int, shape (n,)
        Their sides.
    up_to : int
        Largest period.

    Returns
    -------
    Cycles
        `complete` is False: whether all were found is not known.

    Raises
    ------
    AnswerError
        For a map of another dimension or without `image_on`, or a period below 1.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.sets import cycles_from
    >>> found = cycles_from(maps.Henon(1.4, 0.3), [[x / 4, 0.0] for x in range(-6, 7)], 0, 1)
    >>> [round(float(cycle.x[0, 0]), 6) for cycle in found]
    [-1.131354, 0.631354]
    """
    require_period(up_to)
    kind = kind_of(params)
    if kind.dimension != 2 or not has_slope(params):
        raise AnswerError("the map", kind.name, "a map of the plane with image_on", "register image_on")
    x = np.asarray(starts, dtype=np.float64).reshape(-1, 2)
    sides = np.array(np.broadcast_to(np.asarray(side, dtype=np.int64), (len(x),)))
    scale = float(np.abs(x).max())
    found: list[Cycle] = []
    for period in range(1, up_to + 1):
        roots, on = _newton(params, period, x, sides, scale)
        keys = np.column_stack([np.round(roots / (NEAR * scale)), on])
        _, one_of_each = np.unique(keys, axis=0, return_index=True)
        orbits = [_through(params, roots[k], int(on[k]), period) for k in one_of_each]
        found += [orbit for orbit in orbits if orbit is not None and orbit.residual <= CLOSED * scale]
    kept = distinct(found, 1e3 * NEAR * scale)
    return Cycles(kept, complete=False, how="by Newton's method from many starts: completeness not claimed")
