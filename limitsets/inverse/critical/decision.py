"""The deciding number between jog and flip, on dual numbers (docs/model.md: flight, impact, decision).

The formulas of the impact are those of `thrower.impact`.  The impact angle is found by the kernels, refined here, and
differentiated by the implicit function theorem, d phi = -df / (df/dphi).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.inverse.critical.dual import MultiDual, cosine, sine, square_root
from limitsets.thrower.impact import margin, strike
from limitsets.thrower.params import FLIGHTS, FLIPS
from limitsets.thrower.turn import Turned

# Newton steps on an angle that is right to rounding but for the kernel's last bits.
STEPS = 3
# Below this angle phi - sin phi is summed from its series.
SMALL = 0.5


class SideNumbers(NamedTuple):
    """One side of a part, as `limitsets.inverse.critical.seeded.Seeded` holds it; named as in `params.Side`."""

    a: MultiDual
    d: MultiDual
    rho: MultiDual
    kappa: MultiDual
    h: MultiDual

    @property
    def ell(self) -> MultiDual:
        """Distance of the centre of mass from the left vertex."""
        return square_root(self.a**2 + self.d**2)

    @property
    def rho2(self) -> MultiDual:
        """Squared radius of gyration."""
        return self.rho**2

    @property
    def inertia(self) -> MultiDual:
        """Moment of inertia about the left vertex, per mass."""
        return self.rho2 + self.a**2 + self.d**2


class DecidingNumber(NamedTuple):
    """What decides.

    Parameters
    ----------
    margin : MultiDual
        Positive where the part flips; energies over m w^2 [length^2].
    size : float
        Size of the numbers of which it is the difference.
    steepness : float
        df/dphi at the impact, as a share of its two terms: 0 where the vertex only grazes the arm; -1 at small angles.
    """

    margin: MultiDual
    size: float
    steepness: float


def decided(flight: str, flip: str, part: SideNumbers, x: MultiDual, phi: float) -> DecidingNumber:
    """Evaluate what decides for a throw from x that lands at phi.

    Parameters
    ----------
    flight, flip : str
        The models, in a scene's words.
    part : SideNumbers
        The side it rests on.
    x : MultiDual
        Where it rests [length].
    phi : float
        The impact angle to rounding [rad]; not used at small angles.
    """
    steepness = -1.0
    at = None
    if flight == "exact":
        angle, steepness = _angle(part, x, phi)
        at = Turned(angle, sine(angle), 1.0 - cosine(angle), None)
    omega, barrier = strike(FLIGHTS[flight](), part, x, at)
    decides: MultiDual = margin(FLIPS[flip](), part.inertia, omega, barrier)
    kinetic = 0.5 * part.inertia.value * omega.value**2
    return DecidingNumber(decides, kinetic + abs(barrier.value), steepness)


def _short_of_arc(phi: float) -> float:
    """phi - sin phi, without cancellation."""
    if phi > SMALL:
        return phi - math.sin(phi)
    term, total = phi**3 / 6.0, 0.0
    for k in range(2, 12):
        total += term
        term *= -phi * phi / ((2 * k) * (2 * k + 1))
    return total


def _height(part: SideNumbers, x: MultiDual, phi: float) -> tuple[MultiDual, float, float]:
    """Height of the left vertex over the arm, its derivative by phi, and the size of that one's terms."""
    s, v = math.sin(phi), 2.0 * math.sin(0.5 * phi) ** 2
    reach = x - part.a
    f = reach * phi + part.a * _short_of_arc(phi) + part.d * v - part.kappa * (0.5 * phi * phi)
    up = reach.value + part.a.value * v + part.d.value * s
    down = part.kappa.value * phi
    return f, up - down, abs(up) + down


def _angle(part: SideNumbers, x: MultiDual, phi: float) -> tuple[MultiDual, float]:
    """Return the impact angle with its derivatives, and how steeply the vertex comes down."""
    f, slope, size = _height(part, x, phi)
    for _ in range(STEPS):
        step = f.value / slope if slope < 0.0 else math.inf
        if abs(step) > 1e-6 * phi:  # a grazing impact: Newton would leave
            break
        phi -= step
        f, slope, size = _height(part, x, phi)
    if not slope < 0.0:
        return MultiDual(phi, f.slope * math.nan), 0.0
    return MultiDual(phi, -f.slope / slope), slope / size
