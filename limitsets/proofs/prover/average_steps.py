"""What the search for an average knows of the cells of a component, in floats: steps, images, runs beside changes.

A map and the throw give `Branch`es; `steps_of` puts them together for the compiled loops of `average_search`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.systems.cells import Grid, cell_ends

LEAST_SLOPE = 2.0**-60  # below it nothing is proved; no quotient overflows

Values = Callable[[Array, Array, int, int], Array]
"""The function that is averaged, at places, from the slopes there, the side and the branch."""


class Branch(NamedTuple):
    """Cells of a component that take a branch from one side, one row each: what the inequalities need of them.

    Of a cell with a change of branch `way` is 0 below the change, 1 above.
    """

    cell: Ints
    way: Ints
    least: Array  # slope
    bend: Array  # |f''|/f'^2
    off: Array  # what the ends of the image are known to
    values: Array  # (functions, 3, n): mean, least and largest of what is averaged
    ends: Array  # (2, n) of the image
    covered: Ints  # (2, n) target cells, counted on the side where they lie
    first: int  # cell of that side
    edges: Array  # of its cells


class Steps(NamedTuple):
    """Cells of one component on their branches, rows in the order of the cells; and the cells that each image meets.

    A cell with a change of branch has two rows, one for either side; every other cell has one.
    """

    cell: Ints
    way: Ints
    least: Array  # slope
    bend: Array
    off: Array
    mean: Array  # of the function, its least and its largest value
    low: Array
    high: Array
    length: Array  # of the image
    begin: Ints  # (rows + 1) first entry of `met` of each row
    met: Ints
    part: Array  # of the image in each
    first: Ints  # (cells + 1) first row of each cell


def steps_of(grid: Grid, branches: Sequence[Branch], own: Mask, undecided: Mask) -> tuple[Steps, Array]:
    """Put the branches of a component together, its cells counted from 0; without and with the values of functions."""
    number, (_, lo, hi) = np.cumsum(own) - 1, cell_ends(grid)
    covered = []
    for each in branches:
        edges, ends = each.edges, each.ends
        # of a cell with two branches the checker takes the neighbours of the target cells too, and of others the cells
        # that the image may meet, by what is known of its ends
        first_met = np.searchsorted(edges, ends[0] - each.off, "left") - 1
        last_met = np.searchsorted(edges, ends[1] + each.off, "right") - 1
        near = np.stack([np.minimum(first_met, each.covered[0]), np.maximum(last_met, each.covered[1])])
        beyond = np.where(undecided[each.cell], np.add(each.covered, [[-1], [1]]), near)
        beyond = np.clip(beyond, 0, edges.size - 2)
        covered.append(each.first + np.where(own[each.first + beyond], beyond, each.covered))
    cell = np.concatenate([each.cell for each in branches])
    order = np.argsort(cell, kind="stable")
    ends, met = (np.concatenate(each, axis=1)[:, order] for each in ([b.ends for b in branches], covered))
    sizes = met[1] - met[0] + 1
    begin = np.concatenate([[0], np.cumsum(sizes)])
    row = np.repeat(np.arange(sizes.size), sizes)
    k = np.arange(row.size) - begin[row] + met[0][row]
    inside = np.minimum(hi[k], ends[1, row]) - np.maximum(lo[k], ends[0, row])
    alike = zip(*(each[1:5] for each in branches), strict=True)
    way, least, bend, off = (np.concatenate(column)[order] for column in alike)
    values = np.concatenate([each.values for each in branches], axis=2)[:, :, order]
    cell = number[cell[order]]
    length, first = np.maximum(ends[1] - ends[0], 1e-300), np.searchsorted(cell, np.arange(own.sum() + 1))
    mean, low, high = values[0]
    steps = Steps(
        cell, way, least, bend, off, mean=mean, low=low, high=high, length=length, begin=begin,
        met=number[k], part=np.maximum(inside, 0.0), first=first,
    )  # fmt: skip
    return steps, values


def values_of(functions: Sequence[Values], x: Sequence[Array], slopes: Array, at: tuple[int, int]) -> Array:
    """Give the values of a branch: each function at the ends and the middle of cells, on a side and a branch."""
    of_g = np.array(
        [[one(each, slope, *at) for each, slope in zip(x, slopes, strict=True)] for one in functions]
    )
    return np.stack([of_g[:, 1], of_g.min(axis=1), of_g.max(axis=1)], axis=1)


def bends_of(width: Array, least: Array, slopes: Array, wider: float) -> Array:
    """Bound |f''|/f'^2 on cells by the slopes at their ends, with neighbours."""
    bend = np.abs(slopes[-1] - slopes[0]) / width / np.maximum(least, LEAST_SLOPE) ** 2
    return np.asarray(wider * np.maximum.reduce([bend, np.roll(bend, 1), np.roll(bend, -1)]))


class Runs(NamedTuple):
    """Runs of cells beside changes: by change its row, and by cell of the run the share p; one after another."""

    row: Ints
    begin: Ints  # (changes + 1)
    cell: Ints
    share: Array
    length: Array  # of the run


class Change(NamedTuple):
    """One side of a change of branch: the row of its undecided cell, and the cells beside it, nearest first."""

    row: int
    beside: Ints


def changes_of(grid: Grid, own: Mask, steps: Steps) -> list[Change] | str:
    """List the sides of the changes of branch by undecided cell: below, then above; or say what is missing."""
    listed, cells_of, number = list[Change](), np.flatnonzero(own), np.cumsum(own) - 1
    for row in np.flatnonzero(np.diff(steps.first) == 2).tolist():
        cell, first = int(cells_of[row]), int(steps.first[row])
        borders = grid.of_side(int(grid.side_of(np.array([cell]))[0]))
        both = np.arange(cell - 1, borders.start - 1, -1), np.arange(cell + 1, borders.stop)
        for way, cells in enumerate(both):
            stop = np.flatnonzero(~own[cells])
            cells = cells[: stop[0]] if stop.size else cells
            if not cells.size:
                return f"no cell of the attractor lies beside cell {cell}, in which the branch changes"
            listed.append(Change(first + int(steps.way[first] != way), number[cells]))
    return listed


def runs_of(changes: Sequence[Change], counts: Sequence[int], width: Array) -> Runs:
    """Cut the cells beside changes to runs of so many."""
    cells = [change.beside[:count] for change, count in zip(changes, counts, strict=True)]
    shares = [np.cumsum(width[some][::-1])[::-1] for some in cells]
    length = np.array([share[0] for share in shares])
    return Runs(
        np.array([change.row for change in changes], np.int64),
        np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        np.concatenate([np.zeros(0, np.int64), *cells]),
        np.concatenate([np.zeros(0), *(share / share[0] for share in shares)]),
        length,
    )
