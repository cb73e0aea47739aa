"""Many parts on a tray at once, pass after pass, in the engine: they push each other or pass through; and counts.

In each pass the plate is kicked, and then all parts come by together, spread evenly over the depressions.  What is
assumed: docs/tray.md.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from limitsets.base import AnswerError, as_table, picked
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.base.campaign import Row
from limitsets.cell.trays.passing import Passes, random_of
from limitsets.feeder.engine import Crowd, Recording
from limitsets.feeder.engine.depression import EMPTY, FAR, Motion, Pose, state_of
from limitsets.parameters.noise.sampling import binomial_interval

# The stream of random numbers, beside those of `histories` and `filming`.
CROWD = 10_004
# Parts that the engine holds ready for each depression beside those that come by; so many never lie in one.
ROOM = 4


@dataclass(frozen=True)
class Pouring:
    """What is asked, as workers are sent it.

    Attributes
    ----------
    asked : Passes
        The plate and the laws.
    parts, depressions, passes : int
        Parts that come by in each pass, together; depressions side by side; passes.
    seed : int
        Batch k of a seed draws the same whatever the workers.
    """

    asked: Passes
    parts: int
    depressions: int
    passes: int
    seed: int

    def __post_init__(self) -> None:
        if self.parts < 1 or self.depressions < 1:
            asked = (self.parts, self.depressions)
            raise AnswerError("the parts and depressions", asked, "1 or more", "let some parts come by")

    def question(self) -> dict[str, Any]:
        """Give what is asked, for the file of the batches."""
        return {
            "scene": self.asked.plate.part.as_dict(),
            "side": self.asked.side,
            "step": self.asked.plate.step,
            **picked(self, "parts", "depressions", "passes", "seed"),
        }

    def row(self, number: int) -> Row:
        """Make a batch twice: parts that push each other, and parts that pass through each other."""
        return {name: self._run(number, name == "pushing") for name in ("pushing", "passing")}

    def film(self, number: int, *, between: bool = True, last: int = 1) -> Recording:
        """Make a batch again, and keep the poses of its last passes; x from the tray's near end."""
        tray = self._shaken(number, between, last)
        kept, ahead = tray.crowd.recording(), (tray.far, 0.0)
        ground = tuple(corners - ahead for corners in kept.ground)
        return replace(kept, poses=kept.poses - (*ahead, 0.0), ground=ground)

    def _run(self, number: int, between: bool) -> dict[str, Any]:
        began = time.thread_time()
        tray = self._shaken(number, between)
        return {
            "states": tray.seen,
            "met": bool(tray.crowd.overlapped),
            "unfinished": tray.unfinished,
            "moved": tray.moved,
            "seconds": time.thread_time() - began,
        }

    def _shaken(self, number: int, between: bool, filmed: int = 0) -> _Strewn:
        tray = _Strewn(self, between)
        for k in range(self.passes):
            tray.crowd.film.on = k >= self.passes - filmed
            random = random_of(self.seed, CROWD, number, k)
            first = int(random.integers(self.depressions))
            came = [self.asked.arrival(random) for _ in range(self.parts)]  # the same in both runs
            tray.kick(random)
            tray.pour(first, came)
        return tray


class _Strewn:
    """Depressions side by side, and the parts on them."""

    def __init__(self, pouring: Pouring, between: bool) -> None:
        self.asked, self.between, self.depressions = pouring.asked, between, pouring.depressions
        plate, self.pitch = self.asked.plate, self.asked.tray.pitch
        self.far = FAR * plate.size
        long = 2.0 * self.far + self.depressions * self.pitch
        # gravity and the unit of time of one depression
        part = replace(plate.part, kappa=plate.size, surface_height=0.0, arm_length=long, cavity=None)
        lefts = [self.middle(k) - 0.5 * plate.width for k in range(self.depressions)]
        self.crowd = Crowd(
            [part] * (pouring.parts + ROOM * self.depressions),
            contact="unilateral",
            between=between,
            watch=False,
            friction=plate.friction,
            sliding=plate.friction,
            restitution=plate.restitution,
            step=plate.step,
            patience=plate.patience,
            depressions=[(left, plate.width, plate.outline or plate.depth) for left in lefts],
        )
        self.lies: dict[int, tuple[int, int]] = {}  # by part the depression in which it lies, and how
        self.seen = [self.states()]
        self.unfinished = self.moved = 0

    def middle(self, depression: int) -> float:
        """Where the middle of a depression is."""
        return self.far + (depression + 0.5) * self.pitch

    def kick(self, random: np.random.Generator) -> None:
        """Kick all parts that lie in depressions, each with a draw of its own."""
        if not self.lies:
            return
        for number in self.lies:
            self._push(number, self.asked.kick(random))
        self.crowd.film.mark(0.0, self.lies, "thrown")
        self._settle()

    def pour(self, first: int, came: Sequence[tuple[Pose, Motion]]) -> None:
        """Let parts come by, one over each depression in turn, over what is in the way."""
        members = self.crowd.members
        ready = [number for number in range(len(members)) if number not in self.lies]
        boxes = [_box(members[number].world()) for number in self.lies]
        for k, (number, (pose, motion)) in enumerate(zip(ready, came, strict=False)):
            x = pose.x + self.middle((first + k) % self.depressions)
            members[number].stand((x, pose.y, pose.angle))
            left, right, low, high = _box(members[number].world())
            tops = [box[3] for box in boxes if box[0] < right and left < box[1]] if self.between else []
            rise = max([0.0, *(top - low for top in tops)])
            boxes.append((left, right, low + rise, high + rise))
            self.crowd.drop(number, (x, pose.y + rise, pose.angle))
            self._push(number, motion)
        self._settle()
        self.seen.append(self.states())

    def states(self) -> list[int]:
        """Count depressions: filled rightly, filled rightly under other parts, with wrong parts only."""
        held: list[list[int]] = [[] for _ in range(self.depressions)]
        for depression, state in self.lies.values():
            held[depression].append(state)
        right = held.count([self.asked.right])
        covered = sum(self.asked.right in each for each in held) - right
        return [right, covered, sum(map(bool, held)) - right - covered]

    def _push(self, number: int, motion: Motion) -> None:
        body = self.crowd.members[number].body
        body.velocity, body.angular_velocity = (motion.along, motion.up), motion.turning
        self.moved += 1

    def _settle(self) -> None:
        """Wait until all are at rest, and take out what lies in no depression."""
        plate, before = self.asked.plate, self.lies
        rests = self.crowd.settle()
        self.lies, taken = {}, set()
        self.unfinished += sum(rest.where == "unfinished" for rest in rests)
        # the parts that were in depressions before those that come by
        for rest in sorted(rests, key=lambda rest: rest.number not in before):
            member = self.crowd.members[rest.number]
            if rest.where in ("out", "lost"):
                continue
            corners = member.world()
            heights = [y for _, y in corners]
            state, _ = state_of(heights, rest.pose[2], member.flat, plate.depth, plate.size)
            x = corners[heights.index(min(heights))][0]
            depression = int((x - self.far) // self.pitch)
            # parts that pass through each other find a depression taken, and pass on
            if state == EMPTY or (depression in taken and not self.between):
                self.crowd.take(rest.number)
            else:
                self.lies[rest.number] = depression, state
                taken.add(depression)


def _box(corners: Sequence[tuple[float, float]]) -> tuple[float, float, float, float]:
    """From where to where a part reaches: left, right, low, high."""
    xs, ys = zip(*corners, strict=True)
    return min(xs), max(xs), min(ys), max(ys)


# ----------------------------------------------------------------
# Many parts on a tray at once, counted: fractions of the depressions, pass by pass, and what they cost.


@dataclass(frozen=True, eq=False)
class TrayCrowd:
    """How depressions fill by which many parts come at once; counted.

    Attributes
    ----------
    parts, depressions : int
        Parts that come by in each pass, together; depressions of the tray.
    between : bool
        Whether the parts push each other.
    right, covered, wrong : ndarray of int64, shape (batches, passes + 1)
        Depressions after 0, 1, ... passes: with one part, that lies rightly; with one that does under others; with
        wrong parts only.
    met : ndarray of bool, shape (batches,)
        Whether two parts pushed each other.
    unfinished : int
        Motions after which a part was not at rest when patience ended; it counts as it lay.
    moved : int
        Parts kicked or coming by, each counted in each pass.
    seconds : float
        Processor time of the passes.
    seed : int
        Of all draws.
    """

    parts: int
    depressions: int
    between: bool
    right: Ints
    covered: Ints
    wrong: Ints
    met: Mask
    unfinished: int
    moved: int
    seconds: float
    seed: int

    @property
    def words(self) -> str:
        """How the parts meet, in words."""
        return "pushing" if self.between else "passing through"

    def share(self, counts: Ints) -> tuple[Array, Array]:
        """Give fractions of the depressions after 0, 1, ... passes, and their intervals of 95 %.

        Depressions of one batch depend on each other: the interval is the wider of Student's between batches and that
        of independent depressions.
        """
        from scipy.stats import t

        batches = counts.shape[0]
        each = counts / self.depressions
        mean = each.mean(axis=0)
        of = batches * self.depressions
        ends = np.array([binomial_interval(int(count), of) for count in counts.sum(axis=0)])
        if batches > 1:
            half = t.ppf(0.975, batches - 1) * each.std(axis=0, ddof=1) / np.sqrt(batches)
            ends[:, 0] = np.clip(np.minimum(ends[:, 0], mean - half), 0.0, 1.0)
            ends[:, 1] = np.clip(np.maximum(ends[:, 1], mean + half), 0.0, 1.0)
        return mean, ends

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        shares = {name: self.share(getattr(self, name)) for name in ("right", "covered", "wrong")}
        return as_table(
            parts=self.parts,
            depressions=self.depressions,
            between=self.between,
            contact="unilateral",
            batches=self.met.size,
            seed=self.seed,
            **{name: {"value": value, "interval": ends} for name, (value, ends) in shares.items()},
            met=float(self.met.mean()),
            unfinished=self.unfinished,
            moved=self.moved,
            seconds_per_part_and_pass=self.seconds / max(self.moved, 1),
        )


def crowds_of(pouring: Pouring, rows: Sequence[Row]) -> tuple[TrayCrowd, ...]:
    """Count batches: of parts that push each other, and of parts that pass through each other."""
    return tuple(_crowd_of(pouring, [row[name] for row in rows], name) for name in ("pushing", "passing"))


def _crowd_of(pouring: Pouring, rows: Sequence[Row], name: str) -> TrayCrowd:
    by_name = {key: [row[key] for row in rows] for key in rows[0]}
    right, covered, wrong = np.moveaxis(np.array(by_name["states"], dtype=np.int64), -1, 0)
    return TrayCrowd(
        pouring.parts,
        pouring.depressions,
        name == "pushing",
        right=right,
        covered=covered,
        wrong=wrong,
        met=np.array(by_name["met"]),
        **{key: sum(by_name[key]) for key in ("unfinished", "moved", "seconds")},
        seed=pouring.seed,
    )
