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

import functools
import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from .any_map import Map, Shape, floats_around
from .balls import Arb, Array, UnprovedError, prove
from .file import Arrays, hex_float, is_whole, read_side, require, rows, table
from .map_cells import MapCells
from .map_cycles import read_box
from .program import Formulas, Program, in_words, read_formulas

MOST_CHANGES = 2_048
LEAST_WEIGHT, MOST_WEIGHT, LEAST_S = 2.0**-100, 2.0**100, 2.0**-200
# Of the largest part of a sum: what rounding of 4096 operations comes to is less, and of a few dozen.
ROUNDED, FEW = 2.0**-40, 2.0**-46

# ----------------------------------------------------------------
# Reading.


class Average(NamedTuple):
    """What is averaged, and between which numbers the average lies on each of some components.

    `formula` is None for the logarithm of the slope, or for the share of time in `places`.
    """

    formula: Formulas | None
    places: list[tuple[int, list[tuple[float, float]]]] | None
    bounds: dict[int, tuple[float, float]]
    upper: Array  # u of the upper end, and of the lower end
    lower: Array
    weight: Array
    runs: Array  # by component and undecided cell: cells of J below it, and above


def read_average(section: dict[str, Any], arrays: Arrays, prefix: str, shape: Shape, where: str) -> Average:
    """Read the claim `average`."""
    require(shape.dimension == 1, f"{where}: average is of one axis")
    of = table(section["of"], f"{where}: of", "", "lyapunov formula share")
    require(len(of) == 1, f"{where}: of does not name one function")
    (word, value), formula, places = *of.items(), None, None
    if word == "lyapunov":
        require(value is True, f"{where}: of.lyapunov is not true")
    elif word == "formula":
        table(value, f"{where}: of.formula", "ops out")
        formula = read_formulas(value, 1, shape.names, 1, f"{where}: of.formula")
    else:
        listed = [
            table(one, f"{where}: of.share", "side box")
            for one in rows(value, f"{where}: of.share", 1, 10_000)
        ]
        places = [
            (read_side(one["side"], shape.sides), read_box(one["box"], 1, f"{where}: of.share"))
            for one in listed
        ]
    columns = [rows(section[key], f"{where}: {key}", 1, 10_000) for key in ("components", "lower", "upper")]
    require(len({len(column) for column in columns}) == 1, f"{where}: not as many numbers as components")
    require(all(is_whole(k, 0, 2**31) for k in columns[0]), f"{where}: a component is not a whole number")
    low, high = ([hex_float(text, f"{where}: an end") for text in column] for column in columns[1:])
    bounds = dict(zip(columns[0], zip(low, high, strict=True), strict=True))
    require(len(bounds) == len(columns[0]), f"{where}: a component stands twice")
    words = ("upper", "lower", "weight")
    numbers = {word: arrays.read(f"{prefix}average.{word}", "<f8") for word in words}
    require(all(bool(np.isfinite(one).all()) for one in numbers.values()), f"{where}: a number is not finite")
    runs = arrays.read(f"{prefix}average.runs", "<i4", 2)
    return Average(formula, places, bounds, **numbers, runs=runs)


# ----------------------------------------------------------------
# What is enclosed on each cell and branch.


class Enclosed(NamedTuple):
    """What is enclosed of a cell: m, D, ends of the image, how far these may be off, and the five numbers of g."""

    numbers: tuple[float, ...]
    passes: bool  # whether the image may pass the seam of an axis that closes
    rises: bool


class Step(NamedTuple):
    """Cells of a side and a formula that they take, one row each; floats are rounded so that the claim holds.

    `g` has by cell: bounds of its mean from below and above, least, largest, and how far apart these two are.
    """

    cells: Array
    to: int  # side
    least: Array  # m
    bend: Array  # D
    ends: Array  # (n, 2) of the image
    off: Array  # d
    g: Array  # (n, 5)
    undecided: Array
    way: Array  # of an undecided cell 0 below its change, 1 above; of others 0
    target: Array  # (n, 2) first and last target cell where two branches are possible, else -1


def enclosed_steps(the_map: Map, c: MapCells, average: Average, own: Array) -> Iterator[Step]:
    """Enclose what the inequalities need of the cells of a component, by side and branch.

    The seam of an axis that closes is an end of N: where an image may pass it, f has a change there.
    """
    possible = [to[:, 0] != -2 for to in c.target]
    both, sides = np.sum(possible, axis=0) > 1, c.side_of(np.arange(len(c.rank)))
    for side, branch in itertools.product(range(len(c.edges)), range(len(possible))):
        cells, to = np.flatnonzero(own & possible[branch] & (sides == side)), c.to[branch][side]
        if not len(cells):
            continue
        period, edges = c.periods[to][0], c.edges[to][0]
        prove(period is None or len(possible) == 1, "an axis closes, of a map of two branches")
        listed, ways, g = list[Enclosed](), list[int](), observed(the_map, average, (side, branch))
        for cell, ends in zip(cells.tolist(), c.ends(cells, side).tolist(), strict=True):
            try:
                ways.append(way_of(the_map, (side, branch), ends) if both[cell] else 0)
                outer = [cell == c.start[side], cell == c.start[side + 1] - 1]
                listed.append(enclosed_cell(the_map, g, (side, branch), ends, (edges[0], period, outer)))
            except UnprovedError as error:
                raise UnprovedError(f"{c.name(cell)}: {error}") from None
        target = np.where(both[cells, None], c.target[branch][cells].astype(np.int64), -1)
        passes = np.array([one.passes for one in listed])
        steps = [step_of(cells, to, listed, target, both[cells] | passes, np.array(ways))]
        if passes.any() and period is not None:
            seam = edges[0], floats_around(arb(edges[0]) + period)[1]
            steps.append(beyond_seam(steps[0], passes, np.array([one.rises for one in listed]), seam))
        yield from steps


def beyond_seam(step: Step, passes: Array, rises: Array, seam: tuple[float, float]) -> Step:
    """Cut images that may pass the seam: those of `step` end there, those of the step that is returned begin there."""
    first, last = seam
    step.off[passes] += 2.0**-48 * (abs(first) + 2.0 * abs(last))
    rows = {name: each if name == "to" else each[passes] for name, each in step._asdict().items()}
    ends = np.stack(
        [np.full(len(rows["cells"]), first), np.maximum(rows["ends"][:, 1] - last + first, first)], axis=1
    )
    step.ends[passes, 1], step.way[passes] = last, np.where(rises, 0, 1)[passes]
    return Step(**rows)._replace(ends=ends, way=np.where(rises, 1, 0)[passes])


def step_of(
    cells: Array, to: int, listed: list[Enclosed], target: Array, undecided: Array, way: Array
) -> Step:
    """Put rows of cells together."""
    columns = np.array([one.numbers for one in listed])
    return Step(
        cells, to, columns[:, 0], columns[:, 1], columns[:, 2:4],
        off=columns[:, 4], g=columns[:, 5:], undecided=undecided, way=way, target=target,
    )  # fmt: skip


def way_of(the_map: Map, key: tuple[int, int], ends: list[float]) -> int:
    """Return on which side of its change of branch an undecided cell takes a branch; there is one change at most."""
    side, branch = key
    slope = the_map.margin[side].gradients(the_map.piece([(ends[0], ends[1])]).balls)[0][0]
    prove(slope > 0 or slope < 0, "that it holds one change of branch at most is not proved")
    return branch if slope > 0 else 1 - branch


def turned_images(
    images: list[Arb], axis: tuple[Arb, Arb], outer: tuple[bool, bool]
) -> tuple[list[Arb], bool]:
    """Turn the ends of an image to the first period of an axis that closes, and say whether it may pass the seam.

    An image may begin or end on the seam exactly, as by f(0) = 0, where `outer` says that the cell does so at an end of
    N; at a border inside N there would be a change of branch between two cells.
    """
    (first, last), (below, above), passes = axis, outer, False
    period = last - first
    turns = (((images[0] + images[1]) / 2 - first) / period).mid().floor()
    images = [y - turns * period for y in images]
    if not (images[0] > first or (below and images[0] >= first)):
        images = [y + period for y in images]
        passes = True
    passes = passes or not (images[1] < last or (above and images[1] <= last))
    fits = images[0] > first and images[1] < last + period
    prove(fits or not passes, "its image is as long as the axis")
    return images, passes


Observed = Callable[[list[float], Arb, Arb, Arb], tuple[float, ...]]
"""Five numbers of g on a cell, from its ends, their ball, its middle, and the derivative of ln |f'| there."""


def enclosed_cell(
    the_map: Map,
    g: Observed,
    key: tuple[int, int],
    ends: list[float],
    axis: tuple[float, Arb | None, list[bool]],
) -> Enclosed:
    """Enclose what the inequalities need of a cell.

    `axis` has the first edge and the period where f leads, and whether the ends of the cell are the first and the last
    edge of its own side, hence ends of N.
    """
    program, ranges, (first_edge, period, outer) = the_map.image[key], the_map.piece([]).balls, axis
    x, middle = arb(ends[0]).union(arb(ends[1])), (arb(ends[0]) + arb(ends[1])) / 2
    _, slope, second = program.bend([x, *ranges])
    regular = second.is_finite() and (slope > 0 or slope < 0)
    least = floats_around(abs(slope))[0] if regular else 0.0
    why = "that the formula is twice differentiable, with a slope of one sign, is not proved"
    prove(least >= LEAST_WEIGHT, why)
    images = [program.at([arb(end), *ranges])[0] for end in (ends if slope > 0 else ends[::-1])]
    prove(all(y.is_finite() for y in images), "an image is not bounded")
    below, above = outer if slope > 0 else outer[::-1]
    passes = False
    if period is not None:
        images, passes = turned_images(images, (arb(first_edge), arb(first_edge) + period), (below, above))
    spans = [floats_around(y) for y in images]
    near = [0.5 * (lo + hi) for lo, hi in spans]
    off = max(math.nextafter(hi - lo, math.inf) for lo, hi in spans)
    bend = floats_around(abs(second) / (slope * slope))[1]
    values = g(ends, x, middle, second / slope)
    prove(all(map(math.isfinite, values)), "the function is not bounded")
    return Enclosed((least, bend, *near, off, *values), passes, bool(slope > 0))


def observed(the_map: Map, average: Average, key: tuple[int, int]) -> Observed:
    """Return the function that bounds g on the cells of a side and branch."""
    program, ranges = the_map.image[key], the_map.piece([]).balls
    if average.places is not None:
        return functools.partial(indicator_of, average.places, key[0])
    if average.formula is not None:
        return functools.partial(bounds_of_formula, the_map.program_of(average.formula), ranges)

    def exponent(_: list[float], x: Arb, middle: Arb, bend: Arb) -> tuple[float, ...]:
        return bounds_of_g(abs(program.gradients([middle, *ranges])[0][0]).log(), bend, x)

    return exponent


def bounds_of_g(middle: Arb, slope: Arb, x: Arb) -> tuple[float, ...]:
    """Bound a function by its value in the middle of a cell and its slopes: its mean is off by |I|(B - A)/8 at most."""
    half, spread = x.rad(), slope.rad()  # |I| = 2 half, B - A = 2 spread
    mean = middle + arb(0, 1) * (half * spread / 2)
    largest = half * abs(slope).abs_upper()
    ball = middle + arb(0, 1) * largest
    (lo, hi), (least, most) = floats_around(mean), floats_around(ball)
    return lo, hi, least, most, floats_around(2 * largest)[1]


def bounds_of_formula(
    program: Program, ranges: list[Arb], _: list[float], x: Arb, middle: Arb, __: Arb
) -> tuple[float, ...]:
    """Bound a formula on a cell: by its slopes, or by its ball where it has a kink or jump."""
    slope = program.gradients([x, *ranges])[0][0]
    if slope.is_finite():
        return bounds_of_g(program.at([middle, *ranges])[0], slope, x)
    least, most = floats_around(program.at([x, *ranges])[0])
    return least, most, least, most, math.nextafter(most - least, math.inf)


def indicator_of(places: list[Any], side: int, ends: list[float], *_: Arb) -> tuple[float, ...]:
    """Bound the indicator of some places: 1 in one of them, 0 off all but for borders, else between."""
    own = [box[0] for s, box in places if s == side]
    inside = any(lo <= ends[0] and ends[1] <= hi for lo, hi in own)
    off = all(hi <= ends[0] or ends[1] <= lo for lo, hi in own)
    least, most = (1.0, 1.0) if inside else (0.0, 0.0) if off else (0.0, 1.0)
    return least, most, least, most, most - least


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


def met_cells(c: MapCells, step: Step, own: Array) -> Met:
    """Find the cells that images meet.

    The image of a decided cell lies in N, and in one run of its cells, which its middle tells; ends that are cut to
    that run are as near to the true ones.  Of the image on one of two branches a part of it alone lies there: in the
    target cells of the file, with neighbours.
    """
    edges, begin = c.edges[step.to][0], int(c.start[step.to])
    mine, middle = own[begin : begin + len(edges) - 1], step.ends.mean(axis=1)
    at = np.clip(np.searchsorted(edges, middle, "right") - 1, 0, len(mine) - 1)
    alone, inside = step.target[:, 0] < 0, np.ones(len(own), dtype=bool)
    at = np.where(alone, at, step.target[:, 0])
    inside[step.cells] = mine[at]
    c.prove_all(inside, "its image is not seen to lie in its component")
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


def means_over(c: MapCells, step: Step, met: Met, u: Array) -> Mean:
    """Take mean and integrals of u over images, adding the cells one after another; rounding is within the bounds.

    Of undecided cells only the extremes of u mean something.
    """
    length = met.ends[:, 1] - met.ends[:, 0]
    shortest = length * (1.0 - ROUNDED) - 2.0 * step.off
    proper = np.ones(len(c.rank), dtype=bool)
    proper[step.cells] = (shortest > 0.0) | step.undecided
    c.prove_all(proper, "its image is too short for what is known of its ends: take coarser cells")
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


def check_average(the_map: Map, c: MapCells, average: Average) -> None:
    """Check the bounds of all components that have them."""
    count, row = len(c.rank), 0
    alike = all(len(one) == count for one in (average.upper, average.lower, average.weight))
    prove(alike, "the numbers of the average do not have one row for each cell")
    for component in sorted(average.bounds):
        own = c.component == component
        prove(bool(own.any()), f"component {component} has no cells")
        closed = any(periods[0] is not None and own[c.start[s]] for s, periods in enumerate(c.periods))
        prove(not closed or bool(own.all()), "an axis closes, and not all cells are of one component")
        fits = (average.weight >= LEAST_WEIGHT) & (average.weight <= MOST_WEIGHT)
        c.prove_all(~own | fits, "its weight is not between 2^-100 and 2^100")
        steps = list(enclosed_steps(the_map, c, average, own))
        changes = np.unique(np.concatenate([step.cells[step.undecided] for step in steps])).tolist()
        prove(len(changes) <= MOST_CHANGES, f"more than {MOST_CHANGES} cells of a component are undecided")
        runs = average.runs[row : row + len(changes)].tolist()
        row += len(runs)
        prove(len(runs) == len(changes), "an undecided cell has no runs beside it")
        check_component(c, average, component, steps, dict(zip(changes, runs, strict=True)))
    require(row == len(average.runs), "there are runs beside no undecided cell")


def check_component(
    c: MapCells, average: Average, component: int, steps: list[Step], runs: dict[int, list[int]]
) -> None:
    """Check the two inequalities on the cells of a component, for both ends."""
    own, w = c.component == component, average.weight
    sides, met = Sides(*np.zeros((2, len(own)))), [met_cells(c, step, own) for step in steps]
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
        add_run(c, own, (cell - below, cell - 1), terms[0], sides, above=False)
        add_run(c, own, (cell + 1, cell + above), terms[1], sides, above=True)
    lower, upper = average.bounds[component]
    for u, sign, bound in ((average.upper, 1.0, upper), (average.lower, -1.0, -lower)):
        total, size, s = cell_terms(c, steps, met, u, sign)
        fits = w * (1.0 - ROUNDED) >= np.maximum(s, LEAST_S) + sides.of_a
        c.prove_all(~own | fits, "its weight is smaller than what the inequality of variations asks for")
        most = total + sides.of_b - u
        most += FEW * (size + np.abs(u)) + ROUNDED * sides.of_b
        what = "upper" if sign > 0 else "lower"
        c.prove_all(~own | (most <= bound), f"the {what} end of the average is not proved there")


def cell_terms(
    c: MapCells, steps: list[Step], met: list[Met], u: Array, sign: float
) -> tuple[Array, Array, Array]:
    """Return by cell a bound of the mean of sign g + u o f, the size of its parts, and s."""
    count = len(c.rank)
    mean, size, s = np.full(count, -np.inf), np.zeros(count), np.zeros(count)
    low, high = (
        np.full((2, count), np.inf),
        np.full((2, count), -np.inf),
    )  # of g and u, where a cell is undecided
    width = np.concatenate([np.diff(axes[0]) for axes in c.edges])
    for step, cells in zip(steps, met, strict=True):
        over, at, decided = means_over(c, step, cells, u), step.cells, ~step.undecided
        g_mean = step.g[:, 1] if sign > 0 else -step.g[:, 0]
        off = over.error + step.bend * over.r
        mean[at[decided]] = (g_mean + over.mean + off)[decided]
        size[at[decided]] = (np.abs(g_mean) + np.abs(over.mean) + off)[decided]
        by_parts = over.r * (1.0 / step.least + 2.0 * width[at] * step.bend) + width[at] * step.g[:, 4] / 4.0
        s[at[decided]] = (by_parts * (1.0 + ROUNDED))[decided]
        for k, (least, most) in enumerate(((step.g[:, 2], step.g[:, 3]), (over.least, over.most))):
            low[k, at], high[k, at] = np.minimum(low[k, at], least), np.maximum(high[k, at], most)
    undecided = np.unique(np.concatenate([step.cells[step.undecided] for step in steps]))
    largest_g, largest_u = high[0, undecided] if sign > 0 else -low[0, undecided], high[1, undecided]
    mean[undecided], size[undecided] = largest_g + largest_u, np.abs(largest_g) + np.abs(largest_u)
    spread = (high[:, undecided] - low[:, undecided]).sum(axis=0)
    s[undecided] = width[undecided] * spread / 4.0 * (1.0 + ROUNDED)
    return mean, size, s


def add_run(c: MapCells, own: Array, run: tuple[int, int], term: float, sides: Sides, *, above: bool) -> None:
    """Add the terms of one side of a change to the cells of its run, from the first to the last."""
    first, last = run
    next_to = first - 1 if above else last + 1
    side = int(c.side_of(np.array([next_to]))[0])
    edges, begin, end = c.edges[side][0], int(c.start[side]), int(c.start[side + 1])
    fits = begin <= min(first, next_to) and max(last, next_to) < end and first <= last
    prove(
        fits and bool(own[first : last + 1].all()),
        f"{c.name(next_to)}: a run beside it is not one of its component",
    )
    lower, upper = edges[first - begin : last + 1 - begin], edges[first + 1 - begin : last + 2 - begin]
    length = float(upper[-1] - lower[0]) * (1.0 - ROUNDED)
    distance = upper[-1] - lower if above else upper - lower[0]  # from the far end
    sides.of_a[first : last + 1] += term * np.minimum(distance / length, 1.0)
    sides.of_b[first : last + 1] += term / length


# ----------------------------------------------------------------
# Words.


def average_in_words(average: Average, components: dict[int, str]) -> str:
    """Say what is averaged and what is proved of it."""
    if average.formula is not None:
        what = "of " + "; ".join(in_words(average.formula, ["g"]))
    elif average.places is not None:
        spans = ", ".join(f"[{box[0][0]!r}, {box[0][1]!r}] of side {side}" for side, box in average.places)
        what = f"of the share of steps in {spans}"
    else:
        what = "of ln |dx'/dx|, the Lyapunov exponent,"
    said = [
        f"of almost every start in {name} the average {what} converges to a number from {lo!r} to {hi!r}"
        for (_, (lo, hi)), name in zip(sorted(average.bounds.items()), components.values(), strict=True)
    ]
    return f"{'; '.join(said)}; means over invariant densities lie there too"
