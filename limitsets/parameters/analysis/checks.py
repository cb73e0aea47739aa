"""What is looked at beside the answers: assumptions, the goal, random orbits against attractors missed, and averages.

In cells that are too coarse an attractor has an edge out and is not recognised.  Orbits that stay where no attractor
was found, or do not end where the label of their cell says, reveal it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.feeder.goals import Goal, OrientedBeyond, Reaches, evaluate
from limitsets.feeder.scene import Scene
from limitsets.feeder.thrower import impact_angles
from limitsets.proofs.auditing.judging import where
from limitsets.proofs.prover.averaging import average
from limitsets.systems.graph import TransitionGraph
from limitsets.systems.graph.components import reach
from limitsets.systems.maps import advance, along, codes, has_slope, images, monotone_pieces
from limitsets.systems.sets import Attractor, Basins

# ----------------------------------------------------------------
# Places at which an assumption of the model is broken: a flag beside the answers, never a state of the map.


Array = NDArray[np.float64]
Interval = tuple[float, float]
Extents = Mapping[int, Sequence[tuple[float, float]]]

SAMPLES = 4096
# Of the attracting cells when averages are bounded: 0.3 s, and 2 s for the checker.
CELLS_OF_AVERAGES = 8192


def other_vertex_first(scene: Scene) -> dict[int, list[tuple[float, float]]]:
    """Find the starts from which another vertex than the left one would land first.

    The part has then turned by more than the exterior angle at its left vertex, and the model's formulas speak of a
    landing that does not take place.

    Parameters
    ----------
    scene : Scene
        The scene.

    Returns
    -------
    dict of int to list of (lo, hi)
        Per side of the part the intervals of `scene.domain`, ascending [length]; an empty list where it never
        happens, or where the scene simulates the effect `landing`.  Between 4096 samples a narrower interval may be
        missed.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.analysis import other_vertex_first
    >>> found = other_vertex_first(ls.load("paper-designed"))
    >>> [(side, round(lo, 4)) for side, parts in found.items() for lo, _ in parts]
    [(0, 20.1517), (1, 26.4235)]
    """
    if scene.effects.landing:
        return {side: [] for side in range(len(scene.sides))}
    by_side = {}
    for side in range(len(scene.sides)):
        corner = float(scene.sides.corner[side])
        x = np.linspace(float(scene.domain.lo[side, 0]), float(scene.domain.hi[side, 0]), SAMPLES)

        def beyond(at: Array, side: int = side, corner: float = corner) -> NDArray[np.bool_]:
            return impact_angles(scene.map, at, side) > corner

        by_side[side] = where(beyond, x)
    return by_side


def in_limit_sets(flags: Extents, sets: Iterable[Extents]) -> dict[int, list[Interval]]:
    """Give, per side, where in a limit set a flag is [length]; sides without any are left out.

    Examples
    --------
    >>> from limitsets.analysis import in_limit_sets
    >>> in_limit_sets({0: [(1.0, 3.0)]}, [{0: [(2.0, 5.0)]}, {1: [(0.0, 1.0)]}])
    {0: [(2.0, 3.0)]}
    """
    by_side: dict[int, list[Interval]] = {}
    for extents in sets:
        for side, parts in extents.items():
            by_side.setdefault(side, []).extend(
                (max(a, lo), min(b, hi))
                for a, b in flags.get(side, ())
                for lo, hi in parts
                if max(a, lo) <= min(b, hi)
            )
    return {side: sorted(parts) for side, parts in sorted(by_side.items()) if parts}


# ----------------------------------------------------------------
# The scene's goal, evaluated on the attractors found.


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


def choices_of(extents: Sequence[Extents], sides: int) -> list[tuple[int, float, float]]:
    """Give the X beyond which parts lie on one side alone, and which every limit set gets to: side, from, to.

    Examples
    --------
    >>> choices_of([{0: [(8.0, 12.0)], 1: [(9.0, 20.0)]}, {1: [(10.0, 17.0)]}], 2)
    [(1, 12.0, 17.0)]
    """
    farthest = [
        {side: max(hi for _, hi in parts) for side, parts in each.items() if parts} for each in extents
    ]
    choices = []
    for side in range(sides if farthest else 0):
        least = max((hi for each in farthest for other, hi in each.items() if other != side), default=0.0)
        most = min(each.get(side, -math.inf) for each in farthest)
        if least < most:
            choices.append((side, least, most))
    return choices


def _may_leave(graph: TransitionGraph) -> float:
    """Share of the starts from which some path leaves the arm."""
    leads_out = reach(graph.ranges, graph.components(), graph.ranges.exits) != 0
    weight = graph.grid.measure
    return float(weight[leads_out].sum() / weight.sum())


def _after_any_throw(graph: TransitionGraph) -> Extents:
    """Where a part can rest after one throw or more: the image of the whole domain holds all later images."""
    if not has_slope(graph.map):
        return _seen_after_a_throw(graph)
    domain = graph.grid.domain
    by_side: dict[int, list[tuple[float, float]]] = {}
    for side, pieces in monotone_pieces(graph.map, domain).items():
        for piece in pieces:
            ends, sides, _ = along(graph.map, [piece.lo, piece.hi], side, [piece.branch])
            to = int(sides[0])
            lo = max(float(ends.min()), float(domain.lo[to, 0]))
            hi = min(float(ends.max()), float(domain.hi[to, 0]))
            if lo <= hi:
                by_side.setdefault(to, []).append((lo, hi))
    return by_side


def _seen_after_a_throw(graph: TransitionGraph) -> Extents:
    """Find the same from images of the cells' ends, where the map's branches cannot be followed one by one."""
    by_side: dict[int, list[tuple[float, float]]] = {}
    for side, (edges,) in enumerate(graph.grid.edges):
        there = images(graph.map, edges, side)
        for to in np.unique(there.side[there.code >= 0]).tolist():
            x = there.x[(there.code >= 0) & (there.side == to)]
            by_side.setdefault(to, []).append((float(x.min()), float(x.max())))
    return by_side


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


# ----------------------------------------------------------------
# Comparison of the answer with a thousand orbits from random starts, which reveal attractors that cells missed.


# Starts, and throws after which they are looked at: most have come to an attractor by the first.
STARTS, THROWS = 1000, (100, 1000, 4000)


@dataclass(frozen=True)
class Starts:
    """Where random starts go, beside what the cells say.

    Attributes
    ----------
    count, throws : int
        Starts, by length over all sides, and the most throws that each was followed for.
    elsewhere : float
        Share that is still on the arm after them, and in no attractor that was found.
    contradicted : float
        Share that ended elsewhere than the label of its cell says.
    """

    count: int
    throws: int
    elsewhere: float
    contradicted: float

    @property
    def missed(self) -> float:
        """Share for which the cells have no answer, or a wrong one."""
        return self.elsewhere + self.contradicted

    @property
    def advice(self) -> str | None:
        """What is missing and what to do about it; None where all starts agree with the cells."""
        parts = []
        if self.elsewhere:
            parts.append(
                f"{100 * self.elsewhere:.3g} % of {self.count} random starts are still on the arm after {self.throws} "
                "throws, where no limit set was found: one is missing, or they are slow"
            )
        if self.contradicted:
            parts.append(
                f"{100 * self.contradicted:.3g} % of {self.count} random starts end elsewhere than their cells say"
            )
        return "; ".join(parts) + "; ask for more cells" if parts else None


def against_starts(graph: TransitionGraph, attractors: Sequence[Attractor], basins: Basins) -> Starts:
    """Throw a thousand random starts, the same ones each time, and compare.

    Parameters
    ----------
    graph : TransitionGraph
        Transitions of a scene's map.
    attractors : sequence of Attractor
        What was found in it.
    basins : Basins
        Their basins.

    Returns
    -------
    Starts
    """
    grid, rng = graph.grid, np.random.default_rng(0)
    length = grid.domain.hi[:, 0] - grid.domain.lo[:, 0]
    side = rng.choice(grid.sides, STARTS, p=length / length.sum())
    x = grid.domain.lo[side, 0] + rng.random(STARTS) * length[side]
    label = basins.labels[_cells(grid, x, side)]
    end = np.full(STARTS, codes.UNDECIDED)  # as long as a start is on the arm and in no attractor
    going, thrown = np.arange(STARTS), 0
    number = np.full(grid.n_cells + 1, codes.UNDECIDED)  # the last entry is for what lies in no cell
    for k, attractor in enumerate(attractors):
        number[:-1][attractor.cells.mask] = k
    for throws in THROWS:
        x[going], side[going], code, _ = advance(graph.map, x[going], side[going], throws - thrown)
        end[going] = np.where(code < 0, code, number[_cells(grid, x[going], side[going])])
        going, thrown = going[end[going] == codes.UNDECIDED], throws
    wrong = (label != codes.UNDECIDED) & (end != codes.UNDECIDED) & (label != end)
    return Starts(STARTS, THROWS[-1], going.size / STARTS, float(wrong.mean()))


def _cells(grid: Any, x: Any, side: Any) -> Any:
    numbers = np.full(x.size, -1)
    for s in range(grid.sides):
        numbers[side == s] = grid.index(x[side == s], s)
    return numbers


# ----------------------------------------------------------------
# Bounds of averages, beside those that are counted on one orbit.


def proved_averages(scene: Scene, sets: Sequence[Extents]) -> list[dict[str, tuple[float, float]]]:
    """Bound the Lyapunov exponent and the flips per throw in limit sets, along almost every orbit.

    Parameters
    ----------
    scene : Scene
        The scene.
    sets : sequence of mapping
        Extents of each limit set [length].

    Returns
    -------
    list of dict of str to (float, float)
        Per limit set the bounds of "lyapunov" and "flips_per_throw"; empty where nothing is proved: with effects, where
        throws do not stretch, or without python-flint.

    Examples
    --------
    >>> import limitsets as ls
    >>> scene = ls.load("paper-designed")
    >>> [(lo, hi)] = [each["lyapunov"] for each in proved_averages(scene, ls.analyse(scene).extents)]
    >>> 0.2056 < lo < hi < 0.2058
    True
    """
    if find_spec("flint") is None or scene.effects.on() or scene.effects.spread:
        return [{} for _ in sets]
    proof = average(scene, ["lyapunov", "flips_per_throw"], cells=CELLS_OF_AVERAGES)
    if proof.average is None:
        return [{} for _ in sets]
    grid, component = proof.attractions[0].cover.grid, proof.attractions[0].component
    bounds = []
    for extents in sets:
        middles = [(0.5 * (lo + hi), side) for side, parts in extents.items() for lo, hi in parts]
        cells = grid.index(*(np.array(column) for column in zip(*middles, strict=True)))
        within = set(component[cells].tolist()) if (cells >= 0).all() else {-1}
        own = within.pop() if len(within) == 1 else -1
        bounds.append({name: by[own] for name, by in proof.average.numbers.items()} if own >= 0 else {})
    return bounds
