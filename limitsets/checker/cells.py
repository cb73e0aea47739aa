"""The cells: their structure and their ranks, and what every single cell claims.

docs/certificates.md, "What it rests on", numbers 1 (cover) and 5 (whole numbers) by integers alone; 2 (landing), 3
(decision), 4 (images) and the slope in balls, cell by cell, shared among processes where there are many cells.
"""

import math
import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, NamedTuple

import flint
import numpy as np
from flint import arb

from .balls import HALF, PRECISION, ZERO, Arb, Array, Pair, UnprovedError, float_of, prove, reason_of
from .file import Cells, rounded
from .model import (
    FULL_TURN,
    Angle,
    at_angle,
    flight,
    over_angles,
    positive_until,
    root_above,
    root_below,
    slope_over,
)
from .scene import DEPTH, Scene, Side, check_by_halves, read_scene

MOST_BOXES = 20_000  # pieces of one cell: a certificate that needs more is refused
CHUNK = 2_000  # cells handed to a worker at once
SMALL = 20_000  # up to so many cells no other process is started
Targets = tuple[Pair, Pair]  # the ends of the target cells of a jog and of a flip
Progress = Callable[[int, int], None] | None  # called with the number of cells done and the number of all


@contextmanager
def added_up(progress: Progress, work: int) -> Iterator[Callable[[int], None]]:
    """Give what is told how many more cells are done; all are only at the end."""
    done = 0

    def advance(more: int) -> None:
        nonlocal done
        done = min(done + more, work - 1)
        if progress is not None:
            progress(done, work)

    yield advance
    if progress is not None:
        progress(work, work)


def marked(ranges: Array, n: int) -> Array:
    """Mark the cells of some ranges, each given by its first and its last one."""
    begin, past = (np.bincount(at, minlength=n + 1) for at in (ranges[:, 0], ranges[:, 1] + 1))
    return np.asarray(np.cumsum((begin - past)[:-1]) > 0)


def targets_of(ways: list[Array], cells: Array) -> Array:
    """Find the cells that are targets of some cells, along the ways given."""
    return marked(np.concatenate([way[cells & (way[:, 0] >= 0)] for way in ways]), len(cells))


def leading_by(ways: list[Array], cells: Array) -> Array:
    """Find the cells from which a throw along some of the ways may lead to some cells."""
    count, leading = np.concatenate([[0], np.cumsum(cells)]), np.zeros(len(cells), dtype=bool)
    for way in ways:
        q = np.flatnonzero(way[:, 0] >= 0)
        leading[q] |= count[way[q, 1] + 1] > count[way[q, 0]]
    return leading


def leading_into(c: Cells, cells: Array) -> Array:
    """Find the cells from which a throw may lead to some cells."""
    return leading_by([c.jog, c.flip], cells)


def grown(cells: Array, more: Callable[[Array], Array]) -> Array:
    """Add to some cells what leads to them or is led to, again and again, until no more is added."""
    count = -1
    while count != int(cells.sum()):
        count = int(cells.sum())
        cells = cells | more(cells)
    return cells


def bracketed(c: Cells) -> Array:
    """Mark the cells whose bracket of phi is one."""
    lo, hi = c.phi.T
    return np.asarray((lo > 0) & (lo < hi) & (hi <= FULL_TURN))


def with_targets(c: Cells, branch: int) -> tuple[Array, Array]:
    """Mark the cells whose targets along a branch are cells of the side it leads to, and those that have none."""
    first, last = (c.jog, c.flip)[branch].T
    side = (c.side + branch) % len(c.edges)
    inside = (first >= c.start[side]) & (first <= last) & (last < c.start[side + 1])
    return inside, (first == -1) & (last == -1)


def check_structure(c: Cells, scene: Scene) -> None:
    """Check order of the edges, brackets, branches and targets, which every claim needs."""
    for i, edges in enumerate(c.edges):
        prove(bool((np.diff(edges) > 0).all()), f"side {i}: the edges of the cells do not ascend")
        prove(bool(arb(float(edges[0])) > scene.sides[i].a), f"side {i}: the cells begin left of a_{i}")
    c.prove_all(bracketed(c), "the bracket of phi is not one")
    c.prove_all((c.branch >= 0) & (c.branch <= 2), "the branch is not 0, 1 or 2")
    c.prove_all(c.component >= -1, "the component is below -1")
    c.prove_all(c.rank >= -1, "the rank is below -1")
    for branch, what in enumerate(("jog", "flip")):
        inside, none = with_targets(c, branch)
        fits = np.where((c.branch == branch) | (c.branch == 2), inside, none)
        c.prove_all(fits, f"its branch and the target cells of a {what} do not fit")


def check_components(c: Cells) -> None:
    """Check that component cells, of which there are some, map into their own component."""
    attracting = c.component >= 0
    prove(bool(attracting.any()), "there are no attracting cells")
    c.check_components(attracting)


def check_reach(c: Cells, scene: Scene, side: int) -> None:
    """Check that the cells of a side reach to the end of the longest arm."""
    whole = Fraction(float(c.edges[side][-1])) >= scene.arm[1]
    prove(whole, f"side {side}: the cells end before arm.length")


def check_ranks(c: Cells, scene: Scene, max_rank: int) -> None:
    """Check that the cells reach to the arm's end and the rank falls off the components."""
    for i in range(len(c.edges)):
        check_reach(c, scene, i)
    inside = c.component >= 0
    c.prove_all(~inside | (c.rank == 0), "a cell of a component has a rank above 0")
    c.prove_all(c.rank >= 0, "nothing is claimed of starts in it: its rank is -1")
    c.prove_all(c.rank <= max_rank, f"its rank is above max_rank = {max_rank}")
    c.check_falling("rank", c.rank, ~inside)


def extents(c: Cells, some: Array, *, inward: bool = False) -> str:
    """List some cells as intervals, for people, rounded outward or inward."""
    parts = []
    for i, edges in enumerate(c.edges):
        own = np.concatenate([[False], some[c.start[i] : c.start[i + 1]], [False]])
        ends = np.flatnonzero(np.diff(own.astype(np.int8)))
        spans = [
            f"[{rounded(edges[a], up=inward)}, {rounded(edges[b], up=not inward)}]"
            for a, b in ends.reshape(-1, 2)[:6]
        ]
        more = " ..." if len(ends) > 12 else ""
        parts.append(f"side {i}: {' u '.join(spans) or 'none'}{more}")
    return "; ".join(parts)


class Failure(NamedTuple):
    """The reason why a cell is not proved: its kind, "image" or "slope", and a text for people."""

    kind: str
    text: str


class Box(NamedTuple):
    """A piece of a cell, of kappa and of the scene; a bracket of the impact angle there; how often each was halved."""

    scene: Scene
    x0: Arb
    x1: Arb
    k0: Arb
    k1: Arb
    low: Angle
    high: Angle
    in_x: int
    in_k: int
    in_s: int

    def halves(self, side: int, of: str) -> list["Box"]:
        """Halve the box in x, in kappa or in a quantity, whichever widens the angle most; [] at the limits of halving.

        `of` is what is too wide: the "decision" or the "image".
        """
        xm = arb(float((HALF * (self.x0 + self.x1)).mid()))
        km = arb(float((HALF * (self.k0 + self.k1)).mid()))
        by_x = self.in_x < DEPTH and self.x0 < xm and xm < self.x1
        by_k = self.in_k < DEPTH and self.k0 < km and km < self.k1
        of_x = float(self.x1 - self.x0) if by_x else 0.0
        of_k = float(HALF * self.high.p * (self.k1 - self.k0)) if by_k else 0.0
        if self.in_s < DEPTH and self.scene.loose > 0 and self.scene.width(of, side) > max(of_x, of_k):
            return [self.of(half, side) for half in self.scene.halves(of, side)]
        if by_k and of_k >= of_x:
            return [self._replace(k0=km, in_k=self.in_k + 1), self._replace(k1=km, in_k=self.in_k + 1)]
        if by_x:
            return [self._replace(x0=xm, in_x=self.in_x + 1), self._replace(x1=xm, in_x=self.in_x + 1)]
        return []

    def of(self, scene: Scene, side: int) -> "Box":
        """Return the box for a narrower scene: the bracket stays, the functions of the angle get narrower."""
        low, high = (at_angle(scene.sides[side], at.p) for at in (self.low, self.high))
        return self._replace(scene=scene, low=low, high=high, in_s=self.in_s + 1)


def check_bracket(s: Side, box: Box) -> None:
    """Check a bracket of phi at two corners of a box, which is enough: f rises with x and falls with kappa."""
    if not positive_until(s, box.x0, box.k1, box.low):
        raise UnprovedError(f"f > 0 up to phi = {float(box.low.p)!r} is not proved at x = {float(box.x0)!r}")
    if not flight(box.x1, box.k0, box.high) < 0:
        raise UnprovedError(f"f < 0 at phi = {float(box.high.p)!r} is not proved at x = {float(box.x1)!r}")


def check_cell(
    scene: Scene, side: int, x: tuple[float, float], phi: tuple[float, float],
    targets: Targets, least: Arb | None,
) -> tuple[Failure | None, int]:  # fmt: skip
    """Prove the statements about one cell; the failure or None, and the number of boxes looked at.

    `targets` are (nan, nan) where the branch is excluded, so that no image lies inside; an upper end inf stands for
    the arm's length.
    """
    k_lo, k_hi = scene.k_lo, scene.k_hi
    s = scene.sides[side]
    first = Box(
        scene,
        arb(x[0]),
        arb(x[1]),
        k0=k_lo,
        k1=k_hi,
        low=at_angle(s, arb(phi[0])),
        high=at_angle(s, arb(phi[1])),
        in_x=0,
        in_k=0,
        in_s=0,
    )
    bad = reason_of(check_bracket, s, first)
    if bad and scene.loose > 0:
        bad = reason_of(
            check_by_halves, scene, lambda half: check_bracket(half.sides[side], first.of(half, side))
        )
    if bad:
        return Failure("image", bad), 1
    stack, boxes = [first], 0
    while stack:
        box = stack.pop()
        boxes += 1
        failure = check_box(box.scene.sides[side], box, targets, least)
        if failure is not None:
            halves = box.halves(side, "decision" if failure.text.endswith("is not excluded") else "image")
            if not halves or boxes + len(stack) > MOST_BOXES:
                return failure, boxes
            for half in halves:
                s = half.scene.sides[side]
                high = root_above(s, half.x1, half.k0, half.high)
                low = root_below(s, half.x0, half.k1, half.low, high.p)
                stack.append(half._replace(low=low, high=high))
    return None, boxes


def check_box(s: Side, box: Box, targets: Targets, least: Arb | None) -> Failure | None:
    """Check decision, images and slope over a box.  Noise of the landing place moves an image, and decides nothing."""
    phi, R = box.low.p.union(box.high.p), box.x0.union(box.x1)
    kappa = box.k0.union(box.k1)
    decision, rise, f_slope = over_angles(s, phi, R, kappa)
    slope = None
    if least is not None or not rise > 0:
        slope = slope_over(s, phi, kappa, rise, f_slope)
    lo, hi = jog_over(s, box, rise, slope)
    lo, hi = lo - s.landing, hi + s.landing
    for branch in (0, 1) if decision == 2 else (decision,):
        if branch == 1:
            lo, hi = lo - s.shift, hi - s.shift
        bad = check_target(s, branch, lo, hi, targets[branch])
        if bad:
            return Failure("image", bad)
    if least is not None and not (slope is not None and (slope >= least or -slope >= least)):
        return Failure("slope", "its slope is not proved to be as large as claimed")
    return None


def jog_over(s: Side, box: Box, rise: Arb, slope: Arb | None) -> tuple[Arb, Arb]:
    """Bound R'(jog) = R + D(phi) over a box from below and from above; `rise` encloses D', and `slope` dR'/dR.

    Where D' > 0 both terms are largest at the upper ends.  Otherwise, where R' is proved to rise with R at each kappa,
    its extremes lie at the ends of the cell, and the mean value theorem encloses D there from a bracket of phi at that
    end.  Otherwise the mean value theorem encloses R' over the box.
    """
    _, x0, x1, k0, k1, low, high, _, _, _ = box
    if rise > 0:
        return x0 + low.D, x1 + high.D
    if slope is not None and slope > 0:
        lo = x0 + low.D + rise * ZERO.union(root_above(s, x0, k0, high).p - low.p)
        hi = x1 + high.D - rise * ZERO.union(high.p - root_below(s, x1, k1, low, high.p).p)
        return lo, hi
    whole = x0.union(x1) + low.D + rise * (low.p.union(high.p) - low.p)
    return whole, whole


def check_target(s: Side, branch: int, lo: Arb, hi: Arb, target: Pair) -> str:
    """Check that the image [lo, hi] of a branch lies inside its target cells; "" or the reason."""
    left, right = target
    if lo > left and (hi <= s.arm if right == math.inf else hi < right):
        return ""
    what = ("jog", "flip")[branch]
    if math.isnan(left):
        return f"a {what} is not excluded"
    image = f"[{float(lo.lower())!r}, {float(hi.upper())!r}]"
    end = "arm.length" if right == math.inf else repr(right)
    return f"the image of a {what}, {image}, is not proved to lie in ({left!r}, {end})"


class Task(NamedTuple):
    """Some cells of one side, with their ends, brackets and the ends of their targets, one row for each."""

    box: int
    side: int
    cells: Array
    rows: Array  # x0, x1, phi_lo, phi_hi, jog lo, jog hi, flip lo, flip hi
    least: float | None


Checked = tuple[
    int, Failure | None, int
]  # the first cell not proved (-1 for none), why, and the boxes looked at
# Balls cannot be sent to another process: each process keeps the texts of all boxes of parameters, with what reads the
# scene or the map of one of them, and that of the box that it is at.
SETUP: list[Any] = []
AT_HAND: dict[int, Any] = {}


def prepare(read: Callable[..., Any], *texts: Any) -> None:
    """Set up a process that checks cells."""
    flint.ctx.prec = PRECISION
    SETUP[:] = read, texts
    AT_HAND.clear()


def of_box(box: int) -> Any:
    """Return the scene or the map of a box of parameters."""
    if box not in AT_HAND:
        AT_HAND.clear()  # together with the halves of a scene
        AT_HAND[box] = SETUP[0](box, *SETUP[1])
    return AT_HAND[box]


def scene_of_box(box: int, raw: list[object], noise: object) -> Scene:
    """Read the scene of a box of parameters."""
    return read_scene(raw[box], noise)


def check_task(task: Task) -> Checked:
    """Check the cells of a task."""
    return check_cells_of(of_box(task.box), task)


def check_cells_of(scene: Scene, task: Task) -> Checked:
    """Check the cells of a task for one scene."""
    least = None if task.least is None else arb(task.least)
    total = 0
    for cell, (x0, x1, p0, p1, j0, j1, f0, f1) in zip(task.cells.tolist(), task.rows.tolist(), strict=True):
        targets = ((j0, j1), (f0, f1))
        failure, boxes = check_cell(scene, task.side, (x0, x1), (p0, p1), targets, least)
        total += boxes
        if failure is not None:
            return cell, failure, total
    return -1, None, total


def tasks_of(c: Cells, scene: Scene, box: int, chosen: Array, least: float | None) -> Iterator[Task]:
    """Cut the chosen cells, which ascend, into tasks of one side each."""
    lower, upper = c.lower(), c.upper()
    short, long = float_of(scene.arm[0], up=False), float_of(scene.arm[1], up=True)
    for side in range(len(c.edges)):
        own = chosen[c.side[chosen] == side]
        for part in np.array_split(own, max(1, -(-len(own) // CHUNK))):
            table = np.full((len(part), 8), math.nan)
            table[:, 0], table[:, 1], table[:, 2:4] = lower[part], upper[part], c.phi[part]
            for column, array in ((4, c.jog[part]), (6, c.flip[part])):
                q = np.flatnonzero(array[:, 0] >= 0)
                table[q, column] = lower[array[q, 0]]
                ends = upper[array[q, 1]]
                # where the shortest arm ends before the target cells do, the image has to end at the arm's end
                table[q, column + 1] = np.where((ends > short) | (ends >= long), math.inf, ends)
            if len(part):
                yield Task(box, side, part, table, least)


@contextmanager
def workers_ignore_interrupts() -> Iterator[None]:
    """Start processes that leave Ctrl-C to this one."""
    if threading.current_thread() is not threading.main_thread():  # only the main thread may set a signal
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)


class UnprovedSlopeError(UnprovedError):
    """The slope on a cell is not proved to be as large as claimed; its image is."""


class Crew:
    """The processes that check cells: this one alone, and others too for large certificates.

    Each process is set up by `prepare(*setup)` and does tasks, which have `cells`, by `check`; `work` counts the cells
    of all tasks, for `progress`.
    """

    def __init__(
        self,
        setup: tuple[Any, ...],
        workers: int,
        progress: Progress,
        work: int,
        check: Callable[[Any], Checked] = check_task,
    ):
        self.setup, self.workers, self.check = setup, workers, check
        self.progress, self.work = progress, work
        self.done = self.boxes = 0
        self.pool: ProcessPoolExecutor | None = None
        prepare(*setup)

    def run(self, name: Callable[[int], str], tasks: Iterable[Any]) -> None:
        """Do some tasks; the reason of a failure names the first cell that fails, in the order of the tasks."""
        tasks = list(tasks)
        if self.workers > 1 and self.pool is None and sum(len(t.cells) for t in tasks) > SMALL:
            # never by fork, which copies locks that other threads hold
            method = multiprocessing.get_start_method(allow_none=True)
            context = multiprocessing.get_context("forkserver" if method == "forkserver" else "spawn")
            self.pool = ProcessPoolExecutor(self.workers, context, prepare, self.setup)
        try:
            with workers_ignore_interrupts():
                results = map(self.check, tasks) if self.pool is None else self.pool.map(self.check, tasks)
            for task, (cell, failure, boxes) in zip(tasks, results, strict=True):
                self.done += len(task.cells)
                self.boxes += boxes
                if failure is not None:
                    kind = UnprovedSlopeError if failure.kind == "slope" else UnprovedError
                    raise kind(f"{name(cell)}: {failure.text}")
                if self.progress is not None:
                    self.progress(min(self.done, self.work), self.work)
        except BrokenProcessPool:  # they cannot be started here, as in a script without a main guard
            self.close()
            self.workers = 1
            self.run(name, tasks)

    def close(self) -> None:
        """End the other processes."""
        if self.pool is not None:
            self.pool.shutdown(cancel_futures=True)
            self.pool = None
