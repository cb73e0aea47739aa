"""The topology of one map's attractors from its definitions: many equal cells, scipy's components, long orbits.

Numpy and scipy, and of the package the images of states alone.  Sides are scanned at the ends and the middle of every
cell; where the side, the code or the value of the image jumps, or where the image turns, the cell is cut.  A component
that no image leaves holds an attractor, which is the limit of the images of its cells; 1000 orbits from random starts
say what is really visited, and a stretch of cells that none of them visits is a gap.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from limitsets.maps import INWARD, advance, images, orbit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Interval = tuple[int, float, float]  # side, lo, hi

# Of the length of a cell: how far from a cut its two sides are seen, and a step of the image that may be a jump.
BESIDE, JUMPS = 1e-8, 40.0
# Cells in a row that no orbit visits are a gap; one that is shorter is not told from a band.
HOLE = 4
# Images until a set rests; ends rest that move by less than this share of the longest side.
MOST_IMAGES, REST = 20_000, 1e-13
THROWS, AFTER, STARTS = 3000, 1500, 1000  # before orbits are looked at, from then on, and how many of them


@dataclass
class Attractor:
    """What is found of one attractor; by side where a field is a mapping."""

    bands: dict[int, list[tuple[float, float]]]
    flip_order: tuple[int, ...] | None  # None: it changes
    jogs: dict[int, tuple[int, int]]  # by pushing intervals
    seen_jogs: dict[int, tuple[int, int]]  # by orbits
    period: int
    share: float
    least_gap: float
    holes: int


@dataclass
class Reference:
    """Attractors by side and place, shares of the starts, and whether any start or all of them are lost."""

    attractors: list[Attractor]
    leaves: float
    collapses: float
    remain: float  # of the starts: they neither left nor came to an attractor
    some: dict[str, str] = field(
        default_factory=dict
    )  # "none", "some", "all", or "?" where cells cannot tell


class Scan:
    """Cells of all sides of a map, cut where it jumps or turns, with the images of both ends of each."""

    def __init__(self, params: Any, lo: Floats, hi: Floats, cells: int) -> None:
        self.params, self.lo, self.hi = params, lo, hi
        self.sides, self.per_side = lo.size, cells // lo.size
        self.scale = float((hi - lo).max())
        parts = [self._of_side(side) for side in range(self.sides)]
        self.begin = np.cumsum([0, *(part[0].size for part in parts)])
        self.left, self.right, self.y_left, self.y_right, self.to, self.code = (
            np.concatenate([part[k] for part in parts]) for k in range(6)
        )
        self.side = np.repeat(np.arange(self.sides), np.diff(self.begin))
        self.cuts = [self.left[self.begin[s] : self.begin[s + 1]] for s in range(self.sides)]
        self.before = [(self.cuts[s].size - self.per_side) // 2 for s in range(self.sides)]

    def at(self, x: Floats, side: int) -> tuple[Floats, Ints, Ints]:
        found = images(self.params, x, side)
        return found.x, found.side, found.code

    def _of_side(self, side: int) -> list[Any]:
        edges = np.linspace(self.lo[side], self.hi[side], self.per_side + 1)
        width = edges[1] - edges[0]
        cuts = np.array(sorted(self._cuts(side, edges, width)))
        edges = np.unique(np.concatenate([edges, cuts]))
        edges = edges[np.concatenate([[True], np.diff(edges) > 1e-3 * BESIDE * width])]
        edges[-1] = self.hi[side]
        left, right = edges[:-1], edges[1:]
        # one-sided at cuts; at the other edges the step beside them is below what is compared
        beside = np.minimum(BESIDE * width, 0.25 * (right - left))
        step_l = np.where(np.isin(left, cuts), beside, 0.0)
        step_r = np.where(np.isin(right, cuts), beside, 0.0)
        y_l, _, _ = self.at(left + step_l, side)
        y_r, _, _ = self.at(right - step_r, side)
        _, to, code = self.at(0.5 * (left + right), side)
        bad = code < 0
        out = np.isnan(y_l) | np.isnan(y_r)
        y_l, y_r = np.where(out, 0.0, y_l), np.where(out, 0.0, y_r)
        return [left, right, y_l, y_r, to, np.where(out & ~bad, -99, code)]

    def _cuts(self, side: int, edges: Floats, width: float) -> list[float]:
        """Where the image jumps or turns, by halving and by golden section, all suspected cells at once."""
        x = np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))
        y, to, code = self.at(x, side)
        with np.errstate(invalid="ignore"):
            differ = (to[1:] != to[:-1]) | (code[1:] != code[:-1]) | ~(np.abs(np.diff(y)) <= JUMPS * width)
        cuts: list[float] = []
        k = np.flatnonzero(differ)
        if k.size:
            cuts += self._halved(side, x[k], x[k + 1], width)
        turns = np.flatnonzero((np.diff(y)[1:] * np.diff(y)[:-1] < 0) & ~differ[1:] & ~differ[:-1]) + 1
        for i in turns:
            cuts.append(self._turn(side, x[i - 1], x[i + 1]))
        return cuts

    def _halved(self, side: int, a: Floats, b: Floats, width: float) -> list[float]:
        a, b = a.copy(), b.copy()
        y_a, to_a, code_a = self.at(a, side)
        y_b, to_b, code_b = self.at(b, side)
        for _ in range(60):
            m = 0.5 * (a + b)
            y, to, code = self.at(m, side)
            other_a = (to != to_a) | (code != code_a)
            other_b = (to != to_b) | (code != code_b)
            steps_a, steps_b = np.abs(y - y_a), np.abs(y_b - y)
            left = np.where(other_a == other_b, ~(steps_a <= steps_b), other_a)
            b, y_b = np.where(left, m, b), np.where(left, y, y_b)
            to_b, code_b = np.where(left, to, to_b), np.where(left, code, code_b)
            a, y_a = np.where(left, a, m), np.where(left, y_a, y)
            to_a, code_a = np.where(left, to_a, to), np.where(left, code_a, code)
        jump = (to_a != to_b) | (code_a != code_b) | ~(np.abs(y_a - y_b) <= 1e-6 * self.scale)
        return [float(x) for x in b[jump]]

    def _turn(self, side: int, a: float, b: float) -> float:
        grid = np.linspace(a, b, 41)
        for _ in range(12):
            grid = np.linspace(a, b, 41)
            y, _, _ = self.at(grid, side)
            up = y[20] > 0.5 * (y[0] + y[-1])
            k = int(np.argmax(y) if up else np.argmin(y))
            a, b = grid[max(k - 1, 0)], grid[min(k + 1, 40)]
        return float(0.5 * (a + b))

    def graph(self) -> tuple[csr_array, NDArray[np.bool_], NDArray[np.bool_]]:
        """Which cells each image meets; which images reach below the domain, and which out of it otherwise."""
        low, high = np.minimum(self.y_left, self.y_right), np.maximum(self.y_left, self.y_right)
        n, slack = low.size, 1e-13 * self.scale
        first, last = np.zeros(n, np.int64), np.full(n, -1, np.int64)
        down, out = self.code == INWARD, (self.code < 0) & (self.code != INWARD)
        for side in range(self.sides):
            k = np.flatnonzero((self.code >= 0) & (self.to == side))
            edges = np.append(self.cuts[side], self.hi[side])
            down[k] |= low[k] < self.lo[side] - slack
            out[k] |= high[k] > self.hi[side] + slack
            meets = (high[k] > self.lo[side]) & (low[k] < self.hi[side])
            k = k[meets]
            f = np.searchsorted(edges, low[k] + slack, side="right") - 1
            g = np.searchsorted(edges, high[k] - slack, side="left") - 1
            top = edges.size - 2
            f, g = np.clip(f, 0, top), np.clip(g, 0, top)
            first[k], last[k] = self.begin[side] + f, self.begin[side] + np.maximum(f, g)
        run = np.maximum(last - first + 1, 0)
        pointer = np.concatenate([[0], np.cumsum(run)])
        columns = np.arange(pointer[-1]) - np.repeat(pointer[:-1] - first, run)
        return csr_array((np.ones(columns.size, np.int8), columns, pointer), shape=(n, n)), down, out

    def image(self, union: list[Interval], leaving: bool | None = None) -> list[Interval]:
        """Image of a union of intervals; of what changes sides alone, or of what does not, if so asked."""
        found: list[Interval] = []
        for side in range(self.sides):
            mine = [(lo, hi) for s, lo, hi in union if s == side]
            if not mine:
                continue
            breaks, b = self.breaks[side], self.begin[side]
            parts = []
            for lo, hi in mine:
                for p in range(max(int(np.searchsorted(breaks, lo, side="right")) - 1, 0), breaks.size - 1):
                    if breaks[p] > hi:
                        break
                    u, v = max(lo, breaks[p]), min(hi, breaks[p + 1])
                    if v - u < 0 or (v - u <= 1e-10 * self.scale < hi - lo):
                        continue
                    parts.append((u, v, p))
            ends = np.array([[u, v] for u, v, _ in parts])
            y, _, _ = self.at(ends.ravel(), side)
            y = y.reshape(-1, 2)
            for (u, v, p), (y_u, y_v) in zip(parts, y, strict=True):
                first, last = self.pieces[side][p]
                if u == breaks[p]:
                    y_u = self.y_left[b + first]
                if v == breaks[p + 1]:
                    y_v = self.y_right[b + last]
                cell = b + first
                if self.code[cell] < 0:
                    raise ArithmeticError("an attractor with a part that has no image")
                to = int(self.to[cell])
                if leaving is None or (to != side) == leaving:
                    found.append((to, min(y_u, y_v), max(y_u, y_v)))
        return merged(found, 1e-13 * self.scale)

    def find_pieces(self) -> None:
        """Cells side by side that one monotone branch covers."""
        self.breaks, self.pieces = [], []
        for side in range(self.sides):
            k = slice(self.begin[side], self.begin[side + 1])
            rise = self.y_right[k] > self.y_left[k]
            new = np.concatenate(
                [
                    [True],
                    (np.diff(self.code[k]) != 0)
                    | (np.diff(self.to[k]) != 0)
                    | (rise[1:] != rise[:-1])
                    | (np.abs(self.y_left[k][1:] - self.y_right[k][:-1]) > 1e-6 * self.scale),
                ]
            )
            start = np.flatnonzero(new)
            end = np.append(start[1:], new.size)
            self.breaks.append(np.append(self.left[k][start], self.hi[side]))
            self.pieces.append([(int(i), int(j) - 1) for i, j in zip(start, end, strict=True)])

    def cell_of(self, x: Floats, side: Ints) -> Ints:
        """Number of the cell in which each state lies."""
        found = np.empty(x.size, np.int64)
        for s in range(self.sides):
            k, edges = side == s, self.cuts[s]
            # equal cells with few cuts among them: a guess, then a step or two
            width = (self.hi[s] - self.lo[s]) / self.per_side
            at = ((x[k] - self.lo[s]) / width).astype(np.int64) + self.before[s]
            at = np.clip(at, 0, edges.size - 1)
            while True:
                step = (at < edges.size - 1) & (edges[np.minimum(at + 1, edges.size - 1)] <= x[k])
                back = (at > 0) & (edges[at] > x[k])
                if not (step | back).any():
                    break
                at = at + step - back
            found[k] = self.begin[s] + at
        return found


def merged(union: list[Interval], gap: float) -> list[Interval]:
    """Sort intervals and join what touches."""
    found: list[Interval] = []
    for side, lo, hi in sorted(union):
        if found and found[-1][0] == side and lo <= found[-1][2] + gap:
            found[-1] = (side, found[-1][1], max(found[-1][2], hi))
        else:
            found.append((side, lo, hi))
    return found


def settled(scan: Scan, union: list[Interval]) -> list[Interval]:
    """Take images until the ends rest."""
    for _ in range(MOST_IMAGES):
        after = scan.image(union)
        same = len(after) == len(union) and [s for s, *_ in after] == [s for s, *_ in union]
        if (
            same
            and max(
                abs(p - q)
                for a, b in zip(after, union, strict=True)
                for p, q in zip(a[1:], b[1:], strict=True)
            )
            <= REST * scan.scale
        ):
            return after
        union = after
    raise ArithmeticError("the images do not come to rest")


def pushed(scan: Scan, union: list[Interval]) -> dict[int, tuple[int, int]]:
    """Steps that stay on a side between arriving and leaving, fewest and most."""
    found: dict[int, tuple[int, int]] = {}
    arriving = scan.image(union, leaving=True)
    for side in range(scan.sides):
        inside, steps = [each for each in arriving if each[0] == side], 0
        while inside and steps < 5000:
            if scan.image(inside, leaving=True):
                found[side] = (found.get(side, (steps,))[0], steps)
            inside, steps = scan.image(inside, leaving=False), steps + 1
    return found


def _visits(sides: Ints) -> tuple[dict[int, tuple[int, int]], dict[int, set[int]]]:
    """Jogs of whole visits along orbits, one a row, and the sides that follow each."""
    row, at = np.nonzero(sides[:, 1:] != sides[:, :-1])
    left, entered = sides[row, at], sides[row, at + 1]
    pairs = np.unique(np.stack([left, entered]), axis=1)
    after = {int(s): {int(t) for t in pairs[1, pairs[0] == s]} for s in np.unique(pairs[0])}
    whole = row[1:] == row[:-1]  # a visit between two changes of one orbit
    jogs, on = (np.diff(at) - 1)[whole], entered[:-1][whole]
    spans = {int(s): (int(jogs[on == s].min()), int(jogs[on == s].max())) for s in np.unique(on)}
    return spans, after


def _order(after: dict[int, set[int]], sides: list[int]) -> tuple[int, ...] | None:
    """Sides in the order in which they follow one another, from the smallest; None where it changes."""
    if not after:
        return tuple(sides) if len(sides) == 1 else None
    if any(len(each) != 1 for each in after.values()):
        return None
    order = [min(after)]
    while len(order) <= len(after):
        follows = next(iter(after.get(order[-1], {-1})))
        if follows == order[0]:
            return tuple(order) if len(order) == len(after) else None
        order.append(follows)
    return None


def _period(params: Any, x: float, side: int, scale: float) -> int:
    """Length of the cycle on which a state is, 0 for none of at most 4096."""
    at, on = followed(params, x, side, 8192)
    near = (np.abs(at[1:4097] - at[0]) <= 1e-8 * scale) & (on[1:4097] == on[0])
    for p in np.flatnonzero(near) + 1:
        if np.all(np.abs(at[p:8192] - at[: 8192 - p]) <= 1e-7 * scale):
            return int(p)
    return 0


def followed(params: Any, x: float, side: int, count: int) -> tuple[Floats, Ints]:
    """Orbit of `count` steps; where steps round away, or it leaves, its last state stands for the rest."""
    path = orbit(params, x, side, count)
    rest = count + 1 - path.x.size
    return np.pad(path.x, (0, rest), mode="edge"), np.pad(path.side, (0, rest), mode="edge")


def reference(
    params: Any,
    lo: Any,
    hi: Any,
    *,
    cells: int = 160_000,
    starts: int = STARTS,
    throws: int = THROWS,
    after: int = AFTER,
    seed: int = 0,
) -> Reference:
    """Find the topology of the attractors of one map on the domain `lo`, `hi` (one entry per side)."""
    lo, hi = np.asarray(lo, float), np.asarray(hi, float)
    scan = Scan(params, lo, hi, cells)
    scan.find_pieces()
    matrix, down, out = scan.graph()
    count, label = connected_components(matrix, connection="strong")
    rows = np.repeat(np.arange(label.size), np.diff(matrix.indptr))
    leads = label[rows] != label[matrix.indices]
    left = np.zeros(count, bool)
    left[label[rows[leads]]] = True
    left[label[down | out]] = True
    closed = np.flatnonzero(~left)
    rng = np.random.default_rng(seed)
    length = hi - lo
    side = rng.choice(lo.size, starts, p=length / length.sum())
    x0 = rng.uniform(lo[side], hi[side])
    x, side, code, _ = advance(params, x0, side, throws)
    stay = code >= 0
    cell = scan.cell_of(x, side)
    where = np.where(stay, label[cell], -1)
    found = [_attractor(scan, label == c, x, side, where == c, after) for c in closed]
    order = sorted(range(len(found)), key=lambda k: min((s, b[0][0]) for s, b in found[k].bands.items()))
    result = Reference(
        [found[k] for k in order],
        float(np.mean((code < 0) & (code != INWARD))),
        float(np.mean(code == INWARD)),
        float(np.mean(stay & ~np.isin(where, closed))),
    )
    result.some = _ways_out(matrix, np.isin(label, closed), down, out)
    return result


def _ways_out(matrix: csr_array, closed: Any, down: Any, out: Any) -> dict[str, str]:
    """Whether no cell may, some cell surely does, or all surely do leave or collapse."""
    n = closed.size
    ways = np.stack([out, down, closed])
    rows, columns = np.nonzero(ways)
    edges = matrix.tocoo()
    source, target = np.append(edges.row, columns), np.append(edges.col, n + rows)
    backwards = csr_array((np.ones(source.size, np.int8), (target, source)), shape=(n + 3, n + 3))
    may = np.zeros((3, n + 3), bool)
    for k in range(3):
        may[k, breadth_first_order(backwards, n + k, return_predecessors=False)] = True
    may = may[:, :n]
    alone, found = may.sum(axis=0) == 1, {}
    for k, name in enumerate(("leaves", "collapses")):
        sure = alone & may[k]
        found[name] = "none" if not may[k].any() else "all" if sure.all() else "some" if sure.any() else "?"
    return found


def _attractor(scan: Scan, member: Any, x: Floats, side: Ints, mine: Any, after: int) -> Attractor:
    cells = np.flatnonzero(member)
    union = merged([(int(scan.side[k]), scan.left[k], scan.right[k]) for k in cells], 1e-12 * scan.scale)
    union = settled(scan, union)
    counts, jogs, follow, period = np.zeros(member.size, np.int64), {}, {}, 0
    if mine.any():
        paths = [followed(scan.params, x[k], int(side[k]), after) for k in np.flatnonzero(mine)]
        places, on = (np.array(each) for each in zip(*paths, strict=True))
        jogs, follow = _visits(on)
        counts = np.bincount(scan.cell_of(places.ravel(), on.ravel()), minlength=counts.size)
    if mine.any():
        k = int(np.flatnonzero(mine)[0])
        period = _period(scan.params, float(x[k]), int(side[k]), scan.scale)
    bands: dict[int, list[tuple[float, float]]] = {}
    holes = 0
    for s, lo, hi in union:
        parts = _without_holes(scan, counts, s, lo, hi) if mine.any() and period == 0 else [(lo, hi)]
        holes += len(parts) - 1
        bands.setdefault(s, []).extend(parts)
    gaps = [b[0] - a[1] for parts in bands.values() for a, b in pairwise(parts)]
    return Attractor(
        bands,
        _order(follow, sorted(bands)),
        pushed(scan, union),
        jogs,
        period,
        float(mine.mean()),
        min(gaps, default=np.inf),
        holes,
    )


def _without_holes(scan: Scan, counts: Ints, side: int, lo: float, hi: float) -> list[tuple[float, float]]:
    """Cut an interval where several cells in a row are never visited."""
    ends = scan.cell_of(np.array([lo, hi]), np.array([side, side]))
    seen = np.flatnonzero(counts[ends[0] : ends[1] + 1]) + ends[0]
    parts, start = [], lo
    for a, b in pairwise(seen):
        if b - a > HOLE:
            parts.append((start, float(scan.right[a])))
            start = float(scan.left[b])
    return [*parts, (start, hi)]
