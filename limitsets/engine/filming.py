"""Poses and marks of a crowd, kept while it moves."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np

from limitsets.engine.ground import Ground
from limitsets.engine.member import OUT, Member
from limitsets.engine.recording import Mark, Recording
from limitsets.engine.rests import Rest


class Film:
    """Frames and marks; where nothing is to be kept, it only counts the time.

    Attributes
    ----------
    on : bool
        Whether to keep anything.
    unit : float
        Seconds per rad of the throw's turn, 1 where they are not known.
    start : float
        When the present throw began, in these.
    """

    def __init__(self, on: bool, unit: float, members: Sequence[Member]) -> None:
        self.on, self.unit, self.start, self.members = on, unit, 0.0, members
        self.frames: list[tuple[float, list[tuple[float, float, float]]]] = []
        self.marks: list[Mark] = []
        self.inside: set[int] = set()  # the parts in the cavity

    def mark(self, time: float, numbers: Iterable[int], word: str) -> None:
        """Keep what happens to parts, so long after the throw began [rad]."""
        if self.on:
            self.marks += [(self.start + time * self.unit, number, word) for number in numbers]

    def frame(self, time: float) -> None:
        """Keep where all are."""
        if self.on:
            poses = [(math.nan,) * 3 if each.mode == OUT else each.pose() for each in self.members]
            self.frames.append((self.start + time * self.unit, poses))

    def end(self, time: float, rests: Iterable[Rest]) -> None:
        """Keep where all have come to rest; the next throw begins there."""
        self.frame(time)
        inside = set()
        for rest in rests:
            still = (
                rest.where == "unfinished" and rest.number in self.inside
            )  # in motion: it has not come out
            if rest.where == "cavity" or still:
                inside.add(rest.number)
            elif rest.number in self.inside and rest.where != "out":
                self.mark(time, [rest.number], "ejected")
            if rest.where in ("arm", "beyond", "leaning"):
                self.mark(time, [rest.number], "rest")
        self.mark(time, sorted(inside - self.inside), "in the cavity")
        self.inside = inside
        self.start += time * self.unit

    def recording(self, ground: Ground) -> Recording:
        """Give what was kept."""
        times = np.array([time for time, _ in self.frames])
        poses = np.array([pose for _, pose in self.frames]).reshape(times.size, len(self.members), 3)
        outlines = tuple(np.array(each.corners) for each in self.members)
        return Recording(times, poses, outlines, ground.polygons, np.zeros(times.size), tuple(self.marks))
