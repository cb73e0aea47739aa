"""How stable a basin is: the share of starts in it, steps until they arrive, and the smallest push out of it.

Source: Menck, Heitzig, Marwan, Kurths, "How basin stability complements the linear-stability paradigm", Nature Physics
9, 2013; the interval of a sampled share: Clopper and Pearson, Biometrika 26, 1934.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.base import AnswerError, Column, Table, Tabled, arguments_checked, as_table, how_found, picked
from limitsets.systems.cells import CellSet
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.components import ranks
from limitsets.systems.graph.target import Target
from limitsets.systems.maps import codes
from limitsets.systems.resilience.orbits import (
    MOST_UNDECIDED,
    ROUNDING,
    STEPS,
    Colours,
    Floats,
    best,
    colours,
    follow,
    full_caption,
    leaves_by_the_border,
    random_cells,
)
from limitsets.systems.sets import Attractor
from limitsets.systems.sets.basin import longest_stays

# ----------------------------------------------------------------
# Convergence times: steps until an orbit is in the attracting cells, or has left.
#
# Sampled on random starts, whose orbits may leave the domain and come back; and, where the images of cells are
# enclosed, bounded for every start of the inner basin by the rank of its cell, the longest path to the attracting
# cells or out of the domain, with the longest stays in the recurrent components on the way, each of which an orbit
# passes once.
#
# Source: Datseris, Rossi, Wagemakers, "Framework for global stability analysis of dynamical systems", Chaos 33, 073151,
# 2023; ranks: docs/certificates.md.


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
                full_caption("Convergence times", self.undecided),
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
    _, (x, side) = random_cells(graph.grid, starts, np.random.default_rng(seed))
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
    if parted.how != "proved":
        return [(None, None)] * parted.codes.size
    graph, parts = parted.graph, parted.graph.components()
    sets, stays = graph.recurrent_components(), longest_stays(graph)
    settled = np.zeros(parts.count, dtype=bool)
    settled[[parts.label[cells[0]] for cells in graph.attracting_sets()]] = True
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


# ----------------------------------------------------------------
# Basin stability: the share of all starts that come to an attractor.


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
        return (
            Table(
                columns, rows, full_caption("Basin stability", self.undecided, self.cut), how_found(self.how)
            ),
        )

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
    return BasinStability(
        how,
        tuple(shares[: len(found)]),
        exits,
        undecided=undecided,
        starts=starts,
        cut=cut,
        inner=inner,
        outer=outer,
    )


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

    _, (x, side) = random_cells(parted.grid, starts, np.random.default_rng(seed))
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


# ----------------------------------------------------------------
# Minimal fatal shock: the smallest push after which a state no longer comes to the same attractor.
#
# The push changes x and keeps the side.  It is not fatal while x stays in cells of the inner basin, and fatal once x is
# in a cell outside the outer basin, or beyond the border of the domain, where the cells end: a push that is cut off
# there says so.  Of starts that are asked for the nearest one that comes elsewhere is sought, in ever smaller balls.
#
# Source: Halekotte, Feudel, "Minimal fatal shocks in multistable complex networks", Scientific Reports 10, 11783, 2020;
# Klinshov, Nekorkin, Kurths, "Stability threshold approach for complex dynamical systems", New J. Phys. 18, 2016.


# Without proofs the bracket is widened by so many cells at both ends.
CELLS = 2

# Starts are drawn in so many balls one within the other; then so many places on the line to the nearest fatal one.
BALLS, PLACES = 4, 1024


@dataclass(frozen=True, eq=False)
class FatalShock(Tabled):
    """The smallest fatal push of a state.

    Attributes
    ----------
    lo, hi : float
        No push smaller than `lo` is fatal; some pushes hardly larger than `hi` are [length].  Of starts `lo` is 0, for
        no number of them excludes a smaller push, and `hi` infinite where none was fatal.
    how : str
        "proved"; "cells" where images of cells are sampled: the bracket is then widened by two cells at both ends;
        "sampled" from starts.
    x, side : ndarray of shape (dimension,), int
        The state.
    basin : int or str
        Where it comes to: number of the attractor, or name of the exit.
    shock : ndarray, shape (dimension,)
        The push to the nearest place known to be fatal, in the map's unit; nan without one.
    into : int or str or None
        Where the nearest decided place that is fatal leads to.
    cut : bool
        Whether the border of the domain cuts the push off: `hi` is the distance to it, and beyond it nothing is known;
        of starts, that none within it was fatal.
    """

    lo: float
    hi: float
    how: str
    x: Floats
    side: int
    basin: int | str
    shock: Floats
    into: int | str | None
    cut: bool = False

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        row = (str(self.basin), (self.lo, self.hi), None if self.into is None else str(self.into))
        columns = ("basin", Column("smallest fatal push", show=".6g", ends=True), "into")
        caption = "Smallest fatal shock"
        if self.cut:
            caption += "; cut off by the border of the domain, beyond which nothing is known"
        return (Table(columns, [row], caption, how_found(self.how)),)

    def to_json(self) -> dict[str, Any]:
        """Give the shock as JSON takes it."""
        return as_table(**picked(self, "lo", "hi", "how", "x", "side", "basin", "shock", "into", "cut"))


@arguments_checked
def minimal_fatal_shock(
    graph: TransitionGraph,
    found: tuple[Attractor, ...],
    x: ArrayLike,
    side: int = 0,
    *,
    starts: int | None = None,
    steps: int = STEPS,
    seed: int = 0,
) -> FatalShock:
    """Bracket the smallest push in x, on the same side, that takes a state out of its basin.

    Parameters
    ----------
    graph : TransitionGraph
        From `limitsets.transitions`; with method "boxes" the bracket is proved.
    found : tuple of Attractor
        From `limitsets.attractors` of the same graph.
    x : float, or array_like of shape (dimension,)
        The state [length].
    side : int
        Its side.
    starts : int, optional
        Follow so many random pushed states instead of asking cells.  Their orbits may leave the domain and come back.
    steps : int
        Each is followed for so many steps at most.
    seed : int
        Of the pushed states.

    Returns
    -------
    FatalShock
        In more than one dimension by the Euclidean norm.

    Raises
    ------
    AnswerError
        For attractors of another graph, a state outside the domain or undecided, or a number of starts or steps below
        1.

    Notes
    -----
    Halekotte, Feudel, Scientific Reports 10, 11783, 2020.  Beyond the border of the domain a state counts as having
    left, and `cut` says where this makes the number: choose the domain of a map that has none of its own large enough.

    Examples
    --------
    >>> import limitsets as ls
    >>> graph = ls.transitions(ls.maps.Cubic(1.5), ls.grid([(-1.5, 1.5)], cells=10_000), "boxes")
    >>> found = ls.resilience.minimal_fatal_shock(graph, ls.attractors(graph, throws=100), 0.5**0.5)
    >>> found.how, found.lo <= 1.5**0.5 - 0.5**0.5 <= found.hi, round(found.hi - found.lo, 2)
    ('proved', True, 0.0)
    """
    graph.grid.domain.require_ends("the grid of minimal_fatal_shock")
    parted = colours(graph, found)
    state, cell = _place(parted, x, side)
    if starts is not None:
        return _sampled_pushes(parted, state, side, starts, steps, np.random.default_rng(seed))
    if parted.labels[cell] == codes.UNDECIDED:
        raise AnswerError(
            "the state",
            (x, side),
            "one in a cell that is decided",
            "ask for finer cells, or pass starts=10000",
        )
    own = int(np.flatnonzero(parted.codes == parted.labels[cell])[0])
    here, number = graph.grid.of_side(side), np.arange(graph.grid.n_cells)[graph.grid.of_side(side)]
    lo, hi = graph.grid.boxes(number, side)
    push = np.clip(state, lo, hi) - state
    distance = np.sqrt((push**2).sum(axis=1))
    safe, fatal = parted.inner(own).mask[here], ~parted.outer(own).mask[here]
    border = _border(parted, state, side)
    least = min(float(distance[~safe].min(initial=np.inf)), *(near for near, *_ in border))
    far, where, into = min(((far, push, code) for _, far, push, code in border), key=lambda each: each[0])
    decided, beyond = parted.labels[here] != codes.UNDECIDED, far
    if fatal.any():
        nearest = int(np.flatnonzero(fatal)[distance[fatal].argmin()])
        if distance[nearest] <= far:
            far, where = float(distance[nearest]), push[nearest]
    if (fatal & decided).any():
        nearest = int(np.flatnonzero(fatal & decided)[distance[fatal & decided].argmin()])
        into = int(parted.labels[number[nearest]]) if distance[nearest] <= beyond else into
    cut = far == beyond and graph.grid.domain.anchor is None
    if parted.how == "proved":
        least, far = least * (1.0 - ROUNDING), far * (1.0 + ROUNDING)
    else:
        width = CELLS * float(np.sqrt(((hi - lo) ** 2).sum(axis=1)).max())
        least, far = max(least - width, 0.0), far + width
    name = parted.names[int(np.flatnonzero(parted.codes == into)[0])]
    return FatalShock(
        least, far, parted.how, x=state, side=side, basin=parted.names[own], shock=where, into=name, cut=cut
    )


def _place(parted: Colours, x: ArrayLike, side: int) -> tuple[Floats, int]:
    """Check a state; the state and its cell."""
    grid = parted.grid
    state = np.atleast_1d(np.asarray(x, dtype=np.float64))
    known = 0 <= side < grid.sides and state.shape == (grid.dimension,)
    cell = int(grid.index(state[None, :], side)[0]) if known else -1
    if cell < 0:
        raise AnswerError("the state", (x, side), "one in the domain of the grid", "pass x and side of one")
    return state, cell


def _sampled_pushes(
    parted: Colours, state: Floats, side: int, starts: int, steps: int, rng: np.random.Generator
) -> FatalShock:
    """Seek the nearest start that comes elsewhere, in balls about the state, then on the line to it."""
    if starts < 1:
        raise AnswerError("the number of starts", starts, "an integer from 1", "pass starts=10000")

    def ends(x: Floats) -> NDArray[np.int64]:
        return follow(parted.graph, parted.blocks, x, np.full(len(x), side), steps, returning=True)[0]

    (own,) = ends(state[None, :])
    if own == codes.UNDECIDED:
        raise AnswerError("the state", state.tolist(), "one that comes to an end", "pass more steps=")
    lo, hi = parted.grid.domain.lo[side], parted.grid.domain.hi[side]
    push, least, into = np.full(state.size, np.nan), np.inf, None
    for drawing in range(BALLS + 1):
        if drawing < BALLS:
            low, high = np.maximum(lo, state - least), np.minimum(hi, state + least)
            x = low + rng.random((-(-starts // BALLS), state.size)) * (high - low)
        elif into is None:
            break
        else:
            x = state + np.arange(1, PLACES)[:, None] / PLACES * push
        distance, label = np.sqrt(((x - state) ** 2).sum(axis=1)), ends(x)
        distance[(label == own) | (label == codes.UNDECIDED)] = np.inf
        nearest = int(distance.argmin())
        if distance[nearest] < least:
            push, least, into = x[nearest] - state, float(distance[nearest]), int(label[nearest])
    names = dict(zip(parted.codes.tolist(), parted.names, strict=True))
    goes = None if into is None else names[into]
    return FatalShock(
        0.0,
        least,
        "sampled",
        x=state,
        side=side,
        basin=names[int(own)],
        shock=push,
        into=goes,
        cut=into is None,
    )


def _border(parted: Colours, state: Floats, side: int) -> list[tuple[float, float, Floats, int]]:
    """Distances to the border of the domain along each axis, at least and at most; the push, and the exit's code.

    Below its lower border a state has left for certain only at the anchor, if there is one (a_i of the throw).
    """
    domain, ways = parted.grid.domain, list(parted.graph.exits.values())
    target, shocks = Target.of(parted.grid, parted.graph.exits), []
    for axis, x in enumerate(state.tolist()):
        lo, hi = float(domain.lo[side, axis]), float(domain.hi[side, axis])
        foot = lo if domain.anchor is None else float(domain.anchor[side])
        for near, far, sink in ((lo, foot, target.sink_below), (hi, hi, target.sink_above)):
            push = np.zeros(state.size)
            push[axis] = far - x
            shocks.append((abs(near - x), abs(far - x), push, ways[sink]))
    return shocks
