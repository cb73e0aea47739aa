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
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from limitsets.systems.maps import INWARD, advance, orbit
from tests.topology.scan import Floats, Interval, Ints, Scan, merged

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


def settled(scan: Scan, union: list[Interval]) -> list[Interval]:
    """Take images until the ends rest."""
    for _ in range(MOST_IMAGES):
        after = scan.image(union)
        same = len(after) == len(union) and [s for s, *_ in after] == [s for s, *_ in union]
        if same and np.abs(np.subtract(after, union)).max() <= REST * scan.scale:
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
