"""The search of a fit: the most likely machine, and how far it may be from the true one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from limitsets.fitting.likelihood import SCATTERS, Likelihood
from limitsets.fitting.maximising import End, Maximum, end_of_profile, maximised
from limitsets.fitting.rows import assigned
from limitsets.fitting.starting import RADIUS, Start
from limitsets.scene import Scene

# Share of the region's volume over all repetitions of the film.
LEVEL = 0.95
# Values of the radius of gyration that are tried first, as shares of the largest one.
RADII = np.linspace(0.05, 1.0, 77)
# Rounds of taking the rows anew, and of better maxima met on the way along a profile.
ROUNDS = 4

Array = NDArray[np.float64]


def threshold_of(together: int, rows: int, fitted: int) -> float:
    """Say by how much twice the log-likelihood may fall: of normal residuals with a scatter that is fitted as well.

    rows ln(1 + q F / (rows - fitted)), with the 95 % point of F(q, rows - fitted): exact for linear models, and for
    many rows that of chi-square.
    """
    from scipy.stats import f as f_law

    spare = rows - fitted
    return float(rows * math.log1p(together * f_law.ppf(LEVEL, together, spare) / spare))


def largest(scene: Scene, start: Start) -> tuple[Likelihood, Maximum]:
    """Maximise the likelihood, and take the rows anew, until they stay what they are."""
    names, values, sizes = start.names, start.values, start.errors.copy()
    if "radius_of_gyration" in scene.text["part"]["mass"]:
        radius = scene.value(RADIUS)
        names, values, sizes = (*names, RADIUS), np.append(values, radius), np.append(sizes, 0.02 * radius)
    rows = start.rows
    scatter = np.full(SCATTERS, start.spread / math.sqrt(2.0))
    own = Likelihood(scene, rows, names, np.append(values, np.zeros(SCATTERS)), np.append(sizes, scatter))
    told = own.told(own.centre[None])
    known = rows.error**2 * (1.0 + told.slope[0] ** 2)
    left = math.sqrt(max(start.spread**2 - float(known.mean()), 0.01 * start.spread**2) / 2.0)
    share = left / max(float(np.median(np.abs(told.per_log_speed[0]))), 1e-12)
    # landings that happen to agree better than their errors of measurement tell no more than these let them
    sizes[: len(start.names)] *= max(1.0, math.sqrt(float(known.mean())) / start.spread)
    own = replace(own, scale=np.append(sizes, [share, left]))
    at = np.append(np.zeros(len(names)), [1.0, 1.0])
    best = maximised(own, _best_radius(own, at))
    for _ in range(ROUNDS):
        found = dict(zip(names, own.values(best.at)[0].tolist(), strict=False))
        again = assigned(own.rows, scene, found, start.spread)
        same = (again.side == own.rows.side).all() and (again.branch == own.rows.branch).all()
        if same:
            break
        own = replace(own, rows=again)
        best = maximised(own, _best_radius(own, best.at))
    return own, best


def _best_radius(own: Likelihood, at: Array) -> Array:
    if RADIUS not in own.names:
        return at
    k = own.names.index(RADIUS)
    most = largest_radius(own.scene)
    radii = np.append(min(own.scene.value(RADIUS), most), RADII * most)
    tries = np.repeat(at[None], radii.size, axis=0)
    tries[:, k] = (radii - own.centre[k]) / own.scale[k]
    return np.asarray(tries[int(np.argmax(own(tries)))])


def largest_radius(scene: Scene) -> float:
    """Return the largest radius of gyration about the centre of mass: all mass in vertices, far out, in balance."""
    from scipy.optimize import linprog

    arms = scene.vertices - np.array(scene.centre)
    shares = np.vstack([arms.T, np.ones(len(arms))])
    found = linprog(-(arms**2).sum(axis=1), A_eq=shares, b_eq=[0.0, 0.0, 1.0])
    return math.sqrt(max(-float(found.fun), 0.0))


def _limits(own: Likelihood, best: Maximum, k: int, way: float) -> float:
    """Return how far a number may be followed: a radius of gyration within the part, a scatter to 0."""
    values = own.values(best.at)[0]
    if k >= len(own.names):
        return abs(float(best.at[k])) if way < 0 else 1e4
    if own.names[k] == RADIUS:
        scene = own.scene.with_values(dict(zip(own.names[:k], values.tolist(), strict=False)))
        room = values[k] if way < 0 else max(largest_radius(scene) - values[k], 0.0)
        return float(room / own.scale[k])
    return 1e4


def profiles(
    own: Likelihood, best: Maximum, threshold: float, start: Start
) -> tuple[Maximum, list[tuple[End, End]]]:
    """Follow every number both ways; from the start again where a larger likelihood is met.

    What goes with a quantity that is held has no ends.
    """
    for left in reversed(range(ROUNDS)):
        best = best._replace(at=np.append(best.at[:-SCATTERS], np.abs(best.at[-SCATTERS:])))
        bend = np.linalg.eigh(-best.hessian)
        variance = (bend[1] ** 2 / np.maximum(bend[0], 1e-2)).sum(axis=1)
        better, ends = None, []
        for k in range(best.at.size):
            first = math.sqrt(threshold * variance[k])
            pair: list[End] = []
            for way in (-1.0, 1.0):
                quantity = k < len(own.names)
                limit = 0.0 if quantity and own.names[k] in start.undetermined else _limits(own, best, k, way)
                if limit < (1e-9 if quantity else 1e-3):
                    pair.append(End(way * math.inf))
                    continue
                end = end_of_profile(own, best, k, way, threshold, first, limit)
                if (math.isinf(end.at) or end.wall) and quantity and own.names[k] == RADIUS:
                    end = End(float(best.at[k]) + way * limit, wall=True)
                pair.append(end)
                better = end.better or better
            if better is not None and left:
                break
            ends.append((pair[0], pair[1]))
        if better is None or not left:
            break
        best = better
    return best, ends
