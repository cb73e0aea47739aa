"""The transfer operator of a noisy map between the cells of a grid: Ulam's method, generalised cell mapping.

P[i, j] is the probability that a state anywhere in cell i, equally likely, is in cell j one step later.  The noise of
the step itself (speed, tilt: a parameter of the map) and the noise of the landing place, added afterwards, are two
stages.  Between them the cells extend beyond the domain, as far as the second stage can bring a part back.  Exits are
columns of their own: no mass that leaves is counted in a neighbouring cell.
Source: Ulam, "A Collection of Mathematical Problems", 1960, ch. VI; Hsu, "Cell-to-Cell Mapping", 1987, ch. 10;
Dellnitz and Junge, SIAM J. Numer. Anal. 36, 1999.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.maps import kind_of
from limitsets.robust.noise.boxcars import Array, BoxcarOperator
from limitsets.robust.noise.cell_images import uses_pieces
from limitsets.robust.noise.interpolated_pieces import InterpolatedPieces
from limitsets.robust.noise.laws import Law, Strata, certain
from limitsets.robust.noise.stages import beyond, from_pieces, from_points, landing_stage

STRATA = 24
# Landing places are cut more finely, into boxcars about as narrow as cells, as long as there are no more than this.
LANDING_STRATA, LANDING_BOXCARS = 128, 4_000_000
# Entries up to which the operator is written out: a sparse product is then faster than sums along the cells.
WRITTEN_OUT = 30_000_000


@dataclass(frozen=True, eq=False)
class Transfer:
    """The operator.

    Attributes
    ----------
    map : NamedTuple
        The map at the parameter's first stratum, for names of branches and ways out.
    grid : Grid
        The cells.
    throw : BoxcarOperator or sparse array
        First stage, from the cells to the cells that go on beyond the domain.
    landing : BoxcarOperator or None
        Second stage, back to the cells.
    sinks : ndarray, shape (n_cells, n_exits)
        Probability of leaving by each way out, in the order of `exits`.
    branches : ndarray, shape (n_cells, n_branches)
        Probability of each branch (for the throw: jog, flip).
    reach : (float, float)
        Least and largest deviation of the landing place.
    cut : float
        Probability of noise beyond the bounds at which unbounded laws were cut off.
    """

    map: Any
    grid: Grid
    throw: Any
    landing: BoxcarOperator | None
    sinks: Array
    branches: Array
    reach: tuple[float, float]
    cut: float

    @property
    def exits(self) -> tuple[str, ...]:
        """Names of the ways out."""
        return tuple(kind_of(self.map).exits)

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self.grid.n_cells

    def __repr__(self) -> str:
        return f"Transfer({type(self.map).__name__}, {self.n_cells} cells, {self.entries} entries)"

    @cached_property
    def entries(self) -> int:
        """Entries of the two stages, if they were written out."""
        first = self.throw.entries if isinstance(self.throw, BoxcarOperator) else int(self.throw.nnz)
        if self.landing is None:
            return first
        wide = self.landing.entries / max(self.landing.rows, 1)
        return int(first + self.landing.entries + 1.5 * wide * self.n_cells)

    @cached_property
    def matrix(self) -> Any:
        """P as a sparse matrix, written out."""
        first = self.throw.matrix() if isinstance(self.throw, BoxcarOperator) else self.throw
        return first if self.landing is None else (first @ self.landing.matrix()).tocsr()

    @cached_property
    def _transposed(self) -> Any:
        return self.matrix.T.tocsr()

    @property
    def written_out(self) -> bool:
        """Whether products use the matrix written out."""
        return not isinstance(self.throw, BoxcarOperator) or self.entries <= WRITTEN_OUT

    def apply(self, values: Array) -> Array:
        """Return a function's expected value one step later, from each cell: P v; ways out count nothing."""
        if self.written_out:
            return self.matrix @ values  # type: ignore[no-any-return]  # scipy is untyped
        after = values if self.landing is None else self.landing.apply(values)
        return self.throw.apply(after)  # type: ignore[no-any-return]  # Any: it may be a sparse array

    def adjoint(self, masses: Array) -> Array:
        """Where masses in the cells are one step later: P^T u; what leaves is missing."""
        if self.written_out:
            return self._transposed @ masses  # type: ignore[no-any-return]  # scipy is untyped
        moved = self.throw.adjoint(masses)
        # Sums along the cells leave rounding errors of either sign where nothing lands.
        return np.maximum(moved if self.landing is None else self.landing.adjoint(moved), 0.0)


class SubOperator:
    """The operator on some of the cells; what leaves them is missing.

    Parameters
    ----------
    chain : Transfer
        The operator.
    cells : ndarray of int
        The cells, in the order in which values and masses are given.
    """

    def __init__(self, chain: Transfer, cells: NDArray[np.int64]) -> None:
        self.chain, self.cells = chain, cells

    @cached_property
    def matrix(self) -> Any:
        """The entries among the cells; None where the operator is not written out."""
        return self.chain.matrix[self.cells][:, self.cells] if self.chain.written_out else None

    @cached_property
    def _transposed(self) -> Any:
        return self.matrix.T.tocsr()

    def _whole(self, some: Array) -> Array:
        whole = np.zeros(self.chain.n_cells)
        whole[self.cells] = some
        return whole

    def apply(self, values: Array) -> Array:
        """Return a function's expected value one step later; it is 0 on all other cells."""
        if self.matrix is not None:
            return self.matrix @ values  # type: ignore[no-any-return]  # scipy is untyped
        return self.chain.apply(self._whole(values))[self.cells]

    def adjoint(self, masses: Array) -> Array:
        """Where masses on the cells are one step later."""
        if self.matrix is not None:
            return self._transposed @ masses  # type: ignore[no-any-return]  # scipy is untyped
        return self.chain.adjoint(self._whole(masses))[self.cells]


def transfer(
    map_of: Any,
    grid: Grid,
    *,
    parameter: Law | Strata | None = None,
    landing: Law | None = None,
    strata: int = STRATA,
    cutter: InterpolatedPieces | None = None,
) -> Transfer:
    """Build the transfer operator of a map with noise.

    Parameters
    ----------
    map_of : NamedTuple or callable
        A map; or, where a parameter scatters, the map as a function of it.
    grid : Grid
        The cells.
    parameter : Law or Strata, optional
        Values of the parameter, drawn anew at every step.
    landing : Law, optional
        Noise added to x after every step, in one dimension.
    strata : int
        Into how many pieces the law of the parameter is cut, and at least that of the landing place.
    cutter : InterpolatedPieces, optional
        Where the sides are cut, if that is known already.

    Returns
    -------
    Transfer

    Raises
    ------
    AnswerError
        For noise of the landing place in more than one dimension, or a grid that is not the map's.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust import Uniform, transfer
    >>> found = transfer(ls.maps.Doubling(), ls.grid([(0.0, 1.0)], cells=4), landing=Uniform(0.125))
    >>> found.matrix.toarray()[0], found.sinks[0]
    (array([0.4375, 0.4375, 0.0625, 0.    ]), array([0.0625, 0.    ]))
    """
    fixed = isinstance(map_of, tuple)
    at: Callable[[float], Any] = (lambda _: map_of) if fixed else map_of
    law = certain(1.0) if parameter is None else parameter
    pieces = law if isinstance(law, Strata) else law.strata(strata)
    params = at(float(pieces.mean[0]))
    kind = kind_of(params)
    if kind.dimension != grid.dimension:
        allowed = f"{kind.dimension}, the map's"
        raise AnswerError("the dimension of the grid", grid.dimension, allowed, "cut another domain")
    if landing is not None and kind.dimension != 1:
        raise AnswerError("the noise of x", landing, "none in more than one dimension", "leave it out")
    finer = max(strata, min(LANDING_STRATA, LANDING_BOXCARS // grid.n_cells))
    added = None if landing is None else landing.strata(finer)
    reach = (0.0, 0.0) if added is None else (added.lo, added.hi)
    edges = beyond(grid, reach) if kind.dimension == 1 else ()
    if uses_pieces(params):
        throw, sinks, branches = from_pieces(at, grid, pieces, edges, cutter)
    else:
        throw, sinks, branches = from_points(at, grid, pieces, edges)
    cut = pieces.cut
    second = None
    if added is not None:
        second, late = landing_stage(grid, edges, added, kind.exits)
        columns = [
            throw.apply(column) if isinstance(throw, BoxcarOperator) else throw @ column for column in late.T
        ]
        sinks = sinks + np.stack(columns, axis=1)
        cut += added.cut
    return Transfer(params, grid, throw, second, sinks, branches, reach, cut)
