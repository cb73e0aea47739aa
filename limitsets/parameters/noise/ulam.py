"""The transfer operator of a noisy map between cells (Ulam's method, generalised cell mapping), in two stages.

P[i, j] is the probability that a state anywhere in cell i, equally likely, is in cell j one step later.  The noise of
the step itself (speed, tilt: a parameter of the map) and the noise of the landing place, added afterwards, are two
stages.  Between them the cells extend beyond the domain, as far as the second stage can bring a part back.  Exits are
columns of their own: no mass that leaves is counted in a neighbouring cell.
Source: Ulam, "A Collection of Mathematical Problems", 1960, ch. VI; Hsu, "Cell-to-Cell Mapping", 1987, ch. 10;
Dellnitz and Junge, SIAM J. Numer. Anal. 36, 1999.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from limitsets.base import AnswerError
from limitsets.base.arrays import Array, Ints
from limitsets.feeder.scattering import Law, Strata, certain
from limitsets.parameters.noise.cell_images import (
    BoxcarBlock,
    BoxcarOperator,
    Boxcars,
    InterpolatedPieces,
    boxes_of_pieces,
    first_cells,
    laid,
    mass_rows,
    rows_of_points,
    uses_pieces,
)
from limitsets.systems.cells import Grid
from limitsets.systems.maps import codes, kind_of
from limitsets.systems.maps.contract import compiled_kind_of

# ----------------------------------------------------------------
# The two stages of the transfer operator: the throw, and the scatter of the landing place.


# Most cells that go on beyond an end of the domain.
MOST_BEYOND = 2048


def beyond(grid: Grid, reach: tuple[float, float]) -> tuple[Array, ...]:
    """Borders of the cells between the stages, which go on beyond the domain."""
    borders = []
    for (edges,) in grid.edges:
        width = float(np.median(np.diff(edges)))
        parts = []
        for size, end, sign in ((max(reach[1], 0.0), edges[0], -1.0), (max(-reach[0], 0.0), edges[-1], 1.0)):
            count = min(math.ceil(size / width), MOST_BEYOND)
            parts.append(end + sign * size * np.arange(1, count + 1) / max(count, 1))
        borders.append(np.concatenate([parts[0][::-1], edges, parts[1]]))
    return tuple(borders)


def _sink_numbers(exits: dict[str, int]) -> tuple[int, int, int]:
    """Columns of the masses that land below, that land above, and that have no image."""
    number = {code: k for k, code in enumerate(exits.values())}
    outside = number.get(codes.OUTSIDE_MODEL, number.get(codes.OUTSIDE, 0))
    return number.get(codes.INWARD, number.get(codes.OUTSIDE, 0)), number.get(codes.OUTWARD, 0), outside


def from_pieces(
    map_of: Callable[[float], Any],
    grid: Grid,
    strata: Strata,
    edges: tuple[Array, ...],
    cutter: InterpolatedPieces | None,
) -> tuple[BoxcarOperator, Array, Array]:
    """First stage by monotone pieces: sheets, ways out, branches."""
    kind = kind_of(map_of(float(strata.mean[0])))
    below, above, without = _sink_numbers(kind.exits)
    sinks = np.zeros((grid.n_cells, len(kind.exits)))
    branches = np.zeros((grid.n_cells, len(kind.branches)))
    sheets: list[BoxcarBlock] = []
    cuts = InterpolatedPieces(map_of, grid.domain, strata.mean) if cutter is None else cutter
    for weight, mean, sd in strata.rows():
        for boxcars in boxes_of_pieces(map_of, grid, cuts.at(mean), mean, sd, weight):
            block, under, over = laid(boxcars, edges[boxcars.target])
            sheets.append(block)
            rows = slice(boxcars.first, boxcars.first + under.size)
            sinks[rows, below] += under
            sinks[rows, above] += over
            branches[rows, boxcars.branch] += boxcars.weight
    missing = 1.0 - branches.sum(axis=1)
    missing[missing <= 1e-12] = 0.0  # rounding of sums of shares
    if missing.any():
        exits = tuple(kind.exits.values())
        sinks += missing[:, None] * _ways_out(map_of(float(strata.mean[0])), grid, exits, without)
    return BoxcarOperator(grid.n_cells, edges, tuple(sheets)), sinks, branches


def _ways_out(params: Any, grid: Grid, exits: tuple[int, ...], otherwise: int) -> Array:
    """Shares of the ways out among the points of each cell that have no image; `otherwise` where all have one."""
    met = np.zeros((grid.n_cells, len(exits)))
    for side in range(grid.sides):
        source, _, _, code, _, _ = rows_of_points(lambda _: params, grid, 0.0, 0.0, 1.0, side)
        met += np.stack(
            [np.bincount(source[code == exit_], minlength=grid.n_cells) for exit_ in exits], axis=1
        )
    met[met.sum(axis=1) == 0, otherwise] = 1.0
    return np.asarray(met / met.sum(axis=1, keepdims=True))


def from_points(
    map_of: Callable[[float], Any], grid: Grid, strata: Strata, edges: tuple[Array, ...]
) -> tuple[Any, Array, Array]:
    """First stage by points of the cells: a sparse matrix, ways out, branches."""
    from scipy.sparse import coo_array, csr_array

    kind = kind_of(map_of(float(strata.mean[0])))
    low, high, _ = _sink_numbers(kind.exits)
    number = {code: k for k, code in enumerate(kind.exits.values())}
    sinks = np.zeros((grid.n_cells, len(kind.exits)))
    branches = np.zeros((grid.n_cells, len(kind.branches)))
    offset = first_cells(edges) if edges else grid.offset
    shape = (grid.n_cells, int(offset[-1]))
    whole = csr_array(shape)
    for weight, mean, sd in strata.rows():
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
                some = (x[here], width[here], share[here])
                rows, cells, mass, under, over = _landed(grid, edges, target, *some)
                sinks[:, low] += np.bincount(source[here], under, grid.n_cells)
                sinks[:, high] += np.bincount(source[here], over, grid.n_cells)
                place = (source[here][rows], cells + offset[target])
                whole = whole + coo_array((mass, place), shape=shape).tocsr()
    return whole, sinks, branches


def _landed(
    grid: Grid, edges: tuple[Array, ...], target: int, x: Array, width: Array, share: Array
) -> tuple[Ints, Ints, Array, Array, Array]:
    """Entries of points that land on one side: which point, cell of that side, mass; and masses below and above."""
    if edges:
        boxcars = Boxcars(0, target, 0, x - 0.5 * width, x + 0.5 * width, share)
        block, below, above = laid(boxcars, edges[target])
        return *mass_rows(block, edges[target]), below, above
    cell = grid.index(x, target) - grid.offset[target]
    inside = cell >= 0
    outside = np.where(inside, 0.0, share)
    return np.flatnonzero(inside), cell[inside], share[inside], outside, np.zeros(share.size)


def landing_stage(
    grid: Grid, edges: tuple[Array, ...], strata: Strata, exits: dict[str, int]
) -> tuple[BoxcarOperator, Array]:
    """Second stage: the noise of the landing place, from the cells beyond the domain too; and what leaves."""
    low, high, _ = _sink_numbers(exits)
    rows = sum(e.size - 1 for e in edges)
    targets = tuple(side[0] for side in grid.edges)
    sinks, sheets, first = np.zeros((rows, len(exits))), [], 0
    for side, borders in enumerate(edges):
        middle, extent = 0.5 * (borders[1:] + borders[:-1]), np.diff(borders)
        here = slice(first, first + middle.size)
        for weight, mean, sd in strata.rows():
            reach = 0.5 * np.hypot(extent, math.sqrt(12.0) * sd)
            share = np.full(middle.size, weight)
            boxcars = Boxcars(first, side, 0, middle + mean - reach, middle + mean + reach, share)
            block, below, above = laid(boxcars, targets[side])
            sheets.append(block)
            sinks[here, low] += below
            sinks[here, high] += above
        first += middle.size
    return BoxcarOperator(rows, targets, tuple(sheets)), sinks


# ----------------------------------------------------------------
# The transfer operator of a noisy map between the cells of a grid: Ulam's method, generalised cell mapping.


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

    def marked(self, cells: Ints, values: Array | float = 1.0) -> Array:
        """Give a function that has values on some cells, and is 0 on all others."""
        function = np.zeros(self.n_cells)
        function[cells] = values
        return function

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

    def __init__(self, chain: Transfer, cells: Ints) -> None:
        self.chain, self.cells, self.products = chain, cells, 0

    @cached_property
    def matrix(self) -> Any:
        """The entries among the cells; None where the operator is not written out."""
        return self.chain.matrix[self.cells][:, self.cells] if self.chain.written_out else None

    @cached_property
    def _transposed(self) -> Any:
        return self.matrix.T.tocsr()

    def apply(self, values: Array) -> Array:
        """Return a function's expected value one step later; it is 0 on all other cells."""
        if self.matrix is not None:
            return self.matrix @ values  # type: ignore[no-any-return]  # scipy is untyped
        return self.chain.apply(self.chain.marked(self.cells, values))[self.cells]

    def adjoint(self, masses: Array) -> Array:
        """Where masses on the cells are one step later; how often that was asked is counted."""
        self.products += 1
        if self.matrix is not None:
            return self._transposed @ masses  # type: ignore[no-any-return]  # scipy is untyped
        return self.chain.adjoint(self.chain.marked(self.cells, masses))[self.cells]


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
    at: Callable[[float], Any] = (lambda _: map_of) if isinstance(map_of, tuple) else map_of
    law = certain(1.0) if parameter is None else parameter
    pieces = law if isinstance(law, Strata) else law.strata(strata)
    params = at(float(pieces.mean[0]))
    kind = compiled_kind_of(params, "the noisy chain")
    if kind.dimension != grid.dimension:
        raise AnswerError(
            "the dimension of the grid", grid.dimension, f"{kind.dimension}, the map's", "cut another domain"
        )
    if landing is not None and kind.dimension != 1:
        raise AnswerError("the noise of x", landing, "none in more than one dimension", "leave it out")
    grid.domain.require_ends("the grid of the noisy chain")
    finer = max(strata, min(LANDING_STRATA, LANDING_BOXCARS // grid.n_cells))
    added = None if landing is None else landing.strata(finer)
    reach = (0.0, 0.0) if added is None else (added.lo, added.hi)
    edges = beyond(grid, reach) if kind.dimension == 1 else ()
    first_stage = partial(from_pieces, cutter=cutter) if uses_pieces(params) else from_points
    throw, sinks, branches = first_stage(at, grid, pieces, edges)
    cut, second = pieces.cut, None
    if added is not None:
        second, late = landing_stage(grid, edges, added, kind.exits)
        after = throw.apply if isinstance(throw, BoxcarOperator) else throw.__matmul__
        sinks, cut = sinks + np.stack([after(column) for column in late.T], axis=1), cut + added.cut
    return Transfer(
        map=params,
        grid=grid,
        throw=throw,
        landing=second,
        sinks=sinks,
        branches=branches,
        reach=reach,
        cut=cut,
    )
