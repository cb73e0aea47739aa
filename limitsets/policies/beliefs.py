"""Beliefs as bits, and which of many hold a given one or lie in it."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Bits = NDArray[np.uint64]

# Of the beliefs that are looked through for a subset the last so many: one that is not found only costs time.
COMPARED = 4096


def packed(masks: NDArray[np.bool_]) -> Bits:
    """Write sets of cells as bits: shape (..., n_cells) to (..., words).

    Examples
    --------
    >>> packed(np.array([True, False, True]))
    array([5], dtype=uint64)
    """
    found = np.packbits(masks, axis=-1, bitorder="little")
    missing = -found.shape[-1] % 8
    whole = np.concatenate([found, np.zeros((*found.shape[:-1], missing), np.uint8)], axis=-1)
    return np.ascontiguousarray(whole).view(np.uint64)


def cells_of(belief: Bits) -> NDArray[np.int64]:
    """Give the numbers of the cells, ascending."""
    return np.flatnonzero(np.unpackbits(belief.view(np.uint8), bitorder="little"))


class Kept:
    """Beliefs with a number of throws each.

    Parameters
    ----------
    words : int
        Words of 64 bits in each.
    """

    def __init__(self, words: int) -> None:
        self.rows, self.throws = np.empty((64, words), np.uint64), np.empty(64, np.int64)
        self.size = 0

    def add(self, belief: Bits, throws: int) -> int:
        """Keep a belief; its number."""
        if self.size == len(self.rows):
            self.rows = np.concatenate([self.rows, np.empty_like(self.rows)])
            self.throws = np.concatenate([self.throws, np.empty_like(self.throws)])
        self.rows[self.size], self.throws[self.size] = belief, throws
        self.size += 1
        return self.size - 1

    def superset(self, belief: Bits, most: int) -> int:
        """Find the number of one of at most so many throws that holds the belief; -1 where none does."""
        some = np.flatnonzero(self.throws[: self.size] <= most)
        return self._first(some, ~(belief & ~self.rows[some]).any(axis=1))

    def subset(self, belief: Bits, least: int) -> int:
        """Find the number of one of at least so many throws that lies in the belief; -1 where none is found."""
        begin = max(0, self.size - COMPARED)
        some = begin + np.flatnonzero(self.throws[begin : self.size] >= least)
        return self._first(some, ~(self.rows[some] & ~belief).any(axis=1))

    @staticmethod
    def _first(some: NDArray[np.int64], met: Any) -> int:
        return int(some[int(met.argmax())]) if met.any() else -1
