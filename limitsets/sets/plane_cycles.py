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
from limitsets.maps.drivers import step
from limitsets.maps.kernels import image_on
from limitsets.sets.closing import Closed, closed, distinct
from limitsets.sets.cycle import NEAR, Array, Cycles, Ints, require_period

NEWTON_STEPS = 60
# Relative to the extent of x: after a Newton step this small the next one, at all points, ends the search.
ARRIVED = 1e-7


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


def _orbits(params: Any, roots: Array, side: Ints, period: int) -> tuple[Array, Ints]:
    """Follow roots around: points (n, period, 2) and sides of those that do not leave."""
    points, sides = np.empty((len(roots), period, 2)), np.empty((len(roots), period), np.int64)
    stays = np.ones(len(roots), dtype=bool)
    at, on = roots, side
    for j in range(period):
        points[:, j], sides[:, j] = at, on
        at, _, on = _returned(params, 1, at, np.maximum(on, 0))
        stays &= on >= 0
    return points[stays], sides[stays]


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
    found: list[Closed] = []

    def slopes(at: Array, on: Ints, _: Ints) -> Array:
        return _returned(params, 1, at, on)[1]

    for period in range(1, up_to + 1):
        roots, on = _newton(params, period, x, sides, scale)
        keys = np.column_stack([np.round(roots / (NEAR * scale)), on])
        _, one_of_each = np.unique(keys, axis=0, return_index=True)
        orbits = _orbits(params, roots[one_of_each], on[one_of_each], period)
        found += closed(params, *orbits, scale, slopes, seams=len(kind.branches) == 1)
    return Cycles(
        distinct(found), complete=False, how="by Newton's method from many starts: completeness not claimed"
    )
