"""A whole plane: every cell certified, cells that stay undecided halved along both axes, neighbours glued."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.regions.axes import CellAxis, placed
from limitsets.regions.gluing import regions
from limitsets.regions.record import CELLS, Record, certify_cell
from limitsets.regions.writing import write
from limitsets.scene import Scene, load
from limitsets.scene.left_out import Model
from limitsets.tables import Column, Table, Tabled

CODES = ("undecided", "proved", "refuted")
"""The codes of `Regions.code`, in order."""

Progress = Callable[[str, int, int], None]
Index = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Regions(Tabled):
    """A plane of two quantities in cells, and the proved record of each.

    Attributes
    ----------
    scene : Scene
        The scene, written in the quantities of the axes.
    axes : tuple of CellAxis
        The two quantities with the borders of the smallest cells: those of all cells are among them.
    index : ndarray of int32, shape (n, 4)
        Per cell the numbers of its borders: low and high along the first axis, low and high along the second.
    records : tuple of Record
        Per cell what is proved for all parameters in it.
    code : ndarray of int8, shape (n,)
        Per cell a number of `CODES`: the goal is proved for all parameters, refuted for all parameters, or neither.
        Without a goal: whether starts are proved to come to the attracting blocks.
    region : ndarray of int32, shape (n,)
        Number of the region (`limitsets.regions.gluing`); -1 without a block.
    """

    scene: Scene
    axes: tuple[CellAxis, CellAxis]
    index: Index
    records: tuple[Record, ...]
    code: NDArray[np.int8]
    region: NDArray[np.int32]

    @property
    def area(self) -> NDArray[np.float64]:
        """Area of each cell in the units of the axes, shape (n,)."""
        sides = []
        for k, axis in enumerate(self.axes):
            at = np.array([float(value) for value in axis.borders])
            sides.append(at[self.index[:, 2 * k + 1]] - at[self.index[:, 2 * k]])
        product: NDArray[np.float64] = sides[0] * sides[1]
        return product

    @property
    def blocks(self) -> NDArray[np.int64]:
        """Number of attracting blocks of each cell, shape (n,): there are at least so many attractors."""
        return np.array([len(record.blocks) for record in self.records], dtype=np.int64)

    def shares(self) -> dict[str, float]:
        """Shares of the plane's area that are proved, refuted and undecided: together 1."""
        area = self.area
        total = float(area.sum())
        return {word: float(area[self.code == k].sum()) / total for k, word in enumerate(CODES)}

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = list(self.shares().items())
        caption = f"{self.scene.name}: regions of {' and '.join(axis.quantity for axis in self.axes)}"
        how = f"proved; {Model.of(self.scene).sentence}"
        return (Table(("verdict", Column("share of the area", show=".6f")), rows, caption, how),)

    def raster(self, of: NDArray[Any] | None = None) -> NDArray[Any]:
        """Spread numbers of the cells, by default their own, over the raster of the smallest cells.

        Returns
        -------
        ndarray, shape (cells of the first axis, cells of the second axis)
        """
        return _spread(self.axes, self.index, np.arange(len(self.index)) if of is None else of)

    def save(self, path: str | Path, *, recheck: bool = True, workers: int | None = 1) -> Path:
        """Write the certificate; it gets its name once `limitsets.recheck` has confirmed it.

        Raises
        ------
        DeniedError
            The checker does not confirm it: it is kept as NAME.denied.zip.
        """
        arrays: dict[str, NDArray[Any]] = {"cells": self.index, "goal": self.code, "region": self.region}
        return write(path, self.scene, self.axes, arrays, self.records, recheck=recheck, workers=workers)


def _spread(axes: Sequence[CellAxis], index: Index, values: NDArray[Any]) -> NDArray[Any]:
    out = np.zeros(tuple(len(axis.borders) - 1 for axis in axes), dtype=values.dtype)
    for (a, b, c, d), value in zip(index.tolist(), values, strict=True):
        out[a:b, c:d] = value
    return out


def certified(
    scene: Scene | str | Path,
    x: CellAxis,
    y: CellAxis,
    *,
    depth: int = 2,
    cells: Sequence[int] = CELLS,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> Regions:
    """Certify every cell of a plane of two quantities.

    Parameters
    ----------
    scene : Scene, str or Path
        The scene, without effects; its goal is what is proved or refuted.
    x, y : CellAxis
        The quantities and the borders of the cells (`limitsets.regions.evenly`).
    depth : int
        How often a cell is halved along both axes while it is undecided.
    cells : sequence of int
        Cells per side of the part, tried in turn.
    executor : Executor, optional
        Where the cells are done; default, here.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    Regions

    Raises
    ------
    AnswerError
        Effects, or quantities that the scene does not have.

    Examples
    --------
    >>> from limitsets.regions import certified, evenly
    >>> speed = evenly("throw.speed", "157 deg/s", "158 deg/s", 2)
    >>> height = evenly("arm.surface_height", "-0.2 in", "-0.15 in", 2)
    >>> found = certified("paper-designed", speed, height)
    >>> found.shares()["proved"], found.region.tolist()
    (1.0, [0, 0, 0, 0])
    """
    loaded = placed(load(scene), (x, y))
    fine = (x.refined(depth), y.refined(depth))
    step = 2**depth
    waiting = [
        (i, i + step, j, j + step)
        for i in range(0, len(fine[0].borders) - 1, step)
        for j in range(0, len(fine[1].borders) - 1, step)
    ]
    done: list[tuple[tuple[int, int, int, int], Record]] = []
    run = map if executor is None else partial(executor.map, chunksize=8)
    task = partial(_one, loaded, fine, tuple(cells))
    level = 0
    while waiting:
        todo, waiting = waiting, []
        for number, (at, record) in enumerate(zip(todo, run(task, todo), strict=True)):
            if progress is not None:
                progress(f"cells of parameters, halved {level} times", number, len(todo))
            if record.settled or level == depth:
                done.append((at, record))
            else:
                waiting += _quarters(at)
        level += 1
    done.sort(key=lambda each: each[0])
    index = np.array([at for at, _ in done], dtype=np.int32)
    records = tuple(record for _, record in done)
    code = np.array([_code(record) for record in records], dtype=np.int8)
    region = regions(records, _spread(fine, index, np.arange(len(index))))
    return Regions(loaded, fine, index, records, code, region)


def _one(scene: Scene, axes: tuple[CellAxis, CellAxis], cells: tuple[int, ...], at: Iterable[int]) -> Record:
    """Certify the cell between the borders of these numbers."""
    a, b, c, d = at
    x, y = axes
    spans: dict[str, tuple[Fraction, Fraction]] = {
        x.quantity: (x.borders[a], x.borders[b]),
        y.quantity: (y.borders[c], y.borders[d]),
    }
    return certify_cell(scene, spans, cells)


def _quarters(at: tuple[int, int, int, int]) -> Iterator[tuple[int, int, int, int]]:
    a, b, c, d = at
    i, j = (a + b) // 2, (c + d) // 2
    yield from ((a, i, c, j), (a, i, j, d), (i, b, c, j), (i, b, j, d))


def _code(record: Record) -> int:
    if record.goal:
        return CODES.index(record.goal)
    return 1 if record.settled else 0
