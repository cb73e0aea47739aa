"""The image of a union of intervals under a one-dimensional map, computed from end points.

On a monotone piece J the image of an interval I is the interval between the images of the two ends of I & J; F(I) is
the union of these over all pieces.  An end of I & J that is not an end of I is born there, at a critical point, a
turning point or a jump, and is the one-sided limit on its piece: the map is read as the closed relation that takes
both limits at a change of branch.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from limitsets.maps.contract import kind_of
from limitsets.maps.critical import SAMPLES, Sides, margins
from limitsets.maps.forced import along
from limitsets.maps.pieces import monotone_pieces
from limitsets.sets.unions import BORDER, EPS, Track, TrackedInterval, Union, cut, merged


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
