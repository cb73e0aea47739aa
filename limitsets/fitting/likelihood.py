"""The likelihood of filmed throws (docs/fitting.md), at many parameter points at once.

A row says: the decision at the true place before was this one, and the part landed there.  The decision is uncertain by
the measured place before and the scatter of the speed; the landing by the measured places, by the scatter of the speed
and by that of landings:

    v = e^2 (1 + slope^2) + (dR'/d ln w)^2 sw^2 + sl^2

Where two rows share a reading their landings go together: its error moves the first by e and the second by -slope e.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitsets.fitting.predicting import Predicted
from limitsets.fitting.rows import Rows
from limitsets.scene import Scene

# The decision is never sharper than this share of the arm, nor a landing.
SHARPEST = 1e-7
SCATTERS = 2

Array = NDArray[np.float64]


class Whitened(NamedTuple):
    """Landings less what is predicted, as independent numbers of variance 1, and the logarithms of their variances."""

    residual: Array
    log_variance: Array


def _variances(rows: Rows, told: Predicted, speed: Array, landing: Array) -> tuple[Array, Array]:
    """Variance of each landing, and the covariance with that of the row before; shape (m, n)."""
    v = rows.error**2 * (1.0 + told.slope**2) + (told.per_log_speed * speed) ** 2 + landing**2
    before = np.concatenate([[0.0], rows.error[:-1]])
    return v, np.where(rows.throws.shared, -told.slope * rows.error * before, 0.0)


def whitened(
    rows: Rows, told: Predicted, speed: Array, landing: Array, miss: Array | None = None
) -> Whitened:
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
    """
    variance, covariance = _variances(rows, told, speed, landing)
    residual = rows.throws.x_after - told.after if miss is None else miss
    if covariance.any():
        residual, variance = (each.copy() for each in np.broadcast_arrays(residual, variance))
        for k in np.flatnonzero(rows.throws.shared):  # LDL^T of a matrix with one band
            share = covariance[:, k] / variance[:, k - 1]
            variance[:, k] -= share * covariance[:, k]
            residual[:, k] -= share * residual[:, k - 1]
    return Whitened(residual / np.sqrt(variance), np.log(variance))


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
        found = self.centre + self.scale * np.atleast_2d(at)
        found[:, -SCATTERS:] = np.abs(found[:, -SCATTERS:])
        return found

    def at(self, values: Array) -> Array:
        """Return the numbers at which quantities and scatters have these values."""
        return (np.asarray(values) - self.centre) / self.scale

    def told(self, values: Array) -> Predicted:
        """Return what is predicted at m points."""
        points = dict(zip(self.names, values.T[: len(self.names)], strict=True))
        if not points:
            points = {"arm.surface_height": np.full(len(values), self.scene.surface_height)}
        return self.rows.told(self.scene, points)

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
            white = whitened(self.rows, told, speed, landing)
            decided = log_ndtr(self.decision(told, speed, landing))
            rows = decided - 0.5 * (white.residual**2 + white.log_variance + np.log(2.0 * np.pi))
            total = np.where(told.possible[:, 0], rows.sum(axis=1), -np.inf)
        return np.where(np.isfinite(total), total, -np.inf)
