"""From images of sample points to boxes of target cells.

A cell all of whose points take one branch gets one box, in a compiled pass.  The few others (a guard or a critical
point runs through them) are done apart: the image of every branch, or, in one dimension, of every piece.  Ways out
are taken from real images only; the image of a whole cell under a forced branch is clipped to the domain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.graph.images import Samples
from limitsets.jit import kernel
from limitsets.maps import codes, images, images_on, kind_of
from limitsets.maps.contract import fallback, image, on_side
from limitsets.maps.drivers import pick, put, step

__all__ = ["Boxes", "Target", "boxes_of_side"]

DECIDED, EMPTY, MIXED = 1, 0, 2

# A forced image this close to a real one, relative to the domain's size, comes from the same branch.
SAME_IMAGE = 1e-9


class Target(NamedTuple):
    """The grid that images land on, as kernels take it."""

    edges: NDArray[np.float64]  # all axes of all sides, one after the other
    begin: NDArray[np.int64]  # (n_sides, dimension): where an axis begins in `edges`
    cells: NDArray[np.int64]  # (n_sides, dimension)
    per_length: NDArray[np.float64]  # cells per length of a uniform axis, 0 on a graded one
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
            np.concatenate(axes), begin.reshape(shape), grid.shape, np.array(rate).reshape(shape), below, above, sink
        )


@dataclass(frozen=True, eq=False)
class Boxes:
    """Boxes of cells of one side: `cell` (local, ascending), `side`, `lo`, `hi` of shape (n, dimension), `exits`."""

    cell: NDArray[np.int64]
    side: NDArray[np.int32]
    lo: NDArray[np.int32]
    hi: NDArray[np.int32]
    exits: NDArray[np.uint8]
    second_pass: float


@kernel
def first_meeting(target: Target, side: int, axis: int, x: float, hint: int) -> int:
    """Smallest position whose closed cell reaches x or beyond; the number of cells if none does."""
    begin, n = target.begin[side, axis], target.cells[side, axis]
    rate = target.per_length[side, axis]
    k = np.int64(hint)
    if rate > 0.0:
        u = (x - target.edges[begin]) * rate
        k = np.int64(min(max(u, 0.0), n - 1.0))
    k = min(max(k, 0), n - 1)
    while k > 0 and target.edges[begin + k] >= x:
        k -= 1
    while k < n and target.edges[begin + k + 1] < x:
        k += 1
    return k


@kernel
def last_meeting(target: Target, side: int, axis: int, x: float, hint: int) -> int:
    """Largest position whose closed cell begins at x or before; -1 if none does."""
    begin, n = target.begin[side, axis], target.cells[side, axis]
    rate = target.per_length[side, axis]
    k = np.int64(hint)
    if rate > 0.0:
        u = (x - target.edges[begin]) * rate
        k = np.int64(min(max(u, 0.0), n - 1.0))
    k = min(max(k, 0), n - 1)
    while k < n - 1 and target.edges[begin + k + 1] <= x:
        k += 1
    while k >= 0 and target.edges[begin + k] > x:
        k -= 1
    return k


@kernel
def place(target: Target, side: int, axis: int, lo: float, hi: float, pad: int, hint: int) -> tuple[int, int, int]:
    """Positions that [lo, hi] meets along one axis, and the exit it reaches past (-1: none)."""
    begin, n = target.begin[side, axis], target.cells[side, axis]
    leaves = -1
    if lo < target.edges[begin]:
        leaves = target.sink_below
    if hi > target.edges[begin + n]:
        leaves = target.sink_above
    k = first_meeting(target, side, axis, lo, hint)
    m = last_meeting(target, side, axis, hi, k)
    if m >= k:
        k, m = max(k - pad, 0), min(m + pad, n - 1)
    return k, m, leaves


@kernel(entry=True)
def _images_of_product(params: Any, side: int, axes: Any, xs: Any, after: Any, side_after: Any, code_after: Any) -> int:
    """Images of all combinations of axis values; `xs` holds one run of the last axis at a time."""
    here = on_side(params, side)
    inner = axes[len(axes) - 1].size
    outer = side_after.size // inner
    again = 0
    for o in range(outer):
        rest = o
        for axis in range(len(axes) - 2, -1, -1):
            value = axes[axis][rest % axes[axis].size]
            rest //= axes[axis].size
            for k in range(inner):
                xs[axis][k] = value
        for k in range(inner):
            xs[len(axes) - 1][k] = axes[len(axes) - 1][k]
        base = o * inner
        for k in range(inner):
            x, to, code = image(here, pick(xs, k), side)
            put(after, base + k, x)
            side_after[base + k] = to
            code_after[base + k] = code
        for k in range(inner):
            if code_after[base + k] == codes.UNSETTLED:
                x, to, code = fallback(here, pick(xs, k), side)
                put(after, base + k, x)
                side_after[base + k] = to
                code_after[base + k] = code
                again += 1
    return again


@kernel(entry=True)
def _hulls(
    target: Target,
    shape: Any,
    strides: Any,
    offsets: Any,
    pad: int,
    after: Any,
    side_after: Any,
    code_after: Any,
    state: Any,
    side_out: Any,
    lo_out: Any,
    hi_out: Any,
    exits: Any,
) -> None:
    """Box of every cell whose points agree; the state of the others."""
    dimension = len(after)
    inner = shape[dimension - 1]
    hint = 0
    for cell in range(state.size):
        rest, base = cell // inner, (cell % inner) * strides[dimension - 1]
        for axis in range(dimension - 2, -1, -1):
            base += (rest % shape[axis]) * strides[axis]
            rest //= shape[axis]
        code, to = code_after[base + offsets[0]], side_after[base + offsets[0]]
        agree = True
        for s in range(1, offsets.size):
            k = base + offsets[s]
            agree &= (code_after[k] == code) & (side_after[k] == to)
        if not agree or code < 0:
            state[cell] = MIXED
            continue
        side_out[cell] = to
        state[cell] = DECIDED
        out = 0
        for axis in range(dimension):
            lo = hi = after[axis][base + offsets[0]]
            for s in range(1, offsets.size):
                value = after[axis][base + offsets[s]]
                lo, hi = min(lo, value), max(hi, value)
            k, m, leaves = place(target, to, axis, lo, hi, pad, hint)
            if leaves >= 0:
                out |= 1 << leaves
            if m < k:
                state[cell] = EMPTY
            lo_out[cell, axis], hi_out[cell, axis] = k, m
            hint = k
        exits[cell] = out


@kernel(entry=True)
def _place_hulls(target: Target, side: Any, lo: Any, hi: Any, pad: int, k: Any, m: Any, exits: Any, met: Any) -> None:
    for box in range(side.size):
        out, meets = 0, True
        for axis in range(lo.shape[1]):
            k[box, axis], m[box, axis], leaves = place(target, side[box], axis, lo[box, axis], hi[box, axis], pad, 0)
            if leaves >= 0:
                out |= 1 << leaves
            meets &= m[box, axis] >= k[box, axis]
        exits[box], met[box] = out, meets


@kernel(entry=True)
def _pieces(params: Any, side: int, lo: Any, hi: Any, most: int, x: Any, side_after: Any, code_after: Any) -> None:
    """Cut [lo, hi] where the branch changes: images of the ends of up to `most` pieces, in the order met."""
    here = on_side(params, side)
    for cell in range(lo.size):
        left = lo[cell]
        end, to_end, code_end = step(here, hi[cell], side)
        for piece in range(most):
            x[cell, piece, 0], side_after[cell, piece], code_after[cell, piece] = step(here, left, side)
            if code_after[cell, piece] == code_end and side_after[cell, piece] == to_end:
                x[cell, piece, 1] = end
                break
            a, b = left, hi[cell]
            while True:
                middle = 0.5 * (a + b)
                if not a < middle < b:
                    break
                _, to, code = step(here, middle, side)
                if code == code_after[cell, piece] and to == side_after[cell, piece]:
                    a = middle
                else:
                    b = middle
            x[cell, piece, 1], _, _ = step(here, a, side)
            left = b


MOST_PIECES = 6


def _place(
    target: Target, cell: NDArray[np.int64], side: NDArray[np.int64], lo: Any, hi: Any, pad: int, inside: bool
) -> Boxes:
    """Boxes of the given hulls; `inside`: they are forced images, which do not count as leaving."""
    count, dimension = lo.shape
    k, m = np.empty((count, dimension), np.int32), np.empty((count, dimension), np.int32)
    exits, met = np.empty(count, np.uint8), np.empty(count, np.bool_)
    _place_hulls(target, side, np.ascontiguousarray(lo), np.ascontiguousarray(hi), pad, k, m, exits, met)
    leaves = np.zeros(count, np.uint8) if inside else exits
    return Boxes(cell[met], side[met].astype(np.int32), k[met], m[met], _per_cell(cell, leaves), 0.0)


def _per_cell(cell: NDArray[np.int64], exits: NDArray[np.uint8]) -> NDArray[np.uint8]:
    found = np.zeros(int(cell.max(initial=-1)) + 1, np.uint8)
    np.bitwise_or.at(found, cell, exits)
    return found


def _split(params: Any, side: int, target: Target, samples: Samples, cells: NDArray[np.int64]) -> list[Boxes]:
    """Images of the pieces of undecided cells in one dimension."""
    edges = samples.axes[0]
    shape = (cells.size, MOST_PIECES)
    x, to = np.full((*shape, 2), np.nan), np.zeros(shape, np.int64)
    code = np.full(shape, codes.UNSETTLED, np.int64)
    _pieces(params, side, edges[cells], edges[cells + 1], MOST_PIECES, x, to, code)
    owner = np.repeat(cells, MOST_PIECES)
    code, to, ends = code.ravel(), to.ravel(), x.reshape(-1, 2)
    real = (code > codes.OUTSIDE_MODEL) & np.isfinite(ends).all(axis=1)
    found = [
        _place(
            target,
            owner[real],
            to[real],
            ends[real].min(axis=1, keepdims=True),
            ends[real].max(axis=1, keepdims=True),
            samples.pad,
            inside=False,
        )
    ]
    gone = (code < 0) & (code != codes.UNSETTLED)
    return [*found, _leaving(target, owner[gone], code[gone], 1)]


def _leaving(target: Target, cell: NDArray[np.int64], code: NDArray[np.int64], dimension: int) -> Boxes:
    """Exits that codes name, without boxes."""
    bits = (1 << target.sink_of_code[-code]).astype(np.uint8)
    nothing, none = np.empty(0, np.int64), np.empty((0, dimension), np.int32)
    return Boxes(nothing, nothing.astype(np.int32), none, none, _per_cell(cell, bits), 0.0)


def _every_branch(
    params: Any,
    side: int,
    target: Target,
    samples: Samples,
    cells: NDArray[np.int64],
    numbers: NDArray[np.int64],
    seen: Any,
) -> list[Boxes]:
    """Images of undecided cells: under every branch that one of their points takes, from all their points.

    Without forced images (a map that has only `image`) each branch is given the points that take it.
    """
    kind = kind_of(params)
    after, to, code = seen
    size = max(float(np.ptp(target.edges)), 1.0)
    real = np.stack([values[numbers] for values in after], axis=-1)  # (cells, points, dimension)
    to, code = to[numbers].astype(np.int64), code[numbers].astype(np.int64)
    landed = (code > codes.OUTSIDE_MODEL) & np.isfinite(real).all(axis=-1)
    found = []
    owner = np.repeat(cells, numbers.shape[1])
    gone = ((code < 0) | ~landed).ravel()
    named = np.where(code < 0, code, codes.OUTSIDE).ravel()
    found.append(_leaving(target, owner[gone], named[gone], real.shape[-1]))
    # Points that land beyond the domain leave, whichever box they end up in.
    flat = landed.ravel()
    points = real.reshape(-1, real.shape[-1])[flat]
    alone = _place(target, owner[flat], to.ravel()[flat], points, points, 0, inside=False)
    found.append(Boxes(alone.cell[:0], alone.side[:0], alone.lo[:0], alone.hi[:0], alone.exits, 0.0))
    if kind.has_image_on:
        starts = np.stack(samples.points(), axis=-1)[numbers].reshape(-1, real.shape[-1])
        for branch in range(len(kind.branches)):
            forced, forced_to = images_on(params, starts if real.shape[-1] > 1 else starts[:, 0], side, branch)
            forced, forced_to = forced.reshape(real.shape), forced_to.reshape(to.shape)
            close = (np.abs(forced - real) <= SAME_IMAGE * size).all(axis=-1) & (forced_to == to)
            taken = ((code == branch) | ((code < 0) & landed & close)).any(axis=1)
            taken &= np.isfinite(forced).all(axis=(1, 2))
            hull = forced[taken]
            found.append(
                _place(target, cells[taken], forced_to[taken, 0], hull.min(axis=1), hull.max(axis=1), samples.pad, True)
            )
        return found
    for key in {(int(c), int(t)) for c, t in zip(code[landed], to[landed], strict=True)}:
        mine = landed & (code == key[0]) & (to == key[1])
        some = mine.any(axis=1)
        lo = np.where(mine[..., None], real, np.inf).min(axis=1)[some]
        hi = np.where(mine[..., None], real, -np.inf).max(axis=1)[some]
        sides = np.full(int(some.sum()), key[1])
        found.append(_place(target, cells[some], sides, lo, hi, samples.pad, True))
    return found


def boxes_of_side(params: Any, grid: Grid, side: int, target: Target, samples: Samples) -> Boxes:
    """Boxes of all cells of one side."""
    dimension, shape = grid.dimension, grid.shape[side]
    n = int(shape.prod())
    if samples.scattered:
        points = samples.axes if dimension > 1 else samples.axes[0]
        got = images(params, np.stack(points, axis=-1) if dimension > 1 else points, side)
        after = tuple(np.ascontiguousarray(got.x.reshape(-1, dimension)[:, axis]) for axis in range(dimension))
        to, code, second = got.side.astype(np.int16), got.code.astype(np.int8), got.second_pass
    else:
        count = int(np.prod([axis.size for axis in samples.axes]))
        after = tuple(np.empty(count) for _ in range(dimension))
        to, code = np.empty(count, np.int16), np.empty(count, np.int8)
        run = tuple(np.empty(samples.axes[-1].size) for _ in range(dimension))
        second = _images_of_product(params, side, samples.axes, run, after, to, code) / count
    state, side_out = np.empty(n, np.int8), np.zeros(n, np.int32)
    lo, hi = np.empty((n, dimension), np.int32), np.empty((n, dimension), np.int32)
    exits = np.zeros(n, np.uint8)
    strides = np.array(samples.strides)
    _hulls(
        target, shape, strides, samples.offsets, samples.pad, after, to, code, state, side_out, lo, hi, exits
    )
    mixed = np.flatnonzero(state == MIXED)
    if not mixed.size and (state == DECIDED).all():
        return Boxes(np.arange(n), side_out, lo, hi, exits, second)
    decided = np.flatnonzero(state == DECIDED)
    parts = [Boxes(decided, side_out[decided], lo[decided], hi[decided], exits, second)]
    if mixed.size and samples.split:
        parts += _split(params, side, target, samples, mixed)
    elif mixed.size:
        positions = np.unravel_index(mixed, tuple(shape))
        numbers = sum(p * s for p, s in zip(positions, samples.strides, strict=True))[:, None] + samples.offsets
        parts += _every_branch(params, side, target, samples, mixed, numbers, (after, to, code))
    return _merge(parts, n, second)


def _merge(parts: list[Boxes], n: int, second: float) -> Boxes:
    cell = np.concatenate([part.cell for part in parts])
    order = np.argsort(cell, kind="stable")
    exits = np.zeros(n, np.uint8)
    for part in parts:
        exits[: part.exits.size] |= part.exits
    return Boxes(
        cell[order],
        np.concatenate([part.side for part in parts])[order],
        np.concatenate([part.lo for part in parts])[order],
        np.concatenate([part.hi for part in parts])[order],
        exits,
        second,
    )
