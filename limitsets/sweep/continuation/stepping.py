"""Steps along a path: halved until attractors go on one to one, or what happens is bracketed."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from limitsets.sweep.continuation.collisions import Approach, approaches, crossing, nearest
from limitsets.sweep.continuation.matching import Match, matched
from limitsets.sweep.continuation.path import Path
from limitsets.sweep.continuation.result import Collision
from limitsets.sweep.continuation.snapshot import Snapshot, confirmed, snapshot_at

# Width of the brackets, as a share of the path.
BRACKET = 1e-9
# The same where cells decide: two sizes of cells that agree on a place do not agree on the last digits of an event.
CELL_BRACKET = 1e-4
# A gap this small, of the extent, is a touch where it does not change its sign.
TOUCH = 1e-9
# Width of the bracket of a touch: where a parabola is flat to rounding.
TOUCH_BRACKET = 1e-7


class Met(NamedTuple):
    """A border collision or a touch in a bracket."""

    kind: str
    t: tuple[float, float]
    collision: Collision
    owner: tuple[float, int]


class Follower:
    """The places visited so far."""

    def __init__(self, path: Path, cells: int, most: int) -> None:
        self.path, self.cells, self.most = path, cells, most
        self.snapshots: dict[float, Snapshot] = {}
        self.matches: dict[tuple[Snapshot, Snapshot], Match] = {}
        self.sure: dict[float, bool] = {}
        self.met: list[Met] = []
        self.left = most

    def at(self, t: float) -> Snapshot:
        """Snapshot at t, found once."""
        if t not in self.snapshots:
            self.snapshots[t] = snapshot_at(self.path.at(t), self.cells)
            self.left -= 1
        return self.snapshots[t]

    def match(self, lo: Snapshot, hi: Snapshot) -> Match:
        """Match of two places, found once."""
        if (lo, hi) not in self.matches:
            self.matches[lo, hi] = matched(lo, hi)
        return self.matches[lo, hi]

    def is_sure(self, t: float) -> bool:
        """Whether an event may begin or end at a place: where cells decide, finer ones have to agree."""
        return self.at(t).place.on_line or self.sure.get(t, False)

    def step(self, first: float, last: float) -> None:
        """Halve a step until nothing happens in its parts, or what happens is bracketed."""
        self.left = self.most
        self._halve([(first, last)])

    def _halve(self, stack: list[tuple[float, float]]) -> None:
        while stack:
            lo, hi = (self.at(t) for t in stack.pop())
            met = self._collision(lo, hi)
            if met is not None:
                self.met.append(met)
                stack += [pair for pair in ((met.t[1], hi.t), (lo.t, met.t[0])) if pair[0] < pair[1]]
            elif self.left > 0 and not self._is_done(lo, hi):
                middle = self._middle(lo, hi)
                stack += [] if middle is None else [(middle, hi.t), (lo.t, middle)]

    def _is_done(self, lo: Snapshot, hi: Snapshot) -> bool:
        """Whether a step is short enough, or nothing happens in it, on finer cells either."""
        if lo.place.on_line:
            return hi.t - lo.t <= BRACKET or self.match(lo, hi).smooth
        if self.match(lo, hi).smooth:
            return True
        for t in (lo.t, hi.t):
            self._confirm(t)
        return hi.t - lo.t <= CELL_BRACKET or self.match(self.at(lo.t), self.at(hi.t)).smooth

    def _confirm(self, t: float) -> bool:
        """Look at a place again on finer cells, once; whether they agree."""
        if t not in self.sure:
            found = confirmed(self.at(t))
            self.sure[t] = found is not None
            if found is not None:
                self.snapshots[t] = found
        return self.sure[t]

    def _middle(self, lo: Snapshot, hi: Snapshot) -> float | None:
        """Place that cuts a step; on cells one that finer ones confirm, None where there is none."""
        if lo.place.on_line:
            return 0.5 * (lo.t + hi.t)
        for share in (0.5, 0.25, 0.75):
            t = lo.t + share * (hi.t - lo.t)
            if self.sure.get(t, True) and self._confirm(t):
                return t
            self.snapshots.pop(t, None)
        return None

    def _collision(self, lo: Snapshot, hi: Snapshot) -> Met | None:
        """First border collision between two places."""
        if not lo.place.on_line or any(met.t == (lo.t, hi.t) for met in self.met):
            return None
        roots = [(crossing(each, lo, hi), each) for each in approaches(self.path, lo, hi)]
        for root, each in sorted(((t, each) for t, each in roots if t is not None), key=lambda pair: pair[0]):
            bracket = max(root - 0.4 * BRACKET, lo.t), min(root + 0.4 * BRACKET, hi.t)
            if bracket in [met.t for met in self.met]:
                continue
            places = [self.path.at(t) for t in bracket]
            if not all(each.decided(place) for place in places):
                continue
            met = self._confirmed("border collision", each, bracket)
            if met is not None:
                return met
        return None

    def _confirmed(self, kind: str, each: Approach, bracket: tuple[float, float]) -> Met | None:
        """Tell a meeting if the tracked point is an end of an attractor on one side or both."""
        told = each.told(self.path.at(bracket[0]))
        owners = [(t, each.owner(self.at(t))) for t in bracket]
        known = [(t, position) for t, position in owners if position is not None]
        return Met(kind, bracket, told, known[0]) if known and told is not None else None

    def touches(self) -> None:
        """Find where an end comes nearest to a critical point between steps and touches it, or passes it twice."""
        steps = sorted(self.snapshots)
        for before, middle, after in zip(steps, steps[1:], steps[2:], strict=False):
            a, b, c = (self.at(t) for t in (before, middle, after))
            if after - before < 4.0 * TOUCH_BRACKET or not b.place.on_line:
                continue
            if not (self.match(a, b).smooth and self.match(b, c).smooth):
                continue
            for each in approaches(self.path, a, c):
                found = nearest(each, middle)
                if found is None:
                    continue
                t, gap = found
                self._touched(each, (before, middle, after), t, gap)

    def _touched(self, each: Approach, steps: tuple[float, float, float], t: float, gap: float) -> None:
        place = self.path.at(t)
        if any(met.kind == "touch" and abs(met.t[0] - t) <= 4.0 * TOUCH_BRACKET for met in self.met):
            return
        if abs(gap) <= TOUCH * place.extent:
            met = self._confirmed("touch", each, (t - TOUCH_BRACKET, t + TOUCH_BRACKET))
            self.met += [met] if met is not None else []
        elif (gap > 0.0) != (each.at(steps[1]) > 0.0):
            between = [step for step in self.snapshots if steps[0] < step < steps[2]]
            for lo, hi in pairwise(sorted({steps[0], steps[2], t, *between})):
                self.step(lo, hi)

    def settle(self) -> None:
        """Halve steps beside places that were only looked at on the way to something else.

        Places inside the path at which finer cells do not agree are left out.
        """
        for t in [t for t, sure in self.sure.items() if not sure and 0.0 < t < 1.0]:
            self.snapshots.pop(t, None)
        brackets = {met.t for met in self.met}
        pairs = [
            (lo, hi)
            for lo, hi in pairwise(sorted(self.snapshots))
            if hi - lo > BRACKET
            and (lo, hi) not in brackets
            and not self.match(self.at(lo), self.at(hi)).smooth
        ]
        # One allowance for all: steps that were left wide are not begun anew.
        self.left = self.most
        self._halve(pairs[::-1])
