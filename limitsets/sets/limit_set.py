"""A limit set by its end points: the intersection of all forward images of the attracting cells.

In one dimension the attracting cells N are intervals, and F(N), F(F(N)), ... are computed from end points alone
(`limitsets.sets.interval_map`).  Where the map expands, every end soon becomes a forward image of the one-sided limit
at a point inside the limit set, where the map changes its branch or turns; it then no longer moves, and is known to
the last digits.  Where the map contracts, the ends close in geometrically.

An end that still comes from the border of N is told apart from the others: it marks a fixed border, a point that
attracts, or a set N that was chosen too large.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple, Protocol

import numpy as np

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError, shown
from limitsets.graph.graph import TransitionGraph
from limitsets.graph.morse import morse_graph
from limitsets.maps.contract import kind_of
from limitsets.maps.critical import Sides
from limitsets.sets.bottleneck import in_bottleneck
from limitsets.sets.interval_map import IntervalMap
from limitsets.sets.unions import Extents, Track, Union, read, same
from limitsets.tables import Column, Table, Tabled, bands_of

# Near a_i of the throw an orbit takes some 1200 throws to get away from 1e-9 of the arm; beyond this the map is no
# longer expanding there and a set that still moves is said to move.
MOST_ITERATIONS = 20_000


class HasExtents(Protocol):
    """An answer that knows its intervals per side, such as an attractor or a set of cells."""

    @property
    def extents(self) -> Extents:
        """Intervals by side."""


class Origin(NamedTuple):
    """Where an end of the limit set comes from; as text, one line for a report.

    Attributes
    ----------
    kind : str
        "critical" (the map changes its branch at `x`), "turning", "jump", "exit" or "domain" (the map ends there), or
        "border of N" for an end that no such point has replaced.
    side, x : int, float
        Where its orbit begins.
    branches : tuple of str
        The steps from there to the end; the first is the branch of the one-sided limit.  Empty for "border of N".
    """

    kind: str
    side: int
    x: float
    branches: tuple[str, ...]

    def __str__(self) -> str:
        words = {"critical": "critical point", "turning": "turning point", "domain": "border of the domain"}
        start = f"{words.get(self.kind, self.kind)} x = {self.x:.9g} on side {self.side}"
        runs = [(name, len(list(run))) for name, run in groupby(self.branches)]
        return ", ".join([start, *(name if count == 1 else f"{name} x {count}" for name, count in runs)])


@dataclass(frozen=True)
class End:
    """One end of one interval of a limit set.

    Attributes
    ----------
    side : int
        Its side.
    x : float
        Where it is.
    which : str
        "lo" or "hi".
    origin : Origin
        Where it comes from.
    error : float
        Estimate of what rounding did to `x`: the error of the critical point and of each step, times the slopes of
        the steps that follow.
    """

    side: int
    x: float
    which: str
    origin: Origin
    error: float


@dataclass(frozen=True)
class LimitSet(Tabled):
    """A limit set as intervals per side.

    Attributes
    ----------
    extents : dict of int to list of (lo, hi)
        The intervals, ascending; a side without any is left out.
    ends : tuple of End
        Their ends in the same order.
    iterations : int
        How many images were taken.
    converged : bool
        Whether the ends no longer move.
    leaves : bool
        Whether part of some image left the domain; that part was dropped.
    advice : str or None
        What to do where `converged` is False or `leaves` is True.
    """

    extents: dict[int, list[tuple[float, float]]]
    ends: tuple[End, ...]
    iterations: int
    converged: bool
    leaves: bool
    advice: str | None

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [(end.side, end.which, end.x, end.error, str(end.origin)) for end in self.ends]
        columns = ("side", "end", Column("x", show=".9g"), Column("error", show=".1e"), "image of")
        bands = Table(("side", Column("x", show=".6g", ends=True)), bands_of(self.extents), "Limit set")
        return Table(columns, rows, "Ends of the limit set", "computed, not proved"), bands


def _origin(names: tuple[str, ...], track: Track) -> Origin:
    branches: list[str] = []
    path = track.path
    while path is not None:
        path, branch = path
        branches.append(names[branch])
    return Origin(track.kind, track.side, track.start, tuple(reversed(branches)))


def ends_of(names: tuple[str, ...], union: Union) -> tuple[End, ...]:
    """Give the ends of a union of intervals with their origins; `names` are those of the map's branches."""
    return tuple(
        End(side, end.x, which, _origin(names, end), end.error)
        for side, intervals in union.items()
        for interval in intervals
        for which, end in zip(("lo", "hi"), interval, strict=True)
    )


def _advice(converged: bool, crept: bool, leaves: bool, count: int) -> str | None:
    if crept:
        return "an end creeps on by less than the tolerance with no fixed point near: follow it with orbit"
    if not converged:
        return f"the ends still move after {count} images: start from one attractor, or raise most_iterations"
    if leaves:
        return "part of the set left the domain and was dropped: start from attracting cells, or enlarge the domain"
    return None


def limit_set_of(
    params: Any,
    extents: Extents,
    domain: Sides,
    *,
    tolerance: float = 1e-12,
    most_iterations: int = MOST_ITERATIONS,
) -> LimitSet:
    """Intersect the forward images of a set of intervals; see `limit_set`.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with `image_on`.
    extents : mapping of int to iterable of (lo, hi)
        The set N to start from, per side: attracting, that is, F(N) in N up to what later images drop.
    domain : Domain
        Where the map is looked at; what leaves it is dropped.
    tolerance : float
        The ends are taken to rest when two images in turn move none of them by more, relative to its size or to the
        extent of the largest side, whichever is larger.
    most_iterations : int
        Images after which to give up.

    Returns
    -------
    LimitSet

    Raises
    ------
    AnswerError
        For a map of more dimensions or without `image_on`, or a set without intervals in the domain.

    Notes
    -----
    The map is read as the closed relation that takes both one-sided limits at a change of branch.  N may be larger
    than the limit set, as long as what it holds beside it goes to the limit set too: the border of N then moves in
    with every image until nothing of it is left.  Source: docs/model.md, limit sets.

    Examples
    --------
    >>> from limitsets import maps
    >>> from limitsets.cells import as_domain
    >>> from limitsets.sets import limit_set_of
    >>> band = limit_set_of(maps.Logistic(3.9), {0: [(0.05, 0.99)]}, as_domain([(0, 1)]))
    >>> band.extents[0]  # F(F(1/2)) and F(1/2)
    [(0.0950625, 0.975)]
    >>> print(band.ends[0].origin)
    critical point x = 0.5 on side 0, left, right
    """
    forward = IntervalMap(params, domain)
    union = read(extents, domain)
    scale = float(np.max(domain.hi - domain.lo))
    rested, count, leaves = 0, 0, False
    while rested < 2 and count < most_iterations and union:
        image, out = forward.image(union)
        rested = rested + 1 if same(union, image, tolerance, scale) else 0
        union, count, leaves = image, count + 1, leaves or out
    crept = rested == 2 and in_bottleneck(params, union, tolerance, scale)
    converged = rested == 2 and not crept
    return LimitSet(
        {side: [(lo.x, hi.x) for lo, hi in intervals] for side, intervals in union.items()},
        ends_of(kind_of(params).branches, union),
        count,
        converged,
        leaves,
        _advice(converged, crept, leaves, count),
    )


@arguments_checked
def limit_set(
    graph: TransitionGraph, attractor: HasExtents | None = None, tolerance: float = 1e-12
) -> LimitSet:
    """Find the end points of a limit set to almost the last digit.

    Parameters
    ----------
    graph : TransitionGraph
        Transitions of a one-dimensional map.
    attractor : Attractor, optional
        Which one; needed where there are several.  Its `extents` are the set to start from.
    tolerance : float
        The ends rest when two images in turn move none of them by more, relative to its size or to the extent of the
        largest side, whichever is larger.

    Returns
    -------
    LimitSet
        Intervals, and for each end where it comes from.

    Raises
    ------
    AnswerError
        For a map of more dimensions or without `image_on`, or where it is not clear which attractor is meant.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> found = ls.limit_set(ls.transitions(scene.map, ls.grid(scene.domain, cells=4096)))
    >>> [round(x, 6) for x in found.extents[0][0]]
    [15.205339, 19.752688]
    """
    if attractor is not None:
        extents = getattr(attractor, "extents", None)
        if not isinstance(extents, Mapping):
            remedy = "pass one of limitsets.attractors(graph), such as limitsets.attractors(graph)[0]"
            raise AnswerError("the argument attractor of limit_set", shown(attractor), "an attractor", remedy)
    else:
        nodes = morse_graph(graph).nodes.values()
        attracting = [node["extents"] for node in nodes if node["attracting"]]
        if len(attracting) != 1:
            raise AnswerError(
                "the number of attractors", len(attracting), "1", "pass one of attractors(graph)"
            )
        extents = attracting[0]
    return limit_set_of(graph.map, extents, graph.grid.domain, tolerance=tolerance)
