"""Steps along forced branches: image and slope of a state on a given branch, whatever branch the map takes.

The one-sided limit at a change of branch is a step on a forced branch, and so is a composed map whose itinerary is
given: end points of limit sets and cycles are built on nothing else.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.arguments import arguments_checked
from limitsets.jit import kernel, row_of
from limitsets.maps.contract import require_sides
from limitsets.maps.kernels import image_on, margin
from limitsets.maps.stacks import point_of, size_of


@kernel(entry=True)
def _along(params: Any, x: Any, sides: Any, branches: Any, after: Any, side_after: Any, slope: Any) -> None:
    """Force steps: row k of `branches` for start k, or the one row for all."""
    for k in range(x.size):
        row = k if branches.shape[0] > 1 else 0
        at, side, product = x[k], sides[k], 1.0
        for j in range(branches.shape[1]):
            at, side, factor = image_on(params, at, side, branches[row, j])
            product *= factor
        after[k] = at
        side_after[k] = side
        slope[k] = product


@arguments_checked
def along(
    params: Any, x: ArrayLike, side: ArrayLike, branches: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64]]:
    """Send states along forced branches.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with `image_on`.
    x : array_like, shape (n,)
        States.
    side : int or array_like of int, shape (n,)
        Their sides.
    branches : array_like of int, shape (m,) or (n, m)
        The branches to take one after the other, for all states or for each.

    Returns
    -------
    x, side, slope : ndarray, shape (n,)
        Where they end, in the map's unit, and the derivative of the whole with respect to the start.

    Examples
    --------
    >>> from limitsets import maps
    >>> maps.along(maps.Doubling(2.0), [0.5], 0, [0, 1])  # from below 1/2 to 1, which stays
    (array([1.]), array([0]), array([4.]))
    """
    starts = np.ascontiguousarray(x, dtype=np.float64)
    sides = np.array(np.broadcast_to(np.asarray(side, dtype=np.int64), starts.shape))
    if sides.size:
        require_sides(params, int(sides.min()), int(sides.max()))
    words = np.ascontiguousarray(np.atleast_2d(np.asarray(branches, dtype=np.int64)))
    after, side_after, slope = np.empty(starts.size), np.empty(starts.size, np.int64), np.empty(starts.size)
    _along(params, starts, sides, words, after, side_after, slope)
    return after, side_after, slope


@kernel(entry=True)
def _at_points(stack: Any, x: Any, sides: Any, branches: Any, after: Any, slope: Any, decides: Any) -> None:
    for k in range(after.shape[0]):
        params = row_of(stack, k)
        for j in range(x.shape[1]):
            at, _, factor = image_on(params, x[k, j], sides[j], branches[j])
            after[k, j], slope[k, j] = at, factor
            decides[k, j] = margin(params, x[k, j], sides[j])


def at_points(
    stack: Any, x: ArrayLike, side: ArrayLike, branch: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Make one step each on a forced branch at many parameter points.

    Parameters
    ----------
    stack : NamedTuple
        Stacked parameters (`limitsets.maps.stacks`) of a one-dimensional map with `image_on`, m points.
    x : array_like, shape (n,) or (m, n)
        States, the same at all points or those of each.
    side, branch : array_like, shape (n,)
        Their sides and the branch that each takes, the same at all points.

    Returns
    -------
    x, slope, margin : ndarray, shape (m, n)
        Where they end, the derivative with respect to the start, and the number whose sign decides the branch.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.maps.stacks import stacked
    >>> from limitsets.maps.forced import at_points
    >>> at_points(stacked([maps.Doubling(2.0), maps.Doubling(3.0)]), [0.25], [0], [0])[0]
    array([[0.5 ],
           [0.75]])
    """
    sides, words = (np.ascontiguousarray(each, dtype=np.int64) for each in (side, branch))
    shape = (size_of(stack), sides.size)
    starts = np.ascontiguousarray(np.broadcast_to(np.asarray(x, dtype=np.float64), shape))
    if sides.size:
        require_sides(point_of(stack, 0), int(sides.min()), int(sides.max()))
    after, slope, decides = (np.empty(shape) for _ in range(3))
    _at_points(stack, starts, sides, words, after, slope, decides)
    return after, slope, decides
