"""The search for the numbers by cell that prove an average: u by value iteration, w from below, in floats.

Theorem and inequalities stand in limitsets/checker/map_average.py; nothing in the proof depends on how u and w are
found.  u comes by relative value iteration (White, "Dynamic programming, Markov chains, and the method of successive
approximations", 1963, with half steps); the terms of w enter the function that is averaged, and both are found anew
until the bounds come no nearer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.proofs.prover.certificate_of_map import IMPOSSIBLE, OF_SIZE
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.systems.cells import Grid
from limitsets.systems.maps.contract import between
from limitsets.systems.maps.critical import margins
from limitsets.systems.maps.derived import branch_boxes

# Steps of an iteration; by how much the span of its changes is smaller each time, and after how many times without a
# nearer bound there are no more.
STEPS, LESS_SPAN, NEARER, WORSE = 2_000, 0.7, 0.999, 4
# Runs beside a change of branch are this share of the cells of a component; half of that where there is no w.
RUN = 0.25
LEAST_S = 2.0**-60
# What balls differ by from our boxes, as a share: their radii have 30 bits.
ROUNDED = 1e-8

Values = Callable[[Array, int, Array], Array]
"""The function that is averaged, at places of a side with the slopes there."""


# ---------------------------------------------------------------- cells in floats


class Steps(NamedTuple):
    """Cells of one component on their branches, one row each; and the cells that each image meets, one row each."""

    cell: Ints
    way: Ints  # of an undecided cell 0 below its change, 1 above
    least: Array  # slope
    bend: Array  # |f''|/f'^2
    off: Array  # what the ends of the image are known to
    mean: Array  # of the function, its least and its largest value
    low: Array
    high: Array
    length: Array  # of the image
    begin: Ints  # first row of the cells met; they follow one another
    met: Ints
    part: Array  # of the image in each


def _steps(proof: ProofOfMap, own: Mask, undecided: Mask, values: Values, wider: float) -> Steps:
    """Find what the inequalities need of the cells of a component."""
    grid, branches = proof.graph.grid, sum(name.startswith("target.") for name in proof.arrays)
    parts, met, part, begin = [], [], [], 0
    for side, branch in np.ndindex(grid.sides, branches):
        target = proof.arrays[f"target.{branch}"]
        mine = np.flatnonzero(
            own & (target[:, 0] != IMPOSSIBLE) & (grid.side_of(np.arange(grid.n_cells)) == side)
        )
        if not mine.size:
            continue
        lo, hi = grid.boxes(mine, side)

        def at(x: Array, side: int = side, branch: int = branch) -> tuple[Array, Array, Array]:
            boxes = branch_boxes(proof.map, proof.upper, side, branch, x, x)
            slopes = 0.5 * (boxes.slope_lo + boxes.slope_hi)[:, 0, 0]
            return 0.5 * (boxes.lo + boxes.hi)[:, 0], slopes, 0.5 * (boxes.hi - boxes.lo)[:, 0]

        whole = branch_boxes(proof.map, proof.upper, side, branch, lo, hi)
        low, high = whole.slope_lo[:, 0, 0], whole.slope_hi[:, 0, 0]
        least = np.where(low > 0.0, low, np.where(high < 0.0, -high, 0.0))
        (first, slope_first, off_first), (last, slope_last, off_last) = at(lo), at(hi)
        middle = 0.5 * (lo + hi)
        of_g = [
            values(x[:, 0], side, slope)
            for x, slope in ((lo, slope_first), (middle, at(middle)[1]), (hi, slope_last))
        ]
        width = (hi - lo)[:, 0]
        bend = np.abs(slope_last - slope_first) / width / np.maximum(least, LEAST_S) ** 2
        bend = wider * np.maximum.reduce([bend, np.roll(bend, 1), np.roll(bend, -1)])
        to, edges = int(grid.offset[whole.side]), grid.edges[whole.side][0]
        ends, covered = np.sort(np.stack([first, last]), axis=0), target[mine].T.astype(np.int64)
        rows = np.arange(mine.size)
        way = np.zeros(mine.size, np.int64)
        if grid.domain.closes:
            ends, covered, rows, way = _cut_at_seam(edges, ends, slope_first > 0.0)
            undecided[mine[rows[mine.size :]]] = True
        # of a cell with two branches the checker takes the neighbours of the target cells too, and of others the cells
        # that the image may meet, by what is known of its ends
        off = 2.0 * np.maximum(off_first, off_last)
        first_met = np.searchsorted(edges, ends[0] - off[rows], "left") - 1
        last_met = np.searchsorted(edges, ends[1] + off[rows], "right") - 1
        near = np.stack([np.minimum(first_met, covered[0]), np.maximum(last_met, covered[1])])
        beyond = np.where(undecided[mine[rows]], np.add(covered, [[-1], [1]]), near)
        beyond = np.clip(beyond, 0, edges.size - 2)
        covered = np.where(own[to + beyond], beyond, covered)
        sizes = covered[1] - covered[0] + 1
        row = np.repeat(np.arange(rows.size), sizes)
        k = np.arange(row.size) - np.repeat(np.cumsum(sizes) - sizes, sizes) + covered[0][row]
        inside = np.minimum(edges[k + 1], ends[1, row]) - np.maximum(edges[k], ends[0, row])
        begins = begin + np.cumsum(sizes) - sizes
        if branches > 1 and undecided[mine].any():
            way[undecided[mine]] = _ways(proof, mine[undecided[mine]], side, branch)
        alike = (least, bend, off, of_g[1], np.minimum.reduce(of_g), np.maximum.reduce(of_g))
        parts.append((mine[rows], way, *(each[rows] for each in alike), ends[1] - ends[0], begins))
        met.append(to + k)
        part.append(np.maximum(inside, 0.0))
        begin += row.size
    columns: list[Any] = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return Steps(*(*columns, np.concatenate(met), np.concatenate(part)))


def _cut_at_seam(edges: Array, ends: Array, rises: Mask) -> tuple[Array, Ints, Ints, Ints]:
    """Turn images to the first period; those that pass the seam, an end of the cells, have two rows."""
    period = edges[-1] - edges[0]
    ends = ends - np.floor((ends.mean(axis=0) - edges[0]) / period) * period
    ends += np.where(ends[0] < edges[0], period, 0.0)
    passes = np.flatnonzero(ends[1] > edges[-1])
    below, above = np.minimum(ends, edges[-1]), np.maximum(ends[:, passes] - period, edges[0])
    ends = np.concatenate([below, above], axis=1)
    way = np.concatenate([np.zeros(rises.size, np.int64), rises[passes].astype(np.int64)])
    way[passes] = 1 - way[rises.size :]
    # an image that ends on a border meets the neighbour too
    slack = OF_SIZE * (np.abs(edges[0]) + period)
    first = np.searchsorted(edges, ends[0] - slack, "left") - 1
    last = np.searchsorted(edges, ends[1] + slack, "right") - 1
    first, last = (np.clip(each, 0, edges.size - 2) for each in (first, last))
    return ends, np.stack([first, last]), np.concatenate([np.arange(rises.size), passes]), way


def _ways(proof: ProofOfMap, cells: Ints, side: int, branch: int) -> Ints:
    """Say of cells with two branches on which side of the change a branch is taken: 0 below, 1 above."""
    lo, hi = proof.graph.grid.boxes(cells, side)
    middle = between(proof.map, proof.upper)
    rising = margins(middle, hi[:, 0], side) > margins(middle, lo[:, 0], side)
    return np.where(rising, branch, 1 - branch)


class Change(NamedTuple):
    """One side of a change of branch: the row of its undecided cell, and the cells beside it, nearest first."""

    row: int
    beside: Ints


def _changes(grid: Grid, own: Mask, steps: Steps, undecided: Mask) -> list[Change] | str:
    """List the sides of the changes of branch by undecided cell: below, then above; or say what is missing."""
    listed = list[Change]()
    row_of = {
        (c, way): k for k, (c, way) in enumerate(zip(steps.cell.tolist(), steps.way.tolist(), strict=True))
    }
    for cell in np.flatnonzero(undecided).tolist():
        borders = grid.of_side(int(grid.side_of(np.array([cell]))[0]))
        for way, cells in enumerate(
            (np.arange(cell - 1, borders.start - 1, -1), np.arange(cell + 1, borders.stop))
        ):
            stop = np.flatnonzero(~own[cells])
            cells = cells[: stop[0]] if stop.size else cells
            if not cells.size:
                return f"no cell of the attractor lies beside cell {cell}, in which the branch changes"
            listed.append(Change(row_of[cell, way], cells))
    return listed


# ---------------------------------------------------------------- u and w


@dataclass
class Search:
    """Steps of one component, and the two operators on functions by cell."""

    steps: Steps
    undecided: Mask
    width: Array
    changes: list[Change]
    runs: list[int]
    wider: float

    def _by_cell(self, rows: Array, reduce: Any, empty: float) -> Array:
        out = np.full(self.width.size, empty)
        reduce.at(out, self.steps.cell, rows)
        return out

    def largest(self, values: Array) -> Array:
        """Return by step the largest value that its image meets."""
        return np.asarray(np.maximum.reduceat(values[self.steps.met], self.steps.begin))

    def after(self, u: Array, sign: float) -> Array:
        """Bound by cell the mean of sign g + u after a step."""
        steps, both = self.steps, self.undecided[self.steps.cell]
        mean = np.add.reduceat(u[steps.met] * steps.part, steps.begin) / np.maximum(steps.length, 1e-300)
        of_g = sign * steps.mean
        if both.any():
            largest = self._by_cell(np.maximum(sign * steps.low, sign * steps.high), np.maximum, -np.inf)
            of_u = self._by_cell(self.largest(u), np.maximum, -np.inf)
            return self._by_cell(
                np.where(both, (largest + of_u)[steps.cell], of_g + mean), np.maximum, -np.inf
            )
        return self._by_cell(of_g + mean, np.maximum, -np.inf)

    def slack(self, u: Array) -> tuple[Array, Array]:
        """Bound by cell the integrals s, and by how much the mean of u over an image is off."""
        steps = self.steps
        mean = np.add.reduceat(u[steps.met] * steps.part, steps.begin) / np.maximum(steps.length, 1e-300)
        sizes = np.diff(np.append(steps.begin, steps.met.size))
        partial = np.cumsum((u[steps.met] - np.repeat(mean, sizes)) * steps.part)
        partial -= np.repeat(
            partial[steps.begin] - (u[steps.met[steps.begin]] - mean) * steps.part[steps.begin], sizes
        )
        apart = self.largest(u) + self.largest(-u)
        r = np.maximum.reduceat(np.abs(partial), steps.begin) + 4.0 * steps.off * apart
        wide, spread = self.width[steps.cell], steps.high - steps.low
        s = self._by_cell(
            r * (1.0 / steps.least + 2.0 * wide * steps.bend) + wide * spread / 4.0, np.maximum, 0.0
        )
        shortest = np.maximum(steps.length - 2.0 * steps.off, 0.1 * steps.length + 1e-300)
        off = self._by_cell(steps.bend * r + 2.0 * steps.off * apart / shortest, np.maximum, 0.0)
        both = sum(  # of the function and of u, over both sides of a change
            self._by_cell(high, np.maximum, -np.inf) + self._by_cell(-low, np.maximum, -np.inf)
            for low, high in ((steps.low, steps.high), (-self.largest(-u), self.largest(u)))
        )
        s = np.where(self.undecided, self.width * both / 4.0, s)
        return self.wider * s + LEAST_S, np.where(self.undecided, 0.0, off)

    def terms(self, w: Array) -> tuple[Array, Array]:
        """Return by cell what w adds to the inequality of variations, and to that of means."""
        steps, largest = self.steps, self.largest(w)
        widest = self._by_cell(largest, np.maximum, 0.0)
        of_a = widest / self._by_cell(steps.least, np.minimum, np.inf)
        of_b = widest * self._by_cell(steps.bend, np.maximum, 0.0)
        for change, count in zip(self.changes, self.runs, strict=True):
            cells = change.beside[:count]
            jump, widths = largest[change.row] / steps.least[change.row], self.width[cells]
            length = widths.sum()
            of_a[cells] += jump * np.cumsum(widths[::-1])[::-1] / length
            of_a[steps.cell[change.row]] += jump
            of_b[cells] += jump / length
        return of_a, of_b

    def weights(self, s: Array) -> Array | None:
        """Find w from below, with room for the checker; None where there is none."""
        w, room = s.copy(), 0.05 * s
        for _ in range(STEPS):
            after = (s + room + self.terms(w)[0]) * (1.0 + 2.0 * ROUNDED)
            if not np.isfinite(after).all() or after.max() > 1e12 * s.max():
                return None
            if (after - w <= 0.8 * room + ROUNDED * w).all():
                return w
            w = after
        return None

    def iterated(self, u: Array, sign: float, more: Array, span: float) -> Array | None:
        """Find u by relative value iteration of sign g + more, until what it brings spans no more than that.

        None where it ends before: rounding, and maxima over images, leave more.
        """
        for _ in range(STEPS):
            change = self.after(u, sign) + more - u
            low, high = float(change.min()), float(change.max())
            if high - low <= span:
                return u
            u = u + 0.5 * change
            u -= u.mean()
        return None


class Bounds(NamedTuple):
    """Numbers by cell that prove two bounds: u of the upper end and of the lower end, w."""

    upper: Array
    lower: Array
    weight: Array
    low: float
    high: float


def _bounds_of(search: Search) -> Bounds | str:
    """Find u of both ends, w, and the two bounds; or say what is missing.

    More steps of the iteration leave less of g, and make u rougher, which asks for larger w: the best is between.
    """
    count, best = search.width.size, None
    u, more = [np.zeros(count), np.zeros(count)], [np.zeros(count), np.zeros(count)]
    span, worse = float(search.steps.high.max() - search.steps.low.min()) + 1e-12, 0
    while worse < WORSE and span > 1e-15:
        after = [
            search.iterated(each, sign, off, span)
            for each, sign, off in zip(u, (1.0, -1.0), more, strict=True)
        ]
        if after[0] is None or after[1] is None:
            break
        u = [after[0], after[1]]
        slack = [search.slack(each) for each in u]
        w = search.weights(np.maximum(slack[0][0], slack[1][0]))
        if w is not None:
            of_b = search.terms(w)[1]
            more = [off + of_b for _, off in slack]
            high, low = (
                float((search.after(each, sign) + off - each).max())
                for each, sign, off in zip(u, (1.0, -1.0), more, strict=True)
            )
            now = Bounds(u[0], u[1], w, -low, high)
            worse = 0 if best is None or high + low < NEARER * (best.high - best.low) else worse + 1
            best = now if worse == 0 else best
        elif best is None:  # u becomes rougher from here on
            return "the inequality of variations has no solution"
        span *= LESS_SPAN
    return "the iteration of averages does not settle" if best is None else best


def search_component(
    proof: ProofOfMap, own: Mask, values: Values, wider: float
) -> tuple[list[int], Bounds | str]:
    """Search on one component, with shorter runs where longer ones have no solution."""
    grid, number = proof.graph.grid, np.cumsum(own) - 1
    possible = [each[:, 0] != IMPOSSIBLE for name, each in proof.arrays.items() if name.startswith("target.")]
    undecided = own & (np.sum(possible, axis=0) > 1)
    steps = _steps(proof, own, undecided, values, wider)
    if not (steps.least > 0.0).all() or not np.isfinite(steps.bend).all():
        cell = int(steps.cell[np.argmin(np.where(np.isfinite(steps.bend), steps.least, -1.0))])
        return [], f"the slope may be 0 or jump at cell {cell}"
    bounded = np.isfinite(steps.mean) & np.isfinite(steps.low) & np.isfinite(steps.high)
    if not bounded.all():
        return [], f"the function is not finite on cell {int(steps.cell[np.argmin(bounded)])}"
    changes = _changes(grid, own, steps, undecided)
    if isinstance(changes, str):
        return [], changes
    local = steps._replace(cell=number[steps.cell], met=number[steps.met])
    changes = [change._replace(beside=number[change.beside]) for change in changes]
    longest = int(own.sum()) * RUN
    while True:
        runs = [max(1, min(change.beside.size, int(longest))) for change in changes]
        answer = _bounds_of(Search(local, undecided[own], grid.measure[own], changes, runs, wider))
        if not isinstance(answer, str) or longest < 1.0:
            return runs, answer
        longest /= 2.0
