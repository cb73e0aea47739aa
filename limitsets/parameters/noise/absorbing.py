"""Closed classes of a noisy chain, probabilities of absorption, mean numbers of throws and their distribution.

The absorbing sets are a goal (some cells), the closed classes of the rest, and the exits.  With Q the operator on all
other cells and b the probability of going to one of these in one step, its probability h solves (I - Q) h = b.  Of
those throws that lead to the goal the number T has E[T; goal] = t with (I - Q) t = h on all cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import GridError, as_table, picked
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.parameters.noise.cell_images import BoxcarBlock, cells_met
from limitsets.parameters.noise.ulam import SubOperator, Transfer
from limitsets.systems.cells import CellSet, Domain, Grid, grid
from limitsets.systems.graph.components import strong_components
from limitsets.systems.graph.ranges import RUN, START, Ranges, one_run
from limitsets.systems.maps import kind_of

# ----------------------------------------------------------------
# Closed communicating classes of a noisy chain, and classes with a small rate of escape.
#
# A chain on cells is usually reducible: transient cells, several attractors, exits.  General eigenvector solvers mix
# its classes or fail.  The strong components of its graph therefore come first, and each eigenproblem is that of one
# component. Source of quasi-stationary distributions: Darroch and Seneta, J. Appl. Prob. 2, 1965.


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
        run = np.diff(begin, append=source.size)
        return _ranges(chain, source[begin], matrix.indices[begin].astype(np.int64), run)
    columns: list[Ints] = []
    for block in chain.throw.blocks:
        first, last = _cells_hit(chain, block)
        source, start = block.first + np.arange(first.size), first + int(chain.grid.offset[block.target])
        columns.append(np.stack([source, start, last - first + 1])[:, (block.mass > 0.0) & (last >= first)])
    table = np.concatenate(columns, axis=1)
    return _ranges(chain, *table[:, np.argsort(table[0], kind="stable")])


def _cells_hit(chain: Transfer, block: BoxcarBlock) -> tuple[Ints, Ints]:
    """First and last cell of a side that boxcars and the noise of the landing place after them can reach."""
    first, last = cells_met(block.lo, block.hi)
    if chain.landing is None:
        return first, last
    between, edges = chain.throw.edges[block.target], chain.grid.edges[block.target][0]
    low, high = between[first] + chain.reach[0], between[last + 1] + chain.reach[1]
    inside = (high >= edges[0]) & (low <= edges[-1])
    first = np.clip(np.searchsorted(edges, low, side="right") - 1, 0, edges.size - 2)
    last = np.clip(np.searchsorted(edges, high, side="left") - 1, first, edges.size - 2)
    return first, np.where(inside, last, first - 1)


def _ranges(chain: Transfer, source: Ints, start: Ints, run: Ints) -> Ranges:
    return Ranges(
        np.cumulative_sum(np.bincount(source, minlength=chain.n_cells), include_initial=True),
        one_run(chain.grid.side_of(start), start, run),
        False,
        np.ones(chain.grid.sides, dtype=np.int64),
        np.ones(chain.grid.sides, dtype=np.int64),
        ((chain.sinks > 0.0) @ (1 << np.arange(chain.sinks.shape[1]))).astype(np.uint8),
    )


def _without(r: Ranges, cells: Mask) -> Ranges:
    """Return the graph in which the marked cells lead nowhere."""
    counts = np.diff(r.first)
    first = np.cumulative_sum(np.where(cells, 0, counts), include_initial=True)
    return r._replace(first=first, box=r.box[np.repeat(~cells, counts)], single=False)


def recurrent_classes(
    chain: Transfer, graph: Ranges, absorbing: Mask | None = None
) -> tuple[list[Ints], list[Ints]]:
    """Recurrent components: those that no step leaves, and the others; marked cells are taken out as absorbing."""
    parts = strong_components(graph if absorbing is None else _without(graph, absorbing))
    cells_of = np.split(parts.order.astype(np.int64), np.cumsum(parts.size)[:-1])
    sets = [np.sort(cells) for cells, again in zip(cells_of, parts.recurrent, strict=True) if again]
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


def _arnoldi(part: SubOperator) -> Array | None:
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
    vector = np.maximum(vectors[:, 0].real * np.sign(vectors[:, 0].real.sum()), 0.0)
    return vector / vector.sum() if vector.sum() > 0.0 else None


def distribution(chain: Transfer, cells: Ints) -> tuple[Array, float, int]:
    """Stationary or quasi-stationary distribution of one component: weights of its cells, residual, products.

    Arnoldi's method finds it; steps that stay with probability 1/2, which no period survives, finish it.
    """
    part = SubOperator(chain, cells)
    even = chain.grid.measure[cells] / chain.grid.measure[cells].sum()
    eigenvector = _arnoldi(part)
    weight = even if eigenvector is None else eigenvector
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


def _described(chain: Transfer, cells: Ints, closed: bool) -> NoisyClass:
    part, residual, steps = distribution(chain, cells)
    weight = chain.marked(cells, part)
    lost = part @ chain.sinks[cells]
    leads_to = {name: float(rate) for name, rate in zip(chain.exits, lost, strict=True)}
    leads_to["other cells"] = float(part @ np.maximum(chain.apply(1.0 - chain.marked(cells)), 0.0)[cells])
    sides = {side: float(weight[chain.grid.of_side(side)].sum()) for side in range(chain.grid.sides)}
    names = kind_of(chain.map).branches
    shares = part @ chain.branches[cells]
    shares = shares / max(float(shares.sum()), 1e-300)
    return NoisyClass(
        cells=CellSet.of(chain.grid, cells),
        closed=closed,
        weight=weight,
        escape=0.0 if closed else sum(leads_to.values()),
        leads_to=leads_to,
        sides=sides,
        branches={name: float(share) for name, share in zip(names, shares, strict=True)},
        residual=residual,
        steps=steps,
    )


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
    closed_classes = [_described(chain, cells, closed=True) for cells in closed]
    # some cell keeps nearly all its mass in a slow class: the rate of escape is no less than the least loss
    slow = (cells for cells in open_ if chain.apply(chain.marked(cells))[cells].max() > 1.0 - SLOW)
    large = sorted(slow, key=len, reverse=True)
    left = [_described(chain, cells, closed=False) for cells in large[:MOST_LEFT]]
    return (
        *closed_classes,
        *sorted((part for part in left if part.escape < SLOW), key=lambda part: part.escape),
    )


# ----------------------------------------------------------------
# Absorption of a noisy chain: probabilities and mean numbers of throws.


RESIDUAL = 1e-12


@dataclass(frozen=True, eq=False)
class Absorption:
    """Where it ends, from each cell; an approximation between cells, not proved.

    Attributes
    ----------
    probability : dict of str to ndarray, shape (n_cells,)
        By name: "goal", "other" where asked for, "class 0" and so on (closed classes in the order of their cells),
        and the ways out.
    mean : ndarray, shape (n_cells,)
        Mean number of steps to the goal, of those that come to it; 0 on the goal, nan where none does.
    goal : ndarray of bool, shape (n_cells,)
        Cells of the goal.
    classes : tuple of ndarray
        Cells of the closed classes outside the goal.
    residual : float
        What the equations are short of, at worst.
    """

    probability: dict[str, Array]
    mean: Array
    goal: Mask
    classes: tuple[Ints, ...]
    residual: float


def _triangle(matrix: Any) -> Any:
    """Solve with the lower triangle of I - Q: nearly an inverse where cells are in the order of their graph."""
    from scipy.sparse import eye_array, tril
    from scipy.sparse.linalg import LinearOperator, splu

    n = matrix.shape[0]
    lower = tril(eye_array(n) - matrix).tocsc()
    # A cell that keeps all its mass, of no closed class, is kept by rounding only.
    lower.setdiag(np.maximum(lower.diagonal(), 1e-6))
    factors = splu(lower, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    return LinearOperator((n, n), matvec=factors.solve, dtype=np.float64)


class _Equations:
    """(I - Q) y = b on the cells where nothing is decided yet."""

    def __init__(self, chain: Transfer, open_: Mask, label: NDArray[np.int32]) -> None:
        cells = np.flatnonzero(open_)
        if chain.written_out:
            # In the order of the graph's components an edge leads back, or stays in its component: a triangle holds
            # most of Q, and, larger cells first, the long ways by which orbits creep outward from the joint.
            cells = cells[np.lexsort((-cells, label[cells]))]
        self.part, self.worst = SubOperator(chain, cells), 0.0
        self.inverse = _triangle(self.part.matrix) if chain.written_out and cells.size else None

    def _product(self, values: Array) -> Array:
        return values - self.part.apply(values)

    def solve(self, right: Array) -> Array:
        """Solve for a right side that is given on all cells; 0 elsewhere."""
        from scipy.sparse.linalg import LinearOperator, gmres

        b = right[self.part.cells]
        size = float(np.abs(b).max(initial=0.0))
        if size == 0.0:
            return np.zeros_like(right)
        n, solution = b.size, np.zeros_like(b)
        operator = LinearOperator((n, n), matvec=self._product, dtype=np.float64)
        for _ in range(4):  # once more on what is left over: refines small answers
            rest = b - self._product(solution)
            if np.abs(rest).max() <= RESIDUAL * size:
                break
            step, _ = gmres(operator, rest, rtol=1e-12, restart=min(150, n), maxiter=20, M=self.inverse)
            solution = solution + step
        self.worst = max(self.worst, float(np.abs(b - self._product(solution)).max()) / size)
        return self.part.chain.marked(self.part.cells, solution)


def absorption(
    chain: Transfer,
    goal: Mask,
    *,
    other: Mask | None = None,
    classes: Sequence[Ints] | None = None,
) -> Absorption:
    """Find where the chain ends, and after how many steps it is at the goal.

    Parameters
    ----------
    chain : Transfer
        The operator.
    goal : ndarray of bool, shape (n_cells,)
        Cells that absorb.
    other : ndarray of bool, shape (n_cells,), optional
        Cells that absorb too and are counted apart from the goal, as "other".
    classes : sequence of ndarray of int, optional
        Cells of classes that absorb, instead of the closed classes: those too that are left so rarely that the time
        until then does not matter, and the equations could not be solved.

    Returns
    -------
    Absorption

    Examples
    --------
    From the first quarter doubling leads to the first or the second, from there to the third or beyond 3/4:

    >>> import limitsets as ls
    >>> from limitsets.robust import Uniform, absorption, transfer
    >>> chain = transfer(ls.maps.Doubling(), ls.grid([(0.0, 1.0)], cells=4))
    >>> found = absorption(chain, chain.grid.centres(0) > 0.75)
    >>> found.mean.round(12)
    array([6., 4., 6., 0.])
    """
    goal = np.asarray(goal, dtype=bool)
    graph = graph_of(chain)
    absorbing = goal if other is None else goal | other
    closed = recurrent_classes(chain, graph, absorbing)[0] if classes is None else list(classes)
    open_ = ~absorbing
    for cells in closed:
        open_[cells] = False
    equations = _Equations(chain, open_, strong_components(graph).label)
    ends: dict[str, Any] = {"goal": goal} | ({} if other is None else {"other": other & ~goal})
    ends |= {f"class {number}": cells for number, cells in enumerate(closed)}
    marks = {name: chain.marked(cells) for name, cells in ends.items()}
    hits = {name: mark + equations.solve(np.maximum(chain.apply(mark), 0.0)) for name, mark in marks.items()}
    hits |= {name: equations.solve(rates) for name, rates in zip(chain.exits, chain.sinks.T, strict=True)}
    probability = {name: np.clip(chances, 0.0, 1.0) for name, chances in hits.items()}
    share = probability["goal"]
    steps = equations.solve(np.where(goal, 0.0, share))
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(goal, 0.0, np.where(share > 0.0, steps / share, np.nan))
    return Absorption(probability, mean, goal, tuple(closed), equations.worst)


# ----------------------------------------------------------------
# Distribution of the number of throws from a random start to the goal, by propagating the masses of the starts.


# Share of the starts that is still under way when counting ends.
UNDER_WAY = 1e-9
MOST_THROWS = 200_000


@dataclass(frozen=True, eq=False)
class Feeding:
    """Throws from a random start to the goal; an approximation between cells, not proved.

    Attributes
    ----------
    arrived : ndarray, shape (most throws + 1,)
        Share of the starts that are at the goal for the first time after that many throws.
    share : float
        Share of the starts that ever come to the goal.
    mean : float or None
        Mean number of throws of those that do; None where none does.
    ends : dict of str to float
        Where the starts end: "goal", closed classes that miss it, ways out.
    """

    arrived: Array
    share: float
    mean: float | None
    ends: dict[str, float]

    @property
    def survivors(self) -> Array:
        """Share of all starts that have not been at the goal after so many throws."""
        return np.maximum(1.0 - np.cumsum(self.arrived), 0.0)

    def quantile(self, share: float) -> int | None:
        """Throws after which `share` of all starts have been at the goal; None where so many never come to it."""
        reached = np.flatnonzero(np.cumsum(self.arrived) >= share)
        return int(reached[0]) if reached.size else None

    def crossing(self, share: float) -> float:
        """As `quantile`, interpolated between throws; nan where so many never come to it."""
        total = np.cumsum(self.arrived)
        k = self.quantile(share)
        if k is None:
            return float("nan")
        before = float(total[k - 1]) if k else 0.0
        return k - 1 + (share - before) / (float(total[k]) - before) if k else 0.0


def cells_for_noise(domain: Domain, cells: int) -> Grid:
    """Cut a domain into cells of equal width, for noise takes the part everywhere, and smaller ones next to the joint.

    Jogs are slow there: on equal cells alone 3.0 % of the starts of study 09's robust feeder are lost to the joint,
    where 2.1 % are.

    Parameters
    ----------
    domain : Domain
        What to cover.
    cells : int
        Cells of equal width per side; half as many graded ones are laid over them, so far as they are narrower.

    Returns
    -------
    Grid
        The cells.
    """
    plain = grid(domain, cells=cells, grading="uniform")
    if domain.anchor is None:
        return plain
    both = zip(plain.edges, grid(domain, cells=max(cells // 2, 1), grading="graded").edges, strict=True)
    narrower = (
        (equal, towards[:-1][np.diff(towards) < equal[1] - equal[0]]) for (equal,), (towards,) in both
    )
    return Grid(domain, tuple((np.union1d(*pair),) for pair in narrower))


def with_border(grid: Grid, x: float) -> Grid:
    """Cut the cells of every side at x too, so that "beyond x" is a set of cells.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.parameters.noise.absorbing import with_border
    >>> with_border(ls.grid([(0.0, 1.0)], cells=2), 0.75).edges[0][0]
    array([0.  , 0.5 , 0.75, 1.  ])
    """
    if grid.dimension != 1:
        raise GridError("the dimension of the grid", grid.dimension, "1", "places have no order in more")
    sides = []
    for (edges,) in grid.edges:
        near = np.abs(edges - x).min() <= 1e-9 * (edges[-1] - edges[0])
        sides.append((edges if near or (not edges[0] < x < edges[-1]) else np.sort(np.append(edges, x)),))
    return Grid(grid.domain, tuple(sides))


def random_starts(grid: Grid, lo: Array, hi: float) -> Array:
    """Masses of starts that lie anywhere from `lo[side]` to `hi`, equally likely per length on all sides."""
    overlaps = (
        np.minimum(edges[1:], hi) - np.maximum(edges[:-1], start)
        for start, (edges,) in zip(lo, grid.edges, strict=True)
    )
    masses = np.maximum(np.concatenate([*overlaps]), 0.0)
    if not masses.sum() > 0.0:
        raise GridError("the range of the starts", (lo.tolist(), hi), "places on the arm", "move its ends")
    return masses / masses.sum()  # type: ignore[no-any-return]  # numpy types a quotient as Any


def feeding(chain: Transfer, ends: Absorption, starts: Array) -> Feeding:
    """Move the masses of the starts on until all but 1e-9 of those that come to the goal have arrived.

    Parameters
    ----------
    chain : Transfer
        The operator.
    ends : Absorption
        From `absorption` of the same operator and the goal.
    starts : ndarray, shape (n_cells,)
        Masses; they add up to 1.
    """
    chance = ends.probability["goal"]
    stopped = ends.goal | (chance <= 0.0)
    for cells in ends.classes:
        stopped[cells] = True
    masses = starts.copy()
    arrived = [float(masses[ends.goal].sum())]
    masses[stopped] = 0.0
    while float(masses @ chance) > UNDER_WAY and len(arrived) < MOST_THROWS:
        masses = chain.adjoint(masses)
        arrived.append(float(masses[ends.goal].sum()))
        masses[stopped] = 0.0
    share = min(float(starts @ chance), 1.0)
    known = np.where(np.isfinite(ends.mean), ends.mean, 0.0)
    return Feeding(
        np.array(arrived),
        share,
        (float(starts @ (known * chance)) / share if share > 0.0 else None),
        {name: float(starts @ chances) for name, chances in ends.probability.items()},
    )
