"""Rigorous images: boxes proved to hold the image of every point of a cell, for every parameter of a box, and hulls.

Cells whose branch is not proved are cut along every axis, and in the parameter that is known least, so that within one
piece the decision and the image use nearly the same parameters; each branch then gets the hull of the pieces on which
it is possible.  A cell of which nothing can be proved may go everywhere, and every claim about it fails.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.numbers.interval import guard
from limitsets.numbers.jit import proof_kernel, take_mark
from limitsets.systems.cells import Grid
from limitsets.systems.graph.target import Target, TargetBoxes, merged, placed
from limitsets.systems.maps import kind_of
from limitsets.systems.maps.contract import with_number
from limitsets.systems.maps.kernels import fallback_box, image_box, on_side_box, pick, put

# ----------------------------------------------------------------
# Images of boxes, and their hulls: one for each side and branch.
#
# The joining is compiled: done in numpy it took a third of the time of a rigorous image.  Only the loop that asks the
# map is compiled for each map; the others know but the number of coordinates.


Floats: TypeAlias = NDArray[np.float64]
Columns: TypeAlias = tuple[Floats, ...]

NOTHING, DECIDED, BOTH = -1, 1, 2


@proof_kernel
def _store(answer: Any, k: int, count: Any, first: Any, second: Any, to: Any, witness: Any) -> None:
    """Keep an answer: corners of the slots in `first` and `second`, their sides and branches in `to`."""
    n, a, b, w = answer
    count[k] = n
    put(first[0], k, a[0])
    put(first[1], k, a[1])
    put(second[0], k, b[0])
    put(second[1], k, b[1])
    to[0, k], to[1, k], to[2, k], to[3, k] = a[2], a[3], b[2], b[3]
    witness[0, k], witness[1, k] = w


@proof_kernel(entry=True, counting=False)
def _enclose(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, kept: Any) -> bool:
    """Images of boxes; whether a function was asked beyond where it is defined, for any of them."""
    take_mark()
    one, two = on_side_box(lo_map, hi_map, side)
    for k in range(lo[0].size):
        _store(image_box(one, two, pick(lo, k), pick(hi, k), side), k, *kept)
    return bool(take_mark())


@proof_kernel(entry=True, counting=False)
def _find_undefined(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, count: Any) -> None:
    """Give up the boxes on which one was: apart from the loop above, which it would keep from vectorising."""
    for k in range(count.size):
        take_mark()
        one, two = on_side_box(lo_map, hi_map, side)
        image = image_box(one, two, pick(lo, k), pick(hi, k), side)
        count[k] = NOTHING if take_mark() else image[0]


@proof_kernel(entry=True, counting=False)
def _enclose_surely(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, again: Any, kept: Any) -> None:
    """Images of some of them, the slow and sure way."""
    one, two = on_side_box(lo_map, hi_map, side)
    for k in again:
        take_mark()
        _store(fallback_box(one, two, pick(lo, k), pick(hi, k), side), k, *kept)
        if take_mark():
            kept[0][k] = NOTHING


@proof_kernel(entry=True)
def _refuse(count: Any, first: Any, second: Any) -> None:
    """Give up the answers that are none of the three, or no finite box.  A nan is no finite box."""
    for k in range(count.size):
        n = count[k]
        count[k] = n if (n == DECIDED) | (n == BOTH) else NOTHING
    for axis in range(len(first[0])):
        for k in range(count.size):
            lo, hi = first[0][axis][k], first[1][axis][k]
            real = (lo > -math.inf) & (lo <= hi) & (hi < math.inf)
            count[k] = count[k] if real else NOTHING
        for k in range(count.size):
            lo, hi = second[0][axis][k], second[1][axis][k]
            real = (lo > -math.inf) & (lo <= hi) & (hi < math.inf)
            count[k] = count[k] if real | (count[k] != BOTH) else NOTHING


@proof_kernel(entry=True)
def _widen(begin: int, wanted: Any, lo: Any, hi: Any, side: Any, branch: Any, cells: Any, hull: Any) -> int:
    """Widen one hull by the wanted images that lead where image `begin` leads; the first that leads elsewhere.

    They are wanted no longer.  `cells` are those the images belong to, the same number of consecutive ones each.
    """
    least, most = hull
    to, by = side[begin], branch[begin]
    pieces = wanted.size // cells.size
    elsewhere: int = wanted.size
    for c in range(begin // pieces, cells.size):
        cell = cells[c]
        for k in range(c * pieces, (c + 1) * pieces):
            if not wanted[k]:
                continue
            if (side[k] != to) | (branch[k] != by):
                elsewhere = min(elsewhere, k)
                continue
            wanted[k] = False
            for axis in range(len(lo)):
                least[axis][cell] = min(least[axis][cell], lo[axis][k])
                most[axis][cell] = max(most[axis][cell], hi[axis][k])
    return elsewhere


class BoxImages:
    """Images of boxes: `count`, and per slot the corners, an array for each axis, the sides and the branches.

    `count` is NOTHING too where the answer is none of the three, or no finite box, or a function was asked beyond where
    it is defined.
    """

    def __init__(self, lo_map: Any, hi_map: Any, side: int, lo: Columns, hi: Columns) -> None:
        n, axes = lo[0].size, range(len(lo))
        self.count, self.to, self.witness = (
            np.empty(n, np.int8),
            np.empty((4, n), np.int32),
            np.empty((2, n)),
        )
        self.slots = [tuple(tuple(np.empty(n) for _ in axes) for _ in range(2)) for _ in range(2)]
        kept = (self.count, *self.slots, self.to, self.witness)
        if _enclose(lo_map, hi_map, side, lo, hi, kept):
            _find_undefined(lo_map, hi_map, side, lo, hi, self.count)
        again = np.flatnonzero(self.count == NOTHING)
        if again.size and type(lo_map) in fallback_box.methods:
            _enclose_surely(lo_map, hi_map, side, lo, hi, again, kept)
        _refuse(self.count, *self.slots)


class Hulls:
    """Hulls of the images of n cells: for each (side, branch) the corners, an array for each axis."""

    def __init__(self, n: int, dimension: int) -> None:
        self.n, self.dimension = n, dimension
        self.bounds: dict[tuple[int, int], tuple[Columns, Columns]] = {}

    def join(self, images: BoxImages, wanted: NDArray[np.bool_], slot: int, cells: NDArray[np.int64]) -> None:
        """Widen them by one slot of the wanted images, those of the pieces of `cells`, which follow each other."""
        lo, hi = images.slots[slot]
        side, branch = images.to[2 * slot], images.to[2 * slot + 1]
        left = wanted.copy()
        begin = int(left.argmax()) if left.any() else left.size
        while begin < left.size:
            key = int(side[begin]), int(branch[begin])
            if key not in self.bounds:
                self.bounds[key] = self._empty(math.inf), self._empty(-math.inf)
            begin = _widen(begin, left, lo, hi, side, branch, cells, self.bounds[key])

    def _empty(self, end: float) -> Columns:
        return tuple(np.full(self.n, end) for _ in range(self.dimension))

    def arrays(self) -> dict[tuple[int, int], tuple[Floats, Floats]]:
        """Hulls with corners of shape (n,), in more than one dimension (n, dimension)."""
        if self.dimension == 1:
            return {key: (lo[0], hi[0]) for key, (lo, hi) in self.bounds.items()}
        return {key: (np.stack(lo, axis=1), np.stack(hi, axis=1)) for key, (lo, hi) in self.bounds.items()}


# ----------------------------------------------------------------
# Rigorous images: boxes proved to hold the image of every point of a cell, for every parameter of a box.


# Cells done at a time: few enough for the processor's cache, and for memory that is used again.
BATCH = 16384

# Pieces of an undecided cell along each axis, and along the parameter where one is not known exactly, by dimension.
PIECES_OF_X = {1: 4, 2: 4, 3: 2}
PIECES_OF_PARAMETER = {1: 256, 2: 16, 3: 8}


def _numbers(lo_map: Any, hi_map: Any) -> Iterator[tuple[str, float, float]]:
    """Scalar parameters by their names, in others by a point, and both corners' values."""
    for name, low, high in zip(lo_map._fields, lo_map, hi_map, strict=True):
        if isinstance(low, float):
            yield name, low, high
        elif hasattr(low, "_fields"):
            yield from ((f"{name}.{inner}", a, b) for inner, a, b in _numbers(low, high))


def least_known(lo_map: Any, hi_map: Any) -> tuple[str, float, float] | None:
    """Scalar parameter of largest relative width, None where all are known to some ulp."""
    widths = {
        number: (number[2] - number[1]) / max(abs(number[1]), abs(number[2]), 1e-300)
        for number in _numbers(lo_map, hi_map)
        if number[1] < number[2]
    }
    widest = max(widths, key=lambda key: widths[key], default=None)
    return widest if widest is not None and widths[widest] > 1e-9 else None


def _parameter_pieces(lo_map: Any, hi_map: Any, pieces: int) -> list[tuple[Any, Any]]:
    widest = least_known(lo_map, hi_map)
    if widest is None:
        return [(lo_map, hi_map)]
    name, low, high = widest
    cuts = np.linspace(low, high, pieces + 1).tolist()
    return [(with_number(lo_map, name, a), with_number(hi_map, name, b)) for a, b in pairwise(cuts)]


def _cut(lo: Columns, hi: Columns, pieces: int) -> tuple[Columns, Columns]:
    """Cut boxes into ``pieces`` parts along every axis: the parts of one box follow each other."""
    weights = np.arange(pieces + 1) / pieces
    position = np.indices((pieces,) * len(lo)).reshape(len(lo), -1)
    below, above = [], []
    for low, high, at in zip(lo, hi, position, strict=True):
        cuts = np.minimum(low[:, None] + weights * (high - low)[:, None], high[:, None])
        cuts[:, -1] = high
        below.append(np.ascontiguousarray(cuts[:, at].ravel()))
        above.append(np.ascontiguousarray(cuts[:, at + 1].ravel()))
    return tuple(below), tuple(above)


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Proved images of the cells of one side.

    Attributes
    ----------
    hulls : dict of (side, branch) to (lo, hi), each ndarray of shape (n,), in more than one dimension (n, dimension)
        Where each branch may lead, for the cells on which it is possible; (inf, -inf) for the others.  A map that is
        continuous where branches meet may name but one of them.
    witness : ndarray, shape (2, n)
        What proves it, as the map has it; for the throw, the bracket of the impact angle over the whole cell.
    lost : ndarray of bool, shape (n,)
        Cells of which nothing could be proved.
    """

    hulls: dict[tuple[int, int], tuple[Floats, Floats]]
    witness: Floats
    lost: NDArray[np.bool_]


def _check(map: Any) -> None:  # noqa: A002  # the field's word
    kind = kind_of(map)
    if not kind.has_image_box:
        given = {"image_on": kind.has_image_on, "margin": kind.has_margin}
        wanted = " and ".join(name for name, there in given.items() if not there)
        way = f"register {wanted} too" if len(kind.branches) == 2 else "register image_box"
        branches = f"{kind.name}, of the branches {', '.join(kind.branches)}"
        allowed = "one with image_on and margin, of two branches; or with image_box"
        raise AnswerError("the map", branches, allowed, f"{way}, or sample instead")
    guard()


def enclosures(
    map: Any,  # noqa: A002  # the field's word
    upper: Any,
    edges: Floats | Columns,
    side: int,
    pieces: int | None = None,
) -> Enclosures:
    """Enclose the images of the cells between consecutive edges of one side.

    Parameters
    ----------
    map, upper : NamedTuple
        Corners of a box of parameters of a map with `image_box`.
    edges : ndarray, shape (n + 1,), or a tuple of such, one per axis
        Borders of the cells; cells are numbered with the last axis running fastest.
    side : int
        The side.
    pieces : int, optional
        Pieces of the parameter that is known least, where a cell is undecided; default `PIECES_OF_PARAMETER`.

    Raises
    ------
    AnswerError
        For a map without `image_box`, or a thread that does not round to nearest.
    """
    _check(map)
    axes = edges if isinstance(edges, tuple) else (edges,)
    lo = tuple(m.ravel() for m in np.meshgrid(*(axis[:-1] for axis in axes), indexing="ij"))
    hi = tuple(m.ravel() for m in np.meshgrid(*(axis[1:] for axis in axes), indexing="ij"))
    n = lo[0].size
    hulls, witness = Hulls(n, len(axes)), np.empty((2, n))
    decided, lost = np.empty(n, dtype=bool), np.zeros(n, dtype=bool)
    for begin in range(0, n, BATCH):
        cells = np.arange(begin, min(begin + BATCH, n))
        some = slice(begin, begin + BATCH)
        part = BoxImages(map, upper, side, tuple(x[some] for x in lo), tuple(x[some] for x in hi))
        decided[some], witness[:, some] = part.count == DECIDED, part.witness
        hulls.join(part, decided[some], 0, cells)
    rest = np.flatnonzero(~decided)
    if rest.size:
        parts = PIECES_OF_X[len(axes)]
        below, above = _cut(tuple(x[rest] for x in lo), tuple(x[rest] for x in hi), parts)
        owner = np.repeat(rest, parts ** len(axes))
        for one, two in _parameter_pieces(map, upper, pieces or PIECES_OF_PARAMETER[len(axes)]):
            if lost[rest].any():  # the other parameters tell nothing of what is lost
                kept = ~lost[owner]
                below, above = (tuple(x[kept] for x in corner) for corner in (below, above))
                rest, owner = rest[~lost[rest]], owner[kept]
            part = BoxImages(one, two, side, below, above)
            lost[owner[part.count == NOTHING]] = True
            hulls.join(part, part.count != NOTHING, 0, rest)
            hulls.join(part, part.count == BOTH, 1, rest)
    return Enclosures(hulls.arrays(), witness, lost)


def enclosed(map: Any, grid: Grid, side: int, target: Target, *, upper: Any = None) -> TargetBoxes:  # noqa: A002  # the field's word
    """Image method: enclose the images of all cells of one side.

    Parameters
    ----------
    map : NamedTuple
        A map with `image_box`, or the lower corner of a box of its parameters.
    grid : Grid
        The cells.
    side : int
        The side.
    target : Target
        The grid, as kernels take it.
    upper : NamedTuple, optional
        The upper corner; default `map`.
    """
    proved_images = enclosures(map, map if upper is None else upper, grid.edges[side], side)
    return boxes_of(proved_images, target, len(kind_of(map).exits))


def boxes_of(proved_images: Enclosures, target: Target, exits: int) -> TargetBoxes:
    """Target cells of proved images; a cell of which nothing is proved goes to every cell and leaves by every exit."""
    n, (sides, dimension) = proved_images.lost.size, target.cells.shape
    parts = []
    for (side, _), hull in proved_images.hulls.items():
        if not 0 <= side < sides:
            raise AnswerError(
                "the side that image_box gives", side, f"0 to {sides - 1}", "correct the kernel"
            )
        lo, hi = (corner.reshape(n, dimension) for corner in hull)
        cell = np.flatnonzero((lo <= hi).all(axis=1) & ~proved_images.lost)
        parts.append(placed(target, cell, np.full(cell.size, side), lo[cell], hi[cell], 0, inside=False))
    lost = np.flatnonzero(proved_images.lost)
    everywhere = np.full(int(lost.max(initial=-1)) + 1, 0, np.uint8)
    everywhere[lost] = 2**exits - 1
    for side in np.flatnonzero(target.cells.prod(axis=1)).tolist():
        last = np.tile((target.cells[side] - 1).astype(np.int32), (lost.size, 1))
        of_side = np.full(lost.size, side, np.int32)
        parts.append(TargetBoxes(lost, of_side, np.zeros_like(last), last, everywhere, 0.0))
    return merged(parts, n, 0.0)
