"""Laws as staircases: a density that is constant on strata, and how far the law itself may be from it.

A uniform law is one.  For a normal law the steps have its exact masses, enclosed in rationals, so that of a function V
only its variation within a stratum meets the difference: with osc the change of the density on a stratum of width w,

    | int (p - step) V | = | int (p - step) (V - c) | <= (osc w / 4) (total variation of V there).

What lies beyond six standard deviations is a weight of which nothing is known.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import pairwise
from math import factorial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitsets.errors import AnswerError
from limitsets.proofs.rational import RationalInterval, pi, square_root
from limitsets.robust.noise.laws import Gaussian, Uniform

Array = NDArray[np.float64]

# Standard deviations up to which a normal law is cut into strata.
SIGMAS = 6
# Terms of the series of the normal law: at six standard deviations the first one left out is below 1e-30.
TERMS = 110


@dataclass(frozen=True, eq=False)
class Staircase:
    """A density that is constant on strata.

    Attributes
    ----------
    borders : ndarray, shape (m + 1,)
        Ends of the strata; one number for a law of one value.
    weight : ndarray, shape (m,)
        Probability of each stratum.
    ripple : float
        A mean of V by the staircase differs from that by the law by at most this times the total variation of V.
    cut_ripple : float
        The same for a V that jumps once, times its jump.
    beyond : float
        Probability of deviations outside the strata.
    """

    borders: Array
    weight: Array
    ripple: float = 0.0
    cut_ripple: float = 0.0
    beyond: float = 0.0

    @property
    def certain(self) -> bool:
        """Whether it is the law of one value."""
        return self.borders.size == 1

    @property
    def density(self) -> Array:
        """Density on each stratum."""
        return self.weight / np.diff(self.borders)


def staircase(law: Any, strata: int, name: str) -> Staircase:
    """Cut a law into strata.

    Parameters
    ----------
    law : Uniform, Gaussian or None
        The law; None for a deviation of 0.
    strata : int
        How many; of a normal law a multiple of 12.
    name : str
        What deviates, for the error.

    Raises
    ------
    AnswerError
        Any other law.
    """
    if law is None or (isinstance(law, Uniform) and law.bound == 0.0):
        return Staircase(np.zeros(1), np.ones(1))
    if isinstance(law, Uniform):
        return Staircase(np.linspace(-law.bound, law.bound, strata + 1), np.full(strata, 1.0 / strata))
    if not isinstance(law, Gaussian):
        remedy = "use one of them, or the transfer operator (limitsets robustness), which proves nothing"
        raise AnswerError(f"the law of {name}", law, "Uniform or Gaussian", remedy)
    if law.sigma == 0.0:
        return Staircase(np.zeros(1), np.ones(1))
    a_side = max(strata // (2 * SIGMAS), 1)
    masses, change = _normal(a_side)
    steps = np.arange(-SIGMAS * a_side, SIGMAS * a_side + 1).astype(np.float64)
    borders = law.sigma / a_side * steps
    beyond = float(np.nextafter(float(1 - 2 * sum(mass.lo for mass in masses)), 1.0))
    half = np.array([float(mass) for mass in masses])
    # osc w / 4 with osc in units of 1 / sigma and w of sigma; a jump inside leaves at most half of osc w / 2.
    return Staircase(
        borders, np.concatenate([half[::-1], half]), 0.25 * change / a_side, 0.25 * change / a_side, beyond
    )


@cache
def _normal(a_side: int) -> tuple[list[RationalInterval], float]:
    """Masses of a standard normal law on strata of width 1/a_side from 0 to 6, and the most its density changes."""
    scale = 1 / square_root(2 * pi())
    totals = [
        RationalInterval.of(_half_series(Fraction(j, a_side))) * scale for j in range(SIGMAS * a_side + 1)
    ]
    masses = [RationalInterval(b.lo - a.hi, b.hi - a.lo) for a, b in pairwise(totals)]
    # The slope of the density is largest at 1, exp(-1/2)/sqrt(2 pi) = 0.24197...
    return masses, 0.24198 / a_side


def _half_series(z: Fraction) -> Fraction:
    """Return int_0^z exp(-t^2/2) dt, its series cut off where the terms, falling in turns, are below 1e-30."""
    square = z * z / 2
    total, power = Fraction(0), z
    for k in range(TERMS):
        total += (-1) ** k * power / (factorial(k) * (2 * k + 1))
        power *= square
    return Fraction(round(total * (1 << 120)), 1 << 120)
