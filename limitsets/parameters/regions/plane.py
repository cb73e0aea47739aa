"""A whole plane of parameters: cells certified, halved and glued to regions; and the points with the most room."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, Column, Progress, Table
from limitsets.base.arrays import Array, Arrays, Ints
from limitsets.feeder.scene import Model, Scene, load
from limitsets.feeder.scene.quantities import find
from limitsets.feeder.scene.units import exact_factor, parse
from limitsets.parameters.margins.joint import joint_margin
from limitsets.parameters.margins.margin_result import Margin
from limitsets.parameters.margins.single import goals_of
from limitsets.parameters.regions.record import CELLS, Record, certify_cell
from limitsets.parameters.regions.writing import CellAxis, placed, write
from limitsets.proofs.prover.certificate import Saved

# ----------------------------------------------------------------
# Regions: cells of parameters that share a face are one where their blocks intersect one to one.
#
# On a common face both families of blocks are attracting blocks of the same maps.  Where each block of one meets
# exactly one of the other's, and lies among the starts that are proved to come to the other's, every attractor of the
# one corresponds to one of the other: the clutching of Arai, Kalies, Kokubu, Mischaikow, Oka, Pilarczyk, SIAM J.
# Appl. Dyn. Syst. 8, 2009.


Extents = Mapping[int, Sequence[tuple[float, float]]]


def neighbours(raster: Ints) -> Ints:
    """Pairs of numbers that stand side by side in a raster of cell numbers, each once; shape (n, 2)."""
    pairs = []
    for turned in (np.moveaxis(raster, axis, 0) for axis in range(raster.ndim)):
        apart = turned[:-1] != turned[1:]
        pairs.append(np.stack([turned[:-1][apart], turned[1:][apart]], axis=1))
    return np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)


def regions(
    records: Sequence[Any], raster: Ints, alike: Callable[[Any, Any], bool] | None = None
) -> NDArray[np.int32]:
    """Give each cell the number of its region, from 0 in the order of first cells; -1 without a block.

    Neighbours are of one region where they are alike; by default where they correspond.
    """
    alike = alike or corresponds
    root = list(range(len(records)))

    def of(k: int) -> int:
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    for i, j in neighbours(raster).tolist():
        if of(i) != of(j) and alike(records[i], records[j]):
            root[max(of(i), of(j))] = min(of(i), of(j))
    numbers: dict[int, int] = {}
    labels = [
        numbers.setdefault(of(k), len(numbers)) if each.blocks else -1 for k, each in enumerate(records)
    ]
    return np.array(labels, dtype=np.int32)


def corresponds(one: Record, other: Record) -> bool:
    """Whether the blocks of two cells with a common face intersect one to one, and each comes to the other's."""
    if not one.blocks or len(one.blocks) != len(other.blocks):
        return False
    meets = np.array(
        [[overlap(a.extents, b.extents) for b in other.blocks] for a in one.blocks], dtype=np.int64
    )
    one_to_one = (meets.sum(axis=0) == 1).all() and (meets.sum(axis=1) == 1).all()
    return bool(one_to_one) and comes_to(one, other) and comes_to(other, one)


def overlap(a: Extents, b: Extents) -> bool:
    """Whether two sets of intervals have an interior point in common."""
    return any(
        max(lo, low) < min(hi, high)
        for side in a.keys() & b.keys()
        for lo, hi in a[side]
        for low, high in b[side]
    )


def comes_to(one: Record, other: Record) -> bool:
    """Whether the blocks of one record lie in cells of the other from which starts are proved to come to its blocks."""
    at = 0
    for side in range(sum(name.startswith("edges.") for name in other.arrays)):
        edges = other.arrays[f"edges.{side}"]
        shut = other.arrays["rank"][at : at + edges.size - 1] < 0
        at += edges.size - 1
        for block in one.blocks:
            for lo, hi in block.extents.get(side, ()):
                touched = (edges[1:] > lo) & (edges[:-1] < hi)
                if lo < edges[0] or hi > edges[-1] or (shut & touched).any():
                    return False
    return True


# ----------------------------------------------------------------
# A whole plane: every cell certified, cells that stay undecided halved along both axes, neighbours glued.


CODES = ("undecided", "proved", "refuted")
"""The codes of `Regions.code`, in order."""

Index = NDArray[np.int32]
Cell = tuple[int, ...]


def spread(axes: Sequence[CellAxis], index: Index, values: NDArray[Any]) -> NDArray[Any]:
    """Spread numbers of cells over the raster of the smallest ones."""
    out = np.zeros(tuple(len(axis.borders) - 1 for axis in axes), dtype=values.dtype)
    for at, value in zip(index.tolist(), values, strict=True):
        out[tuple(map(slice, at[::2], at[1::2]))] = value
    return out


def cut_where_open(
    waiting: list[Cell],
    ask: Callable[[list[Cell]], Iterable[Any]],
    parts: Callable[[Cell], Iterable[Cell]],
    depth: int,
    progress: Progress | None,
) -> tuple[Index, tuple[Any, ...]]:
    """Cut each cell that is not settled into its parts, at most so many times; the cells in order, and their records.

    Each record has `settled`: whether parts would not say more.
    """
    done: list[tuple[Cell, Any]] = []
    level = 0
    while waiting:
        todo, waiting = waiting, []
        for number, (at, record) in enumerate(zip(todo, ask(todo), strict=True)):
            if progress is not None:
                progress(f"cells of parameters, halved {level} times", number, len(todo))
            if record.settled or level == depth:
                done.append((at, record))
            else:
                waiting += parts(at)
        level += 1
    done.sort(key=lambda each: each[0])
    return np.array([at for at, _ in done], dtype=np.int32), tuple(record for _, record in done)


@dataclass(frozen=True, eq=False)
class Regions(Saved):
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
        Number of the region; -1 without a block.
    """

    scene: Scene
    axes: tuple[CellAxis, CellAxis]
    index: Index
    records: tuple[Record, ...]
    code: NDArray[np.int8]
    region: NDArray[np.int32]

    @property
    def area(self) -> Array:
        """Area of each cell in the units of the axes, shape (n,)."""
        borders = [np.array([float(value) for value in axis.borders]) for axis in self.axes]
        low, high = self.index[:, ::2], self.index[:, 1::2]
        width, height = (at[high[:, k]] - at[low[:, k]] for k, at in enumerate(borders))
        return np.asarray(width * height)

    @property
    def blocks(self) -> Ints:
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
        return spread(self.axes, self.index, np.arange(len(self.index)) if of is None else of)

    def _write(self, path: str | Path, **how: Any) -> None:
        """Write all cells, with what is proved of each."""
        arrays: Arrays = {"cells": self.index, "goal": self.code, "region": self.region}
        write(path, self.scene, self.axes, arrays, self.records, **how)


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
    waiting: list[Cell] = [
        (i, i + step, j, j + step)
        for i in range(0, len(fine[0].borders) - 1, step)
        for j in range(0, len(fine[1].borders) - 1, step)
    ]
    run = map if executor is None else partial(executor.map, chunksize=8)
    ask = partial(run, partial(_one, loaded, fine, tuple(cells)))
    index, records = cut_where_open(waiting, ask, _quarters, depth, progress)
    code = np.array([_code(record) for record in records], dtype=np.int8)
    region = regions(records, spread(fine, index, np.arange(len(index))))
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


def _quarters(at: Cell) -> Iterator[Cell]:
    a, b, c, d = at
    i, j = (a + b) // 2, (c + d) // 2
    yield from ((a, i, c, j), (a, i, j, d), (i, b, c, j), (i, b, j, d))


def _code(record: Record) -> int:
    if record.goal:
        return CODES.index(record.goal)
    return 1 if record.settled else 0


# ----------------------------------------------------------------
# Certified margins: the largest proved square around a point, and the point of a plane that has the most room.


# Halvings of a size; it is lessened by this share, against the rounding of its ends.
HALVINGS, ROOM = 40, 1e-9


class Pick(NamedTuple):
    """A point of a plane, and how much room it has.

    Attributes
    ----------
    values : dict of str to str
        The two quantities, with units.
    factor : float
        The goal is proved for all parameters that differ from the values by at most so many times the scales.
    """

    values: dict[str, str]
    factor: float


def largest_square(
    scene: Scene, centre: Mapping[str, str], scales: Mapping[str, str], *, width: float = 0.01
) -> Margin:
    """Bracket the largest square around a point such that the scene's goal is proved for all parameters in it.

    Parameters
    ----------
    scene : Scene
        The scene, with its goal.
    centre : mapping of str to str
        The point: quantities with units.
    scales : mapping of str to str
        Half the square of factor 1, by quantity: in percent or with a unit.
    width : float
        How close the proved and the refuted factor have to be, as a share of the upper one.

    Returns
    -------
    Margin
        The joint margin of the scene at this point: its `proved` and `refuted` are factors on the scales.

    Examples
    --------
    >>> import limitsets as ls
    >>> centre = {"throw.speed": "162 deg/s", "arm.surface_height": "-0.2 in"}
    >>> scales = {"throw.speed": "0.5 deg/s", "arm.surface_height": "0.02 in"}
    >>> square = largest_square(ls.load("paper-designed"), centre, scales, width=0.2)
    >>> 2.0 < square.proved < square.refuted < 6.0
    True
    """
    placed = scene.with_values(centre)
    return joint_margin(placed, goals_of(placed, None), scales, width=width)


def roomiest(found: Regions, scales: Mapping[str, str]) -> Pick:
    """Pick the border point of a plane around which the largest square, in units of the scales, is proved.

    Parameters
    ----------
    found : Regions
        The plane.
    scales : mapping of str to str
        Half the square of factor 1, by quantity of the axes, with a unit.

    Returns
    -------
    Pick

    Raises
    ------
    AnswerError
        No scale of a quantity, or nothing of the plane is proved.
    """
    places, units = [], []
    for axis in found.axes:
        if axis.quantity not in scales:
            raise AnswerError("the scales", list(scales), f"one of {axis.quantity}", "give it, with a unit")
        given = parse(scales[axis.quantity], find(axis.quantity).dimension)
        places.append(np.array([float(value) for value in axis.borders]))
        units.append(float(given.number) * float(exact_factor(given.unit, axis.unit)))
    bad = np.zeros(tuple(each.size for each in places), dtype=np.int64)
    bad[1:, 1:] = np.cumsum(
        np.cumsum(found.raster(found.code) != CODES.index("proved"), axis=0, dtype=np.int64), axis=1
    )
    x, y = (each.ravel() for each in np.meshgrid(*places, indexing="ij"))
    low = np.zeros(x.size)
    high = np.full(x.size, min(np.ptp(each) / unit for each, unit in zip(places, units, strict=True)))
    for _ in range(HALVINGS):
        size = 0.5 * (low + high)
        a, b = _between(places[0], x, size * units[0])
        c, d = _between(places[1], y, size * units[1])
        inside = (a >= 0) & (b < places[0].size) & (c >= 0) & (d < places[1].size)
        a, b, c, d = (np.where(inside, each, 0) for each in (a, b, c, d))
        good = inside & (bad[b, d] - bad[a, d] - bad[b, c] + bad[a, c] == 0)
        low, high = np.where(good, size, low), np.where(good, high, size)
    best = int(low.argmax())
    if not low[best] > 0.0:
        raise AnswerError(
            "the plane", found.shares(), "one in which something is proved", "choose another one"
        )
    i, j = np.unravel_index(best, tuple(each.size for each in places))
    values = {axis.quantity: axis.text(int(k)) for axis, k in zip(found.axes, (i, j), strict=True)}
    return Pick(values, float(low[best]) * (1.0 - ROOM))


def _between(
    borders: np.ndarray[tuple[int], np.dtype[np.float64]], middle: np.ndarray, half: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the last border not above, and the first not below, middle -+ half; -1 or n where there is none."""
    low = np.searchsorted(borders, middle - half, side="right") - 1
    return low, np.searchsorted(borders, middle + half, side="left")
