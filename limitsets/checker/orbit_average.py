"""The average of a function along almost every orbit of an expanding map on a line: one inequality for each cell.

docs/certificates.md, "Certificates of any map": the claim `average`.  Let N be the cells of an attracting component, g
bounded on N, and L rho the density of the places after a step, of rho before.  V(rho) is the integral of w d|D rho|,
with the jumps of rho, also those at the ends of N; at a border w is the larger neighbour.  Checked is, with u of the
file and on each cell I, on every branch that is possible there,

    m <= |f'|,   D >= |f''| / f'^2   (so f is twice differentiable on the closed cell),
    s >= largest over t in I of | integral from the left end of I to t of (g + u o f - its mean) dx |,   s > 0,
    w >= s + (largest w that the image meets) / m + sum over ends of p W / m_c                                   (a)
    c >= mean of (g + u o f) - u + D (largest w) + sum over ends whose run J holds I of W / (m_c |J|)            (b)

An *end* is either side of a change of branch inside N.  The seam of an axis that closes is an end of N, and a place
inside N whose image lies there a change of branch.  Changes lie in *undecided* cells B: both branches are possible, and
the slope of the margin has a sign; or the image of the closed cell may pass the seam, or may come to the seam otherwise
than by an end of N, and is shorter than the axis.  So B holds one change at most.  J is a run of cells next to B, W the
largest w that the image of B meets on the branch of that side, m_c its least slope; p is 1 on B, and on a cell of J its
largest distance from the far end of J by |J|.  On B the mean is at most the largest g plus the largest u that is met on
both branches, and s = |B| (osc g + osc u)/4.  Then for every density rho of bounded variation on N:

* (i) The integral of (g + u o f - u) rho over a cell is at most the mean of that function times the mass of the cell,
  plus s times the variation of rho inside (integrate by parts).
* (ii) D(L rho) consists of D rho carried along by f and divided by |f'|; of at most D rho dx; and of a jump
  rho(c)/|f'(c)| at f(c) for each end.  There rho(c) is at most its mean on J plus the integral of p d|D rho|.  By (a),
  V(L rho) <= V(rho) - sum of s (variation inside the cell) + integral of e rho, e the last two terms of (b).
* (iii) Together: integral of g rho <= c + [integral of u rho + V(rho)] - [integral of u L rho + V(L rho)].  Added up
  for rho, L rho, L^2 rho, ... the brackets cancel: the mean of the first n averages of g is at most c + const/n.

So every invariant density has a mean of g of at most c: densities of bounded variation come near it, and L brings none
further.  By (a) and s > 0, V(L rho) <= theta V(rho) + const with theta < 1, hence averages of L^n rho converge, and N
has invariant densities (Lasota and Yorke).  If the starts whose averages of g do not converge, or to more than c, had a
length above 0, such averages of the density on them would converge to an invariant density there, and Birkhoff's
theorem would contradict.  The lower end is the claim for -g.

On a cell with one branch, image [y0, y1] of length l, ubar the mean of u over it and r the largest |integral from y0 to
y of (u - ubar) dy|, the mean of u o f is within D r of ubar, and s = r (1/m + 2 |I| D) + |I| (osc g)/4 is enough: by
parts with 1/|f'|, whose variation on I is at most |I| D.  Ends of images are known to d: r is larger by 4 d (osc u),
ubar is off by 2 d (osc u)/l.
"""

import itertools
import math
from collections.abc import Callable, Iterable
from contextlib import nullcontext
from typing import NamedTuple

import numpy as np

from .balls import Arb, Array, about, floats_around, prove
from .labels import Labelled
from .observable import LEAST_WEIGHT, MOST_WEIGHT, Average, Averaged, Observed, OnCell

MOST_CHANGES, MOST_MET = 2_048, 4_096
LEAST_S = 2.0**-200
# Of the largest part of a sum: what rounding of MOST_MET operations comes to is less, and of a few dozen.
ROUNDED, FEW = 2.0**-40, 2.0**-46

# ----------------------------------------------------------------
# What is enclosed on each cell and branch.


class Enclosed(NamedTuple):
    """What is enclosed of a cell: m, D, ends of the image, how far these may be off; five numbers of each function."""

    numbers: tuple[float, ...]
    functions: list[tuple[float, ...]]


def enclosed(slope: Arb, second: Arb, images: list[Arb], functions: list[Observed], at: OnCell) -> Enclosed:
    """Enclose what the inequalities need of a cell, from f' and f'' over it and the images of its ends, ascending."""
    regular = second.is_finite() and (slope > 0 or slope < 0)
    least = floats_around(abs(slope))[0] if regular else 0.0
    why = "that the formula is twice differentiable, with a slope of one sign, is not proved"
    prove(least >= LEAST_WEIGHT, why)
    prove(all(y.is_finite() for y in images), "an image is not bounded")
    spans = [floats_around(y) for y in images]
    near = [0.5 * (lo + hi) for lo, hi in spans]
    off = max(math.nextafter(hi - lo, math.inf) for lo, hi in spans)
    bend = floats_around(abs(second) / (slope * slope))[1]
    values = [one(at) for one in functions]
    prove(all(map(math.isfinite, itertools.chain(*values))), "the function is not bounded")
    return Enclosed((least, bend, *near, off), values)


class Step(NamedTuple):
    """Cells of a side and a formula that they take, one row each; floats are rounded so that the claim holds.

    `g` has by cell and function: bounds of its mean from below and above, least, largest, and how far apart these two
    are.
    """

    cells: Array
    to: int  # side
    least: Array  # m
    bend: Array  # D
    ends: Array  # (n, 2) of the image
    off: Array  # d
    g: Array  # (n, functions, 5)
    undecided: Array
    way: Array  # of an undecided cell 0 below its change, 1 above; of others 0
    target: Array  # (n, 2) first and last target cell where two branches are possible, else -1


def step_of(
    cells: Array, to: int, listed: list[Enclosed], target: Array, undecided: Array, way: Array
) -> Step:
    """Put rows of cells together."""
    columns = np.array([one.numbers for one in listed])
    return Step(
        cells, to, columns[:, 0], columns[:, 1], columns[:, 2:4], off=columns[:, 4],
        g=np.array([one.functions for one in listed]), undecided=undecided, way=way, target=target,
    )  # fmt: skip


class Line(NamedTuple):
    """The cells of the sides of a line, one side after another."""

    c: Labelled
    edges: list[Array]  # by side


# ----------------------------------------------------------------
# Sums over the cells that an image meets.


class Met(NamedTuple):
    """The cells that the images of some cells meet."""

    first: Array
    last: Array
    ends: Array  # (n, 2) of the images, cut to N
    edges: Array  # of the side
    begin: int  # number of its first cell

    def most(self) -> int:
        """Return how many cells an image meets at most."""
        return int((self.last - self.first).max(initial=-1)) + 1

    def cells(self, k: int) -> Array:
        """Return the k-th cell that each image meets; the last one where there are fewer."""
        return np.asarray(self.begin + np.minimum(self.first + k, self.last))

    def part(self, k: int) -> Array:
        """Return how much of each image lies in its k-th cell, 0 beyond the last."""
        at = np.minimum(self.first + k, self.last)
        part = np.minimum(self.edges[at + 1], self.ends[:, 1]) - np.maximum(self.edges[at], self.ends[:, 0])
        return np.where(self.first + k <= self.last, np.maximum(part, 0.0), 0.0)

    def extremes(self, values: Array) -> tuple[Array, Array]:
        """Return the least and the largest value of the cells that each image meets."""
        least, most = values[self.cells(0)], values[self.cells(0)]
        for k in range(1, self.most()):
            here = values[self.cells(k)]
            least, most = np.minimum(least, here), np.maximum(most, here)
        return least, most


def met_cells(line: Line, step: Step, own: Array) -> Met:
    """Find the cells that images meet.

    The image of a decided cell lies in N, and in one run of its cells, which its middle tells; ends that are cut to
    that run are as near to the true ones.  Of the image on one of two branches a part of it alone lies there: in the
    target cells of the file, with neighbours.
    """
    edges, begin = line.edges[step.to], int(line.c.start[step.to])
    mine, middle = own[begin : begin + len(edges) - 1], step.ends.mean(axis=1)
    at = np.clip(np.searchsorted(edges, middle, "right") - 1, 0, len(mine) - 1)
    alone, inside = step.target[:, 0] < 0, np.ones(len(own), dtype=bool)
    at = np.where(alone, at, step.target[:, 0])
    inside[step.cells] = mine[at]
    line.c.prove_all(inside, "its image is not seen to lie in its component")
    border = np.flatnonzero(np.diff(np.concatenate([[False], mine, [False]]).astype(np.int8)))
    run_first = border[np.searchsorted(border, at, "right") - 1]
    run_last = border[np.searchsorted(border, at, "right")] - 1
    lo, hi = (np.clip(end, edges[run_first], edges[run_last + 1]) for end in step.ends.T)
    below, above = np.nextafter(lo - step.off, -np.inf), np.nextafter(hi + step.off, np.inf)
    first = np.where(alone, np.searchsorted(edges, below, "left") - 1, step.target[:, 0] - 1)
    last = np.where(alone, np.searchsorted(edges, above, "right") - 1, step.target[:, 1] + 1)
    first, last = np.clip(first, run_first, run_last), np.clip(last, run_first, run_last)
    return Met(first, last, np.stack([lo, hi], axis=1), edges, begin)


class Mean(NamedTuple):
    """The mean of u over each image, what it is off at most, r, and the extremes of u."""

    mean: Array
    error: Array
    r: Array
    least: Array
    most: Array


def means_over(line: Line, step: Step, met: Met, u: Array) -> Mean:
    """Take mean and integrals of u over images, adding the cells one after another; rounding is within the bounds.

    Of undecided cells only the extremes of u mean something.
    """
    length = met.ends[:, 1] - met.ends[:, 0]
    shortest = length * (1.0 - ROUNDED) - 2.0 * step.off
    proper = np.ones(len(line.c.rank), dtype=bool)
    proper[step.cells] = (shortest > 0.0) | step.undecided
    line.c.prove_all(proper, "its image is too short for what is known of its ends: take coarser cells")
    least, most = met.extremes(u)
    spread, total = most - least, np.zeros(len(length))
    for k in range(met.most()):
        total += met.part(k) * (u[met.cells(k)] - least)
    mean = total / np.where(length > 0.0, length, 1.0)
    partial, r = np.zeros(len(length)), np.zeros(len(length))
    for k in range(met.most()):
        partial += met.part(k) * (u[met.cells(k)] - least - mean)
        r = np.maximum(r, np.abs(partial))
    rounding = (2.0 * (met.last - met.first) + 40.0) * 2.0**-52 * length * spread  # of an integral
    by = np.where(shortest > 0.0, shortest, 1.0)
    error = (2.0 * step.off * spread + rounding) / by * (1.0 + ROUNDED) + 2.0**-51 * np.abs(least + mean)
    r = (r + 4.0 * step.off * spread + 2.0 * rounding) * (1.0 + ROUNDED)
    return Mean(least + mean, error, r, least, most)


# ----------------------------------------------------------------
# The inequalities.


class Sides(NamedTuple):
    """Both sides of the inequalities, by cell of the box, as they are put together."""

    of_a: Array  # (largest w)/m and the terms of ends
    of_b: Array  # D (largest w) and those of ends


def check_line(
    c: Labelled, edges: list[Array], average: Average, steps_of: Callable[[Array], Iterable[Step]]
) -> None:
    """Check the bounds of all components that have them; `steps_of` encloses the steps of a component's cells."""
    line, count, row = Line(c, edges), len(c.rank), 0
    alike = all(len(one) == count for f in average.functions for one in (f.upper, f.lower, f.weight))
    prove(alike, "the numbers of the average do not have one row for each cell")
    for component in average.components():
        own = c.component == component
        prove(bool(own.any()), f"component {component} has no cells")
        for function in average.functions:
            fits = (function.weight >= LEAST_WEIGHT) & (function.weight <= MOST_WEIGHT)
            c.prove_all(~own | fits, "its weight is not between 2^-100 and 2^100")
            fits = np.maximum(np.abs(function.upper), np.abs(function.lower)) <= MOST_WEIGHT
            c.prove_all(fits, "its numbers u are not between -2^100 and 2^100")
        steps = list(steps_of(own))
        changes = np.unique(np.concatenate([step.cells[step.undecided] for step in steps])).tolist()
        prove(len(changes) <= MOST_CHANGES, f"more than {MOST_CHANGES} cells of a component are undecided")
        runs = average.runs[row : row + len(changes)].tolist()
        row += len(runs)
        prove(len(runs) == len(changes), "an undecided cell has no runs beside it")
        by_cell, met = dict(zip(changes, runs, strict=True)), [met_cells(line, step, own) for step in steps]
        most = max(cells.most() for cells in met)
        prove(most <= MOST_MET, f"an image meets more than {MOST_MET} cells")
        for k, function in enumerate(average.functions):
            with about(f"function {k}") if len(average.functions) > 1 else nullcontext():
                check_function(line, function, k, component, steps=steps, met=met, runs=by_cell)
    prove(row == len(average.runs), "there are runs beside no undecided cell")


def check_function(
    line: Line,
    function: Averaged,
    number: int,
    component: int,
    *,
    steps: list[Step],
    met: list[Met],
    runs: dict[int, list[int]],
) -> None:
    """Check the two inequalities of a function on the cells of a component, for both ends."""
    c = line.c
    own, w = c.component == component, function.weight
    sides = Sides(*np.zeros((2, len(own))))
    widest, slope, bend = np.zeros(len(own)), np.full(len(own), np.inf), np.zeros(len(own))
    jump = np.zeros((2, len(own)))  # below and above the change of an undecided cell: W/m
    for step, cells in zip(steps, met, strict=True):
        most = cells.extremes(w)[1]
        widest[step.cells] = np.maximum(widest[step.cells], most)
        slope[step.cells] = np.minimum(slope[step.cells], step.least)
        bend[step.cells] = np.maximum(bend[step.cells], step.bend)
        jump[step.way, step.cells] = most / step.least
    sides.of_a[own] = widest[own] / slope[own]
    sides.of_b[own] = bend[own] * widest[own]
    for cell, (below, above) in runs.items():
        terms = (jump[:, cell] * (1.0 + ROUNDED)).tolist()
        sides.of_a[cell] += sum(terms)
        add_run(line, own, (cell - below, cell - 1), terms[0], sides, above=False)
        add_run(line, own, (cell + 1, cell + above), terms[1], sides, above=True)
    lower, upper = function.bounds[component]
    for u, sign, bound in ((function.upper, 1.0, upper), (function.lower, -1.0, -lower)):
        total, size, s = cell_terms(line, [step.g[:, number] for step in steps], steps, met, u, sign)
        fits = w * (1.0 - ROUNDED) >= np.maximum(s, LEAST_S) + sides.of_a
        c.prove_all(~own | fits, "its weight is smaller than what the inequality of variations asks for")
        most = total + sides.of_b - u
        most += FEW * (size + np.abs(u)) + ROUNDED * sides.of_b
        what = "upper" if sign > 0 else "lower"
        c.prove_all(~own | (most <= bound), f"the {what} end of the average is not proved there")


def cell_terms(
    line: Line, values: list[Array], steps: list[Step], met: list[Met], u: Array, sign: float
) -> tuple[Array, Array, Array]:
    """Return by cell a bound of the mean of sign g + u o f, the size of its parts, and s."""
    count = len(line.c.rank)
    mean, size, s = np.full(count, -np.inf), np.zeros(count), np.zeros(count)
    low, high = (
        np.full((2, count), np.inf),
        np.full((2, count), -np.inf),
    )  # of g and u, where a cell is undecided
    width = np.concatenate([np.diff(edges) for edges in line.edges])
    for g, step, cells in zip(values, steps, met, strict=True):
        over, at, decided = means_over(line, step, cells, u), step.cells, ~step.undecided
        g_mean = g[:, 1] if sign > 0 else -g[:, 0]
        off = over.error + step.bend * over.r
        mean[at[decided]] = (g_mean + over.mean + off)[decided]
        size[at[decided]] = (np.abs(g_mean) + np.abs(over.mean) + off)[decided]
        by_parts = over.r * (1.0 / step.least + 2.0 * width[at] * step.bend) + width[at] * g[:, 4] / 4.0
        s[at[decided]] = (by_parts * (1.0 + ROUNDED))[decided]
        for k, (least, most) in enumerate(((g[:, 2], g[:, 3]), (over.least, over.most))):
            low[k, at], high[k, at] = np.minimum(low[k, at], least), np.maximum(high[k, at], most)
    undecided = np.unique(np.concatenate([step.cells[step.undecided] for step in steps]))
    largest_g, largest_u = high[0, undecided] if sign > 0 else -low[0, undecided], high[1, undecided]
    mean[undecided], size[undecided] = largest_g + largest_u, np.abs(largest_g) + np.abs(largest_u)
    spread = (high[:, undecided] - low[:, undecided]).sum(axis=0)
    s[undecided] = width[undecided] * spread / 4.0 * (1.0 + ROUNDED)
    return mean, size, s


def add_run(line: Line, own: Array, run: tuple[int, int], term: float, sides: Sides, *, above: bool) -> None:
    """Add the terms of one side of a change to the cells of its run, from the first to the last."""
    first, last = run
    next_to = first - 1 if above else last + 1
    side, start = int(line.c.side_of(np.array([next_to]))[0]), line.c.start
    edges, begin, end = line.edges[side], int(start[side]), int(start[side + 1])
    fits = begin <= min(first, next_to) and max(last, next_to) < end and first <= last
    prove(
        fits and bool(own[first : last + 1].all()),
        f"{line.c.name(next_to)}: a run beside it is not one of its component",
    )
    lower, upper = edges[first - begin : last + 1 - begin], edges[first + 1 - begin : last + 2 - begin]
    length = float(upper[-1] - lower[0]) * (1.0 - ROUNDED)
    distance = upper[-1] - lower if above else upper - lower[0]  # from the far end
    sides.of_a[first : last + 1] += term * np.minimum(distance / length, 1.0)
    sides.of_b[first : last + 1] += term / length
