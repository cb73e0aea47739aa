"""Basin stability: the share of all starts that come to an attractor.

Source: Menck, Heitzig, Marwan, Kurths, "How basin stability complements the linear-stability paradigm", Nature Physics
9, 2013; the interval of a sampled share: Clopper and Pearson, Biometrika 26, 1934.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.cells import CellSet
from limitsets.files import as_table, picked
from limitsets.graph import TransitionGraph
from limitsets.maps import codes
from limitsets.resilience.colours import ROUNDING, Colours, best, colours, told
from limitsets.resilience.orbits import STEPS, follow, leaves_by_the_border, random_starts
from limitsets.sets import Attractor
from limitsets.tables import Column, Table, Tabled, how_found

# A sampled share lies in its interval with this probability.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Share:
    """A share of the starts.

    Attributes
    ----------
    share : float
        The best number: that of the decided starts; nan where more than a tenth of all is undecided.
    lo, hi : float
        Its bracket.
    """

    share: float
    lo: float
    hi: float


@dataclass(frozen=True, eq=False)
class BasinStability(Tabled):
    """Shares of the basins, weighted by length (area, volume) over all sides.

    Attributes
    ----------
    how : str
        "proved": each bracket reaches from the inner to the outer basin; "cells": likewise, with images of cells that
        are sampled; "sampled": intervals of 95 % from random starts, those still on their way counted either way.
    attractors : tuple of Share
        One for each attractor.
    exits : dict of str to Share
        One for each exit.
    undecided : float
        Share of undecided cells; of random starts that came nowhere.
    starts : int or None
        Random starts, if any.
    cut : bool
        Whether orbits that cross the border of the domain were given up there, in the exit: with `starts` they may
        come back.
    inner, outer : tuple of CellSet
        Cells all of whose starts lie in the basin, and cells outside which none does: attractors, then exits.
    """

    how: str
    attractors: tuple[Share, ...]
    exits: dict[str, Share]
    undecided: float
    starts: int | None
    cut: bool
    inner: tuple[CellSet, ...]
    outer: tuple[CellSet, ...]

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        named = [*((f"attractor {k}", each) for k, each in enumerate(self.attractors)), *self.exits.items()]
        rows = [
            *((name, each.share, (each.lo, each.hi)) for name, each in named),
            ("undecided", self.undecided, None),
        ]
        columns = ("basin", Column("share", show=".6f"), Column("bracket", show=".6f", ends=True))
        return (Table(columns, rows, told("Basin stability", self.undecided, self.cut), how_found(self.how)),)

    def to_json(self) -> dict[str, Any]:
        """Give the shares as JSON takes them."""
        return as_table(**picked(self, "how", "attractors", "exits", "undecided", "starts", "cut"))


@arguments_checked
def basin_stability(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    *,
    starts: int | None = None,
    steps: int = STEPS,
    seed: int = 0,
) -> BasinStability:
    """Share of the starts that come to each attractor, or leave by each exit.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`; with method "boxes" the brackets are proved.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    starts : int, optional
        Sample so many random starts instead of counting cells.  Their orbits may leave the domain and come back.
    steps : int
        Each is followed for so many steps at most.
    seed : int
        Of the random starts.

    Returns
    -------
    BasinStability

    Raises
    ------
    AnswerError
        For attractors of another graph, or a number of starts or steps below 1.

    Notes
    -----
    Menck, Heitzig, Marwan, Kurths, Nature Physics 9, 2013.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.2, 1.2)], cells=1001), "boxes")
    >>> found = ls.resilience.basin_stability(graph, ls.attractors(graph, throws=100))
    >>> found.how, found.attractors[0].lo <= 0.5 <= found.attractors[0].hi, round(found.undecided, 3)
    ('proved', True, 0.001)
    """
    parted = colours(graph, found)
    inner = tuple(parted.inner(number) for number in range(parted.codes.size))
    outer = tuple(parted.outer(number) for number in range(parted.codes.size))
    if starts is None:
        shares, undecided, how = *_counted(parted, inner, outer), parted.how
    else:
        shares, undecided, how = *_sampled(parted, starts, steps, seed), "sampled"
    exits = dict(zip(graph.exits, shares[len(found) :], strict=True))
    cut = starts is None and leaves_by_the_border(graph)
    return BasinStability(how, tuple(shares[: len(found)]), exits, undecided, starts, cut, inner, outer)


def _counted(
    parted: Colours, inner: tuple[CellSet, ...], outer: tuple[CellSet, ...]
) -> tuple[list[Share], float]:
    total, undecided = float(parted.grid.measure.sum()), parted.basins.undecided_between
    shares = []
    for some, most in zip(inner, outer, strict=True):
        lo, hi = some.measure() / total, most.measure() / total
        share = best(min(lo / max(1.0 - undecided, 0.5), hi), undecided)
        down = lo - ROUNDING if 0 < len(some) < some.mask.size else float(len(some) > 0)
        up = hi + ROUNDING if 0 < len(most) < most.mask.size else float(len(most) > 0)
        shares.append(Share(share, max(down, 0.0), min(up, 1.0)))
    return shares, undecided


def _sampled(parted: Colours, starts: int, steps: int, seed: int) -> tuple[list[Share], float]:
    from scipy.special import betaincinv

    x, side = random_starts(parted.grid, starts, np.random.default_rng(seed))
    end, _ = follow(parted.graph, parted.blocks, x, side, steps, returning=True)
    undecided = int((end == codes.UNDECIDED).sum())
    shares = []
    for code in parted.codes:
        k = int((end == code).sum())
        most, tail = k + undecided, 0.5 * (1.0 - CONFIDENCE)
        lo = betaincinv(k, starts - k + 1, tail) if k else 0.0
        hi = betaincinv(most + 1, starts - most, 1.0 - tail) if most < starts else 1.0
        share = best(k / max(starts - undecided, 1), undecided / starts)
        shares.append(Share(share, float(lo), float(hi)))
    return shares, undecided / starts
