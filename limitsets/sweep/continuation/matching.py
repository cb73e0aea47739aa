"""Attractors of two places matched: where the sets overlap and one comes to rest at the other under the other's map."""

from __future__ import annotations

from typing import NamedTuple

import networkx as nx
import numpy as np

from limitsets.cells import CellSet
from limitsets.sweep.continuation.snapshot import Found, Snapshot, arrivals

# Of the extent of a side: sets this near overlap, and a set that moves by no more has only moved.
REACH = 0.02


class Group(NamedTuple):
    """Attractors that are matched with each other: positions in both snapshots."""

    before: tuple[int, ...]
    after: tuple[int, ...]

    @property
    def one_to_one(self) -> bool:
        """Whether one attractor goes on as one."""
        return len(self.before) == len(self.after) == 1


class Match(NamedTuple):
    """How the attractors of two places correspond.

    Attributes
    ----------
    groups : tuple of Group
        Every attractor is in one of them.
    smooth : bool
        Whether each goes on alone, with as many bands per side and the same period, and has moved but a little.
    """

    groups: tuple[Group, ...]
    smooth: bool


def distance(one: Found, other: Found) -> float:
    """Hausdorff distance of two sets along the sides; infinite where one is not on a side of the other."""
    if set(one.extents) != set(other.extents):
        return float("inf")
    return max(_directed(one, other), _directed(other, one))


def _directed(one: Found, other: Found) -> float:
    """Largest distance of a point of one set from the other."""
    farthest = 0.0
    for side, parts in one.extents.items():
        there = np.array(other.extents[side])
        # Between two bands of the other set the farthest point is the middle of the gap.
        gaps = 0.5 * (there[1:, 0] + there[:-1, 1])
        points = [x for lo, hi in parts for x in (lo, hi, *gaps[(gaps > lo) & (gaps < hi)].tolist())]
        x = np.array(points)
        farthest = max(farthest, float(other.distance(x, np.full(x.size, side)).max()))
    return farthest


def _overlap(one: Found, other: Found, reach: float) -> bool:
    if one.cells is not None and other.cells is not None:
        return _share(*sorted((one.cells, other.cells), key=lambda each: each.grid.n_cells))
    for side, parts in one.extents.items():
        for lo, hi in parts:
            if any(lo - reach <= top and bottom <= hi + reach for bottom, top in other.extents.get(side, ())):
                return True
    return False


def _share(coarse: CellSet, fine: CellSet) -> bool:
    """Whether the middle of a cell of one set lies in the other."""
    numbers = fine.numbers()
    owner = fine.grid.side_of(numbers)
    for side in np.unique(owner).tolist():
        lo, hi = fine.grid.boxes(numbers[owner == side], side)
        if coarse.holds(0.5 * (lo + hi), side).any():
            return True
    return False


def _alike(one: Found, other: Found, reach: float) -> bool:
    if one.cells is not None:
        return True
    return one.period == other.period and one.bands == other.bands and distance(one, other) <= reach


def matched(before: Snapshot, after: Snapshot) -> Match:
    """Match the attractors of two places."""
    reach = REACH * before.place.extent
    pairs: nx.Graph = nx.Graph()
    pairs.add_nodes_from((0, i) for i in range(len(before.found)))
    pairs.add_nodes_from((1, j) for j in range(len(after.found)))
    ahead = [arrivals(each, after, reach) for each in before.found]
    back = [arrivals(each, before, reach) for each in after.found]
    for i, one in enumerate(before.found):
        for j, other in enumerate(after.found):
            if (ahead[i] == {j} or back[j] == {i}) and _overlap(one, other, reach):
                pairs.add_edge((0, i), (1, j))
    groups = tuple(
        Group(*(tuple(sorted(k for which, k in part if which == side)) for side in (0, 1)))
        for part in nx.connected_components(pairs)
    )
    smooth = all(
        group.one_to_one and _alike(before.found[group.before[0]], after.found[group.after[0]], reach)
        for group in groups
    )
    return Match(tuple(sorted(groups, key=lambda group: (group.before, group.after))), smooth)
