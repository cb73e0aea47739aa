"""All answers about a tray: `limitsets.tray`."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from limitsets.errors import AnswerError
from limitsets.files import as_table
from limitsets.scene import Scene, load
from limitsets.trays.chain import Filled, filled
from limitsets.trays.counting import Counts, Progress, count
from limitsets.trays.histories import Histories, histories
from limitsets.trays.passing import Passes, passes_of, random_of

__all__ = ["TrayFill", "tray"]

# The stream of random numbers of the intervals.
INTERVALS = 10_000


@dataclass(frozen=True, eq=False)
class TrayFill:
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
    """

    scene: Scene
    passes: Passes
    counts: Counts
    filled: Filled
    histories: tuple[Histories, ...]
    seed: int

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
        )


def tray(
    scene: Scene | str | Path | Mapping[str, Any],
    *,
    passes: int = 200,
    drops: int = 4000,
    kicks: int | None = None,
    seed: int = 0,
    side: int | None = None,
    histories: int = 0,
    step: float = 4e-3,
    executor: Executor | None = None,
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
    step : float
        The engine's step, in units of sqrt(longest side/g).
    executor : concurrent.futures.Executor, optional
        Where the engine runs; default here. The numbers are the same.
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
    read = scene if isinstance(scene, Scene) else load(scene)
    if passes < 1 or histories < 0:
        raise AnswerError(
            "the passes and histories", (passes, histories), "1 or more; 0 or more", "correct them"
        )
    asked = passes_of(read, side, step)
    counted = count(asked, drops, kicks or max(drops // 2, 1), seed, executor=executor, progress=progress)
    follow = (False, True) if histories else ()
    followed = tuple(_followed(asked, histories, passes, seed, back, executor, progress) for back in follow)
    chances = filled(counted, passes, random_of(seed, INTERVALS))
    return TrayFill(read, asked, counted, chances, followed, seed)


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
