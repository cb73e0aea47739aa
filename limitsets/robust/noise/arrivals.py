"""Distribution of the number of throws from a random start to the goal, by propagating the masses of the starts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Domain, Grid, grid
from limitsets.errors import GridError
from limitsets.robust.noise.absorbing import Absorption
from limitsets.robust.noise.boxcars import Array
from limitsets.robust.noise.ulam import Transfer

# Share of the starts that is still under way when counting ends.
UNDER_WAY = 1e-9
MOST_THROWS = 200_000


@dataclass(frozen=True, eq=False)
class Feeding:
    """Throws from a random start to the goal; an approximation between cells, not proved.

    Attributes
    ----------
    arrived : ndarray, shape (most throws + 1,)
        Share of the starts that are at the goal for the first time after that many throws.
    share : float
        Share of the starts that ever come to the goal.
    mean : float or None
        Mean number of throws of those that do; None where none does.
    ends : dict of str to float
        Where the starts end: "goal", closed classes that miss it, ways out.
    """

    arrived: Array
    share: float
    mean: float | None
    ends: dict[str, float]

    @property
    def survivors(self) -> Array:
        """Share of all starts that have not been at the goal after so many throws."""
        return np.maximum(1.0 - np.cumsum(self.arrived), 0.0)

    def quantile(self, share: float) -> int | None:
        """Throws after which `share` of all starts have been at the goal; None where so many never come to it."""
        reached = np.flatnonzero(np.cumsum(self.arrived) >= share)
        return int(reached[0]) if reached.size else None

    def crossing(self, share: float) -> float:
        """As `quantile`, interpolated between throws; nan where so many never come to it."""
        total = np.cumsum(self.arrived)
        k = self.quantile(share)
        if k is None:
            return float("nan")
        before = float(total[k - 1]) if k else 0.0
        return k - 1 + (share - before) / (float(total[k]) - before) if k else 0.0


def cells_for_noise(domain: Domain, cells: int) -> Grid:
    """Cut a domain into cells of equal width, for noise takes the part everywhere, and smaller ones next to the joint.

    Jogs are slow there: on equal cells alone 3.0 % of the starts of study 09's robust feeder are lost to the joint,
    where 2.1 % are.

    Parameters
    ----------
    domain : Domain
        What to cover.
    cells : int
        Cells of equal width per side; half as many graded ones are laid over them, so far as they are narrower.

    Returns
    -------
    Grid
        The cells.
    """
    plain = grid(domain, cells=cells, grading="uniform")
    if domain.anchor is None:
        return plain
    sides = []
    graded = grid(domain, cells=max(cells // 2, 1), grading="graded")
    for (equal,), (towards,) in zip(plain.edges, graded.edges, strict=True):
        narrower = towards[:-1][np.diff(towards) < equal[1] - equal[0]]
        sides.append((np.union1d(equal, narrower),))
    return Grid(domain, tuple(sides))


def with_border(grid: Grid, x: float) -> Grid:
    """Cut the cells of every side at x too, so that "beyond x" is a set of cells.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust.noise.arrivals import with_border
    >>> with_border(ls.grid([(0.0, 1.0)], cells=2), 0.75).edges[0][0]
    array([0.  , 0.5 , 0.75, 1.  ])
    """
    if grid.dimension != 1:
        raise GridError("the dimension of the grid", grid.dimension, "1", "places have no order in more")
    sides = []
    for (edges,) in grid.edges:
        near = np.abs(edges - x).min() <= 1e-9 * (edges[-1] - edges[0])
        outside = not edges[0] < x < edges[-1]
        sides.append((edges if near or outside else np.sort(np.append(edges, x)),))
    return Grid(grid.domain, tuple(sides))


def random_starts(grid: Grid, lo: NDArray[np.float64], hi: float) -> Array:
    """Masses of starts that lie anywhere from `lo[side]` to `hi`, equally likely per length on all sides."""
    parts = []
    for side, (edges,) in enumerate(grid.edges):
        overlap = np.minimum(edges[1:], hi) - np.maximum(edges[:-1], lo[side])
        parts.append(np.maximum(overlap, 0.0))
    masses = np.concatenate(parts)
    if not masses.sum() > 0.0:
        raise GridError("the range of the starts", (lo.tolist(), hi), "places on the arm", "move its ends")
    return masses / masses.sum()  # type: ignore[no-any-return]  # numpy types a quotient as Any


def feeding(chain: Transfer, ends: Absorption, starts: Array) -> Feeding:
    """Move the masses of the starts on until all but 1e-9 of those that come to the goal have arrived.

    Parameters
    ----------
    chain : Transfer
        The operator.
    ends : Absorption
        From `absorption` of the same operator and the goal.
    starts : ndarray, shape (n_cells,)
        Masses; they add up to 1.
    """
    chance = ends.probability["goal"]
    stopped = ends.goal | (chance <= 0.0)
    for cells in ends.classes:
        stopped[cells] = True
    masses = starts.copy()
    arrived = [float(masses[ends.goal].sum())]
    masses[stopped] = 0.0
    while float(masses @ chance) > UNDER_WAY and len(arrived) < MOST_THROWS:
        masses = chain.adjoint(masses)
        arrived.append(float(masses[ends.goal].sum()))
        masses[stopped] = 0.0
    share = min(float(starts @ chance), 1.0)
    known = np.where(np.isfinite(ends.mean), ends.mean, 0.0)
    mean = float(starts @ (known * chance)) / share if share > 0.0 else None
    return Feeding(
        np.array(arrived),
        share,
        mean,
        {name: float(starts @ found) for name, found in ends.probability.items()},
    )
