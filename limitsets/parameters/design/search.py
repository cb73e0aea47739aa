"""Global search, by floats, for the part with the largest margin: its bounds, counterweight, and model validity.

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
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from limitsets.base import AnswerError, Progress, SceneError
from limitsets.base.arrays import Array
from limitsets.feeder.geometry import plate_with_points, side_ends
from limitsets.feeder.geometry.polygon import above_side
from limitsets.feeder.scene import Scene, in_units_of, require_rests
from limitsets.feeder.scene.quantities import find
from limitsets.feeder.thrower.assumed_box import assumed
from limitsets.parameters.margins.deviations import Signs, Tolerance
from limitsets.parameters.margins.estimate import (
    Estimate,
    InvariantIntervals,
    estimated,
    failing,
    least_slack,
)
from limitsets.proofs.auditing.assumptions import ASSUMPTIONS
from limitsets.proofs.auditing.judging import Row

# ----------------------------------------------------------------
# The counterweight (lead weight) that gives a plate a wanted centre and radius of gyration: one point mass, if
# any.
#
# With the share f of the whole mass at the point p, and the plate's own centre g and radius of gyration r,
#
#     c = g + f (p - g)        rho^2 = (1 - f) r^2 + f (1 - f) |p - g|^2 = (1 - f) r^2 + (1 - f)/f |c - g|^2
#
# so that f is the positive root of r^2 f^2 + (rho^2 - r^2 + |c - g|^2) f - |c - g|^2.  Source: the paper's parts are
# plates with a lead weight (section 5); docs/model.md.


class Counterweight(NamedTuple):
    """A point mass on a uniform plate.

    Attributes
    ----------
    share : float
        Of the whole mass; below 0 or from 1 on there is no such mass.
    x, y : float
        Where, in the frame of the vertices [length].
    inside : float
        How far inside the plate, least over the sides; below 0 it lies outside [length].
    """

    share: float
    x: float
    y: float
    inside: float


def counterweight_for(
    vertices: Array, centre: tuple[float, float], radius_of_gyration: float
) -> Counterweight:
    """Find the point mass that moves a plate's centre of mass and sets its radius of gyration.

    Parameters
    ----------
    vertices : ndarray, shape (n, 2)
        The plate, counterclockwise [length].
    centre : pair of floats
        Centre of mass of plate and point [length].
    radius_of_gyration : float
        Of both, about that centre [length].

    Returns
    -------
    Counterweight

    Examples
    --------
    >>> square = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    >>> found = counterweight_for(square, (0.4, 0.0), (1 / 3 + 0.16) ** 0.5)  # half of the mass 0.8 off: r^2 = 2/3
    >>> round(found.share, 12), round(found.x, 12), round(found.inside, 12)
    (0.5, 0.8, 0.2)
    """
    plate = plate_with_points(vertices, 1.0)
    g, own = plate.centre, plate.radius_of_gyration**2
    across = (centre[0] - g[0], centre[1] - g[1])
    off = across[0] ** 2 + across[1] ** 2
    half = 0.5 * (radius_of_gyration**2 - own + off)
    share = (math.sqrt(half * half + own * off) - half) / own
    if not share > 0.0:
        return Counterweight(share, *g, -math.inf)
    point = (g[0] + across[0] / share, g[1] + across[1] / share)
    corners = [(float(x), float(y)) for x, y in vertices]
    ends = [side_ends(len(corners), side) for side in range(len(corners))]
    inside = min(above_side(corners[left], corners[right], point, math.sqrt)[1] for left, right in ends)
    return Counterweight(share, *point, float(inside))


def counterweight_of(scene: Scene) -> Counterweight:
    """Find the point mass that makes a scene's part of a uniform plate of its shape.

    Examples
    --------
    >>> import limitsets as ls
    >>> counterweight_of(ls.load("paper-designed")).inside > 0
    True
    """
    return counterweight_for(scene.vertices, scene.centre, scene.radius_of_gyration)


# ----------------------------------------------------------------
# Model validity of a design: the slack of the assumptions that a fast throw would break.
#
# The map goes on where its assumptions fail; there is a stable jog after most of a full turn, for one, that no real
# part would do, because its other corners hit the arm first.  A search finds such places, so it asks the rows of the
# audit's table at the two ends of each stretch, where the numbers are extreme; `limitsets.audit` looks everywhere.


# The left vertex lands first, the throw does not tip the part over, and the vertex that lands presses on the arm.
NAMED = {("landing", "angle"), ("release", "tipping"), ("slip", "press")}
ASKED = [about for about in ASSUMPTIONS if (about.effect, about.what) in NAMED]


def validity_slack(scene: Scene, invariant: InvariantIntervals) -> float:
    """Give what is to spare before an assumption of `ASKED` fails: below 0 one does.

    Parameters
    ----------
    scene : Scene
        The scene.
    invariant : InvariantIntervals
        Where the part is kept.

    Returns
    -------
    float
        Least over the sides, as shares of the exterior angle, of the side's length, and of the throw's impulse.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.parameters.design.search import validity_slack
    >>> from limitsets.parameters.margins.estimate import invariant_intervals
    >>> scene = ls.load("paper-designed")
    >>> validity_slack(scene, invariant_intervals(scene.map, 12.0, 2)) > 0
    True
    """
    params = scene.bare_map
    rows = [Row(about, about.terms(scene, None)) for about in ASKED]
    sizes = {"angle": scene.sides.corner, "length": scene.sides.length, "": np.ones(len(scene.sides))}
    spare = np.inf
    for side, ends in enumerate(np.stack([invariant.lo, invariant.hi], axis=1)):
        if np.isfinite(ends).all():
            numbers = assumed(params, params, side, ends, ends)
            shares = [row.spare(numbers, side).min() / sizes[row.about.dimension][side] for row in rows]
            spare = min(spare, *shares)
    # an unknown number cannot be relied on
    return float(spare) if np.isfinite(spare) else -9.0


# ----------------------------------------------------------------
# Bounds of what a search for designs varies: those given, else usual ones that hold the scene's own value.


Ends = tuple[float | None, float | None]
"""Lowest and highest [scene's units]; None for the usual one."""

USUAL: dict[str, tuple[float, float]] = {
    "part.mass.center.along": (0.05, 0.95),
    "part.mass.center.above": (0.05, 0.6),
    "part.mass.radius_of_gyration": (0.12, 0.4),
    "throw.kappa": (2.2, 8.0),
    "arm.surface_height": (-0.2, -0.005),
}
"""Between what these are sought, in mean side lengths (along: of its side); the speed follows from kappa."""
POINT = ("x", "y", "mass")


def bounds_of(
    scene: Scene, vary: Sequence[str] | None = None, given: Mapping[str, Ends] | None = None
) -> dict[str, tuple[float, float]]:
    """Give the bounds of what is varied [scene's units].

    Parameters
    ----------
    scene : Scene
        The scene.
    vary : sequence of str, optional
        Quantities; default those of `given`, else what the scene gives of the mass, the throw and the surface's height.
    given : mapping of str to (float or None, float or None), optional
        Bounds of some of them.

    Raises
    ------
    AnswerError
        Between two bounds there is nothing.

    Examples
    --------
    >>> import limitsets as ls
    >>> bounds_of(ls.load("paper-designed"), given={"throw.speed": (None, 3.0), "arm.length": (20.0, None)})
    {'throw.speed': (2.120469229098313, 3.0), 'arm.length': (20.0, 42.0)}
    """
    given = dict(given or {})
    bounds = {}
    for name in dict.fromkeys([*(vary or ([] if given else _usual(scene))), *given]):
        lo, hi = (
            own if end is None else float(end)
            for own, end in zip(_own(scene, name), given.get(name, (None, None)), strict=True)
        )
        if not lo < hi:
            raise AnswerError(
                "the bounds", f"{lo:g} to {hi:g}", "a lower and a higher one", "give both", key=name
            )
        bounds[name] = lo, hi
    return bounds


def of_the_arm(scene: Scene) -> list[str]:
    """Name what is changed without another part: the throw, as the scene gives it, and the surface's height."""
    return ["throw.speed" if "speed" in scene.text["throw"] else "throw.kappa", "arm.surface_height"]


def _usual(scene: Scene) -> list[str]:
    mass: Mapping[str, Any] = scene.text["part"]["mass"]
    words: tuple[str, ...] = ("center.along", "center.above", "radius_of_gyration")
    if "center" not in mass:
        words = tuple(f"points[{k}].{word}" for k in range(len(mass.get("points", ()))) for word in POINT)
    return [*(f"part.mass.{word}" for word in words), *of_the_arm(scene)]


def _own(scene: Scene, name: str) -> tuple[float, float]:
    """Give bounds of one quantity that contain its value; outside the usual ones a throw may have half or twice it."""
    dimension, value = find(name).dimension, scene.value(name)
    corners, size = scene.vertices, float(scene.sides.length.mean())
    half, twice = sorted((0.5 * value, 2.0 * value))
    if name == "throw.kappa" or (name == "throw.speed" and scene.gravity is not None):
        lo, hi = (end * size for end in USUAL["throw.kappa"])
        if name == "throw.speed" and scene.gravity is not None:
            lo, hi = math.sqrt(scene.gravity / hi), math.sqrt(scene.gravity / lo)
        return lo if lo <= value else half, hi if value <= hi else twice
    if name in USUAL:
        on = int(scene.text["part"]["mass"].get("center", {}).get("side", 0))
        own = float(scene.sides.length[on]) if name.endswith("along") else size
        lo, hi = (end * own for end in USUAL[name])
        return min(lo, value), max(hi, value)
    if name.startswith("part.mass.points") and name[-1] in "xy":
        axis = "xy".index(name[-1])
        return float(corners[:, axis].min()), float(corners[:, axis].max())
    if name.startswith("part.vertices"):
        return value - 0.2 * size, value + 0.2 * size
    if name == "arm.length":
        return value, 1.5 * value
    if dimension == "angle":
        return 0.5 * value, max(value, min(1.5 * value, math.pi / 2))
    return (0.7 * value, 1.4 * value) if name.startswith("part.sides") else (half, twice)


# ----------------------------------------------------------------
# Global search, by floats, for the part with the largest margin.


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


@dataclass(frozen=True, eq=False)
class Candidate:
    """A design that was tried, and is fed somewhere.

    Attributes
    ----------
    values : dict of str to float
        What was varied [scene's units].
    estimate : Estimate
        Its margin by floats.
    order : int
        Which of the scenes that the search began with: another order of the sides.
    """

    values: dict[str, float]
    estimate: Estimate
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
        ends = zip(unknowns, self.bounds.items(), strict=True)
        return scene_with(self.scene, {name: _scaled(float(share), *pair) for share, (name, pair) in ends})

    def rounded(self, scene: Scene, decimals: int) -> Scene:
        """Write what is varied with few decimals."""
        return in_units_of(scene, self.scene, self.bounds, decimals)

    def rate(self, unknowns: Sequence[float], above: float = 0.0) -> float:
        """Rate a design: its margin, or below 0 how far it is from being one."""
        self.evaluations += 1
        scene = self.scene_of(unknowns)
        quickly = partial(estimated, tolerance=self.tolerance, side=self.side, hard=self.hard, above=above)
        rating, estimate = self.rated(scene, quickly)
        if scene is not None and estimate is not None:
            if self.better is not None:
                self.better(scene, estimate)
            values = {name: scene.value(name) for name in self.bounds}
            self.history.append(Candidate(values, estimate, self.order))
        return rating

    def rated(
        self, scene: Scene | None, estimate: Callable[[Scene], Estimate | None]
    ) -> tuple[float, Estimate | None]:
        """Rate a scene by an estimate of its margin; with the estimate where it feeds, and breaks no assumption."""
        lacking = -30.0 if scene is None else self.lacking(scene)
        if scene is None or lacking < 0.0:
            self.ruled_out[NO_PART if scene is None else NO_WEIGHT] += 1
            return lacking, None
        estimated_margin = estimate(scene)
        if estimated_margin is None or not estimated_margin.margin > 0.0:
            self.ruled_out[LOST if estimated_margin is None else OTHER_SIDE] += 1
            return (-10.0 if estimated_margin is None else estimated_margin.margin - self.strict), None
        valid = validity_slack(scene, estimated_margin.invariant)
        stays = least_slack(scene.bare_map) / scene.arm_length if self.everywhere else valid
        broken = max(min(valid, stays), -9.0)
        if broken < 0.0:
            self.ruled_out[LEAVES if valid >= 0.0 else ASSUMPTION] += 1
            return max(broken, -1.0) if self.strict else broken, None
        return estimated_margin.margin, estimated_margin

    def lacking(self, scene: Scene) -> float:
        """Rate a part that no lead weight makes: -20 or below; 0 where one does."""
        if not self.lead:
            return 0.0
        weight = counterweight_of(scene)
        lacking = max(weight.share - MOST_LEAD, -weight.inside / float(scene.sides.length.mean()))
        return 0.0 if lacking <= 0.0 else -20.0 - min(9.0, lacking)

    def drawn(self, rng: np.random.Generator, count: int) -> tuple[Array, Array]:
        """Draw designs evenly, and rate them."""
        unknowns = rng.random((count, len(self.bounds)))
        return unknowns, np.array([self.rate(row) for row in unknowns])

    def harden(self, unknowns: Sequence[float]) -> None:
        """Try a design on all corners at nearly its margin, and keep those at which it fails."""
        scene = self.scene_of(unknowns)
        estimate = None if scene is None else estimated(scene, self.tolerance, self.side, hard=self.hard)
        if scene is None or estimate is None or not estimate.margin > 0.0:
            return
        wrong = failing(scene, self.tolerance, self.side, estimate, 0.97 * estimate.margin)
        new = [signs for signs in wrong if signs not in self.hard]
        self.hard[:] = (new[: MOST_HARD // 3] + self.hard)[:MOST_HARD]

    def improved(self, population: Array, evaluations: int, seed: int, tell: Progress) -> tuple[Array, Array]:
        """Move a population for so many evaluations; the population and its ratings, the best first."""
        from scipy.optimize import differential_evolution

        begin, step = self.evaluations, 0
        while self.evaluations < begin + max(evaluations, 1):
            evolution = differential_evolution(
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
            order = np.argsort(evolution.population_energies)
            population, ratings = evolution.population[order], -evolution.population_energies[order]
            self.harden(population[0])
            tell("designs", self.evaluations - begin, evaluations)
        return population, ratings


def require_searchable(scene: Scene, evaluations: int) -> None:
    """Refuse a part that does not rest, a scene with effects, and a search that looks at nothing."""
    require_rests(scene)
    if scene.effects.on():
        raise AnswerError("the scene", "with effects on", "the minimal model", "switch its effects off")
    if evaluations < 1:
        raise AnswerError("the evaluations", evaluations, "1 or more", "allow for some designs")


def design_name(start: Scene) -> str:
    """Name the design that began at a scene."""
    return start.name if start.name.endswith("-design") else f"{start.name}-design"


def said(ruled_out: Mapping[str, int]) -> str:
    """Say which conditions ruled designs out, the most frequent first.

    Examples
    --------
    >>> said({LOST: 2, NO_WEIGHT: 5})[:40]
    '5 need more than one lead weight on a pl'
    """
    rows = sorted(ruled_out.items(), key=lambda row: -row[1])
    return "; ".join(f"{count} {words}" for words, count in rows) or "no design was ruled out"


def scene_with(scene: Scene, values: dict[str, float]) -> Scene | None:
    """Give a scene with other values; None where there is none."""
    try:
        return scene.with_values(dict(values))
    except SceneError:
        return None


def _scaled(share: float, lo: float, hi: float) -> float:
    """Between two bounds: evenly in the logarithm where both have a sign, else evenly."""
    if lo * hi > 0.0:
        return math.copysign(math.exp(math.log(abs(lo)) + share * math.log(hi / lo)), lo)
    return lo + share * (hi - lo)
