"""The cheapest method for a given error of the limit set's ends, and the error reached, found independently.

Two methods give the extents of an attractor.  The error of the borders of attracting cells is about the width of a
cell times the slope of the throws after a critical point: half the error costs twice the cells and the time.  Images of
critical points (`limitsets.systems.sets.end_points`) have rounding errors only, but need cells to locate the attractor.
Source of the exponents: studies/03_accuracy.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.base import AnswerError, LimitsetsError, as_table, picked
from limitsets.feeder.scene import Scene
from limitsets.systems.cells import grid
from limitsets.systems.graph import TransitionGraph, transitions
from limitsets.systems.maps import has_slope, orbit
from limitsets.systems.sets import Attractor, LimitSet, attractors, limit_set

Extents = dict[int, list[tuple[float, float]]]

CELLS, END_POINTS = "cells", "end points"

# Error of the ends against cells per side, and seconds of the graph against cells: what the study fits, rounded.
EXPONENT_OF_ERROR, EXPONENT_OF_SECONDS = 1.0, 1.1
# Errors of single grids scatter around the fit by less than this factor.
SCATTER = 2.5
# Fewer cells than these show sets that are not there (`limitsets.parameters.analysis.run`), more are not tried.
FEWEST, MOST = 4096, 2**20
# Cells per side of the two trials, and those at which this machine's speed is measured, the best of so many times.
COARSE, FINE = 1024, 4096
MANY, TIMES = 32768, 2


@dataclass(frozen=True)
class MethodChoice:
    """One way to the ends, and what it is expected to give and to cost.

    Attributes
    ----------
    method : str
        "cells" or "end points".
    cells : int
        Cells per side.
    error : float
        Expected error of the ends [length].
    seconds : float
        Expected time of the steps that lead to the ends: transitions, attractors, limit sets.
    """

    method: str
    cells: int
    error: float
    seconds: float


@dataclass(frozen=True)
class Plan:
    """What was picked for an error asked for; as text, one sentence.

    Attributes
    ----------
    error_wanted : float
        The error asked for [length].
    unit : str
        The scene's unit.
    chosen : MethodChoice
        The cheapest way that is expected to meet it; the most accurate one where none is.
    other : MethodChoice or None
        The next best.
    expected : bool
        Whether `chosen` is expected to meet it.
    """

    error_wanted: float
    unit: str
    chosen: MethodChoice
    other: MethodChoice | None
    expected: bool

    def __str__(self) -> str:
        words = {CELLS: "borders of cells", END_POINTS: "end points by critical orbits"}

        def told(way: MethodChoice) -> str:
            return (
                f"{words[way.method]}, {way.cells} cells a side, error about {way.error:.1g} {self.unit}, "
                f"about {way.seconds:.2g} s"
            )

        so = "asked:" if self.expected else "asked cannot be met; the best there is:"
        text = f"error {self.error_wanted:g} {self.unit} {so} {told(self.chosen)}"
        return text if self.other is None else f"{text} (instead of {told(self.other)})"


@dataclass(frozen=True)
class Accuracy:
    """What was asked of the ends, how it was gone about, and what was reached.

    Attributes
    ----------
    plan : Plan
        What was picked before.
    seconds : float
        What the planned steps took.
    reached : float or None
        Largest error of an end, as verified [length]; None where there are no ends.
    how : str
        "proved": between two proved numbers; "rounding": estimated from slopes and rounding of each step; "orbit":
        how far a point of the cells may be from a long orbit, given that sampled cells hold all of it; "nothing
        stays".
    advice : str or None
        Why the error was not met, and what to do.
    proved : float or None
        Error of the end points that is proved, where they were the method and a proof was found [length].
    """

    plan: Plan
    seconds: float
    reached: float | None
    how: str
    advice: str | None
    proved: float | None = None

    @property
    def met(self) -> bool:
        """Whether the error reached is the one asked for, or less."""
        return self.reached is not None and self.reached <= self.plan.error_wanted

    def to_json(self) -> dict[str, Any]:
        """Give it as a table for JSON."""
        chosen = self.plan.chosen
        return as_table(
            asked=self.plan.error_wanted,
            **picked(chosen, "method", "cells"),
            estimated_error=chosen.error,
            estimated_seconds=round(chosen.seconds, 6),
            seconds=round(self.seconds, 6),
            **picked(self, "reached", "how", "proved", "met", "advice"),
        )


# ---------------------------------------------------------------- before


@dataclass(frozen=True)
class _Trial:
    """One run of the steps, and the seconds of each."""

    graph: float
    orbits: float
    ends: float
    attractors: Sequence[Attractor]
    limits: Sequence[LimitSet]


def _timed_graph(scene: Scene, cells: int) -> tuple[TransitionGraph, float]:
    """Give the graph of so many cells a side, its attracting components found, and the seconds that this takes."""
    begin = time.perf_counter()
    graph = transitions(scene.map, grid(scene.domain, cells=cells))
    _ = graph.condensation().attracting
    return graph, time.perf_counter() - begin


def _trial(scene: Scene, cells: int, throws: int) -> _Trial:
    graph, seconds = _timed_graph(scene, cells)
    stops = [time.perf_counter()]
    sets = attractors(graph, throws)
    stops.append(time.perf_counter())
    limits = [limit_of(graph, each) for each in sets]
    stops.append(time.perf_counter())
    orbits, ends = np.diff(stops).tolist()
    return _Trial(seconds, orbits, ends, sets, limits)


def _seconds_of_graph(scene: Scene, cells: int) -> float:
    """Time of a graph of so many cells a side, from that of one that takes a few hundredths of a second."""
    best = min(_timed_graph(scene, MANY)[1] for _ in range(TIMES))
    return float(best * (cells / MANY) ** EXPONENT_OF_SECONDS)


def _distance(extents: Extents, exact: Extents) -> float:
    """Hausdorff distance between unions of intervals per side; infinite where a side has but one of them."""
    if set(extents) != set(exact):
        return math.inf
    return max(
        (_one_way(a[side], b[side]) for a, b in ((extents, exact), (exact, extents)) for side in a),
        default=0.0,
    )


def _one_way(some: Sequence[tuple[float, float]], others: Sequence[tuple[float, float]]) -> float:
    """Largest distance of a point of `some` from `others`: it is at an end, or in the middle of a gap."""
    gaps = [(a[1] + b[0]) / 2 for a, b in pairwise(others)]
    points = [x for lo, hi in some for x in (lo, hi, *(gap for gap in gaps if lo < gap < hi))]
    return max(min(max(lo - x, x - hi, 0.0) for lo, hi in others) for x in points)


def _by_cells(scene: Scene, coarse: _Trial, fine: _Trial, asked: float) -> MethodChoice:
    """Cells alone: the error of the fine trial is known from its end points, or from what the coarse one had more."""
    exact = best_extents(fine.attractors, fine.limits)
    known = all(limit.converged for limit in fine.limits)
    measured, at = (fine, FINE) if known else (coarse, COARSE)
    if len(measured.attractors) != len(exact):
        error = math.inf
    else:
        error = max(
            (_distance(each.extents, ends) for each, ends in zip(measured.attractors, exact, strict=True)),
            default=0.0,
        )
    needed = at * (SCATTER * error / asked) ** (1.0 / EXPONENT_OF_ERROR)
    cells = int(2.0 ** math.ceil(math.log2(min(max(needed, FEWEST), MOST))))
    left = error * SCATTER * (at / cells) ** EXPONENT_OF_ERROR
    return MethodChoice(CELLS, cells, left, fine.orbits + max(fine.graph, _seconds_of_graph(scene, cells)))


def _by_end_points(fine: _Trial) -> MethodChoice:
    rounding = max((end.error for limit in fine.limits for end in limit.ends), default=0.0)
    sure = all(limit.converged and all(end.origin.branches for end in limit.ends) for limit in fine.limits)
    return MethodChoice(
        END_POINTS, FEWEST, rounding if sure else math.inf, fine.graph + fine.orbits + fine.ends
    )


def plan_for(scene: Scene, error: float, throws: int = 200_000) -> Plan:
    """Pick the cheapest way to the ends of a scene's limit sets, from a short trial on this machine.

    Parameters
    ----------
    scene : Scene
        The scene.
    error : float
        Largest error of an end that is asked for [length].
    throws : int
        Length of the orbit on which jogs are counted: part of what is timed.

    Returns
    -------
    Plan

    Raises
    ------
    AnswerError
        For an error that is not a positive number.

    Notes
    -----
    The trial takes a few tenths of a second, and loads or compiles what is needed, which the estimates leave out.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.analysis import plan_for
    >>> plan_for(ls.load("paper-designed"), 1e-6).chosen.method
    'end points'
    """
    if not (isinstance(error, int | float) and math.isfinite(error) and error > 0):
        raise AnswerError("the error", error, "a number > 0, in the scene's unit", "pass error=1e-6")
    coarse = _trial(scene, COARSE, 1)  # first, and untimed: it may have to compile
    fine = _trial(scene, FINE, throws)
    ways = [_by_cells(scene, coarse, fine, error), _by_end_points(fine)]
    good = sorted((way for way in ways if way.error <= error), key=lambda way: way.seconds)
    ranked = good + sorted((way for way in ways if way not in good), key=lambda way: way.error)
    other = ranked[1] if math.isfinite(ranked[1].error) else None
    return Plan(float(error), scene.unit, ranked[0], other, bool(good))


def best_extents(attractors: Sequence[Attractor], limits: Sequence[LimitSet]) -> tuple[Extents, ...]:
    """Give each attractor's intervals: of the limit set where its end points are known, else of the cells."""
    pairs = zip(attractors, limits, strict=True)
    return tuple(limit.extents if limit.converged else each.extents for each, limit in pairs)


def left_to_cells() -> LimitSet:
    """Say that end points were not looked for, because the borders of cells meet the error."""
    return LimitSet({}, (), 0, False, False, "end points were not looked for: cells meet the error asked for")


def limit_of(graph: TransitionGraph, attractor: Attractor) -> LimitSet:
    """Its end points; the cells where the map's branches cannot be followed one by one."""
    if has_slope(graph.map):
        return limit_set(graph, attractor)
    advice = "with effects on a throw has more branches than this version follows"
    return LimitSet(attractor.extents, (), 0, False, False, advice)


# ----------------------------------------------------------------
# The error of the ends reached, determined independently of the method.
#
# End points are compared with proved brackets (`limitsets.proofs.prover.end_points`); borders of cells, which contain
# the limit set as far as sampled images show, with an orbit, which lies inside.


# The orbit that brackets the ends from inside: throws at a time, how often, and bins per interval to tell holes.
THROWS, ROUNDS, MOST_BINS = 1_000_000, 20, 2_000_000


def _proved(scene: Scene, limits: Sequence[LimitSet]) -> float:
    """Largest distance of an end from either of the two proved numbers around it; infinite without such."""
    from limitsets.proofs.prover.attraction import attraction
    from limitsets.proofs.prover.cover import cover
    from limitsets.proofs.prover.end_points import proved_ends
    from limitsets.proofs.prover.parameters import parameter_box

    if scene.effects.on():  # end points are proved of the minimal map alone
        return math.inf
    try:
        known = proved_ends(attraction(cover(parameter_box(scene), FEWEST))).ends
    except LimitsetsError:  # of this scene nothing can be proved
        return math.inf
    worst = 0.0
    for end in (end for limit in limits for end in limit.ends):
        around = [
            max(abs(end.x - one.outer), abs(end.x - one.inner))
            for one in known
            if one.side == end.side and one.which == end.which and one.inner is not None
        ]
        worst = max(worst, min(around, default=math.inf))
    return worst


class _Visited:
    """Give the parts of an interval that an orbit has visited, to within a bin."""

    def __init__(self, side: int, lo: float, hi: float, width: float) -> None:
        self.side, self.lo, self.hi = side, lo, hi
        self.bins = np.zeros(int(min(max((hi - lo) / width, 4.0), MOST_BINS)), dtype=bool)
        self.least, self.most = math.inf, -math.inf

    def add(self, x: NDArray[np.float64]) -> None:
        """Mark where the states lie."""
        inside = x[(x >= self.lo) & (x <= self.hi)]
        if inside.size:
            place = (inside - self.lo) / (self.hi - self.lo) * self.bins.size
            self.bins[np.minimum(place.astype(np.int64), self.bins.size - 1)] = True
            self.least, self.most = min(self.least, inside.min()), max(self.most, inside.max())

    def gap(self) -> float:
        """Largest distance of a point of the interval from the orbit, or a bin more."""
        seen = np.flatnonzero(self.bins)
        if not seen.size:
            return math.inf
        width = (self.hi - self.lo) / self.bins.size
        hole = float((np.diff(seen).max(initial=1) - 1) * 0.5 + 1.0) * width
        return float(max(self.least - self.lo, self.hi - self.most, hole))


def _from_inside(scene: Scene, attractor: Attractor, asked: float) -> float:
    """Distance of the cells from an orbit inside, which is followed until it is small enough."""
    parts = [
        _Visited(side, lo, hi, asked / 4.0)
        for side, pairs in sorted(attractor.extents.items())
        for lo, hi in pairs
    ]
    start = max(parts, key=lambda part: part.hi - part.lo)
    x, side, gap = 0.5 * (start.lo + start.hi), start.side, math.inf
    for _ in range(ROUNDS):
        path = orbit(scene.map, x, side, THROWS)
        settled = slice(min(1000, path.x.size - 1), None)
        for part in parts:
            part.add(path.x[settled][path.side[settled] == part.side])
        gap = max(part.gap() for part in parts)
        if gap <= asked or path.stopped:
            break
        x, side = float(path.x[-1]), int(path.side[-1])
    return gap


def verified(
    scene: Scene, plan: Plan, attractors: Sequence[Attractor], limits: Sequence[LimitSet], seconds: float
) -> Accuracy:
    """Find what error was reached, by means that the method itself did not use.

    Parameters
    ----------
    scene : Scene
        The scene.
    plan : Plan
        What was picked.
    attractors, limits : sequence of Attractor, of LimitSet
        What was found.
    seconds : float
        What finding it took.

    Returns
    -------
    Accuracy
    """
    if not attractors:
        return Accuracy(plan, seconds, None, "nothing stays", "there are no ends: no limit set was found")
    if plan.chosen.method == CELLS or not all(limit.converged for limit in limits):
        reached = max(_from_inside(scene, each, plan.error_wanted) for each in attractors)
        enough = reached <= plan.error_wanted
        advice = (
            None if enough else f"more cells, or an error from {reached:.1g} {plan.unit}, can be asked for"
        )
        return Accuracy(plan, seconds, reached, "orbit", advice)
    proved = _proved(scene, limits)
    rounding = max(end.error for limit in limits for end in limit.ends)
    reached, how = (proved, "proved") if proved <= plan.error_wanted else (rounding, "rounding")
    advice = None if reached <= plan.error_wanted else f"rounding leaves about {reached:.1g} {plan.unit}"
    return Accuracy(plan, seconds, reached, how, advice, proved if math.isfinite(proved) else None)
