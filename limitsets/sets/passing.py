"""Recurrent sets of cells in which no orbit stays: cells that meet their own image because they are coarse.

Such a set is refined by itself; where images are sampled in more than one dimension they are enlarged by a fine cell on
every side.  If no fine cell is recurrent, every orbit passes through, and the cells that lead there can be decided
without a finer grid.  Where the images are proved, the fine ones are too, for the same box of parameters.
"""

from __future__ import annotations

from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.graph import TransitionGraph
from limitsets.graph.images.hulls import BOTH, NOTHING, BoxImages
from limitsets.maps import images

__all__ = ["longest_stays", "passing"]

# Fine cells in all, beyond which nothing is looked at; parts of a cell along an axis, as many as these allow.
MOST_CELLS, PARTS = 100_000, (64, 32, 16, 8, 4, 2)

Integers = NDArray[np.int64]


def passing(graph: TransitionGraph) -> NDArray[np.bool_]:
    """Tell the recurrent components that orbits pass through; proved where the images are.

    Returns
    -------
    ndarray of bool, shape (k,)
        For each of `graph.recurrent_components()`; an attracting one is none.
    """
    return _passed(graph)[0]


def longest_stays(graph: TransitionGraph) -> Integers:
    """Most steps that an orbit stays in each recurrent component that it passes through; 0 for the others."""
    found, fine = _passed(graph)
    stays = np.zeros(found.size, dtype=np.int64)
    if fine is None:
        return stays
    on = found[fine.owners]
    source, target = fine.source[on[fine.source]], fine.target[on[fine.source]]
    steps = 0
    while on.any():  # take away the cells from which nothing is left to go to, again and again
        steps += 1
        stays[fine.owners[on]] = steps
        goes = np.zeros(on.size, dtype=bool)
        goes[source] = True
        on &= goes
        kept = on[target]
        source, target = source[kept], target[kept]
    return stays


class _Fine(NamedTuple):
    """The component of each fine cell, cell by cell, and edges between those of one component, by place among them."""

    owners: Integers
    source: Integers
    target: Integers
    unclear: Integers


def _passed(graph: TransitionGraph) -> tuple[NDArray[np.bool_], _Fine | None]:
    """Tell the components that orbits pass through, and give the finer graph that says so."""
    sets, attracting = graph.recurrent_components(), graph.condensation().attracting
    found = np.zeros(len(sets), dtype=bool)
    chosen = np.flatnonzero(~attracting)
    cells = np.concatenate([np.empty(0, np.int64), *(sets[k] for k in chosen)])
    dimension = graph.grid.dimension
    parts = next((p for p in PARTS if cells.size * p**dimension <= MOST_CELLS), 0)
    if not cells.size or not parts:
        return found, None
    component = np.full(graph.n_cells, -1)
    component[cells] = np.repeat(chosen, [sets[k].size for k in chosen])
    fine = _finer(graph, np.sort(cells), component, parts)
    found[chosen] = True
    found[_recurring(fine)] = False
    return found, fine


def _recurring(fine: _Fine) -> Integers:
    """Components with a fine cell that can come back to itself, or of which the images do not tell."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    n = fine.owners.size
    edges = coo_array((np.ones(fine.source.size), (fine.source, fine.target)), shape=(n, n))
    _, label = connected_components(edges.tocsr(), directed=True, connection="strong")
    several = np.bincount(label)[label] > 1
    several[fine.source[fine.source == fine.target]] = True
    return np.unique(np.concatenate([fine.owners[several], fine.unclear]))


def _finer(graph: TransitionGraph, cells: Integers, component: Integers, parts: int) -> _Fine:
    """Cut the cells of components, and find which of their fine cells lead to which."""
    grid, fine = graph.grid, graph.grid.refine(parts)
    proved = graph.method == "boxes"
    owner, sources, targets, unclear = [], [], [], []
    rank, begun, of_each = np.zeros(graph.n_cells, np.int64), 0, parts**grid.dimension
    rank[cells] = np.arange(cells.size)
    for side in range(grid.sides):
        here = cells[(cells >= grid.offset[side]) & (cells < grid.offset[side + 1])]
        if not here.size:
            continue
        sub = np.indices((parts,) * grid.dimension).reshape(grid.dimension, -1)
        place = [(at[:, None] * parts + s).ravel() for at, s in zip(grid.axes(here, side), sub, strict=True)]
        whole = component[np.repeat(here, of_each)]
        owner.append(whole)
        boxes, clear = (_enclosed if proved else _hulls)(graph, fine, place, side)
        unclear.append(whole[~clear])
        for lo, hi, to, given in boxes:
            for after in np.unique(to[given]).tolist():
                some = np.flatnonzero(given & (to == after))
                source, position = _met(
                    fine, after, lo[some], hi[some], int(grid.dimension > 1 and not proved)
                )
                coarse = np.ravel_multi_index([at // parts for at in position], tuple(grid.shape[after]))
                coarse += grid.offset[after]
                inside = component[coarse] == whole[some][source]
                within = np.ravel_multi_index(
                    [at[inside] % parts for at in position], (parts,) * grid.dimension
                )
                sources.append(begun + some[source[inside]])
                targets.append(rank[coarse[inside]] * of_each + within)
        begun += whole.size
    source, target = (np.concatenate([*found, rank[:0]]) for found in (sources, targets))
    return _Fine(np.concatenate(owner), source, target, np.concatenate(unclear))


def _hulls(graph: TransitionGraph, fine: Any, place: list[Integers], side: int) -> tuple[list[Any], Any]:
    """Boxes around the images of the corners of fine cells, their sides, where they say; whether all corners agree."""
    found = []
    for corner in product((0, 1), repeat=len(place)):
        points = [edges[at + c] for edges, at, c in zip(fine.edges[side], place, corner, strict=True)]
        found.append(images(graph.map, np.stack(points, axis=1), side))
    x = np.stack([there.x.reshape(-1, len(place)) for there in found])
    code, to = (np.stack([getattr(there, name) for there in found]) for name in ("code", "side"))
    clear = (code == code[0]).all(axis=0) & (to == to[0]).all(axis=0) & (code[0] >= 0)
    clear &= np.isfinite(x).all(axis=(0, 2))
    return [(x.min(axis=0), x.max(axis=0), to[0], clear)], clear


def _enclosed(graph: TransitionGraph, fine: Any, place: list[Integers], side: int) -> tuple[list[Any], Any]:
    """Proved boxes of the images of fine cells, one or two each, their sides, where they are; whether one is proved."""
    lo, hi = (
        tuple(np.ascontiguousarray(edges[at + c]) for edges, at in zip(fine.edges[side], place, strict=True))
        for c in (0, 1)
    )
    found = BoxImages(graph.map, graph.map if graph.upper is None else graph.upper, side, lo, hi)
    boxes = [
        (*(np.stack(corner, axis=1) for corner in found.slots[slot]), found.to[2 * slot], given)
        for slot, given in enumerate((found.count != NOTHING, found.count == BOTH))
    ]
    return boxes, found.count != NOTHING


def _met(fine: Any, side: int, lo: Any, hi: Any, pad: int) -> tuple[Integers, list[Integers]]:
    """Fine cells of one side that boxes meet, and so many more around: which box, position on each axis."""
    first, count = [], []
    for axis, edges in enumerate(fine.edges[side]):
        one = np.searchsorted(edges, lo[:, axis], side="left") - 1 - pad
        last = np.searchsorted(edges, hi[:, axis], side="right") - 1 + pad
        first.append(np.clip(one, 0, edges.size - 2))
        count.append(np.clip(last, 0, edges.size - 2) - first[-1] + 1)
    total = np.prod(count, axis=0)
    box = np.repeat(np.arange(len(lo)), total)
    rest = np.arange(box.size) - np.repeat(np.cumsum(total) - total, total)
    position = []
    for begin, size in zip(first, count, strict=True):
        position.append(begin[box] + rest % size[box])
        rest = rest // size[box]
    return box, position
