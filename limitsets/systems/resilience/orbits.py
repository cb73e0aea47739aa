"""Inner and outer basins on cells, and random starts in cells whose orbits come to an attractor.

Cells end at the border of the domain: what leaves is lost to them.  Orbits of starts that a caller asks for may come
back: one has left for good where it ends beyond the border and was there for the last half of its steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError
from limitsets.systems.cells import CellSet, Grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.components import reach
from limitsets.systems.graph.target import Target
from limitsets.systems.maps import codes
from limitsets.systems.sets import Attractor, Basins, basins
from limitsets.systems.sets.closing import stepped

# ----------------------------------------------------------------
# Inner and outer basins: in which basin each cell lies, and in which ones an undecided cell may lie.
#
# The basins are those of the map on the domain of the grid: an orbit that leaves the domain is in the basin of the
# exit. Where the images of cells are enclosed, both are proved, for `limitsets.basins` labels a cell only where all
# of its paths end in the same place, and an orbit that comes to attracting cells gives a path there.


# Bits of one sweep over the graph.
BITS = 64

# Where a larger share is undecided there is a bracket, and no best value within it.
MOST_UNDECIDED = 0.1

# Proved shares and entropies are rounded by this much, against the rounding of sums.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Colours:
    """Basins of a graph, in the order: attractors, exits.

    Attributes
    ----------
    graph : TransitionGraph
        The graph.
    basins : Basins
        Its labels.
    blocks : ndarray of int32, shape (n_cells,)
        Number of the attractor on attracting cells, undecided on all others.
    codes : ndarray of int, shape (m,)
        The label of each basin.
    undecided : ndarray of int, shape (u,)
        Numbers of the undecided cells.
    possible : ndarray of bool, shape (m + 1, u)
        Whether a path from the cell comes to that basin's attracting cells or exit; last, whether one may stay
        elsewhere, in a recurrent set that does not attract.
    """

    graph: TransitionGraph
    basins: Basins
    blocks: NDArray[np.int32]
    codes: NDArray[np.int64]
    undecided: NDArray[np.int64]
    possible: NDArray[np.bool_]

    @property
    def grid(self) -> Grid:
        """The cells."""
        return self.graph.grid

    @property
    def labels(self) -> NDArray[np.int32]:
        """Label of each cell: an attractor's number, an exit's code, or undecided."""
        return self.basins.labels

    @property
    def how(self) -> str:
        """How inner and outer basins were obtained: "proved", or "cells" whose images are sampled."""
        return self.graph.how

    @property
    def names(self) -> tuple[int | str, ...]:
        """Number of each attractor, name of each exit."""
        return (*range(len(self.basins.attractors)), *self.graph.exits)

    def inner(self, number: int) -> CellSet:
        """Cells all of whose starts lie in a basin."""
        return CellSet(self.grid, self.labels == self.codes[number])

    def outer(self, number: int) -> CellSet:
        """Cells outside which no start lies in a basin."""
        mask = self.labels == self.codes[number]
        mask[self.undecided[self.possible[number]]] = True
        return CellSet(self.grid, mask)


def colours(graph: TransitionGraph, attractors: tuple[Attractor, ...]) -> Colours:
    """Find the basins of a graph; AnswerError for attractors of another one."""
    shares = basins(graph, attractors)
    undecided = np.flatnonzero(shares.labels == codes.UNDECIDED)
    blocks = np.full(graph.n_cells, codes.UNDECIDED, dtype=np.int32)
    for number, attractor in enumerate(attractors):
        blocks[attractor.cells.mask] = number
    staying = graph.recurrent_set().mask & (blocks == codes.UNDECIDED)
    leaving = [(graph.ranges.exits >> number & 1).astype(bool) for number in range(len(graph.exits))]
    ends = [*(attractor.cells.mask for attractor in attractors), *leaving, staying]
    possible = np.zeros((len(ends), undecided.size), dtype=bool)
    for begin in range(0, len(ends) if undecided.size else 0, BITS):
        marks = np.zeros(graph.n_cells, dtype=np.uint64)
        for bit, mask in enumerate(ends[begin : begin + BITS]):
            marks[mask] |= np.uint64(1 << bit)
        seen = reach(graph.ranges, graph.components(), marks)[undecided]
        for bit in range(min(BITS, len(ends) - begin)):
            possible[begin + bit] = seen >> np.uint64(bit) & np.uint64(1)
    labels = np.array([*range(len(attractors)), *graph.exits.values()], dtype=np.int64)
    return Colours(graph, shares, blocks, labels, undecided, possible)


def best(value: float, undecided: float) -> float:
    """Give a best value, nan where more than a tenth is undecided."""
    return value if undecided <= MOST_UNDECIDED else np.nan


def full_caption(caption: str, undecided: float, cut: bool = False) -> str:
    """Write what is beside a number into the caption of its table: what is left out, and where orbits were cut off."""
    words = [caption]
    if undecided > MOST_UNDECIDED:
        words.append(f"{undecided:.1%} undecided, no best value".replace("%", " %"))
    if cut:
        words.append("orbits end at the border of the domain, starts=... follows them beyond")
    return "; ".join(words)


# ----------------------------------------------------------------
# Random starts in cells, and where their orbits come to.


Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Steps after which an orbit that has come nowhere is given up.
STEPS = 10_000


def starts_in(grid: Grid, cells: Integers, rng: np.random.Generator) -> tuple[Floats, Integers]:
    """Draw a start in each of the given cells, evenly: states of shape (n, dimension), and their sides."""
    lo, hi, side = grid.corners(cells)
    return lo + rng.random(lo.shape) * (hi - lo), side


def random_cells(
    grid: Grid, count: int, rng: np.random.Generator
) -> tuple[Integers, tuple[Floats, Integers]]:
    """Draw starts evenly by length (area, volume) over all sides, with their cells; AnswerError for less than 1."""
    if count < 1:
        raise AnswerError("the number of starts", count, "an integer from 1", "pass 1000")
    measure = grid.measure
    cells = rng.choice(grid.n_cells, count, p=measure / measure.sum())
    return cells, starts_in(grid, cells, rng)


def leaves_by_the_border(graph: TransitionGraph) -> bool:
    """Whether the image of some cell's centre lies beyond a border at which the grid ends, and not the map.

    The border of graded cells is the map's own: the throw ends there.
    """
    grid = graph.grid
    if grid.domain.anchor is not None:
        return False
    lo, hi, side = grid.corners(np.arange(grid.n_cells))
    after, to, code = stepped(graph.map, 0.5 * (lo + hi), side)
    return bool((grid.index(after[code >= 0], to[code >= 0]) < 0).any())


def follow(
    graph: TransitionGraph,
    stops: NDArray[np.int32],
    x: Floats,
    side: Integers,
    steps: int,
    *,
    returning: bool = False,
) -> tuple[Integers, Integers]:
    """Follow starts, as the cells do without random noise, until they come to a cell with a label or leave the domain.

    Parameters
    ----------
    graph : TransitionGraph
        Map and cells.
    stops : ndarray of int32, shape (n_cells,)
        Labels; undecided cells are passed through.
    x, side : ndarray, shape (n, dimension) and (n,)
        Starts in the domain.
    steps : int
        At most so many.
    returning : bool
        Follow orbits beyond the border, from where they may come back.

    Returns
    -------
    ndarray of int, shape (n,)
        Label, or code of the exit; undecided for those still on their way.
    ndarray of int, shape (n,)
        Steps to the label; of those that have left, to where they first did.

    Raises
    ------
    AnswerError
        The number of steps is below 1.
    """
    if steps < 1:
        raise AnswerError("the number of steps", steps, "an integer from 1", "pass 1000")
    grid, ways = graph.grid, list(graph.exits.values())
    target = Target.of(grid, graph.exits)
    below, above = ways[target.sink_below], ways[target.sink_above]
    end, made = np.full(side.size, codes.UNDECIDED, dtype=np.int64), np.zeros(side.size, dtype=np.int64)
    going, code = np.arange(side.size), np.zeros(side.size, dtype=np.int64)
    gone, inside = np.zeros_like(made), np.zeros_like(made)  # first step beyond the border, last one within
    for step in range(steps + 1):
        if step:
            x, side, code = stepped(graph.map, x, side)
            x = grid.domain.wrapped(x, side)
            made[going] = step
        label = np.where(code < 0, code, codes.UNDECIDED)
        here = np.flatnonzero(code >= 0)
        cell = grid.index(x[here], side[here])
        low = (x[here] < grid.domain.lo[side[here]]).any(axis=1)
        label[here] = np.where(cell >= 0, stops[cell], np.where(low, below, above))
        if returning:
            out, finite = cell < 0, np.isfinite(x[here]).all(axis=1)
            first = here[out & (gone[going[here]] == 0)]
            gone[going[first]] = step
            inside[going[here[~out]]] = step
            on_their_way = here[out & finite & ((step < steps) | (2 * inside[going[here]] > steps))]
            label[on_their_way] = codes.UNDECIDED
        end[going] = label
        on = np.flatnonzero(label == codes.UNDECIDED)
        going, x, side = going[on], x[on], side[on]
        if not going.size:
            break
    left = (end < 0) & (end != codes.UNDECIDED) & (gone > 0)
    made[left] = gone[left]
    return end, made


def labelled_starts(parted: Colours, steps: int, rng: np.random.Generator) -> Integers:
    """Label of a start in each cell: the cell's where it is decided, else where its orbit comes to.

    The places along each axis are drawn once, so that starts of one row differ in one coordinate only.
    """
    grid, label = parted.grid, parted.labels.astype(np.int64)
    for s, axes in enumerate(grid.edges):
        places = [edges[:-1] + rng.random(edges.size - 1) * np.diff(edges) for edges in axes]
        cells = parted.undecided[grid.side_of(parted.undecided) == s]
        x = np.stack([at[k] for at, k in zip(places, grid.axes(cells, s), strict=True)], axis=1)
        label[cells] = follow(parted.graph, parted.labels, x, np.full(cells.size, s), steps)[0]
    return label


def labelled_lattice(
    parted: Colours, side: int, boxes: list[Integers], each: int, steps: int, rng: np.random.Generator
) -> Integers:
    """Label of so many starts along each axis of boxes of cells, with orbits that may come back.

    Parameters
    ----------
    parted : Colours
        Basins of the cells.
    side : int
        Of the starts.
    boxes : list of ndarray
        Of each axis the cells in which boxes begin, and the number of its cells last.
    each : int
        Starts along each axis of a box, one in each of as many equal parts, at one place in all of them.
    steps : int
        At most so many are followed.
    rng : Generator
        Draws that place of each axis.

    Returns
    -------
    ndarray of int, shape (number of boxes, each, ...)
        Label, or code of the exit, or undecided.
    """
    places = []
    for edges, begin in zip(parted.grid.edges[side], boxes, strict=True):
        at = edges[begin]
        part = (np.arange(each) + rng.random()) / each
        places.append((at[:-1, None] + part * np.diff(at)[:, None]).ravel())
    x = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, len(places))
    label, _ = follow(parted.graph, parted.blocks, x, np.full(len(x), side), steps, returning=True)
    block = label.reshape([n for begin in boxes for n in (begin.size - 1, each)])
    axes = range(len(places))
    return block.transpose(*(2 * k for k in axes), *(2 * k + 1 for k in axes)).reshape(
        -1, *[each] * len(places)
    )
