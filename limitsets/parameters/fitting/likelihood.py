"""The likelihood of filmed throws (docs/fitting.md): what the model predicts, what rows are, which throws tell more.

A row says: the decision at the true place before was this one, and the part landed there.  The decision is uncertain by
the measured place before and the scatter of the speed; the landing by the measured places, by the scatter of the speed
and by that of landings:

    v = e^2 (1 + slope^2) + (dR'/d ln w)^2 sw^2 + sl^2

Where two rows share a reading their landings go together: its error moves the first by e and the second by -slope e.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from limitsets.base.arrays import Array, Ints, Mask
from limitsets.feeder.scene import Scene, throw_stack
from limitsets.parameters.fitting.throws import Throws
from limitsets.systems.maps.pieces import at_points

# ----------------------------------------------------------------
# What the model says of each throw, at many parameter points at once: where it lands, what decides, how both
# move.
#
# The formulas are the kernels of the map; derivatives with respect to the start and to the logarithm of the speed are
# central differences, in steps that leave ten digits.


STEP = 1e-5


class Predicted(NamedTuple):
    """Of n throws on given branches, at m points; all of shape (m, n).

    Attributes
    ----------
    after : ndarray
        Where the throw ends: the place that is read there [length].
    slope, per_log_speed : ndarray
        Its derivatives with respect to the start [1] and to ln w [length].
    decides : ndarray
        Positive where the part flips [length^2].
    decides_slope, decides_per_log_speed : ndarray
        Its derivatives.
    possible : ndarray of bool, shape (m, 1)
        Where there is such a scene.
    """

    after: Array
    slope: Array
    per_log_speed: Array
    decides: Array
    decides_slope: Array
    decides_per_log_speed: Array
    possible: Mask

    def variance(self, error: Array, speed: Array | float, landing: Array | float) -> Array:
        """Give that of each landing, by the error of its places and the scatter of the speed and of landings."""
        return error**2 * (1.0 + self.slope**2) + (self.per_log_speed * speed) ** 2 + landing**2


def predicted(
    scene: Scene,
    values: Mapping[str, Array | float],
    before: Array,
    side: Ints,
    branch: Ints,
    *,
    corner: bool,
) -> Predicted:
    """Predict throws from places on a side that take a branch, for a scene at m values of its quantities.

    Places are those of the centre of mass, or, with `corner`, of the left corner of the side that the part rests on.
    How far this corner is from the centre of mass is the part's geometry, which varies with the quantities.
    """
    stack = throw_stack(scene, {name: np.atleast_1d(value) for name, value in values.items()})
    params, move = stack.params, STEP * scene.arm_length
    x = before + params.a[:, side] if corner else before
    after, slope, decides = at_points(params, x, side, branch)
    fast, _, fast_decides = at_points(
        params._replace(kappa=params.kappa * np.exp(-2 * STEP)), x, side, branch
    )
    slow, _, slow_decides = at_points(params._replace(kappa=params.kappa * np.exp(2 * STEP)), x, side, branch)
    _, _, beyond = at_points(params, x + move, side, branch)
    _, _, short = at_points(params, x - move, side, branch)
    if corner:
        after = after - params.a[:, (side + branch) % len(scene.sides)]
    return Predicted(
        after=after,
        slope=slope,
        per_log_speed=(fast - slow) / (2 * STEP),
        decides=decides,
        decides_slope=(beyond - short) / (2 * move),
        decides_per_log_speed=(fast_decides - slow_decides) / (2 * STEP),
        possible=stack.possible[:, None],
    )


# ----------------------------------------------------------------
# What each row is taken for: the side it began on and whether it flipped, which its landing tells, misrecorded
# or not.
#
# A jog and a flip, and throws from different sides, land inches apart; a recorded side that does not fit where the part
# landed is therefore seen, and the throw still counts with the side that fits.


# Before the data are seen a side after a throw counts as misrecorded once in fifty readings.  The side before is where
# the part was laid down: wrong much less often, and where a jog from either side would do, right.
MISREAD, MISLAID = 0.02, 0.0004
# Critical points are not yet known: to this share of the arm's length.
CRITICAL = 0.05


@dataclass(frozen=True, eq=False)
class Rows:
    """Throws with what happened in each.

    Attributes
    ----------
    throws : Throws
        As recorded.
    side : ndarray of int, shape (n,)
        The side that the throw began on.
    branch : ndarray of int, shape (n,)
        1 where the part flipped, 0 where it did not.
    error : ndarray, shape (n,)
        Standard deviation of a measured place; 0 where it is not known [length].
    known : bool
        Whether it is known.
    """

    throws: Throws
    side: Ints
    branch: Ints
    error: Array
    known: bool

    def told(self, scene: Scene, values: Mapping[str, Array | float]) -> Predicted:
        """Predict these throws for a scene at m values of its quantities: the places that were read."""
        throws = self.throws
        return predicted(scene, values, throws.x_before, self.side, self.branch, corner=throws.corner)

    def side_after(self, sides: int) -> Ints:
        """Return the side on which each throw ended."""
        return (self.side + self.branch) % sides

    def misread_before(self) -> Mask:
        """Where the side before is misrecorded, in a reading of its own."""
        return np.asarray((self.side != self.throws.side_before) & ~self.throws.shared)

    def misread_after(self, sides: int) -> Mask:
        """Where the side after is misrecorded."""
        return np.asarray(self.side_after(sides) != self.throws.side_after)

    def misread(self, sides: int) -> tuple[int, int]:
        """Count the misrecorded sides, and all readings of a side."""
        wrong = self.misread_before().sum() + self.misread_after(sides).sum()
        return int(wrong), 2 * len(self.throws) - int(self.throws.shared.sum())


def as_recorded(throws: Throws, error: Array, known: bool, sides: int) -> Rows:
    """Take every row as recorded; a row that ends on neither possible side counts as a jog."""
    flipped = throws.side_after == (throws.side_before + 1) % sides
    return Rows(throws, throws.side_before, flipped.astype(np.int64), error, known)


def assigned(rows: Rows, scene: Scene, values: Mapping[str, float], spread: float) -> Rows:
    """Find for each row the side it began on and its branch: what lands nearest, with a price for a misrecorded side.

    Parameters
    ----------
    rows : Rows
        Their throws are taken anew.
    scene : Scene
        The scene.
    values : mapping of str to float
        Its quantities.
    spread : float
        Standard deviation of the landings [length].
    """
    from scipy.special import log_ndtr

    throws, sides, count = rows.throws, len(scene.sides), len(rows.throws)
    side, branch = (each.reshape(-1) for each in np.indices((sides, 2)))
    told = predicted(
        scene,
        values,
        np.tile(throws.x_before, side.size),
        np.repeat(side, count),
        np.repeat(branch, count),
        corner=throws.corner,
    )
    miss = (throws.x_after - told.after[0].reshape(side.size, count)) / spread
    after = ((side + branch) % sides)[:, None]
    width = CRITICAL * scene.arm_length * np.abs(told.decides_slope[0])
    decided = log_ndtr(np.where(np.repeat(branch, count) == 1, 1.0, -1.0) * told.decides[0] / width)
    recorded_after = np.where(after == throws.side_after, *_prices(MISREAD, sides))
    fits = decided.reshape(miss.shape) - 0.5 * miss**2 + recorded_after
    fits = np.where(np.isfinite(fits), fits, -np.inf)  # nan: no flight
    right, wrong = _prices(MISLAID, sides)
    before, own, shared = np.empty(count, np.int64), np.empty(count, np.int64), throws.shared
    for k in range(count):
        # one reading for both rows: it is as right or wrong as it was in the row before
        recorded = (before[k - 1] + own[k - 1]) % sides if shared[k] else throws.side_before[k]
        # with both sides wrong, a row could explain a landing that no throw can make
        single = (after[:, 0] == throws.side_after[k]) & ~shared[k]
        price = np.where(side == recorded, right, np.where(single, wrong, -np.inf))
        best = int(np.argmax(fits[:, k] + price))
        before[k], own[k] = side[best], branch[best]
    return Rows(throws, before, own, rows.error, rows.known)


def _prices(wrong: float, sides: int) -> tuple[float, float]:
    """Return the logarithms of the probabilities that a side is recorded right, and as one certain other."""
    return math.log1p(-wrong), math.log(wrong / (sides - 1))


# ----------------------------------------------------------------
# The likelihood of filmed throws (docs/fitting.md), at many parameter points at once.


# The decision is never sharper than this share of the arm, nor a landing.
SHARPEST = 1e-7
SCATTERS = 2


def whitened(
    rows: Rows, told: Predicted, speed: Array, landing: Array, miss: Array | None = None
) -> tuple[Array, Array]:
    """Take the landings apart into independent numbers; `miss` stands in for the residuals where it is given.

    Parameters
    ----------
    rows : Rows
        n throws.
    told : Predicted
        At m points.
    speed, landing : ndarray, shape (m, 1)
        Scatter of the speed [share] and of landings [length].
    miss : ndarray, shape (m, n), optional
        Instead of what was measured less what is predicted [length].

    Returns
    -------
    residual, log_variance : ndarray, shape (m, n)
        Independent numbers of variance 1, and the logarithms of the variances that they had.
    """
    variance = told.variance(rows.error, speed, landing)
    # with the landing of the row before
    before = np.concatenate([[0.0], rows.error[:-1]])
    covariance = np.where(rows.throws.shared, -told.slope * rows.error * before, 0.0)
    residual = rows.throws.x_after - told.after if miss is None else miss
    if covariance.any():
        residual, variance = (each.copy() for each in np.broadcast_arrays(residual, variance))
        for k in np.flatnonzero(rows.throws.shared):  # LDL^T of a matrix with one band
            share = covariance[:, k] / variance[:, k - 1]
            variance[:, k] -= share * covariance[:, k]
            residual[:, k] -= share * residual[:, k - 1]
    return residual / np.sqrt(variance), np.log(variance)


@dataclass(frozen=True, eq=False)
class Likelihood:
    """The logarithm of the likelihood as a function of numbers of order 1.

    Attributes
    ----------
    scene : Scene
        The scene; what is not in `names` stays as it is there.
    rows : Rows
        The throws.
    names : tuple of str
        The quantities that are fitted.
    centre, scale : ndarray, shape (p + 2,)
        Quantity k has the value centre + scale * number, then follow the scatter of the speed [share] and of landings.
    """

    scene: Scene
    rows: Rows
    names: tuple[str, ...]
    centre: Array
    scale: Array

    def values(self, at: Array) -> Array:
        """Return quantities and scatters, of shape (m, p + 2); the sign of a scatter means nothing."""
        numbers = self.centre + self.scale * np.atleast_2d(at)
        numbers[:, -SCATTERS:] = np.abs(numbers[:, -SCATTERS:])
        return numbers

    def told(self, values: Array) -> Predicted:
        """Return what is predicted at m points."""
        points = dict(zip(self.names, values.T[: len(self.names)], strict=True))
        as_it_is = {"arm.surface_height": np.full(len(values), self.scene.surface_height)}
        return self.rows.told(self.scene, points or as_it_is)

    def decision(self, told: Predicted, speed: Array, landing: Array) -> Array:
        """Return by how many of its standard deviations each decision is on the side where it fell; (m, n)."""
        rows = self.rows
        # where no measurement error is known all of the scatter may be one
        error2 = rows.error**2 if rows.known else landing**2 / (1.0 + told.slope**2)
        error2 = error2 + (SHARPEST * self.scene.arm_length) ** 2
        size = np.sqrt(told.decides_slope**2 * error2 + (told.decides_per_log_speed * speed) ** 2)
        return np.where(rows.branch == 1, 1.0, -1.0) * told.decides / size

    def __call__(self, at: Array) -> Array:
        """Return the logarithm at m points; -inf where there is no such scene."""
        from scipy.special import log_ndtr

        values = self.values(at)
        told = self.told(values)
        speed, landing = values[:, -2:-1], values[:, -1:]
        landing = np.sqrt(landing**2 + (SHARPEST * self.scene.arm_length) ** 2)
        with np.errstate(all="ignore"):  # where the part does not fly; those points are refused
            residual, log_variance = whitened(self.rows, told, speed, landing)
            decided = log_ndtr(self.decision(told, speed, landing))
            rows = decided - 0.5 * (residual**2 + log_variance + np.log(2.0 * np.pi))
            total = np.where(told.possible[:, 0], rows.sum(axis=1), -np.inf)
        return np.where(np.isfinite(total), total, -np.inf)


# ----------------------------------------------------------------
# Which further throws would sharpen the answer most: the gain in information of a throw from each place and
# side.
#
# The information of a throw is that of its landing and of its decision; near a critical point the decision tells most,
# and about the radius of gyration it alone tells anything.


PLACES = 200
STEP_OF_GAIN = 1e-4
# Throws that are filmed more, of which the gain is told.
MORE = 10
# A value that the data leave quite open is known this well before them, in units of change.
BEFORE = 0.5


@dataclass(frozen=True)
class Further:
    """A throw worth filming.

    Attributes
    ----------
    x, side : float, int
        Where the part is laid down [length]: what the film shows, the left corner or the centre of mass.
    gain : float
        Gain in information by one such throw [nats]: logarithm of the ratio of volumes of the region, before and after.
    shrinks : dict of str to float
        By which factor ten of them shorten the interval of each quantity.
    """

    x: float
    side: int
    gain: float
    shrinks: dict[str, float]


def information(
    x: Array,
    side: Ints,
    error: Array,
    *,
    scene: Scene,
    units: Mapping[str, float],
    scatter: tuple[float, float],
    corner: bool,
) -> Array:
    """Return the information of single throws about quantities in their units of change; shape (n, p, p).

    `scatter` is that of speed and place; with `corner` places are those of the left corner, else of the centre of mass.
    """
    from scipy.stats import norm

    centre, p = np.array([scene.value(name) for name in units]), len(units)
    unit = np.diag([*units.values()])
    moves = np.concatenate([np.zeros((1, p)), unit, -unit]) * STEP_OF_GAIN
    points = dict(zip(units, (centre + moves).T, strict=True))
    jog, flip = (
        predicted(scene, points, x, side, np.full(side.size, b, np.int64), corner=corner) for b in (0, 1)
    )
    speed, landing = scatter[0], max(scatter[1], SHARPEST * scene.arm_length)
    size = np.sqrt((jog.decides_slope * error) ** 2 + (jog.decides_per_log_speed * speed) ** 2)[0]
    z = jog.decides / np.maximum(size, 1e-9)
    flips = norm.cdf(z[0])
    total = np.zeros((side.size, p, p))
    for told, share in ((jog, 1.0 - flips), (flip, flips)):
        slope = ((told.after[1 : p + 1] - told.after[p + 1 :]) / (2.0 * STEP_OF_GAIN)).T
        total += (
            (share / told.variance(error, speed, landing)[0])[:, None, None]
            * slope[:, :, None]
            * slope[:, None, :]
        )
    slope = ((z[1 : p + 1] - z[p + 1 :]) / (2.0 * STEP_OF_GAIN)).T
    weight = norm.pdf(z[0]) ** 2 / np.maximum(flips * (1.0 - flips), 1e-30)
    total += weight[:, None, None] * slope[:, :, None] * slope[:, None, :]
    return np.where(np.isfinite(total), total, 0.0)


def further_throws(
    filmed: Throws,
    side: Ints,
    error: Array,
    *,
    scene: Scene,
    units: Mapping[str, float],
    scatter: tuple[float, float],
) -> tuple[Further, ...]:
    """Find the start on each side from which a throw tells most beside those filmed; the most telling first."""
    told_by = partial(information, scene=scene, units=units, scatter=scatter, corner=filmed.corner)
    known = told_by(filmed.x_before, side, error).sum(axis=0) + np.eye(len(units)) / BEFORE**2
    further = []
    size = float(np.mean(error)) if np.mean(error) > 0 else scatter[1]
    for own in range(len(scene.sides)):
        near, far = scene.sides.a[own], scene.arm_length
        places = np.linspace(near + 0.02 * (far - near), far, PLACES) - (near if filmed.corner else 0.0)
        there = told_by(places, np.full(PLACES, own), np.full(PLACES, size))
        gains = np.linalg.slogdet(known + there)[1] - np.linalg.slogdet(known)[1]
        best = int(np.argmax(gains))
        ratio = np.diag(np.linalg.inv(known)) / np.diag(np.linalg.inv(known + MORE * there[best]))
        shrinks = {name: float(np.sqrt(each)) for name, each in zip(units, ratio, strict=True)}
        further.append(Further(float(places[best]), own, 0.5 * float(gains[best]), shrinks))
    return tuple(sorted(further, key=lambda each: -each.gain))
