"""Many parts of one kind on the arm at once, thrown together in the rigid-body engine until they have fallen in.

Whatever lies in the cavity after a throw is taken out before the next one, the lowest part first, and counted by its
fate.  Parts that find no free place on the arm are dropped onto the others.  What is assumed: docs/many_parts.md.
"""

from __future__ import annotations

import functools
import math
import time
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.base import AnswerError, Progress, as_table, picked
from limitsets.base.arrays import Array, Ints, Mask
from limitsets.base.campaign import in_order
from limitsets.cell.feeding.falling import FATES, ArmEnd
from limitsets.feeder.engine import Crowd, Rest
from limitsets.feeder.engine.depression import SEATED, off_seat, seat_of
from limitsets.feeder.scattering import Gaussian, Law, Scattering, Uniform
from limitsets.parameters.noise.sampling import binomial_interval

BATCHES = 20
MOST_THROWS = 300
# A pile that has not come to rest after so long [rad] is thrown as it is.
PATIENCE = 20.0
# So often a place on the arm is drawn for a part before it is dropped from above.
DRAWS = 50
FRICTION = 0.5
"""On the arm, of scenes that give none: unilateral contact, and parts that are struck where they lie, need one."""
LAWS = (Gaussian, Uniform, type(None))


@dataclass(frozen=True, eq=False)
class CrowdTrials:
    """What batches of parts did that were thrown together; sampled.

    Attributes
    ----------
    parts : int
        In each batch.
    between : bool
        Whether the parts push each other.
    contact : str
        How the arm holds a struck corner: "hinge" or "unilateral" (`limitsets.engine.Crowd`).
    fates : ndarray of int64, shape (batches, 6)
        How many of those on the arm before the first throw met each fate of `FATES`; those of the last were on the arm
        still when throwing ended.
    throws : ndarray of int64, shape (batches,)
        Throws made: until all were out, or the most.
    spilled : ndarray of int64, shape (batches,)
        Parts that fell off the others before the first throw, into the cavity or off the arm; they are not counted.
    met : ndarray of bool, shape (batches,)
        Whether two parts pushed each other, from the first throw on.
    thrown : int
        Parts thrown, each counted at each throw.
    seconds : float
        Processor time that the throws took on this machine.
    seed : int
        Of starts and noise.
    """

    parts: int
    between: bool
    contact: str
    fates: Ints
    throws: Ints
    spilled: Ints
    met: Mask
    thrown: int
    seconds: float
    seed: int

    @property
    def counts(self) -> dict[str, int]:
        """How many met each fate."""
        return dict(zip(FATES, self.fates.sum(axis=0).tolist(), strict=True))

    @property
    def right_per_throw(self) -> tuple[float, float]:
        """Right feeds per throw, and the standard error from batch to batch (nan for one batch)."""
        right, made = self.fates[:, 0].astype(np.float64), self.throws.astype(np.float64)
        if not made.sum() > 0.0:
            return math.nan, math.nan
        rate, count = float(right.sum() / made.sum()), made.size
        spread = float((right - rate * made).std(ddof=1)) if count > 1 else math.nan
        return rate, spread / math.sqrt(count) / float(made.mean())

    def per_minute(self, rate: float | None) -> float | None:
        """Right feeds per minute at so many throws per second."""
        return None if rate is None else 60.0 * rate * self.right_per_throw[0]

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        total, (rate, error) = int(self.fates.sum()), self.right_per_throw
        return as_table(
            **picked(self, "parts", "between", "contact"),
            batches=self.throws.size,
            seed=self.seed,
            counts=self.counts,
            intervals={name: binomial_interval(met, total) for name, met in self.counts.items()},
            mean_throws=float(self.throws.mean()),
            spilled=float(self.spilled.mean()),
            met=float(self.met.mean()),
            right_per_throw={"value": rate, "error": error},
            thrown=self.thrown,
            seconds_per_part_and_throw=self.seconds / max(self.thrown, 1),
        )


def after_next_throw(end: ArmEnd) -> str | None:
    """Say where a part that lies in the cavity on the wanted side is after one more throw; sampled in the engine.

    Parameters
    ----------
    end : ArmEnd
        The end of the arm: its cavity is thrown with the arm, which stops at once.

    Returns
    -------
    str or None
        "seated": its corners are in their seat again; "moved": it lies in the cavity otherwise; "left": out of it, or
        in motion still. None where the part has no seat below the arm's surface, or without pymunk.
    """
    scene = end.scene
    cavity, friction = scene.cavity, scene.world.friction
    assert cavity is not None  # an ArmEnd has one
    try:
        seat = seat_of(scene, end.side)
        crowd = Crowd([scene], friction=FRICTION if friction is None else friction)
    except AnswerError:
        return None
    member = crowd.members[0]
    angle = member.flat[end.side] - cavity.angle
    radius, phase = member.polar[0]
    x, y = seat[0] - radius * np.array([math.cos(angle + phase), math.sin(angle + phase)])
    crowd.drop(0, (float(x), float(y), angle))
    crowd.settle()
    (rest,) = crowd.throw()
    if off_seat(member.world(), seat) <= SEATED * cavity.width:
        return "seated"
    return "moved" if rest.where == "cavity" else "left"


def run_crowd(
    end: ArmEnd,
    scatter: Scattering,
    parts: int,
    *,
    batches: int = BATCHES,
    between: bool = True,
    contact: str = "hinge",
    throws: int = MOST_THROWS,
    seed: int = 0,
    step: float = 4e-3,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> CrowdTrials:
    """Throw batches of parts until each part has met its fate.

    Parameters
    ----------
    end : ArmEnd
        The end of the arm, of a scene with ``effects.contact = true``.
    scatter : Scattering
        The noise: one deviation of the speed for all parts at every throw, a landing deviation for each part.
    parts, batches : int
        Parts thrown together, and how often that is tried.
    between, contact, step
        As in `limitsets.engine.Crowd`.
    throws : int
        Throws after which a batch ends.
    seed : int
        Of starts and noise: batch k draws from Philox of key (seed, k), the same with `between` and without.
    executor : concurrent.futures.Executor, optional
        Where the batches are thrown; default here. The numbers are the same.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    CrowdTrials

    Raises
    ------
    AnswerError
        Contact is off in the scene, no parts, laws that throws cannot draw from, or no pymunk.
    """
    if not end.scene.effects.contact:
        remedy = "add contact = true to [effects]: parts that pass through each other are those of trials"
        raise AnswerError("effects.contact", False, "true where parts are thrown together", remedy)
    if parts < 1 or batches < 1 or throws < 1:
        asked = f"{parts}, {batches}, {throws}"
        raise AnswerError("the parts, batches and throws", asked, "1 or more of each", "throw some parts")
    if not (isinstance(scatter.speed, LAWS) and isinstance(scatter.landing, LAWS) and scatter.tilt is None):
        allowed = "Gaussian or Uniform of speed and landing"
        raise AnswerError("the noise to throw with", scatter.words(), allowed, "take another law")
    how: dict[str, Any] = {"between": between, "contact": contact, "step": step}
    task = functools.partial(_thrown, end, scatter, parts, throws, seed, how)
    rows = in_order(f"{parts} parts at once", task, range(batches), executor, progress)
    fates, made, spilled, met, thrown, seconds = zip(*rows, strict=True)
    return CrowdTrials(
        parts,
        between,
        contact,
        fates=np.array(fates),
        throws=np.array(made),
        spilled=np.array(spilled),
        met=np.array(met),
        thrown=sum(thrown),
        seconds=sum(seconds),
        seed=seed,
    )


def _thrown(
    end: ArmEnd, scatter: Scattering, parts: int, throws: int, seed: int, how: dict[str, Any], batch: int
) -> tuple[list[int], int, int, bool, int, float]:
    """Throw one batch: fates, throws made, parts spilled, whether two met, parts thrown, processor time."""
    random = np.random.Generator(np.random.Philox(key=[seed, batch]))
    crowd = Crowd([end.scene] * parts, watch=False, patience=PATIENCE, **how)
    tried = _Batch(crowd, end, random)
    spilled = tried.start()
    began = time.thread_time()
    thrown = tried.throw(scatter, throws)
    seconds = time.thread_time() - began
    return tried.fates(), tried.throws, spilled, bool(crowd.overlapped), thrown, seconds


class _Batch:
    """Parts that are thrown together until all are out."""

    def __init__(self, crowd: Crowd, end: ArmEnd, random: np.random.Generator) -> None:
        self.crowd, self.end, self.random = crowd, end, random
        self.fate: dict[int, int] = {}
        self.spilled: frozenset[int] = frozenset()
        self.throws = 0

    def fates(self) -> list[int]:
        """How many met each fate, of those that were thrown."""
        met = [0] * len(FATES)
        for number in range(len(self.crowd.members)):
            if number not in self.spilled:
                met[self.fate.get(number, -1)] += 1
        return met

    def start(self) -> int:
        """Lay the parts on free places of the arm, drop those for which none is drawn; how many fall off again."""
        crowd, end, waiting = self.crowd, self.end, []
        row: list[tuple[float, float]] = []  # the ends of the sides that lie on the arm
        d = end.scene.sides.d
        for number in range(len(crowd.members)):
            for _ in range(DRAWS):
                xs, sides = end.drawn(self.random, 1)
                x, side = float(xs[0]), int(sides[0])
                lo, hi = self._reach(x, side)
                if all(hi <= left or right <= lo for left, right in row):
                    row.append((lo, hi))
                    crowd.place(number, x, side)
                    break
            else:
                waiting.append((number, x, side))
        reach = crowd.members[0].reach
        for number, x, side in waiting:
            tops = [y for each in crowd.members if each.mode != "out" for _, y in each.world()]
            height = max(tops, default=end.scene.surface_height) + reach
            crowd.drop(number, (x, height + float(d[side]), crowd.members[number].flat[side]))
            self._take_out(crowd.settle())
        crowd.overlapped.clear()
        self.spilled = frozenset(self.fate)
        return len(self.spilled)

    def _reach(self, x: float, side: int) -> tuple[float, float]:
        """From where to where a part reaches along the arm that lies on this side."""
        member = self.crowd.members[0]
        across = [radius * math.cos(member.flat[side] + phase) for radius, phase in member.polar]
        return x + min(across), x + max(across)

    def throw(self, scatter: Scattering, most: int) -> int:
        """Throw until all are out; how many parts were thrown, each counted at each throw."""
        crowd, thrown = self.crowd, 0
        parts = len(crowd.members)
        while self.throws < most and len(self.fate) < parts:
            thrown += parts - len(self.fate)
            deviation = _drawn(self.random, scatter.speed, 1)[0]
            shifts = _drawn(self.random, scatter.landing, parts)
            self.throws += 1
            # what a throw does that acts beyond the end of the arm is not simulated
            for rest in crowd.rests():
                on_arm = rest.where == "arm" and rest.number not in self.fate
                if on_arm and self.end.at_edge(rest.x, rest.side):
                    self._take(rest.number, "edge")
            self._take_out(crowd.throw(float(deviation), shifts.tolist()))
        return thrown

    def _take(self, number: int, fate: str) -> None:
        """Count a part and take it out, the first time that it is seen there."""
        self.fate[number] = FATES.index(fate)
        self.crowd.take(number)

    def _take_out(self, rests: list[Rest]) -> None:
        """Count and take out what lies in the cavity, the lowest first, as more slides down; and what has left."""
        while True:
            for rest in rests:
                # in the map a part is off the arm from a of the side down that it lies on
                least = float(self.end.scene.sides.a[rest.side]) if rest.side >= 0 else 0.0
                gone = rest.where in ("arm", "leaning") and rest.x <= least
                if rest.number not in self.fate and (rest.where == "lost" or gone):
                    self._take(rest.number, "left")
            fallen = [rest for rest in rests if rest.where == "cavity"]
            if not fallen:
                return
            lowest = min(fallen, key=lambda rest: rest.pose[1])
            word = "wall" if lowest.side < 0 else "right" if lowest.side == self.end.side else "wrong"
            self._take(lowest.number, word)
            rests = self.crowd.settle() if len(fallen) > 1 else []


def _drawn(random: np.random.Generator, law: Law | None, count: int) -> Array:
    """Draw deviations; the same numbers are used up whatever the law."""
    if isinstance(law, Gaussian):
        return law.sigma * random.standard_normal(count)
    spread = 2.0 * random.random(count) - 1.0
    return law.bound * spread if isinstance(law, Uniform) else 0.0 * spread
