"""Images of cells on which the branch changes, or the map turns.

In one dimension such a cell is cut into equal parts and where the branch changes, and each piece gets its image, from
its least value to its greatest.  Otherwise the cell gets the
image of every branch that one of its points takes, from all its points and from the borders between two that do
different things: together with the closed cells that is the
closed relation, which holds the limits from both sides.  Ways out are taken from real images only; the image of a
whole cell under a forced branch is clipped to the domain.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.graph.boxes import Boxes, leaving, placed
from limitsets.graph.images.samples import Samples
from limitsets.graph.target import Target
from limitsets.jit import kernel
from limitsets.maps import codes, images, images_on, kind_of
from limitsets.maps.drivers import step
from limitsets.maps.kernels import on_side

__all__ = ["bent", "every_branch", "split"]

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
    """Cut [lo, hi] where the branch changes: ends of up to `most` pieces and their images, in the order met.

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
            x[cell, piece, 0], side_after[cell, piece], code_after[cell, piece] = step(here, left, side)
            if code_after[cell, piece] == code_end and side_after[cell, piece] == to_end:
                x[cell, piece, 1] = end
                more -= 1
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
            ends[cell, piece, 1] = a
            x[cell, piece, 1], _, _ = step(here, a, side)
            left = b
    return more


@kernel(entry=True)
def _widen(params: Any, side: int, ends: Any, x: Any, code_after: Any) -> None:
    """Widen the images of the ends of pieces to the extreme values in between: [lo, hi], codes of exits met there."""
    here = on_side(params, side)
    for k in range(code_after.size):
        lo, hi = x[k, 0], x[k, 1]
        for sign in (-1.0, 1.0):
            a, b = ends[k, 0], ends[k, 1]
            for _ in range(NARROWINGS):
                left, right = a + (b - a) / 3.0, b - (b - a) / 3.0
                one, _, code_one = step(here, left, side)
                two, _, code_two = step(here, right, side)
                code_after[k] = min(code_after[k], code_one, code_two)
                if code_one >= 0:
                    lo, hi = min(lo, one), max(hi, one)
                if code_two >= 0:
                    lo, hi = min(lo, two), max(hi, two)
                if sign * one > sign * two:
                    b = right
                else:
                    a = left
        x[k, 0], x[k, 1] = lo, hi


def bent(after: NDArray[np.float64], to: NDArray[Any], code: NDArray[Any]) -> NDArray[np.bool_]:
    """Cells between the points of one axis in which the image may turn, by its differences; the first and the last.

    Where the difference has another sign than next door the map turns, or has a pole, in one of the two cells.
    """
    same = (code[1:] == code[:-1]) & (to[1:] == to[:-1]) & (code[1:] >= 0)
    with np.errstate(invalid="ignore"):  # infinity less infinity has no sign, which is other than any
        trend = np.where(same, np.sign(np.diff(after)), np.nan)
    return _beside_change(trend)


def _beside_change(*rows: NDArray[Any]) -> NDArray[np.bool_]:
    """Entries that differ from one next to them in any of the rows; the first and the last; nan differs from nan."""
    differ = np.any([row[1:] != row[:-1] for row in rows], axis=0)
    change = np.concatenate([[True], differ, [True]])
    found: NDArray[np.bool_] = change[1:] | change[:-1]
    return found


def split(params: Any, side: int, target: Target, samples: Samples, cells: NDArray[np.int64]) -> list[Boxes]:
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
        ends, x = np.full((*shape, 2), np.nan), np.full((*shape, 2), np.nan)
        to: NDArray[np.int64] = np.zeros(shape, np.int64)
        code: NDArray[np.int64] = np.full(shape, codes.UNSETTLED, np.int64)
        more = _pieces(params, side, lo, hi, pieces, ends, x, to, code)
    owner = np.repeat(cells, PARTS * pieces)
    there = (code != codes.UNSETTLED).reshape(-1)
    owner, code, to = owner[there], code.reshape(-1)[there], to.reshape(-1)[there]
    image = x.reshape(-1, 2)[there]
    with np.errstate(invalid="ignore"):  # as in `bent`
        turns = (code >= 0) & _beside_change(np.sign(image[:, 1] - image[:, 0]), code, to)
    image.sort(axis=1)
    turning, met = image[turns], code[turns]
    _widen(params, side, ends.reshape(-1, 2)[there][turns], turning, met)
    image[turns] = turning
    real, gone, holed = code >= 0, code < 0, met < 0
    return [
        placed(target, owner[real], to[real], image[real, :1], image[real, 1:], samples.pad, inside=False),
        leaving(target, owner[gone], code[gone], 1),
        leaving(target, owner[turns][holed], met[holed], 1),
    ]


def every_branch(
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
    size = float(np.ptp(target.edges))
    starts = np.stack(samples.points(), axis=-1)[numbers]  # (cells, points, dimension)
    real = np.stack([values[numbers] for values in after], axis=-1)
    to, code = to[numbers].astype(np.int64), code[numbers].astype(np.int64)
    if not samples.scattered:
        borders = _borders(params, side, starts, to, code)
        met = images(params, _states(borders), side)
        shape = borders.shape[:-1]
        starts = np.concatenate([starts, borders], axis=1)
        real = np.concatenate([real, met.x.reshape(borders.shape)], axis=1)
        to = np.concatenate([to, met.side.reshape(shape)], axis=1)
        code = np.concatenate([code, met.code.reshape(shape)], axis=1)
    landed = (code > codes.OUTSIDE_MODEL) & np.isfinite(real).all(axis=-1)
    found = []
    owner = np.repeat(cells, code.shape[1])
    gone = ((code < 0) | ~landed).ravel()
    named = np.where(code < 0, code, codes.OUTSIDE).ravel()
    found.append(leaving(target, owner[gone], named[gone], real.shape[-1]))
    # Points that land beyond the domain leave, whichever box they end up in.
    flat = landed.ravel()
    points = real.reshape(-1, real.shape[-1])[flat]
    alone = placed(target, owner[flat], to.ravel()[flat], points, points, 0, inside=False)
    found.append(Boxes(alone.cell[:0], alone.side[:0], alone.lo[:0], alone.hi[:0], alone.exits, 0.0))
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
            found.append(
                placed(
                    target,
                    cells[taken],
                    forced_to[taken, 0],
                    lo.min(axis=1),
                    hi.max(axis=1),
                    samples.pad,
                    True,
                )
            )
        return found
    landed &= code >= 0
    for key in {(int(c), int(t)) for c, t in zip(code[landed], to[landed], strict=True)}:
        mine = landed & (code == key[0]) & (to == key[1])
        some = mine.any(axis=1)
        lo = np.where(mine[..., None], real, np.inf).min(axis=1)[some]
        hi = np.where(mine[..., None], real, -np.inf).max(axis=1)[some]
        sides = np.full(int(some.sum()), key[1])
        found.append(placed(target, cells[some], sides, lo, hi, samples.pad, True))
    return found


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
