"""A limit set by its end points: unions of intervals, their images, and the intersection of all forward images.

In one dimension the attracting cells N are intervals, and F(N), F(F(N)), ... are computed from end points alone.
Where the map expands, every end soon becomes a forward image of the one-sided limit
at a point inside the limit set, where the map changes its branch or turns; it then no longer moves, and is known to
the last digits.  Where the map contracts, the ends close in geometrically.

An end that still comes from the border of N is told apart from the others: it marks a fixed border, a point that
attracts, or a set N that was chosen too large.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np

from limitsets.base import AnswerError, Column, Table, Tabled, arguments_checked, bands_of, shown
from limitsets.systems.graph.graph import TransitionGraph, morse_graph
from limitsets.systems.maps.contract import compiled_kind_of, kind_of
from limitsets.systems.maps.critical import SAMPLES, Sides, margins
from limitsets.systems.maps.drivers import displacements, images
from limitsets.systems.maps.pieces import along, monotone_pieces

# ----------------------------------------------------------------
# Unions of intervals per side; each end carries its origin and a bound of its rounding error.
#
# An end is carried along by a map: its side, place and kind at birth stay, its place
# now and its error change.  Two ends are compared to within their errors, so that unions do not fall apart, and slivers
# do not appear, for a last digit.


Extents = Mapping[int, Iterable[tuple[float, float]]]

EPS = float(np.finfo(np.float64).eps)
# Kind of an end of the set that was given.
BORDER = "border of N"


class Track(NamedTuple):
    """An end on its way.

    Attributes
    ----------
    x : float
        Where it is.
    kind, side, start : str, int, float
        What it was when it began, and where.
    path : tuple or None
        The branches since: a linked list ``(path before, branch)``, None for none.
    error : float
        Estimate of what rounding did to `x`.
    """

    x: float
    kind: str
    side: int
    start: float
    path: tuple[Any, int] | None
    error: float

    @classmethod
    def born(cls, x: float, kind: str, side: int, error: float) -> Track:
        """Return an end that begins here."""
        return cls(x, kind, side, x, None, error)


class TrackedInterval(NamedTuple):
    """The closed interval between two ends."""

    lo: Track
    hi: Track


Union: TypeAlias = dict[int, list[TrackedInterval]]


def read(extents: Extents, domain: Sides) -> Union:
    """Read a set N from extents, cut to the domain; AnswerError where nothing of it lies there."""
    union: Union = {}
    for side, pairs in sorted(extents.items()):
        if not 0 <= side < domain.sides:
            raise AnswerError(
                "a side of the set", side, f"0 to {domain.sides - 1}", "pass a set of this domain"
            )
        bottom, top = float(domain.lo[side, 0]), float(domain.hi[side, 0])
        ends = [(max(float(lo), bottom), min(float(hi), top)) for lo, hi in pairs]
        intervals = [
            TrackedInterval(*(Track.born(x, BORDER, side, EPS * abs(x)) for x in pair))
            for pair in ends
            if pair[0] <= pair[1]
        ]
        if intervals:
            union[side] = merged(intervals)
    if not union:
        raise AnswerError(
            "the set to start from", dict(extents), "intervals inside the domain", "pass an attractor"
        )
    return union


def cut(interval: TrackedInterval, bottom: Track, top: Track) -> TrackedInterval | None:
    """Part of an interval between two borders; None for no part, or a sliver that only rounding makes."""
    lo, hi = interval
    sliver = 0.0
    if bottom.x > lo.x:
        lo, sliver = bottom, interval.hi.error
    if top.x < hi.x:
        hi, sliver = top, max(sliver, interval.lo.error)
    return TrackedInterval(lo, hi) if hi.x - lo.x >= sliver else None


def _chosen(outer: Track, other: Track) -> Track:
    """Choose the outer of two ends; of two that agree, the one that says more.

    An end that does not come from N says more than one that does, and one with a smaller error (a shorter way) more
    than one with a larger.
    """
    if abs(other.x - outer.x) > other.error + outer.error:
        return outer
    return min(outer, other, key=lambda end: (end.kind == BORDER, end.error))


def merged(intervals: Iterable[TrackedInterval]) -> list[TrackedInterval]:
    """Union, ascending; intervals that touch to within their own rounding errors are one."""
    union: list[TrackedInterval] = []
    for new in sorted(intervals, key=lambda interval: (interval.lo.x, -interval.hi.x)):
        if not union or new.lo.x - union[-1].hi.x > union[-1].hi.error + new.lo.error:
            union.append(new)
            continue
        last = union[-1]
        hi = _chosen(new.hi, last.hi) if new.hi.x > last.hi.x else _chosen(last.hi, new.hi)
        union[-1] = TrackedInterval(_chosen(last.lo, new.lo), hi)
    return union


def same(old: Union, new: Union, tolerance: float, scale: float) -> bool:
    """Whether no end moved by more than the tolerance, relative to its size or to the scale, whichever is larger."""
    if {side: len(parts) for side, parts in old.items()} != {side: len(parts) for side, parts in new.items()}:
        return False
    pairs = (
        (a.x, b.x)
        for side in new
        for before, after in zip(old[side], new[side], strict=True)
        for a, b in zip(before, after, strict=True)
    )
    return all(abs(a - b) <= tolerance * max(scale, abs(b)) for a, b in pairs)


# ----------------------------------------------------------------
# Bottlenecks: ends that only seem at rest, because steps shorter than the tolerance or the float spacing add
# up.
#
# A step of length s at a point of slope q puts the next fixed point at a distance of s / |1 - q| (Newton's method).
# If that distance is large, as in the ghost of a saddle-node, the end still moves.


def in_bottleneck(params: Any, union: Union, tolerance: float, scale: float) -> bool:
    """Tell whether a step moves some end, by no more than the tolerance, and no fixed point is that near."""
    for side, intervals in union.items():
        x = np.array([end.x for interval in intervals for end in interval])
        image = images(params, x, side)
        stays = (image.side == side) & (image.code >= 0)
        if not stays.any():
            continue
        x, branch = x[stays], image.code[stays]
        step = displacements(params, x, side) if kind_of(params).has_displacement else image.x[stays] - x
        slope = along(params, x, side, branch[:, None])[2]
        near = tolerance * np.maximum(scale, np.abs(x))
        if ((np.abs(step) <= near) & (np.abs(step) > np.abs(1.0 - slope) * near)).any():
            return True
    return False


# ----------------------------------------------------------------
# The image of a union of intervals under a one-dimensional map, computed from end points.
#
# On a monotone piece J the image of an interval I is the interval between the images of the two ends of I & J; F(I) is
# the union of these over all pieces.  An end of I & J that is not an end of I is born there, at a critical point, a
# turning point or a jump, and is the one-sided limit on its piece: the map is read as the closed relation that takes
# both limits at a change of branch.


def _critical_error(params: Any, side: int, x: float, extent: float) -> float:
    """How well a bisected change of branch is known: the noise of the margin over its slope, seen on nearby floats.

    The slope is taken over a millionth of the side's extent.
    """
    if not kind_of(params).has_margin:
        return float(np.spacing(abs(x)))
    offset = np.arange(-16, 17) * np.spacing(abs(x))
    near = margins(params, x + offset, side)
    reach = 1e-6 * extent
    wide = margins(params, [x - reach, x + reach], side)
    slope = (wide[1] - wide[0]) / (2.0 * reach)
    if not (np.isfinite(near).all() and np.isfinite(slope)) or slope == 0.0:
        return float(np.spacing(abs(x)))
    return float(np.abs(near - near.mean() - slope * offset).max() / abs(slope) + np.spacing(abs(x)))


class _Borders(NamedTuple):
    """A monotone piece as two ends to be born, and its branch."""

    branch: int
    bottom: Track
    top: Track


class _IntervalOnPiece(NamedTuple):
    """What of an interval lies on one piece."""

    side: int
    branch: int
    interval: TrackedInterval


def _stepped(end: Track, branch: int, x: float, slope: float) -> Track:
    """Give an end one step ahead: the slope carries its error, and the step rounds twice."""
    path = None if end.kind == BORDER else (end.path, branch)
    error = abs(slope) * end.error + 2.0 * EPS * (abs(x) + abs(end.x))
    return Track(x, end.kind, end.side, end.start, path, error)


class IntervalMap:
    """Images of unions of intervals of one map on one domain.

    Parameters
    ----------
    params : NamedTuple
        A one-dimensional map with `image_on`.
    domain : Domain
        What leaves it is dropped.
    samples : int
        As for `monotone_pieces`.
    """

    def __init__(self, params: Any, domain: Sides, samples: int = SAMPLES) -> None:
        self.params = params
        self.bounds = [(float(domain.lo[side, 0]), float(domain.hi[side, 0])) for side in range(domain.sides)]
        self.pieces = {
            side: [
                _Borders(
                    piece.branch,
                    self._born(side, piece.lo, piece.below),
                    self._born(side, piece.hi, piece.above),
                )
                for piece in pieces
            ]
            for side, pieces in monotone_pieces(params, domain, samples=samples).items()
        }

    def _born(self, side: int, x: float, kind: str) -> Track:
        bottom, top = self.bounds[side]
        error = _critical_error(self.params, side, x, top - bottom) if kind == "critical" else 0.0
        return Track.born(x, kind, side, error)

    def image(self, union: Union) -> tuple[Union, bool]:
        """F of a union of intervals, and whether some of it left the domain."""
        parts, leaves = self._parts(union)
        images: Union = {}
        for side, interval in self._forward(parts):
            bottom, top = self.bounds[side] if 0 <= side < len(self.bounds) else (np.inf, -np.inf)
            lo, hi = interval
            leaves |= lo.x < bottom - lo.error or hi.x > top + hi.error
            if hi.x >= bottom and lo.x <= top:
                lo = lo if lo.x >= bottom else Track.born(bottom, "domain", side, 0.0)
                hi = hi if hi.x <= top else Track.born(top, "domain", side, 0.0)
                images.setdefault(side, []).append(TrackedInterval(lo, hi))
        return {side: merged(intervals) for side, intervals in sorted(images.items())}, leaves

    def _parts(self, union: Union) -> tuple[list[_IntervalOnPiece], bool]:
        """Cut a union at the pieces, and tell whether some of it lies beyond the last of them."""
        parts: list[_IntervalOnPiece] = []
        leaves = not union
        for side, intervals in union.items():
            for interval in intervals:
                cuts = [(branch, cut(interval, bottom, top)) for branch, bottom, top in self.pieces[side]]
                kept = [_IntervalOnPiece(side, branch, part) for branch, part in cuts if part is not None]
                leaves |= not kept or any(end.kind == "exit" for part in kept for end in part.interval)
                parts += kept
        return parts, leaves

    def _forward(self, parts: list[_IntervalOnPiece]) -> list[tuple[int, TrackedInterval]]:
        """Image of each part: the side, and the interval between the images of its ends."""
        if not parts:
            return []
        sides = np.repeat([part.side for part in parts], 2)
        branches = np.repeat([part.branch for part in parts], 2)
        starts = np.array([end.x for part in parts for end in part.interval])
        x, side, slope = (values.tolist() for values in along(self.params, starts, sides, branches[:, None]))
        images = []
        for k, part in enumerate(parts):
            ends = [
                _stepped(end, part.branch, x[j], slope[j]) for j, end in enumerate(part.interval, start=2 * k)
            ]
            images.append((side[2 * k], TrackedInterval(*sorted(ends, key=lambda end: end.x))))
        return images


# ----------------------------------------------------------------
# A limit set by its end points: the intersection of all forward images of the attracting cells.


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
    domain.require_ends("the domain of a limit set")
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
    compiled_kind_of(graph.map, "the limit set")
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
