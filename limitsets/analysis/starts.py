"""Comparison of the answer with a thousand orbits from random starts, which reveal attractors that cells missed.

In cells that are too coarse an attractor has an edge out and is not recognised.  Orbits that stay where no attractor
was found, or do not end where the label of their cell says, reveal it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from limitsets.graph import TransitionGraph
    from limitsets.sets import Attractor, Basins

# Starts, and throws after which they are looked at: most have come to an attractor by the first.
STARTS, THROWS = 1000, (100, 1000, 4000)


@dataclass(frozen=True)
class Starts:
    """Where random starts go, beside what the cells say.

    Attributes
    ----------
    count, throws : int
        Starts, by length over all sides, and the most throws that each was followed for.
    elsewhere : float
        Share that is still on the arm after them, and in no attractor that was found.
    contradicted : float
        Share that ended elsewhere than the label of its cell says.
    """

    count: int
    throws: int
    elsewhere: float
    contradicted: float

    @property
    def missed(self) -> float:
        """Share for which the cells have no answer, or a wrong one."""
        return self.elsewhere + self.contradicted

    @property
    def advice(self) -> str | None:
        """What is missing and what to do about it; None where all starts agree with the cells."""
        parts = []
        if self.elsewhere:
            parts.append(
                f"{100 * self.elsewhere:.3g} % of {self.count} random starts are still on the arm after {self.throws} "
                "throws, where no limit set was found: one is missing, or they are slow"
            )
        if self.contradicted:
            parts.append(
                f"{100 * self.contradicted:.3g} % of {self.count} random starts end elsewhere than their cells say"
            )
        return "; ".join(parts) + "; ask for more cells" if parts else None


def against_starts(graph: TransitionGraph, attractors: Sequence[Attractor], basins: Basins) -> Starts:
    """Throw a thousand random starts, the same ones each time, and compare.

    Parameters
    ----------
    graph : TransitionGraph
        Transitions of a scene's map.
    attractors : sequence of Attractor
        What was found in it.
    basins : Basins
        Their basins.

    Returns
    -------
    Starts
    """
    from limitsets.maps import advance, codes

    grid, rng = graph.grid, np.random.default_rng(0)
    length = grid.domain.hi[:, 0] - grid.domain.lo[:, 0]
    side = rng.choice(grid.sides, STARTS, p=length / length.sum())
    x = grid.domain.lo[side, 0] + rng.random(STARTS) * length[side]
    label = basins.labels[_cells(grid, x, side)]
    end = np.full(STARTS, codes.UNDECIDED)  # as long as a start is on the arm and in no attractor
    going, thrown = np.arange(STARTS), 0
    number = np.full(grid.n_cells + 1, codes.UNDECIDED)  # the last entry is for what lies in no cell
    for k, attractor in enumerate(attractors):
        number[:-1][attractor.cells.mask] = k
    for throws in THROWS:
        x[going], side[going], code, _ = advance(graph.map, x[going], side[going], throws - thrown)
        end[going] = np.where(code < 0, code, number[_cells(grid, x[going], side[going])])
        going, thrown = going[end[going] == codes.UNDECIDED], throws
    wrong = (label != codes.UNDECIDED) & (end != codes.UNDECIDED) & (label != end)
    return Starts(STARTS, THROWS[-1], going.size / STARTS, float(wrong.mean()))


def _cells(grid: Any, x: Any, side: Any) -> Any:
    found = np.full(x.size, -1)
    for s in range(grid.sides):
        found[side == s] = grid.index(x[side == s], s)
    return found
