"""All answers about a scene, in one call."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    Tabled,
    arguments_checked,
    as_table,
    bands_of,
    facts,
    picked,
    shown_in_notebooks,
)
from limitsets.feeder.goals import Goal
from limitsets.feeder.scene import Scene, load_to_analyse
from limitsets.parameters.analysis.accuracy import (
    CELLS as BY_CELLS,
    Accuracy,
    Plan,
    best_extents,
    left_to_cells,
    limit_of,
    plan_for,
    verified,
)
from limitsets.parameters.analysis.checks import (
    GoalOutcome,
    Starts,
    against_starts,
    choices_of,
    goal_outcome,
    other_vertex_first,
)
from limitsets.proofs.auditing import EffectChoice, choose_effects
from limitsets.systems.cells import CellSet, Grid, grid
from limitsets.systems.graph import TransitionGraph, morse_graph, transitions
from limitsets.systems.maps import critical_points
from limitsets.systems.maps.critical import CriticalPoint
from limitsets.systems.sets import (
    Attractor,
    Basins,
    Cycle,
    LimitSet,
    attractors,
    basins,
    cycles as cycles_of,
    spurious,
)

if TYPE_CHECKING:
    import networkx as nx


Extents = dict[int, list[tuple[float, float]]]

# Spurious sets that are written to JSON: the largest.
SPURIOUS_WRITTEN = 20
# 512 to 2048 cells per side are where the last set of spurious cells goes in the paper's four scenes; twice that.
CELLS = 4096

# Where random starts go astray, so many times as many cells are tried, up to the last, as long as that helps.
FINER, MOST_CELLS = 4, 65_536

# Finer cells do not help against it.
ABOVE = (
    "the arm's surface is above the joint, and starts near the joint creep to it for ever, which more cells do not "
    "change; is arm.surface_height meant to be negative, which is below? "
    "If not, limitsets certify says which starts these are"
)


@dataclass(frozen=True, eq=False)
class Analysis(Tabled):
    """What is known about a scene; nothing here is proved.

    Attributes
    ----------
    scene : Scene
        The scene that was analysed: where it asks for effects by `auto`, with those chosen.
    choice : EffectChoice
        How it came to its effects.
    grid : Grid
        The cells.
    graph : TransitionGraph
        Who can go where, from sampled images.
    attractors : tuple of Attractor
        Where the throws lead.
    basins : Basins
        From which starts.
    starts : Starts or None
        What a thousand random starts say to it; None where throws scatter, which cells do not.
    limit_sets : tuple of LimitSet
        One per attractor: its end points.
    critical_points : dict of int to tuple of CriticalPoint
        Per side, where the decision between jog and flip changes.
    cycles : tuple of Cycle
        Periodic orbits, as many as were asked for.
    morse : networkx.DiGraph
        Recurrent components and their order.
    goal : GoalOutcome or None
        The scene's goal and whether it holds.
    other_vertex_first : dict of int to list of (lo, hi)
        Per side the starts at which an assumption of the model is broken [length].
    spurious : tuple of CellSet
        Recurrent cells that vanish on refinement.
    timings : dict of str to float
        Per step, in seconds.
    accuracy : Accuracy or None
        What was done for an error asked for, and what was reached.
    """

    scene: Scene
    choice: EffectChoice
    grid: Grid
    graph: TransitionGraph
    attractors: tuple[Attractor, ...]
    basins: Basins
    starts: Starts | None
    limit_sets: tuple[LimitSet, ...]
    critical_points: dict[int, tuple[CriticalPoint, ...]]
    cycles: tuple[Cycle, ...]
    morse: nx.DiGraph[int]
    goal: GoalOutcome | None
    other_vertex_first: Extents
    spurious: tuple[CellSet, ...]
    timings: dict[str, float]
    accuracy: Accuracy | None = None

    def __repr__(self) -> str:
        """Name its scene, with what was found."""
        size = f"{self.grid.n_cells} cells, limit sets: {len(self.attractors)}"
        goal = "" if self.goal is None else f", {self.goal.goal.kind} holds: {self.goal.holds}"
        return f"Analysis({self.scene.name}: {size}{goal}; sampled, not proved)"

    @property
    def second_pass(self) -> float:
        """Share of the sampled throws that went to the slow, sure search for the impact."""
        return self.graph.second_pass

    @property
    def extents(self) -> tuple[Extents, ...]:
        """Per attractor its intervals: of the limit set where its end points are known, else of the cells."""
        return best_extents(self.attractors, self.limit_sets)

    @property
    def extents_from(self) -> tuple[str, ...]:
        """Per attractor what `extents` are: "end points" or "cells"."""
        return tuple("end points" if limit.converged else "cells" for limit in self.limit_sets)

    @property
    def choices(self) -> list[tuple[int, float, float]]:
        """For which X of a goal `oriented_beyond` a side is right, and all limit sets get there: side, from, to."""
        return choices_of(self.extents, len(self.scene.sides))

    @property
    def advice(self) -> tuple[str, ...]:
        """What cells have not settled, and what to do."""
        said = (self.basins.advice, None if self.starts is None else self.starts.advice)
        texts = tuple(text for text in said if text is not None)
        return (ABOVE,) if texts and self.scene.surface_height > 0.0 else texts

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        unit, how = self.scene.unit, "sampled, not proved"
        columns = (
            "limit set",
            "side",
            Column("x", unit, ".3f", ends=True),
            Column("jogs per visit", ends=True),
        )
        rows = [
            (k, side, span, attractor.jogs_per_visit.get(side, (0, 0)))
            for k, (attractor, extents) in enumerate(zip(self.attractors, self.extents, strict=True))
            for side, span in bands_of(extents)
        ]
        shares = [
            *((f"limit set {k}", share) for k, share in enumerate(self.basins.attractors)),
            *((f"leave: {name}", share) for name, share in self.basins.exits.items()),
            ("undecided", self.basins.undecided_between),
        ]
        points = [
            (side, point.x, point.kind)
            for side, on_side in sorted(self.critical_points.items())
            for point in on_side
        ]
        shown = [
            Table(columns, rows, f"{self.scene.name}: limit sets", how),
            Table(("where starts end", Column("share", show=".4f")), shares, "Basins", how),
            Table(("side", Column("x", unit, ".6f"), "change"), points, "Critical points", how),
        ]
        if self.goal is not None:
            goal = {"kind": self.goal.goal.kind, "holds": self.goal.holds}
            shown.append(facts("Goal", goal, how))
        return tuple(shown)

    def to_json(self) -> dict[str, Any]:
        """Write it as tables, lists, text and finite numbers; None where a number is missing.

        Returns
        -------
        dict
            Sides are keys "0", "1", ...; lengths are in ``units["length"]``, angles in rad, times in seconds.
            `limitsets.load` reads the scene back from ``["scene"]``.

        Examples
        --------
        >>> import limitsets as ls
        >>> found = ls.analyse("paper-designed")
        >>> found.to_json()["attractors"][0]["flip_order"]
        [0, 1, 2]
        """
        scene, goal, basins = self.scene, self.goal, self.basins
        return as_table(
            scene=scene.as_dict(),
            units={"length": scene.unit, "angle": "rad", "time": "s", "lyapunov": "per throw"},
            cells=self.grid.shape[:, 0],
            critical_points={
                side: [picked(point, "x", "kind") for point in points]
                for side, points in sorted(self.critical_points.items())
            },
            attractors=[self._attractor(k) for k in range(len(self.attractors))],
            basins={
                **picked(basins, "attractors", "undecided_between"),
                **{name.replace("-", "_"): share for name, share in basins.exits.items()},
            },
            starts=self.starts,
            advice=self.advice,
            cycles=[
                picked(cycle, "period", "x")
                | {"sides": cycle.side}
                | picked(cycle, "multiplier", "residual", "rounding")
                for cycle in self.cycles
            ],
            goal=None
            if goal is None
            else {"kind": goal.goal.kind, **picked(goal, "holds", "threshold", "how")},
            goal_vacuous=None if goal is None else goal.vacuous,
            choices=[dict(zip(("side", "lo", "hi"), each, strict=True)) for each in self.choices],
            effects=self.choice,
            other_vertex_first=_ordered(self.other_vertex_first),
            spurious=[
                {"cells": len(cells), "extents": cells.extents()}
                for cells in self.largest_spurious[:SPURIOUS_WRITTEN]
            ],
            spurious_count=len(self.spurious),
            accuracy=self.accuracy,
            second_pass=self.second_pass,
            timings={step: round(seconds, 6) for step, seconds in self.timings.items()},
        )

    @property
    def largest_spurious(self) -> list[CellSet]:
        """The sets of `spurious`, the largest first: below a low surface there are thousands of single cells."""
        return sorted(self.spurious, key=len, reverse=True)

    def _attractor(self, k: int) -> dict[str, Any]:
        attractor = self.attractors[k]
        return {
            "extents": _ordered(self.extents[k]),
            "extents_from": self.extents_from[k],
            "flip_order": attractor.flip_order,
            "jogs_per_visit": _ordered(attractor.jogs_per_visit),
            **picked(attractor, "flips_per_throw", "lyapunov", "throws", "in_cells", "stopped"),
            "advice": self.limit_sets[k].advice,
        }


def _ordered(by_side: Mapping[int, Any]) -> dict[int, Any]:
    return dict(sorted(by_side.items()))


class _GridAnswer(NamedTuple):
    """What one grid gives."""

    graph: TransitionGraph
    attractors: tuple[Attractor, ...]
    basins: Basins
    starts: Starts | None


def _on_grid(scene: Scene, cells: int, throws: int, steps: _Steps) -> _GridAnswer:
    """Look at one grid."""
    with steps.step("transitions"):
        graph = transitions(scene.map, grid(scene.domain, cells=cells))
    with steps.step("attractors"):
        sets = attractors(graph, throws=throws)
    with steps.step("basins"):
        shares = basins(graph, sets)
    with steps.step("random starts"):
        starts = None if scene.effects.spread else against_starts(graph, sets, shares)
    return _GridAnswer(graph, sets, shares, starts)


def _on_grids(scene: Scene, cells: int, most_cells: int, throws: int, steps: _Steps) -> _GridAnswer:
    """Look at one grid, and at finer ones as long as random starts show that these miss less."""
    grid_answer = _on_grid(scene, cells, throws, steps)
    while _missed(grid_answer) > 0.0 and (cells := FINER * cells) <= most_cells:
        finer = _on_grid(scene, cells, throws, steps)
        if _missed(finer) >= _missed(grid_answer):
            break
        grid_answer = finer
    return grid_answer


def _missed(grid_answer: _GridAnswer) -> float:
    return 0.0 if grid_answer.starts is None else grid_answer.starts.missed


def _goal_outcome(goal: Goal, grid_answer: _GridAnswer, limits: Sequence[LimitSet]) -> GoalOutcome:
    """Say whether a goal holds; open where some random starts stay where no attractor is known."""
    outcome = goal_outcome(
        goal,
        grid_answer.graph,
        grid_answer.attractors,
        basins=grid_answer.basins,
        extents=best_extents(grid_answer.attractors, limits),
    )
    astray = grid_answer.starts is not None and grid_answer.starts.elsewhere
    return replace(outcome, holds=None) if outcome.holds and astray else outcome


class _Steps:
    """Time each step and say which one has begun."""

    def __init__(self, count: int, progress: Progress | None) -> None:
        self.count, self.progress, self.timings = count, progress, dict[str, float]()

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        if self.progress is not None:
            self.progress(name, len(self.timings), self.count)
        begin = time.perf_counter()
        yield
        self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - begin


@shown_in_notebooks
@arguments_checked
def analyse(
    scene: str | Path | Mapping[str, Any] | Scene,
    cells: int | None = None,
    *,
    error: float | None = None,
    throws: int = 200_000,
    cycles: int = 0,
    progress: Progress | None = None,
    announce: Callable[[Plan], None] | None = None,
) -> Analysis:
    """Find where the throws of a scene lead.

    Parameters
    ----------
    scene : str, Path, mapping or Scene
        A scene, or what `limitsets.load` reads.
    cells : int, optional
        Cells per side, which shrink towards the inner end of each side.  By default 4096, and up to 65 536 where a
        thousand random starts show that these miss something.
    error : float, optional
        Instead of `cells`: the largest error of the limit sets' ends [length].  The cheapest method that meets
        it is picked, and the error reached is verified (`Analysis.accuracy`); one that cannot be met is told there.
    throws : int
        Length of the orbit on which jogs, flips and the Lyapunov exponent are counted.
    cycles : int
        Look for all periodic orbits up to this period in each attractor; 0 looks for none.
    progress : callable, optional
        Called as ``progress(step, done, of)`` before each step.
    announce : callable, optional
        Called with the `Plan` for `error` before the computation starts.

    Returns
    -------
    Analysis
        Attractors, basins, limit sets, critical points, the goal's verdict.  With ``auto = true`` in ``[effects]``,
        of the scene with the effects that the audit calls for on its limit set and whose facts are given.  Of a part
        that cannot rest on one of its sides, with `landing` and `roll`, where what is read does not switch them on.

    Raises
    ------
    SceneError
        For a scene that cannot be read.
    GridError
        For a number of cells that cannot be.
    AnswerError
        For a number of throws, a period or an error that cannot be, or both cells and an error.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.analyse("paper-designed")
    >>> found.goal.holds, round(found.goal.threshold, 3)  # beyond 20 in every part lies on side 2
    (True, 19.753)
    """
    if cycles < 0:
        raise AnswerError("the longest period", cycles, "an integer from 0", "pass cycles=0 for none")
    if cells is not None and error is not None:
        raise AnswerError("the cells", cells, "none beside an error", "give cells or error, not both")
    steps = _Steps(10 + (cycles > 0) + 2 * (error is not None), progress)
    with steps.step("scene"):
        read, tipping = load_to_analyse(scene)
        choice = replace(choose_effects(read), tipping=tipping)
        chosen = choice.scene
    plan = None
    if error is not None:
        with steps.step("plan"):
            plan = plan_for(chosen, error, throws)
        if announce is not None:
            announce(plan)
    count = plan.chosen.cells if plan is not None else CELLS if cells is None else cells
    seen = _on_grids(chosen, count, MOST_CELLS if cells is None else count, throws, steps)
    graph, sets = seen.graph, seen.attractors
    with steps.step("limit sets"):
        skip = plan is not None and plan.chosen.method == BY_CELLS
        limits = tuple(left_to_cells() if skip else limit_of(graph, each) for each in sets)
    with steps.step("critical points"):
        critical = critical_points(chosen.map, chosen.domain)
    orbits: tuple[Cycle, ...] = ()
    if cycles:
        with steps.step("cycles"):
            orbits = tuple(cycle for attractor in sets for cycle in cycles_of(graph, cycles, attractor))
    with steps.step("Morse graph"):
        morse = morse_graph(graph)
        false_sets = spurious(graph)
    with steps.step("goal"):
        outcome = None if chosen.goal is None else _goal_outcome(chosen.goal, seen, limits)
    with steps.step("assumptions"):
        flags = other_vertex_first(chosen)
    accuracy = None
    if plan is not None:
        with steps.step("accuracy"):
            took = sum(steps.timings[step] for step in ("transitions", "attractors", "limit sets"))
            accuracy = verified(chosen, plan, sets, limits, took)
    return Analysis(
        scene=chosen,
        choice=choice,
        grid=graph.grid,
        graph=graph,
        attractors=sets,
        basins=seen.basins,
        starts=seen.starts,
        limit_sets=limits,
        critical_points=critical,
        cycles=orbits,
        morse=morse,
        goal=outcome,
        other_vertex_first=flags,
        spurious=false_sets,
        timings=steps.timings,
        accuracy=accuracy,
    )
