"""Filling for many depths of the depressions and sizes of the agitation, and the best of them confirmed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.files import as_table
from limitsets.progress import shown_in_notebooks
from limitsets.scene import Scene, load
from limitsets.scene.units import written
from limitsets.tables import Column, Table, Tabled
from limitsets.trays.counting import Progress
from limitsets.trays.filling import TrayFill, tray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class TrayDesign(Tabled):
    """How a tray fills, by depth (rows) and agitation (columns).

    Attributes
    ----------
    scene : Scene
        The scene, with its own depth and agitation.
    passes : int
        After so many passes.
    depths : ndarray, shape (n,)
        Depths of the depressions [length].
    agitations : ndarray, shape (m,)
        Agitations [length].
    right : ndarray, shape (n, m)
        Fraction filled rightly.
    interval : ndarray, shape (n, m, 2)
        Of it, 95 %.
    empty, wrong : ndarray, shape (n, m)
        Fractions of the rest after endless passes.
    held : ndarray of bool, shape (n, m)
        Whether no counted kick changed some wrong state: endless passes never leave it, by the counts.
    confirmed : TrayFill
        The best point again, with another seed: the largest of many numbers that scatter is too large.
    """

    scene: Scene
    passes: int
    depths: Array
    agitations: Array
    right: Array
    interval: Array
    empty: Array
    wrong: Array
    held: NDArray[np.bool_]
    confirmed: TrayFill

    @property
    def best(self) -> tuple[float, float]:
        """Depth and agitation where the fraction counted is largest [length]."""
        row, column = np.unravel_index(self.right.argmax(), self.right.shape)
        return float(self.depths[row]), float(self.agitations[column])

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        unit = self.scene.unit
        columns = (
            Column("depth", unit, ".4g"),
            Column("agitation", unit, ".4g"),
            Column("filled rightly", show=".4f"),
            Column("95 % interval", show=".4f", ends=True),
            Column("empty", show=".4f"),
            Column("wrong", show=".4f"),
        )
        rows = [
            (depth, agitation, self.right[at], self.interval[at], self.empty[at], self.wrong[at])
            for i, depth in enumerate(self.depths)
            for k, agitation in enumerate(self.agitations)
            for at in [(i, k)]
        ]
        caption = f"{self.scene.name}: filled rightly after {self.passes} passes"
        return (Table(columns, rows, caption, "counted in the engine, not proved"),)

    def to_json(self) -> dict[str, Any]:
        """Give it as JSON takes it: docs/json.md."""
        depth, agitation = self.best
        row, column = np.unravel_index(self.right.argmax(), self.right.shape)
        again = self.confirmed.filled
        return as_table(
            scene=self.scene.name,
            unit=self.scene.unit,
            side=self.confirmed.passes.side,
            passes=self.passes,
            depths=self.depths,
            agitations=self.agitations,
            right=self.right,
            interval=self.interval,
            empty=self.empty,
            wrong=self.wrong,
            held=self.held,
            best={
                "depth": depth,
                "agitation": agitation,
                "right": self.right[row, column],
                "confirmed": again.right[-1],
                "interval": again.interval[-1],
                "seed": self.confirmed.seed,
            },
        )


@shown_in_notebooks
def tray_design(
    scene: Scene | str | Path | Mapping[str, Any],
    depths: Sequence[float],
    agitations: Sequence[float],
    *,
    passes: int = 200,
    drops: int = 1000,
    kicks: int | None = None,
    seed: int = 0,
    side: int | None = None,
    step: float = 4e-3,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> TrayDesign:
    """Say how a tray fills for each of these depths and agitations, all else as in the scene.

    All points share the draws of trial k, so that they differ by depth and agitation alone.  The best one is run again,
    with the next seed and four times the trials.

    Parameters
    ----------
    scene : Scene, str, Path or mapping
        As `limitsets.tray` takes it.
    depths, agitations : sequence of float
        What to try [length].
    passes, drops, kicks, seed, side, step, executor, progress
        As in `limitsets.tray`, for every point.

    Returns
    -------
    TrayDesign

    Raises
    ------
    SceneError
        For a depth or an agitation that cannot be.
    AnswerError
        As `limitsets.tray`, or nothing to try.

    Examples
    --------
    >>> import limitsets as ls
    >>> tray = {"depression_width": "7.02 in", "depression_depth": "1.53 in", "pitch": "14.04 in",
    ...         "agitation": "1 in", "wash": "1 in"}
    >>> tables = {"tray": tray, "world": {"friction": 0.3, "restitution": 0.3}, "effects": {"contact": True}}
    >>> scene = ls.load({**ls.load("paper-designed").as_dict(), **tables})
    >>> found = tray_design(scene, [1.0, 1.5], [0.5], passes=10, drops=20)
    >>> found.right.shape, found.best[0] in found.depths, found.confirmed.seed
    ((2, 1), True, 1)
    """
    read = load(scene)
    if not len(depths) or not len(agitations) or read.tray is None:
        allowed = "one or more of each, of a scene with [tray]"
        value = (len(depths), len(agitations))
        raise AnswerError("the depths and agitations to try", value, allowed, "name some")

    def at(depth: float, agitation: float, seed: int, more: int, told: Progress | None) -> TrayFill:
        return tray(
            _with(read, depth, agitation),
            passes=passes,
            drops=more * drops,
            kicks=None if kicks is None else more * kicks,
            seed=seed,
            side=side,
            step=step,
            executor=executor,
            progress=told,
        )

    shape = len(depths), len(agitations)
    right, interval, empty, wrong = np.zeros(shape), np.zeros((*shape, 2)), np.zeros(shape), np.zeros(shape)
    held = np.zeros(shape, dtype=bool)
    for place in np.ndindex(shape):
        if progress is not None:
            progress("depths and agitations", int(np.ravel_multi_index(place, shape)), right.size + 1)
        found = at(depths[place[0]], agitations[place[1]], seed, 1, None).filled
        right[place], interval[place] = found.right[-1], found.interval[-1]
        empty[place], wrong[place] = found.unfilled["empty"], found.unfilled["wrong"]
        held[place] = np.isinf(np.delete(found.stays, found.number)).any()
    tried = np.array(depths, dtype=np.float64), np.array(agitations, dtype=np.float64)
    row, column = np.unravel_index(right.argmax(), shape)
    again = at(float(tried[0][row]), float(tried[1][column]), seed + 1, 4, progress)
    return TrayDesign(read, passes, *tried, right, interval, empty, wrong, held, again)


def _with(scene: Scene, depth: float, agitation: float) -> Scene:
    """Give a scene with another depth and agitation, written in its unit."""
    tree = scene.as_dict()
    values = {"depression_depth": depth, "agitation": agitation}
    texts = {name: written(float(value), scene.unit) for name, value in values.items()}
    return Scene.of({**tree, "tray": {**tree["tray"], **texts}}, scene.file)
