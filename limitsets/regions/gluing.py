"""Regions: cells of parameters that share a face are one where their blocks intersect one to one.

On a common face both families of blocks are attracting blocks of the same maps.  Where each block of one meets exactly
one of the other's, and lies among the starts that are proved to come to the other's, every attractor of the one
corresponds to one of the other: the clutching of Arai, Kalies, Kokubu, Mischaikow, Oka, Pilarczyk, SIAM J. Appl. Dyn.
Syst. 8, 2009.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from limitsets.regions.record import Record

Extents = Mapping[int, Sequence[tuple[float, float]]]


def neighbours(raster: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs of numbers that stand side by side in a raster of cell numbers, each once; shape (n, 2)."""
    pairs = [
        np.stack([a.ravel(), b.ravel()], axis=1)
        for a, b in ((raster[:-1], raster[1:]), (raster[:, :-1], raster[:, 1:]))
    ]
    both = np.concatenate(pairs)
    both = np.sort(both[both[:, 0] != both[:, 1]], axis=1)
    return np.unique(both, axis=0)


def regions(records: Sequence[Record], raster: NDArray[np.int64]) -> NDArray[np.int32]:
    """Give each cell the number of its region, from 0 in the order of first cells; -1 without a block."""
    root = list(range(len(records)))

    def of(k: int) -> int:
        while root[k] != k:
            root[k] = root[root[k]]
            k = root[k]
        return k

    for i, j in neighbours(raster).tolist():
        if of(i) != of(j) and corresponds(records[i], records[j]):
            root[max(of(i), of(j))] = min(of(i), of(j))
    numbers: dict[int, int] = {}
    found = [numbers.setdefault(of(k), len(numbers)) if each.blocks else -1 for k, each in enumerate(records)]
    return np.array(found, dtype=np.int32)


def corresponds(one: Record, other: Record) -> bool:
    """Whether the blocks of two cells with a common face intersect one to one, and each comes to the other's."""
    if not one.blocks or len(one.blocks) != len(other.blocks):
        return False
    meets = np.array(
        [[overlap(a.extents, b.extents) for b in other.blocks] for a in one.blocks], dtype=np.int64
    )
    one_to_one = (meets.sum(axis=0) == 1).all() and (meets.sum(axis=1) == 1).all()
    return bool(one_to_one) and comes_to(one, other) and comes_to(other, one)


def overlap(a: Extents, b: Extents) -> bool:
    """Whether two sets of intervals have an interior point in common."""
    return any(
        max(lo, low) < min(hi, high)
        for side in a.keys() & b.keys()
        for lo, hi in a[side]
        for low, high in b[side]
    )


def comes_to(one: Record, other: Record) -> bool:
    """Whether the blocks of one record lie in cells of the other from which starts are proved to come to its blocks."""
    at = 0
    for side in range(sum(name.startswith("edges.") for name in other.arrays)):
        edges = other.arrays[f"edges.{side}"]
        shut = other.arrays["rank"][at : at + edges.size - 1] < 0
        at += edges.size - 1
        for block in one.blocks:
            for lo, hi in block.extents.get(side, ()):
                touched = (edges[1:] > lo) & (edges[:-1] < hi)
                if lo < edges[0] or hi > edges[-1] or (shut & touched).any():
                    return False
    return True
