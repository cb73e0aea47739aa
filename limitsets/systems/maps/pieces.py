"""Steps along forced branches at many parameter points, and the monotone pieces of a one-dimensional map.

On a piece the map is a monotone function of x.  The image of an interval of it is then known from the two ends, and
one symbol names what an orbit does there: limit sets by end points and cycles by itinerary stand on these cuts.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import AnswerError, MapError, arguments_checked
from limitsets.numbers.jit import kernel, row_of
from limitsets.systems.maps.contract import coerce, compiled_kind_of, has_slope, kind_of, require_sides
from limitsets.systems.maps.critical import (
    SAMPLES,
    Array,
    Flags,
    Sides,
    bisected,
    branches_of_side,
    hidden,
    inserted,
    located,
    require_domain,
    sign_code,
)
from limitsets.systems.maps.kernels import image_on, margin

# ----------------------------------------------------------------
# Stacked parameters: many parameter points of one map in one NamedTuple of its class.
#
# A field that is a number for one point is an array of shape (n,), one that is an array with an entry per side has
# shape (n, sides), and a NamedTuple inside is stacked in the same way.  Compiled loops over points take row by row
# (`limitsets.jit.row_of`).


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
    >>> from limitsets.systems.maps.pieces import stacked
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
    compiled_kind_of(rows[0], "monotone pieces")
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
    >>> from limitsets.systems.maps.pieces import point_of, stacked
    >>> point_of(stacked([maps.Logistic(3.2), maps.Logistic(3.9)]), 1)
    Logistic(r=3.9)
    """
    return coerce(row_of(stack, k))


def chosen(stack: Any, points: Any) -> Any:
    """Return the stack of some of the points, given by their numbers."""
    if isinstance(stack, np.ndarray):
        return np.ascontiguousarray(stack[points])
    return type(stack)(*(chosen(entry, points) for entry in stack)) if hasattr(stack, "_fields") else stack


# ----------------------------------------------------------------
# Steps along forced branches: image and slope of a state on a given branch, whatever branch the map takes.
#
# The one-sided limit at a change of branch is a step on a forced branch, and so is a composed map whose itinerary is
# given: end points of limit sets and cycles are built on nothing else.


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
        Stacked parameters of a one-dimensional map with `image_on`, m points.
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
    >>> from limitsets.systems.maps.pieces import stacked
    >>> from limitsets.systems.maps.pieces import at_points
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


# ----------------------------------------------------------------
# Monotone pieces: a one-dimensional map cut at switching points, turning points and jumps.


# A step this large between adjacent floats is a jump; the root of a grazing throw moves by the root of an ulp.
JUMP = 2.0**-18


class TurningPoint(NamedTuple):
    """A point inside a branch where its slope changes sign.

    Attributes
    ----------
    x : float
        The point.
    branch : int
        The branch.
    """

    x: float
    branch: int


class Piece(NamedTuple):
    """A range of x on which a map stays on one branch and is monotone.

    Attributes
    ----------
    lo, hi : float
        First and last floating-point number of the piece.
    branch : int
        The branch.
    below, above : str
        What ends it: "critical", "turning", "jump" (of the image, inside the branch), "exit" (no branch beyond) or
        "domain".
    """

    lo: float
    hi: float
    branch: int
    below: str
    above: str


class _Branch(NamedTuple):
    """One branch of one side, as a function of x."""

    params: Any
    side: int
    number: int

    def image(self, x: Array) -> Array:
        return along(self.params, x, self.side, [self.number])[0]

    def slope(self, x: Array) -> Array:
        return along(self.params, x, self.side, [self.number])[2]


def _jumps(branch: _Branch, x: Array) -> Array:
    """Both floats at each jump of the image: where it moves otherwise than the slopes at two samples let expect."""
    y, slope, step = branch.image(x), branch.slope(x), np.diff(x)
    off = np.abs(np.diff(y) - 0.5 * (slope[1:] + slope[:-1]) * step)
    usual = (np.abs(np.diff(slope)) + 0.01 * np.abs(slope[1:])) * step + JUMP * JUMP * np.abs(y[1:])
    k = np.flatnonzero(off > usual)

    def larger_above(lo: Array, middle: Array, hi: Array) -> Flags:
        y_lo, y_mid, y_hi = (branch.image(at) for at in (lo, middle, hi))
        return np.asarray(np.abs(y_mid - y_lo) <= np.abs(y_hi - y_mid))

    lo, hi = bisected(x[k], x[k + 1], larger_above)
    y_lo, y_hi = branch.image(lo), branch.image(hi)
    real = np.abs(y_hi - y_lo) > JUMP * np.maximum(1.0, np.abs(y_lo))
    return np.concatenate([lo[real], hi[real]])


def _monotone_parts(branch: _Branch, x: Array) -> tuple[list[Array], list[str]]:
    """Cut the samples of one branch where its slope changes sign or its image jumps: parts, and what each cut is."""
    jumps = _jumps(branch, x)
    x = inserted(inserted(x, jumps), hidden(branch.slope, x))
    x, rising = located(lambda at: sign_code(branch.slope(at)), x)
    turns = np.flatnonzero(np.diff(rising)) + 1
    adjacent = np.nextafter(x[:-1], np.inf) == x[1:]
    steps = np.flatnonzero(np.isin(x[:-1], jumps) & np.isin(x[1:], jumps) & adjacent) + 1
    cuts = np.union1d(turns, steps)
    return np.split(x, cuts), ["jump" if cut in steps else "turning" for cut in cuts]


def _pieces_of_side(params: Any, domain: Sides, side: int, samples: int) -> tuple[Piece, ...]:
    """Cut one side at its changes of branch, then every branch."""
    x, code = branches_of_side(params, domain, side, samples)
    if not x.size:
        return ()
    changes = np.flatnonzero(np.diff(code)) + 1
    runs = np.split(x, changes)
    branches = code[np.concatenate([[0], changes])].tolist()
    between = ["critical" if min(pair) >= 0 else "exit" for pair in pairwise(branches)]
    borders = pairwise(["domain", *between, "domain"])
    pieces: list[Piece] = []
    for run, branch, (below, above) in zip(runs, branches, borders, strict=True):
        if branch < 0:
            continue
        parts, cuts = _monotone_parts(_Branch(params, side, branch), run)
        ends = pairwise([below, *cuts, above])
        pieces += [
            Piece(float(part[0]), float(part[-1]), branch, *pair)
            for part, pair in zip(parts, ends, strict=True)
        ]
    return tuple(pieces)


@arguments_checked
def monotone_pieces(params: Any, domain: Sides, *, samples: int = SAMPLES) -> dict[int, tuple[Piece, ...]]:
    """Cut a domain into pieces on which a map stays on one branch and is monotone.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with `image_on`.
    domain : Domain
        What to cut.
    samples : int
        As for `critical_points`.

    Returns
    -------
    dict of int to tuple of Piece
        Per side, ascending.  Where the map has no branch (it leaves, or there is no image) there is no piece.

    Raises
    ------
    AnswerError
        For a map of two or three dimensions, or one without `image_on`.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> pieces = maps.monotone_pieces(maps.Logistic(4.0), as_domain([(0, 1)]))
    >>> [(piece.below, piece.above) for piece in pieces[0]]
    [('domain', 'critical'), ('critical', 'domain')]
    """
    require_domain(params, domain, samples)
    if not has_slope(params):
        name = kind_of(params).name
        raise AnswerError(
            "the map", name, "a map with image_on", "register image_on: one step on a forced branch"
        )
    return {side: _pieces_of_side(params, domain, side, samples) for side in range(domain.sides)}


@arguments_checked
def turning_points(
    params: Any, domain: Sides, *, samples: int = SAMPLES
) -> dict[int, tuple[TurningPoint, ...]]:
    """Find every x at which the slope of the branch in force changes sign.

    Parameters
    ----------
    params : NamedTuple
        A map in one dimension.
    domain : Sides
        Where to look, as for `monotone_pieces`.
    samples : int
        Number of samples on each side.

    Returns
    -------
    dict of int to tuple of TurningPoint
        By side, ascending.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed").with_values({"throw.kappa": 4.0})  # a throw far too fast for this part
    >>> [round(point.x, 4) for point in ls.maps.turning_points(scene.map, scene.domain)[0]]
    [3.9807, 9.6215]
    """
    return {
        side: tuple(TurningPoint(piece.lo, piece.branch) for piece in pieces if piece.below == "turning")
        for side, pieces in monotone_pieces(params, domain, samples=samples).items()
    }
