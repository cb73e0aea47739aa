"""A policy thrown many times with noise and errors of the sensor; and starts from which no policy can do it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.base import AnswerError, Progress, silent
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scattering import uniform_starts
from limitsets.feeder.scene import BeyondSensor, SideSensor
from limitsets.proofs.policies.policy import NONE
from limitsets.proofs.policies.synthesis import Synthesis
from limitsets.proofs.prover.parameters import ParameterBox, parameter_box
from limitsets.systems.graph.images.enclosed import DECIDED, BoxImages
from limitsets.systems.maps import images

# ----------------------------------------------------------------
# Proof that no policy serves some starts: the same game on finitely many starts, whose images are enclosed.
#
# On cells, which are outer images, a policy may fail that works in fact.  Here a belief is a set of single starts that
# saw the same throws and answers.  A start is taken out where an answer, a decision or the goal region is not certain;
# this makes the game easier.  So if these starts are not won within n throws, no policy wins them in n throws, nor any
# set of starts that holds them.


BEAT = 16


@dataclass(frozen=True, eq=False)
class Impossible:
    """A proved number of throws within which no policy serves some starts.

    Attributes
    ----------
    throws : int
        No policy of so many throws serves all of the starts; -1 if nothing was shown.
    starts : tuple of (float, int)
        x and side [length].
    decided : bool
        False where the time was used up, or where the starts were won, within one throw more than `throws`.
    beliefs : int
        Sets of starts looked at.
    """

    throws: int
    starts: tuple[tuple[float, int], ...]
    decided: bool
    beliefs: int


@dataclass(frozen=True, eq=False)
class _Parts:
    """Where the starts are now: brackets of x, and the side of each."""

    lo: Array
    hi: Array
    side: Ints

    def some(self, which: Mask) -> _Parts:
        return _Parts(self.lo[which], self.hi[which], self.side[which])


class _Enclosed:
    """A search of policies; it ends with a TimeoutError once its time is used up."""

    def __init__(self, synthesis: Synthesis, boxes: Sequence[ParameterBox], until: float) -> None:
        self.synthesis, self.boxes, self.until, self.seen = synthesis, boxes, until, 0

    def may_be_won(self, parts: _Parts) -> Mask:
        x, side = self.synthesis.goal
        return np.asarray((parts.hi >= x) & (parts.side == side))

    def thrown(self, parts: _Parts, box: ParameterBox) -> _Parts | None:
        """Throw all; None where one is certainly lost."""
        lo, hi, side = parts.lo.copy(), parts.hi.copy(), parts.side.copy()
        sure = np.zeros(side.size, dtype=bool)
        for own in np.unique(side).tolist():
            some = np.flatnonzero(parts.side == own)
            boxes = BoxImages(box.lo, box.hi, own, (parts.lo[some],), (parts.hi[some],))
            lo[some], hi[some] = boxes.slots[0][0][0], boxes.slots[0][1][0]
            side[some], sure[some] = boxes.to[0], boxes.count == DECIDED
        bare_lo, bare_hi = box.bare
        a_lo, a_hi = bare_lo.a[side], bare_hi.a[side]
        gone = (hi <= a_lo) | (lo > bare_hi.arm_length)
        stays = (lo > a_hi) & (hi <= bare_lo.arm_length)
        x, wanted = self.synthesis.goal
        if self.synthesis.mode == "catch":
            gone |= (lo >= x) & (side != wanted)
            stays &= (hi < x) | ((lo >= x) & (side == wanted))
        if (sure & gone).any():
            return None
        return _Parts(lo, hi, side).some(sure & stays)

    def heard(self, parts: _Parts) -> list[_Parts]:
        """Give the parts of which each answer may certainly come, those that are caught left out."""
        if self.synthesis.mode == "catch":
            parts = parts.some(~self.may_be_won(parts))
        sensor = self.synthesis.sensor
        if isinstance(sensor, SideSensor):
            on = parts.side == sensor.side
            return [parts.some(on), parts.some(~on)]
        if isinstance(sensor, BeyondSensor):
            low = np.nextafter(sensor.x - sensor.error, np.inf)
            high = np.nextafter(sensor.x + sensor.error, -np.inf)
            if not sensor.error:
                low = high = sensor.x
            return [parts.some(parts.lo > low), parts.some(parts.hi <= high)]
        return [parts]

    def won(self, parts: _Parts, left: int) -> bool:
        """Whether a policy of so many throws may serve all of them, after an answer."""
        inside = self.may_be_won(parts)
        if inside.all():  # of none too
            return True
        if left == 0:
            return False
        self.seen += 1
        if self.seen % BEAT == 0 and time.monotonic() > self.until:
            raise TimeoutError
        for after in filter(None, (self.thrown(parts, box) for box in self.boxes)):
            heard = sorted(self.heard(after), key=lambda each: -each.side.size)
            if all(self.won(each, left - 1) for each in heard):
                return True
        return False


def not_within(
    synthesis: Synthesis,
    starts: Sequence[tuple[float, int]],
    throws: int | None = None,
    *,
    seconds: float = 60.0,
    progress: Progress | None = None,
) -> Impossible:
    """Show that no policy of so many throws serves some starts; without noise, which makes it no easier.

    Parameters
    ----------
    synthesis : Synthesis
        The question: throws, sensor, mode and goal.
    starts : sequence of (float, int)
        x and side of each start, all of them in the starts of the question [length].
    throws : int, optional
        The most throws; default: one more than the search on cells got to.
    seconds : float
        The most time [s].
    progress : callable, optional
        Told the step, its number and how many there are.

    Returns
    -------
    Impossible

    Raises
    ------
    AnswerError
        For a start that is not one of the question.
    """
    for x, side in starts:
        if not (0 <= side < synthesis.grid.sides and synthesis.starts.holds([x], side)[0]):
            raise AnswerError("the start", (x, side), "one of the starts of the question", "choose another")
    scene = synthesis.scene
    assert scene.feedback is not None
    boxes = [parameter_box(scene.with_values({each.quantity: each.text})) for each in scene.feedback.throws]
    most = synthesis.found.throws + 1 if throws is None else throws
    places = np.array([at for at, _ in starts], dtype=np.float64)
    begin = _Parts(places, places.copy(), np.array([side for _, side in starts], dtype=np.int64))
    run, shown, decided = _Enclosed(synthesis, boxes, time.monotonic() + seconds), -1, True
    try:
        for left in range(most + 1):
            (progress or silent)(f"enclosed starts, {left} throws", left, most + 1)
            if all(run.won(each, left) for each in run.heard(begin)):
                decided = False
                break
            shown = left
    except TimeoutError:
        decided = False
    return Impossible(shown, tuple((float(at), int(side)) for at, side in starts), decided, run.seen)


# ----------------------------------------------------------------
# A policy thrown many times: random starts, noise anywhere in its bounds and at them, errors of the sensor too.


# Kappas drawn for each throw, the two ends of its noise among them.
KAPPAS = 16


@dataclass(frozen=True, eq=False)
class Simulated:
    """What became of the parts.

    Attributes
    ----------
    parts : int
        How many were started.
    reached : int
        Those that came to the goal region, and where the controller stops, were known to be there.
    failures : dict of str to int
        What happened to the others.
    throws : ndarray of int, shape (most throws + 1,)
        How many of those that came took 0, 1, ... throws.
    """

    parts: int
    reached: int
    failures: dict[str, int]
    throws: Ints

    @property
    def mean(self) -> float:
        """Mean number of throws of those that came."""
        return float(np.average(np.arange(self.throws.size), weights=self.throws)) if self.reached else np.nan


def simulate(synthesis: Synthesis, parts: int = 10_000, seed: int = 0) -> Simulated:
    """Run a policy with throws of the map itself.

    Parameters
    ----------
    synthesis : Synthesis
        A policy that was found.
    parts : int
        How many parts to start, equally likely per length of the starts.
    seed : int
        Of the random numbers.

    Returns
    -------
    Simulated

    Raises
    ------
    AnswerError
        Where there is no policy.
    """
    policy = synthesis.require_policy()
    random = np.random.default_rng(seed)
    x, side = _drawn(synthesis, parts, random)
    state = policy.first[_heard(synthesis, x, side, random)]
    took, ends = np.zeros(parts, np.int64), np.full(parts, "", dtype=object)
    moving = np.ones(parts, dtype=bool)
    for made in range(int(policy.left.max()) + 1):
        unknown = moving & (state == NONE)
        ends[unknown] = "an answer that cannot come"
        stops = moving & ~unknown & (policy.throw[state] == NONE)
        ends[stops & ~((x >= synthesis.goal[0]) & (side == synthesis.goal[1]))] = "stopped elsewhere"
        moving &= ~(unknown | stops)
        if not moving.any():
            break
        took[moving] = made + 1
        for throw, box in enumerate(synthesis.throws.values()):
            now = np.flatnonzero(moving & (policy.throw[state] == throw))
            x[now], side[now], code = _thrown(box, x[now], side[now], random)
            ends[now[code < 0]] = "left the arm"
            moving[now[code < 0]] = False
        if synthesis.mode == "catch":
            fallen = moving & (x >= synthesis.goal[0])
            ends[fallen & (side != synthesis.goal[1])] = "caught on a wrong side"
            moving &= ~fallen
        state = np.where(moving, policy.after[state, _heard(synthesis, x, side, random)], state)
    ends[moving] = "more throws than promised"
    good = ends == ""
    kinds, counts = np.unique(ends[~good].astype(str), return_counts=True)
    return Simulated(
        parts,
        int(good.sum()),
        dict(zip(kinds.tolist(), counts.tolist(), strict=True)),
        np.bincount(took[good], minlength=int(policy.left.max()) + 1),
    )


def _drawn(synthesis: Synthesis, parts: int, random: np.random.Generator) -> tuple[Array, Ints]:
    """Draw starts, equally likely per length."""
    spans = [(side, lo, hi) for side, pairs in synthesis.starts.extents().items() for lo, hi in pairs]
    side, lo, hi = (np.array(column) for column in zip(*spans, strict=True))
    return uniform_starts(random, lo, hi, parts, side)


def _heard(synthesis: Synthesis, x: Array, side: Ints, random: np.random.Generator) -> Any:
    """Read the sensor: the numbers of the answers."""
    if synthesis.sensor is None:
        return np.zeros(x.size, np.int64)
    yes = synthesis.sensor.read(x, side, random.uniform(-1.0, 1.0, x.size))
    words = list(synthesis.game.answers)
    return np.where(yes, words.index("yes"), words.index("no"))


def _thrown(box: Any, x: Array, side: Ints, random: np.random.Generator) -> tuple[Array, Ints, Ints]:
    """Throw parts, each with a kappa of the box; where they come to rest, and the codes."""
    low, high = box.bare[0].kappa, box.bare[1].kappa
    between = random.uniform(low, high, KAPPAS - 2).tolist() if box.kappa_varies else []
    kappas: Sequence[float] = [low, high, *between] if between else [box.middle_kappa]
    drawn = random.integers(len(kappas), size=x.size)
    after, to, code = x.copy(), side.copy(), np.zeros(x.size, np.int64)
    for k, kappa in enumerate(kappas):
        for own in np.unique(side[drawn == k]).tolist():
            some = (drawn == k) & (side == own)
            landed = images(box.at_kappa(kappa), x[some], own)
            after[some], to[some], code[some] = landed.x, landed.side, landed.code
    if box.landing:
        after += box.landing * np.clip(random.uniform(-1.25, 1.25, x.size), -1.0, 1.0)
    return after, to, code
