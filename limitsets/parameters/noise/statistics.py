"""Statistics of a scene with noise: the chain solved at one level, densities, throws to the goal, sensitivities."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
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
    how_found,
    picked,
    shown_in_notebooks,
    silent,
)
from limitsets.base.arrays import Array, Mask
from limitsets.feeder.goals import OrientedBeyond, Reaches
from limitsets.feeder.scattering import (
    Scattering,
    Strata,
    kappa_strata,
    scattering_of,
    starts_from,
    still_map,
    thrown,
)
from limitsets.feeder.scene import Scene, load
from limitsets.parameters.noise.absorbing import (
    Absorption,
    Feeding,
    NoisyClass,
    absorption,
    cells_for_noise,
    classes,
    feeding,
    random_starts,
    with_border,
)
from limitsets.parameters.noise.brackets import brackets_beside
from limitsets.parameters.noise.cell_images import InterpolatedPieces, uses_pieces
from limitsets.parameters.noise.ulam import STRATA, Transfer, transfer
from limitsets.systems.cells import Grid

# ----------------------------------------------------------------
# Solution of the chain of a scene at one level of the noise: numbers, errors, and sensitivities to the level.


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
    starts: Array
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
    settles = {
        name: float(starts @ chances) for name, chances in settling.probability.items() if name != "goal"
    }
    ends = absorption(chain, goal)
    fed = feeding(chain, ends, starts)
    first = absorption(chain, goal, other=beyond & ~goal).probability["other"]
    numbers = _long_run(parts, settles, beyond, goal) | {
        "fed": fed.share,
        "mean throws": math.nan if fed.mean is None else fed.mean,
        "95 % throws": fed.crossing(0.95),
        "lost": sum(fed.ends[name] for name in chain.exits),
        "first beyond is wrong": float(starts @ first),
    }
    return ChainSolution(
        grid=cover, cut=chain.cut, classes=parts, settles=settles, ends=ends, feeding=fed, numbers=numbers
    )


def _long_run(
    parts: Sequence[NoisyClass],
    settles: dict[str, float],
    beyond: Mask,
    goal: Mask,
) -> dict[str, float]:
    if not parts:
        return {}
    # Classes come with those first that are not left, or least: they bear the numbers in `settles`.
    kept = range(sum(part.escape < KEPT for part in parts))
    most = max(kept, key=lambda number: settles[f"class {number}"], default=None)
    main = min(parts, key=lambda part: part.escape) if most is None else parts[most]
    far, wrong = float(main.weight[beyond].sum()), float(main.weight[beyond & ~goal].sum())
    numbers = {f"time on side {side}": share for side, share in main.sides.items()}
    numbers |= {f"share of {name}": share for name, share in main.branches.items()}
    numbers |= {"time beyond": far, "wrong beyond": wrong / far if far > 0.0 else math.nan}
    numbers["escape"] = main.escape
    return numbers


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
    slopes = {}
    for key, value in narrow.items():
        unsure = abs(value - wide.get(key, math.nan)) + abs(value - coarse.get(key, math.nan))
        slopes[key] = LevelSensitivity((4.0 * value - wide.get(key, math.nan)) / 3.0, unsure)
    return slopes


def _differences(problem: ChainProblem, noise: Scattering, name: str, step: float) -> dict[str, float]:
    above = solve(problem, noise.scaled(1.0 + step, name)).numbers
    below = solve(problem, noise.scaled(1.0 - step, name)).numbers
    return {key: (above[key] - below[key]) / (2.0 * step) for key in above if key in below}


# ----------------------------------------------------------------
# Statistics of a scene with noise: stationary densities, throws to the goal, sensitivity to the noise level.


CELLS = 1024

# Levels of the noise.
FACTORS = (0.0, 0.5, 1.0, 1.5, 2.0)

# What the derivatives by one quantity take: four solutions on all cells, two on half as many.
OF_SLOPES = 5.0


@dataclass(frozen=True, eq=False, kw_only=True)
class NoiseStatistics(ChainSolution, Tabled):
    """Answers about a noisy scene from the transfer operator, approximations between cells; brackets where asked for.

    Attributes
    ----------
    scene : str
        Name of the scene.
    unit : str
        Unit of lengths.
    scatter : Scattering
        The noise.
    goal : (float, int)
        A part at rest at x or beyond, on this side, is fed [length].
    starts : ndarray, shape (n_sides,)
        Random starts lie from here to x of the goal, equally likely per length on all sides [length].
    grid : Grid
        The cells.
    strata : int
        Into how many pieces each law was cut.
    cut : float
        Probability of noise beyond where laws without bounds were cut off, per throw.
    classes : tuple of NoisyClass
        Closed classes, then those left at a small rate.
    settles : dict of str to float
        Without a goal: share of the random starts that end in each class left at less than 1e-6 per throw ("class 0"
        is `classes[0]`), and by each way out.
    ends : Absorption
        With the goal: where each cell ends, and after how many throws.
    feeding : Feeding
        Throws from random starts to the goal.
    numbers : dict of str to float
        The answers in numbers, nan where there is none; see the notes.
    errors : dict of str to float
        How much each changes from half as many cells and from half as many strata: an estimate of the error, on the
        safe side as long as it falls with their width; empty where there was no time for it.
    sensitivity : dict of str to dict of str to LevelSensitivity
        By quantity, then by number; without the quantities that there was no time for.
    proved : dict of str to (float, float)
        Proved brackets, by number; empty where they were not asked for.
    how : str
        "sampled".

    Notes
    -----
    Of the class that most random starts settle in (or, where they stay in none, of the one left most slowly):
    "time on side k", "share of" each branch, "time beyond" (share of rests beyond x of the goal, on any side),
    "wrong beyond" (of these, the share on another side), "escape" (per throw).  Of random starts: "fed" (share that
    comes to the goal), "mean throws" of those, "95 % throws" of all, "first beyond is wrong" (the first rest beyond
    x is on another side), "lost" (leave the arm without having been fed).
    """

    scene: str
    unit: str
    scatter: Scattering
    goal: tuple[float, int]
    starts: Array
    strata: int
    errors: dict[str, float]
    sensitivity: dict[str, dict[str, LevelSensitivity]]
    proved: dict[str, tuple[float, float]]
    how: str = "sampled"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows: list[tuple[Any, ...]] = [
            (name, each, self.errors.get(name)) for name, each in self.numbers.items()
        ]
        columns: list[str | Column] = [
            "of the noise",
            Column("value", show=".6g"),
            Column("change on halving", show=".1e"),
        ]
        said = how_found(self.how)
        if self.proved:
            rows = [(*row, self.proved.get(row[0])) for row in rows]
            columns.append(Column("proved", show=".6f", ends=True))
            said += "; brackets are proved: of time and shares from every start in attracting cells, almost surely"
        return (Table(tuple(columns), rows, f"{self.scene}: under noise", said),)

    def to_json(self) -> dict[str, Any]:
        """Give the answers as JSON takes them: null, never nan."""
        return as_table(
            **picked(self, "scene", "unit", "how"),
            scatter=self.scatter.words(),
            noise_cut_off=self.cut,
            goal={"x": self.goal[0], "side": self.goal[1]},
            starts_from=self.starts,
            cells=self.grid.n_cells,
            **picked(self, "strata", "classes", "settles"),
            ends=self.feeding.ends,
            arrived=self.feeding.arrived,
            numbers={
                name: {"value": value, "error": self.errors.get(name), "proved": self.proved.get(name)}
                for name, value in self.numbers.items()
            },
            sensitivity=self.sensitivity,
        )


@dataclass(frozen=True, eq=False)
class Levels:
    """Numbers of `NoiseStatistics` at several levels of the noise.

    Attributes
    ----------
    factors : ndarray, shape (n,)
        Factor on all deviations.
    numbers : dict of str to ndarray, shape (n,)
        By name.
    """

    factors: Array
    numbers: dict[str, Array]


@shown_in_notebooks
@arguments_checked
def noise_statistics(
    scene: Scene | str,
    scatter: Scattering | None = None,
    *,
    goal: Any = None,
    cells: int = CELLS,
    strata: int = STRATA,
    offset: float | None = None,
    sensitivity: bool = True,
    brackets: int | None = None,
    seconds: float = math.inf,
    progress: Progress | None = None,
) -> NoiseStatistics:
    """Find what noise makes of a scene, by the transfer operator.

    Parameters
    ----------
    scene : Scene or str
        A scene, or the name of one.
    scatter : Scattering, optional
        The noise; by default that of the scene, `[world] scatter` with `[effects] spread`.
    goal : (float, int), OrientedBeyond or Reaches, optional
        x and side of the rests that count as fed; by default those of the scene's goal.
    cells : int
        Cells per side.
    strata : int
        Into how many pieces each law is cut.
    offset : float, optional
        How far beyond a_i random starts begin; by default a twentieth of the arm [length].
    sensitivity : bool
        Compute the derivatives with respect to the noise of each quantity: six more solutions for each.
    brackets : int, optional
        Cells per side for proved brackets of the numbers, of noise with uniform or normal laws in the minimal model:
        a minute for 600, several for 4000.
    seconds : float
        Errors, then the derivatives by each quantity, are begun only if they are likely to be done by then; the first
        solution takes what it takes.
    progress : callable, optional
        Told (stage, done, all).

    Returns
    -------
    NoiseStatistics

    Raises
    ------
    AnswerError
        For a goal that is none on this arm, or brackets of noise of which nothing is proved.
    SceneError
        For a scene without noise where none is passed, or noise that it cannot have.

    Examples
    --------
    >>> import limitsets as ls
    >>> from limitsets.robust import Gaussian, Scattering
    >>> noise = Scattering(speed=Gaussian(0.01), landing=Gaussian(0.05))
    >>> found = ls.noise_statistics("paper-designed", noise, goal=(20.5, 2), cells=512, sensitivity=False)
    >>> round(found.numbers["mean throws"], 1), round(float(found.feeding.survivors[40]), 2)
    (23.2, 0.2)
    """
    problem = chain_problem_of(scene, goal, cells, strata, offset)
    noise = scattering_of(problem.scene) if scatter is None else scatter
    names = noise.given() if sensitivity else ()
    stages = 3 + 6 * len(names)
    tell = progress or silent
    begin = time.perf_counter()
    tell("noise", 0, stages)
    solution = solve(problem, noise)
    once, end = time.perf_counter() - begin, begin + seconds
    tell("noise", 1, stages)
    errors = errors_of(problem, noise, solution.numbers) if time.perf_counter() + once <= end else {}
    slopes = {}
    for number, name in enumerate(names):
        if time.perf_counter() + OF_SLOPES * once > end:
            break
        tell("noise", 3 + 6 * number, stages)
        slopes[name] = slopes_of(problem, noise, name)
    tell("noise", stages, stages)
    return NoiseStatistics(
        **vars(solution),
        **picked(problem, "goal", "starts", "strata"),
        **picked(problem.scene, "unit"),
        scene=problem.scene.name,
        scatter=noise,
        errors=errors,
        sensitivity=slopes,
        proved={}
        if brackets is None
        else brackets_beside(problem.scene, noise, problem.goal, problem.starts, brackets, tell),
    )


def noise_levels(
    scene: Scene | str,
    scatter: Scattering | None = None,
    *,
    factors: Sequence[float] = FACTORS,
    goal: Any = None,
    cells: int = CELLS,
    strata: int = STRATA,
    offset: float | None = None,
    seconds: float = math.inf,
) -> Levels:
    """Find the numbers of `noise_statistics` at several levels of the noise; parameters as there.

    Parameters
    ----------
    factors : sequence of float
        Factors on all deviations; 0 is the throw without noise.
    seconds : float
        None but the first is begun for which less is left than the dearest before took.
    """
    end, dearest = time.perf_counter() + seconds, 0.0
    problem = chain_problem_of(scene, goal, cells, strata, offset)
    noise = scattering_of(problem.scene) if scatter is None else scatter
    rows: list[dict[str, float]] = []
    for factor in factors:
        begin = time.perf_counter()
        if rows and begin + dearest > end:
            break
        rows.append(solve(problem, noise.scaled(float(factor))).numbers)
        dearest = max(dearest, time.perf_counter() - begin)
    names = {name: None for row in rows for name in row}
    table = {name: np.array([row.get(name, math.nan) for row in rows]) for name in names}
    return Levels(np.array(factors[: len(rows)], dtype=np.float64), table)
