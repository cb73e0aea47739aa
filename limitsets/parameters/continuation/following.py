"""Attractors followed along a path: matched, stepped until they go on one to one, and what happens between steps."""

from __future__ import annotations

from functools import cache
from itertools import count, pairwise
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError, Progress, arguments_checked, shown_in_notebooks, silent
from limitsets.feeder.scene import load
from limitsets.parameters.continuation.collisions import Approach, approaches, crossing, nearest
from limitsets.parameters.continuation.path import Curve, Path, between, read_path
from limitsets.parameters.continuation.snapshot import (
    LEAST,
    AttractorAtPlace,
    Collision,
    Continuation,
    Event,
    Snapshot,
    State,
    arrivals,
    confirmed,
    snapshot_at,
)
from limitsets.systems.cells import CellSet

# ----------------------------------------------------------------
# Attractors of two places matched: where the sets overlap and one comes to rest at the other under the other's
# map.


# Of the extent of a side: sets this near overlap, and a set that moves by no more has only moved.
REACH = 0.02


class Group(NamedTuple):
    """Attractors that are matched with each other: positions in both snapshots."""

    before: tuple[int, ...]
    after: tuple[int, ...]

    @property
    def one_to_one(self) -> bool:
        """Whether one attractor goes on as one."""
        return len(self.before) == len(self.after) == 1


class Match(NamedTuple):
    """How the attractors of two places correspond.

    Attributes
    ----------
    groups : tuple of Group
        Every attractor is in one of them.
    smooth : bool
        Whether each goes on alone, with as many bands per side and the same period, and has moved but a little.
    """

    groups: tuple[Group, ...]
    smooth: bool


def distance(one: AttractorAtPlace, other: AttractorAtPlace) -> float:
    """Hausdorff distance of two sets along the sides; infinite where one is not on a side of the other."""
    if set(one.extents) != set(other.extents):
        return float("inf")
    return max(_directed(one, other), _directed(other, one))


def _directed(one: AttractorAtPlace, other: AttractorAtPlace) -> float:
    """Largest distance of a point of one set from the other."""
    farthest = 0.0
    for side, parts in one.extents.items():
        there = np.array(other.extents[side])
        # Between two bands of the other set the farthest point is the middle of the gap.
        gaps = 0.5 * (there[1:, 0] + there[:-1, 1])
        x = np.array([x for lo, hi in parts for x in (lo, hi, *gaps[(gaps > lo) & (gaps < hi)].tolist())])
        farthest = max(farthest, float(other.distance(x, np.full(x.size, side)).max()))
    return farthest


def _overlap(one: AttractorAtPlace, other: AttractorAtPlace, reach: float) -> bool:
    if one.cells is not None and other.cells is not None:
        return _share(*sorted((one.cells, other.cells), key=lambda each: each.grid.n_cells))
    return any(
        lo - reach <= top and bottom <= hi + reach
        for side, parts in one.extents.items()
        for lo, hi in parts
        for bottom, top in other.extents.get(side, ())
    )


def _share(coarse: CellSet, fine: CellSet) -> bool:
    """Whether the middle of a cell of one set lies in the other."""
    lo, hi, side = fine.grid.corners(fine.numbers())
    return bool(coarse.holds(0.5 * (lo + hi), side).any())


def _alike(one: AttractorAtPlace, other: AttractorAtPlace, reach: float) -> bool:
    if one.cells is not None:
        return True
    return one.period == other.period and one.bands == other.bands and distance(one, other) <= reach


def matched(before: Snapshot, after: Snapshot) -> Match:
    """Match the attractors of two places."""
    import networkx as nx

    reach = REACH * before.place.extent
    pairs: nx.Graph = nx.Graph()
    pairs.add_nodes_from((0, i) for i in range(len(before.attractors)))
    pairs.add_nodes_from((1, j) for j in range(len(after.attractors)))
    ahead = [arrivals(each, after, reach) for each in before.attractors]
    back = [arrivals(each, before, reach) for each in after.attractors]
    pairs.add_edges_from(
        ((0, i), (1, j))
        for i, one in enumerate(before.attractors)
        for j, other in enumerate(after.attractors)
        if (ahead[i] == {j} or back[j] == {i}) and _overlap(one, other, reach)
    )
    groups = sorted(
        Group(*(tuple(sorted(k for which, k in part if which == side)) for side in (0, 1)))
        for part in nx.connected_components(pairs)
    )
    smooth = all(
        group.one_to_one
        and _alike(before.attractors[group.before[0]], after.attractors[group.after[0]], reach)
        for group in groups
    )
    return Match(tuple(groups), smooth)


# ----------------------------------------------------------------
# Steps along a path: halved until attractors go on one to one, or what happens is bracketed.


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
        self.match = cache(matched)  # of two places, found once
        self.sure: dict[float, bool] = {}
        self.met: list[Met] = []
        self.left = most

    def at(self, t: float) -> Snapshot:
        """Snapshot at t, found once."""
        if t not in self.snapshots:
            self.snapshots[t] = snapshot_at(self.path.at(t), self.cells)
            self.left -= 1
        return self.snapshots[t]

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
            snapshot = confirmed(self.at(t))
            self.sure[t] = snapshot is not None
            if snapshot is not None:
                self.snapshots[t] = snapshot
        return self.sure[t]

    def _middle(self, lo: Snapshot, hi: Snapshot) -> float | None:
        """Place at which to cut a step; on cells, finer cells have to confirm the place.  None without such a place."""
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
            known = bracket in [met.t for met in self.met]
            if not known and all(each.decided(self.path.at(t)) for t in bracket):
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
            if self.match(a, b).smooth and self.match(b, c).smooth:
                for each in approaches(self.path, a, c):
                    touch = nearest(each, middle)
                    if touch is not None:
                        self._touched(each, (before, middle, after), *touch)

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


# ----------------------------------------------------------------
# Events: what happens between two steps, in words, with the numbers of the attractors concerned.


def numbered(follower: Follower) -> list[list[int]]:
    """Give every attractor at every step its number."""
    steps = [follower.at(t) for t in sorted(follower.snapshots)]
    numbers = [list(range(len(steps[0].attractors)))]
    unused = count(len(steps[0].attractors))
    for before, after in pairwise(steps):
        given = [-1] * len(after.attractors)
        for group in follower.match(before, after).groups:
            old = [numbers[-1][position] for position in group.before]
            for position in group.after:
                given[position] = old.pop(0) if old else next(unused)
        numbers.append(given)
    return numbers


def _change(one: AttractorAtPlace, other: AttractorAtPlace) -> str:
    before, after = State.of(one).words(), State.of(other).words()
    if before.removeprefix(LEAST) != after.removeprefix(LEAST):
        return f"{before} -> {after}"
    return f"bands {one.bands} -> bands {other.bands}" if one.bands != other.bands else ""


def _whereto(attractor: AttractorAtPlace, there: Snapshot, numbers: list[int], reach: float) -> str:
    """Say where the states of an attractor go at the other end of a bracket."""
    ends = arrivals(attractor, there, reach)
    words = [f"attractor {numbers[position]}" for position in sorted(ends) if position >= 0]
    words += ["an exit"] if -2 in ends else []
    return " and ".join(words) or "no attractor within 1000 steps"


class _Between(NamedTuple):
    """Two steps in turn, with the numbers of their attractors."""

    before: Snapshot
    after: Snapshot
    old: list[int]
    new: list[int]

    def event(self, kind: str, group: Group, change: str, jump: float | None, met: Met | None) -> Event:
        first, last = self.before.place, self.after.place
        return Event(
            kind=kind,
            t=(first.t, last.t) if met is None else met.t,
            values=(first.values, last.values),
            before=tuple(self.old[position] for position in group.before),
            after=tuple(self.new[position] for position in group.after),
            change=change,
            jump=jump,
            collision=None if met is None else met.collision,
            words=between(first, last),
        )

    def of_group(self, group: Group, met: Met | None) -> Event | None:
        """Tell what happens to one group of attractors, None for nothing."""
        reach = REACH * self.before.place.extent
        if group.one_to_one:
            one, other = self.before.attractors[group.before[0]], self.after.attractors[group.after[0]]
            jump = 0.0 if one.cells is not None else distance(one, other)
            change = "" if one.cells is not None else _change(one, other)
            if met is not None:
                return self.event(met.kind, group, change, jump, met)
            if not change and jump <= reach:
                return None
            return self.event("bands" if change else "jump", group, change, jump, None)
        one_side = [self.before.attractors[k] for k in group.before] or [
            self.after.attractors[k] for k in group.after
        ]
        words = " and ".join(State.of(each).words() for each in one_side)
        if not group.after:
            goes = _whereto(one_side[0], self.after, self.new, reach)
            return self.event("death", group, f"{words}, its states come to {goes}", None, met)
        if not group.before:
            came = _whereto(one_side[0], self.before, self.old, reach)
            return self.event("birth", group, f"{words}, its states came to {came}", None, met)
        others = " and ".join(State.of(self.after.attractors[k]).words() for k in group.after)
        change = f"{words} -> {others}"
        kind = "merge" if len(group.before) >= len(group.after) else "split"
        return self.event(kind, group, change, None, met)


def events_of(follower: Follower, numbers: list[list[int]]) -> tuple[Event, ...]:
    """Tell all events along the path."""
    steps = sorted(follower.snapshots)
    place_of = {t: k for k, t in enumerate(steps)}
    events: list[Event] = []
    for k, (lo, hi) in enumerate(pairwise(steps)):
        if not (follower.is_sure(lo) and follower.is_sure(hi)):
            continue
        pair = _Between(follower.at(lo), follower.at(hi), numbers[k], numbers[k + 1])
        here = [met for met in follower.met if met.t == (lo, hi)]
        for group in follower.match(pair.before, pair.after).groups:
            mine: list[Met | None] = [
                met for met in here if met.owner[1] in (group.before if met.owner[0] == lo else group.after)
            ]
            events += [event for met in mine or [None] if (event := pair.of_group(group, met)) is not None]
    for met in follower.met:
        if place_of[met.t[1]] != place_of[met.t[0]] + 1:  # a touch, with steps in its bracket
            number = [numbers[place_of[met.owner[0]]][met.owner[1]]]
            one, other = (follower.at(t) for t in met.t)
            pair = _Between(one, other, number, number)
            events.append(pair.event(met.kind, Group((0,), (0,)), "", 0.0, met))
    return tuple(sorted(events, key=lambda event: event.t))


# ----------------------------------------------------------------
# Following attractors along a path: the public call.


@shown_in_notebooks
@arguments_checked
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
    follower = Follower(curve, cells, most)
    grid = np.linspace(0.0, 1.0, steps + 1).tolist()
    tell = progress or silent
    for k, (first, last) in enumerate(pairwise(grid)):
        tell("steps", k, steps)
        follower.step(first, last)
    follower.touches()
    follower.settle()
    tell("steps", steps, steps)
    return _answer(curve, follower)


def _answer(curve: Path, follower: Follower) -> Continuation:
    numbers = numbered(follower)
    visited = [follower.at(t) for t in sorted(follower.snapshots)]
    return Continuation(
        name=curve.name,
        unit=curve.unit,
        t=np.array([each.t for each in visited]),
        values={
            name: np.array([each.place.values[name] for each in visited]) for name in visited[0].place.values
        },
        attractors=tuple(
            {
                number: State.of(attractor)
                for number, attractor in sorted(zip(row, each.attractors, strict=True), key=itemgetter(0))
            }
            for row, each in zip(numbers, visited, strict=True)
        ),
        critical=tuple(_critical(each) for each in visited),
        events=events_of(follower, numbers),
        evaluations=len(visited),
    )


def _critical(snapshot: Snapshot) -> dict[int, tuple[float, ...]]:
    if not snapshot.place.on_line:
        return {}
    critical = [border for border in snapshot.place.borders if border.kind == "critical"]
    return {
        side: tuple(border.x_above for border in critical if border.side == side)
        for side in snapshot.place.forward.pieces
    }
