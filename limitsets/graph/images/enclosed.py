"""Rigorous images: boxes proved to hold the image of every point of a cell, for every parameter of a box.

Cells whose branch is not proved are cut along every axis, and in the parameter that is known least, so that within one
piece the decision and the image use nearly the same parameters; each branch then gets the hull of the pieces on which
it is possible.  A cell of which nothing can be proved may go everywhere, and every claim about it fails.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.graph.boxes import TargetBoxes, merged, placed
from limitsets.graph.images.hulls import BOTH, DECIDED, NOTHING, BoxImages, Columns, Hulls
from limitsets.graph.target import Target
from limitsets.interval import guard
from limitsets.maps import kind_of

Floats: TypeAlias = NDArray[np.float64]

# Cells done at a time: few enough for the processor's cache, and for memory that is used again.
BATCH = 16384

# Pieces of an undecided cell along each axis, and along the parameter where one is not known exactly, by dimension.
PIECES_OF_X = {1: 4, 2: 4, 3: 2}
PIECES_OF_PARAMETER = {1: 256, 2: 16, 3: 8}


def _numbers(lo_map: Any, hi_map: Any) -> Iterator[tuple[tuple[str, ...], float, float]]:
    """Scalar parameters by the names on the way to them, and both corners' values."""
    for name, low, high in zip(lo_map._fields, lo_map, hi_map, strict=True):
        if isinstance(low, float):
            yield (name,), low, high
        elif hasattr(low, "_fields"):
            yield from (((name, *rest), a, b) for rest, a, b in _numbers(low, high))


def _with(params: Any, names: tuple[str, ...], value: float) -> Any:
    name, *rest = names
    return params._replace(**{name: _with(getattr(params, name), tuple(rest), value) if rest else value})


def _least_known(lo_map: Any, hi_map: Any) -> tuple[tuple[str, ...], float, float] | None:
    """Scalar parameter of largest relative width, None where all are known to some ulp."""
    widths = {
        number: (number[2] - number[1]) / max(abs(number[1]), abs(number[2]), 1e-300)
        for number in _numbers(lo_map, hi_map)
        if number[1] < number[2]
    }
    found = max(widths, key=lambda key: widths[key], default=None)
    return found if found is not None and widths[found] > 1e-9 else None


def _parameter_pieces(lo_map: Any, hi_map: Any, pieces: int) -> list[tuple[Any, Any]]:
    found = _least_known(lo_map, hi_map)
    if found is None:
        return [(lo_map, hi_map)]
    names, low, high = found
    cuts = np.linspace(low, high, pieces + 1).tolist()
    return [(_with(lo_map, names, a), _with(hi_map, names, b)) for a, b in pairwise(cuts)]


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
    found = enclosures(map, map if upper is None else upper, grid.edges[side], side)
    return boxes_of(found, target, len(kind_of(map).exits))


def boxes_of(found: Enclosures, target: Target, exits: int) -> TargetBoxes:
    """Target cells of proved images; a cell of which nothing is proved goes to every cell and leaves by every exit."""
    n, (sides, dimension) = found.lost.size, target.cells.shape
    parts = []
    for (side, _), hull in found.hulls.items():
        if not 0 <= side < sides:
            raise AnswerError(
                "the side that image_box gives", side, f"0 to {sides - 1}", "correct the kernel"
            )
        lo, hi = (corner.reshape(n, dimension) for corner in hull)
        cell = np.flatnonzero((lo <= hi).all(axis=1) & ~found.lost)
        parts.append(placed(target, cell, np.full(cell.size, side), lo[cell], hi[cell], 0, inside=False))
    lost = np.flatnonzero(found.lost)
    everywhere = np.full(int(lost.max(initial=-1)) + 1, 0, np.uint8)
    everywhere[lost] = 2**exits - 1
    for side in np.flatnonzero(target.cells.prod(axis=1)).tolist():
        last = np.tile((target.cells[side] - 1).astype(np.int32), (lost.size, 1))
        of_side = np.full(lost.size, side, np.int32)
        parts.append(TargetBoxes(lost, of_side, np.zeros_like(last), last, everywhere, 0.0))
    return merged(parts, n, 0.0)
