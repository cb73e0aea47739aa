"""Design for wanted critical points (`limitsets.design`), and limit sets along its path (Fig. 6 of the paper)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitsets.base import (
    AnswerError,
    Column,
    Progress,
    Table,
    Tabled,
    arguments_checked,
    as_table,
    one_by_one,
    picked,
    shown_in_notebooks,
)
from limitsets.feeder.scene import Model, Scene, in_unit_of, in_units_of, load, unit_of
from limitsets.feeder.scene.quantities import text_at, texts
from limitsets.feeder.scene.units import convert, parse
from limitsets.parameters.design.derivatives import (
    CriticalJacobian,
    condition_of,
    present,
    require_minimal,
    with_present,
)
from limitsets.parameters.design.search import design_name
from limitsets.parameters.design.solving import (
    KEPT,
    REACHED,
    Bounds,
    Solution,
    Trial,
    TrialLog,
    Unknowns,
    continued,
    nearest_to_start,
    nearest_to_targets,
    restarted,
    solved,
    staged,
    unknowns_of,
)
from limitsets.systems.cells import grid
from limitsets.systems.graph.building import transitions
from limitsets.systems.sets.attracting import attractors
from limitsets.systems.sets.end_points import limit_set

# ----------------------------------------------------------------
# Design: find quantities of a scene for which its critical points have given values.


# Standard deviations of other starts by turns, in the solver's numbers: shares, or sizes of the part.
SPREADS = (0.15, 0.3)


@dataclass(frozen=True, eq=False)
class Design(Tabled):
    """A scene with the critical points that were wanted, or as near to them as was found; nothing is proved.

    Attributes
    ----------
    scene : Scene
        The scene found; its numbers as written give these critical points.
    start : Scene
        The scene that the search started from.
    targets : tuple of float or None
        What was wanted, per side; None was free [length].
    reached : bool
        Whether every target is hit to 1e-9.
    residual : tuple of float or None
        Critical point minus target, per side; None where it was free [length].
    before, jacobian : CriticalJacobian
        Critical points and derivatives of `start` and of `scene`.
    evaluations : int
        How often critical points were computed, with their derivatives, in all.
    path : tuple of Scene
        Scenes on the way, from `start` to `scene`: of Newton's steps, or of the continuation's stages.
    how : str
        How it was found.
    message : str
        One sentence: reached, or how near and what stands in the way.
    """

    scene: Scene
    start: Scene
    targets: tuple[float | None, ...]
    reached: bool
    residual: tuple[float | None, ...]
    before: CriticalJacobian
    jacobian: CriticalJacobian
    evaluations: int
    path: tuple[Scene, ...]
    how: str
    message: str

    @property
    def condition(self) -> float | None:
        """Condition number of the derivatives of the targeted critical points (`CriticalJacobian.scaled`)."""
        sides = [side for side, target in enumerate(self.targets) if target is not None]
        return condition_of(self.jacobian.scaled[sides])

    def quantities(self) -> dict[str, tuple[float, float, str]]:
        """Give what was varied: value before, value found, unit."""
        quantities_varied = {}
        for name in self.jacobian.names:
            unit = unit_of(self.start, name)
            pair = tuple(
                in_unit_of(self.start, name, present(scene, name)) for scene in (self.start, self.scene)
            )
            if name == "throw.speed" and self.start.gravity is None:
                pair, unit = (1.0, float(np.sqrt(self.start.kappa / self.scene.kappa))), "of its own value"
            quantities_varied[name] = (pair[0], pair[1], unit)
        return quantities_varied

    @property
    def model(self) -> Model:
        """Of which model the design is, and which facts of the scene that leaves out."""
        return Model.of(self.scene)

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        heads = ("quantity", Column("before", show=".9g"), Column("after", show=".9g"), "unit")
        more = (Column("wanted", show=".9g"), Column("off by", show=".1e"))
        rows: list[tuple[object, ...]] = [
            (name, before, after, unit, None, None)
            for name, (before, after, unit) in self.quantities().items()
        ]
        points = zip(
            self.before.x.tolist(), self.jacobian.x.tolist(), self.targets, self.residual, strict=True
        )
        rows += [
            (f"r_{side} (first critical point of side {side})", before, after, self.start.unit, wanted, miss)
            for side, (before, after, wanted, miss) in enumerate(points)
        ]
        how = f"computed, not proved; {self.model.sentence}"
        return (Table((*heads, *more), rows, f"{self.scene.name}: {self.message}", how),)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON."""
        return as_table(
            scene=self.scene.as_dict(),
            **picked(self, "reached", "message", "how", "evaluations"),
            **picked(self, "targets", "residual"),
            quantities=[
                {"quantity": name, "before": before, "after": after, "unit": unit}
                for name, (before, after, unit) in self.quantities().items()
            ],
            before=self.before,
            after=self.jacobian,
            condition=self.condition,
            path=[scene.as_dict() for scene in self.path],
            model=self.model,
        )


@shown_in_notebooks
@arguments_checked
def design(
    scene: Scene | str,
    *,
    critical_points: Sequence[float | str | None] = (),
    vary: Sequence[str] = (),
    bounds: Bounds | None = None,
    starts: int = 8,
    stages: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Design:
    """Find quantities of a scene for which its first critical points are where they are wanted.

    Newton's method in a trust region within bounds, with exact derivatives; where that fails from the scene as it is,
    the targets are moved there step by step (continuation), then other starts are drawn.  With more quantities than
    targets the answer is the one nearest to the scene (in shares, and sizes of the part); with fewer, least squares.

    Parameters
    ----------
    scene : Scene or str
        Where to start, or what `limitsets.load` takes.
    critical_points : sequence of float, str or None
        Per side the first critical point wanted, in the scene's unit or as text with a unit; None leaves it free.
    vary : sequence of str
        Quantities to vary (`limitsets.scene.NAMES`); any number of them.
    bounds : mapping of str to (lo, hi), optional
        Bounds of some of them; None for no bound.  That every side rests is always asked.
    starts : int
        How many other starts are drawn at most.
    stages : int, optional
        Move the targets in so many equal steps and keep every one in the path.
    seed : int
        Of the starts drawn.
    progress : callable, optional
        Told ``(step, done, of)`` on the way.

    Returns
    -------
    Design

    Raises
    ------
    AnswerError
        Targets or quantities that cannot be meant, bounds out of order, or a scene with effects.
    SceneError
        A quantity that this scene does not give.

    Notes
    -----
    Source: the paper's section on design; docs/design.md.  That a target is not reached is what was found,
    not a proof that there is no such scene.

    Examples
    --------
    >>> import limitsets as ls
    >>> centre_and_speed = ["part.mass.center.along", "part.mass.center.above", "throw.speed"]
    >>> found = ls.design("paper-initial", critical_points=[10, 10, 20], vary=centre_and_speed)
    >>> found.reached, [round(value[1], 4) for value in found.quantities().values()]
    (True, [4.2256, 0.7082, 158.0245])
    """
    chosen = load(scene)
    require_minimal(chosen)
    targets = _targets(chosen, critical_points)
    names = [vary] if isinstance(vary, str) else list(vary)
    if not names or len(set(names)) != len(names):
        raise AnswerError(
            "the quantities to vary", ", ".join(map(str, names)), "one or more, each once", "name them"
        )
    unknowns = unknowns_of(chosen, names, bounds)
    # refuses what cannot be set
    with_present(chosen, dict(zip(unknowns.names, unknowns.start.tolist(), strict=True)))
    search = TrialLog(chosen, unknowns, targets, progress)
    outcome, how = _searched(search, unknowns, starts, stages, seed)
    return _answer(search, targets, outcome, how)


def _targets(scene: Scene, wanted: Sequence[float | str | None]) -> tuple[float | None, ...]:
    count = len(scene.sides)
    given = [wanted] if isinstance(wanted, str) else list(wanted)
    if len(given) != count or all(each is None for each in given):
        raise AnswerError(
            "the critical points wanted",
            ", ".join(map(str, given)),
            f"{count}, one for each side, None for a free one, and not all free",
            "give one per side",
        )
    targets = [
        convert(parse(each, "length"), scene.unit) if isinstance(each, str) else each for each in given
    ]
    for side, target in enumerate(targets):
        if target is not None and not 0.0 < target <= scene.arm_length:
            raise AnswerError(
                f"the critical point wanted on side {side}",
                target,
                f"a place on the arm, up to {scene.arm_length:g} {scene.unit}",
                "correct it, or lengthen the arm",
            )
    return tuple(None if target is None else float(target) for target in targets)


def _searched(
    search: TrialLog, unknowns: Unknowns, starts: int, count: int | None, seed: int
) -> tuple[Solution, str]:
    """Try one way after the other until the targets are reached; else come as near as possible."""
    own = unknowns.seen(unknowns.start)
    search.require_effect(search.at(own))
    center = unknowns.inside(own)
    first = search.at(center)
    solution, how = Solution(first, [] if first is None else [first], False), ""
    if first is not None and count is not None:
        solution, how = staged(search, first, count), f"continuation in {count} stages"
    elif first is not None:
        solution, how = solved(search, center, search.wanted), "Newton's method from the scene"
        if not solution.reached and search.wanted.size <= center.size:
            solution, how = continued(search, first, 0.25), "continuation in the targets"
    random, tries = np.random.default_rng(seed), starts if count is None or first is None else 0
    for number in range(tries):
        if solution.reached:
            break
        search.step, search.of = "other starts", (number, starts)
        solution, how = (
            restarted(search, center, SPREADS[number % 2], random),
            f"start {number + 1} of {starts} drawn",
        )
    if not solution.reached:
        best = search.best()
        if best is None:
            return Solution(None, [], False), "no scene was found that has the critical points wanted"
        near = nearest_to_targets(search, best)
        return Solution(near, [*solution.path[:1], near], (search.cost(near) <= REACHED)), "least squares"
    if search.wanted.size < center.size and solution.trial is not None:
        near = nearest_to_start(search, solution.trial, own)
        solution = Solution(
            near, [*(each for each in solution.path if each is not solution.trial), near], True
        )
        how += ", then the nearest to the scene"
    return solution, how


def _answer(search: TrialLog, targets: tuple[float | None, ...], outcome: Solution, how: str) -> Design:
    before = search.trials[0].jacobian
    after = before if outcome.trial is None else outcome.trial.jacobian
    residual = tuple(
        None if target is None or not np.isfinite(x) else float(x - target)
        for target, x in zip(targets, after.x.tolist(), strict=True)
    )
    scene, start = search.scene, search.scene
    if outcome.trial is not None:  # files are named after it
        changed = [name for name, text in texts(after.scene.text) if text != text_at(start.text, name)]
        scene = load(in_units_of(after.scene, start, changed).as_dict() | {"name": design_name(start)})
    scenes = [scene if trial is outcome.trial else trial.jacobian.scene for trial in outcome.path]
    return Design(
        scene=scene,
        start=start,
        targets=targets,
        reached=outcome.reached,
        residual=residual,
        before=before,
        jacobian=after,
        evaluations=search.evaluations,
        path=(search.scene, *scenes[1:]) if scenes else (search.scene,),
        how=how,
        message=_message(search, outcome, residual),
    )


def _message(search: TrialLog, outcome: Solution, residual: tuple[float | None, ...]) -> str:
    unit = search.scene.unit
    if outcome.reached:
        return f"reached: every critical point wanted is within {REACHED:g} {unit} of its place"
    if outcome.trial is None:
        return "not reached: no scene tried has all the critical points wanted; start from another scene"
    worst = max(abs(value) for value in residual if value is not None)
    rms = float(np.sqrt(np.mean([value**2 for value in residual if value is not None])))
    text = f"not reached: the nearest found misses by {worst:.3g} {unit} at most, {rms:.3g} {unit} rms"
    varied, wanted = search.unknowns.start.size, search.wanted.size
    if wanted > varied:
        text += f"; {varied} varied for {wanted} wanted: least squares"
    return text + "".join(f"; {reason}" for reason in _in_the_way(search, outcome.trial))


def _in_the_way(search: TrialLog, trial: Trial) -> list[str]:
    """Say which bounds and which edges of the part hold the search."""
    unknowns = search.unknowns
    still = [side for side, slope in zip(search.sides, trial.slope, strict=True) if not slope.any()]
    bounds = {"lower": unknowns.lo, "upper": unknowns.hi}
    size = float(np.ptp(search.scene.vertices, axis=0).max())
    words = ("the left end", "the right end", "the level")
    tipping = np.flatnonzero(trial.jacobian.slack < 2.0 * KEPT * size).tolist()
    return [
        *(f"the critical point of side {side} does not depend on what is varied" for side in still),
        *(
            f"{name} is at its {word} bound"
            for k, name in enumerate(unknowns.names)
            for word, ends in bounds.items()
            if np.isfinite(ends[k]) and abs(trial.at[k] - ends[k]) < 1e-6
        ),
        *(
            f"the centre of mass is at {words[k % 3]} of side {k // 3}: beyond it the part tips over"
            for k in tipping
        ),
    ]


# ----------------------------------------------------------------
# Limit sets along the path of a design, on which the critical points move to their targets (Fig. 6 of the paper).


Extents = dict[int, list[tuple[float, float]]]

# As many cells per side as an analysis takes.
CELLS = 4096


def limit_sets_along(found: Design, progress: Progress | None = None) -> tuple[tuple[Extents, ...], ...]:
    """Compute the limit sets of every scene on a design's path.

    Parameters
    ----------
    found : Design
        From `limitsets.design`.
    progress : callable, optional
        Told ``(step, done, of)`` before each scene.

    Returns
    -------
    tuple of tuples of dict
        Per scene and attractor the intervals per side [length]: of its end points where they are known, of cells
        otherwise.  Sampled, not proved.

    Examples
    --------
    >>> import limitsets as ls
    >>> found = ls.design("paper-initial", critical_points=[10, 10, 20],
    ...                   vary=["part.mass.center.along", "part.mass.center.above", "throw.speed"])
    >>> first, *_, last = limit_sets_along(found)
    >>> [round(last[0][2][0][end], 3) for end in (0, 1)]
    [8.914, 23.383]
    """
    return tuple(map(_limit_sets, one_by_one("limit sets", found.path, len(found.path), progress)))


def _limit_sets(scene: Scene) -> tuple[Extents, ...]:
    graph = transitions(scene.map, grid(scene.domain, cells=CELLS))
    limits = [(attractor, limit_set(graph, attractor)) for attractor in attractors(graph)]
    return tuple(limit.extents if limit.converged else attractor.extents for attractor, limit in limits)
