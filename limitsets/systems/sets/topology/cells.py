"""Cells of all sides, each within one piece, their images, and the closed components among them.

A piece is monotone, so the image of a cell is the interval between the images of its ends.  Where all of a cell moves
one way on its own side it is passed: its image counts without the cell itself, which every orbit leaves.
"""

from __future__ import annotations

from typing import Any

from limitsets.numbers.jit import kernel
from limitsets.systems.graph.components import fill_components
from limitsets.systems.graph.ranges import Runs
from limitsets.systems.maps import codes
from limitsets.systems.maps.drivers import fill_images
from limitsets.systems.maps.kernels import image_on, on_side
from limitsets.systems.sets.topology.work import MOST_ATTRACTORS, Cells, Components, Pieces, Region

# Bits of the ways out: beyond the domain or out of the model; back to the joint.
LEAVES, COLLAPSES = 1, 2
# Edges this near to the end of a piece, as a share of a cell, are left out; so much of an image is rounding.
NEAR, ROUNDING = 1e-3, 1e-13


@kernel
def _edges_of_side(side: int, bottom: float, hi: float, shape: Any, p: Pieces, c: Cells) -> None:
    """Place the edges of a side: the ends of its pieces, and those of equal cells between them."""
    e, k, span, cell = 0, 0, hi - bottom, c.begin[side]
    for q in range(p.begin[side], p.begin[side + 1]):
        begin, end, before = p.lo[q], p.hi[q], cell
        c.x[side, e] = begin
        e += 1
        while k < shape.size - 1 and bottom + span * shape[k] <= begin:
            k += 1
        while k < shape.size - 1 and bottom + span * shape[k] < end:
            near = NEAR * span * (shape[k + 1] - shape[k])
            x = bottom + span * shape[k]
            if x - begin > near and end - x > near:
                c.lo[cell], c.hi[cell], c.piece[cell] = c.x[side, e - 1], x, q
                cell += 1
                c.x[side, e] = x
                e += 1
            k += 1
        c.lo[cell], c.hi[cell], c.piece[cell] = c.x[side, e - 1], end, q
        cell += 1
        c.x[side, e] = end
        e += 1
        p.cells[q] = cell - before
    c.edge[side], c.begin[side + 1] = e, cell


@kernel
def cell_of(c: Cells, side: int, x: float) -> Any:
    """Cell of a side that holds x, the first or the last where it lies beyond: by halving."""
    low, high = c.begin[side], c.begin[side + 1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if c.lo[middle] <= x:
            low = middle
        else:
            high = middle - 1
    return low


@kernel
def _walk(at: int, end: int, edges: Any, y: float) -> int:
    """Walk from a cell to the cell that holds y, the first or the last where y lies beyond."""
    while at < end and edges[at + 1] <= y:
        at += 1
    while at > 0 and edges[at] > y:
        at -= 1
    return at


@kernel(entry=True, counting=False)
def _of_piece(
    x: Any,
    y: Any,
    begin: int,
    targets: Any,
    first_target: int,
    bottom: float,
    top: float,
    own: bool,
    cell: int,
    c: Cells,
) -> None:
    """Store the images of the cells of one piece: `x` its edges from number `begin` on, `y` their images.

    `targets`: lower ends of the cells on the side of the images; `own`: the same side.
    """
    rounding = ROUNDING * (abs(bottom) + abs(top))
    end = targets.size - 1
    after = y[begin]
    at_after = min(max(int((after - bottom) / (top - bottom) * end), 0), end) if after == after else 0
    at_after = _walk(at_after, end, targets, after)
    for e in range(begin + 1, y.size):
        before, at_before = after, at_after
        after = y[e]
        at_after = _walk(at_after, end, targets, after)
        rising = before <= after
        low, high = (before, after) if rising else (after, before)
        first, last = (at_before, at_after) if rising else (at_after, at_before)
        out = 0
        if low < bottom - rounding:
            out = COLLAPSES
        if high > top + rounding:
            out |= LEAVES
        if last > first and targets[last] >= high - rounding:
            last -= 1
        if last > first and targets[first + 1] <= low + rounding:
            first += 1
        if low >= top or high <= bottom:
            last = first - 1
        elif own:
            k = cell - first_target
            if before > x[e - 1] and after > x[e] and first == k:
                first += 1
            if before < x[e - 1] and after < x[e] and last == k:
                last -= 1
        c.image_lo[cell], c.image_hi[cell], c.out[cell] = low, high, out
        c.first[cell], c.last[cell] = first_target + first, first_target + last
        c.expands[cell] = high - low > x[e] - x[e - 1]
        cell += 1


@kernel(counting=False, inlined=False)
def fill_cells(params: Any, r: Region, shape: Any, p: Pieces, c: Cells) -> bool:
    """Fill the cells from the pieces; False where an image is not a number or takes another branch than its piece."""
    sides = r.lo.size
    for side in range(sides):
        _edges_of_side(side, r.bottom[side], r.hi[side], shape, p, c)
    sound = True
    for side in range(sides):
        n = c.edge[side]
        x, y, to_side, code = c.x[side, :n], c.y[side, :n], c.to[side, :n], c.code[side, :n]
        fill_images(params, side, (x,), (y,), to_side, code)
        here = on_side(params, side)
        cell, e = c.begin[side], 0
        for q in range(p.begin[side], p.begin[side + 1]):
            branch, to, begin, count = p.branch[q], p.to[q], e, p.cells[q]
            e += count + 1
            if branch < 0:
                for k in range(cell, cell + count):
                    c.out[k] = COLLAPSES if to == codes.INWARD else LEAVES
                    c.first[k], c.last[k], c.expands[k] = k, k - 1, True
                    c.image_lo[k], c.image_hi[k] = c.lo[k], c.lo[k]
            else:
                y[begin], y[e - 1] = p.y_lo[q], p.y_hi[q]
                for k in range(begin + 1, e - 1):
                    if code[k] != branch or to_side[k] != to:
                        # left the domain, or took another branch than its piece: a sliver that the samples missed
                        sound &= code[k] < 0
                        y[k], _, _ = image_on(here, x[k], side, branch)
                    sound &= y[k] == y[k]
                targets = c.lo[c.begin[to] : c.begin[to + 1]]
                _of_piece(x, y[:e], begin, targets, c.begin[to], r.lo[to], r.hi[to], to == side, cell, c)
            cell += count
    return sound


# ----------------------------------------------------------------
# Strongly connected components of the cells, those that are closed, and where the starts of each cell may end.
#
# A component that no image leaves holds an attractor.  Every other cell leads to some of these and of the ways out;
# where it leads to several, the share of its starts for each follows from the lengths of images, as in Ulam's method.


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
    n_attractors, i = 0, 0
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
            if n_attractors == MOST_ATTRACTORS:
                return n_attractors, False
            ends, k.closed[n_attractors] = FIRST << n_attractors, label
            n_attractors += 1
            recurs = False
        for m in range(i, j):
            k.ends[k.order[m]], k.held[k.order[m]] = ends, recurs
        i = j
    return n_attractors, True


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
