"""The grid of the images: the closed cells that an interval meets, as boxes and as ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.numbers.jit import kernel
from limitsets.systems.cells import Domain, Grid
from limitsets.systems.maps import codes


class Target(NamedTuple):
    """The grid that images land on, as kernels take it."""

    edges: NDArray[np.float64]  # all axes of all sides, one after the other
    begin: NDArray[np.int64]  # (n_sides, dimension): where an axis begins in `edges`
    cells: NDArray[np.int64]  # (n_sides, dimension)
    per_length: NDArray[np.float64]  # cells per length of a uniform axis, 0 on a graded one
    period: NDArray[np.float64]  # (n_sides, dimension): extent of an axis that closes, 0 of another
    sink_below: int
    sink_above: int
    sink_of_code: NDArray[np.int64]  # exit number of code -k at [k]

    @classmethod
    def of(cls, grid: Grid, exits: dict[str, int]) -> Target:
        """Flatten a grid."""
        axes = [edges for side in grid.edges for edges in side]
        begin = np.concatenate([[0], np.cumsum([axis.size for axis in axes])[:-1]])
        graded = grid.domain.anchor is not None
        rate = [0.0 if graded else (axis.size - 1) / (axis[-1] - axis[0]) for axis in axes]
        sink = np.zeros(8, dtype=np.int64)
        numbers = {code: number for number, code in enumerate(exits.values())}
        for code, number in numbers.items():
            sink[-code] = number
        below = numbers.get(codes.INWARD, numbers.get(codes.OUTSIDE, 0))
        above = numbers.get(codes.OUTWARD, 0)
        shape = (grid.sides, grid.dimension)
        return cls(
            np.concatenate(axes),
            begin.reshape(shape),
            grid.shape,
            per_length=np.array(rate).reshape(shape),
            period=grid.domain.period,
            sink_below=below,
            sink_above=above,
            sink_of_code=sink,
        )


@kernel(counting=False)
def holding(target: Target, side: Any, axis: Any, x: Any, hint: Any) -> Any:
    """Position of a cell that holds x, 0 or the last one where x lies outside; on a uniform axis to rounding.

    On a graded axis by bisection between bounds that are found in steps of doubling size from the hint: images of
    neighbouring cells are neighbours, so the hint is nearly always right.
    """
    begin, n = target.begin[side, axis], target.cells[side, axis]
    rate = target.per_length[side, axis]
    if rate > 0.0:
        return np.int64(min(max((x - target.edges[begin]) * rate, 0.0), n - 1.0))
    k: Any = min(max(np.int64(hint), 0), n - 1)
    low, high, stride = k, k, 1
    while low > 0 and target.edges[begin + low] > x:
        low, stride = max(low - stride, 0), 2 * stride
    stride = 1
    while high < n - 1 and target.edges[begin + high + 1] < x:
        high, stride = min(high + stride, n - 1), 2 * stride
    while low < high:
        middle = (low + high) // 2
        if target.edges[begin + middle + 1] < x:
            low = middle + 1
        else:
            high = middle
    return low


# Rounding of a state less whole turns, in units of the last place of both.
EPS = 4.0 * 2.0**-53


@kernel(counting=False)
def turned(x: Any, bottom: float, period: float, way: float) -> tuple[Any, Any]:
    """Whole turns from an axis that closes to x, and what is left: of a number at or beyond x on the given way.

    What is left lies in [bottom, bottom + period] to rounding; on the seam it is at that end from which the way goes.
    """
    turns = math.floor((x - bottom) / period)
    slack = EPS * (abs(x) + abs(turns) * period) if turns != 0.0 else 0.0
    rest = x - turns * period + way * slack
    slack = EPS * (abs(x) + abs(turns) * period + period)
    if way < 0.0 and rest <= bottom:
        return turns - 1.0, rest + period - slack
    if way > 0.0 and rest >= bottom + period:
        return turns + 1.0, rest - period + slack
    return turns, rest


@kernel(counting=False)
def goes_round(lo: Any, hi: Any, bottom: float, period: float) -> bool:
    """Whether an interval may be a whole circle; or is so far away, or none, that nothing better is known."""
    far = EPS * max(abs(lo), abs(hi), abs(bottom))
    return not ((hi - lo < period) & (far < 2.0**-20 * period))


@kernel(counting=False)
def _place_round(target: Target, side: Any, axis: Any, lo: Any, hi: Any, pad: int) -> tuple[Any, Any, Any]:
    """Do what `place` does along an axis that closes; only what is not finite leaves."""
    begin, n = target.begin[side, axis], np.int64(target.cells[side, axis])
    bottom, period = target.edges[begin], target.period[side, axis]
    leaves = 0
    if not (lo > -math.inf):
        leaves |= 1 << target.sink_below
    if not (hi < math.inf):
        leaves |= 1 << target.sink_above
    if goes_round(lo, hi, bottom, period):
        return np.int64(0), n - 1, leaves
    turns, rest = turned(lo, bottom, period, -1.0)
    first = np.int64(holding(target, side, axis, rest, np.int64(0)))
    while first > 0 and target.edges[begin + first] >= rest:
        first -= 1
    while first < n - 1 and target.edges[begin + first + 1] < rest:
        first += 1
    more, rest = turned(hi, bottom, period, 1.0)
    last = np.int64(holding(target, side, axis, rest, first))
    while last < n - 1 and target.edges[begin + last + 1] <= rest:
        last += 1
    while last > 0 and target.edges[begin + last] > rest:
        last -= 1
    first, last = first - pad, last + pad + n * np.int64(more - turns)
    if last >= first + n - 1:
        return np.int64(0), n - 1, leaves
    around = first % n
    return around, last - first + around, leaves


@kernel(counting=False)
def place(
    target: Target, side: Any, axis: Any, lo: Any, hi: Any, pad: int, hint: Any
) -> tuple[Any, Any, Any]:
    """First and last position that [lo, hi] meets along one axis, and the exits it reaches past, a bit each.

    Cells are closed, so an interval that ends on a border meets both cells there.  First larger than last: no cell.
    Along an axis that closes the positions go on beyond the seam: 0 <= first < n, and last < first + n.
    """
    begin, n = target.begin[side, axis], target.cells[side, axis]
    if target.period[side, axis] > 0.0:
        return _place_round(target, side, axis, lo, hi, pad)
    leaves = 0
    if lo < target.edges[begin]:
        leaves |= 1 << target.sink_below
    if hi > target.edges[begin + n]:
        leaves |= 1 << target.sink_above
    first = holding(target, side, axis, lo, hint)
    while first > 0 and target.edges[begin + first] >= lo:
        first -= 1
    while first < n and target.edges[begin + first + 1] < lo:
        first += 1
    last = holding(target, side, axis, hi, min(first, n - 1))
    while last < n - 1 and target.edges[begin + last + 1] <= hi:
        last += 1
    while last >= 0 and target.edges[begin + last] > hi:
        last -= 1
    if last >= first:
        first, last = max(first - pad, 0), min(last + pad, n - 1)
    elif pad > 0:  # beside the grid: an enlarged box may still meet it
        bottom, top = target.edges[begin], target.edges[begin + n]
        if (hi < bottom) & (hi + pad * (target.edges[begin + 1] - bottom) >= bottom):
            first, last = 0, 0
        elif (lo > top) & (lo - pad * (top - target.edges[begin + n - 1]) <= top):
            first, last = n - 1, n - 1
    return first, last, leaves


@kernel(entry=True, counting=False)
def _fill_round(target: Target, lo: Any, hi: Any, first: Any, last: Any) -> None:
    for k in range(lo.size):
        first[k], last[k], _ = _place_round(target, 0, 0, lo[k], hi[k], 0)


def met_round(edges: NDArray[np.float64], lo: Any, hi: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last cell of an axis that closes that intervals meet, counted on beyond the seam."""
    domain = Domain(edges[None, :1], edges[None, -1:], periodic=(True,))
    target = Target.of(Grid(domain, ((edges,),)), {})
    first, last = np.empty(lo.size, np.int64), np.empty(lo.size, np.int64)
    _fill_round(target, np.ascontiguousarray(lo), np.ascontiguousarray(hi), first, last)
    return first, last


# ----------------------------------------------------------------
# Boxes of target cells, before they become ranges.


@dataclass(frozen=True, eq=False)
class TargetBoxes:
    """Boxes of cells of one side: `cell` (local, ascending), `side`, `lo`, `hi` of shape (n, dimension), `exits`."""

    cell: NDArray[np.int64]
    side: NDArray[np.int32]
    lo: NDArray[np.int32]
    hi: NDArray[np.int32]
    exits: NDArray[np.uint8]
    second_pass: float


def cut_at_seams(boxes: TargetBoxes, shape: NDArray[np.int64]) -> TargetBoxes:
    """Cut the boxes that pass a seam in two; `shape` has the cells per side and axis."""
    for axis in range(shape.shape[1]):
        n = shape[boxes.side, axis]
        beyond = boxes.hi[:, axis] >= n
        if not beyond.any():
            continue
        corners = {"lo": boxes.lo[beyond], "hi": boxes.hi[beyond]}
        rest = replace(boxes, cell=boxes.cell[beyond], side=boxes.side[beyond], **corners)
        boxes.hi[beyond, axis] = n[beyond] - 1
        rest.lo[:, axis] = 0
        rest.hi[:, axis] -= n[beyond]
        boxes = merged([boxes, rest], boxes.exits.size, boxes.second_pass)
    return boxes


def no_boxes(dimension: int, exits: NDArray[np.uint8]) -> TargetBoxes:
    """Return no boxes, and exits of cells."""
    none, corner = np.empty(0, np.int64), np.empty((0, dimension), np.int32)
    return TargetBoxes(none, none.astype(np.int32), corner, corner.copy(), exits, 0.0)


@kernel(entry=True, counting=False)
def _place_hulls(
    target: Target, side: Any, lo: Any, hi: Any, pad: int, first: Any, last: Any, exits: Any, met: Any
) -> None:
    hint = np.int64(0)
    for box in range(side.size):
        out, meets = 0, True
        for axis in range(lo.shape[1]):
            k, m, leaves = place(target, np.int64(side[box]), axis, lo[box, axis], hi[box, axis], pad, hint)
            out |= leaves
            meets &= m >= k
            first[box, axis], last[box, axis] = k, m
            hint = k
        exits[box], met[box] = out, meets


def placed(
    target: Target, cell: NDArray[np.int64], side: NDArray[np.int64], lo: Any, hi: Any, pad: int, inside: bool
) -> TargetBoxes:
    """Boxes of the given hulls; `inside`: they are forced images, which do not count as leaving."""
    count, dimension = lo.shape
    k, m = np.empty((count, dimension), np.int32), np.empty((count, dimension), np.int32)
    exits, met = np.empty(count, np.uint8), np.empty(count, np.bool_)
    _place_hulls(target, side, np.ascontiguousarray(lo), np.ascontiguousarray(hi), pad, k, m, exits, met)
    leaves = np.zeros(count, np.uint8) if inside else exits
    return TargetBoxes(cell[met], side[met].astype(np.int32), k[met], m[met], _per_cell(cell, leaves), 0.0)


def _per_cell(cell: NDArray[np.int64], exits: NDArray[np.uint8]) -> NDArray[np.uint8]:
    exits_of_cell = np.zeros(int(cell.max(initial=-1)) + 1, np.uint8)
    np.bitwise_or.at(exits_of_cell, cell, exits)
    return exits_of_cell


def leaving(target: Target, cell: NDArray[np.int64], code: NDArray[np.int64], dimension: int) -> TargetBoxes:
    """Mark the exits that codes name, without boxes."""
    bits = (1 << target.sink_of_code[-code]).astype(np.uint8)
    return no_boxes(dimension, _per_cell(cell, bits))


def merged(parts: list[TargetBoxes], n: int, second: float) -> TargetBoxes:
    """Boxes of all parts, by cell."""
    cell = np.concatenate([part.cell for part in parts])
    order = np.argsort(cell, kind="stable")
    exits = np.zeros(n, np.uint8)
    for part in parts:
        exits[: part.exits.size] |= part.exits
    return TargetBoxes(
        cell[order],
        np.concatenate([part.side for part in parts])[order],
        np.concatenate([part.lo for part in parts])[order],
        np.concatenate([part.hi for part in parts])[order],
        exits,
        second,
    )
