"""Events: what happens between two steps, in words, with the numbers of the attractors concerned."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

from limitsets.sweep.continuation.matching import REACH, Group, distance
from limitsets.sweep.continuation.path import between
from limitsets.sweep.continuation.result import LEAST, Event, State
from limitsets.sweep.continuation.snapshot import Found, Snapshot, arrivals
from limitsets.sweep.continuation.stepping import Follower, Met


def numbered(follower: Follower) -> list[list[int]]:
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
    if before.removeprefix(LEAST) != after.removeprefix(LEAST):
        return f"{before} -> {after}"
    return f"bands {one.bands} -> bands {other.bands}" if one.bands != other.bands else ""


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

    def event(self, kind: str, group: Group, change: str, jump: float | None, met: Met | None) -> Event:
        t = (self.before.t, self.after.t) if met is None else met.t
        values = self.before.place.values, self.after.place.values
        before = tuple(self.old[position] for position in group.before)
        after = tuple(self.new[position] for position in group.after)
        collision = None if met is None else met.collision
        words = between(self.before.place, self.after.place)
        return Event(kind, t, values, before, after, change, jump, collision, words)

    def of_group(self, group: Group, met: Met | None) -> Event | None:
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


def events_of(follower: Follower, numbers: list[list[int]]) -> tuple[Event, ...]:
    """Tell all events along the path."""
    steps = sorted(follower.snapshots)
    place_of = {t: k for k, t in enumerate(steps)}
    found: list[Event] = []
    for k, (lo, hi) in enumerate(pairwise(steps)):
        if not (follower.is_sure(lo) and follower.is_sure(hi)):
            continue
        pair = _Between(follower.at(lo), follower.at(hi), numbers[k], numbers[k + 1])
        here = [met for met in follower.met if met.t == (lo, hi)]
        for group in follower.match(pair.before, pair.after).groups:
            mine: list[Met | None] = [
                met for met in here if met.owner[1] in (group.before if met.owner[0] == lo else group.after)
            ]
            found += [event for met in mine or [None] if (event := pair.of_group(group, met)) is not None]
    for met in follower.met:
        if place_of[met.t[1]] != place_of[met.t[0]] + 1:  # a touch, with steps in its bracket
            number = numbers[place_of[met.owner[0]]][met.owner[1]]
            one, other = (follower.at(t).place for t in met.t)
            values, words = (one.values, other.values), between(one, other)
            found.append(Event(met.kind, met.t, values, (number,), (number,), "", 0.0, met.collision, words))
    return tuple(sorted(found, key=lambda event: event.t))
