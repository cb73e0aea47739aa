"""Following attractors along a path: steps are halved until attractors go on one to one, or an event is bracketed."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from limitsets.errors import AnswerError
from limitsets.scene import load
from limitsets.sweep.continuation.collisions import Approach, approaches, crossing, nearest
from limitsets.sweep.continuation.matching import REACH, Group, Match, distance, matched
from limitsets.sweep.continuation.path import Curve, Path, read_path
from limitsets.sweep.continuation.result import Collision, Continuation, Event, State
from limitsets.sweep.continuation.snapshot import Found, Snapshot, arrivals, snapshot_at

__all__ = ["continuation"]

Progress = Callable[[str, int, int], None]

# Width of the brackets, as a share of the path.
BRACKET = 1e-9
# A gap this small, of the extent, is a touch where it does not change its sign.
TOUCH = 1e-9
# Width of the bracket of a touch: where a parabola is flat to rounding.
TOUCH_BRACKET = 1e-7


class _Met(NamedTuple):
    """A border collision or a touch in a bracket."""

    kind: str
    t: tuple[float, float]
    collision: Collision
    owner: tuple[float, int]


class _Follower:
    """The places visited so far."""

    def __init__(self, path: Path, cells: int, most: int) -> None:
        self.path, self.cells, self.most = path, cells, most
        self.snapshots: dict[float, Snapshot] = {}
        self.matches: dict[tuple[float, float], Match] = {}
        self.met: list[_Met] = []
        self.left = most

    def at(self, t: float) -> Snapshot:
        """Snapshot at t, found once."""
        if t not in self.snapshots:
            self.snapshots[t] = snapshot_at(self.path.at(t), self.cells)
            self.left -= 1
        return self.snapshots[t]

    def match(self, lo: Snapshot, hi: Snapshot) -> Match:
        """Match of two places, found once."""
        key = (lo.t, hi.t)
        if key not in self.matches:
            self.matches[key] = matched(lo, hi)
        return self.matches[key]

    def step(self, first: float, last: float) -> None:
        """Halve a step until nothing happens in its parts, or what happens is bracketed."""
        self.left = self.most
        stack = [(first, last)]
        while stack:
            lo, hi = (self.at(t) for t in stack.pop())
            met = self._collision(lo, hi)
            if met is not None:
                self.met.append(met)
                stack += [pair for pair in ((met.t[1], hi.t), (lo.t, met.t[0])) if pair[0] < pair[1]]
            elif hi.t - lo.t > BRACKET and self.left > 0 and not self.match(lo, hi).smooth:
                middle = 0.5 * (lo.t + hi.t)
                stack += [(middle, hi.t), (lo.t, middle)]

    def _collision(self, lo: Snapshot, hi: Snapshot) -> _Met | None:
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

    def _confirmed(self, kind: str, each: Approach, bracket: tuple[float, float]) -> _Met | None:
        """Tell a meeting if the tracked point is an end of an attractor on one side or both."""
        told = each.told(self.path.at(bracket[0]))
        owners = [(t, each.owner(self.at(t))) for t in bracket]
        known = [(t, position) for t, position in owners if position is not None]
        return _Met(kind, bracket, told, known[0]) if known and told is not None else None

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
        if abs(gap) <= TOUCH * place.extent:
            met = self._confirmed("touch", each, (t - TOUCH_BRACKET, t + TOUCH_BRACKET))
            self.met += [met] if met is not None else []
        elif (gap > 0.0) != (each.at(steps[1]) > 0.0):
            for lo, hi in ((steps[0], t), (t, steps[2])):
                self.step(lo, hi)

    def settle(self) -> None:
        """Halve steps beside places that were only looked at on the way to something else."""
        brackets = {met.t for met in self.met}
        for lo, hi in pairwise(sorted(self.snapshots)):
            if hi - lo > BRACKET and (lo, hi) not in brackets and not self.match(self.at(lo), self.at(hi)).smooth:
                self.step(lo, hi)


def _numbered(follower: _Follower) -> list[list[int]]:
    """Give every attractor at every step its number."""
    steps = [follower.at(t) for t in sorted(follower.snapshots)]
    numbers = [list(range(len(steps[0].found)))]
    following = len(steps[0].found)
    for before, after in pairwise(steps):
        given = [-1] * len(after.found)
        for group in follower.match(before, after).groups:
            old = [numbers[-1][position] for position in group.before]
            for position in group.after:
                if old:
                    given[position] = old.pop(0)
                else:
                    given[position], following = following, following + 1
        numbers.append(given)
    return numbers


def _change(one: Found, other: Found) -> str:
    before, after = State.of(one).words(), State.of(other).words()
    if before == after and one.bands != other.bands:
        before, after = f"bands {one.bands}", f"bands {other.bands}"
    return f"{before} -> {after}" if before != after else ""


def _whereto(found: Found, there: Snapshot, numbers: list[int], reach: float) -> str:
    """Say where the states of an attractor go at the other end of a bracket."""
    ends = arrivals(found, there, reach)
    words = [f"attractor {numbers[position]}" for position in sorted(ends) if position >= 0]
    words += ["an exit"] if -2 in ends else []
    return " and ".join(words) or "no attractor within 1000 steps"


class _Between(NamedTuple):
    """Two steps in turn, with the numbers of their attractors."""

    before: Snapshot
    after: Snapshot
    old: list[int]
    new: list[int]

    def event(self, kind: str, group: Group, change: str, jump: float | None, met: _Met | None) -> Event:
        t = (self.before.t, self.after.t) if met is None else met.t
        values = self.before.place.values, self.after.place.values
        before = tuple(self.old[position] for position in group.before)
        after = tuple(self.new[position] for position in group.after)
        return Event(kind, t, values, before, after, change, jump, None if met is None else met.collision)

    def of_group(self, group: Group, met: _Met | None) -> Event | None:
        """Tell what happens to one group of attractors, None for nothing."""
        reach = REACH * self.before.place.extent
        if group.one_to_one:
            one, other = self.before.found[group.before[0]], self.after.found[group.after[0]]
            jump = 0.0 if one.cells is not None else distance(one, other)
            change = "" if one.cells is not None else _change(one, other)
            if met is not None:
                return self.event(met.kind, group, change, jump, met)
            if not change and jump <= reach:
                return None
            return self.event("bands" if change else "jump", group, change, jump, None)
        one_side = [self.before.found[k] for k in group.before] or [self.after.found[k] for k in group.after]
        words = " and ".join(State.of(each).words() for each in one_side)
        if not group.after:
            goes = _whereto(one_side[0], self.after, self.new, reach)
            return self.event("death", group, f"{words}, its states come to {goes}", None, met)
        if not group.before:
            came = _whereto(one_side[0], self.before, self.old, reach)
            return self.event("birth", group, f"{words}, its states came to {came}", None, met)
        many = [self.after.found[k] for k in group.after]
        change = f"{words} -> {' and '.join(State.of(each).words() for each in many)}"
        kind = "merge" if len(group.before) >= len(group.after) else "split"
        return self.event(kind, group, change, None, met)


def _events(follower: _Follower, numbers: list[list[int]]) -> tuple[Event, ...]:
    steps = sorted(follower.snapshots)
    place_of = {t: k for k, t in enumerate(steps)}
    found: list[Event] = []
    for k, (lo, hi) in enumerate(pairwise(steps)):
        between = _Between(follower.at(lo), follower.at(hi), numbers[k], numbers[k + 1])
        here = [met for met in follower.met if met.t == (lo, hi)]
        for group in follower.match(between.before, between.after).groups:
            mine = [met for met in here if met.owner[1] in (group.before if met.owner[0] == lo else group.after)]
            found += [event for met in mine or [None] if (event := between.of_group(group, met)) is not None]
    for met in follower.met:
        if place_of[met.t[1]] != place_of[met.t[0]] + 1:  # a touch, with steps in its bracket
            number = numbers[place_of[met.owner[0]]][met.owner[1]]
            values = tuple(follower.at(t).place.values for t in met.t)
            found.append(Event(met.kind, met.t, values, (number,), (number,), "", 0.0, met.collision))
    return tuple(sorted(found, key=lambda event: event.t))


def continuation(
    subject: Any,
    path: Curve,
    *,
    steps: int = 100,
    cells: int = 512,
    domain: Any = None,
    most: int = 300,
    progress: Progress | None = None,
) -> Continuation:
    """Follow the attractors along a path of parameters, and find what happens to them on the way.

    Parameters
    ----------
    subject : Scene, str or NamedTuple
        A scene, its name or file, or a registered map.
    path : dict of str to (first, last), or callable
        A straight path: first and last value of each quantity (numbers in the scene's units, or text with a unit) or
        of each parameter of the map.  Any other curve: a function of t in [0, 1] that gives the values, or the map.
    steps : int
        Equal steps in t to begin with.
    cells : int
        Cells per axis of each side, in which attractors are looked for.
    domain : Domain or list of (lo, hi), optional
        Of a map that is no textbook map.
    most : int
        Places per step at which attractors are found; beyond it the brackets stay as wide as they are.
    progress : callable, optional
        Called with what is done, how many steps of it are, and of how many.

    Returns
    -------
    Continuation
        Attractors at each step with stable numbers, and the events.

    Raises
    ------
    AnswerError
        For a path that is none, or fewer than one step.
    SceneError
        For a quantity or a value that the scene cannot have.

    Notes
    -----
    Two attractors at neighbouring places are matched when they overlap (to a fiftieth of the extent) and the states of
    one come to rest at the other under the other's map.  Where that is not one to one, where the number of bands per
    side or the period changes, or where the set moves by more than that, the step is halved, down to 1e-9 of the path;
    what is left is an event with its bracket.  A change that is undone within a step is not seen.  Nothing is proved.

    Border collisions are those of ends of bands, ends of inner gaps included, and of points of attracting cycles; a
    critical orbit that meets a critical point inside a band changes no band and is not reported.

    Source: docs/continuation.md.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.continuation(ls.maps.Logistic(3.0), {"r": (2.9, 3.1)}, steps=4)
    >>> for event in found.events:
    ...     print(event)
    bands at r = 3: period 1 -> period 2
    """
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise AnswerError("the number of steps", steps, "an integer from 1", "pass steps=100")
    curve = read_path(load(subject) if isinstance(subject, str) else subject, path, domain)
    follower = _Follower(curve, cells, most)
    grid = np.linspace(0.0, 1.0, steps + 1).tolist()
    for k, (first, last) in enumerate(pairwise(grid)):
        if progress is not None:
            progress("steps", k, steps)
        follower.step(first, last)
    follower.touches()
    follower.settle()
    if progress is not None:
        progress("steps", steps, steps)
    return _answer(curve, follower)


def _answer(curve: Path, follower: _Follower) -> Continuation:
    numbers = _numbered(follower)
    visited = [follower.at(t) for t in sorted(follower.snapshots)]
    names = visited[0].place.values
    return Continuation(
        curve.name,
        curve.unit,
        np.array([each.t for each in visited]),
        {name: np.array([each.place.values[name] for each in visited]) for name in names},
        tuple(
            {number: State.of(found) for number, found in sorted(zip(row, each.found, strict=True), key=_first)}
            for row, each in zip(numbers, visited, strict=True)
        ),
        tuple(_critical(each) for each in visited),
        _events(follower, numbers),
        len(visited),
    )


def _first(pair: tuple[int, Found]) -> int:
    return pair[0]


def _critical(snapshot: Snapshot) -> dict[int, tuple[float, ...]]:
    if not snapshot.place.on_line:
        return {}
    found: dict[int, list[float]] = {side: [] for side in snapshot.place.forward.pieces}
    for border in snapshot.place.borders:
        if border.kind == "critical":
            found[border.side].append(border.x_above)
    return {side: tuple(x) for side, x in found.items()}
