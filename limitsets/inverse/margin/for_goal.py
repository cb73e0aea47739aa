"""Design for the scene's own goal: its side and its X stay, quantities move until it holds with room to spare.

The room is the least of two distances by floats: from the farthest place on another side to X, and from X to the
farthest place on the side.  scipy's differential evolution makes it large, the scene as it is among its first designs;
what it ends with is proved, or not, by `limitsets.proofs`.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from limitsets.errors import AnswerError, SceneError
from limitsets.files import as_table, picked
from limitsets.goals import OrientedBeyond, Reaches
from limitsets.inverse.margin.model_validity import validity_slack
from limitsets.inverse.margin.search import ASSUMPTION, LOST, NO_PART, Tell, bounds_of, said
from limitsets.proofs.query import Query
from limitsets.robust.margins.invariant_set import invariant_intervals
from limitsets.scene import Scene, load
from limitsets.scene.quantities import find
from limitsets.scene.spelling import in_unit_of, in_units_of, unit_of
from limitsets.tables import Column, Table, Tabled

__all__ = ["GoalDesign", "design_for_goal"]

EARLY = "let another side get beyond X"
SHORT = "do not reach X on the wanted side"

# Designs of a population, and decimals of what is found.
POPULATION, DECIMALS = 24, 4


@dataclass(frozen=True, eq=False)
class GoalDesign(Tabled):
    """A design for a goal.

    Attributes
    ----------
    scene : Scene
        The design, with the goal of `before`.
    before : Scene
        Where the search began.
    varied : dict of str to (float, float)
        What was varied, and between what [scene's units].
    room : float
        Distance to spare, by floats: X to the farthest place on another side, and to the farthest on its own; the
        smaller of both, negative where the goal fails [length].
    room_before : float or None
        The same of the scene before; None where the part is lost.
    verdict : str
        "proved" or "undecided": of the goal in `scene`, with that parts get beyond X on its side.
    ruled_out : dict of str to int
        Which conditions ruled designs out, and how many.
    evaluations : int
        Designs looked at.
    seconds : float
        Of the search and the proof.
    """

    scene: Scene
    before: Scene
    varied: dict[str, tuple[float, float]]
    room: float
    room_before: float | None
    verdict: str
    ruled_out: dict[str, int]
    evaluations: int
    seconds: float

    @property
    def message(self) -> str:
        """One sentence: what was found, or what ruled designs out."""
        unit, x = self.scene.unit, self.before.goal.x  # type: ignore[union-attr]  # it has one: `design_for_goal` asks
        if self.room > 0.0:
            proof = "proved" if self.verdict == "proved" else "sampled, not proved"
            return f"the goal holds at X = {x:g} {unit} with {self.room:.3g} {unit} to spare ({proof})"
        why = said(self.ruled_out)
        return f"no design that meets the goal at X = {x:g} {unit} among {self.evaluations}: {why}"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [
            (
                name,
                *(in_unit_of(self.before, name, one.value(name)) for one in (self.before, self.scene)),
                *(in_unit_of(self.before, name, end) for end in self.varied[name]),
                unit_of(self.before, name),
            )
            for name in self.varied
        ]
        numbers = [Column(head, show=".6g") for head in ("before", "design", "lowest", "highest")]
        return (Table(("quantity", *numbers, "unit"), rows, f"{self.scene.name}: {self.message}"),)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON."""
        return as_table(
            scene=self.scene.as_dict(),
            **picked(self, "message", "room", "room_before", "verdict", "ruled_out", "evaluations"),
            quantities={
                name: {"before": self.before.value(name), "after": self.scene.value(name), "bounds": ends}
                for name, ends in self.varied.items()
            },
            timings={"design": self.seconds},
        )


def own_bounds(scene: Scene, names: Sequence[str] | None = None) -> dict[str, tuple[float, float]]:
    """Give bounds about the values of a scene, wide enough for a search, which hold these values.

    Parameters
    ----------
    scene : Scene
        The scene.
    names : sequence of str, optional
        Quantities; default what the scene gives of the throw, the mass and the surface's height.

    Examples
    --------
    >>> own_bounds(load("paper-designed"), ["throw.kappa"])
    {'throw.kappa': (12.6889259, 50.7557036)}
    """
    return {name: _ends(scene, name) for name in (names or _usual(scene))}


def _usual(scene: Scene) -> list[str]:
    mass: Mapping[str, Any] = scene.text["part"]["mass"]
    throw = "throw.speed" if "speed" in scene.text["throw"] else "throw.kappa"
    if "center" in mass:
        own = [f"part.mass.{word}" for word in ("center.along", "center.above", "radius_of_gyration")]
    else:
        own = [
            f"part.mass.points[{k}].{word}"
            for k in range(len(mass.get("points", ())))
            for word in ("x", "y", "mass")
        ]
    return [*own, throw, "arm.surface_height"]


def _ends(scene: Scene, name: str) -> tuple[float, float]:
    """Give bounds of one quantity."""
    dimension, value = find(name).dimension, scene.value(name)
    corners, size = scene.vertices, float(scene.sides.length.mean())
    if name.startswith("part.mass.center.") or name in ("part.mass.radius_of_gyration", "arm.surface_height"):
        lo, hi = bounds_of(scene, [name])[name]
    elif name.startswith("part.mass.points") and name[-1] in "xy":
        axis = "xy".index(name[-1])
        lo, hi = float(corners[:, axis].min()), float(corners[:, axis].max())
    elif name.startswith("part.vertices"):
        lo, hi = value - 0.2 * size, value + 0.2 * size
    elif name == "arm.length":
        lo, hi = value, 1.5 * value
    elif dimension == "angle":
        lo, hi = 0.5 * value, min(1.5 * value, math.pi / 2)
    elif name.startswith("part.sides"):
        lo, hi = 0.7 * value, 1.4 * value
    else:
        lo, hi = 0.5 * value, 2.0 * value
    return min(lo, value), max(hi, value)


class _GoalSearch:
    """Rate designs by their room, and count what rules them out."""

    def __init__(self, scene: Scene, bounds: Mapping[str, tuple[float, float]], tell: Tell, of: int) -> None:
        assert isinstance(scene.goal, OrientedBeyond | Reaches)
        self.scene, self.bounds, self.tell, self.of = scene, dict(bounds), tell, of
        self.x, self.side = scene.goal.x, scene.goal.side
        self.ruled_out, self.evaluations = Counter[str](), 0
        self.best: tuple[float, Scene] = (-math.inf, scene)

    def room(self, scene: Scene | None) -> tuple[float, str]:
        """Rate a scene: the room it has, and below 0 why it has none."""
        if scene is None:
            return -4.0 * self.scene.arm_length, NO_PART
        end = scene.arm_length
        start = min(max(end / 3.0, 1.1 * float(scene.sides.a[self.side])), 0.99 * end)
        kept = invariant_intervals(scene.bare_map, start, self.side, landing=0.0)
        if kept is None or not np.isfinite(kept.hi[self.side]):
            return -3.0 * end, LOST
        if not self.x < end or validity_slack(scene, kept) < 0.0:
            return -2.0 * end, ASSUMPTION
        before, after = self.x - kept.threshold(self.side), float(kept.hi[self.side]) - self.x
        room = min(before, after, end)
        return room, "" if room > 0.0 else EARLY if before <= after else SHORT

    def made(self, shares: Sequence[float]) -> Scene | None:
        """Give the scene of unknowns between 0 and 1, as it would be written."""
        values: dict[str, float | str] = {
            name: lo + float(share) * (hi - lo)
            for share, (name, (lo, hi)) in zip(shares, self.bounds.items(), strict=True)
        }
        try:
            return in_units_of(self.scene.with_values(values), self.scene, self.bounds, DECIMALS)
        except SceneError:
            return None

    def cost(self, shares: Sequence[float]) -> float:
        """Rate unknowns, the less the better."""
        self.tell("designs", min(self.evaluations, self.of), self.of)
        self.evaluations += 1
        scene = self.made(shares)
        room, why = self.room(scene)
        if why:
            self.ruled_out[why] += 1
        if scene is not None and room > self.best[0]:
            self.best = room, scene
        return -room


def design_for_goal(
    scene: Scene | str | Path,
    *,
    vary: Sequence[str] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    evaluations: int = 600,
    seed: int = 0,
    progress: Tell | None = None,
) -> GoalDesign:
    """Find a scene that meets its own goal at the X and on the side that it asks for.

    Parameters
    ----------
    scene : Scene, str or Path
        Where to begin, in the minimal model, with a goal `oriented_beyond` or `reaches`.
    vary : sequence of str, optional
        Quantities to vary; default the throw, the mass and the surface's height, as the scene gives them.
    bounds : mapping of str to (float, float), optional
        Bounds of some of them [scene's units]; the others have bounds about the scene's own values.
    evaluations : int
        Designs to look at.
    seed : int
        Of the search; the same seed, the same answer.
    progress : callable, optional
        Called with what is done, how much of it, and of how much.

    Returns
    -------
    GoalDesign
        Its `ruled_out` says which condition ruled designs out, and how many of them.

    Raises
    ------
    AnswerError
        No goal with a side and an X, or effects that are switched on.

    Examples
    --------
    >>> found = design_for_goal("paper-designed", vary=["throw.kappa"], evaluations=24)
    >>> found.verdict, found.scene.goal == found.before.goal
    ('proved', True)
    """
    from scipy.optimize import differential_evolution

    begin, start = time.perf_counter(), load(scene)
    if not isinstance(start.goal, OrientedBeyond | Reaches):
        kind = None if start.goal is None else start.goal.kind
        remedy = "add one to [goal], or ask for --critical-points"
        raise AnswerError(
            "the goal", kind, "oriented_beyond or reaches, with a side and an x", remedy, file=start.file
        )
    if start.effects.on():
        raise AnswerError("the scene", "with effects on", "the minimal model", "switch its effects off")
    if evaluations < 1:
        raise AnswerError("the evaluations", evaluations, "1 or more", "allow for some designs")
    given = dict(bounds or {})
    names = list(dict.fromkeys([*(vary or ([] if given else _usual(start))), *given]))
    ends = {name: given.get(name) or _ends(start, name) for name in names}
    search = _GoalSearch(start, ends, progress or (lambda what, done, of: None), evaluations)
    room_before, why = search.room(start)
    search.best = room_before, start
    random = np.random.default_rng(seed)
    population = random.random((min(POPULATION, max(evaluations, 5)), len(ends)))
    population[0] = [_share(start.value(name), *pair) for name, pair in ends.items()]
    differential_evolution(
        search.cost,
        [(0.0, 1.0)] * len(ends),
        init=population,
        maxiter=max(evaluations // len(population) - 1, 0),
        polish=False,
        tol=0.0,
        seed=seed,
    )
    room, made = search.best
    name = start.name if start.name.endswith("-design") else f"{start.name}-design"
    found = load(made.as_dict() | {"name": name})
    asked = (
        start.goal,
        *([Reaches(start.goal.x, start.goal.side)] if isinstance(start.goal, OrientedBeyond) else []),
    )
    verdict = Query.of(found, asked).prove().verdict if room > 0.0 else "undecided"
    lost = why in (LOST, NO_PART)
    return GoalDesign(
        found, start, ends, room, None if lost else room_before, verdict, dict(search.ruled_out),
        search.evaluations, time.perf_counter() - begin,
    )  # fmt: skip


def _share(value: float, lo: float, hi: float) -> float:
    return min(max((value - lo) / (hi - lo), 0.0), 1.0) if hi > lo else 0.0
