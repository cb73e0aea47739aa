"""All answers about a tray, `limitsets.tray`, and the chain of one depression."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    Tabled,
    arguments_checked,
    as_table,
    picked,
    shown_in_notebooks,
)
from limitsets.base.arrays import Array
from limitsets.base.campaign import finished_trials
from limitsets.cell.trays.passing import (
    Counts,
    Histories,
    Passes,
    count,
    histories as histories_of,
    passes_of,
    random_of,
)
from limitsets.cell.trays.pouring import Pouring, TrayCrowd, crowds_of
from limitsets.feeder.scene import Scene, load
from limitsets.parameters.noise.sampling import require_seed

# ----------------------------------------------------------------
# The chain of one depression: in each pass a kick, and a part that comes by if the depression is empty then.
#
# A state is "empty", "right" or a wrong one.  With K the probabilities of what a kick leaves of each state and c
# those of what a part that comes by leaves of the empty one, one pass is P = K C, where C has the row c for "empty"
# and leaves all others as they are.  The chain has no memory but its state: `histories` asks whether a depression
# has.


# Passes after which nothing changes any more: 2 to this power.
ENDLESS = 40
# A wrong part that no kick moved leaves by so little, that there is one answer.
LEAVES = 1.0 - 1e-12
# Draws of the counted probabilities, and the confidence of the intervals.
DRAWS, CONFIDENCE = 2000, 0.95


@dataclass(frozen=True, eq=False)
class Chain:
    """Probabilities of one pass, by state; state 0 is the empty depression.

    Attributes
    ----------
    captured : ndarray, shape (..., states)
        What a part that comes by leaves of the empty depression.
    kicked : ndarray, shape (..., states, states)
        What a kick leaves of each state.
    right : int
        Number of the state wanted.
    """

    captured: Array
    kicked: Array
    right: int

    @property
    def passed(self) -> Array:
        """Probabilities of one whole pass, shape (..., states, states)."""
        stay = np.array(self.kicked)
        stay[..., :, 0] = 0.0
        return np.asarray(stay + self.kicked[..., :, :1] * self.captured[..., None, :])

    def occupied(self, passes: int) -> Array:
        """Give the probabilities of the states after 0, 1, ... passes from the empty one, (..., passes + 1, states)."""
        step = self.passed
        now = np.zeros((*step.shape[:-2], 1, step.shape[-1]))
        now[..., 0] = 1.0
        return np.concatenate([*accumulate([step] * passes, np.matmul, initial=now)], axis=-2)

    def of_many(self, each: float) -> Chain:
        """Give the chain of passes in which so many parts come by, one after the other.

        What is left over of a whole number is the probability that one more does.
        """
        whole, more = divmod(each, 1.0)
        missed = self.captured[..., :1]
        missed_by_all = missed**whole * (1.0 - more * (1.0 - missed))
        # of those that do not miss the first captured one stays: a geometric series
        captured = self.captured * ((1.0 - missed_by_all) / np.maximum(1.0 - missed, 1e-300))
        captured[..., :1] = missed_by_all
        return Chain(captured, self.kicked, self.right)

    def at_last(self) -> Array:
        """Give the probabilities of the states after endless passes from the empty one, shape (..., states)."""
        power = self.passed
        for _ in range(ENDLESS):
            power = power @ power
            power /= power.sum(axis=-1, keepdims=True)  # rounding grows, too
        return np.asarray(power[..., 0, :])

    @property
    def capture_and_release(self) -> tuple[Array, Array]:
        """Give p_capture and p_release: of the chain watched only while it is empty or right.

        From each of the two, the probability that the other one is the next of them, whatever wrong parts lay there
        between; so p_release/(p_capture + p_release) is exactly the share of "empty" in both, after endless passes.
        """
        step = self.passed
        ends, others = [0, self.right], [k for k in range(1, step.shape[-1]) if k != self.right]
        among, out = step[..., others, :][..., others], step[..., others, :][..., ends]
        between = np.linalg.solve(np.eye(len(others)) - LEAVES * among, out)
        watched = step[..., ends, :][..., ends] + step[..., ends, :][..., others] @ between
        return np.asarray(watched[..., 0, 1]), np.asarray(watched[..., 1, 0])


def chain_of(counts: Counts, captured: Array | None = None, kicked: Array | None = None) -> Chain:
    """Give the chain with the counted shares, or others; only states that came about are in it.

    The empty depression stays empty under a kick.
    """
    at = [0, *counts.met]
    came = counts.captured[at].astype(np.float64) if captured is None else captured
    rows = counts.kicked[np.ix_(at, at)].astype(np.float64) if kicked is None else kicked
    rows[..., 0, :] = 0.0
    rows[..., 0, 0] = 1.0
    rows /= rows.sum(axis=-1, keepdims=True)
    return Chain(came / came.sum(axis=-1, keepdims=True), rows, 1 + counts.met.index(counts.right))


def drawn_chains(counts: Counts, random: np.random.Generator, draws: int = DRAWS) -> Chain:
    """Draw chains that the counts allow: each row from Dirichlet's law of its counts and one count more, spread evenly.

    That is a Bayesian bootstrap with Perks's prior; a plain one would never draw what was not counted.
    """
    at = [0, *counts.met]
    more = 1.0 / len(at)
    rows = np.stack([random.dirichlet(row + more, draws) for row in counts.kicked[np.ix_(at, at)]], axis=-2)
    return chain_of(counts, random.dirichlet(counts.captured[at] + more, draws), rows)


@dataclass(frozen=True, eq=False)
class Filled:
    """What the chain says of many passes; intervals of 95 % by drawing the counted probabilities anew.

    Attributes
    ----------
    right : ndarray, shape (passes + 1,)
        Fraction of the depressions that are filled rightly after 0, 1, ... passes.
    interval : ndarray, shape (passes + 1, 2)
        Of it.
    wrong, wrong_interval : ndarray, shape (passes + 1,) and (passes + 1, 2)
        Those that hold a wrong part.
    states : tuple of str
        The states that came about; "empty" first.
    last : ndarray, shape (states,)
        Fractions after endless passes.
    last_interval : ndarray, shape (states, 2)
        Of them.
    stays : ndarray, shape (states,)
        Mean number of passes that a depression stays as it is; infinite where no kick changed it.
    number : int
        Of the state wanted, in `states`.
    capture, release : float
        Between empty and right (`Chain.capture_and_release`).
    rest, rest_interval : float; tuple of float
        release/(capture + release): the share that is empty of the depressions without a wrong part.
    """

    right: Array
    interval: Array
    wrong: Array
    wrong_interval: Array
    states: tuple[str, ...]
    last: Array
    last_interval: Array
    stays: Array
    number: int
    capture: float
    release: float
    rest: float
    rest_interval: tuple[float, float]

    @property
    def unfilled(self) -> dict[str, float]:
        """Fractions that are not filled rightly after endless passes: empty depressions, and wrong parts."""
        empty, right = float(self.last[0]), float(self.last[self.number])
        return {"empty": empty, "wrong": max(1.0 - empty - right, 0.0)}

    def passes_to(self, share: float) -> int | None:
        """Give the passes after which this share of the last fraction is filled; None where it takes more, or is 0."""
        last = self.last[self.number]
        enough = np.flatnonzero((self.right >= share * last) & (last > 0.0))
        return int(enough[0]) if enough.size else None

    def to_json(self) -> dict[str, Any]:
        """Give the numbers as JSON takes them."""
        by_state = picked(self, "last", "last_interval", "stays")
        return as_table(
            **picked(self, "right", "interval", "wrong", "wrong_interval"),
            **{name: dict(zip(self.states, values, strict=True)) for name, values in by_state.items()},
            unfilled=self.unfilled,
            rest={
                "p_capture": self.capture,
                "p_release": self.release,
                "value": self.rest,
                "interval": self.rest_interval,
            },
            passes_to_95=self.passes_to(0.95),
        )


def filled(counts: Counts, passes: int, random: np.random.Generator, each: float = 1.0) -> Filled:
    """Say what follows from the counts for so many passes, in each of which so many parts come by a depression."""
    chain, drawn = chain_of(counts).of_many(each), drawn_chains(counts, random).of_many(each)
    ends = [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE]

    def interval(values: Array) -> Array:
        return np.moveaxis(np.quantile(values, ends, axis=0), 0, -1)

    with np.errstate(divide="ignore"):
        stays = 1.0 / (1.0 - np.diagonal(chain.passed))
    capture, release = chain.capture_and_release
    captures, releases = drawn.capture_and_release
    low, high = interval(releases / (captures + releases)).tolist()
    now, nows = chain.occupied(passes), drawn.occupied(passes)
    others = [k for k in range(1, now.shape[-1]) if k != chain.right]
    return Filled(
        now[:, chain.right],
        interval(nows[..., chain.right]),
        now[:, others].sum(axis=-1),
        wrong_interval=interval(nows[..., others].sum(axis=-1)),
        states=("empty", *(counts.states[k] for k in counts.met)),
        last=chain.at_last(),
        last_interval=interval(drawn.at_last()),
        stays=stays,
        number=chain.right,
        capture=float(capture),
        release=float(release),
        rest=float(release) / float(capture + release) if capture + release else math.nan,
        rest_interval=(low, high),
    )


# ----------------------------------------------------------------
# All answers about a tray: `limitsets.tray`.


# The stream of random numbers of the intervals.
INTERVALS = 10_000

COUNTED = "counted in the engine, not proved"


@dataclass(frozen=True, eq=False)
class TrayFill(Tabled):
    """How a tray's depressions fill.

    Attributes
    ----------
    scene : Scene
        The scene.
    passes : Passes
        What a pass is, and the engine's contact.
    counts : Counts
        What one depression did with parts that came by and with kicks.
    filled : Filled
        What follows for many passes.
    histories : tuple of Histories
        One depression followed pass by pass, with a new part in each pass and with parts that return; empty where they
        were not asked for.
    seed : int
        Of all draws.
    crowds : tuple of TrayCrowd
        Many parts at once in the engine: that push each other, and that pass through each other; empty where they were
        not asked for.
    crowd_chain : Filled or None
        What the chain says of as many parts in each pass.
    """

    scene: Scene
    passes: Passes
    counts: Counts
    filled: Filled
    histories: tuple[Histories, ...]
    seed: int
    crowds: tuple[TrayCrowd, ...] = ()
    crowd_chain: Filled | None = None

    def table(self) -> Table:
        """Give the fractions filled, pass by pass."""
        shares = {"filled rightly": (self.filled.right, self.filled.interval)}
        shares |= {f"filled rightly, {crowd.words}": crowd.share(crowd.right) for crowd in self.crowds}
        columns: list[str | Column] = ["passes"]
        values: list[Sequence[Any]] = [range(self.filled.right.size)]
        for name, (share, ends) in shares.items():
            interval = "95 % interval" + name.removeprefix("filled rightly")
            columns += [Column(name, show=".4f"), Column(interval, show=".4f", ends=True)]
            values += [share.tolist(), ends.tolist()]
        rows = list(zip(*values, strict=True))
        return Table(columns, rows, f"{self.scene.name}: depressions filled rightly", COUNTED)

    def tables(self) -> tuple[Table, ...]:
        """Give the states of a depression, the fractions filled, and many parts at once, if they were asked for."""
        return self._states(), self.table(), *([self._at_once()] if self.crowds else [])

    def _states(self) -> Table:
        filled, counts = self.filled, self.counts
        numbers = [0, *counts.met]
        came = counts.captured[numbers] / max(int(counts.captured.sum()), 1)
        names = (f"{name}: right" if k == filled.number else name for k, name in enumerate(filled.states))
        stays = (counts.kicked[k][k] / counts.kicked[k].sum() for k in numbers[1:])
        values = (came.tolist(), [None, *stays], filled.last.tolist(), filled.last_interval.tolist())
        rows = list(zip(names, *values, strict=True))
        columns = (
            "a depression",
            Column("after a part came by", show=".4f"),
            Column("stands a kick", show=".4f"),
            Column("after endless passes", show=".4f"),
            Column("95 % interval", show=".4f", ends=True),
        )
        return Table(columns, rows, "States of a depression", COUNTED)

    def _at_once(self) -> Table:
        columns: list[str | Column] = ["parts"]
        for name in ("right", "covered", "wrong"):
            columns += [Column(name, show=".4f"), Column(f"{name}: 95 % interval", show=".4f", ends=True)]
        rows = [
            (
                crowd.words,
                *(
                    share[-1].tolist()
                    for counts in (crowd.right, crowd.covered, crowd.wrong)
                    for share in crowd.share(counts)
                ),
                1e3 * crowd.seconds / max(crowd.moved, 1),
            )
            for crowd in self.crowds
        ]
        crowd = self.crowds[0]
        passes = crowd.right.shape[1] - 1
        title = f"{crowd.parts} parts at once over {crowd.depressions} depressions, after {passes} passes"
        return Table((*columns, Column("ms a part and pass", show=".2f")), rows, title, COUNTED)

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it: docs/json.md."""
        return as_table(
            scene=self.scene.name,
            unit=self.scene.unit,
            side=self.passes.side,
            tray=self.passes,
            seed=self.seed,
            **self.counts.to_json(),
            filled=self.filled,
            histories=list(self.histories),
            crowds=list(self.crowds),
            crowd_chain=self.crowd_chain,
        )


@shown_in_notebooks
@arguments_checked
def tray(
    scene: Scene | str | Path | Mapping[str, Any],
    *,
    passes: int = 200,
    drops: int = 4000,
    kicks: int | None = None,
    seed: int = 0,
    side: int | None = None,
    histories: int = 0,
    parts: int | None = None,
    depressions: int | None = None,
    batches: int = 10,
    file: str | Path | None = None,
    step: float = 4e-3,
    executor: Executor | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> TrayFill:
    """Say how the depressions of a tray fill, over which parts wash again and again.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        A scene with [tray], friction and restitution in [world], and `contact = true` in [effects]; or what
        `limitsets.load` takes.
    passes : int
        Passes of the chain, and of each history.
    drops : int
        Parts that come by an empty depression in the engine.
    kicks : int, optional
        Kicks in each state of a depression that comes about; default half of `drops`.
    seed : int
        Of all draws; trial number k has random numbers of its own.
    side : int, optional
        The side wanted; default the goal's.
    histories : int
        Depressions that are followed pass by pass in the engine, once with new parts and once with parts that return.
    parts : int, optional
        Let so many parts come by together in each pass, that push each other; and the same parts again, that pass
        through each other.
    depressions : int, optional
        Of the tray over which they come; default one for each part.
    batches : int
        How often that is tried; batch number k has random numbers of its own.
    file : str or Path, optional
        Finished batches are kept there; the same call goes on with what is left.
    step : float
        The engine's step, in units of sqrt(longest side/g).
    executor : concurrent.futures.Executor, optional
        Where the engine runs; default here. The numbers are the same.
    workers : int, optional
        Instead: processes on this machine that run the batches.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    TrayFill

    Raises
    ------
    AnswerError
        pymunk is not installed; the scene lacks a tray, contact, friction or restitution; or a number is out of range.

    Examples
    --------
    >>> import limitsets as ls
    >>> tables = {
    ...     "tray": {"depression_width": "7.02 in", "depression_depth": "1.53 in", "pitch": "14.04 in",
    ...              "agitation": "1 in", "wash": "1 in"},
    ...     "world": {"friction": 0.3, "restitution": 0.3},
    ...     "effects": {"contact": True},
    ... }
    >>> found = ls.tray({**ls.load("paper-designed").as_dict(), **tables}, passes=20, drops=60)
    >>> found.filled.right.size, bool(0.0 < found.filled.right[-1] < 1.0)
    (21, True)
    """
    read = load(scene)
    if passes < 1 or histories < 0:
        raise AnswerError(
            "the passes and histories", (passes, histories), "1 or more; 0 or more", "correct them"
        )
    if batches < 1:
        raise AnswerError("the batches", batches, "1 or more", "correct them")
    if parts is None and any(each is not None for each in (depressions, file, workers)):
        remedy = "say how many parts come by at once"
        raise AnswerError("the parts", None, "1 or more, with depressions, a file or workers", remedy)
    asked = passes_of(read, side, step)
    require_seed(seed)
    depressions = parts if depressions is None else depressions
    pouring = None if parts is None else Pouring(asked, parts, depressions or 0, passes, seed)
    kicks = max(drops // 2, 1) if kicks is None else kicks
    counted = count(asked, drops, kicks, seed, executor=executor, progress=progress)
    followed = tuple(
        histories_of(asked, histories, passes, seed, returning=back, executor=executor, progress=progress)
        for back in ((False, True) if histories else ())
    )
    chances = filled(counted, passes, random_of(seed, INTERVALS))
    answer = TrayFill(read, asked, counted, chances, followed, seed)
    if pouring is None:
        return answer
    name = f"{pouring.parts} parts at once"
    where: dict[str, Any] = {"file": file, "executor": executor, "workers": workers, "progress": progress}
    rows = finished_trials(pouring, batches, 1, name, "batches", **where)
    chain = filled(counted, passes, random_of(seed, INTERVALS), pouring.parts / pouring.depressions)
    return replace(answer, crowds=crowds_of(pouring, rows), crowd_chain=chain)
