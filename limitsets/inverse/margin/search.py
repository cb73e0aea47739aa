"""Global search, by floats, for the part with the largest margin.

The search knows one number, the joint margin by floats (`estimated`); what it ends with `limitsets.robust` proves.
scipy's differential evolution moves a population of designs; in between, the best one is tried on all corners of the
tolerance, and those at which it fails are kept as hard ones for all.  An answer depends on the seed and the number of
evaluations, never on the clock.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import SceneError
from limitsets.inverse.margin.counterweight import counterweight_of
from limitsets.inverse.margin.model_validity import validity_slack
from limitsets.robust.margins.estimate import Estimate, estimated, failing
from limitsets.robust.margins.invariant_set import least_slack
from limitsets.robust.margins.vector import Signs, Tolerance
from limitsets.scene import Scene

# Designs in the population, generations between two looks at all corners, and corners kept as hard.
POPULATION, GENERATIONS, MOST_HARD = 24, 4, 24
# A lead weight is at most this share of the part: the rest is the plate.
MOST_LEAD = 0.9

# What rules a design out.
NO_PART = "cannot be built (a side on which the part cannot rest, or no such part)"
NO_WEIGHT = "need more than one lead weight on a plate, or one of over 90 % of the mass"
LOST = "lose the part, or never lay it on the wanted side"
OTHER_SIDE = "let another side get as far out as the wanted one"
ASSUMPTION = (
    "break an assumption of the model (another corner lands first, the throw tips the part, or it slips)"
)
LEAVES = "lose parts from some starts on the arm"

Tell = Callable[[str, int, int], None]
Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Candidate:
    """A design that was tried, and is fed somewhere.

    Attributes
    ----------
    values : dict of str to float
        What was varied [scene's units].
    found : Estimate
        Its margin by floats.
    order : int
        Which of the scenes that the search began with: another order of the sides.
    """

    values: dict[str, float]
    found: Estimate
    order: int


@dataclass(eq=False)
class DesignSearch:
    """The search in one scene.

    Attributes
    ----------
    scene : Scene
        Where it begins: what is not varied stays.
    tolerance : Tolerance
        The tolerance.
    side : int
        The side on which parts are to be fed.
    bounds : dict of str to (float, float)
        What is varied, and between what [scene's units].
    order : int
        A number for it, for the record.
    lead : bool
        Whether the part has to be a uniform plate with one point mass on it.
    everywhere : bool
        Whether no start on the arm may be lost, in the scene as it is.
    strict : bool
        Whether every design that feeds, and breaks a condition, rates above all that do not feed.  Else how far it is
        from being a design decides: a search ends there where few designs feed.
    """

    scene: Scene
    tolerance: Tolerance
    side: int
    bounds: Mapping[str, tuple[float, float]]
    order: int = 0
    lead: bool = True
    everywhere: bool = True
    strict: bool = False
    hard: list[Signs] = field(default_factory=list)
    history: list[Candidate] = field(default_factory=list)
    evaluations: int = 0
    ruled_out: Counter[str] = field(default_factory=Counter)
    better: Callable[[Scene, Estimate], None] | None = None

    def scene_of(self, unknowns: Sequence[float]) -> Scene | None:
        """Give the scene of scaled unknowns; None where there is none."""
        values: dict[str, float | str] = {}
        for value, (name, (lo, hi)) in zip(unknowns, self.bounds.items(), strict=True):
            values[name] = _scaled(float(value), lo, hi)
        try:
            return self.scene.with_values(values)
        except SceneError:
            return None

    def rate(self, unknowns: Sequence[float], above: float = 0.0) -> float:
        """Rate a design: its margin, or below 0 how far it is from being one."""
        self.evaluations += 1
        scene = self.scene_of(unknowns)

        def quickly(one: Scene) -> Estimate | None:
            return estimated(one, self.tolerance, self.side, hard=self.hard, above=above)

        rating, found = self.rated(scene, quickly)
        if scene is not None and found is not None:
            if self.better is not None:
                self.better(scene, found)
            self.history.append(Candidate(self._values(scene), found, self.order))
        return rating

    def rated(
        self, scene: Scene | None, estimate: Callable[[Scene], Estimate | None]
    ) -> tuple[float, Estimate | None]:
        """Rate a scene by an estimate of its margin; with the estimate where it feeds, and breaks no assumption."""
        lacking = -30.0 if scene is None else self.lacking(scene)
        if scene is None or lacking < 0.0:
            self.ruled_out[NO_PART if scene is None else NO_WEIGHT] += 1
            return lacking, None
        found = estimate(scene)
        if found is None or not found.margin > 0.0:
            self.ruled_out[LOST if found is None else OTHER_SIDE] += 1
            return (-10.0 if found is None else found.margin - self.strict), None
        lacking = self.broken(scene, found)
        if lacking < 0.0:
            self.ruled_out[LEAVES if validity_slack(scene, found.invariant) >= 0.0 else ASSUMPTION] += 1
            return max(lacking, -1.0) if self.strict else lacking, None
        return found.margin, found

    def lacking(self, scene: Scene) -> float:
        """Rate a part that no lead weight makes: -20 or below; 0 where one does."""
        if not self.lead:
            return 0.0
        weight = counterweight_of(scene)
        lacking = max(weight.share - MOST_LEAD, -weight.inside / float(scene.sides.length.mean()))
        return 0.0 if lacking <= 0.0 else -20.0 - min(9.0, lacking)

    def broken(self, scene: Scene, found: Estimate) -> float:
        """Rate a design outside of the model, or one that loses parts: below 0; 0 or above for any other."""
        spare = validity_slack(scene, found.invariant)
        if self.everywhere:
            spare = min(spare, least_slack(scene.bare_map) / scene.arm_length)
        return max(spare, -9.0)

    def _values(self, scene: Scene) -> dict[str, float]:
        return {name: scene.value(name) for name in self.bounds}

    def drawn(self, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
        """Draw designs evenly, and rate them."""
        unknowns = rng.random((count, len(self.bounds)))
        return unknowns, np.array([self.rate(row) for row in unknowns])

    def harden(self, unknowns: Sequence[float]) -> None:
        """Try a design on all corners at nearly its margin, and keep those at which it fails."""
        scene = self.scene_of(unknowns)
        found = None if scene is None else estimated(scene, self.tolerance, self.side, hard=self.hard)
        if scene is None or found is None or not found.margin > 0.0:
            return
        wrong = failing(scene, self.tolerance, self.side, found, 0.97 * found.margin)
        new = [signs for signs in wrong if signs not in self.hard]
        self.hard[:] = (new[: MOST_HARD // 3] + self.hard)[:MOST_HARD]

    def improved(self, population: Array, evaluations: int, seed: int, tell: Tell) -> tuple[Array, Array]:
        """Move a population for so many evaluations; the population and its ratings, the best first."""
        from scipy.optimize import differential_evolution

        end, step = self.evaluations + max(evaluations, 1), 0
        begin = self.evaluations
        while self.evaluations < end:
            found = differential_evolution(
                lambda unknowns: -self.rate(unknowns),
                [(0.0, 1.0)] * len(self.bounds),
                maxiter=GENERATIONS,
                init=population,
                polish=False,
                tol=0.0,
                seed=seed + step,
                mutation=(0.4, 0.9),
                recombination=0.9,
            )
            step += 1
            order = np.argsort(found.population_energies)
            population, ratings = found.population[order], -found.population_energies[order]
            self.harden(population[0])
            tell("designs", self.evaluations - begin, evaluations)
        return population, ratings


def said(ruled_out: Mapping[str, int]) -> str:
    """Say which conditions ruled designs out, the most frequent first.

    Examples
    --------
    >>> said({LOST: 2, NO_WEIGHT: 5})[:40]
    '5 need more than one lead weight on a pl'
    """
    rows = sorted(ruled_out.items(), key=lambda row: -row[1])
    return "; ".join(f"{count} {words}" for words, count in rows) or "no design was ruled out"


def _scaled(share: float, lo: float, hi: float) -> float:
    """Between two bounds: evenly in the logarithm where both have a sign, else evenly."""
    if lo * hi > 0.0:
        return math.copysign(math.exp(math.log(abs(lo)) + share * math.log(hi / lo)), lo)
    return lo + share * (hi - lo)
