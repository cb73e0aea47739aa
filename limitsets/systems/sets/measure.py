"""Invariant measures by Ulam's method on a chain of cells.

Which share of a cell goes to which cell is a Markov chain on finitely many states.  Its
stationary distributions are the mixtures of one for each closed class, and each of those is found by repeated steps.
A cell of no closed class carries nothing.
Source: Ulam, "A Collection of Mathematical Problems", 1960, ch. VI; Li, J. Approximation Theory 17, 1976, shows that
the densities converge for piecewise expanding maps of an interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.maps import along, has_slope, images, monotone_pieces

# ----------------------------------------------------------------
# The Markov chain on cells that approximates a map: the share of each cell mapped to each cell (Ulam's matrix).
#
# In one dimension cells are cut where the map changes its branch, turns or jumps; what is left is monotone, and a piece
# is spread evenly between the images of its two ends.  Sample points would leave an error of about one sample in each
# share, and so an error of the density that finer cells do not reduce.  In more dimensions, on axes that close, and for
# maps without forced branches, which give the one-sided limits, points spread evenly in the cell are counted.


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
    >>> from limitsets.systems.sets.measure import sample_points
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
    image = images(graph.map, sample_points(grid, cells, side, samples), side)
    target = np.full(image.code.size, -1)
    lands = image.code >= 0
    target[lands] = grid.index(image.x[lands], image.side[lands])
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
    matrices = []
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
        matrices.append(UlamMatrix(cells[some][owner][kept], number[kept], weight[kept]))
    return matrices


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
    exact = grid.dimension == 1 and has_slope(graph.map) and not grid.domain.closes
    pieces = monotone_pieces(graph.map, grid.domain) if exact else {}
    parts: list[UlamMatrix] = []
    for side in range(grid.sides):
        here = cells[(cells >= grid.offset[side]) & (cells < grid.offset[side + 1])]
        if here.size:
            parts += (
                _from_pieces(graph, here, side, pieces[side]) if exact else [_from_points(graph, here, side)]
            )
    return UlamMatrix(*(np.concatenate(column) for column in zip(*parts, strict=True)))


# ----------------------------------------------------------------
# Invariant measures by Ulam's method: the stationary distribution of a chain on cells.


MOST_POWERS = 100_000


@dataclass(frozen=True, eq=False)
class Measure:
    """How much of its time an orbit spends in each cell, by Ulam's method; an approximation, not proved.

    Attributes
    ----------
    cells : CellSet
        The closed class it lives on.
    weight : ndarray, shape (n_cells,)
        Share of the time in each cell of the grid; they add up to 1.
    residual : float
        What one more step of the chain changes, added up over all cells.
    steps : int
        Steps of the chain that were made.
    lost : float
        Share of each step that left the attracting cells; it was left out.
    """

    cells: CellSet
    weight: NDArray[np.float64]
    residual: float
    steps: int
    lost: float

    @property
    def density(self) -> NDArray[np.float64]:
        """Share of the time per length, area or volume of each cell, shape (n_cells,)."""
        return self.weight / self.cells.grid.measure


def _chain(graph: TransitionGraph, cells: NDArray[np.int64]) -> tuple[Any, NDArray[np.float64]]:
    """Shares that go from cell to cell, each row adding up to 1 or 0, and what each cell has lost before that."""
    from scipy.sparse import coo_array

    shares = ulam_matrix(graph, cells)
    number = np.full(graph.n_cells, -1)
    number[cells] = np.arange(cells.size)
    source, target = number[shares.source], number[shares.target]
    kept = target >= 0
    total = np.bincount(source[kept], weights=shares.weight[kept], minlength=cells.size)
    weight = shares.weight[kept] / total[source[kept]]
    shape = (cells.size, cells.size)
    chain = coo_array((weight, (source[kept], target[kept])), shape=shape).tocsr()
    return chain, np.subtract(1.0, total)


def _closed_classes(chain: Any) -> list[NDArray[np.int64]]:
    """Strong components that no step leaves."""
    from scipy.sparse.csgraph import connected_components

    count, label = connected_components(chain, directed=True, connection="strong")
    coo = chain.tocoo()
    source, target = coo.coords
    steps = np.bincount(label, weights=np.diff(chain.indptr), minlength=count)
    leaving = np.bincount(label[source][label[source] != label[target]], minlength=count)
    return [np.flatnonzero(label == k) for k in np.flatnonzero((leaving == 0) & (steps > 0))]


def _stationary(chain: Any, tolerance: float, most_steps: int) -> tuple[NDArray[np.float64], float, int]:
    """Stationary distribution of one closed class, by steps that stay with probability 1/2: no period survives that."""
    back = chain.T.tocsr()
    weight = np.full(chain.shape[0], 1.0 / chain.shape[0])
    residual, steps = np.inf, 0
    while residual > tolerance and steps < most_steps:
        after = back @ weight
        residual = float(np.abs(after - weight).sum())
        weight = 0.5 * (weight + after)
        weight /= weight.sum()
        steps += 1
    return weight, residual, steps


def invariant_measures(
    graph: TransitionGraph, *, tolerance: float = 1e-12, most_steps: int = MOST_POWERS
) -> tuple[Measure, ...]:
    """Find how an orbit divides its time between the cells of each attractor (Ulam's method).

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`; its attracting cells are looked at.
    tolerance : float
        Stop when one more step changes no more than this, added up over all cells.
    most_steps : int
        Steps after which to stop anyway; `Measure.residual` tells.

    Returns
    -------
    tuple of Measure
        One per closed class of the chain, in ascending order of their first cells; none where nothing stays.

    Notes
    -----
    On a density that is bounded and has finitely many jumps the error falls about as the width of the cells; where
    it grows as 1/sqrt(distance), as at the ends of the logistic map's, as the root of it.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.sets import invariant_measures
    >>> graph = ls.transitions(ls.maps.Doubling(), ls.grid([(0.0, 1.0)], cells=8))
    >>> invariant_measures(graph)[0].density.round(12)  # uniform
    array([1., 1., 1., 1., 1., 1., 1., 1.])
    """
    cells = np.sort(np.concatenate([*graph.attracting_sets(), np.empty(0, np.int64)]).astype(np.int64))
    if not cells.size:
        return ()
    chain, lost = _chain(graph, cells)
    measures = []
    for members in sorted(_closed_classes(chain), key=lambda part: int(part[0])):
        part, residual, steps = _stationary(chain[members][:, members], tolerance, most_steps)
        weight = np.zeros(graph.n_cells)
        weight[cells[members]] = part
        share = float((part * lost[members]).sum())
        measures.append(Measure(CellSet.of(graph.grid, cells[members]), weight, residual, steps, share))
    return tuple(measures)
