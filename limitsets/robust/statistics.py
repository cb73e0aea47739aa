"""What noise makes of a scene: where it settles, how a goal is reached, and what more or less noise changes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from limitsets.cells import Grid, grid
from limitsets.errors import AnswerError
from limitsets.goals import OrientedBeyond, Reaches
from limitsets.robust.absorbing import Absorption, absorption
from limitsets.robust.arrivals import Feeding, feeding, random_starts, with_border
from limitsets.robust.casting import uses_pieces
from limitsets.robust.cutting import Cutter
from limitsets.robust.laws import Strata
from limitsets.robust.scattering import Scattering, kappa_strata, scattering_of, still_map, thrown
from limitsets.robust.settling import NoisyClass, classes
from limitsets.robust.ulam import STRATA, Transfer, transfer

if TYPE_CHECKING:
    from limitsets.scene import Scene

__all__ = ["Levels", "NoiseStatistics", "Sensitivity", "noise_levels", "noise_statistics", "starts_from"]

CELLS = 1024
# Random starts begin this share of the arm beyond a_i: nearer to it the number of throws has no bound.
BEYOND_FOOT = 0.05
# Relative change of the noise for derivatives, and half of it.
STEP = 0.1
WIDER = 1.25

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Sensitivity:
    """Change of a number with the level of the noise of one quantity.

    Attributes
    ----------
    slope : float
        Derivative with respect to the logarithm of the level: about 100 times the change for 1 % more noise.
    error : float
        How far central differences over two steps disagree.
    """

    slope: float
    error: float


@dataclass(frozen=True, eq=False)
class NoiseStatistics:
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
        A part at rest at x or beyond, on this side, is fed [unit].
    starts : ndarray, shape (n_sides,)
        Random starts lie from here to x of the goal, equally likely per length on all sides [unit].
    grid : Grid
        The cells.
    strata : int
        Into how many pieces each law was cut.
    cut : float
        Probability of noise beyond where laws without bounds were cut off, per throw.
    classes : tuple of NoisyClass
        Closed classes, then those left at a small rate.
    settles : dict of str to float
        Without a goal: share of the random starts that end in each closed class, and by each way out.
    ends : Absorption
        With the goal: where each cell ends, and after how many throws.
    feeding : Feeding
        Throws from random starts to the goal.
    numbers : dict of str to float
        The answers in numbers, nan where there is none; see the notes.
    errors : dict of str to float
        How much each changes from half as many cells and from half as many strata: an estimate of the error, on the
        safe side as long as it falls with their width.
    sensitivity : dict of str to dict of str to Sensitivity
        By quantity, then by number.
    how : str
        "sampled".

    Notes
    -----
    Of the class that most random starts settle in (or, where none is closed, of the one left most slowly):
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
    grid: Grid
    strata: int
    cut: float
    classes: tuple[NoisyClass, ...]
    settles: dict[str, float]
    ends: Absorption
    feeding: Feeding
    numbers: dict[str, float]
    errors: dict[str, float]
    sensitivity: dict[str, dict[str, Sensitivity]]
    how: str = "sampled"

    def to_json(self) -> dict[str, Any]:
        """Give the answers as JSON takes them: null, never nan."""
        return {
            "scene": self.scene,
            "unit": self.unit,
            "how": self.how,
            "scatter": self.scatter.words(),
            "noise_cut_off": self.cut,
            "goal": {"x": self.goal[0], "side": self.goal[1]},
            "starts_from": self.starts.tolist(),
            "cells": self.grid.n_cells,
            "strata": self.strata,
            "classes": [_class_as_json(part) for part in self.classes],
            "settles": {name: _number(value) for name, value in self.settles.items()},
            "ends": {name: _number(value) for name, value in self.feeding.ends.items()},
            "arrived": self.feeding.arrived.tolist(),
            "numbers": {
                name: {"value": _number(value), "error": _number(self.errors.get(name))}
                for name, value in self.numbers.items()
            },
            "sensitivity": {
                quantity: {
                    name: {"slope": _number(found.slope), "error": _number(found.error)}
                    for name, found in rows.items()
                }
                for quantity, rows in self.sensitivity.items()
            },
        }


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


def _number(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _class_as_json(part: NoisyClass) -> dict[str, Any]:
    return {
        "closed": part.closed,
        "extents": {
            str(side): [list(pair) for pair in pairs] for side, pairs in part.cells.extents().items()
        },
        "escape": part.escape,
        "leads_to": part.leads_to,
        "sides": {str(side): share for side, share in part.sides.items()},
        "branches": part.branches,
        "residual": part.residual,
    }


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is asked, of one grid and level of noise."""

    scene: Scene
    goal: tuple[float, int]
    starts: NDArray[np.float64]
    cells: int
    strata: int
    cutters: dict[
        tuple[float, float], Cutter
    ]  # by range of the factor on kappa: found once, used at every solution

    def cutter(self, factors: Strata) -> Cutter | None:
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
        self.cutters[lo, hi] = Cutter(thrown(params), self.scene.domain, values)
        return self.cutters[lo, hi]


@dataclass(frozen=True, eq=False)
class _Found:
    chain: Transfer
    classes: tuple[NoisyClass, ...]
    settles: dict[str, float]
    ends: Absorption
    feeding: Feeding
    numbers: dict[str, float]


def _solve(asked: _Asked, scatter: Scattering) -> _Found:
    """Everything at one level of the noise, without errors and derivatives."""
    scene, (x, side) = asked.scene, asked.goal
    # Uniform: noise makes grading towards the joint needless, and cells are wanted where the part is.
    cover = with_border(grid(scene.domain, cells=asked.cells, grading="uniform"), x)
    factors = kappa_strata(scatter, scene, asked.strata)
    chain = transfer(
        thrown(still_map(scene)),
        cover,
        parameter=factors,
        landing=scatter.landing,
        strata=asked.strata,
        cutter=asked.cutter(factors),
    )
    beyond = np.concatenate([cover.centres(k) > x for k in range(cover.sides)])
    goal = beyond & (cover.side_of(np.arange(cover.n_cells)) == side)
    starts = random_starts(cover, asked.starts, x)
    settling = absorption(chain, np.zeros(cover.n_cells, dtype=bool))
    settles = {name: float(starts @ found) for name, found in settling.probability.items() if name != "goal"}
    parts = classes(chain)
    ends = absorption(chain, goal)
    fed = feeding(chain, ends, starts)
    first = absorption(chain, goal, other=beyond & ~goal).probability["other"]
    numbers = {**_long_run(chain, parts, settles, beyond, goal), **_from_starts(chain, fed)}
    numbers["first beyond is wrong"] = float(starts @ first)
    return _Found(chain, parts, settles, ends, fed, numbers)


def _main(parts: Sequence[NoisyClass], settles: dict[str, float]) -> NoisyClass | None:
    closed = [part for part in parts if part.closed]
    if closed:
        return max(enumerate(closed), key=lambda pair: settles[f"class {pair[0]}"])[1]
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
    """Where random starts begin on each side: `offset` beyond a_i, a twentieth of the arm unless given [unit]."""
    return scene.sides.a + (BEYOND_FOOT * scene.arm_length if offset is None else offset)


def _goal_of(scene: Scene, goal: Any) -> tuple[float, int]:
    asked = scene.goal if goal is None else goal
    if isinstance(asked, OrientedBeyond | Reaches):
        asked = (asked.x, asked.side)
    if (
        isinstance(asked, tuple)
        and len(asked) == 2
        and 0.0 < float(asked[0]) < scene.arm_length
        and int(asked[1]) in range(len(scene.sides))
    ):
        return float(asked[0]), int(asked[1])
    allowed = "(x, side) on the arm, OrientedBeyond or Reaches"
    raise AnswerError("the goal of the noise", asked, allowed, "pass goal=(20.0, 2)")


def _asked(
    scene: Scene | str, goal: Any, cells: int, strata: int, offset: float | None
) -> tuple[_Asked, Scene]:
    from limitsets.scene import load

    read = load(scene) if isinstance(scene, str) else scene
    return _Asked(read, _goal_of(read, goal), starts_from(read, offset), cells, strata, {}), read


def noise_statistics(
    scene: Scene | str,
    scatter: Scattering | None = None,
    *,
    goal: Any = None,
    cells: int = CELLS,
    strata: int = STRATA,
    offset: float | None = None,
    sensitivity: bool = True,
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
        How far beyond a_i random starts begin; by default a twentieth of the arm [scene's length unit].
    sensitivity : bool
        Compute the derivatives with respect to the noise of each quantity: four more solutions for each.
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
    >>> from limitsets.robust import Gaussian, Scattering, noise_statistics
    >>> noise = Scattering(speed=Gaussian(0.01), landing=Gaussian(0.05))
    >>> found = noise_statistics("paper-designed", noise, goal=(20.5, 2), cells=512, sensitivity=False)
    >>> round(found.numbers["mean throws"], 1), round(found.feeding.survivors[40], 2)
    (23.2, 0.14)
    """
    asked, read = _asked(scene, goal, cells, strata, offset)
    noise = scattering_of(read) if scatter is None else scatter
    names = noise.given() if sensitivity else ()
    stages = 3 + 4 * len(names)
    tell = progress or (lambda stage, done, total: None)
    tell("noise", 0, stages)
    found = _solve(asked, noise)
    tell("noise", 1, stages)
    errors = _errors(asked, noise, found.numbers)
    slopes = {}
    for number, name in enumerate(names):
        tell("noise", 3 + 4 * number, stages)
        slopes[name] = _slopes(asked, noise, name)
    tell("noise", stages, stages)
    return NoiseStatistics(
        read.name,
        read.unit,
        noise,
        asked.goal,
        asked.starts,
        found.chain.grid,
        strata,
        found.chain.cut,
        found.classes,
        found.settles,
        found.ends,
        found.feeding,
        found.numbers,
        errors,
        slopes,
    )


def _errors(asked: _Asked, noise: Scattering, numbers: dict[str, float]) -> dict[str, float]:
    """How much the numbers change from half as many cells, and from half as many strata, added up."""
    total = dict.fromkeys(numbers, 0.0)
    for coarse in (
        replace(asked, cells=max(asked.cells // 2, 1)),
        replace(asked, strata=max(asked.strata // 2, 1)),
    ):
        check = _solve(coarse, noise).numbers
        total = {key: total[key] + abs(value - check.get(key, math.nan)) for key, value in numbers.items()}
    return total


def _slopes(asked: _Asked, noise: Scattering, name: str) -> dict[str, Sensitivity]:
    """Take central differences over two steps, and extrapolate."""
    wide: dict[str, float] = {}
    narrow: dict[str, float] = {}
    for step, slope in ((STEP, wide), (0.5 * STEP, narrow)):
        above = _solve(asked, noise.scaled(1.0 + step, name)).numbers
        below = _solve(asked, noise.scaled(1.0 - step, name)).numbers
        slope.update({key: (above[key] - below[key]) / (2.0 * step) for key in above if key in below})
    return {
        key: Sensitivity((4.0 * value - wide[key]) / 3.0, abs(value - wide[key]))
        for key, value in narrow.items()
        if key in wide
    }


def noise_levels(
    scene: Scene | str,
    scatter: Scattering | None = None,
    *,
    factors: Sequence[float] = (0.0, 0.5, 1.0, 1.5, 2.0),
    goal: Any = None,
    cells: int = CELLS,
    strata: int = STRATA,
    offset: float | None = None,
) -> Levels:
    """Find the numbers of `noise_statistics` at several levels of the noise; parameters as there.

    Parameters
    ----------
    factors : sequence of float
        Factors on all deviations; 0 is the throw without noise.
    """
    asked, read = _asked(scene, goal, cells, strata, offset)
    noise = scattering_of(read) if scatter is None else scatter
    rows = [_solve(asked, noise.scaled(float(factor))).numbers for factor in factors]
    names = {name: None for row in rows for name in row}
    table = {name: np.array([row.get(name, math.nan) for row in rows]) for name in names}
    return Levels(np.array(factors, dtype=np.float64), table)
