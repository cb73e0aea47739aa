"""Boxes of cells: how much of each basin they hold, by cells or by starts, and the bracket of their entropy.

What is undecided in a box is allotted in every way to the basins in which it may lie.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.maps import codes
from limitsets.resilience.colours import Colours
from limitsets.resilience.orbits import labelled_lattice

Floats = NDArray[np.float64]

# Fewest starts along each axis of a box: every second of them gives two.
ALONG = 4


@dataclass(frozen=True, eq=False)
class Boxes:
    """Per box: its measure, basins met for certain, entropies (nan where all is undecided), their bracket."""

    weight: Floats
    met: NDArray[np.int64]
    value: Floats
    lo: Floats
    hi: Floats
    undecided: float


def of_cells(parted: Colours, box: int) -> Boxes:
    """Measure the cells of each basin in each box."""
    grid = parted.grid
    parts = [
        _gathered(grid, np.where(parted.labels == code, grid.measure, 0.0), box) for code in parted.codes
    ]
    mass = np.stack([*parts, np.zeros_like(parts[0])])  # last, elsewhere
    open_to, left = np.zeros(mass.shape, dtype=bool), np.zeros(grid.n_cells)
    for number, some in enumerate(parted.possible):
        left[:] = 0.0
        left[parted.undecided] = some
        open_to[number] = _gathered(grid, left, box) > 0.0
    left[:] = 0.0
    left[parted.undecided] = grid.measure[parted.undecided]
    weight, rest = _gathered(grid, grid.measure, box), _gathered(grid, left, box)
    return _bracketed(weight, mass, open_to, rest, parted.basins.undecided_between)


def counted_starts(parted: Colours, box: int, starts: int, steps: int, seed: int) -> tuple[list[Floats], int]:
    """Count the starts of each basin in each box, undecided last; of all, then of every second along each axis."""
    grid, rng = parted.grid, np.random.default_rng(seed)
    begins = [
        [np.append(_begins(int(n), box), int(n)) for n in grid.shape[side]] for side in range(grid.sides)
    ]
    boxes = sum(int(np.prod([begin.size - 1 for begin in axes])) for axes in begins)
    each = int((starts / boxes) ** (1.0 / grid.dimension) + 1e-9)
    if each < ALONG:
        fewest = boxes * ALONG**grid.dimension
        raise AnswerError(
            "the number of starts",
            starts,
            f"an integer from {fewest}, {ALONG} along each axis of {boxes} boxes",
            f"pass starts={fewest}, or larger boxes",
        )
    label = np.concatenate(
        [labelled_lattice(parted, side, axes, each, steps, rng) for side, axes in enumerate(begins)]
    )
    phases = product(range(2), repeat=grid.dimension)
    every_second = (label[(slice(None), *(slice(first, None, 2) for first in phase))] for phase in phases)
    counts = []
    for some in (label, *every_second):
        flat = some.reshape(boxes, -1)
        counts.append(np.stack([(flat == code).sum(axis=1) for code in (*parted.codes, codes.UNDECIDED)]))
    return [count.astype(np.float64) for count in counts], each


def of_starts(parted: Colours, box: int, counts: Floats) -> Boxes:
    """Take counts of starts in each box for the shares of basins."""
    weight = _gathered(parted.grid, parted.grid.measure, box)
    mass, rest = np.vstack([counts[:-1], np.zeros_like(counts[-1:])]), counts[-1]
    open_to = np.ones(mass.shape, dtype=bool)
    undecided = float((rest / counts.sum(axis=0) * weight).sum() / weight.sum())
    return _bracketed(weight, mass, open_to, rest, undecided)


def _bracketed(
    weight: Floats, mass: Floats, open_to: NDArray[np.bool_], rest: Floats, undecided: float
) -> Boxes:
    value = entropy_of(mass)
    value[mass.sum(axis=0) == 0.0] = np.nan
    lo, hi = value.copy(), value.copy()
    some = rest > 0.0
    lo[some], hi[some] = (
        least_entropy(mass[:, some], open_to[:, some], rest[some]),
        largest_entropy(mass[:, some], open_to[:, some], rest[some]),
    )
    return Boxes(weight, (mass > 0.0).sum(axis=0), value, lo, hi, undecided)


def _begins(cells: int, box: int) -> NDArray[np.int64]:
    """Cells along an axis in which boxes begin."""
    count = max(1, round(cells / box))
    return np.arange(count) * cells // count


def _gathered(grid: Grid, values: Floats, box: int) -> Floats:
    """Sum values of cells over boxes, side after side."""
    parts = []
    for side in range(grid.sides):
        shape = tuple(int(n) for n in grid.shape[side])
        block = values[grid.of_side(side)].reshape(shape)
        for axis, n in enumerate(shape):
            block = np.add.reduceat(block, _begins(n, box), axis=axis)
        parts.append(block.ravel())
    return np.concatenate(parts)


def entropy_of(mass: Floats) -> Floats:
    """Entropy of each column."""
    with np.errstate(divide="ignore", invalid="ignore"):
        p = mass / mass.sum(axis=0)
        found: Floats = np.where(p > 0.0, -p * np.log(p), 0.0).sum(axis=0)
    return found


def least_entropy(mass: Floats, open_to: NDArray[np.bool_], rest: Floats) -> Floats:
    """Give all that is left to the largest basin that may have it."""
    full = mass.copy()
    largest = np.where(open_to, mass, -1.0).argmax(axis=0)
    full[largest, np.arange(rest.size)] += rest
    return entropy_of(full)


def largest_entropy(mass: Floats, open_to: NDArray[np.bool_], rest: Floats) -> Floats:
    """Fill the smallest basins that may have some up to one level, as water would."""
    bars = np.sort(np.where(open_to, mass, np.inf), axis=0)
    number = np.arange(1, len(bars) + 1)[:, None]
    with np.errstate(invalid="ignore"):
        levels = (rest + np.cumsum(bars, axis=0)) / number
    wet = (bars < levels) & np.isfinite(levels)
    level = np.where(wet, levels, np.inf).min(axis=0)
    return entropy_of(np.where(open_to, np.maximum(mass, level), mass))
