"""What each row is taken for: the side it began on and whether it flipped, which its landing tells, misrecorded or not.

A jog and a flip, and throws from different sides, land inches apart; a recorded side that does not fit where the part
landed is therefore seen, and the throw still counts with the side that fits.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from limitsets.fitting.predicting import Predicted, predicted
from limitsets.fitting.throws import Throws
from limitsets.scene import Scene

# Before the data are seen a side after a throw counts as misrecorded once in fifty readings.  The side before is where
# the part was laid down: wrong much less often, and where a jog from either side would do, right.
MISREAD, MISLAID = 0.02, 0.0004
# Critical points are not yet known: to this share of the arm's length.
CRITICAL = 0.05

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


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
    side: Whole
    branch: Whole
    error: Array
    known: bool

    def told(self, scene: Scene, values: Mapping[str, Array]) -> Predicted:
        """Predict these throws for a scene at m values of its quantities: the places that were read."""
        throws = self.throws
        return predicted(scene, values, throws.x_before, self.side, self.branch, corner=throws.corner)

    def side_after(self, sides: int) -> Whole:
        """Return the side on which each throw ended."""
        return (self.side + self.branch) % sides

    def misread_before(self) -> NDArray[np.bool_]:
        """Where the side before is misrecorded, in a reading of its own."""
        return np.asarray((self.side != self.throws.side_before) & ~self.throws.shared)

    def misread_after(self, sides: int) -> NDArray[np.bool_]:
        """Where the side after is misrecorded."""
        return np.asarray(self.side_after(sides) != self.throws.side_after)

    def misread(self, sides: int) -> tuple[int, int]:
        """Count the misrecorded sides, and all readings of a side."""
        wrong = self.misread_before().sum() + self.misread_after(sides).sum()
        return int(wrong), 2 * len(self.throws) - int(self.throws.shared.sum())


def as_recorded(throws: Throws, error: Array, known: bool, sides: int) -> Rows:
    """Take every row at its word; one that ends on neither of the two sides it could counts as a jog."""
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
        {name: np.array([value]) for name, value in values.items()},
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
        # wrong before and after at once would be a way out for whatever lands where no throw can
        single = (after[:, 0] == throws.side_after[k]) & ~shared[k]
        price = np.where(side == recorded, right, np.where(single, wrong, -np.inf))
        best = int(np.argmax(fits[:, k] + price))
        before[k], own[k] = side[best], branch[best]
    return Rows(throws, before, own, rows.error, rows.known)


def _prices(wrong: float, sides: int) -> tuple[float, float]:
    """Return the logarithms of the probabilities that a side is recorded right, and as one certain other."""
    return math.log1p(-wrong), math.log(wrong / (sides - 1))
