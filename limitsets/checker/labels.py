"""The labels of cells, of a scene or of a map: components and ranks, and the rules that they follow, by whole numbers.

docs/certificates.md, "What it rests on", number 5, and "Certificates of any map", the two rules of labels.
"""

import itertools
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from .balls import Array, UnprovedError


def box_max(table: Array, first: Array, last: Array) -> Array:
    """Return the largest entry of each box of a table, from maxima over windows of length 2^k along each axis.

    The boxes are `first` to `last` (n, axes), both included.
    """
    level = np.frexp((last - first + 1).astype(np.float64))[1] - 1  # floor(log2), exact for integers
    out = np.zeros(len(first), dtype=np.int64)

    def fill(window: Array, boxes: Array, axis: int) -> None:
        """Fill in some boxes; `window` has the maxima over windows as long as theirs along the axes before this one."""
        if axis == table.ndim:
            ends = zip(first[boxes].T, (last[boxes] - (1 << level[boxes]) + 1).T, strict=True)
            out[boxes] = np.max([window[corner] for corner in itertools.product(*ends)], axis=0)
            return
        for k in range(int(level[boxes, axis].max(initial=-1)) + 1):
            now = boxes[level[boxes, axis] == k]
            if len(now):
                fill(window, now, axis + 1)
            along = np.moveaxis(window, axis, 0)
            window = np.moveaxis(np.maximum(along[: -(1 << k)], along[1 << k :]), 0, axis)

    fill(table.astype(np.int64), np.arange(len(first)), 0)
    return out


def range_max(values: Array, first: Array, last: Array) -> Array:
    """Return max(values[first..last]) of each range."""
    return box_max(values, first[:, None], last[:, None])


class Way(NamedTuple):
    """A way from cells to others: a jog or a flip, or a branch of a map.

    `extremes` leads from labels and some cells to the least and the largest label among the target cells of each.
    """

    name: str
    possible: Array  # from which cells it is
    extremes: Callable[[Array, Array], tuple[Array, Array]]


class Labelled:
    """Cells with labels: a component, -1 for none, and a rank, -1 where nothing is claimed."""

    component: Array
    rank: Array
    start: Array  # the first cell of each side; at the end the number of all cells

    def side_of(self, cells: Array) -> Array:
        """Return the side of each of some cells."""
        return np.searchsorted(self.start, cells, side="right") - 1

    def name(self, cell: int) -> str:
        """Name a cell, for people."""
        raise NotImplementedError  # on an arm, or in one to three coordinates

    def ways(self) -> list[Way]:
        """Return the ways to target cells."""
        raise NotImplementedError  # jog and flip, or branches

    def prove_all(self, good: Array, what: str) -> None:
        """Prove something of all cells, by cell; the reason names the first of which it is not known."""
        if not good.all():
            raise UnprovedError(f"{self.name(int(np.argmin(good)))}: {what}")

    def check_components(self, cells: Array) -> None:
        """Check that some cells of components map into cells of their own component."""
        for way, chosen, least, most in self.targets(self.component, cells):
            stays = np.ones(len(cells), dtype=bool)
            stays[chosen] = (least == self.component[chosen]) & (most == self.component[chosen])
            self.prove_all(stays, f"{way} may lead out of its component")

    def check_falling(self, what: str, label: Array, cells: Array) -> None:
        """Check that a label falls along every way from some cells, to targets that have one."""
        for way, chosen, least, most in self.targets(label, cells):
            falls = np.ones(len(cells), dtype=bool)
            falls[chosen] = (least >= 0) & (most < label[chosen])
            self.prove_all(falls, f"the {what} does not fall along {way}")

    def targets(self, label: Array, cells: Array) -> Iterator[tuple[str, Array, Array, Array]]:
        """Give by way the cells, of some, from which it is possible, and the extremes of a label among targets."""
        for way in self.ways():
            chosen = np.flatnonzero(cells & way.possible)
            yield way.name, chosen, *way.extremes(label, chosen)
