"""Attractors of a transition graph: extents (from cells), dynamics (from an orbit), cells that are too coarse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Column, Table, Tabled, arguments_checked, facts, how_found
from limitsets.systems.cells import CellSet
from limitsets.systems.graph import TransitionGraph, transitions
from limitsets.systems.maps import has_slope, lyapunov, orbit
from limitsets.systems.maps.growth import orbit_with_exponent
from limitsets.systems.maps.kernels import scattered

# ----------------------------------------------------------------
# Cells that are recurrent only because they are coarse.


# Refinements are tried from coarse to fine, and only up to this many cells in all.
MOST_CELLS = 4_000_000


def spurious(graph: TransitionGraph, parts: int = 8, **options: Any) -> tuple[CellSet, ...]:
    """Recurrent components in which nothing recurs once their cells are cut finer.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    parts : int
        Pieces per cell and axis; fewer are used where the finer graph would have more than four million cells.
    **options
        Of the image method, as given to `limitsets.transitions`.

    Returns
    -------
    tuple of CellSet
        One per component without a recurrent cell in the finer graph.  Those that remain are not thereby proved.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Logistic(1.4), ls.grid([(0, 1)], depth=10), method="corners-padded")
    >>> recurrent = ls.morse_graph(graph).number_of_nodes()
    >>> from limitsets.sets import spurious
    >>> 0 < len(spurious(graph)) < recurrent
    True
    """
    while parts > 2 and graph.n_cells * parts**graph.grid.dimension > MOST_CELLS:
        parts //= 2
    fine = transitions(graph.map, graph.grid.refine(parts), graph.method, **options)
    recurrent = fine.recurrent_set()
    components = [CellSet.of(graph.grid, np.asarray(cells)) for cells in graph.recurrent_components()]
    return tuple(cells for cells in components if not (cells.refined(fine.grid) & recurrent).mask.any())


# ----------------------------------------------------------------
# Attractors of a transition graph: their extents (from cells) and their dynamics (from one long orbit).


# Steps thrown away before anything is counted.
TRANSIENT = 1000


@dataclass(frozen=True, eq=False)
class Attractor(Tabled):
    """An attracting component of the transition graph.

    The cells contain the attractor as far as their sampled images can tell; what happens inside is counted on one
    orbit of `throws` steps from the middle of a cell.

    Attributes
    ----------
    cells : CellSet
        Its cells.
    extents : dict of int to list of (lo, hi)
        Per side the intervals they make up [length]; in more dimensions the boxes of their connected pieces, each a
        tuple with one (lo, hi) per axis (`CellSet.pieces`).
    flip_order : tuple of int, or None
        The sides in the cyclic order in which they are visited, beginning with the smallest; None where the order
        changes along the orbit.
    jogs_per_visit : dict of int to (int, int)
        Per side the least and the largest number of steps that stay on it between arriving and leaving; empty if
        the orbit never changes sides.
    flips_per_throw : float
        Share of the steps that change the side.
    lyapunov : float or None
        Largest Lyapunov exponent per step, None for a map without slopes.
    throws : int
        Steps that were counted.
    in_cells : float
        Share of the orbit's states in the cells: less than 1 shows cells that the images missed.
    stopped : str or None
        Why the orbit ended early: the exit it left by, or "stalled" where a step rounds away (`limitsets.orbit`).
    how : str
        "proved" where the transitions are (method "boxes"), "cells" where the images of cells are sampled.
    """

    cells: CellSet
    extents: dict[int, list[Any]]
    flip_order: tuple[int, ...] | None
    jogs_per_visit: dict[int, tuple[int, int]]
    flips_per_throw: float
    lyapunov: float | None
    throws: int
    in_cells: float
    stopped: str | None
    how: str = "cells"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        plane = self.cells.grid.dimension > 1
        rows = [
            (side, *(box if plane else [box]), self.jogs_per_visit.get(side))
            for side, boxes in sorted(self.extents.items())
            for box in boxes
        ]
        order = None if self.flip_order is None else " ".join(map(str, self.flip_order))
        of = {
            "flip order": order,
            "flips per throw": self.flips_per_throw,
            "Lyapunov exponent per throw": self.lyapunov,
            "throws": self.throws,
            "share of the orbit in the cells": self.in_cells,
            "stopped": self.stopped,
        }
        names = [f"x[{axis}]" for axis in range(self.cells.grid.dimension)] if plane else ["x"]
        spans = [Column(name, show=".6g", ends=True) for name in names]
        columns: tuple[Column | str, ...] = ("side", *spans, Column("jogs per visit", ends=True))
        return Table(columns, rows, "Attractor", how_found(self.how)), facts(
            "Its orbit", of, "sampled, not proved"
        )


def _visits(side: NDArray[np.int64]) -> tuple[tuple[int, ...] | None, dict[int, tuple[int, int]]]:
    """Cyclic order of the sides and steps per visit, of the visits that lie whole in the orbit."""
    change = np.flatnonzero(np.diff(side)) + 1
    if change.size == 0:
        return (int(side[0]),), {}
    sides, jogs = side[change], np.diff(change) - 1
    visited = sides[:-1]
    met, most = np.flatnonzero(np.bincount(visited)).tolist(), int(sides.max()) + 1
    per_side = {s: (int(jogs[visited == s].min()), int(jogs[visited == s].max())) for s in met}
    after: dict[int, set[int]] = {}
    for pair in np.flatnonzero(np.bincount(visited * most + sides[1:])).tolist():
        after.setdefault(pair // most, set()).add(pair % most)
    if not after or any(len(options) > 1 for options in after.values()):
        return None, per_side
    cycle = [min(after)]
    while (following := next(iter(after.get(cycle[-1], {cycle[0]})))) != cycle[0] and len(cycle) <= len(
        after
    ):
        cycle.append(following)
    return tuple(cycle), per_side


def _start(cells: CellSet) -> tuple[Any, int]:
    """Middle of the middle cell, and its side."""
    numbers = cells.numbers()
    lo, hi, side = cells.grid.corners(numbers[[numbers.size // 2]])
    middle = 0.5 * (lo[0] + hi[0])
    return (float(middle[0]) if middle.size == 1 else middle), int(side[0])


def _attractor(graph: TransitionGraph, cells: CellSet, throws: int) -> Attractor:
    x, side = _start(cells)
    exponent, domain = None, graph.grid.domain
    if has_slope(graph.map) and type(graph.map) not in scattered.methods:
        path, growth = orbit_with_exponent(graph.map, x, side, TRANSIENT, throws, domain=domain)
        exponent = growth.exponent
    else:
        path = orbit(graph.map, x, side, TRANSIENT + throws, domain=domain)
        if has_slope(graph.map):  # of the map without its scatter
            exponent = lyapunov(graph.map, x, side, throws, skip=TRANSIENT, domain=domain).exponent
    skip = min(TRANSIENT, path.code.size)
    sides, states = path.side[skip:], path.x[skip:]
    met = sum(int(cells.holds(states[sides == s], s).sum()) for s in range(graph.grid.sides))
    inside = met / sides.size
    extents: dict[int, list[Any]] = (
        dict(cells.extents()) if cells.grid.dimension == 1 else dict(cells.pieces())
    )
    order, jogs = _visits(sides)
    flips = float((np.diff(sides) != 0).mean()) if sides.size > 1 else 0.0
    return Attractor(
        cells,
        extents,
        order,
        jogs_per_visit=jogs,
        flips_per_throw=flips,
        lyapunov=exponent,
        throws=max(sides.size - 1, 0),
        in_cells=inside,
        stopped=path.stopped,
        how=graph.how,
    )


@arguments_checked
def attractors(graph: TransitionGraph, throws: int = 200_000) -> tuple[Attractor, ...]:
    """Attracting components: those from which no path leads elsewhere.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`.
    throws : int
        Length of the orbit on which what happens inside is counted.

    Returns
    -------
    tuple of Attractor
        In the order of the graph's components.  The ways out of the domain are attracting components to networkx;
        here they are not attractors but states of their own (`limitsets.basins`).

    Raises
    ------
    AnswerError
        For a number of throws below 1.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> found = ls.attractors(ls.transitions(scene.map, ls.grid(scene.domain, cells=4096)))
    >>> found[0].flip_order, found[0].jogs_per_visit[2]
    ((0, 1, 2), (3, 11))
    """
    if throws < 1:
        raise AnswerError("the number of throws", throws, "an integer from 1", "pass throws=200_000")
    sets = graph.attracting_sets()
    return tuple(_attractor(graph, CellSet.of(graph.grid, cells), throws) for cells in sets)
