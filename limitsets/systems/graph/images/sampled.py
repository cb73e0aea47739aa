"""Image methods that sample points or corners of a cell: from images of points to boxes of target cells.

A cell all of whose points take one branch gets one box, in a compiled pass; the few others are done apart
(`undecided.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.numbers.jit import kernel
from limitsets.systems.cells import Grid
from limitsets.systems.graph.images.undecided import SamplePoints, every_branch, mark_bends, split
from limitsets.systems.graph.target import Target, TargetBoxes, merged, place
from limitsets.systems.maps import codes, images, kind_of
from limitsets.systems.maps.contract import compiled_kind_of
from limitsets.systems.maps.drivers import judged
from limitsets.systems.maps.kernels import fallback, image, on_side, pick, put

# ----------------------------------------------------------------
# The box around the images of a cell's corners, bare or enlarged by one cell on every side.
#
# Neighbours share corners, so there are hardly more points than cells.  In one dimension, on branches that are
# monotone in each cell, the corners are the end points and the box is the image itself; there a cell on which the
# branch changes is cut where it does.


def corners(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """Two, four or eight corners per cell."""
    axes = grid.edges[side]
    sizes = [edges.size for edges in axes]
    strides = tuple(int(np.prod(sizes[k + 1 :])) for k in range(len(sizes)))
    offsets = [
        sum(s * c for s, c in zip(strides, corner, strict=True))
        for corner in product((0, 1), repeat=len(axes))
    ]
    return SamplePoints(axes, strides, np.array(offsets, np.int64))


def corners_padded(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """Corners, and one cell more on every side of the box."""
    return replace(corners(grid, side), pad=1)


def end_points(grid: Grid, side: int, **_: Any) -> SamplePoints:
    """End points of cells in one dimension; raises AnswerError in more."""
    if grid.dimension != 1:
        raise AnswerError(
            "the image method", "end-points", "another in more than one dimension", "use corners-padded"
        )
    return replace(corners(grid, side), split=True)


# ----------------------------------------------------------------
# Image methods that sample: from images of points to boxes of target cells.


DECIDED, EMPTY, MIXED = 1, 0, 2


@kernel(entry=True)
def _images_of_product(
    params: Any, side: int, axes: Any, xs: Any, after: Any, side_after: Any, code_after: Any
) -> int:
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
            code_after[base + k] = judged(x, code)
        for k in range(inner):
            if code_after[base + k] == codes.UNSETTLED:
                x, to, code = fallback(here, pick(xs, k), side)
                put(after, base + k, x)
                side_after[base + k] = to
                code_after[base + k] = judged(x, code)
                again += 1
    return again


@kernel(entry=True, counting=False)
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
    """Box of every cell whose points agree; the state of the others.

    A run of cells along the last axis at a time: to take one coordinate out of a tuple of arrays costs more than to
    place a cell.
    """
    dimension = len(after)
    inner, along = shape[dimension - 1], strides[dimension - 1]
    for run in range(state.size // inner):
        rest, base, begin = run, np.int64(0), run * inner
        for axis in range(dimension - 2, -1, -1):
            base += (rest % shape[axis]) * strides[axis]
            rest //= shape[axis]
        for cell in range(inner):
            k = base + cell * along
            # One integer type for all: another would compile what `place` calls once more.
            code, to = np.int64(code_after[k + offsets[0]]), np.int64(side_after[k + offsets[0]])
            agree = code >= 0
            for s in range(1, offsets.size):
                agree &= (code_after[k + offsets[s]] == code) & (side_after[k + offsets[s]] == to)
            state[begin + cell] = DECIDED if agree else MIXED
            side_out[begin + cell] = to if agree else 0
            exits[begin + cell] = 0
        for axis in range(dimension):
            values, hint = after[axis], np.int64(0)
            for cell in range(inner):
                if state[begin + cell] == MIXED:
                    continue
                k = base + cell * along
                lo = hi = values[k + offsets[0]]
                for s in range(1, offsets.size):
                    value = values[k + offsets[s]]
                    lo, hi = min(lo, value), max(hi, value)
                first, last, leaves = place(target, np.int64(side_out[begin + cell]), axis, lo, hi, pad, hint)
                exits[begin + cell] |= leaves
                if last < first:
                    state[begin + cell] = EMPTY
                lo_out[begin + cell, axis], hi_out[begin + cell, axis] = first, last
                hint = first


def sampled(method: Callable[..., SamplePoints]) -> Callable[..., TargetBoxes]:
    """Make an image method of a function that chooses the points of each cell."""
    return partial(_boxes_of_side, method)


def _require_sides(grid: Grid, to: Any, code: Any) -> None:
    """Refuse images on sides that the grid has not: compiled code would read whatever lies beyond its edges."""
    if to.size and (to.min() < 0 or to.max() >= grid.sides):
        beyond = to[(code >= 0) & ((to < 0) | (to >= grid.sides))]
        if beyond.size:
            raise AnswerError(
                "the side of an image",
                int(beyond[0]),
                f"one of the {grid.sides} of the grid",
                "cut a domain with one box for each side of the map",
            )


def _images_of_arrays(params: Any, side: int, samples: SamplePoints, after: Any, to: Any, code: Any) -> float:
    """Do what `_images_of_product` does, by a function of arrays."""
    there = images(params, np.stack(samples.points(), axis=-1), side)
    for values, each in zip(after, np.reshape(there.x, (to.size, -1)).T, strict=True):
        values[:] = each
    to[:], code[:] = there.side, there.code
    return 0.0


def _boxes_of_side(
    method: Callable[..., SamplePoints], params: Any, grid: Grid, side: int, target: Target, **options: Any
) -> TargetBoxes:
    """Boxes of all cells of one side."""
    samples = method(grid, side, **options)
    if samples.split:
        compiled_kind_of(params, 'transitions by "end-points", or a method that cuts cells as it does,')
    dimension, shape = grid.dimension, grid.shape[side]
    n = int(shape.prod())
    count = int(np.prod([axis.size for axis in samples.axes]))
    after = tuple(np.empty(count) for _ in range(dimension))
    to, code = np.empty(count, np.int16), np.empty(count, np.int8)
    if kind_of(params).on_arrays is None:
        run = tuple(np.empty(samples.axes[-1].size) for _ in range(dimension))
        second = _images_of_product(params, side, samples.axes, run, after, to, code) / count
    else:
        second = _images_of_arrays(params, side, samples, after, to, code)
    _require_sides(grid, to, code)
    state, side_out, exits = np.empty(n, np.int8), np.empty(n, np.int32), np.empty(n, np.uint8)
    lo, hi = np.empty((n, dimension), np.int32), np.empty((n, dimension), np.int32)
    strides = np.array(samples.strides)
    _hulls(
        target, shape, strides, samples.offsets, samples.pad, after, to, code, state, side_out, lo, hi, exits
    )
    if samples.split:
        mark_bends(after[0], to, code, MIXED, state)
    mixed = np.flatnonzero(state == MIXED)
    if not mixed.size and (state == DECIDED).all():
        return TargetBoxes(np.arange(n), side_out, lo, hi, exits, second)
    decided = np.flatnonzero(state == DECIDED)
    exits[mixed] = 0
    parts = [TargetBoxes(decided, side_out[decided], lo[decided], hi[decided], exits, second)]
    if mixed.size and samples.split:
        parts.append(split(params, side, target, samples, mixed))
    elif mixed.size:
        positions = np.unravel_index(mixed, tuple(shape))
        numbers = (np.stack(positions, axis=1) @ strides)[:, None] + samples.offsets
        parts += every_branch(
            params, side, target, samples=samples, cells=mixed, numbers=numbers, seen=(after, to, code)
        )
    return merged(parts, n, second)
