"""Basins, invariant densities and Lyapunov exponents by cells and by orbits: error against seconds.

Known answers: both attractors of u' = 1.5 u - u^3 take the same share of the starts that stay, |u| < sqrt(5/2); the
doubling map is uniform; the logistic map with r = 4 has the arcsine density and the exponent ln 2.  For the paper's
scene the answer of cells eight times as fine as the finest shown is the reference, held against a long orbit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from accuracy_points import Point, timed

import limitsets as ls
from limitsets.systems.maps.growth import lyapunov
from limitsets.systems.sets import invariant_measures
from limitsets.systems.sets.measure import sample_points

__all__ = [
    "CELLS",
    "DOUBLING",
    "LOGISTIC",
    "ORBITS",
    "THROWS",
    "ULAM",
    "basin_errors",
    "density_errors",
    "l1_arcsine",
    "l1_uniform",
    "lyapunov_errors",
    "scene_errors",
]

CELLS, ORBITS, ULAM, THROWS = "cells", "random starts", "Ulam's method", "one long orbit"

CUBIC, CUBIC_END = ls.maps.Cubic(1.5), 1.7
SHARE = math.sqrt(2.5) / (2.0 * CUBIC_END)  # of the starts in [-1.7, 1.7], per attractor
LOGISTIC, DOUBLING = ls.maps.Logistic(4.0), ls.maps.Doubling(1.999999999)  # factor 2 sends doubles to 0

# Points per cell over which ln |slope| is averaged.
SLOPES = 4


# ---------------------------------------------------------------- basins


def _share_by_cells(cells: int) -> float:
    """Share of the attractor on the right."""
    graph = ls.transitions(CUBIC, ls.grid([(-CUBIC_END, CUBIC_END)], cells=cells))
    found = ls.attractors(graph, throws=1)
    shares = ls.basins(graph, found).attractors
    return float(next(share for share, one in zip(shares, found, strict=True) if one.extents[0][-1][1] > 0.5))


def _share_by_starts(count: int, seed: int) -> float:
    starts = np.random.default_rng(seed).uniform(-CUBIC_END, CUBIC_END, count)
    x, _, _, _ = ls.maps.advance(CUBIC, starts, 0, 60)
    return float(np.mean(np.abs(x - math.sqrt(0.5)) < 0.1))


def basin_errors(seed: int = 0, quick: bool = False) -> list[Point]:
    """Error of the share of the starts that go to one attractor of the cubic map."""
    least = 0.01 if quick else 0.3
    points = []
    for cells in [2**k for k in range(6, 14 if quick else 19)]:
        share, seconds = timed(partial(_share_by_cells, cells), least, 10)
        points.append(Point(CELLS, cells, abs(share - SHARE), seconds))
    for count in [10**k for k in range(2, 6 if quick else 8)]:
        _, seconds = timed(partial(_share_by_starts, count, seed), least, 5)
        shares = [_share_by_starts(count, seed + k) for k in range(16 if count <= 10**6 else 4)]
        error = math.sqrt(np.mean(np.square(np.array(shares) - SHARE)))
        points.append(Point(ORBITS, count, error, seconds))
    return points


# ---------------------------------------------------------------- densities


def arcsine(x: Any) -> Any:
    """Share of its time that an orbit of the logistic map with r = 4 spends below x."""
    return 2.0 / math.pi * np.arcsin(np.sqrt(x))


def l1_arcsine(density: Any) -> float:
    """L1 distance of a density that is constant on equal cells (evenly many) from the arcsine density, in closed form.

    On a cell the arcsine density is monotone, and crosses the constant at most once.
    """
    edges = np.linspace(0.0, 1.0, density.size + 1)
    lo, hi = edges[:-1], edges[1:]
    inside = np.clip(1.0 - 4.0 / (math.pi * np.maximum(density, 1e-300)) ** 2, 0.0, 1.0)
    low = 0.5 * (1.0 - np.sqrt(inside))
    cross = np.clip(np.where(hi <= 0.5, low, 1.0 - low), lo, hi)
    one = density * (cross - lo) - (arcsine(cross) - arcsine(lo))
    two = density * (hi - cross) - (arcsine(hi) - arcsine(cross))
    return float((np.abs(one) + np.abs(two)).sum())


def l1_uniform(density: Any) -> float:
    """L1 distance from the uniform density."""
    return float(np.abs(density - 1.0).mean())


def _ulam(params: Any, cells: int) -> Any:
    (found,) = invariant_measures(ls.transitions(params, ls.grid([(0.0, 1.0)], cells=cells)))
    return found.density


def _histogram(params: Any, throws: int, bins: int, start: float) -> Any:
    x = ls.orbit(params, start, 0, throws).x
    return np.bincount(np.minimum((x * bins).astype(np.int64), bins - 1), minlength=bins) * (bins / x.size)


def density_errors(
    params: Any, distance: Callable[[Any], float], seed: int = 0, quick: bool = False
) -> list[Point]:
    """L1 error of the invariant density on [0, 1]; histograms have as many bins as the root of the throws.

    Where the density grows as 1/sqrt(x) at an end, bins of width h cannot do better than sqrt(h), and n throws leave
    sqrt(1/(n h)): both are least together at h = 1/sqrt(n), with an error of n^(-1/4).
    """
    least = 0.01 if quick else 0.3
    points = []
    for cells in [2**k for k in range(5, 13 if quick else 17)]:
        density, seconds = timed(partial(_ulam, params, cells), least, 10)
        points.append(Point(ULAM, cells, distance(density), seconds))
    start = float(np.random.default_rng(seed).uniform(0.1, 0.9))
    for throws in [10**k for k in range(3, 7 if quick else 8)]:
        bins = 2 * round(0.5 * math.sqrt(throws))
        density, seconds = timed(partial(_histogram, params, throws, bins, start), least, 5)
        points.append(Point(THROWS, throws, distance(density), seconds))
    return points


# ---------------------------------------------------------------- Lyapunov exponents


def _ulam_exponent(graph: Any) -> float:
    """Mean of ln |slope| over the invariant measure."""
    (found,) = invariant_measures(graph)
    total = 0.0
    for side in range(graph.grid.sides):
        cells = found.cells.numbers()
        cells = cells[(cells >= graph.grid.offset[side]) & (cells < graph.grid.offset[side + 1])]
        if not cells.size:
            continue
        x = sample_points(graph.grid, cells, side, SLOPES)
        code = ls.maps.images(graph.map, x, side).code
        _, _, slope = ls.maps.along(graph.map, x, side, np.maximum(code, 0)[:, None])
        mean = np.log(np.abs(slope)).reshape(cells.size, SLOPES).mean(axis=1)
        total += float((found.weight[cells] * mean).sum())
    return total


def _orbit_exponents(params: Any, starts: list[tuple[float, int]], throws: int) -> Any:
    return np.array([lyapunov(params, x, side, throws).exponent for x, side in starts])


def _orbits(
    params: Any, starts: list[tuple[float, int]], known: float, sizes: list[int], least: float
) -> list[Point]:
    """Root mean square error over several starts, and seconds of one."""
    points = []
    for throws in sizes:
        some = starts if throws < 10**7 else starts[:4]
        found = _orbit_exponents(params, some, throws)
        _, seconds = timed(partial(_orbit_exponents, params, some[:1], throws), least, 3)
        points.append(Point(THROWS, throws, float(np.sqrt(np.mean(np.square(found - known)))), seconds))
    return points


def lyapunov_errors(seed: int = 0, quick: bool = False) -> list[Point]:
    """Error of the Lyapunov exponent of the logistic map with r = 4, ln 2."""
    least = 0.01 if quick else 0.3
    points = []
    for cells in [2**k for k in range(5, 13 if quick else 17)]:

        def run(cells: int = cells) -> float:
            return _ulam_exponent(ls.transitions(LOGISTIC, ls.grid([(0.0, 1.0)], cells=cells)))

        found, seconds = timed(run, least, 10)
        points.append(Point(ULAM, cells, abs(found - math.log(2.0)), seconds))
    starts = [(float(x), 0) for x in np.random.default_rng(seed).uniform(0.1, 0.9, 64)]
    sizes = [10**k for k in range(3, 6 if quick else 8)]
    return points + _orbits(LOGISTIC, starts, math.log(2.0), sizes, least)


# ---------------------------------------------------------------- the paper's scene


def _coarser(weight: Any, fine: Any, parts: int) -> Any:
    """Weights of the fine cells of a grid if each coarse cell's were spread evenly over its parts."""
    return np.repeat(weight, parts) / parts


def scene_errors(
    scene: Any, seed: int = 0, quick: bool = False
) -> tuple[list[Point], list[Point], dict[str, float]]:
    """Errors of the invariant density (L1) and of the exponent for a scene, and the reference's own numbers."""
    least = 0.01 if quick else 0.3
    base, levels, more = ls.grid(scene.domain, cells=256), range(1, 5 if quick else 8), 8
    finest = base.refine(2 ** levels[-1] * more)
    graph = ls.transitions(scene.map, finest)
    (known,) = invariant_measures(graph)
    exponent = _ulam_exponent(graph)
    density, growth = [], []
    for level in levels:
        grid = base.refine(2**level)

        def run(grid: Any = grid) -> Any:
            (found,) = invariant_measures(ls.transitions(scene.map, grid))
            return found

        found, seconds = timed(run, least, 5)
        spread = _coarser(found.weight, finest, finest.n_cells // grid.n_cells)
        density.append(Point(ULAM, 256 * 2**level, float(np.abs(spread - known.weight).sum()), seconds))

        def run_exponent(grid: Any = grid) -> float:
            return _ulam_exponent(ls.transitions(scene.map, grid))

        value, seconds = timed(run_exponent, least, 5)
        growth.append(Point(ULAM, 256 * 2**level, abs(value - exponent), seconds))
    density += _histograms(scene, base, finest, known.weight, least, quick)
    random = np.random.default_rng(seed)
    starts = [(float(x), 2) for x in random.uniform(9.0, 23.0, 24)]
    sizes = [10**k for k in range(3, 6 if quick else 8)]
    growth += _orbits(scene.map, starts, exponent, sizes, least)
    long = lyapunov(scene.map, 15.0, 2, 10**6 if quick else 2 * 10**8).exponent
    return density, growth, {"by_cells": exponent, "by_orbit": float(long)}


def _histograms(scene: Any, base: Any, finest: Any, known: Any, least: float, quick: bool) -> list[Point]:
    """Histograms of one orbit; with n throws about n^(1/3) bins, which balances their width against their noise."""
    points = []
    for throws in [10**k for k in range(3, 6 if quick else 8)]:
        level = max(round(math.log2(throws ** (1 / 3) / 16)), 0)
        grid = base.refine(2**level)

        def run(throws: int = throws, grid: Any = grid) -> Any:
            path = ls.orbit(scene.map, 15.0, 2, throws + 1000)
            count = np.zeros(grid.n_cells)
            for side in range(grid.sides):
                here = path.x[1000:][path.side[1000:] == side]
                count += np.bincount(grid.index(here, side), minlength=grid.n_cells)
            return count / count.sum()

        weight, seconds = timed(run, least, 3)
        spread = _coarser(weight, finest, finest.n_cells // grid.n_cells)
        points.append(Point(THROWS, throws, float(np.abs(spread - known).sum()), seconds))
    return points
