"""Laws of what deviates at every throw, in strata: probabilities, where the density jumps, how it changes between.

docs/certificates.md, "Probabilities", number 20.  The means of a function are computed as if the density were constant
on each stratum, which has its exact probability.  With w the width of the strata and osc the most by which the density
varies on one of them, a mean is then off by at most (osc w/4) times the variation of the function, and by at most
(sum of osc w^2/8) times its largest slope, the density rising or falling on each stratum.
"""

import itertools
import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from flint import arb

from .balls import ZERO, Arb, Array, exact, float_above, prove

SIGMAS = 6  # standard deviations at which a normal law is cut off; the rest may be anything
WIDEST = Fraction(1, 200)  # of a column: derivatives over a wider range of speeds have no sign
HALVES = 2 * SIGMAS * 2  # of a normal law: half a standard deviation each


class Column(NamedTuple):
    """A range of deviations on which the density rises or falls, between two of the law's `ends`, by their numbers.

    The density changes by `change` from the first to the last, has no slope above `steep` and no value above `most`.
    """

    first: int
    last: int
    change: Arb
    steep: float
    most: float


class Law(NamedTuple):
    """A law.

    `ends`: deviations that cut it in parts, exact, the least and the largest among them; a single 0 where nothing
    deviates.  `cuts`, `weights`: finer strata and their probabilities.  `jumps`: the ends at which the density jumps,
    and by how much it rises there.  `most`: the largest density.  `ripple`, `tilt`: how far a mean may be off, as a
    share of the variation and of the largest slope of a function.  `beyond`: the probability of any other deviations.
    `height`: the density at 0; `sigma`: the standard deviation of a normal law.
    """

    ends: tuple[Fraction, ...]
    cuts: Array
    weights: Array
    jumps: tuple[tuple[int, Arb], ...] = ()
    columns: tuple[Column, ...] = ()
    most: float = math.inf
    ripple: float = 0.0
    tilt: float = 0.0
    beyond: float = 0.0
    height: Arb = ZERO
    sigma: Fraction | None = None

    @property
    def certain(self) -> bool:
        """Whether nothing deviates."""
        return len(self.ends) == 1

    @property
    def reach(self) -> Fraction:
        """The largest deviation."""
        return self.ends[-1]

    def density(self, deviation: Arb) -> Arb:
        """Enclose the density at deviations between the ends."""
        if self.sigma is None:
            return self.height
        return self.height * (-((deviation / exact(self.sigma)) ** 2) / 2).exp()


NOTHING = Law((Fraction(0),), np.zeros(1), np.zeros(0))


def uniform_law(bound: Fraction, strata: int) -> Law:
    """Cut the law that is uniform within a bound."""
    if bound == 0:
        return NOTHING
    ends = tuple(bound * (Fraction(2 * j, strata) - 1) for j in range(strata + 1))
    density = exact(1 / (2 * bound))
    most = float_above(density)
    count = min(math.ceil(2 * bound / WIDEST), strata)
    borders = [round(k * strata / count) for k in range(count + 1)]
    columns = [Column(i, j, ZERO, 0.0, most) for i, j in itertools.pairwise(borders)]
    return Law(
        ends,
        np.array([float(end) for end in ends]),
        np.full(strata, 1.0 / strata),
        jumps=((0, density), (strata, -density)),
        columns=tuple(columns),
        most=most,
        height=density,
    )


def normal_law(sigma: Fraction, strata: int, finer: int) -> Law:
    """Cut a normal law, which ends at `SIGMAS`, in so many parts, a multiple of `HALVES`, and these in finer ones."""
    if sigma == 0:
        return NOTHING
    prove(strata % HALVES == 0, f"the strata of a normal law are no multiple of {HALVES}")
    z = [2 * SIGMAS * (Fraction(j, strata) - Fraction(1, 2)) for j in range(strata + 1)]
    fine = [2 * SIGMAS * (Fraction(j, strata * finer) - Fraction(1, 2)) for j in range(strata * finer + 1)]
    whole = 2 * below(Fraction(SIGMAS))
    totals = [below(each) / whole for each in fine]
    weights = [b - a for a, b in itertools.pairwise(totals)]
    scale = 1 / (whole * exact(sigma) * (2 * arb.pi()).sqrt())  # density at 0
    heights = [scale * (-(exact(each) ** 2) / 2).exp() for each in z]
    step = exact(2 * SIGMAS * sigma / (strata * finer))
    # of all slopes of the density that at one standard deviation is the largest
    steepest = scale * (arb(-0.5)).exp() / exact(sigma)
    per, columns = strata // HALVES, []
    for first in range(0, strata, per):
        last = first + per
        near, far = sorted((abs(z[first]), abs(z[last])))
        # the slope |z| exp(-z^2/2) rises up to 1, and falls beyond
        at = exact(min(max(near, Fraction(1)), far))
        steep = at * (-(at**2) / 2).exp() * scale / exact(sigma)
        change, most = heights[last] - heights[first], float_above(heights[first].max(heights[last]))
        columns.append(Column(first, last, change, float_above(steep), most))
    return Law(
        tuple(sigma * each for each in z),
        np.array([float(sigma * each) for each in fine]),
        np.array([float(weight.mid()) for weight in weights]),
        jumps=((0, heights[0]), (strata, -heights[-1])),
        columns=tuple(columns),
        most=float_above(scale),
        ripple=float_above(steepest * step**2 / 4),
        # the density rises up to 0 and falls beyond
        tilt=float_above(scale * step**2 / 4),
        beyond=float_above(1 - whole),
        height=scale,
        sigma=sigma,
    )


def below(z: Fraction) -> Arb:
    """Enclose the probability that a standard normal number lies between 0 and z."""
    return (exact(z) / arb(2).sqrt()).erf() / 2
