"""The Markov chain on cells that approximates a map: the share of each cell mapped to each cell (Ulam's matrix).

In one dimension cells are cut where the map changes its branch, turns or jumps; what is left is monotone, and a piece
is spread evenly between the images of its two ends.  Sample points would leave an error of about one sample in each
share, and so an error of the density that finer cells do not reduce.  In more dimensions, and for maps without forced
branches, which give the one-sided limits, points spread evenly in the cell are counted.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.graph import TransitionGraph
from limitsets.maps import along, has_slope, images, monotone_pieces

# Points per cell and axis, by dimension.
SAMPLES = {1: 64, 2: 4, 3: 3}


class UlamMatrix(NamedTuple):
    """Entries of the matrix: from cell `source` to cell `target` goes the share `weight`; the rest leaves."""

    source: NDArray[np.int64]
    target: NDArray[np.int64]
    weight: NDArray[np.float64]


def sample_points(grid: Grid, cells: NDArray[np.int64], side: int, samples: int) -> NDArray[np.float64]:
    """Middles of equal parts of some cells of one side, `samples` along each axis, the points of a cell in turn.

    Returns
    -------
    ndarray, shape (n * samples**dimension,), in more than one dimension (n * samples**dimension, dimension)

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.sets.markov_chain import sample_points
    >>> sample_points(ls.grid([(0.0, 4.0)], cells=2), [1], 0, 2)
    array([2.5, 3.5])
    """
    lo, hi = grid.boxes(cells, side)
    dimension = lo.shape[1]
    position = (np.indices((samples,) * dimension).reshape(dimension, -1).T + 0.5) / samples
    points = lo[:, None, :] + position * (hi - lo)[:, None, :]
    return points.reshape(-1) if dimension == 1 else points.reshape(-1, dimension)


def _from_points(graph: TransitionGraph, cells: NDArray[np.int64], side: int) -> UlamMatrix:
    """Shares of the points of each cell."""
    grid = graph.grid
    samples = SAMPLES[grid.dimension]
    found = images(graph.map, sample_points(grid, cells, side, samples), side)
    target = np.full(found.code.size, -1)
    for after in range(grid.sides):
        lands = (found.side == after) & (found.code >= 0)
        target[lands] = grid.index(found.x[lands], after)
    source = np.repeat(cells, samples**grid.dimension)
    kept = target >= 0
    return UlamMatrix(source[kept], target[kept], np.full(int(kept.sum()), samples ** -float(grid.dimension)))


def _spread(edges: NDArray[np.float64], lo: NDArray[np.float64], hi: NDArray[np.float64]) -> tuple[Any, ...]:
    """Cells between `edges` that each interval meets, and the share of the interval in each: owner, cell, share."""
    first = np.clip(np.searchsorted(edges, lo, side="right") - 1, 0, edges.size - 2)
    last = np.clip(np.searchsorted(edges, hi, side="left") - 1, first, edges.size - 2)
    count = last - first + 1
    owner = np.repeat(np.arange(lo.size), count)
    cell = np.arange(owner.size) - np.repeat(np.cumsum(count) - count, count) + first[owner]
    met = np.minimum(hi[owner], edges[cell + 1]) - np.maximum(lo[owner], edges[cell])
    width = (hi - lo)[owner]
    inside = (lo[owner] >= edges[0]) & (hi[owner] <= edges[-1])  # of an image too narrow to be shared out
    share = np.where(width > 0.0, np.maximum(met, 0.0) / np.where(width > 0.0, width, 1.0), inside)
    return owner, cell, share


def _from_pieces(
    graph: TransitionGraph, cells: NDArray[np.int64], side: int, pieces: Any
) -> list[UlamMatrix]:
    """Shares of the monotone pieces of each cell of one side."""
    grid = graph.grid
    boxes = grid.boxes(cells, side)
    bottom, top = boxes[0][:, 0], boxes[1][:, 0]
    ends = [piece.lo for piece in pieces[1:]]
    found = []
    for piece, end in zip(pieces, [*ends, np.inf], strict=True):
        # The last float of a piece and the first of the next are neighbours: the gap between them is nothing.
        piece_top = end if np.nextafter(piece.hi, np.inf) == end else piece.hi
        lo, hi = np.maximum(bottom, piece.lo), np.minimum(top, piece_top)
        some = np.flatnonzero(hi > lo)
        if not some.size:
            continue
        share = (hi[some] - lo[some]) / (top[some] - bottom[some])
        one, to, _ = along(graph.map, lo[some], side, [piece.branch])
        two, _, _ = along(graph.map, hi[some], side, [piece.branch])
        after = int(to[0])
        if not 0 <= after < grid.sides:
            continue
        owner, cell, part = _spread(grid.edges[after][0], np.minimum(one, two), np.maximum(one, two))
        weight = share[owner] * part
        kept = weight > 0.0
        number = grid.offset[after] + cell
        found.append(UlamMatrix(cells[some][owner][kept], number[kept], weight[kept]))
    return found


def ulam_matrix(graph: TransitionGraph, cells: NDArray[np.int64]) -> UlamMatrix:
    """Find where the given cells go; entries that name the same two cells add up.

    Parameters
    ----------
    graph : TransitionGraph
        Its map and grid are used.
    cells : ndarray of int, shape (n,)
        Numbers of the cells, ascending.

    Returns
    -------
    UlamMatrix
        Weights from one cell add up to 1 less what leaves the grid.
    """
    grid = graph.grid
    exact = grid.dimension == 1 and has_slope(graph.map)
    pieces = monotone_pieces(graph.map, grid.domain) if exact else {}
    parts: list[UlamMatrix] = []
    for side in range(grid.sides):
        here = cells[(cells >= grid.offset[side]) & (cells < grid.offset[side + 1])]
        if here.size:
            parts += (
                _from_pieces(graph, here, side, pieces[side]) if exact else [_from_points(graph, here, side)]
            )
    return UlamMatrix(*(np.concatenate(column) for column in zip(*parts, strict=True)))
