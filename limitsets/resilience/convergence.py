"""Convergence times: steps until an orbit is in the attracting cells, or has left.

Sampled on random starts, whose orbits may leave the domain and come back; and, where the images of cells are enclosed,
bounded for every start of the inner basin by the rank of its cell, the longest path to the attracting cells or out of
the domain, with the longest stays in the recurrent components on the way, each of which an orbit passes once.

Source: Datseris, Rossi, Wagemakers, "Framework for global stability analysis of dynamical systems", Chaos 33, 073151,
2023; ranks: docs/certificates.md.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.files import as_table, picked
from limitsets.graph import TransitionGraph
from limitsets.graph.components import ranks
from limitsets.maps import codes
from limitsets.resilience.colours import MOST_UNDECIDED, Colours, colours, told
from limitsets.resilience.orbits import STEPS, follow, random_starts
from limitsets.sets import Attractor
from limitsets.sets.passing import longest_stays
from limitsets.tables import Column, Table, Tabled, how_found

STARTS = 10_000


@dataclass(frozen=True)
class Times:
    """Steps to one attractor's cells, or out by one exit.

    Attributes
    ----------
    starts : int
        Random starts that came there.
    mean, median, longest : float
        Of their steps, from undecided cells too; nan if there are none, and where more than a tenth of all starts is
        still on its way: the slowest are missing.
    at_most : int or None
        Proved: no start of the inner basin takes more.  None without proof or where the inner basin is empty.
    mean_at_most : float or None
        Proved: the mean over the inner basin is at most this.
    """

    starts: int
    mean: float
    median: float
    longest: float
    at_most: int | None
    mean_at_most: float | None


@dataclass(frozen=True, eq=False)
class ConvergenceTimes(Tabled):
    """Steps to each attractor's cells, and out by each exit.

    Attributes
    ----------
    attractors : tuple of Times
        One for each attractor: 0 from within its cells.
    exits : dict of str to Times
        One for each exit: steps until an orbit that ends there first leaves, 1 from where one step leads out.
    undecided : float
        Share of the random starts still on their way after the last step.
    starts, steps : int
        Random starts, and the most steps that each was followed for.
    how : str
        "sampled": the times; what is `at_most` is proved.
    """

    attractors: tuple[Times, ...]
    exits: dict[str, Times]
    undecided: float
    starts: int
    steps: int
    how: str = "sampled"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        named = [*((f"attractor {k}", each) for k, each in enumerate(self.attractors)), *self.exits.items()]
        rows = [
            (name, each.starts, each.mean, each.median, each.longest, each.at_most, each.mean_at_most)
            for name, each in named
        ]
        means = (
            Column("mean", "steps", ".4g"),
            Column("median", "steps", ".4g"),
            Column("longest", "steps", ".4g"),
        )
        proved = ("at most, proved", Column("mean at most, proved", "steps", ".4g"))
        return (
            Table(
                ("to", "starts", *means, *proved),
                rows,
                told("Convergence times", self.undecided),
                how_found(self.how),
            ),
        )

    def to_json(self) -> dict[str, Any]:
        """Give the times as JSON takes them."""
        return as_table(**picked(self, "attractors", "exits", "undecided", "starts", "steps", "how"))


@arguments_checked
def convergence_times(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    *,
    starts: int = STARTS,
    steps: int = STEPS,
    seed: int = 0,
) -> ConvergenceTimes:
    """Count the steps that starts take to the attracting cells or out of the domain: sampled, and bounded by cells.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`; with method "boxes" there are proved bounds.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    starts : int
        Random starts, evenly by length (area, volume) over all sides.  Their orbits may leave the domain and come back.
    steps : int
        Each is followed for so many steps at most.
    seed : int
        Of the starts.

    Returns
    -------
    ConvergenceTimes
        They depend on the cells: finer attracting cells are entered later.

    Raises
    ------
    AnswerError
        For attractors of another graph, or a number of starts or steps below 1.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=1001), "boxes")
    >>> found = ls.resilience.convergence_times(graph, ls.attractors(graph, throws=100), starts=1000)
    >>> times = found.attractors[0]
    >>> times.median <= times.at_most
    True
    """
    parted = colours(graph, found)
    bounds = _bounds(parted)
    x, side = random_starts(graph.grid, starts, np.random.default_rng(seed))
    end, made = follow(graph, parted.blocks, x, side, steps, returning=True)
    undecided = float((end == codes.UNDECIDED).mean())
    times = []
    for code, bound in zip(parted.codes, bounds, strict=True):
        taken = made[end == code]
        mean, median, longest = (
            (float(taken.mean()), float(np.median(taken)), float(taken.max()))
            if taken.size and undecided <= MOST_UNDECIDED
            else (np.nan,) * 3
        )
        times.append(Times(taken.size, mean, median, longest, *bound))
    exits = dict(zip(graph.exits, times[len(found) :], strict=True))
    return ConvergenceTimes(tuple(times[: len(found)]), exits, undecided, starts, steps)


def _bounds(parted: Colours) -> list[tuple[int | None, float | None]]:
    """Bound the steps from each inner basin, at most and in the mean."""
    if not parted.proved:
        return [(None, None)] * parted.codes.size
    graph, parts = parted.graph, parted.graph.components()
    sets, attracting, stays = (
        graph.recurrent_components(),
        graph.condensation().attracting,
        longest_stays(graph),
    )
    settled = np.zeros(parts.count, dtype=bool)
    settled[[parts.label[cells[0]] for cells in itertools.compress(sets, attracting)]] = True
    # a rank falls with every step, but for those within a recurrent component, through which orbits pass
    rank = ranks(graph.ranges, parts, settled)
    within = np.array([parted.labels[cells[0]] for cells in sets], dtype=np.int64)
    bounds: list[tuple[int | None, float | None]] = []
    for number, code in enumerate(parted.codes):
        mask = parted.inner(number).mask
        if not mask.any():
            bounds.append((None, None))
            continue
        more = int((stays[(within == code) & (stays > 0)] - 1).sum()) + (0 if code >= 0 else 1)
        steps, weight = rank[mask] + np.where(parted.blocks[mask] == code, 0, more), parted.grid.measure[mask]
        bounds.append((int(steps.max()), float((steps * weight).sum() / weight.sum())))
    return bounds
