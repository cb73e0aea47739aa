"""Thirty random own maps: every cycle closes, none is missed on a line, and every proved claim survives random orbits.

The maps are also written for arrays, and what is asked of them there uses nothing of the package.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pytest

import limitsets as ls
from tests.sets.test_closing import require_closed

ORBITS, CLAIMS = 100_000, ["attracts-all", "expanding", "invariant", "trapping", "cycles"]


class Bent(NamedTuple):
    a: float
    c: float


class Ricker(NamedTuple):
    r: float
    harvest: float
    coming: float


class Broken(NamedTuple):
    a: float
    b: float
    c: float
    d: float
    at: float


class Circle(NamedTuple):
    omega: float
    k: float


class Fold(NamedTuple):
    a: float
    b: float


class Damped(NamedTuple):
    k: float
    b: float
    push: float


class Creased(NamedTuple):
    a: float
    b: float
    step: float


# Written with numpy, so that arrays can follow them too.
def bent(p, x, side, branch):
    return p.a * x - x**3 + p.c, side


def ricker(p, x, side, branch):
    return x * np.exp(p.r - x) * (1.0 - p.harvest) + p.coming, side


def broken(p, x, side, branch):
    return (p.a * x + p.b - 0.1 * x**2 if branch == 0 else p.c * x + p.d + 0.1 * x**2), side


def circle(p, x, side, branch):
    y = x + p.omega - p.k / math.tau * np.sin(math.tau * x)
    return y - np.floor(y), side


def fold(p, x, side, branch):
    return (1.0 - p.a * x[0] ** 2 + x[1], p.b * x[0]), side


def damped(p, x, side, branch):
    v = p.b * x[1] + p.push + p.k / math.tau * np.sin(math.tau * x[0])
    u = x[0] + v
    return (u - np.floor(u), v), side


def creased(p, x, side, branch):
    if branch == 0:
        return (1.0 + p.a * x[0] + x[1], p.b * x[0]), side
    return (1.0 - p.a * x[0] + x[1] - p.step, p.b * x[0]), side


def bent_image(p, x, side):
    after, to = bent(p, x, side, 0)
    return after, to, 0


def ricker_image(p, x, side):
    after, to = ricker(p, x, side, 0)
    return after, to, 0


def circle_image(p, x, side):
    after, to = circle(p, x, side, 0)
    return after, to, 0


def fold_image(p, x, side):
    after, to = fold(p, x, side, 0)
    return after, to, 0


def damped_image(p, x, side):
    after, to = damped(p, x, side, 0)
    return after, to, 0


def broken_margin(p, x, side):
    return x - p.at


def creased_margin(p, x, side):
    return x[0]


def broken_image(p, x, side):
    branch = 1 if broken_margin(p, x, side) > 0.0 else 0
    after, to = broken(p, x, side, branch)
    return after, to, branch


def creased_image(p, x, side):
    branch = 1 if creased_margin(p, x, side) > 0.0 else 0
    after, to = creased(p, x, side, branch)
    return after, to, branch


TWO = ("below", "above")
ls.register(Bent, image=bent_image)
ls.register(Ricker, image=ricker_image)
ls.register(Broken, image=broken_image, image_on=broken, margin=broken_margin, branches=TWO)
ls.register(Circle, image=circle_image)
ls.register(Fold, image=fold_image, dimension=2)
ls.register(Damped, image=damped_image, dimension=2)
ls.register(Creased, image=creased_image, image_on=creased, margin=creased_margin, dimension=2, branches=TWO)


@dataclass
class Kind:
    cls: type
    on: object
    domain: list
    cells: int
    least: tuple
    most: tuple
    margin: object = None

    def image(self, p, x):
        """Images of many states, shape (n, d), and their branches, by numpy alone."""
        at = x[:, 0] if x.shape[1] == 1 else tuple(x.T)
        one = np.reshape(np.array(self.on(p, at, 0, 0)[0]), (x.shape[1], -1)).T
        if self.margin is None:
            return one
        other = np.reshape(np.array(self.on(p, at, 0, 1)[0]), (x.shape[1], -1)).T
        return np.where((self.margin(p, at, 0) > 0.0)[:, None], other, one)

    def times(self, p, x, count):
        for _ in range(count):
            x = self.image(p, x)
        return x

    def random(self, random):
        return self.cls(*random.uniform(self.least, self.most).tolist())


KINDS = [
    Kind(Bent, bent, [(-2.1, 2.1)], 2048, (0.3, -0.2), (2.5, 0.2)),
    Kind(Ricker, ricker, [(0.001, 12.0)], 2048, (1.2, 0.0, 0.01), (3.2, 0.3, 0.2)),
    Kind(
        Broken,
        broken,
        [(-1.5, 1.5)],
        2048,
        (-1.7, -0.3, -1.7, -0.3, -0.4),
        (1.7, 0.3, 1.7, 0.3, 0.4),
        broken_margin,
    ),
    Kind(Circle, circle, [(0.0, 1.0)], 1024, (0.0, 0.2), (1.0, 1.6)),
    Kind(Fold, fold, [(-1.6, 1.6), (-0.6, 0.6)], 192, (0.2, -0.3), (1.4, 0.3)),
    Kind(Damped, damped, [(0.0, 1.0), (-1.0, 1.0)], 128, (0.3, 0.1, 0.0), (2.0, 0.5, 0.3)),
    Kind(
        Creased, creased, [(-2.5, 2.5), (-1.2, 1.2)], 128, (0.4, -0.4, -0.1), (1.6, 0.4, 0.3), creased_margin
    ),
]
COUNTS = (5, 4, 5, 5, 4, 4, 3)
CASES = [
    pytest.param(kind, seed, id=f"{kind.cls.__name__}-{seed}")
    for kind, count in zip(KINDS, COUNTS, strict=True)
    for seed in range(count)
]


def require_none_missed(kind, p, found, up_to):
    """Roots of F^k(x) = x on a line, bisected between samples, are points of the cycles that are found."""
    points = np.concatenate([np.ravel(c.x) for c in found] or [np.zeros(0)])
    ((lo, hi),) = kind.domain
    x = np.linspace(lo, hi, 60_001)[1:-1] + 1e-7
    for period in range(1, up_to + 1):
        a, b = x[:-1], x[1:]
        below = kind.times(p, a[:, None], period)[:, 0] > a
        k = np.flatnonzero(below != (kind.times(p, b[:, None], period)[:, 0] > b))
        a, b, below = a[k], b[k], below[k]
        for _ in range(60):
            middle = 0.5 * (a + b)
            same = (kind.times(p, middle[:, None], period)[:, 0] > middle) == below
            a, b = np.where(same, middle, a), np.where(same, b, middle)
        root = 0.5 * (a + b)
        path = [root[:, None]]
        for _ in range(period):
            path.append(kind.image(p, path[-1]))
        ahead = np.hstack(path)
        inside = ((ahead > lo + 1e-6) & (ahead < hi - 1e-6)).all(axis=1)
        true = root[(np.abs(ahead[:, -1] - root) < 1e-9) & inside]
        for each in true:
            assert np.abs(points - each).min(initial=np.inf) < 1e-6, (period, each)
    return points.size


def in_cells(grid, mask, x):
    """Whether each state lies in one of some cells, by their edges; on a border in any that meets there."""
    held = np.zeros(len(x), dtype=bool)
    for nudge in (0.0, 1e-12, -1e-12):
        number = np.zeros(len(x), dtype=np.int64)
        good = np.ones(len(x), dtype=bool)
        for axis, edges in enumerate(grid.edges[0]):
            at = np.searchsorted(edges, x[:, axis] + nudge, side="right") - 1
            at = np.where(x[:, axis] == edges[-1], edges.size - 2, at)
            good &= (at >= 0) & (at < edges.size - 1)
            number = number * (edges.size - 1) + np.clip(at, 0, edges.size - 2)
        held |= good & mask[number]
    return held


def slopes(kind, p, x):
    """Derivative of the step at states (n, d) by central differences, nan across a switch or a seam."""
    n, d = x.shape
    found = np.empty((n, d, d))
    for axis in range(d):
        h = np.zeros(d)
        h[axis] = 1e-6
        found[:, :, axis] = (kind.image(p, x + h) - kind.image(p, x - h)) / 2e-6
    found[(np.abs(found) > 1e3).any(axis=(1, 2))] = np.nan
    return found


def require_true(kind, proof, ends, random):
    """Hold what is proved against random orbits, of random maps between two."""
    grid, verdict = proof.graph.grid, {claim.claim: claim for claim in proof.claims}
    low, high = np.array(kind.domain).T
    for _ in range(5):
        p = kind.cls(*random.uniform(*ends).tolist())
        everywhere = random.uniform(low, high, (ORBITS // 5, grid.dimension))
        if verdict["invariant"].verdict == "proved":
            numbers = random.choice(proof.cells.numbers(), ORBITS // 5)
            lo, hi = grid.boxes(numbers, 0)
            x, mine = random.uniform(lo, hi), proof.component[numbers]
            for _ in range(60):
                x = kind.image(p, x)
                assert all(in_cells(grid, proof.component == k, x[mine == k]).all() for k in np.unique(mine))
        if verdict["attracts-all"].verdict == "proved":
            x = kind.times(p, everywhere, verdict["attracts-all"].section["max_rank"])
            assert in_cells(grid, proof.cells.mask, x).all()
        enters = in_cells(grid, proof.enters.mask, everywhere)
        x = kind.times(p, everywhere[enters], 3000 if grid.dimension == 1 else 600)
        assert in_cells(grid, proof.cells.mask, x).all()
        if verdict["expanding"].verdict in ("proved", "refuted"):
            numbers = random.choice(proof.cells.numbers(), 20_000)
            lo, hi = grid.boxes(numbers, 0)
            size = np.abs(slopes(kind, p, random.uniform(lo, hi))[:, 0, 0])
            size = size[np.isfinite(size)]
            assert (
                (size > 1.0 - 1e-5).all()
                if verdict["expanding"].verdict == "proved"
                else (size < 1.0 + 1e-5).all()
            )
        for cycle in proof.cycles[:: max(1, len(proof.cycles) // 50)]:
            require_orbit(kind, p, cycle)


def require_orbit(kind, p, cycle):
    """Find the cycle of one map that a box promises, by Newton's method at all points, and hold it against the box."""
    x = 0.5 * (cycle.lo + cycle.hi)
    period, d = x.shape
    shift = np.kron(np.roll(np.eye(period), 1, axis=1), np.eye(d))
    for _ in range(30):
        step = slopes(kind, p, x)
        matrix = -shift
        for j in range(period):
            matrix[d * j : d * j + d, d * j : d * j + d] += step[j]
        move = np.linalg.solve(matrix, (kind.image(p, x) - np.roll(x, -1, axis=0)).ravel())
        x = x - move.reshape(x.shape)
    assert np.abs(kind.image(p, x) - np.roll(x, -1, axis=0)).max() < 1e-9
    assert ((cycle.lo - 1e-9 <= x) & (x <= cycle.hi + 1e-9)).all()
    total = np.eye(d)
    for one in step:
        total = one @ total
    size = np.abs(np.linalg.eigvals(total)).max()
    assert cycle.attracts is None or (size < 1.0 + 1e-6 if cycle.attracts else size > 1.0 - 1e-6)


@pytest.mark.sweep
@pytest.mark.parametrize(("kind", "seed"), CASES)
def test_thirty_random_own_maps(kind, seed):
    random = np.random.default_rng([seed, len(kind.cls.__name__)])
    p = kind.random(random)
    grid = ls.grid(kind.domain, cells=kind.cells)
    graph = ls.transitions(p, grid)
    found = ls.cycles(graph, 5)
    require_closed(p, found)
    missed = require_none_missed(kind, p, ls.cycles(graph, 5), 4) if grid.dimension == 1 else 0
    width = random.choice([0.0, 1e-4]) * (np.array(kind.most) - np.array(kind.least))
    upper = kind.cls(*(np.array(p) + width).tolist())
    proof = ls.certify(p, grid, CLAIMS, upper=upper)
    require_true(kind, proof, (np.array(p), np.array(upper)), random)
    words = ", ".join(f"{claim.claim} {claim.verdict}" for claim in proof.claims)
    print(f"{p}: {len(found)} cycles, {missed} points; {len(proof.cycles)} proved, {words}")
