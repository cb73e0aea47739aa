"""Strongly connected components of the cells, those that are closed, and where the starts of each cell may end.

A component that no image leaves holds an attractor.  Every other cell leads to some of these and of the ways out; where
it leads to several, the share of its starts for each follows from the lengths of images, as in Ulam's method.
"""

from __future__ import annotations

from typing import Any

from limitsets.graph.components import fill_components
from limitsets.graph.ranges import Runs
from limitsets.jit import kernel
from limitsets.topology.cells import COLLAPSES, LEAVES
from limitsets.topology.work import MOST_ATTRACTORS, Cells, Components, Region

# Bit of the first attractor in `Components.ends`; the ways out have those below.
FIRST = 4
# Sweeps over a component that orbits leave, until the shares of its cells move by less.
MOST_SWEEPS, STILL = 200, 1e-5


@kernel(entry=True, counting=False)
def find_components(sides: int, c: Cells, k: Components) -> tuple[int, bool]:
    """Fill `ends` of every cell, and `held` of those that recur in no closed one; how many are, if all.

    `ends` has the bit ``FIRST << a`` of an attractor that starts may come to, and those of the ways out.
    """
    n = c.begin[sides]
    k.rank[:n], k.loops[:n], k.held[:n], k.ends[:n] = 0, False, False, 0
    fill_components(
        Runs(c.first[:n], c.last[:n]),
        k.rank[:n],
        k.label[:n],
        k.order[:n],
        k.path[:n],
        k.boxes[:n],
        k.rows[:n],
        k.waiting[:n],
        k.loops[:n],
    )
    found, i = 0, 0
    while i < n:
        label, j, ends = k.label[k.order[i]], i, 0
        while j < n and k.label[k.order[j]] == label:
            cell = k.order[j]
            ends |= c.out[cell]
            for target in range(c.first[cell], c.last[cell] + 1):
                ends |= k.ends[target]  # 0 yet for the component's own
            j += 1
        # a cell alone that is stretched over itself holds a repelling fixed point, which all other orbits leave
        recurs = j - i > 1 or (k.loops[k.order[i]] and not c.expands[k.order[i]])
        if ends == 0:
            if found == MOST_ATTRACTORS:
                return found, False
            ends, k.closed[found] = FIRST << found, label
            found += 1
            recurs = False
        for m in range(i, j):
            k.ends[k.order[m]], k.held[k.order[m]] = ends, recurs
        i = j
    return found, True


@kernel
def _single(ends: int) -> bool:
    return ends & (ends - 1) == 0


@kernel
def _column(ends: int) -> int:
    """Column of a single bit in `share`: 0 leaves, 1 collapses, then the attractors."""
    column = 0
    while ends > 1:
        ends >>= 1
        column += 1
    return column


@kernel
def _set(k: Components, cell: int, columns: int, ends: int) -> None:
    """Give a cell whose starts all end in one way its shares; 0 for no way at all."""
    for column in range(columns):
        k.share[cell, column] = 0.0
    if ends:
        k.share[cell, _column(ends)] = 1.0


@kernel(entry=True, counting=False)
def _average(bottom: float, top: float, columns: int, c: Cells, k: Components, cell: int) -> float:
    """Set the shares of a cell to the mean over its image; by how much one of them moved."""
    low, high = c.image_lo[cell], c.image_hi[cell]
    below, above = max(bottom - low, 0.0), max(high - top, 0.0)
    total = below + above
    for target in range(c.first[cell], c.last[cell] + 1):
        total += max(min(high, c.hi[target]) - max(low, c.lo[target]), 0.0)
    moved = 0.0
    for column in range(columns):
        mean = above if column == 0 else below if column == 1 else 0.0
        for target in range(c.first[cell], c.last[cell] + 1):
            overlap = min(high, c.hi[target]) - max(low, c.lo[target])
            mean += max(overlap, 0.0) * k.share[target, column]
        mean = mean / total if total > 0.0 else 0.0
        moved = max(moved, abs(mean - k.share[cell, column]))
        k.share[cell, column] = mean
    return moved


@kernel(entry=True, counting=False)
def shares(r: Region, attractors: int, to: Any, c: Cells, k: Components, out: Any) -> bool:
    """Fill `out`: shares of the starts that leave, that collapse, and that come to each attractor.

    `to` is the side of the images of each piece.  False where cells may lead to a way out that none surely leads to.
    """
    n, columns = c.begin[r.lo.size], attractors + 2
    out[:] = 0.0
    may, does, mixed = 0, 0, 0.0
    for cell in range(n):
        ends, length = k.ends[cell], c.hi[cell] - c.lo[cell]
        may |= ends
        if _single(ends):
            does |= ends
            out[_column(ends)] += length
        else:
            mixed += length
    if mixed > 0.0:
        _mix(r, columns, to, c, k)
        for cell in range(n):
            if not _single(k.ends[cell]):
                for column in range(columns):
                    out[column] += (c.hi[cell] - c.lo[cell]) * k.share[cell, column]
    total = 0.0
    for column in range(columns):
        total += out[column]
    for column in range(columns):
        out[column] /= total
    return (may & ~does) & (LEAVES | COLLAPSES) == 0


@kernel(entry=True, counting=False)
def _mix(r: Region, columns: int, to: Any, c: Cells, k: Components) -> None:
    """Fill the shares of every cell, component by component: those that a component leads to come before it."""
    i, n = 0, c.begin[r.lo.size]
    while i < n:
        label, j = k.label[k.order[i]], i
        while j < n and k.label[k.order[j]] == label:
            j += 1
        ends = k.ends[k.order[i]]
        for m in range(i, j):
            _set(k, k.order[m], columns, ends if _single(ends) else 0)
        for _ in range(0 if _single(ends) else MOST_SWEEPS):
            moved = 0.0
            for m in range(i, j):
                cell = k.order[m]
                side = to[c.piece[cell]]
                moved = max(moved, _average(r.lo[side], r.hi[side], columns, c, k, cell))
            if j - i == 1 or moved < STILL:
                break
        i = j
