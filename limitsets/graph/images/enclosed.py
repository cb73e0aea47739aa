"""Rigorous images: boxes proved to hold the image of every point of a cell, for every parameter of a box.

Cells whose branch is not proved are cut along every axis, and in the parameter that is known least, so that within one
piece the decision and the image use nearly the same parameters; each branch then gets the hull of the pieces on which
it is possible.  A cell of which nothing can be proved may go everywhere: whatever is claimed of it fails.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.graph.boxes import Boxes, merged, placed
from limitsets.graph.target import Target
from limitsets.interval import guard
from limitsets.jit import proof_kernel
from limitsets.maps import kind_of
from limitsets.maps.contract import fallback_box, image_box, on_side_box
from limitsets.maps.drivers import pick, put

__all__ = ["Enclosures", "boxes_of", "enclosed", "enclosures"]

Floats: TypeAlias = NDArray[np.float64]
Columns: TypeAlias = tuple[Floats, ...]

NOTHING, DECIDED, BOTH = -1, 1, 2

# Pieces of an undecided cell along each axis, and along the parameter where one is not known exactly, by dimension.
PIECES_OF_X = {1: 4, 2: 4, 3: 2}
PIECES_OF_PARAMETER = {1: 256, 2: 16, 3: 8}


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


@proof_kernel(entry=True)
def _enclose(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, kept: Any) -> None:
    """Images of boxes."""
    one, two = on_side_box(lo_map, hi_map, side)
    for k in range(lo[0].size):
        _store(image_box(one, two, pick(lo, k), pick(hi, k), side), k, *kept)


@proof_kernel(entry=True)
def _enclose_surely(lo_map: Any, hi_map: Any, side: int, lo: Any, hi: Any, again: Any, kept: Any) -> None:
    """Images of some of them, the slow and sure way."""
    one, two = on_side_box(lo_map, hi_map, side)
    for k in again:
        _store(fallback_box(one, two, pick(lo, k), pick(hi, k), side), k, *kept)


class _Images:
    """Images of boxes: `count`, and per slot the corners, shape (n, dimension), the sides and the branches.

    `count` is NOTHING too where the answer is none of the three, or no finite box.
    """

    def __init__(self, lo_map: Any, hi_map: Any, side: int, lo: Columns, hi: Columns) -> None:
        n, axes = lo[0].size, range(len(lo))
        count, self.to, self.witness = np.empty(n, np.int8), np.empty((4, n), np.int32), np.empty((2, n))
        slots = [tuple(tuple(np.empty(n) for _ in axes) for _ in range(2)) for _ in range(2)]
        kept = (count, *slots, self.to, self.witness)
        _enclose(lo_map, hi_map, side, lo, hi, kept)
        again = np.flatnonzero(count == NOTHING)
        if again.size and type(lo_map) in fallback_box.methods:  # type: ignore[attr-defined]  # a generic function has them
            _enclose_surely(lo_map, hi_map, side, lo, hi, again, kept)
        self.slots = [tuple(np.stack(corner, axis=1) for corner in slot) for slot in slots]
        real = [
            ((low <= high) & np.isfinite(low) & np.isfinite(high)).all(axis=1) for low, high in self.slots
        ]
        sound = ((count == DECIDED) & real[0]) | ((count == BOTH) & real[0] & real[1])
        self.count = np.where(sound, count, NOTHING)

    def join(
        self, hulls: dict[tuple[int, int], Any], n: int, cells: NDArray[np.int64], some: Any, slot: int
    ) -> None:
        """Widen the hulls of `cells` by the images in one slot of `some` of their pieces, which follow each other."""
        side, branch = self.to[2 * slot], self.to[2 * slot + 1]
        lo, hi = self.slots[slot]
        dimension = lo.shape[1]
        shape = (cells.size, -1, dimension)
        rest = some.copy()
        while rest.any():
            k = int(rest.argmax())
            key = int(side[k]), int(branch[k])
            mine = rest & (side == key[0]) & (branch == key[1])
            rest &= ~mine
            empty = (n, dimension)
            least, most = hulls.setdefault(key, (np.full(empty, np.inf), np.full(empty, -np.inf)))
            low, high = np.where(mine[:, None], lo, np.inf), np.where(mine[:, None], hi, -np.inf)
            least[cells] = np.minimum(least[cells], low.reshape(shape).min(axis=1))
            most[cells] = np.maximum(most[cells], high.reshape(shape).max(axis=1))


def _least_known(lo_map: Any, hi_map: Any) -> str | None:
    """Name of the scalar parameter of largest relative width, None where all are known to some ulp."""
    widths = {
        name: (getattr(hi_map, name) - low) / max(abs(low), abs(getattr(hi_map, name)), 1e-300)
        for name, low in zip(lo_map._fields, lo_map, strict=True)
        if isinstance(low, float)
    }
    name = max(widths, key=lambda key: widths[key], default=None)
    return name if name is not None and widths[name] > 1e-9 else None


def _parameter_pieces(lo_map: Any, hi_map: Any, pieces: int) -> list[tuple[Any, Any]]:
    name = _least_known(lo_map, hi_map)
    if name is None:
        return [(lo_map, hi_map)]
    cuts = np.linspace(getattr(lo_map, name), getattr(hi_map, name), pieces + 1).tolist()
    return [(lo_map._replace(**{name: a}), hi_map._replace(**{name: b})) for a, b in pairwise(cuts)]


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


def _check(map: Any, upper: Any) -> None:  # noqa: A002  # the field's word
    if not kind_of(map).has_image_box:
        raise AnswerError(
            "the map", kind_of(map).name, "one with image_box", "register image_box, or sample instead"
        )
    if type(upper) is not type(map):
        allowed = f"parameters of {kind_of(map).name}"
        raise AnswerError("the upper corner of the parameters", type(upper).__name__, allowed, "pass such")
    for name, low, high in zip(map._fields, map, upper, strict=True):
        if isinstance(low, (int, float, np.ndarray)) and (np.asarray(low) > np.asarray(high)).any():
            raise AnswerError(
                f"the upper corner of {name}", high, f"at least the lower one, {low}", "swap them"
            )
    guard()


def enclosures(map: Any, upper: Any, edges: Floats | Columns, side: int) -> Enclosures:  # noqa: A002  # the field's word
    """Enclose the images of the cells between consecutive edges of one side.

    Parameters
    ----------
    map, upper : NamedTuple
        Corners of a box of parameters of a map with `image_box`.
    edges : ndarray, shape (n + 1,), or a tuple of such, one per axis
        Borders of the cells; cells are numbered with the last axis running fastest.
    side : int
        The side.

    Raises
    ------
    AnswerError
        For a map without `image_box`, an upper corner that is none, or a thread that does not round to nearest.
    """
    _check(map, upper)
    axes = edges if isinstance(edges, tuple) else (edges,)
    lo = tuple(m.ravel() for m in np.meshgrid(*(axis[:-1] for axis in axes), indexing="ij"))
    hi = tuple(m.ravel() for m in np.meshgrid(*(axis[1:] for axis in axes), indexing="ij"))
    n = lo[0].size
    whole = _Images(map, upper, side, lo, hi)
    hulls: dict[tuple[int, int], Any] = {}
    whole.join(hulls, n, np.arange(n), whole.count == DECIDED, 0)
    rest = np.flatnonzero(whole.count != DECIDED)
    lost = np.zeros(n, dtype=bool)
    if rest.size:
        pieces = PIECES_OF_X[len(axes)]
        below, above = _cut(tuple(x[rest] for x in lo), tuple(x[rest] for x in hi), pieces)
        owner = np.repeat(rest, pieces ** len(axes))
        for one, two in _parameter_pieces(map, upper, PIECES_OF_PARAMETER[len(axes)]):
            part = _Images(one, two, side, below, above)
            lost[owner[part.count == NOTHING]] = True
            part.join(hulls, n, rest, part.count != NOTHING, 0)
            part.join(hulls, n, rest, part.count == BOTH, 1)
    if len(axes) == 1:
        hulls = {key: (low[:, 0], high[:, 0]) for key, (low, high) in hulls.items()}
    return Enclosures(hulls, whole.witness, lost)


def enclosed(map: Any, grid: Grid, side: int, target: Target, *, upper: Any = None) -> Boxes:  # noqa: A002  # the field's word
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


def boxes_of(found: Enclosures, target: Target, exits: int) -> Boxes:
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
        part = placed(target, cell, np.full(cell.size, side), lo[cell], hi[cell], 0, inside=False)
        parts += [part, _past_both_ends(target, side, cell, lo[cell], hi[cell])]
    lost = np.flatnonzero(found.lost)
    everywhere = np.full(int(lost.max(initial=-1)) + 1, 0, np.uint8)
    everywhere[lost] = 2**exits - 1
    for side in range(sides):
        last = np.tile((target.cells[side] - 1).astype(np.int32), (lost.size, 1))
        of_side = np.full(lost.size, side, np.int32)
        parts.append(Boxes(lost, of_side, np.zeros_like(last), last, everywhere, 0.0))
    return merged(parts, n, 0.0)


def _past_both_ends(target: Target, side: int, cell: NDArray[np.int64], lo: Floats, hi: Floats) -> Boxes:
    """Ways out of hulls: `place` names one for each axis, but a hull may reach past both ends."""
    begin = target.begin[side]
    below = (lo < target.edges[begin]).any(axis=1)
    above = (hi > target.edges[begin + target.cells[side]]).any(axis=1)
    bits = (below * (1 << target.sink_below)) | (above * (1 << target.sink_above))
    found = np.zeros(int(cell.max(initial=-1)) + 1, np.uint8)
    found[cell] = bits
    none = np.empty((0, lo.shape[1]), np.int32)
    return Boxes(cell[:0], np.empty(0, np.int32), none, none, found, 0.0)
