"""The search for the numbers by cell that prove an average: u by value iteration, w from below, in floats.

Theorem and inequalities stand in limitsets/checker/orbit_average.py; nothing in the proof depends on how u and w are
found.  u comes by relative value iteration (White, "Dynamic programming, Markov chains, and the method of successive
approximations", 1963, with half steps); the terms of w enter the function that is averaged, and both are found anew
until the bounds come no nearer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Mask
from limitsets.numbers.jit import kernel
from limitsets.proofs.prover.average_steps import Branch, Runs, Steps, changes_of, runs_of, steps_of
from limitsets.systems.cells import Grid

# Steps of an iteration, and after how many it is looked whether they settle; by how much the span of its changes is
# smaller each time, and after how many times without a nearer bound there are no more.
STEPS, SWEEPS, LESS_SPAN, NEARER, WORSE = 2_000, 8, 0.35, 0.999, 3
# Runs beside a change of branch are this share of the length of a component, and each time this share of that, as long
# as there is no w or the bounds come nearer; the search with shorter runs begins with so much of what was left.
RUN, LESS_RUN, WORTH, FIRST_SPAN = 0.125, 0.0625, 0.99, 4.0
LEAST_S = 2.0**-60
# What weights leave to the checker, as a share of s; by which share of them they may still fall.
ROOM, LARGER = 0.05, 3e-4
# What balls differ by from our boxes, as a share: their radii have 30 bits.
ROUNDED = 1e-8

NO_WEIGHTS = "the inequality of variations has no solution of use; four times as many cells may help"


@kernel
def _largest(steps: Any, values: Any, row: int) -> Any:
    """Return the largest value of the cells that the image of a row meets."""
    out = values[steps.met[steps.begin[row]]]
    for k in range(steps.begin[row] + 1, steps.begin[row + 1]):
        out = max(out, values[steps.met[k]])
    return out


@kernel
def _mean(steps: Any, values: Any, row: int) -> Any:
    """Return the mean of values over the image of a row."""
    total = 0.0
    for k in range(steps.begin[row], steps.begin[row + 1]):
        total += values[steps.met[k]] * steps.part[k]
    return total / steps.length[row]


@kernel
def _after_step(steps: Any, sign: float, values: Any, c: int) -> Any:
    """Bound the mean of sign g + u over a cell after a step."""
    row = steps.first[c]
    if steps.first[c + 1] == row + 1:
        return sign * steps.mean[row] + _mean(steps, values, row)
    of_g = max(sign * steps.low[row], sign * steps.high[row])
    of_g = max(of_g, max(sign * steps.low[row + 1], sign * steps.high[row + 1]))
    return of_g + max(_largest(steps, values, row), _largest(steps, values, row + 1))


@kernel(entry=True)
def _iterate(steps: Any, sign: float, more: Any, span: float, u: Any, change: Any) -> Any:
    """Improve u by relative value iteration until what a step brings spans no more than that; what it spans."""
    apart = math.inf
    for _ in range(STEPS):
        low, high = math.inf, -math.inf
        for c in range(u.size):
            change[c] = _after_step(steps, sign, u, c) + more[c] - u[c]
            low, high = min(low, change[c]), max(high, change[c])
        apart = high - low
        if not apart > span:
            break
        for c in range(u.size):
            u[c] += 0.5 * (change[c] - 0.5 * (low + high))
    return apart


@kernel
def _carried(steps: Any, w: Any, c: int) -> Any:
    """Return the largest weight that images of a cell meet, by its least slope."""
    row = steps.first[c]
    widest, least = _largest(steps, w, row), steps.least[row]
    for k in range(row + 1, steps.first[c + 1]):
        widest, least = max(widest, _largest(steps, w, k)), min(least, steps.least[k])
    return widest / least


@kernel
def _fill_jumps(steps: Any, runs: Any, w: Any, jumps: Any) -> None:
    """Fill in by cell what the changes add to the inequality of variations."""
    jumps[:] = 0.0
    for k in range(runs.row.size):
        row = runs.row[k]
        jump = _largest(steps, w, row) / steps.least[row]
        jumps[steps.cell[row]] += jump
        for i in range(runs.begin[k], runs.begin[k + 1]):
            jumps[runs.cell[i]] += jump * runs.share[i]


@kernel
def _asked(steps: Any, s: Any, w: Any, jumps: Any, c: int) -> Any:
    """Return what the weight of a cell has to be, with room for the checker."""
    return (s[c] * (1.0 + ROOM) + _carried(steps, w, c) + jumps[c]) * (1.0 + 2.0 * ROUNDED)


@kernel(entry=True)
def _find_weights(steps: Any, runs: Any, s: Any, w: Any, jumps: Any) -> bool:
    """Find weights from others, each put in place at once; whether they have settled."""
    most = 1e12 * s.max()
    for _ in range(STEPS // SWEEPS):
        for _ in range(SWEEPS):
            _fill_jumps(steps, runs, w, jumps)
            for c in range(w.size):
                w[c] = _asked(steps, s, w, jumps, c)
        _fill_jumps(steps, runs, w, jumps)
        settled, largest = True, 0.0
        for c in range(w.size):
            missing = _asked(steps, s, w, jumps, c) - w[c]
            settled &= (missing <= 0.8 * ROOM * s[c] + ROUNDED * w[c]) & (missing >= -LARGER * w[c])
            largest = max(largest, w[c])
        if settled or not largest < most:
            return settled
    return False


@kernel(entry=True)
def _highest(steps: Any, sign: float, more: Any, u: Any) -> Any:
    """Return the largest bound that u gives."""
    high = -math.inf
    for c in range(u.size):
        high = max(high, _after_step(steps, sign, u, c) + more[c] - u[c])
    return high


@kernel
def _apart(steps: Any, values: Any, row: int) -> Any:
    """Return how far values over the image of a row lie apart, and the largest integral of these less their mean."""
    mean, partial, r = _mean(steps, values, row), 0.0, 0.0
    least = most = values[steps.met[steps.begin[row]]]
    for k in range(steps.begin[row], steps.begin[row + 1]):
        value = values[steps.met[k]]
        least, most = min(least, value), max(most, value)
        partial += (value - mean) * steps.part[k]
        r = max(r, abs(partial))
    return most - least, r


@kernel(entry=True)
def _fill_slack(steps: Any, width: Any, u: Any, s: Any, off: Any) -> None:
    """Fill in by cell bounds of the integrals s, and by how much the mean of u over an image is off."""
    for c in range(u.size):
        row = steps.first[c]
        if steps.first[c + 1] == row + 1:
            apart, r = _apart(steps, u, row)
            r += 4.0 * steps.off[row] * apart
            s[c] = r * (1.0 / steps.least[row] + 2.0 * width[c] * steps.bend[row])
            s[c] += width[c] * (steps.high[row] - steps.low[row]) / 4.0
            shortest = max(steps.length[row] - 2.0 * steps.off[row], 0.1 * steps.length[row])
            off[c] = steps.bend[row] * r + 2.0 * steps.off[row] * apart / shortest
        else:  # of the function and of u, over both sides of the change
            of_g = max(steps.high[row], steps.high[row + 1]) - min(steps.low[row], steps.low[row + 1])
            least, most = math.inf, -math.inf
            for k in range(steps.begin[row], steps.begin[row + 2]):
                least, most = min(least, u[steps.met[k]]), max(most, u[steps.met[k]])
            s[c], off[c] = width[c] * (of_g + most - least) / 4.0, 0.0


@kernel(entry=True)
def _fill_means(steps: Any, runs: Any, w: Any, of_b: Any) -> None:
    """Fill in by cell what weights add to the inequality of means."""
    for c in range(w.size):
        widest, bend = 0.0, 0.0
        for row in range(steps.first[c], steps.first[c + 1]):
            widest, bend = max(widest, _largest(steps, w, row)), max(bend, steps.bend[row])
        of_b[c] = widest * bend
    for k in range(runs.row.size):
        row = runs.row[k]
        term = _largest(steps, w, row) / steps.least[row] / runs.length[k]
        for i in range(runs.begin[k], runs.begin[k + 1]):
            of_b[runs.cell[i]] += term


class Search(NamedTuple):
    """Steps of one component, widths of its cells, runs beside changes; by how much s is larger than in floats."""

    steps: Steps
    width: Array
    runs: Runs
    wider: float

    def slack(self, u: Array) -> tuple[Array, Array]:
        """Bound by cell the integrals s, and by how much the mean of u over an image is off."""
        s, off = np.empty((2, u.size))
        _fill_slack(self.steps, self.width, u, s, off)
        return self.wider * s + LEAST_S, off

    def of_means(self, w: Array) -> Array:
        """Return by cell what w adds to the inequality of means."""
        of_b = np.empty(w.size)
        _fill_means(self.steps, self.runs, w, of_b)
        return of_b

    def weights(self, s: Array, near: Array) -> Array | None:
        """Find w from numbers near it; None where there is none."""
        w = near.copy()
        return w if _find_weights(self.steps, self.runs, s, w, np.empty(s.size)) else None


class Bounds(NamedTuple):
    """Numbers by cell that prove two bounds: u of the upper end and of the lower end, w."""

    upper: Array
    lower: Array
    weight: Array
    low: float
    high: float
    near: Array  # w by the sum of s


def _bounds_of(search: Search, first: Bounds | None, near: Array) -> Bounds | str:
    """Find u of both ends, w, and the two bounds, from those of other runs if there are any; or say what is missing.

    w is looked for near some numbers by cell.

    More steps of the iteration leave less of g, and make u rougher, which asks for larger w: the best is between.
    """
    count, steps, signs = search.width.size, search.steps, (1.0, -1.0)
    u, more, change = np.zeros((2, count)), np.zeros((2, count)), np.empty(count)
    apart = float(steps.high.max() - steps.low.min())
    span = apart + 1e-12
    if first is not None:
        u, span = np.array([first.upper, first.lower]), FIRST_SPAN * (first.high - first.low)
        slack = [search.slack(each) for each in u]
        more = search.of_means(first.weight) + np.array([off for _, off in slack])
    best, worse = None, 0
    while worse < WORSE and span > 1e-15:
        three = list(zip(signs, more, u, strict=True))
        # rounding, and maxima over images, may leave more
        if not max(_iterate(steps, sign, off, span, each, change) for sign, off, each in three) <= span:
            break
        slack = [search.slack(each) for each in u]
        s = np.maximum(slack[0][0], slack[1][0])
        w, worse = search.weights(s, near * s.sum()), worse + 1
        if w is not None:
            near = w / s.sum()
            more = search.of_means(w) + np.array([off for _, off in slack])
            high, low = (
                _highest(steps, sign, off, each) for sign, off, each in zip(signs, more, u, strict=True)
            )
            known = (
                apart + 1e-9 if best is None else NEARER * (best.high - best.low)
            )  # without any proof, or till now
            if high + low < known:
                best, worse = Bounds(u[0].copy(), u[1].copy(), w, -low, high, near=near), 0
        elif best is None:  # u becomes rougher from here on
            return NO_WEIGHTS
        span *= LESS_SPAN
    return NO_WEIGHTS if best is None else best


def search_component(
    grid: Grid, own: Mask, undecided: Mask, branches: Sequence[Branch], wider: float
) -> tuple[list[int], list[Bounds] | str]:
    """Search on one component for the numbers of all functions: runs beside changes, and bounds.

    Runs are shorter where there are no weights for longer ones, which does not depend on the function.
    """
    steps, values = steps_of(grid, branches, own, undecided)
    cells_of = np.flatnonzero(own)
    if not (steps.least > 0.0).all() or not np.isfinite(steps.bend).all():
        worst = np.argmin(np.where(np.isfinite(steps.bend), steps.least, -1.0))
        where = f"the slope may be 0 or jump at cell {int(cells_of[steps.cell[worst]])}"
        return (
            [],
            f"{where}: write a kink or jump as a change of branch, limitsets.map(pieces=(f, g), margin=m)",
        )
    bounded = np.isfinite(values).all(axis=(0, 1))
    if not bounded.all():
        return [], f"the function is not finite on cell {int(cells_of[steps.cell[np.argmin(bounded)]])}"
    changes = changes_of(grid, own, steps)
    if isinstance(changes, str):
        return [], changes
    width = grid.measure[own]

    def bounds(number: int, counts: Sequence[int], first: Bounds | None) -> Bounds | str:
        mean, low, high = values[number]
        of_one = steps._replace(mean=mean, low=low, high=high)
        near = np.full(width.size, 1.0 / width.size) if first is None else first.near
        search = Search(of_one, width, runs_of(changes, counts, width), wider)
        return _bounds_of(search, first if number == 0 else None, near)

    runs, best = _best_runs([np.cumsum(width[change.beside]) for change in changes], width, bounds)
    if isinstance(best, str):
        return runs, best
    all_bounds = [best]
    for number in range(1, len(values)):
        answer = bounds(number, runs, best)
        if isinstance(answer, str):
            return runs, answer
        all_bounds.append(answer)
    return runs, all_bounds


def _best_runs(
    beside: Sequence[Array],
    width: Array,
    bounds: Callable[[int, Sequence[int], Bounds | None], Bounds | str],
) -> tuple[list[int], Bounds | str]:
    """Find lengths of runs for which the bounds of the first function are nearest; `beside` has by change all ends."""
    longest, shortest, runs, best = width.sum() * RUN, np.median(width), list[int](), None
    while True:
        shorter = [max(1, int(np.searchsorted(ends, longest))) for ends in beside]
        answer = bounds(0, shorter, best)
        if isinstance(answer, str):
            if best is not None or longest < shortest:
                return runs, answer if best is None else best
        elif best is not None and answer.high - answer.low > WORTH * (best.high - best.low):
            return runs, best
        else:
            runs, best = shorter, answer
            if longest < shortest or not beside:
                return runs, best
        longest *= LESS_RUN
