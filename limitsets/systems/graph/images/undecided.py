"""Images of cells on which the branch changes, or the map turns or jumps; and what an image method gives.

In one dimension such a cell is cut into equal parts, where the branch changes and where the image jumps on a branch
(a floor), and each piece gets its image, from its least value to its greatest.  Otherwise the cell gets the
image of every branch that one of its points takes, from all its points and from the borders between two that do
different things: together with the closed cells that is the
closed relation, which holds the limits from both sides.  Ways out are taken from real images only; the image of a
whole cell under a forced branch is clipped to the domain.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.numbers.jit import kernel
from limitsets.systems.graph.target import Target, TargetBoxes, leaving, no_boxes, place, placed
from limitsets.systems.maps import codes, images, images_on, kind_of
from limitsets.systems.maps.drivers import step
from limitsets.systems.maps.kernels import on_side

# ----------------------------------------------------------------
# Result of an image method: points of one side, and the cell that each point represents.


@dataclass(frozen=True, eq=False)
class SamplePoints:
    """Points of one side and their cells.

    The points of the cell at position (i, j, ...) are those with number ``i s_0 + j s_1 + ... + offset``.

    Attributes
    ----------
    axes : tuple of ndarray
        The points are all combinations of these values, the last axis running fastest.
    strides : tuple of int
        s_0, s_1, ...
    offsets : ndarray of int64, shape (points per cell,)
        The offsets.
    pad : int
        Cells by which the image's box is enlarged on every side.
    split : bool
        In one dimension: an undecided cell is cut where the branch changes, and each piece's image taken, instead
        of the image of the whole cell under every branch.
    """

    axes: tuple[NDArray[np.float64], ...]
    strides: tuple[int, ...]
    offsets: NDArray[np.int64]
    pad: int = 0
    split: bool = False

    def points(self) -> tuple[NDArray[np.float64], ...]:
        """All points, one array per coordinate."""
        return tuple(m.ravel() for m in np.meshgrid(*self.axes, indexing="ij"))


# ----------------------------------------------------------------
# Images of cells on which the branch changes, or the map turns or jumps.


# Pieces that one cell may be cut into, at first and at last: more than six are rare, more than the last an error.
FEW_PIECES, MOST_PIECES = 6, 1536

# Equal parts of such a cell, so that a hole or a bend in it is met, and steps in search of a piece's extreme values:
# each leaves two thirds of the piece.
PARTS, NARROWINGS = 16, 25

# Halvings between two points of a cell in search of the border between what they do: to the last digits.
HALVINGS = 60

# A forced image this close to a real one, relative to the domain's size, comes from the same branch.
SAME_IMAGE = 1e-9


@kernel(entry=True)
def _pieces(
    params: Any, side: int, lo: Any, hi: Any, most: int, ends: Any, x: Any, side_after: Any, code_after: Any
) -> int:
    """Cut [lo, hi] where the branch changes or the image jumps: ends of up to `most` pieces and images, as met.

    A jump is a step between adjacent floats that is wider than [lo, hi]; a smaller one is not seen in cells.  One is
    looked for, and first: beside a pole there are thousands.
    Returns how many cells have more.
    """
    here = on_side(params, side)
    more = 0
    for cell in range(lo.size):
        more += 1
        left = lo[cell]
        end, to_end, code_end = step(here, hi[cell], side)
        for piece in range(most):
            ends[cell, piece, 0], ends[cell, piece, 1] = left, hi[cell]
            first, side_first, code_first = step(here, left, side)
            x[cell, piece, 0], side_after[cell, piece], code_after[cell, piece] = (
                first,
                side_first,
                code_first,
            )
            alike = (code_first == code_end) & (side_first == to_end)
            a, b, at_a, at_b = left, hi[cell], first, end
            while True:
                middle = 0.5 * (a + b)
                if not a < middle < b:
                    break
                at, to, code = step(here, middle, side)
                nearer = not alike or abs(at - at_a) <= abs(at_b - at)
                if nearer and code == code_first and to == side_first:
                    a, at_a = middle, at
                else:
                    b, at_b = middle, at
            if alike and (piece > 0 or not abs(at_b - at_a) > hi[cell] - lo[cell]):
                x[cell, piece, 1] = end
                more -= 1
                break
            ends[cell, piece, 1], x[cell, piece, 1], left = a, at_a, b
    return more


@kernel
def _widened(here: Any, side: int, a: float, b: float, one: float, two: float, code: int) -> Any:
    """Widen the images of the ends of [a, b] to the extreme values in between: lo, hi, code of an exit met there."""
    lo, hi = one, two
    for sign in (-1.0, 1.0):
        bottom, top = a, b
        for _ in range(NARROWINGS):
            left, right = bottom + (top - bottom) / 3.0, top - (top - bottom) / 3.0
            at_left, _, code_left = step(here, left, side)
            at_right, _, code_right = step(here, right, side)
            code = min(code, code_left, code_right)
            if code_left >= 0:
                lo, hi = min(lo, at_left), max(hi, at_left)
            if code_right >= 0:
                lo, hi = min(lo, at_right), max(hi, at_right)
            if sign * at_left > sign * at_right:
                top = right
            else:
                bottom = left
    return lo, hi, code


@kernel
def _trend(one: float, two: float) -> float:
    """Sign of a difference; nan, which is other than any, where it has none."""
    way = two - one
    return way if way != way else float((way > 0.0) - (way < 0.0))


@kernel(entry=True)
def _place_pieces(
    params: Any,
    side: int,
    target: Target,
    pad: int,
    parts: int,
    cells: Any,
    pieces: Any,
    boxes: Any,
    exits: Any,
) -> int:
    """Target cells of pieces, widened where the map may turn in them; how many meet the grid.

    A piece is looked at between its neighbours: where it does something else than one of them, it may turn.
    """
    here = on_side(params, side)
    ends, x, to, code = pieces
    owner, side_out, first, last = boxes
    kept = 0  # pieces that there are, moved to the front
    for k in range(code.size):
        if code[k] != codes.UNSETTLED:
            ends[kept, 0], ends[kept, 1] = ends[k, 0], ends[k, 1]
            x[kept, 0], x[kept, 1] = x[k, 0], x[k, 1]
            to[kept], code[kept], owner[kept] = to[k], code[k], cells[k // parts]
            kept += 1
    made, changes, hint = 0, True, np.int64(0)
    for k in range(kept):
        turns, changes = changes, True
        if k + 1 < kept:
            trend, after = _trend(x[k, 0], x[k, 1]), _trend(x[k + 1, 0], x[k + 1, 1])
            changes = (trend != after) | (code[k] != code[k + 1]) | (to[k] != to[k + 1])
        cell = owner[k]
        if code[k] < 0:
            exits[cell] |= 1 << target.sink_of_code[-code[k]]
            continue
        lo, hi = min(x[k, 0], x[k, 1]), max(x[k, 0], x[k, 1])
        if turns | changes:
            lo, hi, met = _widened(here, side, ends[k, 0], ends[k, 1], lo, hi, code[k])
            if met < 0:
                exits[cell] |= 1 << target.sink_of_code[-met]
        begin, end, leaves = place(target, to[k], 0, lo, hi, pad, hint)
        exits[cell] |= leaves
        if end >= begin:
            owner[made], side_out[made], first[made, 0], last[made, 0] = cell, to[k], begin, end
            made += 1
        hint = begin
    return made


@kernel(entry=True, counting=False)
def mark_bends(after: Any, to: Any, code: Any, mark: int, state: Any) -> None:
    """Mark the cells between the points of one axis in which the image may turn, the first and the last.

    Where the difference has another sign than next door the map turns, or has a pole, in one of the two cells.
    """
    before = math.nan
    for k in range(state.size):
        same = (code[k + 1] == code[k]) & (to[k + 1] == to[k]) & (code[k + 1] >= 0)
        trend = _trend(after[k], after[k + 1]) if same else math.nan
        if trend != before:
            state[k] = mark
            state[max(k - 1, 0)] = mark
        before = trend
    state[state.size - 1] = mark


def split(
    params: Any, side: int, target: Target, samples: SamplePoints, cells: NDArray[np.int64]
) -> TargetBoxes:
    """Images of the pieces of some cells in one dimension."""
    borders = samples.axes[0]
    part = np.arange(PARTS + 1) / PARTS
    cuts = borders[cells, None] + part * (borders[cells + 1] - borders[cells])[:, None]
    cuts[:, -1] = borders[cells + 1]
    lo, hi = cuts[:, :-1].ravel(), cuts[:, 1:].ravel()
    pieces, more = FEW_PIECES // 2, lo.size
    while more:
        pieces *= 2
        if pieces > MOST_PIECES:
            raise AnswerError(
                "the number of changes of branch in one cell",
                f"over {MOST_PIECES}",
                f"at most {MOST_PIECES}",
                "ask for more cells",
            )
        shape = (lo.size, pieces)
        ends, x, to = np.empty((*shape, 2)), np.empty((*shape, 2)), np.empty(shape, np.int64)
        code = np.full(shape, codes.UNSETTLED, np.int64)
        more = _pieces(params, side, lo, hi, pieces, ends, x, to, code)
    flat = ends.reshape(-1, 2), x.reshape(-1, 2), to.reshape(-1), code.reshape(-1)
    owner, side_out = np.empty(code.size, np.int64), np.empty(code.size, np.int32)
    first, last = np.empty((code.size, 1), np.int32), np.empty((code.size, 1), np.int32)
    exits = np.zeros(int(cells[-1]) + 1, np.uint8)
    boxes = owner, side_out, first, last
    n = _place_pieces(params, side, target, samples.pad, PARTS * pieces, cells, flat, boxes, exits)
    return TargetBoxes(owner[:n], side_out[:n], first[:n], last[:n], exits, 0.0)


def every_branch(
    params: Any,
    side: int,
    target: Target,
    samples: SamplePoints,
    cells: NDArray[np.int64],
    numbers: NDArray[np.int64],
    seen: Any,
) -> list[TargetBoxes]:
    """Images of undecided cells: under every branch that one of their points takes, from all their points.

    Without forced images (a map that has only `image`) each branch is given the points that take it.
    """
    kind = kind_of(params)
    after, to, code = seen
    size = float(np.ptp(target.edges))
    starts = np.stack(samples.points(), axis=-1)[numbers]  # (cells, points, dimension)
    real = np.stack([values[numbers] for values in after], axis=-1)
    to, code = to[numbers].astype(np.int64), code[numbers].astype(np.int64)
    borders = _borders(params, side, starts, to, code)
    met = images(params, _states(borders), side)
    shape = borders.shape[:-1]
    starts = np.concatenate([starts, borders], axis=1)
    real = np.concatenate([real, met.x.reshape(borders.shape)], axis=1)
    to = np.concatenate([to, met.side.reshape(shape)], axis=1)
    code = np.concatenate([code, met.code.reshape(shape)], axis=1)
    landed = (code > codes.OUTSIDE_MODEL) & np.isfinite(real).all(axis=-1)
    owner = np.repeat(cells, code.shape[1])
    gone = ((code < 0) | ~landed).ravel()
    named = np.where(code < 0, code, codes.OUTSIDE).ravel()
    # Points that land beyond the domain leave, whichever box they end up in.
    flat = landed.ravel()
    points = real.reshape(-1, real.shape[-1])[flat]
    alone = placed(target, owner[flat], to.ravel()[flat], points, points, 0, inside=False)
    dimension = real.shape[-1]
    boxes = [leaving(target, owner[gone], named[gone], dimension), no_boxes(dimension, alone.exits)]
    if kind.has_image_on:
        for branch in range(len(kind.branches)):
            forced, forced_to = images_on(params, _states(starts), side, branch)
            forced, forced_to = forced.reshape(real.shape), forced_to.reshape(to.shape)
            finite = np.all(np.isfinite(forced), axis=-1)
            with np.errstate(invalid="ignore"):  # infinity less infinity is close to nothing
                close = (np.abs(forced - real) <= SAME_IMAGE * size).all(axis=-1) & (forced_to == to)
            taken = ((code == branch) | ((code < 0) & landed & close)).any(axis=1)
            taken &= np.any(finite, axis=1)  # the branch itself may have a hole
            lo, hi = (np.where(finite[..., None], forced, end)[taken] for end in (np.inf, -np.inf))
            boxes.append(
                placed(
                    target,
                    cells[taken],
                    forced_to[taken, 0],
                    lo=lo.min(axis=1),
                    hi=hi.max(axis=1),
                    pad=samples.pad,
                    inside=True,
                )
            )
        return boxes
    landed &= code >= 0
    for key in {(int(c), int(t)) for c, t in zip(code[landed], to[landed], strict=True)}:
        mine = landed & (code == key[0]) & (to == key[1])
        some = mine.any(axis=1)
        lo = np.where(mine[..., None], real, np.inf).min(axis=1)[some]
        hi = np.where(mine[..., None], real, -np.inf).max(axis=1)[some]
        sides = np.full(int(some.sum()), key[1])
        boxes.append(placed(target, cells[some], sides, lo=lo, hi=hi, pad=samples.pad, inside=True))
    return boxes


def _states(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points as the drivers take them: shape (n, dimension), or (n,) in one dimension."""
    flat = points.reshape(-1, points.shape[-1])
    return flat if flat.shape[1] > 1 else flat[:, 0]


def _borders(
    params: Any, side: int, points: NDArray[np.float64], to: NDArray[np.int64], code: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Where, between two points of a cell, the map begins to do something else: the last of one, the first after it.

    Returns
    -------
    ndarray, shape (cells, 2 pairs, dimension)
        The points themselves for pairs that do the same.
    """
    one, two = np.triu_indices(points.shape[1], 1)
    a, b = points[:, one], points[:, two]
    differ = (code[:, one] != code[:, two]) | (to[:, one] != to[:, two])
    low, high, was_to, was_code = a[differ], b[differ], to[:, one][differ], code[:, one][differ]
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        there = images(params, _states(middle), side)
        same = ((there.code == was_code) & (there.side == was_to))[:, None]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    a[differ], b[differ] = low, high
    return np.concatenate([a, b], axis=1)
