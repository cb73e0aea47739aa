"""Statistics of a scene with noise: stationary densities, throws to the goal, sensitivity to the noise level."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.arguments import arguments_checked
from limitsets.files import as_table, picked
from limitsets.progress import shown_in_notebooks
from limitsets.robust.noise.chain_solution import (
    ChainSolution,
    LevelSensitivity,
    chain_problem_of,
    errors_of,
    slopes_of,
    solve,
)
from limitsets.robust.noise.scattering import Scattering, scattering_of
from limitsets.robust.noise.ulam import STRATA
from limitsets.tables import Column, Table, Tabled, how_found

if TYPE_CHECKING:
    from limitsets.scene import Scene

CELLS = 1024

# Levels of the noise.
FACTORS = (0.0, 0.5, 1.0, 1.5, 2.0)

# What the derivatives by one quantity take: four solutions on all cells, two on half as many.
OF_SLOPES = 5.0

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False, kw_only=True)
class NoiseStatistics(ChainSolution, Tabled):
    """Answers about a noisy scene from the transfer operator; approximations between cells, not proved.

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
    starts: NDArray[np.float64]
    strata: int
    errors: dict[str, float]
    sensitivity: dict[str, dict[str, LevelSensitivity]]
    how: str = "sampled"

    def tables(self) -> tuple[Table, ...]:
        """Give the tables that show it, the one that is saved as CSV first."""
        rows = [(name, value, self.errors.get(name)) for name, value in self.numbers.items()]
        columns = ("of the noise", Column("value", show=".6g"), Column("change on halving", show=".1e"))
        return (Table(columns, rows, f"{self.scene}: under noise", how_found(self.how)),)

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
                name: {"value": value, "error": self.errors.get(name)} for name, value in self.numbers.items()
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

    factors: NDArray[np.float64]
    numbers: dict[str, NDArray[np.float64]]


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
        For a goal that is none on this arm.
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
    tell = progress or (lambda stage, done, total: None)
    begin = time.perf_counter()
    tell("noise", 0, stages)
    found = solve(problem, noise)
    once, end = time.perf_counter() - begin, begin + seconds
    tell("noise", 1, stages)
    errors = errors_of(problem, noise, found.numbers) if time.perf_counter() + once <= end else {}
    slopes = {}
    for number, name in enumerate(names):
        if time.perf_counter() + OF_SLOPES * once > end:
            break
        tell("noise", 3 + 6 * number, stages)
        slopes[name] = slopes_of(problem, noise, name)
    tell("noise", stages, stages)
    return NoiseStatistics(
        **vars(found),
        **picked(problem, "goal", "starts", "strata"),
        **picked(problem.scene, "unit"),
        scene=problem.scene.name,
        scatter=noise,
        errors=errors,
        sensitivity=slopes,
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
