"""Whether an assumption is broken or holds, by enclosures of its number, at the states where it is asked."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.thrower.assumed_box import assumed
from limitsets.proofs.auditing.assumptions import Assumption, Terms
from limitsets.systems.maps import codes, orbit

if TYPE_CHECKING:
    from limitsets.feeder.scene import Scene
    from limitsets.proofs.prover.parameters import ParameterBox
    from limitsets.systems.cells import CellSet


# ----------------------------------------------------------------
# States at which assumptions are evaluated: cells that hold the limit set, orbits on it, and the whole domain.


Cells: TypeAlias = dict[int, tuple[Array, Array]]

# Cells per side for the proof; sampled where the map has effects on.
CELLS, SAMPLED_CELLS = 2048, 4096
# Steps of an orbit before it is taken to be on the limit set, and those counted.
TRANSIENT, THROWS = 1000, 20_000
# Samples of a side of the domain.
SAMPLES = 4096


@dataclass(frozen=True, eq=False)
class Sample:
    """Throws on one side at which assumptions are evaluated.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Where they start, ascending on the domain [length].
    code : ndarray of int, shape (n,)
        Branch of each throw (`limitsets.systems.maps.codes`); empty where it is not needed.
    """

    x: Array
    code: Ints


@dataclass(frozen=True, eq=False)
class Places:
    """Cells and throws at which assumptions are evaluated.

    Attributes
    ----------
    limit_cells, domain_cells : dict of int to (ndarray, ndarray)
        Per side the lower and upper ends of cells.
    enclosed : bool
        Whether the cells are proved to hold the limit set.
    orbits, domain : dict of int to Sample
        Per side throws of long orbits on the limit set, and samples of the domain.
    extents : dict of int to list of (lo, hi)
        The cells of the limit set, put together.
    """

    limit_cells: Cells
    domain_cells: Cells
    enclosed: bool
    orbits: dict[int, Sample]
    domain: dict[int, Sample]
    extents: dict[int, list[tuple[float, float]]]


def _cells_of(attracting: CellSet) -> Cells:
    cells = {}
    for side, (edges,) in enumerate(attracting.grid.edges):
        here = np.flatnonzero(attracting.mask[attracting.grid.of_side(side)])
        if here.size:
            cells[side] = (edges[here], edges[here + 1])
    return cells


def _limit_sets(scene: Scene, box: ParameterBox) -> tuple[list[CellSet], Cells, bool]:
    """Attracting cells, one set per component; the cells of the domain; whether they are proved to hold the limit set.

    The enclosed images are those of the minimal map: with effects on, or where no cells are proved to attract, the
    cells come from sampled images.
    """
    from limitsets.proofs.prover.attraction import attraction
    from limitsets.proofs.prover.cover import cover
    from limitsets.systems.cells import CellSet, grid
    from limitsets.systems.graph import transitions
    from limitsets.systems.sets import attractors

    covered = cover(box, CELLS)
    domain = {
        side: (edges[:-1], edges[1:]) for side, (edges,) in enumerate(covered.grid.edges) if edges.size > 1
    }
    if not scene.effects.on():
        attracting = attraction(covered)
        sets = [
            CellSet(covered.grid, attracting.component == k)
            for k in range(int(attracting.component.max()) + 1)
        ]
        if sets:
            return sets, domain, True
    graph = transitions(scene.map, grid(scene.domain, cells=SAMPLED_CELLS))
    return [each.cells for each in attractors(graph, throws=1)], domain, False


def _throws(scene: Scene, cells: CellSet) -> tuple[Array, Ints, Ints]:
    """Throws of an orbit from the middle of the middle cell, once it is on the limit set."""
    numbers = cells.numbers()
    middle = int(numbers[numbers.size // 2])
    side = int(cells.grid.side_of(middle))
    lo, hi = cells.grid.boxes(np.array([middle]), side)
    path = orbit(scene.map, 0.5 * float(lo[0, 0] + hi[0, 0]), side, TRANSIENT + THROWS)
    made = path.code.size
    on = slice(min(TRANSIENT, made), made)
    return path.x[on], path.side[on], path.code[on]


def _orbits(scene: Scene, sets: list[CellSet]) -> dict[int, Sample]:
    if not sets:
        return {}
    x, side, code = map(np.concatenate, zip(*(_throws(scene, cells) for cells in sets), strict=True))
    return {k: Sample(x[side == k], code[side == k]) for k in np.unique(side).tolist()}


def places(scene: Scene, box: ParameterBox) -> Places:
    """Collect the cells and throws at which assumptions are evaluated.

    Parameters
    ----------
    scene : Scene
        The scene.
    box : ParameterBox
        Its parameters.

    Returns
    -------
    Places
    """
    sets, domain_cells, enclosed = _limit_sets(scene, box)
    union = reduce(or_, sets) if sets else None
    limit = {} if union is None else _cells_of(union)
    lo, hi = scene.domain.lo[:, 0], scene.domain.hi[:, 0]
    domain = {
        side: Sample(np.linspace(lo[side], hi[side], SAMPLES), np.full(SAMPLES, codes.UNDECIDED))
        for side in np.flatnonzero(scene.sides.rests).tolist()
    }
    extents = {} if union is None else union.extents()
    return Places(limit, domain_cells, enclosed, _orbits(scene, sets), domain, extents)


# ----------------------------------------------------------------
# Decide by enclosures of its number whether an assumption is broken or holds.


# A cell on which an assumption is not proved is halved so many times, while there are no more than so many cells.
HALVINGS, MOST_CELLS = 10, 200_000


class Row:
    """One assumption with the facts of a scene."""

    def __init__(self, about: Assumption, terms: Terms) -> None:
        self.about, self.terms = about, terms

    def limit(self, side: int) -> float:
        """Give the limit on a side, nan where a fact is missing."""
        limit = self.terms.limit
        return math.nan if limit is None else float(limit[side] if isinstance(limit, np.ndarray) else limit)

    def values(self, enclosed: Array) -> Array:
        """Both ends of the number, widened by the rounding of scale and offset."""
        pair: Array = enclosed[:, self.about.column]
        scale, offset = self.terms.scale, self.terms.offset
        if scale == 1.0 and offset == 0.0:
            return pair
        pair = np.where(np.isfinite(pair), scale * pair + offset, pair)
        ends = np.array([-np.inf, np.inf])
        wider: Array = np.nextafter(np.nextafter(pair, ends), ends)
        return wider

    def reached(self, enclosed: Array) -> Array:
        """Give the value that is certainly reached: the end of the enclosure that breaks the limit least."""
        return self.values(enclosed)[:, 0 if self.about.below else 1]

    def broken(self, enclosed: Array, side: int) -> Mask:
        """Whether the assumption is proved to be broken; never where a fact is missing."""
        reached = self.reached(enclosed)
        beyond = reached > self.limit(side) if self.about.below else reached < self.limit(side)
        # no value of a missing fact is enough
        hopeless = np.isposinf(reached) if self.about.below else np.isneginf(reached)
        return beyond | (hopeless & (self.terms.limit is None))

    def kept(self, enclosed: Array, side: int) -> Mask:
        """Whether the assumption is proved to hold."""
        values = self.values(enclosed)
        return values[:, 1] <= self.limit(side) if self.about.below else values[:, 0] >= self.limit(side)

    def spare(self, enclosed: Array, side: int) -> Array:
        """Give the distance of the number from its limit, to the width of the enclosures; below 0 beyond the limit."""
        inside: Array = (self.limit(side) - self.values(enclosed).mean(axis=1)) * (
            1 if self.about.below else -1
        )
        return inside


def enclosed_at(box: ParameterBox, side: int, x: Array) -> Array:
    """Enclose everything at single throws."""
    return assumed(*box.bare, side, x, x)


def all_hold(box: ParameterBox, cells: Cells, rows: list[Row]) -> list[bool]:
    """Whether each assumption is proved to hold on all cells, halving those on which it is not."""
    open_rows = np.ones(len(rows), dtype=bool)
    for side, (lo, hi) in cells.items() if rows else ():
        needed = np.tile(open_rows, (lo.size, 1))
        for halving in range(HALVINGS + 1):
            enclosed = assumed(*box.bare, side, lo, hi)
            kept = np.stack([row.kept(enclosed, side) for row in rows], axis=1)
            needed &= ~kept & open_rows
            again = needed.any(axis=1)
            if not again.any():
                break
            if halving == HALVINGS or 2 * int(again.sum()) > MOST_CELLS:
                open_rows &= ~needed.any(axis=0)
                break
            lo, hi, needed = lo[again], hi[again], np.repeat(needed[again], 2, axis=0)
            middle = lo + 0.5 * (hi - lo)
            lo, hi = np.stack([lo, middle], axis=1).ravel(), np.stack([middle, hi], axis=1).ravel()
    return open_rows.tolist()


# ----------------------------------------------------------------
# Intervals of a side on which a condition holds.


def where(true: Callable[[Array], Mask], x: Array, seen: Mask | None = None) -> list[tuple[float, float]]:
    """Intervals on which a condition holds, seen at samples, their ends bisected down to adjacent floats.

    Parameters
    ----------
    true : callable
        The condition, of many places at once.
    x : ndarray, shape (n,)
        Samples [length], ascending; a narrower interval between two of them may be missed.
    seen : ndarray of bool, shape (n,), optional
        The condition at the samples, where that is known.

    Examples
    --------
    >>> import numpy as np
    >>> [(lo, round(hi, 9)) for lo, hi in where(lambda x: x * x < 2.0, np.linspace(0.0, 2.0, 5))]
    [(0.0, 1.414213562)]
    """
    seen = true(x) if seen is None else seen
    changes = np.flatnonzero(seen[1:] != seen[:-1])
    lo, hi, before = x[changes], x[changes + 1], seen[changes]
    while True:
        middle = lo + 0.5 * (hi - lo)
        if not ((middle > lo) & (middle < hi)).any():
            break
        same = true(middle) == before
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    # The end of a true stretch is the last float where the condition holds.
    ends = np.where(before, lo, hi).tolist()
    if seen[0]:
        ends.insert(0, float(x[0]))
    if seen[-1]:
        ends.append(float(x[-1]))
    return list(zip(ends[::2], ends[1::2], strict=True))
