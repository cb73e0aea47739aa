"""A limit set by its end points: the intersection of all forward images of the attracting cells.

In one dimension the attracting cells N are intervals, and the image of an interval is known from its ends and from
the critical and turning points inside it.  So F(N), F(F(N)), ... are computed without cells at all.  Where the map
expands, every end soon becomes a forward image of the one-sided limit at a point inside the limit set, where the map
changes its branch or turns; it then no longer moves, and is known to the last digits.  Where the map contracts, the
ends close in geometrically.

An end that still comes from the border of N is told apart from the others: it marks a fixed border, a point that
attracts, or a set N that was chosen too large.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from limitsets.errors import AnswerError
from limitsets.graph.graph import TransitionGraph
from limitsets.graph.morse import morse_graph
from limitsets.maps.contract import kind_of
from limitsets.maps.critical import Piece, Sides, along, margins, monotone_pieces

__all__ = ["End", "LimitSet", "Origin", "limit_set", "limit_set_of"]

Extents = Mapping[int, Iterable[tuple[float, float]]]

EPS = 2.0**-52
# Near a_i of the throw an orbit takes some 1200 throws to get away from 1e-9 of the arm; beyond this the map is no
# longer expanding there and a set that still moves is said to move.
MOST_ITERATIONS = 20_000


class HasExtents(Protocol):
    """An answer that knows its intervals per side, such as an attractor or a set of cells."""

    @property
    def extents(self) -> Extents: ...


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
        runs: list[list[Any]] = []
        for name in self.branches:
            if runs and runs[-1][0] == name:
                runs[-1][1] += 1
            else:
                runs.append([name, 1])
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
class LimitSet:
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


class _Track(NamedTuple):
    """An end on its way: where it is, where it began, the branches since (a linked list), its error."""

    x: float
    kind: str
    side: int
    start: float
    path: tuple[Any, int] | None
    error: float


class _Interval(NamedTuple):
    lo: _Track
    hi: _Track


_Sets = dict[int, list[_Interval]]


def _critical_error(params: Any, side: int, x: float) -> float:
    """How well a bisected change of branch is known: the noise of the margin over its slope, seen on nearby floats."""
    if not kind_of(params).has_margin:
        return float(np.spacing(abs(x)))
    offset = np.arange(-16, 17) * np.spacing(abs(x))
    near = margins(params, x + offset, side)
    wide = margins(params, [x - 1e-6 * max(abs(x), 1.0), x + 1e-6 * max(abs(x), 1.0)], side)
    slope = (wide[1] - wide[0]) / (2e-6 * max(abs(x), 1.0))
    if not (np.isfinite(near).all() and np.isfinite(slope)) or slope == 0.0:
        return float(np.spacing(abs(x)))
    return float(np.abs(near - near.mean() - slope * offset).max() / abs(slope) + np.spacing(abs(x)))


def _cut(interval: _Interval, side: int, piece: Piece, errors: Mapping[float, float]) -> _Interval | None:
    """Part of an interval in a piece of the domain; None for no part, or a sliver that only rounding makes."""
    lo, hi = interval
    sliver = 0.0
    if piece.lo > lo.x:
        sliver = hi.error
        lo = _Track(piece.lo, piece.below, side, piece.lo, None, errors.get(piece.lo, 0.0))
    if piece.hi < hi.x:
        sliver = max(sliver, interval.lo.error)
        hi = _Track(piece.hi, piece.above, side, piece.hi, None, errors.get(piece.hi, 0.0))
    return _Interval(lo, hi) if hi.x - lo.x >= sliver else None


def _merged(intervals: list[_Interval]) -> list[_Interval]:
    """Union, ascending; intervals that touch to within their own rounding errors are one."""
    union: list[_Interval] = []
    for new in sorted(intervals, key=lambda interval: (interval.lo.x, -interval.hi.x)):
        if not union or new.lo.x - union[-1].hi.x > union[-1].hi.error + new.lo.error:
            union.append(new)
            continue
        last = union[-1]
        # Of two ends that agree, the one that does not come from N says more, then the shorter way.
        hi = new.hi if new.hi.x > last.hi.x else last.hi
        if abs(new.hi.x - last.hi.x) <= new.hi.error + last.hi.error:
            hi = min(last.hi, new.hi, key=lambda end: (end.kind == "border of N", end.error))
        lo = last.lo
        if abs(new.lo.x - lo.x) <= new.lo.error + lo.error:
            lo = min(lo, new.lo, key=lambda end: (end.kind == "border of N", end.error))
        union[-1] = _Interval(lo, hi)
    return union


class _Images:
    """Images of unions of intervals of one map on one domain."""

    def __init__(self, params: Any, domain: Sides) -> None:
        self.params = params
        self.bounds = [(float(domain.lo[side, 0]), float(domain.hi[side, 0])) for side in range(domain.sides)]
        self.pieces = monotone_pieces(params, domain)
        self.errors: dict[int, dict[float, float]] = {
            side: {
                x: _critical_error(params, side, x)
                for piece in pieces
                for x, kind in ((piece.lo, piece.below), (piece.hi, piece.above))
                if kind == "critical"
            }
            for side, pieces in self.pieces.items()
        }

    def image(self, sets: _Sets) -> tuple[_Sets, bool]:
        """F of a union of intervals, and whether some of it left the domain."""
        parts: list[tuple[int, int, _Interval]] = []
        leaves = False
        for side, intervals in sets.items():
            for interval in intervals:
                cuts = [
                    (piece.branch, _cut(interval, side, piece, self.errors[side]))
                    for piece in self.pieces[side]
                ]
                kept = [(side, branch, cut) for branch, cut in cuts if cut is not None]
                ends = {end.kind for _, _, cut in kept for end in cut}
                leaves |= not kept or "exit" in ends
                parts += kept
        if not parts:
            return {}, True
        sides = np.repeat([side for side, _, _ in parts], 2)
        branches = np.repeat([branch for _, branch, _ in parts], 2)
        starts = np.array([end.x for _, _, cut in parts for end in cut])
        after, side_after, slope = along(self.params, starts, sides, branches[:, None])
        images: _Sets = {}
        for k, (_, branch, cut) in enumerate(parts):
            new = [
                _Track(
                    float(after[j]),
                    end.kind,
                    end.side,
                    end.start,
                    (end.path, branch) if end.kind != "border of N" else None,
                    abs(float(slope[j])) * end.error + 2.0 * EPS * (abs(float(after[j])) + abs(end.x)),
                )
                for j, end in ((2 * k, cut.lo), (2 * k + 1, cut.hi))
            ]
            lo, hi = sorted(new, key=lambda end: end.x)
            to = int(side_after[2 * k])
            bottom, top = self.bounds[to] if 0 <= to < len(self.bounds) else (np.inf, -np.inf)
            leaves |= lo.x < bottom - lo.error or hi.x > top + hi.error
            if not (hi.x < bottom or lo.x > top):
                lo = lo if lo.x >= bottom else _Track(bottom, "domain", to, bottom, None, 0.0)
                hi = hi if hi.x <= top else _Track(top, "domain", to, top, None, 0.0)
                images.setdefault(to, []).append(_Interval(lo, hi))
        return {side: _merged(intervals) for side, intervals in sorted(images.items())}, leaves


def _start(params: Any, extents: Extents, domain: Sides) -> _Sets:
    """Read the first set N from extents."""
    sets: _Sets = {}
    for side, pairs in sorted(extents.items()):
        if not 0 <= side < domain.sides:
            raise AnswerError(
                "a side of the set", side, f"0 to {domain.sides - 1}", "pass a set of this domain"
            )
        bottom, top = float(domain.lo[side, 0]), float(domain.hi[side, 0])
        ends = [(max(float(lo), bottom), min(float(hi), top)) for lo, hi in pairs]
        tracks = [tuple(_Track(x, "border of N", side, x, None, EPS * abs(x)) for x in pair) for pair in ends]
        intervals = [_Interval(*pair) for pair in tracks if pair[0].x <= pair[1].x]
        if intervals:
            sets[side] = _merged(intervals)
    if not sets:
        raise AnswerError(
            "the set to start from", dict(extents), "intervals inside the domain", "pass an attractor"
        )
    return sets


def _same(old: _Sets, new: _Sets, tolerance: float) -> bool:
    """Whether no end moved by more than the tolerance, relative to its size (to 1 below 1)."""
    if {side: len(intervals) for side, intervals in old.items()} != {side: len(new[side]) for side in new}:
        return False
    pairs = (
        (a.x, b.x)
        for side in new
        for o, n in zip(old[side], new[side], strict=True)
        for a, b in zip(o, n, strict=True)
    )
    return all(abs(a - b) <= tolerance * max(1.0, abs(b)) for a, b in pairs)


def _origin(names: tuple[str, ...], track: _Track) -> Origin:
    branches: list[str] = []
    path = track.path
    while path is not None:
        path, branch = path
        branches.append(names[branch])
    return Origin(track.kind, track.side, track.start, tuple(reversed(branches)))


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
        The ends are taken to rest when two images in turn move none of them by more, relative to its size.
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
    >>> from limitsets.sets.limit_set import limit_set_of
    >>> band = limit_set_of(maps.Logistic(3.9), {0: [(0.05, 0.99)]}, as_domain([(0, 1)]))
    >>> band.extents[0]  # F(F(1/2)) and F(1/2)
    [(0.0950625, 0.975)]
    >>> print(band.ends[0].origin)
    critical point x = 0.5 on side 0, left, right
    """
    machine = _Images(params, domain)
    names = kind_of(params).branches
    sets = _start(params, extents, domain)
    rested, count, leaves = 0, 0, False
    while rested < 2 and count < most_iterations and sets:
        new, out = machine.image(sets)
        rested = rested + 1 if _same(sets, new, tolerance) else 0
        sets, count, leaves = new, count + 1, leaves or out
    advice = None
    if rested < 2:
        advice = (
            f"the ends still move after {count} images: start from one attractor, or raise most_iterations"
        )
    elif leaves:
        advice = "part of the set left the domain and was dropped: start from attracting cells, or enlarge the domain"
    found = [
        (side, which, end)
        for side in sets
        for pair in sets[side]
        for which, end in zip(("lo", "hi"), pair, strict=True)
    ]
    return LimitSet(
        {side: [(pair.lo.x, pair.hi.x) for pair in sets[side]] for side in sets},
        tuple(End(side, end.x, which, _origin(names, end), end.error) for side, which, end in found),
        count,
        rested == 2,
        leaves,
        advice,
    )


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
        See `limit_set_of`.

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
        extents = attractor.extents
    else:
        nodes = morse_graph(graph).nodes.values()
        attracting = [node["extents"] for node in nodes if node["attracting"]]
        if len(attracting) != 1:
            raise AnswerError(
                "the number of attractors", len(attracting), "1", "pass one of attractors(graph)"
            )
        extents = attracting[0]
    return limit_set_of(graph.map, extents, graph.grid.domain, tolerance=tolerance)
