"""The exact throw in ball arithmetic of 60 digits: every root of a turn, proved, and how well each number is posed.

Nothing here knows how the kernels work.  The turn is halved until each piece either holds no zero of the height or
holds one at most, because the slope keeps its sign there: no root can hide, however flat the height grazes the arm.

Condition numbers are those of the data as the kernels receive them: the answer's relative change per relative change
of each term of the formula it comes from.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from flint import arb

# Bits at which everything here is to be computed; a global of flint, so whoever calls sets it for the while.
PRECISION = 320

# Pieces of the turn narrower than this against their place are not halved any more: a touching root, or two within.
NARROWEST = arb(2) ** -120


class Part(NamedTuple):
    """One side of a part on its arm, as floats; `after` is the side that a flip leads to."""

    a: float
    d: float
    kappa: float
    h: float = -0.2
    rho: float = 1.25
    flip: str = "signed"
    length_after: float = 5.0
    a_after: float = 2.0

    def numbers(self, arm_length: float = 1e6) -> dict[str, Any]:
        """Arguments of `throw_map`: a part of three sides, of which side 0 is this one."""
        length = [2.0 * self.a, self.length_after, self.length_after]
        sides = {"a": [self.a, self.a_after, self.a_after], "d": [self.d, 1.0, 1.0], "length": length}
        throw = {"radius_of_gyration": self.rho, "kappa": self.kappa, "surface_height": self.h}
        return {**sides, **throw, "corner": [2.0, 2.0, 2.0], "arm_length": arm_length, "flip": self.flip}


class Root(NamedTuple):
    """A root, or a piece of the turn that may hold two."""

    phi: arb
    simple: bool


class Height:
    """f(phi) of one start and its derivatives."""

    def __init__(self, part: Part, x: float | arb) -> None:
        self.a, self.d, self.kappa = arb(part.a), arb(part.d), arb(part.kappa)
        self.reach = arb(x) - self.a
        self.bend = self.kappa + (self.a**2 + self.d**2).sqrt()

    def terms(self, phi: arb) -> tuple[arb, arb, arb, arb]:
        rise = self.a * (phi - phi.sin()), 2 * self.d * (phi / 2).sin() ** 2
        return (self.reach * phi, *rise, -self.kappa / 2 * phi**2)

    def value(self, phi: arb) -> arb:
        one, two, three, four = self.terms(phi)
        return one + two + three + four

    def slope(self, phi: arb) -> arb:
        return self.reach + 2 * self.a * (phi / 2).sin() ** 2 + self.d * phi.sin() - self.kappa * phi

    def second(self, phi: arb) -> arb:
        return self.a * phi.sin() + self.d * phi.cos() - self.kappa


def _bisected(height: Height, lo: arb, hi: arb) -> arb:
    """Narrow a piece at whose ends the height has two signs and on which it is monotone."""
    rising = height.value(lo) < 0
    for _ in range(30):
        middle = ((lo + hi) / 2).mid()
        value = height.value(middle)
        if value > 0:
            lo, hi = (lo, middle) if rising else (middle, hi)
        elif value < 0:
            lo, hi = (middle, hi) if rising else (lo, middle)
        else:
            break
    phi = ((lo + hi) / 2).mid()
    for _ in range(40):
        step = height.value(phi) / height.slope(phi)
        if abs(step) < phi * arb(2) ** -170:
            return phi
        phi = (phi - step).mid()
    raise ArithmeticError(phi)


def roots(part: Part, x: float | arb, *, first: bool = False) -> list[Root]:
    """All roots of the height within a full turn, ascending; with `first` only the smallest."""
    height = Height(part, x)
    found: list[Root] = []
    # Below this the height over phi is positive: it starts at the reach and falls by no more than bend / 2.
    stack = [((height.reach * 2 / height.bend).lower().mid(), (2 * arb.pi()).upper().mid())]
    if not height.reach > 0 or stack[0][0] > stack[0][1]:
        return found
    while stack:
        lo, hi = stack.pop()
        middle, half = ((lo + hi) / 2).mid(), ((hi - lo) / 2).upper()
        piece = arb(middle, half)
        value, slope, second = height.value(middle), height.slope(middle), height.second(piece)
        if abs(value) > abs(slope) * half + abs(second) * half**2 / 2:
            continue
        if not (slope + second * arb(0, half)).contains(0):
            if height.value(lo) * height.value(hi) < 0:
                found.append(Root(_bisected(height, lo, hi), simple=True))
        elif half < NARROWEST * middle:
            found.append(Root(piece, simple=False))
        else:
            stack += [(middle, hi), (lo, middle)]
        if found and first:
            break
    return found


class Exact(NamedTuple):
    """One throw: each number with its condition."""

    phi: arb
    phi_condition: float
    margin: arb
    flips: bool
    displacement: arb
    displacement_condition: float


def margin_at(part: Part, x: float | arb, phi: arb) -> arb:
    """The number that is positive where the part flips."""
    a, d, kappa, rho = arb(part.a), arb(part.d), arb(part.kappa), arb(part.rho)
    right, above = a * phi.cos() - d * phi.sin(), a * phi.sin() + d * phi.cos()
    ell = (a**2 + d**2).sqrt()
    inertia = rho**2 + ell**2
    omega = (rho**2 + right * (arb(x) - kappa * phi) + above * (arb(part.h) + d)) / inertia
    kinetic, climb = inertia * omega**2 / 2, kappa * (ell - above)
    if part.flip == "energy":
        return kinetic - climb if right > 0 else arb(1)
    return (kinetic if omega > 0 else -kinetic) - (climb if right > 0 else -climb)


def throw(part: Part, x: float) -> Exact | None:
    """Throw once; None without an impact within a full turn."""
    first = roots(part, x, first=True)
    if not first:
        return None
    phi = first[0].phi
    height = Height(part, x)
    spread = sum((abs(term) for term in height.terms(phi)), arb(0))
    # The angle is rounded as well.
    phi_condition = max(1.0, float((spread / abs(height.slope(phi)) / phi).mid()))
    margin = margin_at(part, x, phi)
    flips = bool(margin > 0)
    terms = [
        arb(part.a) * 2 * (phi / 2).sin() ** 2,
        -arb(part.d) * (phi - phi.sin()),
        -arb(part.h) * phi,
        *([-arb(part.a), -arb(part.length_after), arb(part.a_after)] if flips else []),
    ]
    shift = sum(terms, arb(0))
    bend = arb(part.a) * phi.sin() - 2 * arb(part.d) * (phi / 2).sin() ** 2 - arb(part.h)
    moved = sum((abs(term) for term in terms), arb(0)) + abs(bend) * phi * phi_condition
    condition = math.inf if shift.contains(0) else float((moved / abs(shift)).mid())
    return Exact(phi, phi_condition, margin, flips, shift, condition)
