"""Equal cells of all sides of a map, cut where it jumps or turns, and their images: numpy and `maps.images` alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from limitsets.systems.maps import INWARD, images

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Interval = tuple[int, float, float]  # side, lo, hi

# Of the length of a cell: how far from a cut its two sides are seen, and a step of the image that may be a jump.
BESIDE, JUMPS = 1e-8, 40.0


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
            jumps = np.abs(self.y_left[k][1:] - self.y_right[k][:-1]) > 1e-6 * self.scale
            differ = (np.diff(self.code[k]) != 0) | (np.diff(self.to[k]) != 0) | (rise[1:] != rise[:-1])
            new = np.concatenate([[True], differ | jumps])
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
