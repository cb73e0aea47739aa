"""Averages along almost every orbit of an expanding map on a line: cells, and what the search needs of them."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.proofs.prover.average_steps import Branch, bends_of, values_of
from limitsets.proofs.prover.averages import Average, confirmed
from limitsets.proofs.prover.certificate_of_map import IMPOSSIBLE, OF_SIZE
from limitsets.proofs.prover.observables import Asked, Subject, asked_for
from limitsets.proofs.prover.proof import Claim, undecided
from limitsets.proofs.prover.proof_of_map import ProofOfMap
from limitsets.systems.cells import Grid
from limitsets.systems.maps import images, kind_of, turning_points
from limitsets.systems.maps.contract import between
from limitsets.systems.maps.critical import margins
from limitsets.systems.maps.derived import branch_boxes

# Half the width of a cell that holds a change, as a share of its side, and beyond what a range of parameters makes it;
# steps that find it.
TINY, MORE, BISECTIONS = 2.0**-40, 2.0**-20, 60
# A cell that holds a change is smaller than this share of its side; how much larger each cell beside it is.
SMALL, GRADE = 2.0**-30, 4.0


# ---------------------------------------------------------------- cells that hold a change of branch


def cut_at_changes(
    lower: Any, upper: Any, grid: Grid, jumps: Sequence[tuple[int, float]] = (), *, turns: bool = False
) -> Grid:
    """Cut the cells of a line at jumps of what is averaged, and so that changes of branch lie in very small ones.

    With `turns` those places too where the map turns; towards both cells become smaller.
    """
    edges = []
    for side, (borders,) in enumerate(grid.edges):
        tiny = TINY * (borders[-1] - borders[0])
        for end in [end for s, end in jumps if s == side and borders[0] + tiny < end < borders[-1] - tiny]:
            borders = np.sort(np.append(borders[np.abs(borders - end) > tiny], end))
        first, last = (_changes_at(params, grid, side) for params in (lower, upper))
        if turns:
            first, last = (
                np.union1d(at, [point.x for point in turning_points(params, grid.domain)[side]])
                for at, params in ((first, lower), (last, upper))
            )
        if len(first) != len(last):  # changes come and go between the corners
            edges.append((borders,))
            continue
        # the checker's balls of a range of parameters are wider by a share of it, and next to the change no cell may be
        # shorter than what its ends move by
        least, most, moves = np.minimum(first, last), np.maximum(first, last), np.abs(last - first)
        beyond = tiny + MORE * moves
        for lo, hi, apart in zip(least - beyond, most + beyond, tiny + 8.0 * moves, strict=True):
            if borders[0] + tiny < lo and hi < borders[-1] - tiny:  # else f begins or ends on the seam
                kept = (borders < lo - apart) | (borders > hi + apart)
                kept[[0, -1]] = True
                borders = np.sort(np.concatenate([borders[kept], [lo, hi]]))
        edges.append((graded(borders) if turns else borders,))
    return Grid(grid.domain, tuple(edges))


def graded(edges: Array) -> Array:
    """Cut the neighbours of very small cells, each time GRADE times larger."""
    widths, more = np.diff(edges), []
    for k in np.flatnonzero(widths < SMALL * (edges[-1] - edges[0])).tolist():
        steps = widths[k] * GRADE ** np.arange(math.log(1.0 / widths[k], GRADE) + 1.0)
        below, above = edges[k] - steps, edges[k + 1] + steps
        more += [below[below > edges[max(k - 1, 0)]], above[above < edges[min(k + 2, edges.size - 1)]]]
    return np.unique(np.concatenate([edges, *more]))


def _changes_at(params: Any, grid: Grid, side: int) -> Array:
    """Find where the branch changes between borders of cells, or the image passes the seam of an axis that closes."""
    borders, first = grid.edges[side][0], grid.domain.lo[side, 0]
    period = grid.domain.hi[side, 0] - first

    def level(x: Array) -> Array:
        if kind_of(params).has_margin:
            return np.asarray(margins(params, x, side) > 0.0, dtype=np.float64)
        after = images(params, x, side).x.ravel()
        return np.floor((after - first) / period) if grid.domain.closes else np.zeros(x.size)

    at = level(borders)
    k = np.flatnonzero(at[1:] != at[:-1])
    lo, hi, below = borders[k], borders[k + 1], at[k]
    for _ in range(BISECTIONS):
        middle = 0.5 * (lo + hi)
        same = level(middle) == below
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    return np.asarray(np.sort(0.5 * (lo + hi)))


# ---------------------------------------------------------------- branches


def _targets(proof: ProofOfMap) -> list[Ints]:
    names = [name for name in proof.arrays if name.startswith("target.")]
    return [proof.arrays[name] for name in names]


def branches_of(
    proof: ProofOfMap, asked: Asked, own: Mask, undecided: Mask, wider: float
) -> Iterator[Branch]:
    """Give what the search needs of a component; cells whose images pass the seam become undecided."""
    grid, listed = proof.graph.grid, _targets(proof)
    side_of = grid.side_of(np.arange(grid.n_cells))
    for side, branch in np.ndindex(grid.sides, len(listed)):
        mine = np.flatnonzero(own & (listed[branch][:, 0] != IMPOSSIBLE) & (side_of == side))
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
        places = (lo, 0.5 * (lo + hi), hi)
        after, slopes, off = (np.array(column) for column in zip(*map(at, places), strict=True))
        values = values_of(
            [each.values for each in asked.functions], [x[:, 0] for x in places], slopes, (side, branch)
        )
        bend = bends_of((hi - lo)[:, 0], least, slopes, wider)
        edges, ends = grid.edges[whole.side][0], np.sort(after[::2], axis=0)
        covered, rows = listed[branch][mine].T.astype(np.int64), np.arange(mine.size)
        way = np.zeros(mine.size, np.int64)
        if grid.domain.closes:
            ends, covered, rows, way = _cut_at_seam(edges, ends, slopes[0] > 0.0)
            undecided[mine[rows[mine.size :]]] = True
        if len(listed) > 1 and undecided[mine].any():
            params = between(proof.map, proof.upper)
            way[undecided[mine]] = ways_of(params, grid, mine[undecided[mine]], side, branch)
        yield Branch(
            mine[rows], way, least[rows], bend[rows], off=2.0 * np.maximum(off[0], off[2])[rows],
            values=values[:, :, rows], ends=ends, covered=covered,
            first=int(grid.offset[whole.side]), edges=edges,
        )  # fmt: skip


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


def ways_of(params: Any, grid: Grid, cells: Ints, side: int, branch: int) -> Ints:
    """Say of cells with two branches on which side of the change a branch is taken: 0 below, 1 above."""
    lo, hi = grid.boxes(cells, side)
    rising = margins(params, hi[:, 0], side) > margins(params, lo[:, 0], side)
    return np.where(rising, branch, 1 - branch)


# ---------------------------------------------------------------- the answer


def asked_of_map(of: Any, params: Any, grid: Grid) -> Asked:
    """Read what is averaged of a map on a grid."""
    lo, hi = grid.domain.lo[:, 0].tolist(), grid.domain.hi[:, 0].tolist()
    return asked_for(of, Subject(params, dict(enumerate(zip(lo, hi, strict=True)))))


def averaged(proof: ProofOfMap, of: Any) -> ProofOfMap:
    """Prove between which numbers the average of a function lies, as the checker confirms it; the claim `average`."""
    asked = asked_of_map(of, proof.map, proof.graph.grid)
    if not len(proof.cells):
        why = "there are no attracting cells: images may leave the domain; widen it, or close it (periodic)"
        return replace(proof, claims=(undecided("average", why),))

    def answer(average: Average) -> ProofOfMap:
        claim = Claim("average", "proved", "", average.section)
        return replace(proof, claims=(*proof.claims, claim), average=average)

    open_cells = np.sum([each[:, 0] != IMPOSSIBLE for each in _targets(proof)], axis=0) > 1
    if open_cells.any() and proof.graph.grid.domain.closes:
        why = (
            "an axis closes, of a map of two branches; pass noise= for averages of those whose steps scatter"
        )
        return replace(proof, claims=(undecided("average", why),))
    average = confirmed(
        proof.graph.grid, proof.arrays["component"], open_cells,
        functools.partial(branches_of, proof, asked), asked, answer,
    )  # fmt: skip
    if isinstance(average, Average):
        return answer(average)
    return replace(proof, claims=(undecided("average", average),))
