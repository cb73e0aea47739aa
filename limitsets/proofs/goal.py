"""The goal "beyond X every part lies on side S", asked of the attracting cells: proved by cells, refuted by an orbit.

A counterexample is found in floats by reachability, with kappa chosen at every throw where it may differ (random throws
miss it), and proved by replaying the orbit in intervals from a start in the attracting cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.goals import OrientedBeyond
from limitsets.maps import images, orbit
from limitsets.proofs.attraction import Attraction
from limitsets.proofs.replay import replay

__all__ = ["State", "counterexample", "exceptions"]

# Values of kappa tried at every throw where it may differ.
CHOICES = 33

# Throws from the start at which the search gives up.
MOST_THROWS = 2000

# Without a choice: throws of the orbit that is searched, and how many of the last are shown and replayed.
SEARCHED, SHOWN = 200_000, 20


def exceptions(proof: Attraction, goal: OrientedBeyond) -> NDArray[np.bool_]:
    """Attracting cells that reach beyond X on another side."""
    found = np.zeros(proof.component.size, dtype=bool)
    for side, (edges,) in enumerate(proof.cover.grid.edges):
        if side != goal.side:
            here = proof.cover.grid.of_side(side)
            found[here] = (proof.component[here] >= 0) & (edges[1:] > goal.x)
    return found


@dataclass(frozen=True)
class State:
    """One state of a counterexample.

    Attributes
    ----------
    lo, hi : float
        Enclosure of x.
    side : int
        The side.
    kappa : float or None
        Gravity over squared speed of the throw made from here; None for the last state.
    """

    lo: float
    hi: float
    side: int
    kappa: float | None


@dataclass(eq=False)
class _Reached:
    """States met so far, at most one per cell, with where each came from."""

    x: list[NDArray[np.float64]]
    side: list[NDArray[np.int64]]
    parent: list[NDArray[np.int64]]
    kappa: list[NDArray[np.float64]]

    def path(self, last: int) -> tuple[list[float], list[int], list[float]]:
        """States and throws from the start to state number `last`."""
        x, side = np.concatenate(self.x), np.concatenate(self.side)
        parent, kappa = np.concatenate(self.parent), np.concatenate(self.kappa)
        order = [last]
        while parent[order[-1]] >= 0:
            order.append(int(parent[order[-1]]))
        order.reverse()
        return x[order].tolist(), side[order].tolist(), kappa[order[1:]].tolist()


def _throws(proof: Attraction, x: Any, side: Any, choices: NDArray[np.float64]) -> tuple[Any, Any, Any, Any]:
    """Images of all states under all choices: x', side', number of the state, kappa."""
    found = []
    for kappa in choices.tolist():
        map_now = proof.cover.box.lo._replace(kappa=kappa)
        for s in np.unique(side).tolist():
            mine = np.flatnonzero(side == s)
            got = images(map_now, x[mine], s)
            good = got.code >= 0
            found.append((got.x[good], got.side[good], mine[good], np.full(int(good.sum()), kappa)))
    return tuple(np.concatenate(part) for part in zip(*found, strict=True))  # type: ignore[return-value]


def _search(proof: Attraction, goal: OrientedBeyond, choices: NDArray[np.float64]) -> Any:
    """Breadth first, one state per cell, until a state violates the goal by more than rounding."""
    grid: Grid = proof.cover.grid
    start = proof.cells.numbers()
    side = grid.side_of(start)
    x = np.concatenate([grid.centres(s)[start[side == s] - grid.offset[s]] for s in np.unique(side)])
    one = np.array([len(start) // 2])
    x, side = x[one], side[one]
    seen = np.zeros(grid.n_cells, dtype=bool)
    reached = _Reached([x], [side], [np.array([-1])], [np.array([np.nan])])
    first = 0
    for _ in range(MOST_THROWS):
        after, to, parent, kappa = _throws(proof, x, side, choices)
        bad = np.flatnonzero((after > goal.x * (1.0 + 1e-9)) & (to != goal.side))
        cells = np.full(after.size, -1)
        for s in np.unique(to).tolist():
            cells[to == s] = grid.index(after[to == s], s)
        if bad.size:
            keep = bad[np.argmax(after[bad])][None]
        else:
            new = np.flatnonzero((cells >= 0) & ~seen[cells])
            _, where = np.unique(cells[new], return_index=True)
            keep = new[where]
        if not keep.size:
            return None
        seen[cells[keep]] = True
        reached.x.append(after[keep])
        reached.side.append(to[keep])
        reached.parent.append(parent[keep] + first)
        reached.kappa.append(kappa[keep])
        first += x.size
        x, side = after[keep], to[keep]
        if bad.size:
            return reached.path(first)
    return None


def _long_orbit(proof: Attraction, goal: OrientedBeyond) -> Any:
    """Last throws of one long orbit of the exact scene up to the state that violates the goal first."""
    start = proof.cells.numbers()
    cell = int(start[start.size // 2])
    side = int(proof.cover.grid.side_of(cell))
    lo, hi = proof.cover.grid.boxes([cell], side)
    path = orbit(proof.cover.box.lo, 0.5 * float(lo[0, 0] + hi[0, 0]), side, SEARCHED)
    bad = np.flatnonzero((path.x > goal.x * (1.0 + 1e-9)) & (path.side != goal.side))
    bad = bad[bad > proof.max_rank]  # long in the attracting cells by then
    if not bad.size:
        return None
    k = int(bad[0])
    begin = k - min(SHOWN, k)
    return (
        path.x[begin : k + 1].tolist(),
        path.side[begin : k + 1].tolist(),
        [proof.cover.box.lo.kappa] * (k - begin),
    )


def counterexample(proof: Attraction, goal: OrientedBeyond) -> tuple[State, ...]:
    """Search for an orbit in the attracting cells that ends beyond X on another side, and prove it.

    Parameters
    ----------
    proof : Attraction
        Cells and images.
    goal : OrientedBeyond
        The goal.

    Returns
    -------
    tuple of State
        The orbit, enclosed; empty if the search finds none.
    """
    box = proof.cover.box
    narrow = not box.noise
    # a little inside the bounds, so that each choice is one of the noise's whatever the last digit
    ends = (box.lo.kappa, box.hi.kappa)
    margin = 1e-9 * (ends[1] - ends[0])
    choices = np.linspace(ends[0] + margin, ends[1] - margin, CHOICES)
    found = _long_orbit(proof, goal) if narrow else _search(proof, goal, choices)
    if found is None:
        return ()
    x, side, kappa = found
    bounds = np.array([ends] * len(kappa)).T if narrow else np.array([kappa, kappa])
    lo, hi, sides = replay(box, x[0], side[0], bounds)
    (cell,) = proof.cover.grid.index([x[0]], side[0])
    if lo.size < len(x) or not (lo[-1] > goal.x and sides[-1] != goal.side) or proof.component[cell] < 0:
        return ()
    return tuple(
        State(*state) for state in zip(lo.tolist(), hi.tolist(), sides.tolist(), [*kappa, None], strict=True)
    )
