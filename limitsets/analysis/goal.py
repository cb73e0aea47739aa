"""The scene's goal, evaluated on the attractors found."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from limitsets.goals import Goal, OrientedBeyond, Reaches, evaluate

if TYPE_CHECKING:
    from limitsets.graph import TransitionGraph
    from limitsets.sets import Attractor, Basins

Extents = Mapping[int, Sequence[tuple[float, float]]]


@dataclass(frozen=True)
class GoalOutcome:
    """A goal and what the analysis says to it.

    Attributes
    ----------
    goal : Goal
        What was asked.
    holds : bool or None
        None where this analysis cannot tell.
    threshold : float or None
        Where the goal begins or ceases to hold, see `limitsets.goals.Verdict`; None where there is no such number.
    how : str
        "sampled": read off sampled cells, no proof.
    reach : tuple of float
        The largest x of each limit set, or, where the goal says `from_anywhere`, of all landings [length].
    """

    goal: Goal
    holds: bool | None
    threshold: float | None
    how: str = "sampled"
    reach: tuple[float, ...] = ()

    @property
    def vacuous(self) -> bool:
        """Whether it holds only because nothing gets to where it is asked."""
        if not (isinstance(self.goal, OrientedBeyond) and self.holds and self.reach):
            return False
        return max(self.reach) <= self.goal.x


def _may_leave(graph: TransitionGraph) -> float:
    """Share of the starts from which some path leaves the arm."""
    from limitsets.graph.components import reach

    leads_out = reach(graph.ranges, graph.components(), graph.ranges.exits) != 0
    weight = graph.grid.measure
    return float(weight[leads_out].sum() / weight.sum())


def _after_any_throw(graph: TransitionGraph) -> Extents:
    """Where a part can rest after one throw or more: the image of the whole domain holds all later images."""
    from limitsets.maps import along, has_slope, monotone_pieces

    if not has_slope(graph.map):
        return _seen_after_a_throw(graph)
    domain = graph.grid.domain
    found: dict[int, list[tuple[float, float]]] = {}
    for side, pieces in monotone_pieces(graph.map, domain).items():
        for piece in pieces:
            ends, sides, _ = along(graph.map, [piece.lo, piece.hi], side, [piece.branch])
            to = int(sides[0])
            lo = max(float(ends.min()), float(domain.lo[to, 0]))
            hi = min(float(ends.max()), float(domain.hi[to, 0]))
            if lo <= hi:
                found.setdefault(to, []).append((lo, hi))
    return found


def _seen_after_a_throw(graph: TransitionGraph) -> Extents:
    """Find the same from images of the cells' ends, where the map's branches cannot be followed one by one."""
    from limitsets.maps import images

    found: dict[int, list[tuple[float, float]]] = {}
    for side, (edges,) in enumerate(graph.grid.edges):
        there = images(graph.map, edges, side)
        for to in np.unique(there.side[there.code >= 0]).tolist():
            x = there.x[(there.code >= 0) & (there.side == to)]
            found.setdefault(to, []).append((float(x.min()), float(x.max())))
    return found


def goal_outcome(
    goal: Goal,
    graph: TransitionGraph,
    attractors: Sequence[Attractor],
    basins: Basins,
    extents: Sequence[Extents],
) -> GoalOutcome:
    """Ask a goal.

    Parameters
    ----------
    goal : Goal
        From the scene.
    graph : TransitionGraph
        Transitions of the scene's map.
    attractors : sequence of Attractor
        What was found.
    basins : Basins
        Which starts go where.
    extents : sequence of mapping
        Per attractor its best known extents [length].

    Returns
    -------
    GoalOutcome
    """
    orders = {attractor.flip_order for attractor in attractors}
    order = next(iter(orders)) if len(orders) == 1 else None
    leaving = _may_leave(graph) if goal.from_anywhere or not attractors else 0.0
    wanted = [_after_any_throw(graph)] if goal.from_anywhere else list(extents)
    outcomes = [
        evaluate(goal, each, flip_order=order, fractions=basins.attractors, leaving=leaving)
        for each in wanted or [{}]
    ]
    verdict = goal.worst(outcomes)
    holds = verdict.holds
    if holds and not any(wanted):
        holds = None  # nothing stays on the arm: the sentence would hold of nothing
    if isinstance(goal, Reaches) and holds and not goal.from_anywhere and _may_leave(graph) > 0:
        holds = None  # some starts leave before they get there
    threshold = (
        verdict.threshold if verdict.threshold is not None and math.isfinite(verdict.threshold) else None
    )
    reach = tuple(
        max((hi for parts in each.values() for _, hi in parts), default=-math.inf) for each in wanted
    )
    return GoalOutcome(goal, holds, threshold, reach=reach)
