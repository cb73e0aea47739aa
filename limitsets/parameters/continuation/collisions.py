"""Border collisions: parameters at which an end of an attractor stands on a critical point.

An end of a band is F^k(c+-), the k-th image of a one-sided limit at a critical point c along known branches; a point of
an attracting cycle solves F^p(x) = x on its branches.  Either is a smooth function of t as long as the branches are
forced, and so is its distance from a critical point c'.  A change of sign of that distance between two places is solved
(Brent's method); it counts if on both sides of the root the map itself takes these branches, further from every change
of branch than rounding reaches, and the point is an end of the attractor on one side of the root or both.

The same is done for exits and the ends of the domain, where an attractor begins to leave.  Critical points across which
the map is smooth (the top of the logistic map, which only names two branches) are no borders: nothing happens where an
end passes them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from limitsets.parameters.continuation.growth import on_itinerary
from limitsets.parameters.continuation.path import LEAVING, Border, Path, Place
from limitsets.parameters.continuation.snapshot import AttractorAtPlace, Collision, Snapshot
from limitsets.systems.cells import Domain
from limitsets.systems.maps import along, images, kind_of
from limitsets.systems.maps.critical import TINY, branches_of_side
from limitsets.systems.sets.end_points import EPS

# Of the extent: the window in which a critical point is looked for again; slopes and images that differ by less are
# the same.
WINDOW, SMOOTH = 0.01, 1e-6


def _nearest(borders: list[Border], wanted: Border, guess: float) -> Border | None:
    alike = [each for each in borders if each.like(wanted)]
    return min(alike, key=lambda each: abs(each.x_above - guess), default=None)


def _again(place: Place, wanted: Border, guess: float) -> Border | None:
    """Find a border again at another place, near a guess."""
    if wanted.kind != "critical" or place.is_cut:
        return _nearest(place.borders, wanted, guess)
    lo, hi = place.domain.lo.copy(), place.domain.hi.copy()
    bottom, top = float(lo[wanted.side, 0]), float(hi[wanted.side, 0])
    reach = WINDOW * (top - bottom)
    lo[wanted.side, 0] = min(max(guess - reach, bottom), top - reach)
    hi[wanted.side, 0] = max(min(guess + reach, top), bottom + reach)
    x, code = branches_of_side(place.params, Domain(lo, hi), wanted.side, 9)
    k = np.flatnonzero((code[:-1] == wanted.below) & (code[1:] == wanted.above))
    if k.size == 0:
        return None
    k = k[np.abs(x[k] - guess).argmin()]
    return wanted._replace(x_below=float(x[k]), x_above=float(x[k + 1]))


def _is_smooth(place: Place, border: Border) -> bool:
    """Whether image and slope are the same on both sides."""
    x, branches = [border.x_below, border.x_above], [[border.below], [border.above]]
    y, side, slope = along(place.params, x, border.side, branches)
    near = abs(y[1] - y[0]) <= SMOOTH * place.extent and abs(slope[1] - slope[0]) <= SMOOTH * (
        1.0 + abs(slope[0])
    )
    return bool(side[0] == side[1] and near)


class Tracked(NamedTuple):
    """A point to track.

    Attributes
    ----------
    start : Border or None
        The critical point that its orbit begins at; None for a point of a cycle.
    from_above : bool
        Which limit there.
    x, side : float, int
        Of a cycle: the point.
    word : tuple of int
        The branches.
    to_side : int
        Side on which the tracked point lies.
    """

    start: Border | None
    from_above: bool
    x: float
    side: int
    word: tuple[int, ...]
    to_side: int


class Approach(NamedTuple):
    """A tracked point and a critical point, between two places.

    Attributes
    ----------
    path : Path
        The path.
    span : (float, float)
        Both t.
    tracked : Tracked
        The point.
    start : (Border, Border) or None
        The critical point of its orbit at both; None for a point of a cycle.
    target : (Border, Border)
        The critical point it may meet, at both.
    """

    path: Path
    span: tuple[float, float]
    tracked: Tracked
    start: tuple[Border, Border] | None
    target: tuple[Border, Border]

    def _border(self, place: Place, pair: tuple[Border, Border]) -> Border | None:
        share = (place.t - self.span[0]) / (self.span[1] - self.span[0])
        return _again(place, pair[0], (1.0 - share) * pair[0].x_above + share * pair[1].x_above)

    def point(self, place: Place) -> tuple[float, int] | None:
        """Where the tracked orbit begins, and on which side; None where that is not there."""
        if self.start is not None:
            border = self._border(place, self.start)
            if border is None:
                return None
            return (border.x_above if self.tracked.from_above else border.x_below), border.side
        _, _, x, side, word, _ = self.tracked
        root, _, good = on_itinerary(place, np.array([x]), np.array([side]), np.array([word]))
        return (float(root[0]), side) if good[0] else None

    def gap(self, place: Place) -> float:
        """Tracked point minus critical point; nan where one of them is not there."""
        begin, border = self.point(place), self._border(place, self.target)
        if begin is None or border is None:
            return float("nan")
        x, side, _ = along(place.params, [begin[0]], begin[1], self.tracked.word)
        return float(x[0] - border.x_above) if side[0] == self.tracked.to_side else float("nan")

    def at(self, t: float) -> float:
        """`gap` at t."""
        return self.gap(self.path.at(t))

    def decided(self, place: Place) -> bool:
        """Whether the map takes the forced branches, and the sign of the gap stands out of rounding."""
        begin = self.point(place)
        if begin is None:
            return False
        x, side = begin
        leaves = self.target[0].kind in LEAVING
        error = 4.0 * EPS * place.extent
        for j, branch in enumerate(self.tracked.word):
            # The first branch of a one-sided limit is forced by its side; the tracked point of a cycle is the one
            # that passes the border.
            # What happens in the last step to a point that leaves is the event itself.
            if j > 0 and not (leaves and j == len(self.tracked.word) - 1):
                around = np.array([x - 4.0 * error, x + 4.0 * error])
                if (images(place.params, around, side).code != branch).any():
                    return False
            after, to, slope = along(place.params, [x], side, [branch])
            error = abs(float(slope[0])) * error + 2.0 * EPS * (abs(x) + abs(float(after[0])))
            x, side = float(after[0]), int(to[0])
        return abs(self.gap(place)) > 4.0 * error

    def owner(self, snapshot: Snapshot) -> int | None:
        """Attractor of which the tracked point is an end, or on whose cycle it is; None for none."""
        begin = self.point(snapshot.place)
        if begin is None:
            return None
        x, side, _ = along(snapshot.place.params, [begin[0]], begin[1], self.tracked.word)
        near = 1e-9 * snapshot.place.extent
        for position, attractor in enumerate(snapshot.attractors):
            if (attractor.cycle is None) == (self.start is not None):
                ends = [end for pair in attractor.extents.get(int(side[0]), ()) for end in pair]
                if any(abs(end - float(x[0])) <= near for end in ends):
                    return position
        return None

    def told(self, place: Place) -> Collision | None:
        """Put it in the words of an event."""
        names = kind_of(place.params).branches
        begin, border = self.point(place), self._border(place, self.target)
        if begin is None or border is None:
            return None
        kinds = {"critical": f"{names[border.below]}->{names[border.above]}", "domain": "end of the domain"}
        change = kinds.get(border.kind, border.kind)
        itinerary = tuple(names[branch] for branch in self.tracked.word)
        limit = "cycle" if self.start is None else ("c+" if self.tracked.from_above else "c-")
        start = None if self.start is None else begin[0] * (abs(begin[0]) >= TINY)
        at = border.x_above if abs(border.x_above) >= TINY else 0.0
        return Collision(
            x=at,
            side=border.side,
            change=change,
            k=len(itinerary),
            start=start,
            start_side=begin[1],
            limit=limit,
            itinerary=itinerary,
        )


def _tracked(attractor: AttractorAtPlace, borders: list[Border], names: tuple[str, ...]) -> Iterator[Tracked]:
    """Points to track of one attractor."""
    if attractor.cycle is not None:
        word = attractor.cycle.branches.tolist()
        for k, (x, side) in enumerate(
            zip(attractor.cycle.x.tolist(), attractor.cycle.side.tolist(), strict=True)
        ):
            yield Tracked(None, False, x, side, tuple(word[k:] + word[:k]), side)
    for end in attractor.ends:
        x, side, word = (
            end.origin.x,
            end.origin.side,
            tuple(names.index(name) for name in end.origin.branches),
        )
        for border in borders:
            if border.side == side and x in (border.x_below, border.x_above):
                yield Tracked(border, x == border.x_above, x, side, word, end.side)


def _at_both(border: Border, others: list[Border], which: int) -> tuple[Border, Border] | None:
    """Pair a border at one place with the same border at the other place; None without one there."""
    other = _nearest(others, border, border.x_above)
    if other is None:
        return None
    return (border, other) if which == 0 else (other, border)


def approaches(path: Path, lo: Snapshot, hi: Snapshot) -> Iterator[Approach]:
    """All ends and cycle points of two places, each with every border on its side, tracked between them."""
    borders, names = (lo.place.borders, hi.place.borders), kind_of(lo.place.params).branches
    seen = set()
    for which, snapshot in enumerate((lo, hi)):
        targets = [
            (target, pair)
            for target in borders[which]
            if target.kind in LEAVING or (target.kind != "turning" and not _is_smooth(snapshot.place, target))
            if (pair := _at_both(target, borders[1 - which], which)) is not None
        ]
        points = [
            point for attractor in snapshot.attractors for point in _tracked(attractor, borders[which], names)
        ]
        for point in points if targets else ():
            start = None if point.start is None else _at_both(point.start, borders[1 - which], which)
            if point.start is not None and start is None:
                continue
            for target, pair in targets:
                # An end that both places have is the same if it is of the same orbit, a point of a cycle if it is near.
                where = start[0] if start else round(point.x / (WINDOW * lo.place.extent))
                key = (point.word, point.from_above, where, pair[0])
                if target.side == point.to_side and key not in seen:
                    seen.add(key)
                    yield Approach(path, (lo.t, hi.t), point, start, pair)


def crossing(approach: Approach, lo: Snapshot, hi: Snapshot) -> float | None:
    """Root t of a gap that changes its sign between two places; None for none, or where the gap ends on the way."""
    from scipy.optimize import brentq

    first, last = approach.gap(lo.place), approach.gap(hi.place)
    if not (np.isfinite(first) and np.isfinite(last)) or (first > 0.0) == (last > 0.0):
        return None

    def value(t: float) -> float:
        distance = approach.at(t)
        if not np.isfinite(distance):
            raise ValueError
        return distance

    try:
        return float(brentq(value, lo.t, hi.t, xtol=1e-14, rtol=4.0 * EPS))
    except ValueError:
        return None


def nearest(approach: Approach, middle: float) -> tuple[float, float] | None:
    """Least gap between two places at whose ends it is no smaller than in the middle: t, and the gap there."""
    from scipy.optimize import minimize_scalar

    if approach.target[0].kind in LEAVING:  # a set may end with the domain all along
        return None
    lo, hi = approach.span
    first, between, last = (approach.at(t) for t in (lo, middle, hi))
    if not np.isfinite([first, between, last]).all():
        return None
    sign = 1.0 if between > 0.0 else -1.0
    if not (0.0 < sign * between <= min(sign * first, sign * last)):
        return None
    minimum = minimize_scalar(
        lambda t: sign * approach.at(t), bounds=(lo, hi), method="bounded", options={"xatol": 1e-12}
    )
    return float(minimum.x), sign * float(minimum.fun)
