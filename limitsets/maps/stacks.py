"""Stacked parameters: many parameter points of one map in one NamedTuple of its class.

A field that is a number for one point is an array of shape (n,), one that is an array with an entry per side has
shape (n, sides), and a NamedTuple inside is stacked in the same way.  Compiled loops over points take row by row
(`limitsets.jit.row_of`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import MapError
from limitsets.jit import row_of
from limitsets.maps.contract import coerce, kind_of


def stacked(points: Sequence[Any]) -> Any:
    """Stack the parameters of one map at several points.

    Parameters
    ----------
    points : sequence of NamedTuple
        Parameters of one registered class, one at least.

    Returns
    -------
    NamedTuple
        Of the same class; arrays of float64 whose first axis numbers the points.

    Raises
    ------
    MapError
        For no points, points of several classes, or arrays of different lengths.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.maps.stacks import stacked
    >>> stacked([maps.Logistic(3.2), maps.Logistic(3.9)])
    Logistic(r=array([3.2, 3.9]))
    """
    rows = [coerce(point) for point in points]
    classes = {type(row) for row in rows}
    if len(classes) != 1:
        raise MapError(
            "the points",
            [cls.__name__ for cls in classes],
            "parameters of one map, one at least",
            "stack these",
        )
    kind_of(rows[0])
    return _together(rows)


def _together(rows: list[Any]) -> Any:
    first = rows[0]
    if isinstance(first, tuple) and hasattr(first, "_fields"):
        return type(first)(*(_together(list(entries)) for entries in zip(*rows, strict=True)))
    if not isinstance(first, (float, np.ndarray)):
        return first
    if len({np.shape(row) for row in rows}) != 1:
        shapes = sorted({np.shape(row) for row in rows})
        raise MapError(
            "the shapes of a parameter", shapes, "the same at all points", "stack parts of as many sides"
        )
    return np.array(rows)


def _arrays(stack: Any) -> list[NDArray[np.float64]]:
    if isinstance(stack, np.ndarray):
        return [stack]
    return [array for entry in stack for array in _arrays(entry)] if isinstance(stack, tuple) else []


def size_of(stack: Any) -> int:
    """Count the points of stacked parameters; raises MapError where their arrays do not agree."""
    sizes = {array.shape[0] if array.ndim else -1 for array in _arrays(stack)}
    if len(sizes) != 1 or -1 in sizes:
        raise MapError(
            "the stacked parameters", sorted(sizes), "arrays with one row per point", "use stacked(points)"
        )
    return sizes.pop()


def point_of(stack: Any, k: int) -> Any:
    """Return the parameters at one point.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.maps.stacks import point_of, stacked
    >>> point_of(stacked([maps.Logistic(3.2), maps.Logistic(3.9)]), 1)
    Logistic(r=3.9)
    """
    return coerce(row_of(stack, k))


def chosen(stack: Any, points: Any) -> Any:
    """Return the stack of some of the points, given by their numbers."""
    if isinstance(stack, np.ndarray):
        return np.ascontiguousarray(stack[points])
    return type(stack)(*(chosen(entry, points) for entry in stack)) if hasattr(stack, "_fields") else stack
