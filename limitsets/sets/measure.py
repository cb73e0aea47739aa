"""Invariant measures by Ulam's method: the stationary distribution of a chain on cells.

Which share of a cell goes to which cell (`limitsets.sets.markov_chain`) is a Markov chain on finitely many states.  Its
stationary distributions are the mixtures of one for each closed class, and each of those is found by repeated steps.
A cell of no closed class carries nothing.
Source: Ulam, "A Collection of Mathematical Problems", 1960, ch. VI; Li, J. Approximation Theory 17, 1976, shows that
the densities converge for piecewise expanding maps of an interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.graph import TransitionGraph
from limitsets.sets.markov_chain import ulam_matrix

MOST_STEPS = 100_000


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
    graph: TransitionGraph, *, tolerance: float = 1e-12, most_steps: int = MOST_STEPS
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
    sets = graph.recurrent_components()
    attracting = [part for part, ends in zip(sets, graph.condensation().attracting, strict=True) if ends]
    cells = np.sort(np.concatenate([*attracting, np.empty(0, np.int64)]).astype(np.int64))
    if not cells.size:
        return ()
    chain, lost = _chain(graph, cells)
    found = []
    for members in sorted(_closed_classes(chain), key=lambda part: int(part[0])):
        part, residual, steps = _stationary(chain[members][:, members], tolerance, most_steps)
        weight = np.zeros(graph.n_cells)
        weight[cells[members]] = part
        share = float((part * lost[members]).sum())
        found.append(Measure(CellSet.of(graph.grid, cells[members]), weight, residual, steps, share))
    return tuple(found)
