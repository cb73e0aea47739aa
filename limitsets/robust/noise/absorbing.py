"""Absorption of a noisy chain: probabilities and mean numbers of throws.

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

from limitsets.graph.components import strong_components
from limitsets.robust.noise.boxcars import Array
from limitsets.robust.noise.communicating_classes import graph_of, recurrent_classes
from limitsets.robust.noise.ulam import SubOperator, Transfer

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
    goal: NDArray[np.bool_]
    classes: tuple[NDArray[np.int64], ...]
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

    def __init__(self, chain: Transfer, open_: NDArray[np.bool_], label: NDArray[np.int32]) -> None:
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

        cells, answer = self.part.cells, np.zeros(self.part.chain.n_cells)
        b = right[cells]
        size = float(np.abs(b).max(initial=0.0))
        if size == 0.0:
            return answer
        n = cells.size
        operator = LinearOperator((n, n), matvec=self._product, dtype=np.float64)
        found = np.zeros(n)
        for _ in range(4):  # once more on what is left over: refines small answers
            rest = b - self._product(found)
            if np.abs(rest).max() <= RESIDUAL * size:
                break
            step, _ = gmres(operator, rest, rtol=1e-12, restart=min(150, n), maxiter=20, M=self.inverse)
            found = found + step
        self.worst = max(self.worst, float(np.abs(b - self._product(found)).max()) / size)
        answer[cells] = found
        return answer


def absorption(
    chain: Transfer,
    goal: NDArray[np.bool_],
    *,
    other: NDArray[np.bool_] | None = None,
    classes: Sequence[NDArray[np.int64]] | None = None,
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
    ends: dict[str, Any] = {"goal": np.flatnonzero(goal)}
    if other is not None:
        ends["other"] = np.flatnonzero(other & ~goal)
    ends.update({f"class {number}": cells for number, cells in enumerate(closed)})
    probability = {}
    for name, cells in ends.items():
        mark = np.zeros(chain.n_cells)
        mark[cells] = 1.0
        probability[name] = np.clip(mark + equations.solve(np.maximum(chain.apply(mark), 0.0)), 0.0, 1.0)
    for number, name in enumerate(chain.exits):
        probability[name] = np.clip(equations.solve(chain.sinks[:, number]), 0.0, 1.0)
    share = probability["goal"]
    steps = equations.solve(np.where(goal, 0.0, share))
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(goal, 0.0, np.where(share > 0.0, steps / share, np.nan))
    return Absorption(probability, mean, goal, tuple(closed), equations.worst)
