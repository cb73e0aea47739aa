"""Entropy of a piecewise monotone map on a line, from both sides: by intervals that images meet, and that they cover.

docs/certificates.md, "Entropy": the claim `entropy`.  N are the attracting cells.  A *lap* is a largest interval of N
on which one branch is taken and f is continuous and rises, or falls.  A *word* is a sequence of laps that all starts of
some interval, longer than 0, follow, and the *entropy* is the limit of (ln W)/n, W the number of words of n laps.  For
a continuous map this is the topological entropy (Misiurewicz and Szlenk, "Entropy of piecewise monotone mappings",
Studia Mathematica 67, 1980).  Laps may be cut at finitely many more places, E: on the starts of a word f, .., f^n are
monotone and come to each of these once at most, so that it becomes 1 + n E words at most, and the limit stays.

Ends of laps that are known to a *bracket* only lie in cells where two branches are possible, and the slope of the
margin has a sign, or where the sign of f' is not known, and that of f'' is: so a bracket holds one end at most.

A file has intervals D, with a number x(D) > 0 for each, and checked is, with P the part of D in a lap,

* Upper end: each run of neighbouring cells of N lies in one D.  Every P, brackets included, has an image that lies in
  some D' as far as it lies in N; with the least such x(D'), the sum over the P of D is at most theta x(D).  A word from
  D begins with the lap of some P and goes on from its D', so that by induction there are at most theta^n x(D)/min x.
* Lower end: P is the part without brackets, if it is longer than 0, and its image may hold some D' entirely; with the
  largest such x(D'), and 0 where it holds none, the sum over the P of D is at least theta x(D).  Every word from D',
  with the lap of P before it, is one from D, and laps differ: so there are at least theta^n x(D)/max x.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from .balls import Arb, Array, Pair, floats_around, prove
from .file import Arrays, hex_float, require, rounded
from .labels import Labelled
from .observable import Allowed

ENTROPY_KEYS = "lower upper"
MOST_INTERVALS, MOST_LAPS = 20_000, 1_000
LEAST_NUMBER, MOST_NUMBER = 2.0**-200, 2.0**200  # of numbers of intervals
TO_SPARE = 2.0**-40  # sums of the parts of an interval, in floats, are right to less, as a share
LEAST_WIDTH = 2.0**-1000  # no interval of the lower end is shorter


class Entropy(NamedTuple):
    """The claim: theta of both ends; by interval side, lower end, upper end and number."""

    lower: float
    upper: float
    covered: Array  # by images, for the lower end
    met: Array  # by images, for the upper end


def read_entropy(
    section: dict[str, Any], arrays: Arrays, prefix: str, allowed: Allowed, where: str
) -> Entropy:
    """Read the claim `entropy`."""
    lower, upper = (hex_float(section[key], f"{where}: {key}") for key in ENTROPY_KEYS.split())
    require(1.0 <= lower <= upper <= MOST_NUMBER, f"{where}: the two ends do not ascend from 1")
    both = [arrays.read(f"{prefix}entropy.{word}", "<f8", 4) for word in ("covered", "met")]
    for one in both:
        require(len(one) <= MOST_INTERVALS, f"{where}: there are more than {MOST_INTERVALS} intervals")
        fits = (
            np.isin(one[:, 0], range(allowed.sides)) & np.isfinite(one).all(axis=1) & (one[:, 1] <= one[:, 2])
        )
        require(bool(fits.all()), f"{where}: a row is no interval of a side")
        fits = (one[:, 3] >= LEAST_NUMBER) & (one[:, 3] <= MOST_NUMBER)
        require(bool(fits.all()), f"{where}: the number of an interval is not between 2^-200 and 2^200")
    proper = both[0][:, 2] - both[0][:, 1] >= LEAST_WIDTH
    require(bool(proper.all()), f"{where}: an interval of the lower end has no length")
    return Entropy(lower, upper, *both)


def entropy_in_words(claim: Entropy) -> str:
    """Put the claim in words."""
    # the logarithm of Python is off by less than this share of 1
    lo, hi = math.log(claim.lower) - TO_SPARE, math.log(claim.upper) + TO_SPARE
    ends = rounded(max(lo, 0.0), up=False), rounded(hi, up=True)
    return f"the entropy (growth of the words of laps) of the attracting cells is between {ends[0]} and {ends[1]}"


# ----------------------------------------------------------------
# Laps.


class Row(NamedTuple):
    """A cell on a branch that is possible there.

    `place` is -1 where the branch is taken on all of the cell; else it is taken on a part, 0 below a change, 1 above.
    """

    cell: int
    ends: Pair
    slope: Arb
    second: Arb
    image: Arb  # of the whole cell
    place: int

    @property
    def sign(self) -> int:
        """Return 1 where f rises, -1 where it falls, 0 where this is not known."""
        return 1 if self.slope > 0 else -1 if self.slope < 0 else 0


class Lap(NamedTuple):
    """A lap between brackets: from `outer` to `outer` with these, `inner` without (None: it may lie within them)."""

    side: int
    to: int
    outer: Pair
    inner: Pair | None
    brackets: tuple[Arb | None, Arb | None]  # what f takes there
    at: Callable[[float], Arb]

    def outward(self, lo: float, hi: float) -> Pair | None:
        """Return floats around the images of the part of an interval in the lap; None where there is none."""
        lo, hi = max(lo, self.outer[0]), min(hi, self.outer[1])
        if lo >= hi:
            return None
        first, last = self.inner or (math.inf, -math.inf)
        inside = max(lo, first), min(hi, last)
        images = [self.at(x) for x in inside] if inside[0] <= inside[1] else []
        below, above = self.brackets
        if below is not None and lo < first:
            images.append(below)
        if above is not None and hi > last:
            images.append(above)
        ends = [floats_around(image) for image in images]
        return min(lo for lo, _ in ends), max(hi for _, hi in ends)

    def inward(self, lo: float, hi: float) -> Pair | None:
        """Return floats between which all numbers are images of the part without brackets; None where it has none."""
        if self.inner is None:
            return None
        lo, hi = max(lo, self.inner[0]), min(hi, self.inner[1])
        if not lo < hi:
            return None
        (_, first), (last, _) = sorted(floats_around(self.at(x)) for x in (lo, hi))
        return (first, last) if first <= last else None


def laps_of(side: int, to: int, rows: Iterable[Row], at: Callable[[float], Arb]) -> Iterator[Lap]:
    """Put the cells of a side on which a branch is possible, ascending, together to laps."""
    runs: list[list[Row]] = []
    for row in rows:
        finite = bool(row.image.is_finite() and row.slope.is_finite())
        prove(finite, f"cell {row.cell}: that the formula is continuous there is not proved")
        if runs and row.cell == runs[-1][-1].cell + 1 and row.sign == runs[-1][-1].sign:
            runs[-1].append(row)
        else:
            runs.append([row])
    turns = [k for k, run in enumerate(runs) if run[0].sign == 0]
    for k in turns:
        require_one_turn(runs[k])
    for k, run in enumerate(runs):
        beside = [_turn_beside(runs, k, step) for step in (-1, 1)]
        if run[0].sign:
            yield lap_of(side, to, run, beside, at)
        # a turn next to the end of N may have a lap between, of which no more is known
        for other in (k - 1, k + 1):
            if run[0].sign == 0 and not _is_beside(runs, k, other):
                yield Lap(side, to, (run[0].ends[0], run[-1].ends[1]), None, (image_hull(run), None), at)


def _is_beside(runs: list[list[Row]], k: int, other: int) -> bool:
    """Return whether two runs of cells are neighbours."""
    first, last = sorted((k, other))
    return first >= 0 and last < len(runs) and runs[first][-1].cell + 1 == runs[last][0].cell


def _turn_beside(runs: list[list[Row]], k: int, step: int) -> list[Row]:
    """Return the cells next to a run where the sign of the slope is not known; none where it is."""
    return runs[k + step] if _is_beside(runs, k, k + step) and runs[k + step][0].sign == 0 else []


def require_one_turn(run: list[Row]) -> None:
    """Require that f turns once at most on cells where the sign of its slope is not known."""
    whole = all(row.place < 0 for row in run)
    prove(whole, f"cell {run[0].cell}: a change of branch, and a slope whose sign is not proved")
    one_sign = all(row.second > 0 for row in run) or all(row.second < 0 for row in run)
    why = "that f turns once at most, where its slope may be 0, is not proved (a corner, or a flat piece?)"
    prove(one_sign, f"cell {run[0].cell}: {why}")


def lap_of(side: int, to: int, run: list[Row], beside: list[list[Row]], at: Callable[[float], Arb]) -> Lap:
    """Make a lap of cells with slopes of one sign, and the turns beside it."""
    places = [row.place for row in run]
    # beside a cell with this branch on all of it the branch is taken at the border, hence up to there from the change
    for k in reversed(range(len(run) - 1)):
        places[k] = -1 if places[k] == 0 and places[k + 1] < 0 else places[k]
    for k in range(1, len(run)):
        places[k] = -1 if places[k] == 1 and places[k - 1] < 0 else places[k]
    begin = next((k for k, place in enumerate(places) if place != 1), len(run))
    end = len(run) - next((k for k, place in enumerate(reversed(places)) if place != 0), len(run))
    whole = all(place < 0 for place in places[begin:end])
    prove(whole, f"cell {run[0].cell}: that its lap is one interval is not proved")
    inner = (run[begin].ends[0], run[end - 1].ends[1]) if begin < end else None
    below, above = beside[0] + run[:begin], run[end:] + beside[1]
    outer = (below or run)[0].ends[0], (above or run)[-1].ends[1]
    return Lap(side, to, outer, inner, (image_hull(below), image_hull(above)), at)


def image_hull(rows: list[Row]) -> Arb | None:
    """Enclose what f takes on cells."""
    whole = None
    for row in rows:
        whole = row.image if whole is None else whole.union(row.image)
    return whole


# ----------------------------------------------------------------
# The inequalities.


class Runs:
    """The runs of neighbouring cells of N, by side."""

    def __init__(self, c: Labelled, edges: list[Array]):
        self.by_side: list[list[Pair]] = []
        for (first, end), ends in zip(itertools.pairwise(c.start.tolist()), edges, strict=True):
            inside = np.concatenate([[False], c.component[first:end] >= 0, [False]])
            borders = np.flatnonzero(np.diff(inside.astype(np.int8))).reshape(-1, 2)
            self.by_side.append([(float(ends[a]), float(ends[b])) for a, b in borders.tolist()])

    def widened(self, side: int, lo: Array, hi: Array) -> tuple[Array, Array]:
        """Widen intervals that end where a run does up to the next run: what lies beyond is not in N."""
        runs = self.by_side[side]
        if not runs:
            return lo, hi
        before = [-math.inf, *(np.nextafter(last, math.inf) for _, last in runs[:-1])]
        after = [*(np.nextafter(first, -math.inf) for first, _ in runs[1:]), math.inf]
        for (first, last), below, above in zip(runs, before, after, strict=True):
            lo, hi = np.where(lo == first, below, lo), np.where(hi == last, above, hi)
        return lo, hi


def require_few(laps: list[Lap]) -> None:
    """Require that there are laps, and not too many."""
    prove(len(laps) > 0, "there are no attracting cells")
    prove(len(laps) <= MOST_LAPS, f"there are more than {MOST_LAPS} laps")


def check_entropy(laps: list[Lap], runs: Runs, claim: Entropy) -> None:
    """Check both ends."""
    require_few(laps)
    if claim.lower > 1.0:
        prove(len(claim.covered) > 0, "there are no intervals for the lower end")
        sums = covered_sums(laps, claim.covered)
        wanting = sums < claim.lower * claim.covered[:, 3] * (1.0 + TO_SPARE)
        prove(not wanting.any(), _of_interval(claim.covered, wanting, "images cover too little"))
    whole = [
        any(s == side and lo <= first and last <= hi for s, lo, hi, _ in claim.met.tolist())
        for side, pairs in enumerate(runs.by_side)
        for first, last in pairs
    ]
    prove(all(whole), "the intervals of the upper end do not hold the attracting cells")
    sums = met_sums(laps, runs, claim.met)
    wanting = ~(sums * (1.0 + TO_SPARE) <= claim.upper * claim.met[:, 3])
    prove(not wanting.any(), _of_interval(claim.met, wanting, "images meet too much"))


def _of_interval(rows: Array, bad: Array, what: str) -> str:
    side, lo, hi, _ = rows[int(np.argmax(bad))].tolist()
    return f"side {int(side)}, x in [{lo!r}, {hi!r}]: {what}"


def covered_sums(laps: list[Lap], rows: Array) -> Array:
    """Return by interval the sum over laps of the largest number of an interval that the image covers."""
    sums, by_side = (
        np.zeros(len(rows)),
        [rows[rows[:, 0] == s] for s in range(1 + max(lap.to for lap in laps))],
    )
    for k, (side, lo, hi, _) in enumerate(rows.tolist()):
        for lap in laps:
            image = lap.inward(lo, hi) if lap.side == side else None
            if image is not None:
                targets = by_side[lap.to]
                within = (targets[:, 1] >= image[0]) & (targets[:, 2] <= image[1])
                sums[k] += targets[within, 3].max(initial=0.0)
    return sums


def met_sums(laps: list[Lap], runs: Runs, rows: Array) -> Array:
    """Return by interval the sum over laps of the least number of an interval that holds the image."""
    sums, by_side = np.zeros(len(rows)), []
    for side in range(len(runs.by_side)):
        own = rows[rows[:, 0] == side]
        by_side.append((*runs.widened(side, own[:, 1], own[:, 2]), own[:, 3]))
    for k, (side, lo, hi, _) in enumerate(rows.tolist()):
        for lap in laps:
            image = lap.outward(lo, hi) if lap.side == side else None
            if image is not None:
                first, last, numbers = by_side[lap.to]
                holding = (first <= image[0]) & (image[1] <= last)
                sums[k] += numbers[holding].min(initial=math.inf)
    return sums
