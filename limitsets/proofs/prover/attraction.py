"""Attraction: every start on the arm enters the attracting cells and stays there; and trapping.

An integer rank falls strictly along every image off the attracting cells, and attracting cells lead to attracting cells
of the same component only; neither needs the map to be continuous.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.proofs.prover.basin import (
    MOST_UNEXPLAINED,
    ROUNDING,
    Basin,
    NearHinge,
    basin,
    missing_near,
    near_hinge,
    shares_of,
)
from limitsets.proofs.prover.cover import Cover
from limitsets.systems.cells import CellSet
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.components import attracting_of

BELOW = "with the arm's surface above the joint, starts nearer to it than the fixed point of the jog go there"


@dataclass(frozen=True, eq=False)
class Attraction:
    """The attracting cells of a cover, and the proof that starts enter them.

    Attributes
    ----------
    cover : Cover
        Cells and images.
    component : ndarray of int32, shape (n_cells,)
        Number of the attracting component of each cell, -1 off them.
    joint : tuple of NearHinge
        The starts below the cells.
    proved : bool
        Whether every start on (a_i, arm.length] of every side enters the attracting cells.
    reason : str
        The first step that is not proved, and where; empty if all are.
    unresolved : CellSet
        Recurrent cells that do not attract.
    """

    cover: Cover
    component: NDArray[np.int32]
    joint: tuple[NearHinge, ...]
    proved: bool
    reason: str
    unresolved: CellSet

    @property
    def cells(self) -> CellSet:
        """The attracting cells."""
        return CellSet(self.cover.grid, self.component >= 0)

    @property
    def missing(self) -> str:
        """What is missing for every start on the arm, those next to the joint included; empty if nothing."""
        return self.reason or (BELOW if self.cover.points else "")

    @cached_property
    def basin(self) -> Basin:
        """The starts that are proved to come to the attracting cells."""
        return basin(self.cover, self.component, self.joint)

    @property
    def shares(self) -> dict[str, float]:
        """Shares of the arm where only the starts in the attracting cells are claimed."""
        lo, hi = self.cover.box.bare
        total = float((hi.arm_length - lo.a)[self.cover.box.rests].sum())
        inside = sum(high - low for parts in self.cells.extents().values() for low, high in parts) / total
        share = max(0.0, inside - ROUNDING)
        others = self.basin.leaves + self.basin.creeps
        return self.basin.shares | {"share": share, "open": max(0.0, 1.0 - share - others) + ROUNDING}

    def shares_from(self, section: Mapping[str, Any]) -> tuple[dict[str, float], bool]:
        """Shares of the arm for the starts of a goal's section, and whether it counts as proved of them.

        The section may be that of several boxes of parameters: its starts begin where those of the last of them do,
        and only what lies before the first of their fixed points, or is lost in all of them, is explained.
        """
        arm, near = self.cover.box.bare[0], section.get("near_joint")
        ends = {side: each["fixed_point"][0] for side, each in (near or {}).items() if "fixed_point" in each}
        ends |= section.get("lost", {})
        sides = [str(side) for side in range(arm.a.size)]
        start = np.array([float.fromhex(section["starts"]["from"].get(side, "inf")) for side in sides])
        explained = np.array(
            [
                float.fromhex(ends[side]) if side in ends else foot
                for side, foot in zip(sides, arm.a, strict=True)
            ]
        )
        shut = self.basin.rank < 0
        *numbers, whole = shares_of(self.cover, self.joint, shut, near is not None, start, explained)
        shares = dict(zip(self.basin.shares, numbers, strict=True))
        return shares, whole and shares["open"] <= MOST_UNEXPLAINED  # the checker counts what is open

    @property
    def max_rank(self) -> int:
        """Throws after which every start in the cells is in attracting ones, at most, where attraction is proved."""
        return int(self.basin.rank.max())


def components_of(graph: TransitionGraph) -> tuple[NDArray[np.int32], list[NDArray[np.int32]]]:
    """Return the number of each cell's attracting component, -1 off them; and recurrent cells that do not attract."""
    sets = graph.recurrent_components()
    # a survey's order is quadratic in their number
    good = attracting_of(graph.ranges, graph.components(), sets)
    component = np.full(graph.n_cells, -1, dtype=np.int32)
    for number, cells in enumerate(each for each, attracts in zip(sets, good, strict=True) if attracts):
        component[cells] = number
    return component, [cells for cells, attracts in zip(sets, good, strict=True) if not attracts]


def attraction(cover: Cover) -> Attraction:
    """Find the attracting cells and prove that everything enters them.

    Parameters
    ----------
    cover : Cover
        Cells and enclosed images.

    Returns
    -------
    Attraction
        With the reason where it is not proved.
    """
    component, recurring = components_of(cover.graph)
    unresolved = CellSet.of(cover.grid, np.concatenate([np.zeros(0, np.int64), *recurring]))
    joint = near_hinge(cover)
    lost = np.concatenate([images.lost for images in cover.images])
    if lost.any():
        reason = f"nothing is proved of the image of {cover.place(int(lost.argmax()))}"
    elif cover.box.landing > 0.0:
        reason = f"near the joint: {next(near.reason for near in joint if not near.empty)}"
    else:
        reason = (
            cover.leaving or not_attracting(cover, unresolved) or no_cells(component) or missing_near(joint)
        )
    return Attraction(cover, component, joint, not reason, reason, unresolved)


def no_cells(component: NDArray[np.int32]) -> str:
    """Say that no cell is in an attracting component; empty if some are."""
    return "" if (component >= 0).any() else "there are no attracting cells"


def not_attracting(cover: Cover, recurring: CellSet) -> str:
    """Say of recurrent cells that they do not attract; empty if there are none."""
    if not len(recurring):
        return ""
    return f"{len(recurring)} recurrent cells do not attract: first {cover.place(recurring.numbers()[0])}"


def near_section(attractors: Attraction) -> dict[str, dict[str, Any]]:
    """Write what a recheck needs of the starts below the cells: by side the factor, the bracket of a fixed point."""
    return {
        str(side): {"q": near.q.hex()}
        | ({"fixed_point": [end.hex() for end in near.fixed_point]} if near.fixed_point else {})
        for side, near in enumerate(attractors.joint)
        if not near.empty
    }


# ----------------------------------------------------------------
# Trapping: every attracting component is mapped into its own interior.
#
# Then the component is an isolating neighbourhood of an attractor that persists under small changes of the map.  The
# interior is relative to (a_i, arm.length], where a part can rest: a component may reach the arm's end, but no image
# may lie beyond it.


def _held(lo: float, hi: float, intervals: list[tuple[float, float]], end: float, arm: float) -> bool:
    """Whether [lo, hi] lies in the interior of one of the intervals, relative to x <= arm."""
    return any(bottom < lo and (hi < top or (top >= end and hi <= arm)) for bottom, top in intervals)


def trapping(attractors: Attraction) -> str:
    """Prove that the images of each attracting component lie in the interior of its cells.

    Parameters
    ----------
    attractors : Attraction
        Cells, components and enclosed images.

    Returns
    -------
    str
        What is missing and where; empty if it is proved.

    Notes
    -----
    Comparisons of the enclosures' ends with the cells' borders only, both exact.  Source: docs/model.md, attraction.
    """
    grid, arm = attractors.cover.grid, float(attractors.cover.box.lo.arm_length)
    for number in range(int(attractors.component.max(initial=-1)) + 1):
        inside = CellSet(grid, attractors.component == number)
        extents = inside.extents()
        for side, images in enumerate(attractors.cover.images):
            mine = inside.mask[grid.of_side(side)]
            edges = grid.edges[side][0]
            cells = [*((int(k), "nothing is proved of") for k in np.flatnonzero(mine & images.lost))]
            for (to, _), (lo, hi) in images.hulls.items():
                end = float(grid.edges[to][0][-1])
                cells += [
                    (int(k), "not interior to the component is")
                    for k in np.flatnonzero(mine & (lo <= hi))
                    if not _held(float(lo[k]), float(hi[k]), extents.get(to, []), end, arm)
                ]
            if cells:
                k, what = cells[0]
                return f"{what} the image of side {side}, x in [{edges[k]:.6g}, {edges[k + 1]:.6g}]"
    return no_cells(attractors.component)
