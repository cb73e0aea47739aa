"""All answers about a tray: `limitsets.tray`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from limitsets.arguments import arguments_checked
from limitsets.errors import AnswerError
from limitsets.files import as_table
from limitsets.progress import shown_in_notebooks
from limitsets.robust.noise.sampling import require_seed
from limitsets.scene import Scene, load
from limitsets.sweep.trial_file import TrialFile, complete
from limitsets.tables import Column, Table, Tabled
from limitsets.trays.chain import Filled, filled
from limitsets.trays.counting import Counts, Progress, count
from limitsets.trays.crowd import TrayCrowd, crowds_of
from limitsets.trays.histories import Histories, histories
from limitsets.trays.passing import Passes, passes_of, random_of
from limitsets.trays.pouring import Pouring, made

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
        rows = []
        for k, (number, name) in enumerate(zip(numbers, filled.states, strict=True)):
            kept = counts.kicked[number]
            stays = float(kept[number] / kept.sum()) if number else None
            word = f"{name}: right" if k == filled.number else name
            rows.append(
                (word, float(came[k]), stays, float(filled.last[k]), filled.last_interval[k].tolist())
            )
        columns = (
            "a depression",
            Column("after a part came by", show=".4f"),
            Column("stands a kick", show=".4f"),
            Column("after endless passes", show=".4f"),
            Column("95 % interval", show=".4f", ends=True),
        )
        return Table(columns, rows, "States of a depression", COUNTED)

    def _at_once(self) -> Table:
        rows = []
        for crowd in self.crowds:
            shares = [crowd.share(counts) for counts in (crowd.right, crowd.covered, crowd.wrong)]
            ends = [(float(share[-1]), ends[-1].tolist()) for share, ends in shares]
            cost = 1e3 * crowd.seconds / max(crowd.moved, 1)
            rows.append((crowd.words, *(value for pair in ends for value in pair), cost))
        columns: list[str | Column] = ["parts"]
        for name in ("right", "covered", "wrong"):
            columns += [Column(name, show=".4f"), Column(f"{name}: 95 % interval", show=".4f", ends=True)]
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
    >>> found = ls.tray({**ls.load("paper-designed").as_dict(), **tables}, passes=20, drops=200)
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
    follow = (False, True) if histories else ()
    followed = tuple(_followed(asked, histories, passes, seed, back, executor, progress) for back in follow)
    chances = filled(counted, passes, random_of(seed, INTERVALS))
    found = TrayFill(read, asked, counted, chances, followed, seed)
    if pouring is None:
        return found
    kept = TrialFile(None if file is None else Path(file), pouring.question(), batches, 1)
    name = f"{pouring.parts} parts at once"
    complete(kept, made, (pouring,), name, "batches", executor=executor, workers=workers, progress=progress)
    chain = filled(counted, passes, random_of(seed, INTERVALS), pouring.parts / pouring.depressions)
    return replace(found, crowds=crowds_of(pouring, tuple(kept)), crowd_chain=chain)


def _followed(
    asked: Passes,
    number: int,
    passes: int,
    seed: int,
    returning: bool,
    executor: Executor | None,
    progress: Progress | None,
) -> Histories:
    return histories(asked, number, passes, seed, returning=returning, executor=executor, progress=progress)
