"""Recurrent sets of cells in which no orbit stays: cells that meet their own image because they are coarse.

Such a set is refined by itself; in more than one dimension the images are enlarged by a fine cell on every side.  If no
fine cell is recurrent, every orbit passes through, and the cells that lead there can be decided without a finer grid.
"""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.graph import TransitionGraph
from limitsets.maps import images

__all__ = ["passing"]

# Fine cells in all, beyond which nothing is looked at; parts of a cell along an axis, as many as these allow.
MOST_CELLS, PARTS = 100_000, (64, 32, 16, 8, 4, 2)

Integers = NDArray[np.int64]


def passing(graph: TransitionGraph) -> NDArray[np.bool_]:
    """Tell the recurrent components that orbits pass through: none of proved images, which ask for a proof.

    Returns
    -------
    ndarray of bool, shape (k,)
        For each of `graph.recurrent_components()`; an attracting one is none.
    """
    sets, attracting = graph.recurrent_components(), graph.condensation().attracting
    found = np.zeros(len(sets), dtype=bool)
    chosen = np.flatnonzero(~attracting)
    cells = np.sort(np.concatenate([np.empty(0, np.int64), *(sets[k] for k in chosen)]))
    dimension = graph.grid.dimension
    parts = next((p for p in PARTS if cells.size * p**dimension <= MOST_CELLS), 0)
    if graph.method == "boxes" or not cells.size or not parts:
        return found
    component = np.full(graph.n_cells, -1)
    for k in chosen:
        component[sets[k]] = k
    found[chosen] = True
    found[_recurring(graph, cells, component, parts)] = False
    return found


def _recurring(graph: TransitionGraph, cells: Integers, component: Integers, parts: int) -> Integers:
    """Components with a fine cell that can come back to itself, or of which its corners do not tell."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    grid, fine = graph.grid, graph.grid.refine(parts)
    node, owner, sources, targets, unclear = [], [], [], [], []
    for side in range(grid.sides):
        here = cells[(cells >= grid.offset[side]) & (cells < grid.offset[side + 1])]
        if not here.size:
            continue
        sub = np.indices((parts,) * grid.dimension).reshape(grid.dimension, -1)
        place = [(at[:, None] * parts + s).ravel() for at, s in zip(grid.axes(here, side), sub, strict=True)]
        number = fine.offset[side] + np.ravel_multi_index(place, tuple(fine.shape[side]))
        whole = component[np.repeat(here, parts**grid.dimension)]
        node.append(number)
        owner.append(whole)
        lo, hi, to, clear = _hulls(graph, fine, place, side)
        unclear.append(whole[~clear])
        for after in np.unique(to[clear]).tolist():
            some = np.flatnonzero(clear & (to == after))
            source, position = _met(fine, after, lo[some], hi[some])
            coarse = np.ravel_multi_index([at // parts for at in position], tuple(grid.shape[after]))
            inside = component[grid.offset[after] + coarse] == whole[some][source]
            met = fine.offset[after] + np.ravel_multi_index(position, tuple(fine.shape[after]))
            sources.append(number[some][source[inside]])
            targets.append(met[inside])
    nodes, owners = np.concatenate(node), np.concatenate(owner)
    order = np.argsort(nodes)
    nodes, owners = nodes[order], owners[order]
    source, target = (
        np.searchsorted(nodes, np.concatenate([*ends, nodes[:0]])) for ends in (sources, targets)
    )
    edges = coo_array((np.ones(source.size), (source, target)), shape=(nodes.size, nodes.size))
    _, label = connected_components(edges.tocsr(), directed=True, connection="strong")
    several = np.bincount(label)[label] > 1
    several[source[source == target]] = True
    return np.unique(np.concatenate([owners[several], *unclear]))


def _hulls(graph: TransitionGraph, fine: Any, place: list[Integers], side: int) -> tuple[Any, ...]:
    """Boxes around the images of the corners of fine cells, their sides, and whether all corners agree."""
    found = []
    for corner in product((0, 1), repeat=len(place)):
        points = [edges[at + c] for edges, at, c in zip(fine.edges[side], place, corner, strict=True)]
        found.append(images(graph.map, np.stack(points, axis=1), side))
    x = np.stack([there.x.reshape(-1, len(place)) for there in found])
    code, to = (np.stack([getattr(there, name) for there in found]) for name in ("code", "side"))
    clear = (code == code[0]).all(axis=0) & (to == to[0]).all(axis=0) & (code[0] >= 0)
    clear &= np.isfinite(x).all(axis=(0, 2))
    return x.min(axis=0), x.max(axis=0), to[0], clear


def _met(fine: Any, side: int, lo: Any, hi: Any) -> tuple[Integers, list[Integers]]:
    """Fine cells of one side that boxes meet, in the plane one more around: which box, position on each axis."""
    first, count, pad = [], [], int(lo.shape[1] > 1)
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
