"""The transfer operator of a noisy map between the cells of a grid: Ulam's method, generalised cell mapping.

P[i, j] is the probability that a state anywhere in cell i, equally likely, is in cell j one step later.  The noise of
the step itself (speed, tilt: a parameter of the map) and the noise of the landing place, added afterwards, are two
stages.  Between them the cells go on beyond the domain by as far as the second can bring something back.  Ways out are
columns of their own: nothing that leaves is counted in a neighbouring cell.
Source: Ulam, "A Collection of Mathematical Problems", 1960, ch. VI; Hsu, "Cell-to-Cell Mapping", 1987, ch. 10;
Dellnitz and Junge, SIAM J. Numer. Anal. 36, 1999.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.maps import codes, kind_of
from limitsets.robust.casting import boxes_of_pieces, rows_of_points, uses_pieces
from limitsets.robust.cutting import Cutter
from limitsets.robust.laws import Law, Strata
from limitsets.robust.sheets import Array, Boxes, Sheet, Sheets, laid, shared

__all__ = ["STRATA", "Transfer", "transfer"]

STRATA = 24
# Landing places are cut more finely, into boxcars about as narrow as cells, as long as there are no more than this.
LANDING_STRATA, LANDING_BOXCARS = 128, 4_000_000
# Entries up to which the operator is written out: a sparse product is then faster than sums along the cells.
WRITTEN_OUT = 30_000_000
# Most cells that go on beyond an end of the domain.
MOST_BEYOND = 2048


@dataclass(frozen=True, eq=False)
class Transfer:
    """The operator.

    Attributes
    ----------
    map : NamedTuple
        The map at the parameter's first stratum, for names of branches and ways out.
    grid : Grid
        The cells.
    throw : Sheets or sparse array
        First stage, from the cells to the cells that go on beyond the domain.
    landing : Sheets or None
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
    landing: Sheets | None
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
        first = self.throw.entries if isinstance(self.throw, Sheets) else int(self.throw.nnz)
        if self.landing is None:
            return first
        wide = self.landing.entries / max(self.landing.rows, 1)
        return int(first + self.landing.entries + 1.5 * wide * self.n_cells)

    @cached_property
    def matrix(self) -> Any:
        """P as a sparse matrix, written out."""
        first = self.throw.matrix() if isinstance(self.throw, Sheets) else self.throw
        return first if self.landing is None else (first @ self.landing.matrix()).tocsr()

    @cached_property
    def _transposed(self) -> Any:
        return self.matrix.T.tocsr()

    @property
    def written_out(self) -> bool:
        """Whether products use the matrix written out."""
        return not isinstance(self.throw, Sheets) or self.entries <= WRITTEN_OUT

    def apply(self, values: Array) -> Array:
        """Return a function's expected value one step later, from each cell: P v; ways out count nothing."""
        if self.written_out:
            return self.matrix @ values  # type: ignore[no-any-return]  # scipy is untyped
        return self.throw.apply(values if self.landing is None else self.landing.apply(values))  # type: ignore[no-any-return]

    def adjoint(self, masses: Array) -> Array:
        """Where masses in the cells are one step later: P^T u; what leaves is missing."""
        if self.written_out:
            return self._transposed @ masses  # type: ignore[no-any-return]  # scipy is untyped
        moved = self.throw.adjoint(masses)
        # Sums along the cells leave rounding errors of either sign where nothing lands.
        return np.maximum(moved if self.landing is None else self.landing.adjoint(moved), 0.0)

    def linear_operator(self) -> Any:
        """P as `scipy.sparse.linalg.LinearOperator`."""
        from scipy.sparse.linalg import LinearOperator

        shape = (self.n_cells, self.n_cells)
        return LinearOperator(shape, matvec=self.apply, rmatvec=self.adjoint, dtype=np.float64)


def _beyond(grid: Grid, reach: tuple[float, float]) -> tuple[Array, ...]:
    """Borders of the cells between the stages, which go on beyond the domain."""
    found = []
    for (edges,) in grid.edges:
        width = float(np.median(np.diff(edges)))
        parts = []
        for size, end, sign in ((max(reach[1], 0.0), edges[0], -1.0), (max(-reach[0], 0.0), edges[-1], 1.0)):
            count = min(math.ceil(size / width), MOST_BEYOND)
            parts.append(end + sign * size * np.arange(1, count + 1) / max(count, 1))
        found.append(np.concatenate([parts[0][::-1], edges, parts[1]]))
    return tuple(found)


def _sink_numbers(exits: dict[str, int]) -> tuple[int, int, int]:
    """Columns of what lands below, above, and of what has no image."""
    number = {code: k for k, code in enumerate(exits.values())}
    outside = number.get(codes.OUTSIDE_MODEL, number.get(codes.OUTSIDE, 0))
    return number.get(codes.INWARD, number.get(codes.OUTSIDE, 0)), number.get(codes.OUTWARD, 0), outside


def _from_pieces(
    map_of: Callable[[float], Any],
    grid: Grid,
    strata: Strata,
    edges: tuple[Array, ...],
    cutter: Cutter | None,
) -> tuple[Sheets, Array, Array]:
    """First stage by monotone pieces: sheets, ways out, branches."""
    kind = kind_of(map_of(float(strata.mean[0])))
    below, above, without = _sink_numbers(kind.exits)
    sinks = np.zeros((grid.n_cells, len(kind.exits)))
    branches = np.zeros((grid.n_cells, len(kind.branches)))
    sheets: list[Sheet] = []
    cuts = Cutter(map_of, grid.domain, strata.mean) if cutter is None else cutter
    for weight, mean, sd in zip(*(column.tolist() for column in strata[:3]), strict=True):
        for boxes in boxes_of_pieces(map_of, grid, cuts.at(mean), mean, sd, weight):
            sheet, under, over = laid(boxes, edges[boxes.target])
            sheets.append(sheet)
            rows = slice(boxes.first, boxes.first + under.size)
            sinks[rows, below] += under
            sinks[rows, above] += over
            branches[rows, boxes.branch] += boxes.weight
    missing = 1.0 - branches.sum(axis=1)
    sinks[:, without] += np.where(missing > 1e-12, missing, 0.0)  # below that: rounding of sums of shares
    return Sheets(grid.n_cells, edges, tuple(sheets)), sinks, branches


def _from_points(
    map_of: Callable[[float], Any], grid: Grid, strata: Strata, edges: tuple[Array, ...]
) -> tuple[Any, Array, Array]:
    """First stage by points of the cells: a sparse matrix, ways out, branches."""
    from scipy.sparse import coo_array, csr_array

    kind = kind_of(map_of(float(strata.mean[0])))
    low, high, _ = _sink_numbers(kind.exits)
    number = {code: k for k, code in enumerate(kind.exits.values())}
    sinks = np.zeros((grid.n_cells, len(kind.exits)))
    branches = np.zeros((grid.n_cells, len(kind.branches)))
    offset = np.concatenate([[0], np.cumsum([e.size - 1 for e in edges])]) if edges else grid.offset
    shape = (grid.n_cells, int(offset[-1]))
    whole = csr_array(shape)
    for weight, mean, sd in zip(*(column.tolist() for column in strata[:3]), strict=True):
        for side in range(grid.sides):
            source, x, to, code, share, width = rows_of_points(map_of, grid, mean, sd, weight, side)
            for branch in range(len(kind.branches)):
                branches[:, branch] += np.bincount(source, share * (code == branch), grid.n_cells)
            for value, column in number.items():
                lost = code == value
                if edges and value in (codes.INWARD, codes.OUTWARD):
                    continue  # decided after the landing place has scattered
                sinks[:, column] += np.bincount(source[lost], share[lost], grid.n_cells)
            for target in range(grid.sides):
                here = to == target
                here &= (code >= 0) | (np.isin(code, (codes.INWARD, codes.OUTWARD)) if edges else False)
                rows, cells, mass, under, over = _landed(
                    grid, edges, target, x[here], width[here], share[here]
                )
                sinks[:, low] += np.bincount(source[here], under, grid.n_cells)
                sinks[:, high] += np.bincount(source[here], over, grid.n_cells)
                place = (source[here][rows], cells + offset[target])
                whole = whole + coo_array((mass, place), shape=shape).tocsr()
    return whole, sinks, branches


def _landed(
    grid: Grid, edges: tuple[Array, ...], target: int, x: Array, width: Array, share: Array
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, Array]:
    """Entries of points that land on one side: which point, cell of that side, mass; and masses below and above."""
    if edges:
        boxes = Boxes(0, target, 0, x - 0.5 * width, x + 0.5 * width, share)
        sheet, below, above = laid(boxes, edges[target])
        last = edges[target].size - 1
        owner, cell, part = shared(sheet.lo, np.minimum(sheet.hi, last))
        cell = np.minimum(cell, last - 1)
        return owner, cell, sheet.per_length[owner] * part * np.diff(edges[target])[cell], below, above
    cell = grid.index(x, target) - grid.offset[target]
    inside = cell >= 0
    outside = np.where(inside, 0.0, share)
    owner = np.flatnonzero(inside)
    return owner, cell[inside], share[inside], outside, np.zeros(share.size)


def _landing(
    grid: Grid, edges: tuple[Array, ...], strata: Strata, exits: dict[str, int]
) -> tuple[Sheets, Array]:
    """Second stage: the noise of the landing place, from the cells beyond the domain too; and what leaves."""
    low, high, _ = _sink_numbers(exits)
    rows = sum(e.size - 1 for e in edges)
    targets = tuple(side[0] for side in grid.edges)
    sinks, sheets, first = np.zeros((rows, len(exits))), [], 0
    for side, borders in enumerate(edges):
        middle, extent = 0.5 * (borders[1:] + borders[:-1]), np.diff(borders)
        here = slice(first, first + middle.size)
        for weight, mean, sd in zip(*strata[:3], strict=True):
            reach = 0.5 * np.hypot(extent, math.sqrt(12.0) * sd)
            share = np.full(middle.size, float(weight))
            boxes = Boxes(first, side, 0, middle + mean - reach, middle + mean + reach, share)
            sheet, below, above = laid(boxes, targets[side])
            sheets.append(sheet)
            sinks[here, low] += below
            sinks[here, high] += above
        first += middle.size
    return Sheets(rows, targets, tuple(sheets)), sinks


def transfer(
    map_of: Any,
    grid: Grid,
    *,
    parameter: Law | Strata | None = None,
    landing: Law | None = None,
    strata: int = STRATA,
    cutter: Cutter | None = None,
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
    cutter : Cutter, optional
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
    (array([0.4375, 0.4375, 0.0625, 0.    ]), array([0.0625]))
    """
    fixed = isinstance(map_of, tuple)
    at: Callable[[float], Any] = (lambda _: map_of) if fixed else map_of
    pieces = _still() if parameter is None else _cut(parameter, strata)
    params = at(float(pieces.mean[0]))
    kind = kind_of(params)
    if kind.dimension != grid.dimension:
        raise AnswerError(
            "the dimension of the grid", grid.dimension, f"{kind.dimension}, the map's", "cut another domain"
        )
    if landing is not None and kind.dimension != 1:
        raise AnswerError("the noise of x", landing, "none in more than one dimension", "leave it out")
    finer = max(strata, min(LANDING_STRATA, LANDING_BOXCARS // grid.n_cells))
    added = None if landing is None else landing.strata(finer)
    reach = (0.0, 0.0) if added is None else (added.lo, added.hi)
    edges = _beyond(grid, reach) if kind.dimension == 1 else ()
    if uses_pieces(params):
        throw, sinks, branches = _from_pieces(at, grid, pieces, edges, cutter)
    else:
        throw, sinks, branches = _from_points(at, grid, pieces, edges)
    cut = pieces.cut
    second = None
    if added is not None:
        second, late = _landing(grid, edges, added, kind.exits)
        columns = [throw.apply(column) if isinstance(throw, Sheets) else throw @ column for column in late.T]
        sinks = sinks + np.stack(columns, axis=1)
        cut += added.cut
    return Transfer(params, grid, throw, second, sinks, branches, reach, cut)


def _still() -> Strata:
    return Strata(np.ones(1), np.ones(1), np.zeros(1), 1.0, 1.0)


def _cut(parameter: Law | Strata, count: int) -> Strata:
    return parameter if isinstance(parameter, Strata) else parameter.strata(count)
