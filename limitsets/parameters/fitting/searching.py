"""The search of a fit: its start, maxima and profiles, the most likely machine, and how far off it may be."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from limitsets.base import DataError
from limitsets.base.arrays import Array, Ints
from limitsets.feeder.geometry import largest_radius
from limitsets.feeder.scene import Scene
from limitsets.parameters.fitting.likelihood import SCATTERS, Likelihood, Rows, assigned

# ----------------------------------------------------------------
# Where the likelihood's maximum is looked for: robust least squares of the landings, and what they cannot tell.
#
# A quantity along whose direction the landings hardly move (a singular direction of the information) is held at the
# scene's value and named.


RADIUS = "part.mass.radius_of_gyration"
QUANTITIES = ("part.mass.center.along", "part.mass.center.above", "arm.surface_height")
# A direction is told by the landings if they fix it to this share of the speed, or of the part.
TOLD = 0.2
# What moves by this share of its standard error with a quantity that is held is not determined.
MOVED = 0.2
STEP = 1e-5
# One after the other: towards the machine, away from outliers for good, and once more with the sides set right.
LOSSES = ("soft_l1", "cauchy", "huber")
# Median of the sizes of normal numbers.
MEDIAN = 0.6744897501960817
# Where the landings are first taken apart robustly: what misses by more is treated as an outlier, this share of a side.
ROUGH = 0.02


class Start(NamedTuple):
    """Where to begin.

    Attributes
    ----------
    rows : Rows
        The throws, with the sides and branches that their landings tell.
    names : tuple of str
        What the landings tell.
    values, errors : ndarray, shape (p,)
        Their values, and roughly how well they are known.
    held : dict of str to str
        What they do not tell, and which others it goes with.
    undetermined : dict of str to str
        What has a value only because another quantity is held, and which one.
    spread : float
        Robust standard deviation of the landings [length].
    """

    rows: Rows
    names: tuple[str, ...]
    values: Array
    errors: Array
    held: dict[str, str]
    undetermined: dict[str, str]
    spread: float

    @property
    def known(self) -> dict[str, float]:
        """The values by name."""
        return dict(zip(self.names, self.values.tolist(), strict=True))


def quantities_of(scene: Scene) -> tuple[str, ...]:
    """Name what landings depend on: the speed, or kappa without gravity, and what the scene is written in."""
    thrown = "throw.kappa" if scene.gravity is None else "throw.speed"
    return (thrown, *(QUANTITIES if ("center" in scene.text["part"]["mass"]) else QUANTITIES[2:]))


def units_of_change(scene: Scene, names: tuple[str, ...]) -> Array:
    """Return what counts as a large change of each quantity: its value for the throw, a side for lengths."""
    side = float(np.mean(scene.sides.length))
    return np.array([scene.value(name) if name.startswith("throw.") else side for name in names])


def spread_of(residual: Array) -> float:
    """Return the standard deviation of most of the numbers."""
    return float(np.median(np.abs(residual))) / MEDIAN


def jacobian(scene: Scene, rows: Rows, names: tuple[str, ...], values: Array, units: Array) -> Array:
    """Return the derivatives of the landings by quantities, each in its unit of change; shape (n, p)."""
    count = len(names)
    moves = np.concatenate([np.diag(units), -np.diag(units), np.zeros((1, count))]) * STEP
    told = rows.told(scene, dict(zip(names, (values + moves).T, strict=True)))
    # a step to an impossible scene is left out: the difference is one-sided there
    after = np.where(told.possible, told.after, told.after[-1])
    steps = STEP * (told.possible[:count] * 1.0 + told.possible[count:-1])
    return np.asarray(((after[:count] - after[count:-1]) / np.maximum(steps, STEP)).T)


def _least_squares(
    scene: Scene, rows: Rows, names: tuple[str, ...], values: Array, units: Array, scale: float, loss: str
) -> Array:
    """Fit the landings so that outliers count little."""
    from scipy.optimize import least_squares

    def misses(at: Array) -> Array:
        told = rows.told(scene, dict(zip(names, values + units * at, strict=True)))
        miss = (rows.throws.x_after - told.after[0]) / scale
        return np.where(np.isfinite(miss) & told.possible[0], miss, 1e6)

    def slopes(at: Array) -> Array:
        slope = -jacobian(scene, rows, names, values + units * at, units) / scale
        return np.where(np.isfinite(slope), slope, 0.0)

    # a hundredth of a unit of change is a step; nothing leads farther than half of one
    done = least_squares(
        misses, np.zeros(len(names)), slopes, bounds=(-0.5, 0.5), x_scale=0.01, loss=loss, max_nfev=60
    )
    return np.asarray(values + units * done.x, dtype=np.float64)


def robust_start(scene: Scene, rows: Rows) -> Start:
    """Fit the landings robustly, and hold what they do not tell.

    Raises
    ------
    DataError
        A throw begins where a part on its side cannot fly, or the landings tell nothing.
    """
    names, held, together = quantities_of(scene), {}, {}
    values, units = np.array([scene.value(name) for name in names]), units_of_change(scene, names)
    _require_flight(scene, rows)
    while True:
        spread = ROUGH * float(np.mean(scene.sides.length))
        for loss in LOSSES:
            values = _least_squares(scene, rows, names, values=values, units=units, scale=spread, loss=loss)
            here = dict(zip(names, values.tolist(), strict=True))
            told = rows.told(scene, here)
            spread = max(spread_of(rows.throws.x_after - told.after[0]), 1e-9 * scene.arm_length)
            if loss != LOSSES[0]:  # a machine that is not yet near explains nothing
                rows = assigned(rows, scene, here, spread)
        slopes = jacobian(scene, rows, names, values, units)
        _, singular, axes = np.linalg.svd(slopes / spread, full_matrices=False)
        if singular[-1] * TOLD >= 1.0:
            break
        out = int(np.argmax(np.abs(axes[-1])))
        others = [n for k, n in enumerate(names) if k != out and abs(axes[-1][k]) > 0.1]
        together[names[out]] = others
        held[names[out]] = (
            f"the landings do not tell it apart from {', '.join(others)}" if others else "no landing tells it"
        )
        keep = [k for k in range(len(names)) if k != out]
        if not keep:
            raise DataError(
                "what the landings tell",
                "nothing",
                "one quantity at least",
                "film throws from other places; check units and sides",
                file=rows.throws.file,
            )
        names, units = tuple(names[k] for k in keep), units[keep]
        values = np.array([scene.value(name) for name in names])
    errors = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes / spread**2)))
    return Start(
        rows=rows,
        names=names,
        values=values,
        errors=errors * units,
        held=held,
        undetermined=_undetermined(scene.with_values(here), rows, names, together, slopes, errors),
        spread=spread,
    )


def _undetermined(
    scene: Scene, rows: Rows, names: tuple[str, ...], held: dict[str, list[str]], slopes: Array, errors: Array
) -> dict[str, str]:
    """Find what goes with a quantity that is held, or moves when that one moves within what the landings leave open."""
    movers: dict[str, list[str]] = {}
    for one, others in held.items():
        own = np.array([scene.value(one)])
        moved = jacobian(scene, rows, (one,), own, units_of_change(scene, (one,)))[:, 0]
        follows = np.linalg.lstsq(slopes, moved)[0]
        # a decision depends on all quantities, so that the radius of gyration goes with each
        for name, size in zip((*names, RADIUS), (*np.abs(follows) * TOLD / errors, np.inf), strict=True):
            if size > MOVED or name in others:
                movers.setdefault(name, []).append(one)
    return {name: ", ".join(others) for name, others in movers.items()}


def _require_flight(scene: Scene, rows: Rows) -> None:
    throws, count = rows.throws, len(scene.sides)
    strange = np.flatnonzero(np.maximum(throws.side_before, throws.side_after) >= count)
    if strange.size:
        k = int(strange[0])
        raise DataError(
            "the sides",
            f"{throws.side_before[k]} and {throws.side_after[k]}",
            f"sides of this part, 0 to {count - 1}",
            "count them in flip order",
            key=f"row {throws.row[k]}",
        )
    least = np.zeros(len(throws)) if throws.corner else scene.sides.a[throws.side_before]
    short = np.flatnonzero(throws.x_before <= least)
    if short.size:
        k, unit = int(short[0]), scene.unit
        beyond = f"beyond the left vertex of side {throws.side_before[k]}, above {least[k]:.4g} {unit}"
        raise DataError(
            "the place before", f"{throws.x_before[k]:g} {unit}",
            "beyond the joint, above 0" if throws.corner else beyond,
            "a part nearer to the joint is not thrown: correct the place or the side", key=f"row {throws.row[k]}",
            file=throws.file,
        )  # fmt: skip


# ----------------------------------------------------------------
# Maxima of a smooth function of few numbers of order 1, and how far each may go: Newton's method and profiles.
#
# The function takes many points in one call, so a whole Hessian by differences costs little more than one value.


Function = Callable[[Array], Array]

H = 0.03
MOST = 60
# Newton's method ends where a step promises less than this.
GAIN, ROUGHLY = 1e-6, 1e-3
LONGEST = 3.0
FLATTEST = 1e-3
SHARES = np.array([0.5, 0.25, 0.1, 0.03, 0.01, 0.001])
SHARES_BACK = np.array([1.0, 0.7, 0.4, 0.1, 0.0])
# The end of a profile is found to this share of its distance.
CLOSE = 0.01
# Below this a point is as bad as one where there is nothing.
WORST = -1e9


class Maximum(NamedTuple):
    """Where a function is largest.

    Attributes
    ----------
    at : ndarray, shape (p,)
        Where.
    value : float
        The function there.
    hessian : ndarray, shape (p, p)
        Its second derivatives; 0 in rows and columns of what was held.
    """

    at: Array
    value: float
    hessian: Array


def _expanded(f: Function, at: Array, free: Ints) -> tuple[float, Array, Array]:
    """Value, gradient and Hessian with respect to the free numbers."""
    p = free.size
    one = np.zeros((p, at.size))
    one[np.arange(p), free] = H
    first, second = np.triu_indices(p, 1)
    values = np.maximum(
        f(at + np.concatenate([np.zeros((1, at.size)), one, -one, one[first] + one[second]])), WORST
    )
    here, up, down, both = values[0], values[1 : p + 1], values[p + 1 : 2 * p + 1], values[2 * p + 1 :]
    hessian = np.diag((up - 2.0 * here + down) / H**2)
    hessian[first, second] = hessian[second, first] = (both - up[first] - up[second] + here) / H**2
    return float(here), (up - down) / (2.0 * H), hessian


def maximised(f: Function, start: Array, held: int | None = None, gain: float = GAIN) -> Maximum:
    """Climb from a start, until a step promises less than `gain`; one number may be held."""
    at = np.array(start, dtype=np.float64)
    free = np.array([k for k in range(at.size) if k != held], dtype=np.int64)
    value, gradient, hessian = _expanded(f, at, free)
    for _ in range(MOST):
        bend, axes = np.linalg.eigh(-hessian)
        # downhill bends are turned over, flat ones bent a little: the step goes up
        step = axes @ ((axes.T @ gradient) / np.maximum(np.abs(bend), FLATTEST))
        step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-300)) if step.size else 1.0
        if gradient @ step < gain:
            break
        there = at.copy()
        there[free] += step
        expansion = _expanded(f, there, free)
        if not expansion[0] > value:
            tries = np.repeat(at[None], SHARES.size, axis=0)
            tries[:, free] += SHARES[:, None] * step
            there = tries[int(np.argmax(f(tries)))]
            expansion = _expanded(f, there, free)
            if not expansion[0] > value:
                break
        at, (value, gradient, hessian) = there, expansion
    whole = np.zeros((at.size, at.size))
    whole[np.ix_(free, free)] = hessian
    return Maximum(at, value, whole)


class End(NamedTuple):
    """One end of a profile.

    Attributes
    ----------
    at : float
        Where the deviance reaches its threshold; infinite, with the way's sign, where it does not within the limit.
    better : Maximum or None
        A larger value of the function that was met on the way.
    wall : bool
        Whether the function ends there, before the deviance reaches its threshold.
    """

    at: float
    better: Maximum | None = None
    wall: bool = False


def end_of_profile(
    f: Function, best: Maximum, k: int, way: float, threshold: float, first: float, limit: float
) -> End:
    """Follow number k one way from a maximum, the others free, until twice the loss reaches a threshold.

    Parameters
    ----------
    f : callable
        The function.
    best : Maximum
        Where to begin.
    k : int
        Which number.
    way : float
        1 or -1.
    threshold : float
        Of twice the loss.
    first : float
        How far the end may be expected.
    limit : float
        The farthest that is looked at.
    """
    wanted = math.sqrt(threshold)
    # the others go along as in a parabola, then as they did before
    bend, axes = np.linalg.eigh(-best.hessian)
    along = (axes / np.maximum(bend, FLATTEST)) @ axes[k]
    along *= way / along[k]
    near, near_root, far, far_root = 0.0, 0.0, math.inf, math.inf
    last, distance, wall = best.at, min(first, limit), False
    for _ in range(40):
        # if the other numbers moved so far that the function is undefined, they move less
        starts = last + SHARES_BACK[:, None] * (best.at + distance * along - last)
        starts[:, k] = best.at[k] + way * distance
        start = starts[int(np.argmax(f(starts) > WORST))]
        maximum = maximised(f, start, held=k, gain=ROUGHLY)
        nothing = maximum.value <= WORST
        if not nothing:
            along = (maximum.at - best.at) / distance
        loss = 2.0 * (best.value - maximum.value)
        if loss < -0.01:
            return End(start[k], maximised(f, maximum.at))
        root = math.sqrt(max(loss, 0.0))
        if root < wanted:
            near, near_root, last = distance, root, maximum.at
            if distance >= limit:
                return End(way * math.inf)
        else:
            far, far_root, wall = distance, root, nothing
        if abs(root - wanted) < CLOSE * wanted or far - near < CLOSE * far:
            break
        if math.isinf(far):
            guess = distance * (wanted / root if root > 0.2 * wanted else 3.0) * 1.02
            distance = min(max(guess, 1.1 * distance), 4.0 * distance, limit)
        else:
            share = (wanted - near_root) / (far_root - near_root) if far_root < 10.0 * wanted else 0.5
            distance = near + min(max(share, 0.1), 0.9) * (far - near)
    if wall:
        return End(best.at[k] + way * near, wall=True)
    return End(best.at[k] + way * (distance if math.isinf(far) else min(distance, far)))


# ----------------------------------------------------------------
# The search of a fit: the most likely machine, and how far it may be from the true one.


# Share of the region's volume over all repetitions of the film.
LEVEL = 0.95
# Values of the radius of gyration that are tried first, as shares of the largest one.
RADII = np.linspace(0.05, 1.0, 77)
# Rounds of taking the rows anew, and of better maxima met on the way along a profile.
ROUNDS = 4


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
    # landings that agree better than their errors of measurement by chance tell no more than these errors allow
    sizes[: len(start.names)] *= max(1.0, math.sqrt(float(known.mean())) / start.spread)
    own = replace(own, scale=np.append(sizes, [share, left]))
    best = maximised(own, _best_radius(own, np.append(np.zeros(len(names)), [1.0, 1.0])))
    for _ in range(ROUNDS):
        best_values = dict(zip(names, own.values(best.at)[0].tolist(), strict=False))
        again = assigned(own.rows, scene, best_values, start.spread)
        if (again.side == own.rows.side).all() and (again.branch == own.rows.branch).all():
            break
        own = replace(own, rows=again)
        best = maximised(own, _best_radius(own, best.at))
    return own, best


def _best_radius(own: Likelihood, at: Array) -> Array:
    if RADIUS not in own.names:
        return at
    k = own.names.index(RADIUS)
    most = _most(own.scene)
    radii = np.append(min(own.scene.value(RADIUS), most), RADII * most)
    tries = np.repeat(at[None], radii.size, axis=0)
    tries[:, k] = (radii - own.centre[k]) / own.scale[k]
    return np.asarray(tries[int(np.argmax(own(tries)))])


def _most(scene: Scene) -> float:
    """Give the largest radius of gyration that the part can have about its centre of mass."""
    return float(largest_radius(scene.vertices, scene.centre))


def _limits(own: Likelihood, best: Maximum, k: int, way: float) -> float:
    """Return how far a number may be followed: a radius of gyration within the part, a scatter to 0."""
    values = own.values(best.at)[0]
    if k >= len(own.names):
        return abs(float(best.at[k])) if way < 0 else 1e4
    if own.names[k] == RADIUS:
        scene = own.scene.with_values(dict(zip(own.names[:k], values.tolist(), strict=False)))
        return float((values[k] if way < 0 else max(_most(scene) - values[k], 0.0)) / own.scale[k])
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
                end = end_of_profile(own, best, k, way=way, threshold=threshold, first=first, limit=limit)
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
