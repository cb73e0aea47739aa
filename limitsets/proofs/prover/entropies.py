"""Topological entropy from both sides: the answer, and how it is found.

limitsets/checker/entropy.py has the theorem: intervals with numbers that one step of the map bounds.  The intervals are
images of the attracting cells, of parts of these images, and so on, by the checker's own laps (Hofbauer, "On intrinsic
ergodicity of piecewise monotonic transformations with positive entropy", Israel J. Math. 34, 1979); images that are
left over count for the least interval that holds them, or the largest that they hold.  The ends come nearer as
exp(-n entropy) with n images.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from limitsets.base import Column, Progress, Table, silent
from limitsets.base.arrays import Array, Arrays, Ints
from limitsets.proofs.prover.averages import outward
from limitsets.systems.sets.entropy import perron

if TYPE_CHECKING:
    from limitsets.checker.balls import Pair
    from limitsets.checker.entropy import Lap, Runs

# Intervals at first and at most, and between which ends they are enough.
FIRST, MOST, CLOSE = 250, 4000, 1e-8
# The largest eigenvalue is exceeded by the least of these shares with which numbers stay within a ratio.
SHARES, MOST_RATIO = (1e-10, 1e-8, 1e-6, 1e-4, 1e-2), 2.0**150
# By how much an inequality is asked to hold more than floats give, and a logarithm is off at most.
ROOM = 2.0**-36


@dataclass(frozen=True, eq=False)
class Entropy:
    """The entropy on the attracting cells.

    Attributes
    ----------
    lo, hi : float
        Between these it lies, proved.
    sampled : float
        As floats give it, with the branches and turns that samples find; nan where this is not known.
    section : dict
        The claim as a certificate has it: both ends as factors per step.
    arrays : dict of str to ndarray
        ``entropy.covered``, ``entropy.met``: by interval side, ends and number.
    """

    lo: float
    hi: float
    sampled: float
    section: dict[str, str]
    arrays: Arrays

    def table(self) -> Table:
        """Show both ends and the sampled number."""
        heads = [Column(word, show=".12g") for word in ("lo", "hi", "sampled")]
        said = "growth of the words of laps in the attracting cells alone; "
        said += "proved: between lo and hi" if self.arrays else "nothing is proved"
        ends = outward(self.lo, self.hi) if self.arrays else (None, None)
        rows = [(*ends, None if math.isnan(self.sampled) else self.sampled)]
        return Table(heads, rows, "Topological entropy per step [natural logarithm]", said)

    def to_json(self) -> dict[str, float | None]:
        """Give the numbers, None for those that are not known."""
        numbers = {"lo": self.lo, "hi": self.hi, "sampled": self.sampled}
        return {word: number if math.isfinite(number) else None for word, number in numbers.items()}


# ---------------------------------------------------------------- how it is found


def _grown(
    laps: list[Lap],
    starts: list[tuple[int, float, float]],
    image: Callable[[Lap, float, float], Pair | None],
    most: int,
) -> tuple[list[tuple[int, float, float]], list[tuple[int, int, Pair]]]:
    """Follow intervals: at most so many; and images of their parts, as number, side and ends."""
    intervals, images = list(dict.fromkeys(starts)), list[tuple[int, int, "Pair"]]()
    known = set(intervals)
    for k, (side, lo, hi) in enumerate(intervals):  # it becomes longer
        for lap in (lap for lap in laps if lap.side == side):
            ends = image(lap, lo, hi)
            if ends is None:
                continue
            images.append((k, lap.to, ends))
            if (lap.to, *ends) not in known and len(intervals) < most:
                known.add((lap.to, *ends))
                intervals.append((lap.to, *ends))
    return intervals, images


def _matrix(
    intervals: list[tuple[int, float, float]],
    images: list[tuple[int, int, Pair]],
    fitting: Callable[[int, Pair], tuple[Ints, Array]],
) -> Any:
    """Count by interval the images, each in the interval that fits it first; of some nothing does."""
    from scipy import sparse

    rows, columns = list[int](), list[int]()
    for k, side, ends in images:
        numbers, order = fitting(side, ends)
        if numbers.size:
            rows.append(k)
            columns.append(int(numbers[np.argmin(order)]))
    size = len(intervals)
    return sparse.csr_matrix((np.ones(len(rows)), (rows, columns)), shape=(size, size))


def met_intervals(laps: list[Lap], runs: Runs, most: int) -> Array:
    """Find intervals for the upper end: rows as the file has them."""
    from scipy import sparse
    from scipy.sparse.linalg import spsolve

    starts = [(side, lo, hi) for side, pairs in enumerate(runs.by_side) for lo, hi in pairs]

    def image(lap: Lap, lo: float, hi: float) -> Pair | None:
        ends = lap.outward(lo, hi)
        if ends is None:
            return None
        own = runs.by_side[lap.to]
        first, last = min(own, key=lambda run: max(run[0] - ends[1], ends[0] - run[1]))
        return max(ends[0], min(first, ends[1])), min(ends[1], max(last, ends[0]))

    intervals, images = _grown(laps, starts, image, most)
    side, lo, hi = np.array(intervals).T
    wide = [runs.widened(s, np.where(side == s, lo, np.nan), hi) for s in range(len(runs.by_side))]

    def fitting(s: int, ends: Pair) -> tuple[Ints, Array]:
        numbers = np.flatnonzero((side == s) & (wide[s][0] <= ends[0]) & (ends[1] <= wide[s][1]))
        return numbers, hi[numbers] - lo[numbers]

    matrix = _matrix(intervals, images, fitting)
    for share in SHARES:
        # (factor - matrix) x = 1 has x > 0, hence matrix x < factor x
        factor = math.exp(perron(matrix)[0]) * (1.0 + share)
        shifted = sparse.identity(len(intervals), format="csc") * factor - matrix.tocsc()
        x = spsolve(shifted, np.ones(len(intervals)))
        if np.isfinite(x).all() and x.min() > x.max() / MOST_RATIO > 0.0:
            return np.column_stack([side, lo, hi, x / x.max()])
    return np.zeros((0, 4))


def covered_intervals(laps: list[Lap], most: int) -> Array:
    """Find intervals for the lower end: rows as the file has them; none where their words do not grow."""
    starts = [(lap.side, *lap.inner) for lap in laps if lap.inner is not None]
    if not starts:
        return np.zeros((0, 4))

    def image(lap: Lap, lo: float, hi: float) -> Pair | None:
        ends = lap.inward(lo, hi)
        return ends if ends is not None and ends[0] < ends[1] else None

    intervals, images = _grown(laps, starts, image, most)
    side, lo, hi = np.array(intervals).T

    def fitting(s: int, ends: Pair) -> tuple[Ints, Array]:
        numbers = np.flatnonzero((side == s) & (ends[0] <= lo) & (hi <= ends[1]))
        return numbers, lo[numbers] - hi[numbers]

    growth, x = perron(_matrix(intervals, images, fitting))
    kept = x > x.max(initial=0.0) * 2.0**-150
    return np.column_stack([side, lo, hi, x])[kept] if growth > 0.0 else np.zeros((0, 4))


def both_ends(laps: list[Lap], runs: Runs, tell: Progress = silent) -> tuple[dict[str, str], Arrays]:
    """Find the claim: its section and arrays, with ever more intervals until both ends are near."""
    from limitsets.checker.balls import prove
    from limitsets.checker.entropy import covered_sums, met_sums, require_few

    require_few(laps)
    most, lower, upper = FIRST, 1.0, math.inf
    covered, met = np.zeros((0, 4)), np.zeros((0, 4))
    while most <= MOST:
        tell(f"{most} intervals", int(math.log2(most / FIRST)), 1 + int(math.log2(MOST / FIRST)))
        rows = met_intervals(laps, runs, most)
        if len(rows):
            factor = float((met_sums(laps, runs, rows) / rows[:, 3]).max()) * (1.0 + ROOM)
            if factor < upper:
                met, upper = rows, max(factor, 1.0)
        rows = covered_intervals(laps, most)
        if len(rows):
            factor = float((covered_sums(laps, rows) / rows[:, 3]).min()) * (1.0 - ROOM)
            if factor > lower:
                covered, lower = rows, factor
        if math.log(upper / lower) < CLOSE:
            break
        most *= 2
    prove(math.isfinite(upper), "no intervals were found for the upper end")
    return {"lower": lower.hex(), "upper": upper.hex()}, {"entropy.covered": covered, "entropy.met": met}
