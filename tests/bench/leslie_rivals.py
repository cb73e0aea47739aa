"""The Leslie map by others: CMGDB's batch path, and plain numpy and scipy.

Each does what ours does: images of all cells by corners and one cell more, recurrent components, their order, and for
every cell where its paths end.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from limitsets.systems.maps.codes import OUTSIDE, UNDECIDED

__all__ = ["HI", "LO", "Answer", "by_cmgdb", "by_scipy", "morse_by_cmgdb"]

LO, HI = (-0.001, -0.001), (90.0, 70.0)


@dataclass(frozen=True)
class Answer:
    """What all engines have to agree on; components are named by their number of cells."""

    components: list[int]  # descending
    order: set[tuple[int, int]]  # (from, to), without those that follow from others
    basins: dict[Any, int]  # destination -> cells
    seconds_to_order: float = 0.0


def shape_of(depth: int) -> tuple[int, int]:
    """Cells along the two axes, halved in turn."""
    return 2 ** ((depth + 1) // 2), 2 ** (depth // 2)


def images(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """The Leslie map on points of shape (n, 2)."""
    x, y = points[:, 0], points[:, 1]
    return np.column_stack([(19.6 * x + 23.68 * y) * np.exp(-0.1 * (x + y)), 0.7 * x])


def reduced(order: NDArray[np.bool_], sizes: list[int]) -> set[tuple[int, int]]:
    """Transitive reduction of a transitive order, by the components' sizes."""
    proper = order & ~np.eye(len(sizes), dtype=bool)
    between = (proper.astype(int) @ proper.astype(int)) > 0
    return {(sizes[i], sizes[j]) for i, j in np.argwhere(proper & ~between)}


def cmgdb() -> Any:
    """CMGDB, without the warnings of its import."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import CMGDB
    return CMGDB


def morse_by_cmgdb(
    images: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    ends: tuple[Sequence[float], Sequence[float]],
    depth: int,
    *,
    periodic: bool | Sequence[bool] = False,
    adaptive: bool = False,
) -> tuple[Any, Any]:
    """Morse graph and map graph of CMGDB, from a function of points (n, d) that is called in batches.

    Along an axis that closes images are moved to begin in the domain: of the cat map's lift it loses cells else.
    """
    rival = cmgdb()
    levels = (depth, depth) if adaptive else (depth, depth, depth, 10_000)

    def scalar(rectangle: list[float]) -> list[float]:
        raise AssertionError("the batch map was to be called")

    def batch(rectangles: NDArray[np.float64]) -> NDArray[np.float64]:
        after = rival.BoxMapBatch(images, rectangles, padding=True)
        if not np.any(periodic):
            return after
        begin, period = np.array(ends[0]), np.subtract(ends[1], ends[0])
        turns = np.where(periodic, np.floor((after[:, : begin.size] - begin) / period), 0.0)
        return after - np.tile(turns * period, 2)

    closing = (np.broadcast_to(periodic, len(ends[0])).tolist(),) if np.any(periodic) else ()
    model = rival.Model(*levels, *map(list, ends), *closing, scalar)
    model.set_batch_map(batch)
    return rival.ComputeMorseGraph(model)


def by_cmgdb(depth: int, *, adaptive: bool = False) -> Answer:
    """CMGDB on all cells at once (or halving only what recurs, its own default), the map evaluated in batches.

    The basins, per set of components that a cell can reach, ask for a second pass over the map: CMGDB's way to them.
    """
    begin = perf_counter()
    morse, graph = morse_by_cmgdb(images, (LO, HI), depth, adaptive=adaptive)
    sizes = [len(morse.morse_set(v)) for v in morse.vertices()]
    order = {(sizes[i], sizes[j]) for i, j in morse.edges()}
    seconds = perf_counter() - begin
    basins: dict[Any, int] = {}
    if not adaptive:
        graph.build_cache()
        masks = cmgdb().MorseReachabilityMasks(graph, morse, np.arange(graph.num_vertices()))
        for mask, count in zip(*np.unique(np.asarray(masks), return_counts=True), strict=True):
            reached = frozenset(size for k, size in enumerate(sizes) if int(mask) >> k & 1)
            basins[reached] = int(count)
    return Answer(sorted(sizes, reverse=True), order, basins, seconds)


def _matrix(depth: int) -> tuple[csr_array, int]:
    """Every edge written out; the last node is the way out of the domain."""
    shape = shape_of(depth)
    axes = [np.linspace(lo, hi, n + 1) for lo, hi, n in zip(LO, HI, shape, strict=True)]
    points = images(np.stack([m.ravel() for m in np.meshgrid(*axes, indexing="ij")], axis=1))
    first, last = [], []
    leaves = np.zeros(shape, dtype=bool)
    for axis, n in enumerate(shape):
        at = points[:, axis].reshape(shape[0] + 1, shape[1] + 1)
        corners = (at[:-1, :-1], at[1:, :-1], at[:-1, 1:], at[1:, 1:])
        lo = np.minimum(np.minimum(corners[0], corners[1]), np.minimum(corners[2], corners[3]))
        hi = np.maximum(np.maximum(corners[0], corners[1]), np.maximum(corners[2], corners[3]))
        leaves |= (lo < LO[axis]) | (hi > HI[axis])
        per_length = n / (HI[axis] - LO[axis])
        begin = np.ceil((lo - LO[axis]) * per_length).astype(np.int32) - 2
        end = np.floor((hi - LO[axis]) * per_length).astype(np.int32) + 1
        first.append(np.clip(begin, 0, n - 1).ravel())
        last.append(np.clip(end, 0, n - 1).ravel())
    out = leaves.ravel()
    height = last[1] - first[1] + 1
    sizes = (last[0] - first[0] + 1) * height
    pointer = np.concatenate([[0], np.cumsum(sizes + out), [0]])
    pointer[-1] = pointer[-2]
    within = np.arange(pointer[-1], dtype=np.int32) - np.repeat(pointer[:-2].astype(np.int32), sizes + out)
    per = np.repeat(height, sizes + out)
    corner = np.repeat(first[0] * np.int32(shape[1]) + first[1], sizes + out)
    targets = corner + within // per * np.int32(shape[1]) + within % per
    n_cells = sizes.size
    targets[pointer[1:-1][out] - 1] = n_cells
    matrix = csr_array((np.ones(targets.size), targets, pointer), shape=(n_cells + 1, n_cells + 1))
    return matrix, n_cells


def by_scipy(depth: int) -> Answer:
    """A CSR matrix, strong components of scipy, and one search backwards per component."""
    matrix, n_cells = _matrix(depth)
    _, label = connected_components(matrix, connection="strong")
    size = np.bincount(label[:n_cells])
    recurrent = size > 1
    loops = np.flatnonzero(matrix.diagonal()[:n_cells])
    recurrent[label[loops]] = True
    sets = np.flatnonzero(recurrent)
    sizes = size[sets].tolist()
    backwards = matrix.T.tocsr()
    member = np.array([np.argmax(label == c) for c in sets])
    reaches = np.zeros((len(sets) + 1, n_cells + 1), dtype=bool)
    for k, node in enumerate([*member, n_cells]):
        reaches[k, breadth_first_order(backwards, int(node), return_predecessors=False)] = True
    order = reaches[:-1, member].T
    attracting = ~(order & ~np.eye(len(sets), dtype=bool)).any(axis=1) & ~reaches[-1, member]
    ends = np.flatnonzero(attracting)
    count = reaches[ends, :n_cells].sum(axis=0) + reaches[-1, :n_cells]
    one = np.where(reaches[-1, :n_cells], len(sets), ends[np.argmax(reaches[ends, :n_cells], axis=0)])
    lasting = reaches[:-1][~attracting, :n_cells].any(axis=0)  # a recurrent set that is not closed: undecided
    destination = np.where((count == 1) & ~lasting, one, -1)
    names = {-1: UNDECIDED, len(sets): OUTSIDE, **dict(enumerate(sizes))}
    numbers, cells = np.unique(destination, return_counts=True)
    basins = {names[int(k)]: int(c) for k, c in zip(numbers, cells, strict=True)}
    return Answer(sorted(sizes, reverse=True), reduced(order, sizes), basins)
