"""One depression pass by pass in the engine: kicks, parts that come by, counts, whether it forgets, and films."""

from __future__ import annotations

import functools
import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from itertools import chain, islice
from typing import Any

import numpy as np

from limitsets.base import AnswerError, Progress, as_table
from limitsets.base.arrays import Array, Ints
from limitsets.base.campaign import in_order
from limitsets.feeder.engine.depression import EMPTY, UNFINISHED, Motion, Plate, Pose, Rest, fall_speed
from limitsets.feeder.engine.member import Mark, Recording
from limitsets.feeder.scene import Scene, Tray, heights_over_sides, require_rests
from limitsets.parameters.noise.sampling import binomial_interval


def random_of(seed: int, *number: int) -> np.random.Generator:
    """Give the random numbers of one trial: the same whatever else is drawn, where and in which order."""
    return np.random.Generator(np.random.Philox(np.random.SeedSequence((seed, *number))))


@dataclass(frozen=True, eq=False)
class Passes:
    """The plate, the side wanted, and the laws of what happens in a pass.

    A kick throws every part at rest, on the plate and in depressions: up with the speed |N| s, turning at the
    rate N s/size, N from the normal law of standard deviation 1, s = sqrt(2 g agitation) and size the part's
    longest side, so that the ends of that side leave with speeds that differ by s; and along the plate with a
    speed that is uniform from 0 to sqrt(2 g wash). A part that comes by falls from the height `agitation`
    over a place uniform on one pitch about the middle of the depression, turned by a uniform angle, moving
    along and turning as after a kick.

    Attributes
    ----------
    plate : Plate
        Part and depression in the engine.
    tray : Tray
        Sizes, agitation and wash.
    side : int
        The side wanted.
    """

    plate: Plate
    tray: Tray
    side: int

    @property
    def right(self) -> int:
        """Number of the state in which a part lies in the depression rightly."""
        return 1 + self.side

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states of a depression, by their numbers."""
        count = len(self.plate.part.sides)
        flush = (f"side {i}" for i in range(count))
        return "empty", *flush, *(f"leaning, vertex {k} lowest" for k in range(count))

    def kick(self, random: np.random.Generator) -> Motion:
        """Draw what a kick of the plate does to a part at rest."""
        up, turning = random.normal(0.0, fall_speed(self.plate.size, self.tray.agitation), 2).tolist()
        along = random.uniform(0.0, fall_speed(self.plate.size, self.tray.wash))
        return Motion(along, abs(up), turning / self.plate.size)

    def arrival(self, random: np.random.Generator) -> tuple[Pose, Motion]:
        """Draw a part that comes by."""
        x = random.uniform(-0.5, 0.5) * self.tray.pitch
        angle = random.uniform(0.0, math.tau)
        return self.plate.lowered(x, angle, self.tray.agitation), self.kick(random)._replace(up=0.0)

    def again(self, pose: Pose, random: np.random.Generator) -> tuple[Pose, Motion]:
        """Draw how a part that lies on the plate comes by: kicked and washed on, the next depression being equal."""
        return Pose(math.remainder(pose.x, self.tray.pitch), pose.y, pose.angle), self.kick(random)

    def to_json(self) -> dict[str, Any]:
        """Give what was drawn, and with which contact."""
        plate = self.plate
        return as_table(
            **{name: size for name, size in vars(self.tray).items() if name != "outline"},
            friction=plate.friction,
            restitution=plate.restitution,
            contact="unilateral",
            step=plate.step,
        )


def passes_of(scene: Scene, side: int | None, step: float) -> Passes:
    """Read what is asked of a scene; refuse one that lacks something.

    Raises
    ------
    AnswerError
        No [tray], no effects.contact, no friction or restitution, or a side the part has not.
    """
    refuse = functools.partial(AnswerError, file=scene.file)
    tray = scene.tray
    if tray is None:
        require_rests(scene)
        remedy = (
            "add [tray] with depression_width and depression_depth, or vertices, pitch, agitation and wash"
        )
        raise refuse("the scene", "without [tray]", "one with a tray", remedy, key="tray")
    if not scene.effects.contact:
        remedy = "a part in a depression touches its walls: write contact = true in [effects]"
        raise refuse("contact", None, "true", remedy, key="effects.contact")
    facts = {"friction": scene.world.friction, "restitution": scene.world.restitution}
    for name, given in facts.items():
        if given is None:
            remedy = f"the engine needs it: add {name} to [world]"
            raise refuse(f"the {name}", None, "a number from 0", remedy, key=f"world.{name}")
    wanted = getattr(scene.goal, "side", None) if side is None else side
    if wanted is None or not 0 <= wanted < len(scene.sides):
        allowed = f"0 to {len(scene.sides) - 1}"
        remedy = "pass side= (--side), or give the scene a goal with a side"
        raise refuse("the side wanted", wanted, allowed, remedy, key="goal")
    if tray.floor[1] - tray.floor[0] < scene.sides.length[wanted]:
        allowed = f"at least {scene.sides.length[wanted]:.6g} {scene.unit}, the length of side {wanted}"
        remedy = "the part cannot lie in it: widen it"
        raise refuse("the width", tray.depression_width, allowed, remedy, key="tray.depression_width")
    height = heights_over_sides([(float(x), float(y)) for x, y in scene.vertices])[wanted]
    if tray.depression_depth >= height:
        allowed = f"below {height:.6g} {scene.unit}, the height of the part on side {wanted}"
        remedy = "the depression is deeper than the part, and nothing would pop out: make it less deep"
        raise refuse("the depth", tray.depression_depth, allowed, remedy, key="tray.depression_depth")
    if not 0.0 < step <= 0.02:
        raise AnswerError("the engine's step", step, "above 0 and at most 0.02", "pass step=4e-3")
    friction, restitution = float(facts["friction"] or 0.0), float(facts["restitution"] or 0.0)
    sizes = scene, tray.depression_width, tray.depression_depth, friction, restitution, step
    return Passes(Plate(*sizes, outline=tray.outline), tray, wanted)


# ----------------------------------------------------------------
# What a depression does with parts that come by and with kicks, counted in the engine.


# Trials of one task, and the streams of random numbers: a part that comes by; from here on kicks, by state.
BLOCK, ARRIVALS, KICKS = 50, 0, 1


@dataclass(frozen=True, eq=False)
class Counts:
    """Counts of what a depression did.

    Attributes
    ----------
    states : tuple of str
        Names of the states, by number; 0 is the empty depression.
    right : int
        Number of the state wanted.
    captured : ndarray of int64, shape (states,)
        States in which parts that came by an empty depression left it.
    kicked : ndarray of int64, shape (states, states)
        By the state before, the states in which one kick left it; rows of states that never came about are 0.
    unfinished : int
        Parts that had not come to rest when patience ended; they are in none of the counts.
    poses : dict of int to Pose
        Where the first part in each state lay.
    """

    states: tuple[str, ...]
    right: int
    captured: Ints
    kicked: Ints
    unfinished: int
    poses: dict[int, Pose]

    @property
    def met(self) -> list[int]:
        """Numbers of the states that came about, and that wanted, without the empty one."""
        return [k for k in range(1, len(self.states)) if k == self.right or self.kicked[k].any()]

    def to_json(self) -> dict[str, Any]:
        """Give counts and Clopper-Pearson intervals of 95 %, by the names of states."""
        names = ["empty", *(self.states[k] for k in self.met)]
        numbers = [EMPTY, *self.met]

        def row(counts: Ints) -> dict[str, Any]:
            of_fate = dict(zip(names, counts[numbers].tolist(), strict=True))
            of = int(counts.sum())
            intervals = {name: _interval(n, of) for name, n in of_fate.items()}
            return {"counts": of_fate, "of": of, "intervals": intervals}

        kicked = {self.states[k]: row(self.kicked[k]) for k in self.met}
        return as_table(arrivals=row(self.captured), kicks=kicked, unfinished=self.unfinished)


def _interval(count: int, of: int) -> tuple[float, float]:
    """Give the interval of a share; all of it where nothing was counted."""
    return binomial_interval(count, of) if of else (0.0, 1.0)


def _arrivals(passes: Passes, seed: int, numbers: Sequence[int]) -> list[Rest]:
    """Let parts come by an empty depression."""
    trials = (passes.arrival(random_of(seed, ARRIVALS, k)) for k in numbers)
    return [passes.plate.settle(*trial) for trial in trials]


def _kicks(
    passes: Passes, seed: int, state: int, poses: Sequence[Pose], numbers: Sequence[int]
) -> list[Rest]:
    """Kick parts that lie in a depression, each as one of those that came to lie so."""
    motions = (passes.kick(random_of(seed, KICKS + state, k)) for k in numbers)
    return [
        passes.plate.settle(poses[k % len(poses)], motion) for k, motion in zip(numbers, motions, strict=True)
    ]


def _run(
    step: str,
    task: Callable[[Any], list[Rest]],
    trials: int,
    executor: Executor | None,
    progress: Progress | None,
) -> list[Rest]:
    blocks = [range(lo, min(lo + BLOCK, trials)) for lo in range(0, trials, BLOCK)]
    return [*chain.from_iterable(in_order(step, task, blocks, executor, progress))]


def _tally(rests: Sequence[Rest], states: int, which: str) -> Ints:
    """Count states; without any the chain would have a row of nothing."""
    done = [rest.state for rest in rests if rest.state != UNFINISHED]
    if not done:
        remedy = "make more of them, or agitate less: these were still in motion when patience ended"
        raise AnswerError(f"the parts at rest, of those {which},", 0, f"some of {len(rests)}", remedy)
    return np.bincount(np.array(done, dtype=np.int64), minlength=states)


def count(
    passes: Passes,
    drops: int,
    kicks: int,
    seed: int,
    *,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Counts:
    """Count captures of `drops` parts that come by, and what `kicks` kicks do in each state that comes about.

    A state's kicks begin from the poses, in turn, in which parts came to lie in it: from those that came by or, where
    none did, from those kicked into it.

    Raises
    ------
    AnswerError
        No drops or no kicks, or of those from some state none came to rest.
    """
    if drops < 1 or kicks < 1:
        raise AnswerError("the drops and kicks", (drops, kicks), "1 or more", "let some parts fall")
    states = len(passes.states)
    rests = _run("drops", functools.partial(_arrivals, passes, seed), drops, executor, progress)
    captured = _tally(rests, states, "that came by")
    kicked = np.zeros((states, states), dtype=np.int64)
    poses: dict[int, list[Pose]] = {passes.right: []}
    every = list(rests)
    for rest in rests:
        poses.setdefault(rest.state, []).append(rest.pose)
    if not poses[passes.right]:
        middle = 0.5 * sum(passes.tray.floor) - 0.5 * passes.plate.width
        poses[passes.right] = [passes.plate.seated(passes.side, middle)]
    waiting = [k for k in sorted(poses) if k > EMPTY]
    while waiting:
        state = waiting.pop(0)
        task = functools.partial(_kicks, passes, seed, state, poses[state])
        after = _run(f"kicks, {passes.states[state]}", task, kicks, executor, progress)
        kicked[state] = _tally(after, states, f"kicked from {passes.states[state]}")
        every += after
        fresh: dict[int, list[Pose]] = {}
        for rest in after:
            if rest.state > EMPTY and rest.state not in poses:
                fresh.setdefault(rest.state, []).append(rest.pose)
        poses |= fresh
        waiting += sorted(fresh)
    unfinished = sum(rest.state == UNFINISHED for rest in every)
    first = {state: poses_of_state[0] for state, poses_of_state in sorted(poses.items()) if state > EMPTY}
    return Counts(passes.states, passes.right, captured, kicked, unfinished, first)


# ----------------------------------------------------------------
# Histories of one depression in the engine, pass by pass, and whether it forgets between passes.


# The streams of random numbers, beyond those of kicks: 2 + n states at most.
FRESH, RETURNING = 10_001, 10_002
# So many past misses are told apart.
PAST = 3


@dataclass(frozen=True, eq=False)
class Histories:
    """What became of one depression, from the empty one, in histories that share nothing.

    Attributes
    ----------
    after_kick, after_pass : ndarray of int64, shape (histories, passes)
        Its state after the kick, and after the part that came by, of each pass; -1 from where a part did not come to
        rest.
    returning : bool
        Whether a part that missed comes by again in the next pass, as it lies, or a new one does.
    right : int
        Number of the state wanted.
    """

    after_kick: Ints
    after_pass: Ints
    returning: bool
    right: int

    @property
    def filled(self) -> Array:
        """Fraction filled rightly after 0, 1, ... passes, shape (passes + 1,)."""
        return np.concatenate([[0.0], (self.after_pass == self.right).mean(axis=0)])

    def interval(self, after: int) -> tuple[float, float]:
        """Give the interval of the fraction after so many passes; histories are independent."""
        successes = int((self.after_pass[:, after - 1] == self.right).sum()) if after else 0
        return binomial_interval(successes, self.after_pass.shape[0])

    def captures(self) -> list[tuple[int, int]]:
        """Give (right captures, parts that came by) of an empty depression: after 0, 1 and 2 or more misses in turn."""
        counts = [[0, 0] for _ in range(PAST)]
        for kicked, passed in zip(self.after_kick.tolist(), self.after_pass.tolist(), strict=True):
            misses = 0
            for before, after in zip(kicked, passed, strict=True):
                if before == EMPTY and after != UNFINISHED:
                    counts[min(misses, PAST - 1)][0] += after == self.right
                    counts[min(misses, PAST - 1)][1] += 1
                misses = misses + 1 if before == EMPTY and after == EMPTY else 0
        return [(right, of) for right, of in counts]

    def releases(self) -> list[tuple[int, int]]:
        """Give (releases, kicks) of the right state: after it stood 0, 1 and 2 or more kicks."""
        counts = [[0, 0] for _ in range(PAST)]
        for kicked, passed in zip(self.after_kick.tolist(), self.after_pass.tolist(), strict=True):
            stood = -1
            for last, now, after in zip([EMPTY, *passed[:-1]], kicked, passed, strict=True):
                if last == self.right and now != UNFINISHED:
                    counts[min(stood, PAST - 1)][0] += now != self.right
                    counts[min(stood, PAST - 1)][1] += 1
                if after == self.right:
                    stood = stood + 1 if last == self.right and now == self.right else 0
        return [(out, of) for out, of in counts]

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""

        def table(counts: list[tuple[int, int]]) -> list[dict[str, Any]]:
            return [{"count": n, "of": of, "interval": _interval(n, of)} for n, of in counts]

        return as_table(
            histories=self.after_pass.shape[0],
            returning=self.returning,
            right=self.filled,
            interval=[self.interval(k) for k in range(self.filled.size)],
            captured_after_misses=table(self.captures()),
            released_after_stood=table(self.releases()),
            unfinished=int((self.after_pass == UNFINISHED).any(axis=1).sum()),
        )


def _pass_by_pass(
    passes: Passes, random: np.random.Generator, returning: bool, settle: Callable[[Pose, Motion, bool], Rest]
) -> Iterator[tuple[int, int]]:
    """Follow a depression from an empty one: states after the kick and after the part that came by, without end.

    `settle` lets a part move to rest, and is told whether it was kicked or came by.
    """
    state, pose, on_plate = EMPTY, Pose(0.0, 0.0, 0.0), None
    while True:
        if state != EMPTY:
            # what pops out is washed on with the parts that pass; it does not come by again in this pass
            pose, state, *_ = settle(pose, passes.kick(random), True)
        after_kick = state
        if state == EMPTY:
            came = passes.again(on_plate, random) if on_plate and returning else passes.arrival(random)
            rest = settle(*came, False)
            state, pose = rest.state, rest.pose
            on_plate = pose if state == EMPTY and rest.side >= 0 else None
        yield after_kick, state


def _history(passes: Passes, count: int, seed: int, returning: bool, number: int) -> list[tuple[int, int]]:
    """Follow a depression: its states after each kick and pass, those of a part that does not rest from there on."""
    random = random_of(seed, RETURNING if returning else FRESH, number)
    rows: list[tuple[int, int]] = []
    settled = _pass_by_pass(
        passes, random, returning, lambda pose, motion, _: passes.plate.settle(pose, motion)
    )
    for row in islice(settled, count):
        rows.append(row)
        if row[1] == UNFINISHED:
            break
    return rows + [(UNFINISHED, UNFINISHED)] * (count - len(rows))


def histories(
    passes: Passes,
    number: int,
    count: int,
    seed: int,
    *,
    returning: bool = False,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Histories:
    """Follow `number` depressions for `count` passes each.

    Parameters
    ----------
    passes : Passes
        The plate and the laws.
    number, count : int
        Histories, and passes of each.
    seed : int
        Of all draws.
    returning : bool
        Whether a part that missed comes by again, kicked and washed on from where it lies: the next depression is equal
        to this one.  Else each pass has a part of its own, as it has after a capture or a part that lies on no side.
    executor, progress
        As in `limitsets.tray`.
    """
    task = functools.partial(_history, passes, count, seed, returning)
    rows = in_order("histories", task, range(number), executor, progress)
    table = np.array(rows, dtype=np.int64).reshape(number, count, 2)
    return Histories(table[..., 0].copy(), table[..., 1].copy(), returning, passes.right)


# ----------------------------------------------------------------
# A depression pass by pass, kept for a film: kicks, parts that come by, how they come to lie.


# The stream of random numbers, frames per unit of time, and pitches to either side that are shown.
STREAM, FRAMES, SHOWN = 10_003, 25.0, 1.0


def filmed(
    scene: Scene, passes: int = 12, *, seed: int = 0, side: int | None = None, step: float = 4e-3
) -> Recording:
    """Follow one depression, as this file does with new parts, and keep where all parts are.

    Parameters
    ----------
    scene : Scene
        As `limitsets.tray` takes it.
    passes : int
        Passes.
    seed : int
        Of all draws.
    side : int, optional
        The side wanted; default the goal's.
    step : float
        The engine's step, in units of sqrt(longest side/g).

    Returns
    -------
    Recording
        One part for each that came by, nan before it comes and after it has passed; x from the middle of the
        depression, y from the plate's surface.

    Raises
    ------
    AnswerError
        As `limitsets.tray`.

    Examples
    --------
    >>> import limitsets as ls
    >>> tray = {"depression_width": "7.02 in", "depression_depth": "1.53 in", "pitch": "14.04 in",
    ...         "agitation": "1 in", "wash": "1 in"}
    >>> tables = {"tray": tray, "world": {"friction": 0.3, "restitution": 0.3}, "effects": {"contact": True}}
    >>> scene = ls.load({**ls.load("paper-designed").as_dict(), **tables})
    >>> kept = filmed(scene, passes=2)
    >>> kept.poses.shape[1] in (1, 2), kept.outlines[0].shape
    (True, (3, 2))
    """
    if passes < 1:
        raise AnswerError("the passes", passes, "1 or more", "film some")
    asked, random = passes_of(scene, side, step), random_of(seed, STREAM)
    plate = asked.plate
    g = scene.kappa if scene.gravity is None else scene.gravity
    unit = math.sqrt(plate.size / g)  # seconds, or 1/w
    every = max(round(1.0 / (FRAMES * step)), 1)
    frames: list[tuple[float, int, Pose]] = []
    marks: list[Mark] = []
    start, parts = 0.0, 0

    def move(pose: Pose, motion: Motion, kicked: bool) -> Rest:
        """Let a part move to rest; what is kept begins where the last motion ended."""
        nonlocal start, parts
        parts += not kicked
        part, kept = parts - 1, list[tuple[float, Pose]]()
        if kicked:
            marks.append((start, part, "thrown"))
        rest = plate.settle(pose, motion, lambda time, now, _: kept.append((time, now)))
        shown = [*kept[::every], (rest.time, rest.pose)]
        frames.extend((start + unit * time, part, now) for time, now in shown)
        start += unit * rest.time
        marks.append((start, part, "rest"))
        start += unit * step
        if rest.state == EMPTY or not kicked:
            missed = "ejected" if kicked else "lost"
            marks.append((start, part, missed if rest.state == EMPTY else "in the cavity"))
        return rest

    deque(islice(_pass_by_pass(asked, random, False, move), passes), maxlen=0)
    times = np.array([time for time, _, _ in frames])
    poses = np.full((times.size, parts, 3), np.nan)
    for number, (_, part, now) in enumerate(frames):
        poses[number, part] = now
    outline = scene.vertices - scene.centre
    edge = SHOWN * asked.tray.pitch
    ground = tuple(
        np.column_stack([corners[:, 0].clip(-edge, edge), corners[:, 1]]) for corners in plate.ground()
    )
    return Recording(times, poses, (outline,) * parts, ground, np.zeros(times.size), tuple(marks))
