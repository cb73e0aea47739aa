"""The two stages of the transfer operator: the throw, and the scatter of the landing place."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.maps import codes, kind_of
from limitsets.robust.noise.boxcars import (
    Array,
    BoxcarBlock,
    BoxcarOperator,
    Boxcars,
    first_cells,
    laid,
    mass_rows,
)
from limitsets.robust.noise.cell_images import boxes_of_pieces, rows_of_points
from limitsets.robust.noise.interpolated_pieces import InterpolatedPieces
from limitsets.robust.noise.laws import Strata

# Most cells that go on beyond an end of the domain.
MOST_BEYOND = 2048


def beyond(grid: Grid, reach: tuple[float, float]) -> tuple[Array, ...]:
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
        for column, value in enumerate(exits):
            met[:, column] += np.bincount(source[code == value], minlength=grid.n_cells)
    met[met.sum(axis=1) == 0, otherwise] = 1.0
    shares: Array = met / met.sum(axis=1, keepdims=True)
    return shares


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
) -> tuple[NDArray[np.int64], NDArray[np.int64], Array, Array, Array]:
    """Entries of points that land on one side: which point, cell of that side, mass; and masses below and above."""
    if edges:
        boxcars = Boxcars(0, target, 0, x - 0.5 * width, x + 0.5 * width, share)
        block, below, above = laid(boxcars, edges[target])
        return *mass_rows(block, edges[target]), below, above
    cell = grid.index(x, target) - grid.offset[target]
    inside = cell >= 0
    outside = np.where(inside, 0.0, share)
    owner = np.flatnonzero(inside)
    return owner, cell[inside], share[inside], outside, np.zeros(share.size)


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
