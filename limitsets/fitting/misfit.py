"""Does the model fit at all?  Tests of what is left of the landings, at a level of 5 %.

Two tests, each at half the level.  Outliers: the likelihood ratio of "some landings scatter more than others" against
"all alike", its law found by drawing from the fitted model.  Structure: do residuals depend on side, branch and place
beyond what the fitted quantities can take up (F test)?
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.fitting.likelihood import whitened
from limitsets.fitting.starting import Start, jacobian, units_of_change
from limitsets.scene import Scene

LEVEL = 0.05
DRAWS = 1999
# Of the alternative: how large a share of the landings scatters more, and how many times more.
SHARES = np.array([0.02, 0.05, 0.1, 0.2])
WIDER = np.array([2.0, 4.0, 8.0, 20.0, 100.0])
# Weight of a number of that many standard deviations, in the robust fit of what is left (Huber's).
BEND = 1.345
ROUNDS = 8
# Residuals that are all this small, in standard deviations, are none.
NOTHING = 1e-9
# Beyond so many robust standard deviations a row is named.
NAMED = 3.5
# Scatters up to so many robust ones, and how many of them are tried.
WIDEST, SIZES = 1.5, 16

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Misfit:
    """What the tests say.

    Attributes
    ----------
    outliers, structure : float
        Probabilities of what is left of the landings being as far from the model's as it is, if the model held.
    strange : tuple of int
        Lines of the file whose landings are far off.
    """

    outliers: float
    structure: float | None
    strange: tuple[int, ...]

    @property
    def p(self) -> float:
        """The probability for both tests together (Bonferroni)."""
        both = [each for each in (self.outliers, self.structure) if each is not None]
        return min(1.0, len(both) * min(both))

    @property
    def lacking(self) -> bool:
        """Whether the data hold something that the model lacks."""
        return self.p < LEVEL


def misfit_of(scene: Scene, start: Start) -> Misfit:
    """Test the model by the robust fit: the most likely machine leans towards throws that no machine makes."""
    rows = start.rows
    points = {name: np.array([value]) for name, value in zip(start.names, start.values, strict=True)}
    told = rows.told(scene, points)
    slopes = jacobian(scene, rows, start.names, start.values, units_of_change(scene, start.names))
    # of speed and of landings: the scatter that is most likely for the landings that are not far off
    sizes = start.spread * np.linspace(0.0, WIDEST, SIZES)
    per_share = max(float(np.median(np.abs(told.per_log_speed))), 1e-12)
    speed, landing = (each.reshape(-1, 1) for each in np.meshgrid(sizes / per_share, sizes))
    landing = np.hypot(landing, 1e-7 * scene.arm_length)
    tried = whitened(rows, told, speed, landing)
    loss = np.minimum(tried.residual**2, NAMED**2) + tried.log_variance
    k = [int(np.argmin(loss.sum(axis=1)))]

    def white(miss: Array | None) -> Array:
        found: Array = whitened(rows, told, speed[k], landing[k], miss).residual[0]
        return found

    columns = np.stack([white(column[None]) for column in slopes.T], axis=1)
    throws = rows.throws
    return misfit(white(None), columns, 2 * rows.side + rows.branch, throws.x_before, throws.row)


def misfit(
    residual: Array, slopes: Array, groups: NDArray[np.int64], x: Array, row: NDArray[np.int64]
) -> Misfit:
    """Test what is left of the landings.

    Parameters
    ----------
    residual : ndarray, shape (n,)
        Of unit variance if the model holds, from the fit.
    slopes : ndarray, shape (n, p)
        Their derivatives by the fitted quantities.
    groups : ndarray of int, shape (n,)
        Side and branch of each throw, as a number.
    x : ndarray, shape (n,)
        Place before.
    row : ndarray of int, shape (n,)
        Lines of the file.
    """
    drawn = np.random.default_rng(13).standard_normal((DRAWS, residual.size))
    found = _cleared(residual[None], slopes)
    ratio, others = _ratio(found)[0], _ratio(_cleared(drawn, slopes))
    outliers = (1.0 + np.count_nonzero(others >= ratio)) / (1.0 + DRAWS)
    strange = tuple(int(each) for each in row[np.abs(found[0]) > NAMED])
    return Misfit(float(outliers), _structure(residual, slopes, groups, x), strange)


def _cleared(residual: Array, slopes: Array) -> Array:
    """Take off what the quantities can take up, outliers counting little, and divide by the robust scale; (m, n)."""
    weight = np.ones_like(residual)
    left = residual
    for _ in range(ROUNDS):
        normal = np.einsum("mn,np,nq->mpq", weight, slopes, slopes)
        pull = np.einsum("mn,np,mn->mp", weight, slopes, residual)
        left = residual - np.linalg.solve(normal, pull[..., None])[..., 0] @ slopes.T
        size = np.maximum(np.median(np.abs(left), axis=1, keepdims=True) / 0.6744897501960817, NOTHING)
        weight = np.minimum(1.0, BEND * size / np.maximum(np.abs(left), 1e-300))
    scaled: Array = left / size
    return scaled


def _ratio(z: Array) -> Array:
    """Logarithm of the likelihood ratio, the largest over share and width; shape (m,)."""
    ratio = np.full(z.shape[0], -np.inf)
    for wide in WIDER:
        gain = np.exp(np.minimum(0.5 * z**2 * (1.0 - 1.0 / wide**2), 700.0)) / wide
        for (
            share
        ) in SHARES:  # one at a time: all at once hold a Ctrl-C back, and take gigabytes for long films
            ratio = np.maximum(ratio, np.log1p(share * (gain - 1.0)).sum(axis=1))
    return ratio


def _structure(residual: Array, slopes: Array, groups: NDArray[np.int64], x: Array) -> float | None:
    """F test of a parabola in x for each side and branch, beside the slopes; None for too few throws."""
    from scipy.stats import f as f_law

    columns = [slopes]
    for group in np.unique(groups):
        own = groups == group
        if own.sum() >= 6:
            z = np.where(own, (x - x[own].mean()) / max(float(np.ptp(x[own])), 1e-12), 0.0)
            columns.append(np.stack([own.astype(float), z, z**2], axis=1))
    few, many = columns[0], np.concatenate(columns, axis=1)
    ranks = [int(np.linalg.matrix_rank(each)) for each in (few, many)]
    spare, more = residual.size - ranks[1], ranks[1] - ranks[0]
    if more < 1 or spare < 5:
        return None
    sums = [
        float(((residual - each @ np.linalg.lstsq(each, residual)[0]) ** 2).sum()) for each in (few, many)
    ]
    return float(f_law.sf((sums[0] - sums[1]) / more / (sums[1] / spare), more, spare))
