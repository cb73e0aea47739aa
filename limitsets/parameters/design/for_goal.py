"""Design for the scene's own goal: its side and its X stay, quantities move until it holds with room to spare.

The room is the least of two distances by floats: from the farthest place on another side to X, and from X to the
farthest place on the side.  scipy's differential evolution makes it large, the scene as it is among its first designs;
a design that some starts leave comes after all that none leaves.  What it ends with is proved, or not, by
`limitsets.proofs`.
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

from limitsets.base import AnswerError, Column, Progress, Table, Tabled, as_table, picked, silent
from limitsets.feeder.goals import Laid, OrientedBeyond, Reaches
from limitsets.feeder.scattering import uniform_starts
from limitsets.feeder.scene import (
    LaidLike,
    Model,
    Scene,
    in_unit_of,
    in_units_of,
    laid_goal,
    laid_goals,
    load,
    unit_of,
)
from limitsets.parameters.design.search import (
    ASSUMPTION,
    LEAVES,
    LOST,
    NO_PART,
    Ends,
    bounds_of,
    design_name,
    of_the_arm,
    require_searchable,
    said,
    scene_with,
    validity_slack,
)
from limitsets.parameters.margins.estimate import invariant_intervals, least_slack
from limitsets.proofs.prover.query import Query
from limitsets.systems.maps import advance

EARLY = "let another side get beyond X"
SHORT = "do not reach X on the wanted side"

# Starts that are sampled where parts leave, and throws of each.
STARTS, THROWS = 2000, 2000

# Share of the designs, one in so many, for arm and throw alone.
ALONE = 2

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
    lacking_before : str
        The condition that rules the scene before out, "break an assumption ..."; empty where none does.
    leaving : float or None
        Share of the starts on the arm from which parts leave it, sampled; None where a throw from anywhere stays on it.
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
    lacking_before: str
    leaving: float | None
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
            held = f"the goal holds of the limit set at X = {x:g} {unit} ({proof})"
            return f"{held}, with {self.room:.3g} {unit} to spare (sampled)"
        return f"no design that meets the goal at X = {x:g} {unit} among {self.evaluations}: {said(self.ruled_out)}"

    @property
    def itself(self) -> str:
        """One sentence: how the scene before stands, and whether it is the design."""
        said = f"the scene as it is is ruled out, as one of those that {self.lacking_before}"
        if not self.lacking_before:
            spare = f"{self.room_before:.3g} {self.scene.unit} to spare"
            said = f"the scene as it is meets the goal, with {spare}"
        same = load(self.before.as_dict() | {"name": self.scene.name}) == self.scene
        return f"{said}; no other is better, so that {self.scene.name} has its values" if same else said

    @property
    def model(self) -> Model:
        """Of which model the design is, and which facts of the scene that leaves out."""
        return Model.of(self.scene)

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
        heading = "design" if self.room > 0.0 else "nearest miss"
        numbers = [Column("before", show=".6g"), Column(heading, show=".6g")]
        numbers += [Column(head, show=".4g") for head in ("lowest", "highest")]
        caption = f"{self.scene.name}: {self.message}"
        return (Table(("quantity", *numbers, "unit"), rows, caption, self.model.sentence),)

    def to_json(self) -> dict[str, Any]:
        """Give it as plain tables for JSON."""
        return as_table(
            scene=self.scene.as_dict(),
            **picked(self, "message", "room", "room_before", "lacking_before"),
            **picked(self, "leaving", "verdict", "ruled_out", "evaluations"),
            quantities={
                name: {"before": self.before.value(name), "after": self.scene.value(name), "bounds": ends}
                for name, ends in self.varied.items()
            },
            model=self.model,
            timings={"design": self.seconds},
        )


class _GoalSearch:
    """Rate designs by their room, and count what rules them out."""

    def __init__(self, scene: Scene, tell: Progress, of: int) -> None:
        assert isinstance(scene.goal, OrientedBeyond | Reaches)
        self.scene, self.tell, self.of = scene, tell, of
        self.bounds: dict[str, tuple[float, float]] = {}
        self.x, self.side, self.laid = scene.goal.x, scene.goal.side, scene.goal.laid
        self.ruled_out, self.evaluations = Counter[str](), 0
        self.best: tuple[float, float, Scene] = (-math.inf, -math.inf, scene)

    def rated(self, scene: Scene | None) -> tuple[float, float, str]:
        """Rate a scene: a number, the room it has, and what rules it out."""
        end = self.scene.arm_length
        room, why = self._room(scene)
        if scene is None or why:
            return room, room, why
        slack = 0.0 if self.laid else least_slack(scene.bare_map)
        # after all designs that no start leaves, and before all designs that do not meet the goal
        if slack < 0.0:
            return end + max(slack, -end), room, LEAVES
        return end + room, room, ""

    def _room(self, scene: Scene | None) -> tuple[float, str]:
        """Give the room of a scene, and below 0 why it has none."""
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
        ends = zip(shares, self.bounds.items(), strict=True)
        values = {name: lo + float(share) * (hi - lo) for share, (name, (lo, hi)) in ends}
        scene = scene_with(self.scene, values)
        return None if scene is None else in_units_of(scene, self.scene, self.bounds, DECIMALS)

    def run(self, bounds: Mapping[str, tuple[float, float]], evaluations: int, seed: int) -> None:
        """Look at so many designs between bounds, the best one so far among the first."""
        from scipy.optimize import differential_evolution

        self.bounds = dict(bounds)
        population = np.random.default_rng(seed).random((min(POPULATION, max(evaluations, 5)), len(bounds)))
        shares = ((self.best[2].value(name) - lo) / (hi - lo) for name, (lo, hi) in bounds.items())
        population[0] = [min(max(share, 0.0), 1.0) for share in shares]
        differential_evolution(
            self.cost,
            [(0.0, 1.0)] * len(bounds),
            init=population,
            maxiter=max(evaluations // len(population) - 1, 0),
            polish=False,
            tol=0.0,
            seed=seed,
        )

    def cost(self, shares: Sequence[float]) -> float:
        """Rate unknowns, the less the better."""
        self.tell("designs", min(self.evaluations, self.of), self.of)
        self.evaluations += 1
        scene = self.made(shares)
        rating, room, why = self.rated(scene)
        if why:
            self.ruled_out[why] += 1
        if scene is not None and rating > self.best[0]:
            self.best = rating, room, scene
        return -rating


def design_for_goal(
    scene: Scene | str | Path,
    *,
    vary: Sequence[str] | None = None,
    bounds: Mapping[str, Ends] | None = None,
    laid: LaidLike | None = None,
    evaluations: int = 600,
    seed: int = 0,
    progress: Progress | None = None,
) -> GoalDesign:
    """Find a scene that meets its own goal at the X and on the side that it asks for.

    Parameters
    ----------
    scene : Scene, str or Path
        Where to begin, in the minimal model, with a goal `oriented_beyond` or `reaches`.
    vary : sequence of str, optional
        Quantities to vary; default the throw and the surface's height, and where these do not meet the goal the mass.
    bounds : mapping of str to (float or None, float or None), optional
        Bounds of some of them [scene's units]; what is left out has usual ones, which hold the scene's own value.
    laid : mapping of int to sequence of (float, float), optional
        Where parts are laid down, as for `limitsets.certify`: the goal is proved of these starts, and starts elsewhere
        may leave the arm.  Default: the whole arm.
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
    begin, start = time.perf_counter(), laid_goals(load(scene), laid)[0]
    if not isinstance(start.goal, OrientedBeyond | Reaches):
        kind = None if start.goal is None else start.goal.kind
        remedy = "add one to [goal], or ask for --critical-points"
        raise AnswerError(
            "the goal", kind, "oriented_beyond or reaches, with a side and an x", remedy, file=start.file
        )
    require_searchable(start, evaluations)
    search = _GoalSearch(start, progress or silent, evaluations)
    rating, room_before, why = search.rated(start)
    search.best = rating, room_before, start
    # arm and throw are set in minutes, another part is made: it varies only where they do not meet the goal
    if vary is None and bounds is None:
        search.run(bounds_of(start, of_the_arm(start)), evaluations // ALONE, seed)
    if vary is not None or bounds is not None or search.rated(search.best[2])[2]:
        search.run(bounds_of(start, vary, bounds), evaluations - search.evaluations, seed)
    _, room, made = search.best
    design = load(made.as_dict() | {"name": design_name(start)})
    fed = (Reaches(start.goal.x, start.goal.side),) if isinstance(start.goal, OrientedBeyond) else ()
    goals = tuple(laid_goal(goal, start.goal.laid) for goal in (start.goal, *fed))
    return GoalDesign(
        scene=design,
        before=start,
        varied=search.bounds,
        room=room,
        room_before=None if why in (LOST, NO_PART) else room_before,
        lacking_before=why,
        leaving=_leaving(design, start.goal.laid),
        verdict=(Query.of(design, goals).prove().verdict if room > 0.0 else "undecided"),
        ruled_out=dict(search.ruled_out),
        evaluations=search.evaluations,
        seconds=time.perf_counter() - begin,
    )


def _leaving(scene: Scene, laid: Laid) -> float | None:
    """Give the share of random starts from which parts leave the arm; None where no throw from anywhere does."""
    if least_slack(scene.bare_map) >= 0.0:
        return None
    whole = [(side, a, scene.arm_length) for side, a in enumerate(scene.sides.a.tolist())]
    side, lo, hi = (np.array(column) for column in zip(*(laid or whole), strict=True))
    starts = uniform_starts(np.random.default_rng(0), lo, hi, STARTS, side)
    return float((advance(scene.bare_map, *starts, THROWS)[2] < 0).mean())
