"""The goal of a map: every start in some boxes ends in others, and stays there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, shown
from limitsets.base.arrays import Array, Arrays, Ints
from limitsets.systems.cells import Domain, Grid

Mask: TypeAlias = NDArray[np.bool_]


class Region(NamedTuple):
    """A box on one side: `lo` and `hi`, shape (d,)."""

    side: int
    lo: Array
    hi: Array

    def in_file(self) -> dict[str, Any]:
        """Write it with hexadecimal ends."""
        ends = zip(self.lo.tolist(), self.hi.tolist(), strict=True)
        return {"side": self.side, "box": [[lo.hex(), hi.hex()] for lo, hi in ends]}


class GoalOfMap(NamedTuple):
    """Where orbits end, and from which starts; None for starts in all cells that are proved to lead there."""

    ends: tuple[Region, ...]
    starts: tuple[Region, ...] | None

    def in_file(self) -> dict[str, Any]:
        """Write the table `goal` of a certificate."""
        starts = None if self.starts is None else [region.in_file() for region in self.starts]
        return {"starts": starts, "ends": [region.in_file() for region in self.ends]}

    def within(self, lo: Array, hi: Array, side: Ints) -> Mask:
        """Whether each of some boxes, (n, d) on sides (n,), lies in one of the ends."""
        within = np.zeros(len(side), dtype=bool)
        for on, low, high in self.ends:
            within |= (side == on) & ((lo >= low) & (hi <= high)).all(axis=1)
        return within

    def spread(self, count: int) -> tuple[Array, Ints]:
        """Places spread over the starts (none: none), and their sides; always the same ones."""
        regions = self.starts or ()
        random, each = np.random.default_rng(0), -(-count // max(len(regions), 1))
        places = [random.uniform(lo, hi, (each, len(lo))) for _, lo, hi in regions]
        return np.concatenate(places), np.repeat([side for side, _, _ in regions], each)

    def is_left_by(self, lo: Array, hi: Array, side: Ints) -> str:
        """Say where an orbit through boxes (p, d) is inside the starts and where apart from the ends; "" if nowhere."""
        inside, apart = np.zeros(len(side), dtype=bool), np.ones(len(side), dtype=bool)
        for on, low, high in self.starts or ():
            inside |= (side == on) & ((lo > low) & (hi < high)).all(axis=1)
        for on, low, high in self.ends:
            apart &= (side != on) | ((hi < low) | (lo > high)).any(axis=1)
        if not (inside.any() and apart.any()):
            return ""
        k, first = int(apart.argmax()), int(inside.argmax())
        place, begun = (_named(int(side[j]), lo, hi, j) for j in (k, first))
        return f"it has a point inside the starts, {begun}, and one outside the ends, {place}"


def read_goal(ends: Any, starts: Any, domain: Domain) -> GoalOfMap:
    """Read the boxes of a goal.

    Parameters
    ----------
    ends, starts : sequence of boxes, or mapping of int to such
        A box is a list of (lo, hi), one for each axis; by side where there are several.  A box alone is one in a list.
    domain : Domain
        Of the map.

    Raises
    ------
    AnswerError
        For what is no list of boxes, a side that is not there, starts outside the domain, or a box that passes the seam
        of an axis that closes.
    """
    goal = GoalOfMap(
        _regions(ends, "ends", domain), None if starts is None else _regions(starts, "starts", domain)
    )
    for side, lo, hi in goal.starts or ():
        if (lo < domain.lo[side]).any() or (hi > domain.hi[side]).any():
            allowed = "boxes in the domain of the grid"
            raise AnswerError(
                "the starts", shown([*map(tuple, np.stack([lo, hi], 1).tolist())]), allowed, "clip them"
            )
        # a start on the seam is one of the first cells too
        if (np.array(domain.periodic) & (lo > domain.lo[side]) & (hi == domain.hi[side])).any():
            allowed = "boxes that end before the seam of an axis that closes, or go round it"
            raise AnswerError("the starts", shown(tuple(hi.tolist())), allowed, "end them a little before")
    for side, lo, hi in goal.ends:
        # a cycle may refute the goal: its points have values in the domain
        if (np.array(domain.periodic) & ((lo < domain.lo[side]) | (hi > domain.hi[side]))).any():
            allowed = "boxes in the domain along axes that close, two where the seam is passed"
            raise AnswerError(
                "the ends", shown([*map(tuple, np.stack([lo, hi], 1).tolist())]), allowed, "cut them there"
            )
    return goal


def _regions(given: Any, name: str, domain: Domain) -> tuple[Region, ...]:
    """Read boxes by side."""
    sides, dimension = domain.lo.shape
    regions = []
    for side, given_boxes in (given if isinstance(given, Mapping) else {0: given}).items():
        try:
            boxes = np.array(given_boxes, dtype=np.float64)
        except (TypeError, ValueError):
            boxes = np.empty(0)
        boxes = boxes[(None,) * (3 - boxes.ndim)] if 0 < boxes.ndim < 3 and boxes.size else boxes
        sound = boxes.ndim == 3 and boxes.shape[1:] == (dimension, 2) and bool(np.isfinite(boxes).all())
        if not sound or not (boxes[..., 0] < boxes[..., 1]).all() or side not in range(sides):
            raise AnswerError(
                f"the argument {name} of certify",
                f"{shown(given_boxes)} on side {side}",
                f"boxes of {dimension} pairs lo < hi, on a side from 0 to {sides - 1}",
                f"pass {name}=[{[(0.0, 1.0)] * dimension}]",
            )
        regions += [Region(int(side), box[:, 0], box[:, 1]) for box in boxes]
    return tuple(regions)


def missing(goal: GoalOfMap, grid: Grid, arrays: Arrays) -> str:
    """Say what of a goal is not proved by the cells of a certificate; "" where all is."""
    if not (arrays["component"] >= 0).any():
        return "no cells in the ends are proved to stay there"
    lo, hi, sides = grid.corners(np.arange(grid.n_cells))
    for side, low, high in goal.starts or ():
        bad = (sides == side) & ((lo < high) & (hi > low)).all(axis=1) & (arrays["rank"] < 0)
        if bad.any():
            place = _named(side, lo, hi, int(bad.argmax()))
            return f"starts whose orbits are not proved to end there: first {place}"
    return ""


def _named(side: int, lo: Array, hi: Array, k: int) -> str:
    spans = " x ".join(f"[{a:.6g}, {b:.6g}]" for a, b in zip(lo[k], hi[k], strict=True))
    return f"side {side}, x in {spans}"
