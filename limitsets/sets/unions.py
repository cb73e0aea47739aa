"""Unions of intervals per side; each end carries its origin and a bound of its rounding error.

An end is carried along by a map (`limitsets.sets.interval_map`): its side, place and kind at birth stay, its place
now and its error change.  Two ends are compared to within their errors, so that unions do not fall apart, and slivers
do not appear, for a last digit.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from limitsets.errors import AnswerError
from limitsets.maps.critical import Sides

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
