"""Decide by enclosures of its number whether an assumption is broken or holds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.auditing.assumptions import Assumption, Terms
from limitsets.thrower.assumed_box import assumed

if TYPE_CHECKING:
    from limitsets.auditing.places import Cells
    from limitsets.proofs.parameters import ParameterBox

Array: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]

# A cell on which an assumption is not proved is halved this often, as long as there are no more cells than these.
HALVINGS, MOST_CELLS = 10, 200_000


class Row:
    """One assumption with the facts of a scene."""

    def __init__(self, about: Assumption, terms: Terms) -> None:
        self.about, self.terms = about, terms

    def limit(self, side: int) -> float:
        """Give the limit on a side, nan where a fact is missing."""
        limit = self.terms.limit
        return math.nan if limit is None else float(limit[side] if isinstance(limit, np.ndarray) else limit)

    def values(self, found: Array) -> Array:
        """Both ends of the number, widened by the rounding of scale and offset."""
        pair: Array = found[:, self.about.column]
        scale, offset = self.terms.scale, self.terms.offset
        if scale == 1.0 and offset == 0.0:
            return pair
        pair = np.where(np.isfinite(pair), scale * pair + offset, pair)
        ends = np.array([-np.inf, np.inf])
        wider: Array = np.nextafter(np.nextafter(pair, ends), ends)
        return wider

    def reached(self, found: Array) -> Array:
        """Give what is surely reached: the end of the enclosure that breaks the least."""
        return self.values(found)[:, 0 if self.about.below else 1]

    def broken(self, found: Array, side: int) -> Flags:
        """Whether it is proved to be broken; never where nothing is known."""
        reached = self.reached(found)
        beyond = reached > self.limit(side) if self.about.below else reached < self.limit(side)
        # no value of a missing fact is enough
        hopeless = np.isposinf(reached) if self.about.below else np.isneginf(reached)
        return beyond | (hopeless & (self.terms.limit is None))

    def kept(self, found: Array, side: int) -> Flags:
        """Whether it is proved to hold."""
        values = self.values(found)
        return values[:, 1] <= self.limit(side) if self.about.below else values[:, 0] >= self.limit(side)

    def spare(self, found: Array, side: int) -> Array:
        """Give how far within the limit it is, to the width of the enclosures; below 0 beyond it."""
        inside: Array = (self.limit(side) - self.values(found).mean(axis=1)) * (1 if self.about.below else -1)
        return inside


def enclosed_at(box: ParameterBox, side: int, x: Array) -> Array:
    """Enclose everything at single throws."""
    return assumed(*box.bare, side, x, x)


def all_hold(box: ParameterBox, cells: Cells, rows: list[Row]) -> list[bool]:
    """Whether each assumption is proved to hold on all cells, halving those on which it is not."""
    open_rows = np.ones(len(rows), dtype=bool)
    for side, (lo, hi) in cells.items() if rows else ():
        needed = np.tile(open_rows, (lo.size, 1))
        for halving in range(HALVINGS + 1):
            found = assumed(*box.bare, side, lo, hi)
            kept = np.stack([row.kept(found, side) for row in rows], axis=1)
            needed &= ~kept & open_rows
            again = needed.any(axis=1)
            if not again.any():
                break
            if halving == HALVINGS or 2 * int(again.sum()) > MOST_CELLS:
                open_rows &= ~needed.any(axis=0)
                break
            lo, hi, needed = lo[again], hi[again], np.repeat(needed[again], 2, axis=0)
            middle = lo + 0.5 * (hi - lo)
            lo, hi = np.stack([lo, middle], axis=1).ravel(), np.stack([middle, hi], axis=1).ravel()
    return open_rows.tolist()
