"""Wada test: whether boxes on a boundary meet all basins once one looks closely enough.

A basin boundary has the Wada property where each of its points is a boundary point of three basins or more.  No finite
number of starts shows it: the share of boundary boxes that meet all basins is given as found, at one resolution.

Source: Daza, Wagemakers, Sanjuan, Yorke, "Testing for basins of Wada", Scientific Reports 5, 16579, 2015 (the grid
method, used here); Daza, Wagemakers, Sanjuan, "Ascertaining when a basin is Wada: the merging method", Scientific
Reports 8, 9954, 2018.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base.arguments import arguments_checked
from limitsets.base.errors import AnswerError
from limitsets.base.files import as_table, picked
from limitsets.base.tables import Column, Table, Tabled
from limitsets.systems.cells import Grid
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.maps import codes
from limitsets.systems.resilience.orbits import (
    MOST_UNDECIDED,
    STEPS,
    Colours,
    colours,
    follow,
    full_caption,
    labelled_starts,
    leaves_by_the_border,
    random_cells,
    starts_in,
)
from limitsets.systems.sets import Attractor

# Starts per cell and axis at the four refinements; the first is one start in each cell of a box.
REFINEMENTS = (1, 2, 4, 8)

# Boundary boxes that are looked at.
BOXES = 400

# A box reaches so many cells to each side of its middle one.
AROUND = 1

# Starts that are followed at a time.
BATCH = 2**18


@dataclass(frozen=True)
class Wada(Tabled):
    """How many boundary boxes meet all basins.

    Attributes
    ----------
    shares : tuple of float
        Share of the boundary boxes that meet all basins, at four refinements of the starts in them: rising to 1 for a
        Wada boundary.  nan without boundary boxes, where fewer than three basins were met, and where more than a tenth
        of the starts is undecided.
    basins : tuple of int or str
        Those met by the first starts: numbers of attractors, names of exits.
    refinements : tuple of int
        Starts per cell and axis; the first are one in each cell, or the random ones that were asked for.
    boxes, of : int
        Boxes of three cells along each axis that were looked at, of so many on a boundary.
    undecided : float
        Share of the first starts that came nowhere.
    cut : bool
        Whether orbits that cross the border of the domain were given up there, in the exit.
    how : str
        "sampled, at this resolution": never proved.
    """

    shares: tuple[float, ...]
    basins: tuple[int | str, ...]
    refinements: tuple[int, ...]
    boxes: int
    of: int
    undecided: float
    cut: bool = False
    how: str = "sampled, at this resolution"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = list(zip(self.refinements, self.shares, strict=False))
        columns = ("starts per cell and axis", Column("share of boxes that meet all basins", show=".6f"))
        caption = full_caption(f"Wada: {self.boxes} of {self.of} boxes", self.undecided, self.cut)
        return (Table(columns, rows, caption, f"{self.how}, not proved"),)

    def to_json(self) -> dict[str, Any]:
        """Give the shares as JSON takes them."""
        return as_table(
            **picked(self, "shares", "basins", "refinements", "boxes", "of", "undecided", "cut", "how")
        )


@arguments_checked
def wada(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    *,
    boxes: int = BOXES,
    starts: int | None = None,
    steps: int = STEPS,
    seed: int = 0,
) -> Wada:
    """Share of the boundary boxes that meet all basins, at four refinements.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    boxes : int
        Boundary boxes to look at; drawn at random where there are more.
    starts : int, optional
        Follow so many random starts first, instead of one in each cell that is not decided: one for each cell or more.
        Their orbits, and those of the finer starts, may leave the domain and come back.
    steps : int
        An orbit is followed for so many steps at most.
    seed : int
        Of the starts and the boxes.

    Returns
    -------
    Wada

    Raises
    ------
    AnswerError
        For attractors of another graph, or a number of boxes below 1.

    Notes
    -----
    Daza, Wagemakers, Sanjuan, Yorke, Scientific Reports 5, 16579, 2015.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-2.0, 2.0)], cells=1000))
    >>> found = ls.resilience.wada(graph, ls.attractors(graph, throws=100))
    >>> found.basins, found.shares[-1] < 0.5  # the two attractors and the way out
    ((0, 1, 'outside'), True)
    """
    if boxes < 1:
        raise AnswerError("the number of boxes", boxes, "an integer from 1", "pass boxes=400")
    parted, rng = colours(graph, found), np.random.default_rng(seed)
    if starts is None:
        cell, label = np.arange(graph.n_cells), labelled_starts(parted, steps, rng)
    else:
        cell, drawn = random_cells(graph.grid, starts, rng)
        label, _ = follow(graph, parted.blocks, *drawn, steps, returning=True)
    number, undecided = _numbers(parted, label), float((label == codes.UNDECIDED).mean())
    seen = np.zeros((parted.codes.size, graph.n_cells), dtype=bool)
    seen[number[number >= 0], cell[number >= 0]] = True
    met = np.flatnonzero(seen.any(axis=1))
    chosen = []
    for side in range(graph.grid.sides):
        shape = tuple(int(n) for n in graph.grid.shape[side])
        several = np.zeros(shape, dtype=np.int64)
        for colour in met:
            several += _around(seen[colour, graph.grid.of_side(side)].reshape(shape))
        chosen.append(graph.grid.offset[side] + np.flatnonzero(several > 1))
    middle = np.concatenate(chosen)
    of = middle.size
    if of > boxes:
        middle = np.sort(rng.choice(middle, boxes, replace=False))
    here = np.zeros((middle.size, parted.codes.size), dtype=bool)
    shares = []
    for parts in REFINEMENTS:
        if parts == 1:
            _see(graph.grid, middle, seen, here)
        else:
            left = np.flatnonzero(~here[:, met].all(axis=1))
            _look(
                parted,
                middle[left],
                left,
                parts=parts,
                steps=steps,
                rng=rng,
                here=here,
                returning=starts is not None,
            )
        known = of and met.size > 2 and undecided <= MOST_UNDECIDED
        shares.append(float(here[:, met].all(axis=1).mean()) if known else np.nan)
    names = tuple(parted.names[k] for k in met)
    cut = starts is None and leaves_by_the_border(graph)
    return Wada(tuple(shares), names, REFINEMENTS, boxes=middle.size, of=of, undecided=undecided, cut=cut)


def _numbers(parted: Colours, label: NDArray[np.int64]) -> NDArray[np.int64]:
    """Index of each label among the basins, -1 for undecided."""
    order = np.argsort(parted.codes)
    at = np.searchsorted(parted.codes[order], label).clip(max=order.size - 1)
    numbers: NDArray[np.int64] = np.where(parted.codes[order][at] == label, order[at], -1)
    return numbers


def _around(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells in whose box some cell of the mask lies."""
    for axis in range(mask.ndim):
        spread = mask.copy()
        for ends in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
            to, of = ((slice(None),) * axis + (end,) for end in ends)
            spread[to] |= mask[of]
        mask = spread
    return mask


def _neighbours(
    grid: Grid, middle: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Cells of boxes: which box, which cell; one place of the box after the other."""
    side = grid.side_of(middle)
    for s in np.unique(side).tolist():
        mine = np.flatnonzero(side == s)
        position, shape = grid.axes(middle[mine], s), tuple(int(n) for n in grid.shape[s])
        for shift in product(range(-AROUND, AROUND + 1), repeat=grid.dimension):
            at = [k + by for k, by in zip(position, shift, strict=True)]
            inside = np.all([(k >= 0) & (k < n) for k, n in zip(at, shape, strict=True)], axis=0)
            cell = np.ravel_multi_index([k[inside] for k in at], shape)
            yield mine[inside], grid.offset[s] + cell


def _see(grid: Grid, middle: NDArray[np.int64], seen: NDArray[np.bool_], here: NDArray[np.bool_]) -> None:
    """Mark the basins that the first starts met."""
    for box, cell in _neighbours(grid, middle):
        here[box] |= seen[:, cell].T


def _look(
    parted: Colours,
    middle: NDArray[np.int64],
    row: NDArray[np.int64],
    parts: int,
    steps: int,
    rng: np.random.Generator,
    here: NDArray[np.bool_],
    returning: bool,
) -> None:
    """Mark the basins of more random starts in the undecided cells of boxes; the others are of one basin.

    Of orbits that may come back the cells decide nothing: all are looked at.
    """
    stops = parted.blocks if returning else parted.labels
    for box, cell in _neighbours(parted.grid, middle):
        open_ones = np.flatnonzero(stops[cell] == codes.UNDECIDED)
        each = parts**parted.grid.dimension
        for some in np.array_split(open_ones, 1 + open_ones.size * each // BATCH):
            starts = starts_in(parted.grid, np.repeat(cell[some], each), rng)
            label, _ = follow(parted.graph, stops, *starts, steps, returning=returning)
            number = _numbers(parted, label)
            which = np.repeat(row[box[some]], each)
            here[which[number >= 0], number[number >= 0]] = True
