"""Minimal fatal shock: the smallest push after which a state no longer comes to the same attractor.

The push changes x and keeps the side.  It is not fatal while x stays in cells of the inner basin, and fatal once x is
in a cell outside the outer basin, or beyond the border of the domain, where the cells end: a push that is cut off
there says so.  Of starts that are asked for the nearest one that comes elsewhere is sought, in ever smaller balls.

Source: Halekotte, Feudel, "Minimal fatal shocks in multistable complex networks", Scientific Reports 10, 11783, 2020;
Klinshov, Nekorkin, Kurths, "Stability threshold approach for complex dynamical systems", New J. Phys. 18, 2016.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.files import as_table, picked
from limitsets.graph import TransitionGraph
from limitsets.graph.target import Target
from limitsets.maps import codes
from limitsets.resilience.colours import ROUNDING, Colours, colours
from limitsets.resilience.orbits import STEPS, follow
from limitsets.sets import Attractor
from limitsets.tables import Column, Table, Tabled, how_found

# Without proofs the bracket is widened by so many cells at both ends.
CELLS = 2

# Starts are drawn in so many balls one within the other; then so many places on the line to the nearest fatal one.
BALLS, PLACES = 4, 1024

Floats = NDArray[np.float64]


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
    parted = colours(graph, found)
    state, cell = _place(parted, x, side)
    if starts is not None:
        return _sampled(parted, state, side, starts, steps, np.random.default_rng(seed))
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
    if parted.proved:
        least, far = least * (1.0 - ROUNDING), far * (1.0 + ROUNDING)
    else:
        width = CELLS * float(np.sqrt(((hi - lo) ** 2).sum(axis=1)).max())
        least, far = max(least - width, 0.0), far + width
    name = parted.names[int(np.flatnonzero(parted.codes == into)[0])]
    return FatalShock(least, far, parted.how, state, side, parted.names[own], where, name, cut)


def _place(parted: Colours, x: ArrayLike, side: int) -> tuple[Floats, int]:
    """Check a state; the state and its cell."""
    grid = parted.grid
    state = np.atleast_1d(np.asarray(x, dtype=np.float64))
    known = 0 <= side < grid.sides and state.shape == (grid.dimension,)
    cell = int(grid.index(state[None, :], side)[0]) if known else -1
    if cell < 0:
        raise AnswerError("the state", (x, side), "one in the domain of the grid", "pass x and side of one")
    return state, cell


def _sampled(
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
    return FatalShock(0.0, least, "sampled", state, side, names[int(own)], push, goes, into is None)


def _border(parted: Colours, state: Floats, side: int) -> list[tuple[float, float, Floats, int]]:
    """Distances to the border of the domain along each axis, at least and at most; the push, and the exit's code.

    Below its lower border a state has left for certain only at the anchor, if there is one (a_i of the throw).
    """
    domain, ways = parted.grid.domain, list(parted.graph.exits.values())
    target, found = Target.of(parted.grid, parted.graph.exits), []
    for axis, x in enumerate(state.tolist()):
        lo, hi = float(domain.lo[side, axis]), float(domain.hi[side, axis])
        foot = lo if domain.anchor is None else float(domain.anchor[side])
        for near, far, sink in ((lo, foot, target.sink_below), (hi, hi, target.sink_above)):
            push = np.zeros(state.size)
            push[axis] = far - x
            found.append((abs(near - x), abs(far - x), push, ways[sink]))
    return found
