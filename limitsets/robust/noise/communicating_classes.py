"""Closed communicating classes of a noisy chain, and classes with a small rate of escape.

A chain on cells is usually reducible: transient cells, several attractors, exits.  General eigenvector solvers mix its
classes or fail.  The strong components of its graph therefore come first, and each eigenproblem is that of one
component.
Source of quasi-stationary distributions: Darroch and Seneta, J. Appl. Prob. 2, 1965.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import CellSet
from limitsets.files import as_table, picked
from limitsets.graph.components import Components, strong_components
from limitsets.graph.ranges import RUN, START, Ranges, one_run
from limitsets.maps import kind_of
from limitsets.robust.noise.boxcars import Array, BoxcarOperator, cells_met
from limitsets.robust.noise.ulam import SubOperator, Transfer

Cells = NDArray[np.int64]

# Escapes per step from which a class is not worth a name.
SLOW = 0.02
# Components whose rate of escape is computed, the largest first.
MOST_LEFT = 12
MOST_STEPS = 20_000
TOLERANCE = 1e-13


@dataclass(frozen=True, eq=False)
class NoisyClass:
    """A class of the chain, and how its time is divided; an approximation between cells, not proved.

    Attributes
    ----------
    cells : CellSet
        Its cells.
    closed : bool
        Whether no step leaves it; an escape so rare that it underflows leaves False here.
    weight : ndarray, shape (n_cells,)
        Stationary distribution; of a class that is left the quasi-stationary one, that of what has not left yet.
    escape : float
        Probability of leaving it per step, in that distribution; 0 for a closed class.
    leads_to : dict of str to float
        Escapes per step by each way out, and to "other cells".
    sides, branches : dict
        Share of the time on each side (by its number) and of the steps along each branch (by its name).
    residual : float
        What one more step changes, added up over all cells.
    steps : int
        Products with the operator.
    """

    cells: CellSet
    closed: bool
    weight: Array
    escape: float
    leads_to: dict[str, float]
    sides: dict[int, float]
    branches: dict[str, float]
    residual: float
    steps: int

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON, without the distribution."""
        names = ("escape", "leads_to", "sides", "branches", "residual")
        return as_table(closed=self.closed, extents=self.cells.extents(), **picked(self, *names))

    @property
    def density(self) -> Array:
        """Share of the time per length, area or volume of each cell, shape (n_cells,)."""
        return self.weight / self.cells.grid.measure


def graph_of(chain: Transfer) -> Ranges:
    """Which cells a step can lead to, as runs of cells: the entries of the operator that are not 0."""
    if chain.written_out:
        matrix = chain.matrix
        matrix.sort_indices()
        source = np.repeat(np.arange(chain.n_cells), np.diff(matrix.indptr))
        new = np.ones(source.size, dtype=bool)
        # A run goes on while the row is the same, the next column follows and it is of the same side.
        side = chain.grid.side_of(matrix.indices)
        new[1:] = (np.diff(source) != 0) | (np.diff(matrix.indices) != 1) | (np.diff(side) != 0)
        begin = np.flatnonzero(new)
        run = np.diff(np.append(begin, source.size))
        return _ranges(chain, source[begin], matrix.indices[begin].astype(np.int64), run)
    rows, starts, runs = [], [], []
    for block in chain.throw.blocks:
        some = block.mass > 0.0
        first, last = _cells_hit(chain, block, chain.throw)
        some &= last >= first
        rows.append((block.first + np.arange(some.size))[some])
        starts.append(first[some] + int(chain.grid.offset[block.target]))
        runs.append((last - first + 1)[some])
    order = np.argsort(np.concatenate(rows), kind="stable")
    return _ranges(chain, *(np.concatenate(column)[order] for column in (rows, starts, runs)))


def _cells_hit(chain: Transfer, block: Any, stage: BoxcarOperator) -> tuple[Cells, Cells]:
    """First and last cell of a side that boxcars and the noise of the landing place after them can reach."""
    first, last = cells_met(block.lo, block.hi)
    if chain.landing is None:
        return first, last
    between, edges = stage.edges[block.target], chain.grid.edges[block.target][0]
    low, high = between[first] + chain.reach[0], between[last + 1] + chain.reach[1]
    inside = (high >= edges[0]) & (low <= edges[-1])
    first = np.clip(np.searchsorted(edges, low, side="right") - 1, 0, edges.size - 2)
    last = np.clip(np.searchsorted(edges, high, side="left") - 1, first, edges.size - 2)
    return first, np.where(inside, last, first - 1)


def _ranges(chain: Transfer, source: Cells, start: Cells, run: Cells) -> Ranges:
    counts = np.bincount(source, minlength=chain.n_cells)
    bits = (chain.sinks > 0.0) @ (1 << np.arange(chain.sinks.shape[1]))
    return Ranges(
        np.cumulative_sum(counts, include_initial=True),
        one_run(chain.grid.side_of(start), start, run),
        False,
        np.ones(chain.grid.sides, dtype=np.int64),
        np.ones(chain.grid.sides, dtype=np.int64),
        bits.astype(np.uint8),
    )


def _members(parts: Components) -> list[Cells]:
    """Cells of each recurrent component."""
    cells = np.split(parts.order.astype(np.int64), np.cumsum(parts.size)[:-1])
    return [np.sort(each) for each, again in zip(cells, parts.recurrent, strict=True) if again]


def _without(r: Ranges, cells: NDArray[np.bool_]) -> Ranges:
    """Return the graph in which the marked cells lead nowhere."""
    counts = np.where(cells, 0, np.diff(r.first))
    kept = np.repeat(~cells, np.diff(r.first))
    first = np.cumulative_sum(counts, include_initial=True)
    return r._replace(first=first, box=r.box[kept], single=False)


def recurrent_classes(
    chain: Transfer, graph: Ranges, absorbing: NDArray[np.bool_] | None = None
) -> tuple[list[Cells], list[Cells]]:
    """Recurrent components: those that no step leaves, and the others; marked cells are taken out as absorbing."""
    gone = np.zeros(chain.n_cells, dtype=bool) if absorbing is None else absorbing
    sets = _members(strong_components(graph if absorbing is None else _without(graph, gone)))
    source = np.repeat(np.arange(chain.n_cells), np.diff(graph.first))
    label = np.full(chain.n_cells, -1)
    for number, cells in enumerate(sets):
        label[cells] = number
    # How many cells from the first on carry each label: a run stays inside if all its cells do.
    change = np.cumulative_sum(np.diff(label) != 0, include_initial=True)
    leaves = graph.exits != 0
    begin = graph.box[:, START].astype(np.int64)
    last = begin + graph.box[:, RUN] - 1
    stays = (label[begin] == label[source]) & (change[begin] == change[last])
    leaves[source[~stays]] = True
    sets.sort(key=lambda cells: int(cells[0]))
    open_ = [cells for cells in sets if leaves[cells].any()]
    return [cells for cells in sets if not leaves[cells].any()], open_


class _Counted(SubOperator):
    """The operator on one component, whose products are counted."""

    products = 0

    def adjoint(self, masses: Array) -> Array:
        self.products += 1
        return super().adjoint(masses)


def _arnoldi(part: _Counted) -> Array | None:
    """Leading left eigenvector by Arnoldi's method; None where it does not come out."""
    from scipy.sparse.linalg import ArpackError, LinearOperator, eigs

    n = part.cells.size
    if n < 24:
        return None
    operator = LinearOperator((n, n), matvec=part.adjoint, dtype=np.float64)
    try:
        _, vectors = eigs(operator, k=1, which="LR", v0=np.ones(n), tol=1e-12, maxiter=200)
    except ArpackError:
        return None
    vector = vectors[:, 0].real
    vector = np.maximum(vector * np.sign(vector.sum()), 0.0)
    total = float(vector.sum())
    return vector / total if total > 0.0 else None


def distribution(chain: Transfer, cells: Cells) -> tuple[Array, float, int]:
    """Stationary or quasi-stationary distribution of one component: weights of its cells, residual, products.

    Arnoldi's method finds it; steps that stay with probability 1/2, which no period survives, finish it.
    """
    part = _Counted(chain, cells)
    even = chain.grid.measure[cells] / chain.grid.measure[cells].sum()
    found = _arnoldi(part)
    weight = even if found is None else found
    residual, steps = np.inf, 0
    while residual > TOLERANCE and steps < MOST_STEPS:
        after = part.adjoint(weight)
        total = float(after.sum())
        if total <= 0.0:
            return even, 1.0, part.products
        last, residual = residual, float(np.abs(after / total - weight).sum())
        weight = 0.5 * (weight + after / total)
        steps += 1
        if residual < 100.0 * TOLERANCE and residual > 0.9 * last:
            break  # rounding
    return weight, residual, part.products


def _described(chain: Transfer, cells: Cells, closed: bool) -> NoisyClass:
    part, residual, steps = distribution(chain, cells)
    weight = np.zeros(chain.n_cells)
    weight[cells] = part
    lost = part @ chain.sinks[cells]
    leads_to = {name: float(rate) for name, rate in zip(chain.exits, lost, strict=True)}
    outside = np.ones(chain.n_cells)
    outside[cells] = 0.0
    leads_to["other cells"] = float(part @ np.maximum(chain.apply(outside), 0.0)[cells])
    sides = {side: float(weight[chain.grid.of_side(side)].sum()) for side in range(chain.grid.sides)}
    names = kind_of(chain.map).branches
    shares = part @ chain.branches[cells]
    shares = shares / max(float(shares.sum()), 1e-300)
    return NoisyClass(
        CellSet.of(chain.grid, cells),
        closed,
        weight,
        0.0 if closed else sum(leads_to.values()),
        leads_to,
        sides,
        {name: float(share) for name, share in zip(names, shares, strict=True)},
        residual,
        steps,
    )


def _may_be_slow(chain: Transfer, cells: Cells) -> bool:
    """Whether some cell keeps nearly all its mass in the class: the rate of escape is no less than the least loss."""
    inside = np.zeros(chain.n_cells)
    inside[cells] = 1.0
    return bool(chain.apply(inside)[cells].max() > 1.0 - SLOW)


def classes(chain: Transfer) -> tuple[NoisyClass, ...]:
    """Find the closed classes of the chain, then the classes that it leaves at less than 2 % per step.

    Parameters
    ----------
    chain : Transfer
        The operator.

    Returns
    -------
    tuple of NoisyClass
        Closed ones in the order of their cells, then the others, the slowest escape first.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust import Uniform, classes, transfer
    >>> chain = transfer(ls.maps.Logistic(3.2), ls.grid([(0.0, 1.0)], cells=512), landing=Uniform(0.001))
    >>> [(round(part.escape, 6), part.cells.extents()) for part in classes(chain) if part.closed]
    [(0.0, {0: [(0.5..., 0.5...), (0.7..., 0.8...)]})]
    """
    closed, open_ = recurrent_classes(chain, graph_of(chain))
    found = [_described(chain, cells, closed=True) for cells in closed]
    large = sorted((cells for cells in open_ if _may_be_slow(chain, cells)), key=len, reverse=True)
    left = [_described(chain, cells, closed=False) for cells in large[:MOST_LEFT]]
    return (*found, *sorted((part for part in left if part.escape < SLOW), key=lambda part: part.escape))
