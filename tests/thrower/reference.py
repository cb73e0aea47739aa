"""The throw at 50 digits, written from the model's formulas alone: what the kernels are compared with.

Nothing here knows how the kernels work. The impact is found by a scan of the whole turn, not by a march; energies
and landing places are the plain formulas, whose cancellations 50 digits do not feel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from mpmath import mp, mpf

mp.dps = 50

SCAN = np.concatenate((np.geomspace(1e-30, 1e-3, 3000), np.linspace(1e-3, 2.0 * np.pi, 40_000)[1:]))


@dataclass(frozen=True)
class Facts:
    """Keyword arguments of `throw_map`, and the same numbers at 50 digits."""

    numbers: dict[str, Any]

    def __getattr__(self, name: str) -> Any:
        value = self.numbers[name]
        if isinstance(value, str):
            return value
        return mpf(value) if np.ndim(value) == 0 else [mpf(float(entry)) for entry in value]


def height(a: mpf, d: mpf, kappa: mpf, x: mpf, phi: mpf) -> mpf:
    """Left vertex over the arm."""
    return x * phi - a * mp.sin(phi) + d * (1 - mp.cos(phi)) - kappa / 2 * phi**2


def scan(facts: Facts, side: int, x: float) -> np.ndarray:
    """height / phi at the points of SCAN."""
    a, d, kappa = float(facts.a[side]), float(facts.d[side]), float(facts.kappa)
    phi = SCAN
    series = sum((-1) ** k * phi ** (2 * k + 2) / float(mp.factorial(2 * k + 3)) for k in range(6))
    late = np.where(phi < 0.5, series, 1.0 - np.sin(phi) / phi)
    return (x - a) + a * late + d * 2.0 * np.sin(phi / 2) ** 2 / phi - kappa / 2 * phi


def roots_in_turn(facts: Facts, side: int, x: float) -> int:
    """How often the height changes its sign within a full turn."""
    over = scan(facts, side, x) > 0.0
    return int(np.count_nonzero(over[1:] != over[:-1]))


@mp.workdps(50)  # whatever the module imported last has set
def impact(facts: Facts, side: int, x: float) -> mpf | None:
    """Return the smallest positive root within a full turn, None where there is none."""
    a, d, kappa, at = facts.a[side], facts.d[side], facts.kappa, mpf(x)
    if at <= a:
        return None
    if facts.flight != "exact":
        phi = 2 * (at - a) / (kappa - (d if facts.flight == "small-angle-2" else 0))
        return phi if 0 < phi <= 2 * mp.pi else None

    values = scan(facts, side, float(x))
    below = np.flatnonzero(values <= 0.0)
    end = int(below[0]) if below.size else values.size
    # A dip between two points of the scan may touch the arm before that.
    inner = values[1:-1]
    dips = np.flatnonzero((inner < values[:-2]) & (inner <= values[2:]) & (inner < 1e-5)) + 1
    for k in dips[(dips < end) & (SCAN[dips] > 2e-3)]:
        lo, hi = mpf(SCAN[k - 1]), mpf(SCAN[k + 1])
        over = partial(mp.diff, lambda p: height(a, d, kappa, at, p) / p)
        lowest = mp.findroot(over, (lo + hi) / 2)
        if height(a, d, kappa, at, lowest) <= 0:
            return refine(a, d, kappa, at, lo, lowest)
    if end == values.size:
        return None
    return refine(a, d, kappa, at, mpf(SCAN[end - 1]), mpf(SCAN[end]))


def refine(a: mpf, d: mpf, kappa: mpf, x: mpf, lo: mpf, hi: mpf) -> mpf:
    """Return the root of height / phi between lo (above the arm) and hi (below), by bisection and secants."""

    def over(phi: mpf) -> mpf:
        return height(a, d, kappa, x, phi) / phi

    for _ in range(20):
        middle = (lo + hi) / 2
        lo, hi = (middle, hi) if over(middle) > 0 else (lo, middle)
    before, after = lo, hi
    for _ in range(200):
        rise = over(after) - over(before)
        if rise == 0 or abs(after - before) < mpf(10) ** -42 * after:
            break
        before, after = after, after - over(after) * (after - before) / rise
    assert abs(over(after)) < mpf(10) ** -35
    return after


@dataclass(frozen=True)
class Throw:
    """What one throw does."""

    phi: mpf
    omega: mpf
    kinetic: mpf
    potential: mpf
    past: bool  # the centre of mass is left of the vertex
    margin: mpf  # positive: flips
    code: int
    side: int
    x: mpf
    displacement: mpf


def land(facts: Facts, side: int, x: mpf, phi: mpf, flips: bool) -> mpf:
    """Return the centre's place after a throw that meets the arm at phi."""
    a, d, h = facts.a[side], facts.d[side], facts.surface_height
    if facts.flight == "exact":
        vertex = x - (h + d) * phi - a * mp.cos(phi) + d * mp.sin(phi)
    else:
        vertex = x - h * phi - a
    after = (side + 1) % len(facts.a)
    return vertex - (facts.length[after] - facts.a[after]) if flips else vertex + a


@mp.workdps(50)  # whatever the module imported last has set
def throw(facts: Facts, side: int, x: float) -> Throw | None:
    """Throw once; None outside the model."""
    phi = impact(facts, side, x)
    if phi is None:
        return None
    a, d, h, kappa, at = facts.a[side], facts.d[side], facts.surface_height, facts.kappa, mpf(x)
    ell, rho = mp.hypot(a, d), facts.radius_of_gyration
    inertia = rho**2 + ell**2
    if facts.flight == "exact":
        right = a * mp.cos(phi) - d * mp.sin(phi)
        above = a * mp.sin(phi) + d * mp.cos(phi)
        omega = (rho**2 + right * (at - kappa * phi) + above * (h + d)) / inertia
        potential, past = kappa * (ell - above), right < 0
    else:
        omega = (rho**2 - a * at + 2 * a**2 + d**2 + d * h) / inertia
        potential, past = kappa * (ell - d) - 2 * a * (at - a), False
    kinetic = inertia * omega**2 / 2
    if facts.flip == "energy":
        margin = mpf(1) if past else kinetic - potential
    else:
        margin = mp.sign(omega) * kinetic - (-potential if past else potential)
    flips = margin > 0
    side_after = (side + 1) % len(facts.a) if flips else side
    after = land(facts, side, at, phi, flips)
    code = 1 if flips else 0
    if after <= facts.a[side_after]:
        code = -1
    elif after > facts.arm_length:
        code = -2
    return Throw(phi, omega, kinetic, potential, past, margin, code, side_after, after, after - at)


def slope(facts: Facts, side: int, x: float, phi: mpf, flips: bool) -> mpf:
    """Return the derivative of a forced branch, by a difference along the root that was found."""
    a, d, kappa, at, step = facts.a[side], facts.d[side], facts.kappa, mpf(x), mpf(10) ** -18
    ends = []
    for place in (at - step, at + step):
        if facts.flight == "exact":
            near = phi * mpf(10) ** -12
            root = refine(a, d, kappa, place, phi - near, phi + near)
        else:
            root = 2 * (place - a) / (kappa - (d if facts.flight == "small-angle-2" else 0))
        ends.append(land(facts, side, place, root, flips))
    return (ends[1] - ends[0]) / (2 * step)


# The scenes of the paper as this project restates them: a triangle given by its sides, the centre of mass measured
# from the left end of side 2, inches.
PAPER = {
    "initial-small": ("small-angle", "energy", -1.0, 3.2444722, 1.7898493, 85.2549144, 40.0, (20, 20, 20)),
    "designed-small": ("small-angle", "energy", -1.0, 4.4179581, 0.5040259, 48.6228609, 40.0, (10, 10, 20)),
    "initial": ("exact", "signed", -0.2, 3.9867006, 1.8835981, 33.3605945, 28.0, (20, 20, 20)),
    "designed": ("exact", "signed", -0.2, 4.2255778, 0.7082490, 25.3778518, 28.0, (10, 10, 20)),
}


def paper(name: str, **changes: Any) -> Facts:
    """Facts of one of the paper's scenes, by plane geometry."""
    flight, flip, h, along, above, kappa, arm, _ = PAPER[name]
    length = [5.75, 3.6, 6.75]
    # Left end of side 2 at the origin; the third corner is 5.75 from it and 3.6 from the right end.
    right, center = mp.mpc(length[2], 0), mp.mpc(along, above)
    third_x = (mpf(length[0]) ** 2 - mpf(length[1]) ** 2 + mpf(length[2]) ** 2) / (2 * mpf(length[2]))
    third = mp.mpc(third_x, mp.sqrt(mpf(length[0]) ** 2 - third_x**2))
    left_ends = [third, right, mp.mpc(0)]
    right_ends = [mp.mpc(0), third, right]
    a, d, corner = [], [], []
    for k in range(3):
        along_side = (right_ends[k] - left_ends[k]) / abs(right_ends[k] - left_ends[k])
        foot = (center - left_ends[k]) * mp.conj(along_side)
        a.append(float(foot.real))
        d.append(float(foot.imag))
        # The side that ends in this left vertex is the next one in flip order.
        arriving = right_ends[(k + 1) % 3] - left_ends[(k + 1) % 3]
        corner.append(float(mp.arg(along_side / arriving)))
    numbers = {"a": a, "d": d, "length": length, "corner": corner, "radius_of_gyration": 1.25, "kappa": kappa}
    numbers |= {"surface_height": h, "arm_length": arm, "flight": flight, "flip": flip}
    return Facts({**numbers, **changes})
