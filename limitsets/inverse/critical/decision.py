"""The number that decides between jog and flip, on dual numbers: docs/model.md, flight, impact, decision.

The kernels of `thrower` compute the same on floats, one machine word per number.  Here the impact angle is found by
them, refined, and differentiated by the implicit function theorem, d phi = -df / (df/dphi).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from limitsets.inverse.critical.dual import Dual, cosine, sine, square_root

__all__ = ["Decision", "Part", "decided"]

# Newton steps on an angle that is right to rounding but for the kernel's last bits.
STEPS = 3
# Below this angle phi - sin phi is summed from its series.
SMALL = 0.5


class Part(NamedTuple):
    """One side of a part, as `limitsets.inverse.critical.seeded.Numbers` holds it."""

    a: Dual
    d: Dual
    rho: Dual
    kappa: Dual
    h: Dual


class Decision(NamedTuple):
    """What decides.

    Parameters
    ----------
    margin : Dual
        Positive where the part flips; energies over m w^2 [length^2].
    size : float
        Size of the numbers of which it is the difference.
    steepness : float
        df/dphi at the impact, as a share of its two terms: 0 where the vertex only grazes the arm; -1 at small angles.
    """

    margin: Dual
    size: float
    steepness: float


def decided(flight: str, flip: str, part: Part, x: Dual, phi: float) -> Decision:
    """Evaluate what decides for a throw from x that lands at phi.

    Parameters
    ----------
    flight, flip : str
        The models, in a scene's words.
    part : Part
        The side it rests on.
    x : Dual
        Where it rests [length].
    phi : float
        The impact angle to rounding [rad]; not used at small angles.
    """
    steepness = -1.0
    if flight == "exact":
        angle, steepness = _angle(part, x, phi)
        omega, barrier = _exact(part, x, angle)
    else:
        omega, barrier = _small(part, x)
    inertia = part.rho * part.rho + part.a * part.a + part.d * part.d
    kinetic = inertia * omega * omega / 2.0
    towards = -1.0 if flip == "signed" and omega.value < 0.0 else 1.0
    return Decision(kinetic * towards - barrier, kinetic.value + abs(barrier.value), steepness)


def _short_of_arc(phi: float) -> float:
    """phi - sin phi, without cancellation."""
    if phi > SMALL:
        return phi - math.sin(phi)
    term, total = phi**3 / 6.0, 0.0
    for k in range(2, 12):
        total += term
        term *= -phi * phi / ((2 * k) * (2 * k + 1))
    return total


def _height(part: Part, x: Dual, phi: float) -> tuple[Dual, float, float]:
    """Height of the left vertex over the arm, its derivative by phi, and the size of that one's terms."""
    s, v = math.sin(phi), 2.0 * math.sin(0.5 * phi) ** 2
    reach = x - part.a
    f = reach * phi + part.a * _short_of_arc(phi) + part.d * v - part.kappa * (0.5 * phi * phi)
    up = reach.value + part.a.value * v + part.d.value * s
    down = part.kappa.value * phi
    return f, up - down, abs(up) + down


def _angle(part: Part, x: Dual, phi: float) -> tuple[Dual, float]:
    """Return the impact angle with its derivatives, and how steeply the vertex comes down."""
    f, slope, size = _height(part, x, phi)
    for _ in range(STEPS):
        step = f.value / slope if slope < 0.0 else math.inf
        if abs(step) > 1e-6 * phi:  # a grazing impact: Newton would leave
            break
        phi -= step
        f, slope, size = _height(part, x, phi)
    if not slope < 0.0:
        return Dual(phi, f.slope * math.nan), 0.0
    return Dual(phi, -f.slope / slope), slope / size


def _exact(part: Part, x: Dual, phi: Dual) -> tuple[Dual, Dual]:
    """Rate after the impact, and the energy still to be climbed: negative past the vertex."""
    a, d, kappa = part.a, part.d, part.kappa
    s, c = sine(phi), cosine(phi)
    right, above = a * c - d * s, a * s + d * c
    ell = square_root(a * a + d * d)
    inertia = part.rho * part.rho + a * a + d * d
    omega = (part.rho * part.rho + right * (x - kappa * phi) + above * (part.h + d)) / inertia
    past = -1.0 if right.value < 0.0 else 1.0
    if above.value > 0.0:  # ell - H = X^2 / (ell + H) keeps its digits near the top
        return omega, kappa * (right * right / (ell + above)) * past
    return omega, kappa * (ell - above) * past


def _small(part: Part, x: Dual) -> tuple[Dual, Dual]:
    a, d = part.a, part.d
    rest = part.rho * part.rho + d * d + d * part.h
    omega = (rest - a * (x - a * 2.0)) / (part.rho * part.rho + a * a + d * d)
    ell = square_root(a * a + d * d)
    return omega, part.kappa * (a * a / (ell + d)) - a * (x - a) * 2.0
