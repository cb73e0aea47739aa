"""Solution of the chain of a scene at one level of the noise: numbers, errors, and sensitivities to the level."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid
from limitsets.errors import AnswerError
from limitsets.goals import OrientedBeyond, Reaches
from limitsets.robust.noise.absorbing import Absorption, absorption
from limitsets.robust.noise.arrivals import Feeding, cells_for_noise, feeding, random_starts, with_border
from limitsets.robust.noise.cell_images import uses_pieces
from limitsets.robust.noise.communicating_classes import NoisyClass, classes
from limitsets.robust.noise.interpolated_pieces import InterpolatedPieces
from limitsets.robust.noise.laws import Strata
from limitsets.robust.noise.scattering import Scattering, kappa_strata, still_map, thrown
from limitsets.robust.noise.ulam import STRATA, Transfer, transfer

if TYPE_CHECKING:
    from limitsets.scene import Scene

# Random starts begin this share of the arm beyond a_i: nearer to it the number of throws has no bound.
BEYOND_FOOT = 0.05
# Relative change of the noise for derivatives, and half of it.
STEP = 0.1
WIDER = 1.25
# Escapes per throw below which a class counts as one that parts settle in.
KEPT = 1e-6


@dataclass(frozen=True)
class LevelSensitivity:
    """Change of a number with the level of the noise of one quantity.

    Attributes
    ----------
    slope : float
        Derivative with respect to the logarithm of the level: about 100 times the change for 1 % more noise.
    error : float
        How far central differences over two steps disagree, and how far those on half as many cells, added up.
    """

    slope: float
    error: float


@dataclass(frozen=True, eq=False)
class ChainProblem:
    """The problem on one grid and at one level of noise."""

    scene: Scene
    goal: tuple[float, int]
    starts: NDArray[np.float64]
    cells: int
    strata: int
    # By range of the factor on kappa: found once, used at every solution.
    cutters: dict[tuple[float, float], InterpolatedPieces] = field(default_factory=dict)

    def cutter(self, factors: Strata) -> InterpolatedPieces | None:
        """Where the sides are cut; None for a map without pieces."""
        params = still_map(self.scene)
        if not uses_pieces(params):
            return None
        key = (float(factors.mean.min()), float(factors.mean.max()))
        for (lo, hi), known in self.cutters.items():
            if lo <= key[0] and key[1] <= hi:
                return known
        # A little wider than asked, for the same law cut otherwise or scaled up for a derivative.
        lo, hi = (1.0 + (end - 1.0) * WIDER for end in key)
        values = np.linspace(lo, hi, 2 * STRATA if hi > lo else 1)
        self.cutters[lo, hi] = InterpolatedPieces(thrown(params), self.scene.domain, values)
        return self.cutters[lo, hi]

    def chain(self, cover: Grid, scatter: Scattering) -> Transfer:
        """Build the transfer operator on some cells."""
        factors = kappa_strata(scatter, self.scene, self.strata)
        return transfer(
            thrown(still_map(self.scene)),
            cover,
            parameter=factors,
            landing=scatter.landing,
            strata=self.strata,
            cutter=self.cutter(factors),
        )


@dataclass(frozen=True, eq=False)
class ChainSolution:
    """All that was read off the operator at one level of the noise; `NoiseStatistics` says what the fields are."""

    grid: Grid
    cut: float
    classes: tuple[NoisyClass, ...]
    settles: dict[str, float]
    ends: Absorption
    feeding: Feeding
    numbers: dict[str, float]


def solve(problem: ChainProblem, scatter: Scattering) -> ChainSolution:
    """Solve at one level of the noise, without errors and derivatives."""
    scene, (x, side) = problem.scene, problem.goal
    cover = with_border(cells_for_noise(scene.domain, problem.cells), x)
    chain = problem.chain(cover, scatter)
    beyond = np.concatenate([cover.centres(k) > x for k in range(cover.sides)])
    goal = beyond & (cover.side_of(np.arange(cover.n_cells)) == side)
    starts = random_starts(cover, problem.starts, x)
    parts = classes(chain)
    kept = [np.flatnonzero(part.cells.mask) for part in parts if part.escape < KEPT]
    settling = absorption(chain, np.zeros(cover.n_cells, dtype=bool), classes=kept)
    settles = {name: float(starts @ found) for name, found in settling.probability.items() if name != "goal"}
    ends = absorption(chain, goal)
    fed = feeding(chain, ends, starts)
    first = absorption(chain, goal, other=beyond & ~goal).probability["other"]
    numbers = {**_long_run(chain, parts, settles, beyond, goal), **_from_starts(chain, fed)}
    numbers["first beyond is wrong"] = float(starts @ first)
    return ChainSolution(cover, chain.cut, parts, settles, ends, fed, numbers)


def _main(parts: Sequence[NoisyClass], settles: dict[str, float]) -> NoisyClass | None:
    # Classes come with those first that are not left, or least: they bear the numbers in `settles`.
    kept = sum(part.escape < KEPT for part in parts)
    if kept:
        return parts[max(range(kept), key=lambda number: settles[f"class {number}"])]
    return min(parts, key=lambda part: part.escape, default=None)


def _long_run(
    chain: Transfer,
    parts: Sequence[NoisyClass],
    settles: dict[str, float],
    beyond: NDArray[np.bool_],
    goal: NDArray[np.bool_],
) -> dict[str, float]:
    main = _main(parts, settles)
    if main is None:
        return {}
    far, wrong = float(main.weight[beyond].sum()), float(main.weight[beyond & ~goal].sum())
    numbers = {f"time on side {side}": share for side, share in main.sides.items()}
    numbers |= {f"share of {name}": share for name, share in main.branches.items()}
    numbers |= {"time beyond": far, "wrong beyond": wrong / far if far > 0.0 else math.nan}
    numbers["escape"] = main.escape
    return numbers


def _from_starts(chain: Transfer, fed: Feeding) -> dict[str, float]:
    return {
        "fed": fed.share,
        "mean throws": math.nan if fed.mean is None else fed.mean,
        "95 % throws": fed.crossing(0.95),
        "lost": sum(fed.ends[name] for name in chain.exits),
    }


def starts_from(scene: Scene, offset: float | None = None) -> NDArray[np.float64]:
    """Where random starts begin on each side: `offset` beyond a_i, a twentieth of the arm unless given [length]."""
    return scene.sides.a + (BEYOND_FOOT * scene.arm_length if offset is None else offset)


def _goal_of(scene: Scene, goal: Any) -> tuple[float, int]:
    target = scene.goal if goal is None else goal
    if isinstance(target, OrientedBeyond | Reaches):
        target = (target.x, target.side)
    if isinstance(target, tuple) and len(target) == 2:
        x, side = float(target[0]), int(target[1])
        if 0.0 < x < scene.arm_length and side in range(len(scene.sides)):
            return x, side
    allowed = "(x, side) on the arm, OrientedBeyond or Reaches"
    raise AnswerError("the goal of the noise", target, allowed, "pass goal=(20.0, 2)")


def chain_problem_of(
    scene: Scene | str, goal: Any, cells: int, strata: int, offset: float | None
) -> ChainProblem:
    """Read what is asked."""
    from limitsets.scene import load

    read = load(scene)
    return ChainProblem(read, _goal_of(read, goal), starts_from(read, offset), cells, strata)


def _half_cells(asked: ChainProblem) -> ChainProblem:
    return replace(asked, cells=max(asked.cells // 2, 1))


def errors_of(problem: ChainProblem, noise: Scattering, numbers: dict[str, float]) -> dict[str, float]:
    """How much the numbers change from half as many cells, and from half as many strata, added up."""
    total = dict.fromkeys(numbers, 0.0)
    for coarse in (_half_cells(problem), replace(problem, strata=max(problem.strata // 2, 1))):
        check = solve(coarse, noise).numbers
        total = {key: total[key] + abs(value - check.get(key, math.nan)) for key, value in numbers.items()}
    return total


def slopes_of(problem: ChainProblem, noise: Scattering, name: str) -> dict[str, LevelSensitivity]:
    """Take central differences over two steps and extrapolate; once more on half as many cells, for the error."""
    wide = _differences(problem, noise, name, STEP)
    narrow = _differences(problem, noise, name, 0.5 * STEP)
    coarse = _differences(_half_cells(problem), noise, name, 0.5 * STEP)
    found = {}
    for key, value in narrow.items():
        unsure = abs(value - wide.get(key, math.nan)) + abs(value - coarse.get(key, math.nan))
        found[key] = LevelSensitivity((4.0 * value - wide.get(key, math.nan)) / 3.0, unsure)
    return found


def _differences(problem: ChainProblem, noise: Scattering, name: str, step: float) -> dict[str, float]:
    above = solve(problem, noise.scaled(1.0 + step, name)).numbers
    below = solve(problem, noise.scaled(1.0 - step, name)).numbers
    return {key: (above[key] - below[key]) / (2.0 * step) for key in above if key in below}
